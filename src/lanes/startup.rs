//! A look at the CPU before the first compiled instruction of this program.
//!
//! A build for a newer CPU than it meets dies on an illegal instruction, possibly before `main`: the compiler may use
//! wide vectors anywhere, in the runtime's start-up too. So on Linux the check is a constructor made of nothing but
//! old instructions: it compares CPUID with what was compiled in, writes one line and exits with 2.
#![allow(unsafe_code, reason = "CPUID and system calls before the runtime exists have no safe form")]

/// Bit masks of the features compiled in: CPUID leaf 1 `ecx`, leaf 7 `ebx`, leaf 7 `ecx`.
const fn required() -> [u32; 3] {
    macro_rules! mask {
        ($($feature:literal $bit:literal),*) => { 0 $(| (cfg!(target_feature = $feature) as u32) << $bit)* };
    }
    [
        mask!("sse3" 0, "ssse3" 9, "fma" 12, "sse4.1" 19, "sse4.2" 20, "movbe" 22, "popcnt" 23, "avx" 28, "f16c" 29),
        mask!("bmi1" 3, "avx2" 5, "bmi2" 8, "avx512f" 16, "avx512dq" 17, "avx512cd" 28, "avx512bw" 30, "avx512vl" 31),
        mask!("avx512vbmi" 1, "avx512vbmi2" 6, "gfni" 8, "vaes" 9, "vpclmulqdq" 10, "avx512vnni" 11,
              "avx512bitalg" 12, "avx512vpopcntdq" 14),
    ]
}

const MESSAGE: &[u8] = b"error: this binary was compiled for a CPU with wider vectors than this one has; \
build it on this machine, or with --config 'build.rustflags=[\"-C\",\"target-cpu=x86-64-v2\"]'\n";

#[used]
#[unsafe(link_section = ".init_array")]
// SAFETY: the section holds pointers to `extern "C"` functions, which the loader calls once before `main`; this one
// takes no argument and returns none.
static CHECK: extern "C" fn() = check;

extern "C" fn check() {
    const REQUIRED: [u32; 3] = required();
    // SAFETY: `cpuid` exists on every x86-64; `rbx`, which it overwrites and LLVM reserves, is put back; the other
    // registers and the flags are declared as clobbered. Where a feature is missing, `write` reads a static string
    // of the given length and `exit_group` does not return.
    unsafe {
        core::arch::asm!(
            "mov r8, rbx",
            "xor eax, eax",
            "cpuid",
            "mov r9d, eax",
            "mov eax, 1",
            "xor ecx, ecx",
            "cpuid",
            "and ecx, {leaf1_ecx}",
            "cmp ecx, {leaf1_ecx}",
            "jne 2f",
            "mov eax, {leaf7_ebx}",
            "or eax, {leaf7_ecx}",
            "test eax, eax",
            "jz 3f",
            "cmp r9d, 7",
            "jb 2f",
            "mov eax, 7",
            "xor ecx, ecx",
            "cpuid",
            "and ebx, {leaf7_ebx}",
            "cmp ebx, {leaf7_ebx}",
            "jne 2f",
            "and ecx, {leaf7_ecx}",
            "cmp ecx, {leaf7_ecx}",
            "je 3f",
            "2:",
            "mov eax, 1",
            "mov edi, 2",
            "lea rsi, [rip + {message}]",
            "mov edx, {length}",
            "syscall",
            "mov eax, 231",
            "mov edi, 2",
            "syscall",
            "3:",
            "mov rbx, r8",
            leaf1_ecx = const REQUIRED[0],
            leaf7_ebx = const REQUIRED[1],
            leaf7_ecx = const REQUIRED[2],
            message = sym MESSAGE_BYTES,
            length = const MESSAGE.len(),
            out("rax") _, out("rcx") _, out("rdx") _, out("rsi") _, out("rdi") _,
            out("r8") _, out("r9") _, out("r11") _,
        );
    }
}

static MESSAGE_BYTES: [u8; MESSAGE.len()] = {
    let mut bytes = [0; MESSAGE.len()];
    let mut i = 0;
    while i < bytes.len() {
        bytes[i] = MESSAGE[i];
        i += 1;
    }
    bytes
};

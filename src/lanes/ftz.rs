//! Flush-to-zero and denormals-are-zero, set for a scope and put back.
//!
//! Embree's manual asks for both; without them a denormal costs some 150 cycles on many CPUs, and a comparison where
//! only one side pays that is not fair. The flags belong to the thread, so each tracing thread sets its own.
#![allow(unsafe_code, reason = "the control register is reached by two instructions no safe function offers")]

use std::marker::PhantomData;

#[cfg(target_arch = "aarch64")]
type Control = u64;
#[cfg(not(target_arch = "aarch64"))]
type Control = u32;

/// MXCSR bits 15 (results flushed to zero) and 6 (operands read as zero).
#[cfg(target_arch = "x86_64")]
const FLUSH: Control = 1 << 15 | 1 << 6;
/// FPCR bit 24: both.
#[cfg(target_arch = "aarch64")]
const FLUSH: Control = 1 << 24;
/// No such flag.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
const FLUSH: Control = 0;

/// While this lives, the thread that made it treats denormal numbers as zero; dropping it restores what was before.
/// Does nothing on machines without such flags.
#[derive(Debug)]
pub struct FlushDenormals {
    before: Control,
    /// The flags are the thread's own: the guard must not leave it.
    _stays: PhantomData<*const ()>,
}

impl FlushDenormals {
    /// Sets the flags of this thread.
    #[must_use]
    pub fn new() -> Self {
        let before = read();
        write(before | FLUSH);
        Self { before, _stays: PhantomData }
    }
}

impl Default for FlushDenormals {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for FlushDenormals {
    fn drop(&mut self) {
        write(self.before);
    }
}

#[cfg(target_arch = "x86_64")]
fn read() -> Control {
    let mut control: Control = 0;
    // SAFETY: `stmxcsr` stores four bytes to the address of a live `u32` and changes nothing else.
    unsafe {
        std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack, preserves_flags));
    }
    control
}

/// Writes the thread's control register; callers pass what [`read`] gave, with or without [`FLUSH`].
#[cfg(target_arch = "x86_64")]
fn write(control: Control) {
    // SAFETY: `ldmxcsr` reads four bytes of a live `u32`. Reserved bits are as they were read, so it cannot fault;
    // rounding mode and exception masks stay. Rust lets the compiler assume the default treatment of denormals: it may
    // fold a constant denormal or keep an operation on the other side of this point, which can turn a denormal result
    // into zero or back. No memory safety hangs on a float, and the hits are checked under the same flags as they are
    // timed under.
    unsafe {
        std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const control, options(nostack, readonly, preserves_flags));
    }
}

#[cfg(target_arch = "aarch64")]
fn read() -> Control {
    let control: Control;
    // SAFETY: reading FPCR is allowed in user mode and has no side effect.
    unsafe {
        std::arch::asm!("mrs {}, fpcr", out(reg) control, options(nomem, nostack, preserves_flags));
    }
    control
}

/// Writes the thread's control register; callers pass what [`read`] gave, with or without [`FLUSH`].
#[cfg(target_arch = "aarch64")]
fn write(control: Control) {
    // SAFETY: all bits but FZ are as they were read. What the compiler may assume about denormals, and why that is
    // harmless here, is said at the x86 twin.
    unsafe {
        std::arch::asm!("msr fpcr, {}", in(reg) control, options(nostack, preserves_flags));
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn read() -> Control {
    0
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn write(_control: Control) {}

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use super::*;
    use std::hint::black_box;

    /// Half the smallest normal number is denormal: exact outside, zero inside, also when read.
    #[test]
    fn denormals_vanish_inside_and_return_outside() {
        let half = || black_box(f32::MIN_POSITIVE) * black_box(0.5);
        let read_back = || black_box(f32::from_bits(1)) * black_box(f32::MAX);
        assert!(half() > 0.0 && read_back() > 0.0);
        {
            let _outer = FlushDenormals::new();
            drop(FlushDenormals::new());
            assert_eq!((half().to_bits(), read_back().to_bits()), (0, 0));
        }
        assert!(half() > 0.0 && read_back() > 0.0);
    }
}

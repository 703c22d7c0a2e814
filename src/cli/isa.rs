//! Does the CPU have what the binary was compiled for? Asked before anything else runs.
//!
//! `is_x86_feature_detected!` cannot answer: it folds to `true` for features that are compiled in. So CPUID is read
//! directly.

/// An instruction-set extension.
#[derive(Clone, Copy, Debug)]
struct Feature {
    /// Its name for `target-feature`.
    name: &'static str,
    /// The build may use it.
    compiled: bool,
    /// The CPU has it.
    present: bool,
}

/// One line about what the CPU lacks, or `None` if the binary can run.
pub fn missing() -> Option<String> {
    lacking(&features())
}

/// One line about wide vectors that the CPU has and the build does not use, if there are any.
pub fn hint() -> Option<String> {
    unused(&features())
}

fn lacking(features: &[Feature]) -> Option<String> {
    let names = names(features, |f| f.compiled && !f.present);
    (!names.is_empty()).then(|| {
        format!(
            "this binary was compiled for {}, which this CPU lacks; build it on this machine, or with \
             --config 'build.rustflags=[\"-C\",\"target-cpu=x86-64-v2\"]'",
            names.join(", ")
        )
    })
}

fn unused(features: &[Feature]) -> Option<String> {
    let wide = ["avx2", "avx512f"];
    let names = names(features, |f| f.present && !f.compiled && wide.contains(&f.name));
    (!names.is_empty()).then(|| {
        format!(
            "hint: this CPU has {}, which this binary was not compiled for; target-cpu=native makes it faster",
            names.join(", ")
        )
    })
}

fn names(features: &[Feature], wanted: impl Fn(&Feature) -> bool) -> Vec<&'static str> {
    features.iter().filter(|f| wanted(f)).map(|f| f.name).collect()
}

#[cfg(target_arch = "x86_64")]
fn features() -> Vec<Feature> {
    let cpu = raw_cpuid::CpuId::new();
    let (basic, more, amd) =
        (cpu.get_feature_info(), cpu.get_extended_feature_info(), cpu.get_extended_processor_and_feature_identifiers());
    macro_rules! list {
        ($($name:tt $leaf:ident $has:ident),* $(,)?) => {
            vec![$(Feature {
                name: $name,
                compiled: cfg!(target_feature = $name),
                present: $leaf.as_ref().is_some_and(|leaf| leaf.$has()),
            }),*]
        };
    }
    list![
        "sse3" basic has_sse3,
        "ssse3" basic has_ssse3,
        "sse4.1" basic has_sse41,
        "sse4.2" basic has_sse42,
        "popcnt" basic has_popcnt,
        "movbe" basic has_movbe,
        "pclmulqdq" basic has_pclmulqdq,
        "f16c" basic has_f16c,
        "avx" basic has_avx,
        "fma" basic has_fma,
        "lzcnt" amd has_lzcnt,
        "bmi1" more has_bmi1,
        "bmi2" more has_bmi2,
        "avx2" more has_avx2,
        "gfni" more has_gfni,
        "vpclmulqdq" more has_vpclmulqdq,
        "avx512f" more has_avx512f,
        "avx512cd" more has_avx512cd,
        "avx512bw" more has_avx512bw,
        "avx512dq" more has_avx512dq,
        "avx512vl" more has_avx512vl,
        "avx512ifma" more has_avx512_ifma,
        "avx512vbmi" more has_avx512vbmi,
        "avx512vbmi2" more has_avx512vbmi2,
        "avx512vnni" more has_avx512vnni,
        "avx512bitalg" more has_avx512bitalg,
        "avx512vpopcntdq" more has_avx512vpopcntdq,
    ]
}

/// Other machines have no CPUID; their binaries are built for a baseline that every CPU has.
#[cfg(not(target_arch = "x86_64"))]
fn features() -> Vec<Feature> {
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feature(name: &'static str, compiled: bool, present: bool) -> Feature {
        Feature { name, compiled, present }
    }

    #[test]
    fn names_what_is_missing_in_one_line() {
        let features = [feature("avx2", true, true), feature("avx512f", true, false), feature("fma", false, false)];
        let line = lacking(&features).unwrap();
        assert!(line.contains("compiled for avx512f,") && !line.contains("fma") && !line.contains('\n'), "{line}");
        assert_eq!(unused(&features), None);
    }

    #[test]
    fn hints_at_unused_width() {
        let line = unused(&[feature("avx2", true, true), feature("avx512f", false, true)]).unwrap();
        assert!(line.contains("has avx512f,"), "{line}");
        assert_eq!(unused(&[feature("popcnt", false, true)]), None);
    }

    /// The tests run, so the CPU has everything they were compiled with.
    #[test]
    fn this_machine_runs_this_binary() {
        assert_eq!(missing(), None);
        if cfg!(target_arch = "x86_64") {
            assert!(features().iter().any(|f| f.name == "sse3"));
        }
    }
}

//! What instruction set this build was compiled for (`wide` decides at compile time).

/// Instruction-set features compiled in that a CPU may lack, by their usual names.
pub const fn compiled_features() -> &'static [&'static str] {
    &[
        #[cfg(target_feature = "sse4.2")]
        "sse4.2",
        #[cfg(target_feature = "avx")]
        "avx",
        #[cfg(target_feature = "fma")]
        "fma",
        #[cfg(target_feature = "avx2")]
        "avx2",
        #[cfg(target_feature = "bmi2")]
        "bmi2",
        #[cfg(target_feature = "avx512f")]
        "avx512f",
        #[cfg(target_feature = "avx512bw")]
        "avx512bw",
        #[cfg(target_feature = "avx512dq")]
        "avx512dq",
        #[cfg(target_feature = "avx512vl")]
        "avx512vl",
    ]
}

/// Name of the vector instruction set the kernels use: `avx512`, `avx2`, `avx`, `sse2`, `neon`, `simd128` or
/// `scalar`.
pub const fn compiled_isa() -> &'static str {
    if cfg!(target_feature = "avx512f") {
        "avx512"
    } else if cfg!(all(target_feature = "avx2", target_feature = "fma")) {
        "avx2"
    } else if cfg!(target_feature = "avx") {
        "avx"
    } else if cfg!(target_feature = "sse2") {
        "sse2"
    } else if cfg!(target_feature = "neon") {
        "neon"
    } else if cfg!(target_feature = "simd128") {
        "simd128"
    } else {
        "scalar"
    }
}

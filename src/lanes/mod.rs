//! (being built)
/// A scalar the engines compute in: `f32` or `f64`.
pub trait Real: Copy + Send + Sync + PartialOrd + std::fmt::Debug + 'static {
    /// From f64, rounded to nearest.
    fn from_f64(x: f64) -> Self;
    /// To f64, exact.
    fn to_f64(self) -> f64;
}
impl Real for f32 {
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}
impl Real for f64 {
    fn from_f64(x: f64) -> Self {
        x
    }
    fn to_f64(self) -> f64 {
        self
    }
}

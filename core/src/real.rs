use nalgebra::RealField;

/// The scalar that every formula is generic over: `f32` on all targets, `f64` in tests and for long logs.
///
/// Elementary functions are nalgebra's [`RealField`], which this workspace routes to `libm` on every target
/// (feature `libm-force`): the platform's own would differ in the last bits. Kernels that are written for
/// `f32` alone call `libm::sqrtf` and its kind by name for the same reason.
pub trait Real: RealField + Copy + Default {
    /// The scalar nearest to a literal.
    fn lit(value: f64) -> Self;
    /// The value as `f64`, exactly.
    fn to_f64(self) -> f64;
}

impl Real for f32 {
    fn lit(value: f64) -> Self {
        value as f32
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    fn lit(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
}

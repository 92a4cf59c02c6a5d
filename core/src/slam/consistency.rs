//! How honest the covariance is: the normalised error against a known truth.
//!
//! The error is measured in the filter's own tangent space. With a = θ̂ − θ wrapped,
//!
//! ```text
//! e = ((V(a)⁻¹ + a J)(p̂ − p), a),     NEES = eᵀ P_rr⁻¹ e      ~ χ²(3) when the filter is consistent
//! ```
//!
//! for the invariant filter, and e = (p̂ − p, a) for the others.
use crate::Real;
use crate::geometry::{Pose, wrap_angle};
use crate::slam::filter::{Filter, Variant};
use crate::slam::landmark::Landmark;
use crate::slam::models::arc_rotation;
use nalgebra::{Matrix2, Vector3};

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// The pose's error (x, y, heading) against the truth, in the tangent space of the filter's covariance.
    pub fn pose_error(&self, truth: &Pose<T>) -> Vector3<T> {
        let pose = self.pose();
        let turn = wrap_angle(pose.heading - truth.heading);
        let offset = pose.position() - truth.position();
        let (zero, one) = (T::zero(), T::one());
        let position = match self.config.variant {
            Variant::Invariant => {
                let tangent = arc_rotation(turn).try_inverse().unwrap_or_else(Matrix2::identity);
                (tangent + Matrix2::new(zero, -one, one, zero) * turn) * offset
            }
            Variant::Textbook | Variant::FirstEstimates => offset,
        };
        Vector3::new(position.x, position.y, turn)
    }

    /// The normalised squared error of the pose, 3 on average when the filter is consistent. `None` when the
    /// covariance is not positive definite.
    pub fn pose_nees(&self, truth: &Pose<T>) -> Option<T> {
        let error = self.pose_error(truth);
        let root = self.pose_covariance().cholesky()?;
        let whitened = root.l().solve_lower_triangular(&error)?;
        Some(whitened.norm_squared())
    }
}

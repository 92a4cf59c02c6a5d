//! The prediction: (8), (12), and its share of the mount's and the wheels' errors where the camera measured the step.
use super::{Covariance, Filter, ROBOT, Variant};
use crate::slam::covariance::{factored, packed};
use crate::slam::landmark::Landmark;
use crate::slam::models::Increment;
use crate::{Error, Real, Result};
use nalgebra::{Matrix3, Matrix3x4, Vector2};

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// Predicts the robot's motion up to `time` seconds: (8), (12). O(n).
    ///
    /// # Errors
    /// [`Error::TimeBackwards`]; [`Error::OutOfRange`] for a number that is not finite or a negative variance.
    pub fn predict(&mut self, time: f64, increment: &Increment<T>) -> Result<()> {
        self.check_time(time)?;
        increment.check()?;
        let (variant, form, first) = (self.config.variant, self.config.covariance, self.first_pose);
        let pose = self.pose();
        let rotation = pose.rotation();
        let shift = rotation * increment.delta.xy();
        let mut parts = self.parts();
        for (index, step) in [shift.x, shift.y, increment.delta.z].into_iter().enumerate() {
            parts.add(index, step);
        }
        parts.wrap_heading();
        let [x, y, heading] = parts.robot();
        let lever = match variant {
            Variant::FirstEstimates => Vector2::new(x - first[0], y - first[1]),
            Variant::Invariant | Variant::Textbook => shift,
        };
        let turn = rotation.to_homogeneous();
        let noise = turn * increment.covariance * turn.transpose();
        match form {
            Covariance::Packed => packed::predict(&mut parts.p, [-lever.y, lever.x], &noise),
            Covariance::Factored => factored::predict(&mut parts.p, [-lever.y, lever.x], &noise),
        }
        self.first_pose = [x, y, heading];
        self.time = time;
        Ok(())
    }

    /// As [`predict`](Self::predict), of a step that the camera measured, alone or beside the wheels: `by_mount` is its derivative
    /// with respect to the mount's height, tilt, roll and yaw, `by_wheels` that with respect to the wheels' errors
    /// ([`driven`](Self::driven)). Where these errors are states, the robot's rows get their share of them;
    /// elsewhere this is [`predict`](Self::predict).
    ///
    /// # Errors
    /// As [`predict`](Self::predict).
    pub fn predict_seen(
        &mut self,
        time: f64,
        increment: &Increment<T>,
        by_mount: &Matrix3x4<T>,
        by_wheels: &Matrix3<T>,
    ) -> Result<()> {
        let finite = |part: &[T]| part.iter().all(|value| value.is_finite());
        if !(finite(by_mount.as_slice()) && finite(by_wheels.as_slice())) {
            let expected = "finite";
            return Err(Error::OutOfRange { name: "by_mount", value: f64::NAN, expected });
        }
        let turn = self.pose().rotation().to_homogeneous();
        self.predict(time, increment)?;
        if self.config.mount_std.is_some() {
            let (form, by_mount) = (self.config.covariance, turn * by_mount);
            let mut p = self.parts().p;
            match form {
                Covariance::Packed => packed::predict_shared(&mut p, ROBOT, &by_mount),
                Covariance::Factored => factored::predict_shared(&mut p, ROBOT, &by_mount),
            }
        }
        self.predict_by_wheels(&(turn * by_wheels), increment.delta.xy().norm());
        Ok(())
    }
}

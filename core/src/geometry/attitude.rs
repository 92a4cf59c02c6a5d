//! A robot that leans: where its pixels would lie if it stood level.
//!
//! ```text
//! d_level = R_y(pitch) R_x(roll) d         a direction in the robot's axes: x ahead, y to the left, z up
//! ```
use super::RangeFinder;
use crate::Real;
use nalgebra::{Vector2, Vector3};

impl<T: Real> RangeFinder<T> {
    /// Where a pixel would lie if the robot stood level, which leans by `pitch` about its y axis (nose down is positive) and
    /// then by `roll` about its own x axis (left side up is positive), rad, as ROS has them (REP 103). It is turned about the lens.
    ///
    /// `None` where there is no such pixel.
    pub fn levelled(&self, pixel: Vector2<T>, pitch: T, roll: T) -> Option<Vector2<T>> {
        let ((sp, cp), (sr, cr)) = (pitch.sin_cos(), roll.sin_cos());
        let direction = self.robot_from_cam() * self.camera().ray_from_pixel(pixel)?.push(T::one());
        let [x, y, z] =
            [direction.x, direction.y * cr - direction.z * sr, direction.y * sr + direction.z * cr];
        self.pixel_from_direction(&Vector3::new(x * cp + z * sp, y, z * cp - x * sp)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Camera, Mount};

    fn finder(tilt: f64, roll: f64) -> RangeFinder<f64> {
        let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        RangeFinder::new(camera, Mount::new([0.4, tilt, roll, 0.0, 0.0, 0.0]).unwrap())
    }

    #[test]
    fn a_robot_that_pitches_sees_what_a_camera_tilted_further_sees() {
        let (level, leaning) = (finder(0.2, 0.01), finder(0.23, 0.01));
        let pixel = Vector2::new(90.0, 150.0);
        let range = leaning.sight(pixel).unwrap().range;
        let levelled = level.levelled(pixel, 0.03, 0.0).unwrap();
        assert!((level.sight(levelled).unwrap().range - range).abs() < 1e-9, "{levelled}");
        assert!((level.sight(pixel).unwrap().range - range).abs() > 0.1);
    }

    #[test]
    fn a_robot_that_rolls_sees_what_a_camera_rolled_further_sees() {
        // With a camera that looks straight ahead the axes are one.
        let (level, leaning) = (finder(0.0, 0.01), finder(0.0, 0.04));
        let pixel = Vector2::new(90.0, 190.0);
        let range = leaning.sight(pixel).unwrap().range;
        let levelled = level.levelled(pixel, 0.0, 0.03).unwrap();
        assert!((level.sight(levelled).unwrap().range - range).abs() < 1e-9, "{levelled}");
    }

    #[test]
    fn a_level_robot_sees_what_it_sees() {
        let pixel = Vector2::new(90.0, 190.0);
        assert!((finder(0.2, 0.01).levelled(pixel, 0.0, 0.0).unwrap() - pixel).norm() < 1e-9);
    }
}

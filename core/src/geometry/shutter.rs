//! A rolling shutter: the rows of a picture are exposed one after the other, while the robot drives on.
//!
//! ```text
//! τ = (v/(H − 1) − ½) T                    of row v of H, against the middle row; T from the first row to the last
//! p_middle = (v_robot τ, 0) + R(ω τ) p     a point of the floor, in the robot's axes
//! d_middle = R(ω τ) d                      a direction above the floor
//! ```
use super::{Pose, RangeFinder};
use crate::Real;
use nalgebra::{Vector2, Vector3};

impl<T: Real> RangeFinder<T> {
    /// Where a pixel would lie had its row been exposed with the middle one: of a robot that drives with `velocity` (m/s, rad/s), and a
    /// shutter that takes `readout` seconds from the first row to the last. What is below the horizon is taken to be on the floor.
    ///
    /// `None` where there is no such pixel.
    pub fn with_middle_row(&self, pixel: Vector2<T>, readout: T, velocity: Vector2<T>) -> Option<Vector2<T>> {
        let rows = T::lit(self.camera().height() as f64) - T::one();
        let later = (pixel.y / rows - T::lit(0.5)) * readout;
        let middle_from_row = Pose::new(velocity.x * later, T::zero(), velocity.y * later);
        if let Ok(point) = self.floor_from_pixel(pixel) {
            return self.pixel_from_floor_unbounded(middle_from_row.transform(point)).ok();
        }
        let direction = self.robot_from_cam() * self.camera().ray_from_pixel(pixel)?.push(T::one());
        let turned = middle_from_row.rotation() * direction.xy();
        self.pixel_from_direction(&Vector3::new(turned.x, turned.y, direction.z)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Camera, Mount};

    #[test]
    fn a_point_of_the_floor_comes_to_where_the_middle_row_sees_it() {
        let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.1, 0.0]).unwrap());
        let (readout, velocity) = (0.033, Vector2::new(0.5, 0.7));
        // Seen by the row that is exposed when it is seen there.
        let point = Vector2::new(1.4, 0.3);
        let truth = finder.pixel_from_floor(point).unwrap();
        let mut pixel = truth;
        for _ in 0..20 {
            let later = (pixel.y / 239.0 - 0.5) * readout;
            let robot = Pose::new(velocity.x * later, 0.0, velocity.y * later);
            pixel = finder.pixel_from_floor(robot.inverse_transform(point)).unwrap();
        }
        assert!((pixel - truth).norm() > 1.0, "{pixel}");
        let found = finder.with_middle_row(pixel, readout, velocity).unwrap();
        assert!((found - truth).norm() < 1e-9, "{found} should be {truth}");
        // Above the horizon it is turned alone, and the middle row stays.
        let above: Vector2<f64> =
            finder.with_middle_row(Vector2::new(100.0, 10.0), readout, velocity).unwrap();
        let turned = -velocity.y * (10.0 / 239.0 - 0.5) * readout * 365.0;
        assert!((above.x - 100.0 - turned).abs() < 1.0 && (above.y - 10.0).abs() < 0.5, "{above}");
        let middle = finder.with_middle_row(Vector2::new(100.0, 119.5), readout, velocity).unwrap();
        assert!((middle - Vector2::new(100.0, 119.5)).norm() < 1e-9);
    }
}

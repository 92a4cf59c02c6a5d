//! A tape measure on the floor.
//!
//! With d = p₁ − p₀, both in the robot's frame, the distance |d| changes with a pixel by nᵀ ∂pᵢ/∂pixelᵢ and with
//! the mount by nᵀ (∂p₁/∂mount − ∂p₀/∂mount), n = d/|d|. The mount's error is common to both ends, which is why
//! a short stretch far away is known better than either of its ends.
use monorange_core::geometry::{Sighting, range_bearing_by_floor};
use nalgebra::{Matrix2, RowVector2, SMatrix};

/// The distance between two floor points and its standard deviation, both in metres.
pub fn measure(
    from: &Sighting<f32>,
    to: &Sighting<f32>,
    pixel_covariance: &Matrix2<f32>,
    mount_std: &[f32; 6],
) -> (f32, f32) {
    let offset = to.point_in_robot - from.point_in_robot;
    let distance = offset.norm();
    if distance == 0.0 {
        return (0.0, 0.0);
    }
    let direction = RowVector2::new(offset.x, offset.y) / distance;
    let mut variance = 0.0;
    let mut by_mount = SMatrix::<f32, 1, 6>::zeros();
    for (end, sign) in [(from, -1.0), (to, 1.0)] {
        let Some(floor_by_polar) = range_bearing_by_floor(end.point_in_robot, end.range).try_inverse() else {
            continue;
        };
        let by_end = direction * floor_by_polar * sign;
        let by_pixel = by_end * end.by_pixel;
        variance += (by_pixel * pixel_covariance * by_pixel.transpose()).x;
        by_mount += by_end * end.by_mount;
    }
    for (slope, std) in by_mount.iter().zip(mount_std) {
        variance += slope * slope * std * std;
    }
    (distance, libm::sqrtf(variance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorange_core::geometry::{Camera, Mount, RangeFinder};
    use nalgebra::Vector2;

    fn finder(mount: [f32; 6]) -> RangeFinder<f32> {
        let camera = Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default()).unwrap();
        RangeFinder::new(camera, Mount::new(mount).unwrap())
    }

    #[test]
    fn turning_the_mount_changes_no_distance() {
        let finder = finder([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]);
        let [a, b] = [(100.0, 200.0), (220.0, 150.0)].map(|(u, v)| finder.sight(Vector2::new(u, v)).unwrap());
        let (_, by_yaw) = measure(&a, &b, &Matrix2::zeros(), &[0.0, 0.0, 0.0, 0.1, 0.1, 0.1]);
        assert!(by_yaw < 1e-5, "{by_yaw}");
        let (distance, by_height) = measure(&a, &b, &Matrix2::zeros(), &[0.04, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!((by_height - 0.1 * distance).abs() < 1e-5, "height scales every distance: {by_height}");
    }

    #[test]
    fn pixel_noise_matches_central_differences() {
        let finder = finder([0.4, 0.2, 0.05, 0.1, 0.0, 0.0]);
        let ends = [Vector2::new(100.0, 200.0), Vector2::new(220.0, 180.0)];
        let distance = |ends: [Vector2<f32>; 2]| {
            let [a, b] = ends.map(|pixel| finder.sight(pixel).unwrap());
            measure(&a, &b, &Matrix2::identity(), &[0.0; 6])
        };
        let mut variance = 0.0;
        for end in 0..2 {
            for axis in 0..2 {
                let [mut more, mut less] = [ends; 2];
                more[end][axis] += 0.5;
                less[end][axis] -= 0.5;
                let slope = distance(more).0 - distance(less).0;
                variance += slope * slope;
            }
        }
        let std = distance(ends).1;
        assert!((std - variance.sqrt()).abs() < 0.02 * std, "{std} {}", variance.sqrt());
    }
}

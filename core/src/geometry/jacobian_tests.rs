//! Every analytic Jacobian of the geometry against central differences, at random rigs and pixels.
use super::{Camera, Distortion, MOUNT_PARAMETERS, Mount, RangeFinder, Ranged};
use nalgebra::Vector2;
use proptest::prelude::*;

fn rig(mount: [f64; 6], lens: [f64; 5], skew: f64) -> RangeFinder<f64> {
    let [k1, k2, p1, p2, k3] = lens;
    let lens = Distortion { k1, k2, p1, p2, k3 };
    let camera = Camera::new(320, 240, [365.0, 361.0], [146.0, 114.0], skew, lens).unwrap();
    RangeFinder::new(camera, Mount::new(mount).unwrap())
}

fn range_bearing(finder: &RangeFinder<f64>, pixel: Vector2<f64>) -> Vector2<f64> {
    let seen = finder.sight(pixel).unwrap();
    Vector2::new(seen.range, seen.bearing)
}

prop_compose! {
    fn mounts()(h in 0.1..2.0, tilt in 0.25..0.6, roll in -0.2..0.2, yaw in -0.5..0.5, fwd in -0.3..0.3, left in -0.3..0.3)
        -> [f64; 6] { [h, tilt, roll, yaw, fwd, left] }
}
prop_compose! {
    fn lenses()(k1 in -0.25..0.1, k2 in 0.0..0.3, p1 in -0.006..0.006, p2 in -0.006..0.006, k3 in 0.0..0.05)
        -> [f64; 5] { [k1, k2, p1, p2, k3] }
}

proptest! {
    #[test]
    fn sighting_jacobians_match_central_differences(
        mount in mounts(), lens in lenses(), skew in -0.02..0.02, u in 20.0..300.0, v in 150.0..230.0,
    ) {
        let (pixel, finder) = (Vector2::new(u, v), rig(mount, lens, skew));
        let Ok(seen) = finder.sight(pixel) else { return Ok(()) };
        prop_assume!(seen.range < 20.0 && seen.point_in_robot.x > 0.1);
        let close = |analytic: f64, numeric: f64| (analytic - numeric).abs() <= 1e-6 * (1.0 + numeric.abs());
        for axis in 0..2 {
            let mut step = Vector2::zeros();
            step[axis] = 1e-4;
            let slope = (range_bearing(&finder, pixel + step) - range_bearing(&finder, pixel - step)) / 2e-4;
            for row in 0..2 {
                prop_assert!(close(seen.by_pixel[(row, axis)], slope[row]), "pixel axis {axis}, row {row}");
            }
        }
        for (index, name) in MOUNT_PARAMETERS.into_iter().enumerate() {
            let moved = |by: f64| {
                let mut mount = mount;
                mount[index] += by;
                range_bearing(&rig(mount, lens, skew), pixel)
            };
            let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            for row in 0..2 {
                prop_assert!(close(seen.by_mount[(row, index)], slope[row]), "{name}, row {row}");
            }
        }
    }

    #[test]
    fn sights_together_are_sights_alone(mount in mounts(), lens in lenses(), u in -50.0..350.0, v in -50.0..250.0) {
        let finder = rig(mount, lens, 0.0);
        let pixels = [[0.0, 0.0], [30.0, 10.0], [-40.0, 60.0]].map(|[more_u, more_v]| Vector2::new(u + more_u, v + more_v));
        let alone = |pixel| finder.sight(pixel).map(|s| Ranged {
            point_in_robot: s.point_in_robot,
            range: s.range,
            bearing: s.bearing,
            by_pixel: s.by_pixel,
        });
        prop_assert_eq!(finder.ranges(pixels), pixels.map(alone));
    }

    #[test]
    fn lens_round_trip_is_exact_to_1e9_px(lens in lenses(), skew in -0.02..0.02, u in 0.0..320.0, v in 0.0..240.0) {
        let finder = rig([0.4, 0.2, 0.0, 0.0, 0.0, 0.0], lens, skew);
        let pixel = Vector2::new(u, v);
        if let Some(ray) = finder.camera().ray_from_pixel(pixel) {
            let back = finder.camera().pixel_from_ray(ray).unwrap();
            prop_assert!((back - pixel).norm() <= 1e-9, "{}", (back - pixel).norm());
        }
    }

    #[test]
    fn height_scales_the_range_and_nothing_else(mount in mounts(), u in 0.0..319.0, v in 150.0..230.0) {
        let mut mount = mount;
        (mount[4], mount[5]) = (0.0, 0.0);
        let once = range_bearing(&rig(mount, [0.0; 5], 0.0), Vector2::new(u, v));
        mount[0] *= 2.0;
        let twice = range_bearing(&rig(mount, [0.0; 5], 0.0), Vector2::new(u, v));
        prop_assert!((twice.x / once.x - 2.0).abs() < 1e-12 && (twice.y - once.y).abs() < 1e-12);
    }
}

#[test]
fn a_pixel_beyond_the_monotone_domain_has_no_ray() {
    // r(1 − r²) turns back at r = 1/√3, where it reaches 0.385: 0.5 is never reached.
    let lens = Distortion { k1: -1.0, ..Default::default() };
    let camera = Camera::new(320, 240, [160.0, 160.0], [159.5, 119.5], 0.0, lens).unwrap();
    assert_eq!(camera.ray_from_pixel(Vector2::new(159.5 + 80.0, 119.5)), None);
    let ray = camera.ray_from_pixel(Vector2::new(159.5 + 56.0, 119.5)).unwrap();
    assert!(ray.x < 1.0 / 3f64.sqrt() && ray.x > 0.0, "{ray}");
    assert_eq!(camera.pixel_from_ray(Vector2::new(0.6, 0.0)), None);
}

#[test]
fn roll_yaw_and_lever_arm_turn_the_way_the_docs_say() {
    let centre = Vector2::new(146.0, 114.0);
    let level = |mount: [f64; 6]| rig(mount, [0.0; 5], 0.0);
    // Yaw to the left: what is straight ahead in the picture lies to the left.
    let seen = level([0.4, 0.3, 0.0, 0.1, 0.0, 0.0]).sight(centre).unwrap();
    assert!((seen.bearing - 0.1).abs() < 1e-12);
    // The camera's left side up: the horizon lies lower (larger v) in the picture's left half.
    let horizon = level([0.4, 0.3, 0.1, 0.0, 0.0, 0.0]).horizon();
    let v_at = |x: f64| -(horizon.x * x + horizon.z) / horizon.y;
    assert!(v_at(-0.3) > v_at(0.3), "{} {}", v_at(-0.3), v_at(0.3));
    // The lever arm shifts the point, not the direction.
    let shifted = level([0.4, 0.3, 0.0, 0.0, 0.5, -0.2]).floor_from_pixel(centre).unwrap();
    let plain = level([0.4, 0.3, 0.0, 0.0, 0.0, 0.0]).floor_from_pixel(centre).unwrap();
    assert!((shifted - plain - Vector2::new(0.5, -0.2)).norm() < 1e-12);
}

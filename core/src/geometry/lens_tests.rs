use super::*;
use crate::geometry::Camera;
use std::vec::Vec;

/// What people's files hold: a wide action camera (8 coefficients of OpenCV), a fisheye, a moderate lens.
fn cameras() -> [Camera<f64>; 3] {
    let rational = Lens::from_polynomial(&[2.1, 0.9, 2e-4, -3e-4, 0.03, 2.45, 1.6, 0.19]).unwrap();
    let fisheye = Lens::Equidistant([-0.013, 0.021, -0.017, 0.004]);
    let brown = Distortion { k1: -0.3, k2: 0.12, p1: 1e-3, p2: -5e-4, k3: -0.02 };
    [
        Camera::with_lens(1280, 720, [800.0, 798.0], [640.0, 355.0], 0.0, rational).unwrap(),
        Camera::with_lens(752, 480, [300.0, 300.5], [368.0, 243.0], 0.0, fisheye).unwrap(),
        Camera::new(640, 480, [420.0, 421.0], [318.0, 242.0], 1e-4, brown).unwrap(),
    ]
}

#[test]
fn every_pixel_comes_back_within_a_billionth_of_a_pixel_or_has_no_ray() {
    for camera in cameras() {
        let mut rays = 0;
        for v in (0..camera.height()).step_by(7) {
            for u in (0..camera.width()).step_by(7) {
                let pixel = Vector2::new(u as f64, v as f64);
                let Some(ray) = camera.ray_from_pixel(pixel) else { continue };
                let again = camera.pixel_from_ray(ray).unwrap();
                // Near 90° off the axis tan θ loses digits.
                let tolerance = 1e-9 * (1.0 + ray.norm_squared());
                assert!((again - pixel).norm() < tolerance, "{pixel:?} {again:?} {ray:?}");
                rays += 1;
            }
        }
        assert!(rays > camera.width() * camera.height() / 49 * 9 / 10);
    }
}

#[test]
fn several_pixels_together_are_each_alone_bit_by_bit() {
    for camera in cameras() {
        let (mut with, mut without) = (0, 0);
        for v in (0..camera.height()).step_by(13) {
            for u in (0..camera.width()).step_by(28) {
                // One of them lies far outside, where a lens may have no inverse.
                let pixels = [0.0, 9.3, 18.7, 5e3].map(|more| Vector2::new(u as f64 + more, v as f64));
                let together = camera.rays_from_pixels(pixels);
                let alone = |pixel| {
                    let ray = camera.ray_from_pixel(pixel)?;
                    Some((ray, camera.ray_by_pixel(ray)?))
                };
                assert_eq!(together, pixels.map(alone));
                with += together.iter().flatten().count();
                without += together.iter().filter(|ray| ray.is_none()).count();
            }
        }
        assert!(with > 1000 && without > 0, "{with} {without}");
    }
}

#[test]
fn jacobians_are_the_differences_quotients() {
    for camera in cameras() {
        for ray in [[0.0, 0.0], [2e-3, -1e-3], [0.3, 0.2], [-0.6, 0.5]].map(Vector2::from) {
            let step = 1e-6;
            let columns: Vec<_> = [Vector2::x(), Vector2::y()]
                .into_iter()
                .map(|axis| {
                    let [after, before] =
                        [ray + axis * step, ray - axis * step].map(|ray| camera.pixel_from_ray(ray).unwrap());
                    (after - before) / (2.0 * step)
                })
                .collect();
            let difference = camera.pixel_by_ray(ray) - Matrix2::from_columns(&columns);
            assert!(difference.amax() < 1e-5 * camera.focal().x, "{ray:?}: {difference}");
        }
    }
}

#[test]
fn the_series_near_the_axis_continues_the_formula() {
    let k = [-0.05, 0.02, 0.0, 0.0];
    let (inside, outside) = (NEAR_AXIS * (1.0 - 1e-9), NEAR_AXIS * (1.0 + 1e-9));
    let (near, far) = (equidistant(&k, inside), equidistant(&k, outside));
    assert!((near.0 - far.0).abs() < 1e-10 && (near.1 - far.1).abs() < 1e-7, "{near:?} {far:?}");
}

#[test]
fn single_precision_follows_double() {
    for camera in cameras() {
        let single: Camera<f32> = camera.cast().unwrap();
        let pixel = Vector2::new(0.8 * camera.width() as f64, 0.7 * camera.height() as f64);
        let exact = camera.ray_from_pixel(pixel).unwrap();
        let rounded = single.ray_from_pixel(pixel.cast()).unwrap().cast::<f64>();
        assert!((rounded - exact).norm() < 4e-6 * (1.0 + exact.norm_squared()), "{rounded} {exact}");
    }
}

#[test]
fn eight_coefficients_whose_last_three_are_zero_are_five() {
    let five = [-0.2, 0.1, 1e-3, 2e-3, 0.05];
    let eight = Lens::from_polynomial(&[five.as_slice(), &[0.0; 3]].concat()).unwrap();
    assert_eq!(Some(eight), Lens::from_polynomial(&five));
    assert_eq!(Lens::from_polynomial(&[0.1; 6]), None);
}

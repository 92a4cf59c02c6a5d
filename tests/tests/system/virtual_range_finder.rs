//! Range and bearing against exact geometry: plane intersection in homogeneous coordinates, and the paper's
//! trigonometric equations (1)–(6) as corrected.
use monorange_core::Real;
use monorange_core::geometry::{NoFloor, RangeFinder};
use monorange_tests::table1_range_finder;
use nalgebra::{Matrix3, Vector2, Vector3};

const HEIGHT: f64 = 0.4;
const TILT: f64 = 0.3;

/// (range, bearing) by the homography that maps floor points to rays: H = [r₁ r₂ −h r₃] of cam_from_robot,
/// inverted as a whole. Shares no code with the range finder.
fn by_plane_homography(ray: Vector2<f64>, height: f64, tilt: f64) -> (f64, f64) {
    let (sin, cos) = tilt.sin_cos();
    let cam_from_robot = Matrix3::new(0.0, -1.0, 0.0, -sin, 0.0, -cos, cos, 0.0, -sin);
    let mut rays_from_floor = cam_from_robot;
    rays_from_floor.set_column(2, &(cam_from_robot * Vector3::new(0.0, 0.0, -height)));
    let floor = rays_from_floor.lu().solve(&Vector3::new(ray.x, ray.y, 1.0)).expect("height is not 0");
    let (x, y) = (floor.x / floor.z, floor.y / floor.z);
    (x.hypot(y), y.atan2(x))
}

/// (range, bearing) by (1)–(6) with the corrections of the errata; α is the tilt.
fn by_the_paper(ray: Vector2<f64>, h: f64, alpha: f64) -> (f64, f64) {
    let beta = ray.y.atan(); // (1)
    let gamma = (ray.x * beta.cos()).atan(); // (1), corrected
    let foot_to_lens = h / (alpha + beta).sin(); // (2)
    let point_to_lens = foot_to_lens / gamma.cos(); // (3)
    let r = (point_to_lens * point_to_lens - h * h).sqrt(); // (4)
    let d = h / (alpha + beta).tan(); // (5)
    let phi = -(foot_to_lens * gamma.tan()).atan2(d); // (6), without the loss of arccos
    (r, phi)
}

/// Rays at least 1° below the horizon of every pixel of Table 1's picture.
fn floor_pixels(finder: &RangeFinder<f64>) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + '_ {
    let horizon = finder.horizon();
    (0..240).flat_map(move |v| (0..320).map(move |u| Vector2::new(f64::from(u), f64::from(v)))).filter_map(
        move |pixel| {
            let ray = finder.camera().ray_from_pixel(pixel)?;
            let direction = ray.push(1.0).normalize();
            (direction.dot(&horizon) <= -(1f64.to_radians().sin())).then_some((pixel, ray))
        },
    )
}

#[test]
fn f64_agrees_with_exact_geometry_and_with_the_corrected_paper() {
    let finder = table1_range_finder::<f64>(HEIGHT, TILT);
    let (mut worst, mut count) = (0f64, 0);
    for (pixel, ray) in floor_pixels(&finder) {
        let seen = finder.sight(pixel).expect("below the horizon");
        for (range, bearing) in [by_plane_homography(ray, HEIGHT, TILT), by_the_paper(ray, HEIGHT, TILT)] {
            worst = worst.max((seen.range - range).abs() / range).max((seen.bearing - bearing).abs());
        }
        count += 1;
    }
    println!("{count} pixels, worst relative range or absolute bearing error {worst:.1e}");
    assert!(count > 70_000);
    assert!(worst <= 1e-12, "{worst:e}");
}

#[test]
fn f32_stays_within_2e5_of_f64() {
    for tilt in [0.3, 0.2094] {
        let exact = table1_range_finder::<f64>(HEIGHT, tilt);
        let finder = table1_range_finder::<f32>(HEIGHT, tilt);
        let (mut range, mut bearing) = (0f64, 0f64);
        for (pixel, _) in floor_pixels(&exact) {
            let truth = exact.sight(pixel).expect("below the horizon");
            let seen = finder.sight(pixel.cast()).expect("below the horizon");
            range = range.max((seen.range.to_f64() / truth.range - 1.0).abs());
            bearing = bearing.max((seen.bearing.to_f64() - truth.bearing).abs());
        }
        println!("tilt {tilt}: worst relative range error {range:.1e}, bearing error {bearing:.1e} rad");
        assert!(range <= 2e-5 && bearing <= 2e-5, "{range:e} {bearing:e}");
    }
}

#[test]
fn a_pixel_without_floor_says_why() {
    let finder = table1_range_finder::<f64>(HEIGHT, 0.2);
    let why = |u, v| finder.sight(Vector2::new(u, v)).err();
    assert_eq!(why(160.0, 0.0), Some(NoFloor::AboveHorizon));
    assert_eq!(why(320.0, 200.0), Some(NoFloor::OutsideImage));
    assert_eq!(why(-0.6, 200.0), Some(NoFloor::OutsideImage));
    assert_eq!(why(f64::NAN, 200.0), Some(NoFloor::OutsideImage));
    assert_eq!(why(160.0, 200.0), None);
}

#[test]
fn projection_inverts_the_range_finder() {
    let finder = table1_range_finder::<f64>(HEIGHT, TILT);
    let worst = floor_pixels(&finder)
        .map(|(pixel, _)| {
            let point = finder.floor_from_pixel(pixel).expect("below the horizon");
            (finder.pixel_from_floor_unbounded(point).expect("in front") - pixel).norm()
        })
        .fold(0.0, f64::max);
    println!("worst round trip {worst:.1e} px");
    assert!(worst <= 1e-9, "{worst:e}");
}

use super::*;
use crate::geometry::{Mount, RangeFinder};
use std::vec::Vec;

const PIXEL_STD: f64 = 0.1;

fn camera() -> Camera<f64> {
    let lens = Distortion { k1: -0.25, k2: 0.08, p1: 0.001, p2: -0.0005, k3: 0.0 };
    Camera::new(640, 480, [540.0, 538.0], [325.0, 236.0], 0.0, lens).unwrap()
}

/// Normally distributed enough: the sum of twelve even numbers.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        let mut even = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| even()).sum::<f64>() - 6.0
    }
}

/// A board of 9 × 6 points, 25 mm apart, turned about the optical frame's axes, its middle at a place.
fn board(turn: [f64; 3], middle: [f64; 3]) -> BoardPose {
    let rotation = Rotation3::new(Vector3::from(turn)).into_inner();
    BoardPose { rotation, translation: Vector3::from(middle) - rotation * Vector3::new(0.1, 0.0625, 0.0) }
}

fn seen(camera: &Camera<f64>, pose: &BoardPose, chance: &mut Chance, std: f64) -> Vec<BoardPoint> {
    let mut points = Vec::new();
    for (row, column) in (0..6).flat_map(|row| (0..9).map(move |column| (row, column))) {
        let on_board = Vector2::new(f64::from(column), f64::from(row)) * 0.025;
        let place = pose.point_in_camera(on_board);
        let pixel = camera.pixel_from_ray(place.xy() / place.z).unwrap();
        points.push(BoardPoint { on_board, pixel: pixel + Vector2::new(chance.next(), chance.next()) * std });
    }
    points
}

const POSES: [([f64; 3], [f64; 3]); 6] = [
    ([0.4, 0.1, 0.0], [-0.08, -0.05, 0.35]),
    ([-0.4, 0.2, 0.3], [0.09, -0.05, 0.36]),
    ([0.1, 0.5, 0.1], [-0.06, 0.05, 0.34]),
    ([0.0, -0.5, 1.4], [0.08, 0.05, 0.38]),
    ([0.3, 0.3, 0.2], [0.0, 0.0, 0.28]),
    ([-0.3, -0.3, -0.2], [0.02, 0.01, 0.45]),
];

fn fit_of(poses: &[([f64; 3], [f64; 3])], std: f64, seed: u64) -> Result<CameraFit> {
    let chance = &mut Chance(seed);
    let views: Vec<_> =
        poses.iter().map(|(turn, middle)| seen(&camera(), &board(*turn, *middle), chance, std)).collect();
    let views: Vec<_> = views.iter().map(Vec::as_slice).collect();
    fit_camera(640, 480, &views)
}

fn numbers(camera: &Camera<f64>) -> [f64; 9] {
    let (focal, principal) = (camera.focal(), camera.principal());
    let lens = camera.lens().coefficients();
    core::array::from_fn(|index| match index {
        0..2 => focal[index],
        2..4 => principal[index - 2],
        _ => lens[index - 4],
    })
}

#[test]
fn exact_views_give_the_camera_back() {
    let fit = fit_of(&POSES, 0.0, 1).unwrap();
    for (fitted, is) in numbers(&fit.camera).iter().zip(numbers(&camera())) {
        assert!((fitted - is).abs() < 1e-6 * (1.0 + is.abs()), "{fit:?}");
    }
    assert!(fit.rms < 1e-6, "{fit:?}");
    for (view, (turn, middle)) in fit.views.iter().zip(POSES) {
        assert!((view.pose.translation - board(turn, middle).translation).norm() < 1e-7);
    }
}

/// Of 40 noisy problems the errors are as large as the standard deviations say: NEES of focal lengths and centre, and the
/// pixels' own noise.
#[test]
fn standard_deviations_are_honest() {
    let mut squares = [0.0; 4];
    let (mut noise, tries) = (0.0, 40);
    for seed in 0..tries {
        let fit = fit_of(&POSES, PIXEL_STD, 17 + seed).unwrap();
        for ((square, std), (fitted, is)) in
            squares.iter_mut().zip(fit.std).zip(numbers(&fit.camera).iter().zip(numbers(&camera())))
        {
            *square += (fitted - is) * (fitted - is) / (std * std) / tries as f64;
        }
        noise += (fit.pixel_std[0] + fit.pixel_std[1]) / 2.0 / tries as f64;
    }
    // χ² of 40: 99.8 % lies between 0.45 and 1.84 of its mean; a lens with a term too few or too many widens it a little.
    assert!(squares.iter().all(|square| (0.45..2.0).contains(square)), "{squares:?}");
    assert!((noise - PIXEL_STD).abs() < 0.003, "{noise}");
}

#[test]
fn parallel_boards_tell_no_camera() {
    let facing: Vec<_> =
        (0..5).map(|n| ([0.0; 3], [0.02 * f64::from(n) - 0.04, 0.01, 0.3 + 0.05 * f64::from(n)])).collect();
    if let Ok(fit) = fit_of(&facing, PIXEL_STD, 3) {
        assert!(fit.std[0] > 0.05 * fit.camera.focal().x, "{fit:?}");
    }
    let tilted: Vec<_> = (0..5)
        .map(|n| ([0.5, 0.0, 0.0], [0.02 * f64::from(n) - 0.04, 0.01, 0.3 + 0.05 * f64::from(n)]))
        .collect();
    if let Ok(fit) = fit_of(&tilted, PIXEL_STD, 3) {
        assert!(fit.std[..4].iter().any(|std| *std > 0.02 * 640.0), "{fit:?}");
    }
    assert!(matches!(fit_of(&POSES[..1], 0.0, 1), Err(Error::Size { got: 1, .. })));
}

/// Within three standard deviations, which a board of 20 cm half a metre away makes small.
#[test]
fn a_board_on_the_floor_tells_the_mount() {
    let is = [0.42, 0.5, 0.03, -0.06, 0.0, 0.0];
    let finder = RangeFinder::new(camera(), Mount::new(is).unwrap());
    let cam_from_robot = finder.robot_from_cam().transpose();
    // Ahead of the robot, its columns to the right and its rows towards the robot: z of the board points into the floor.
    let corner = Vector3::new(0.8, 0.1, -0.42);
    let to_floor = Matrix3::from_columns(&[-Vector3::y(), -Vector3::x(), -Vector3::z()]);
    let pose = BoardPose { rotation: cam_from_robot * to_floor, translation: cam_from_robot * corner };
    let points = seen(&camera(), &pose, &mut Chance(5), PIXEL_STD);
    let view = fit_pose(&camera(), &points).unwrap();
    let corners = [Vector2::zeros(), Vector2::new(0.2, 0.125)];
    let told = mount_on_floor(&view, corners, true).unwrap();
    let limits = [0.01, 0.02, 0.02, 0.03];
    for (((fitted, is), std), limit) in told.mount.parameters().iter().zip(is).zip(told.std).zip(limits) {
        assert!((fitted - is).abs() < 3.0 * std && std < limit, "{told:?}");
    }
    let quiet = mount_on_floor(&view, corners, false).unwrap();
    assert_eq!((quiet.std[3], quiet.mount.parameters()[3]), (0.0, 0.0));
}

//! The robot's metric step from matches: its covariance against the scatter that it predicts.
use monorange_core::Real;
use monorange_core::geometry::{Camera, Distortion, Mount, Pose, RangeFinder};
use monorange_core::homography::{
    GroundMotion, GroundMotionConfig, Match, MotionModel, MotionPrior, OdometryConfig, Track, VisualOdometry,
    ground_motion,
};
use monorange_tests::Noise;
use nalgebra::{Matrix2, Vector2, Vector3};
use std::fmt::Write;

fn finder<T: Real>() -> RangeFinder<T> {
    let lens = Distortion { k1: -0.2, k2: 0.1, p1: -0.002, p2: 0.001, k3: 0.0 };
    let Distortion { k1, k2, p1, p2, k3 } = lens;
    let [k1, k2, p1, p2, k3] = [k1, k2, p1, p2, k3].map(T::lit);
    let lens = Distortion { k1, k2, p1, p2, k3 };
    let (focal, principal) = ([365.0, 366.0].map(T::lit), [160.0, 118.0].map(T::lit));
    let camera = Camera::new(320, 240, focal, principal, T::zero(), lens).expect("a camera");
    let mount = Mount::new([0.4, 0.25, 0.01, -0.02, 0.12, 0.03].map(T::lit)).expect("a mount");
    RangeFinder::new(camera, mount)
}

/// A pixel that sees a point of the robot's frame.
fn pixel(finder: &RangeFinder<f64>, point: Vector3<f64>) -> Option<Vector2<f64>> {
    let mount = finder.mount();
    let lens = Vector3::new(mount.lever_arm().x, mount.lever_arm().y, mount.height());
    let in_cam = finder.robot_from_cam().tr_mul(&(point - lens));
    let ahead = in_cam.z > 0.1;
    let seen = ahead.then(|| finder.camera().pixel_from_ray(in_cam.xy() / in_cam.z)).flatten()?;
    finder.camera().contains(seen).then_some(seen)
}

/// Matches of a corridor 2 m wide: floor, walls, and wrong ones.
fn corridor(
    noise: &mut Noise,
    finder: &RangeFinder<f64>,
    step: &Pose<f64>,
    counts: [usize; 3],
    sigma: f64,
) -> Vec<Match<f64>> {
    corridor_seen_by(noise, [finder, finder], step, counts, sigma)
}

/// The same, where the camera may sit otherwise in the second picture.
fn corridor_seen_by(
    noise: &mut Noise,
    [before, after]: [&RangeFinder<f64>; 2],
    step: &Pose<f64>,
    [floor, walls, wrong]: [usize; 3],
    sigma: f64,
) -> Vec<Match<f64>> {
    let mut matches = Vec::new();
    let jitter = |noise: &mut Noise| Vector2::new(noise.normal(), noise.normal()) * sigma;
    while matches.len() < floor + walls {
        // Even in the picture, as a detector's points are: the floor in inverse distance.
        let ahead = 1.0 / noise.uniform(0.08, 1.2);
        let point = if matches.len() < floor {
            Vector3::new(ahead, noise.uniform(-1.0, 1.0), 0.0)
        } else {
            let side = if noise.uniform(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
            Vector3::new(ahead, side, noise.uniform(0.0, 2.5))
        };
        let then = step.inverse_transform(point.xy()).push(point.z);
        if let (Some(a), Some(b)) = (pixel(before, point), pixel(after, then)) {
            matches.push(Match::new(a + jitter(noise), b + jitter(noise), sigma * sigma, sigma * sigma));
        }
    }
    for _ in 0..wrong {
        let mut place = || Vector2::new(noise.uniform(0.0, 319.0), noise.uniform(0.0, 239.0));
        matches.push(Match::new(place(), place(), sigma * sigma, sigma * sigma));
    }
    matches
}

fn solve<T: Real>(matches: &[Match<f64>], model: MotionModel) -> GroundMotion<T> {
    solve_with(&finder::<T>(), matches, model)
}

fn solve_with<T: Real>(
    finder: &RangeFinder<T>,
    matches: &[Match<f64>],
    model: MotionModel,
) -> GroundMotion<T> {
    let narrow = |p: Vector2<f64>| p.map(T::lit);
    let matches: Vec<Match<T>> = matches
        .iter()
        .map(|m| Match::new(narrow(m.from), narrow(m.to), T::lit(m.from_cov.m11), T::lit(m.to_cov.m11)))
        .collect();
    let mut tracks = vec![Track::default(); matches.len()];
    let config = GroundMotionConfig { model, ..GroundMotionConfig::default() };
    ground_motion(&config, finder, &matches, None, &mut tracks).expect("solvable")
}

/// NEES of the step in its own dimensions: path and turn, or dx, dy, dθ.
fn nees<T: Real>(found: &GroundMotion<T>, truth: &Pose<f64>, arc: Vector2<f64>, model: MotionModel) -> f64 {
    if model == MotionModel::Wheeled {
        let error = found.arc.map(Real::to_f64) - arc;
        let covariance: Matrix2<f64> = found.arc_covariance.map(Real::to_f64);
        return error.dot(&(covariance.try_inverse().expect("regular") * error));
    }
    let pose = Vector3::new(found.pose.x, found.pose.y, found.pose.heading).map(Real::to_f64);
    let error = pose - Vector3::new(truth.x, truth.y, truth.heading);
    error.dot(&(found.covariance.map(Real::to_f64).try_inverse().expect("regular") * error))
}

#[test]
fn step_covariance_is_consistent() {
    let trials = std::env::var("TRIALS").ok().and_then(|n| n.parse().ok()).unwrap_or(200);
    let mut table = String::from(
        "model   scalar floor walls wrong sigma_px  path_m   NEES  of  sd_path_mm  sd_turn_mrad\n",
    );
    for (model, dimension) in [(MotionModel::Wheeled, 2.0), (MotionModel::Free, 3.0)] {
        let (mut all, mut problems) = (0.0, 0.0);
        let (mut floor_only, mut floor_problems) = (0.0, 0.0);
        for (case, (counts, sigma, path)) in [
            ([100, 0, 0], 0.5, 0.05),
            ([60, 0, 40], 0.3, 0.2),
            ([60, 100, 40], 0.3, 0.2),
            ([100, 100, 100], 0.7, 0.1),
            ([60, 60, 60], 1.0, 0.3),
        ]
        .into_iter()
        .enumerate()
        {
            for scalar in ["f64", "f32"] {
                let (mut sum, mut path_var, mut turn_var) = (0.0, 0.0, 0.0);
                for trial in 0..trials {
                    let mut noise = Noise::new((100_000 * (case + 1) + trial) as u64);
                    let turn = noise.uniform(-0.1, 0.1);
                    let arc = Vector2::new(path, turn);
                    let (sin, cos) = f64::sin_cos(turn);
                    let truth = Pose::new(path * sin / turn, path * (1.0 - cos) / turn, turn);
                    let matches = corridor(&mut noise, &finder(), &truth, counts, sigma);
                    let (nees, covariance) = if scalar == "f64" {
                        let found = solve::<f64>(&matches, model);
                        (nees(&found, &truth, arc, model), found.arc_covariance)
                    } else {
                        let found = solve::<f32>(&matches, model);
                        (nees(&found, &truth, arc, model), found.arc_covariance.map(f64::from))
                    };
                    sum += nees;
                    path_var += covariance.m11;
                    turn_var += covariance.m22;
                }
                let trials = trials as f64;
                if counts[1] == 0 {
                    floor_only += sum;
                    floor_problems += trials;
                }
                all += sum;
                problems += trials;
                let [floor, walls, wrong] = counts;
                let (sd_path, sd_turn) = ((path_var / trials).sqrt() * 1e3, (turn_var / trials).sqrt() * 1e3);
                let mean = sum / trials;
                let name = format!("{model:?}");
                writeln!(table, "{name:8}{scalar} {floor:8} {walls:5} {wrong:5} {sigma:8} {path:7} {mean:6.2} {dimension:3} {sd_path:11.2} {sd_turn:13.3}")
                    .expect("a string");
            }
        }
        let (mean, floor_mean) = (all / problems / dimension, floor_only / floor_problems / dimension);
        writeln!(
            table,
            "{model:?} NEES per dimension: floor and wrong matches {floor_mean:.3}, all {mean:.3}"
        )
        .expect("a string");
        assert!((floor_mean - 1.0).abs() < 0.05, "{table}");
        assert!((mean - 1.0).abs() < 0.05, "{table}");
    }
    insta::assert_snapshot!("ground_motion_nees", table);
}

#[test]
fn a_mount_that_is_off_moves_the_step_as_its_derivative_says() {
    let mut noise = Noise::new(7);
    let truth = Pose::new(0.2, 0.005, 0.05);
    let matches = corridor(&mut noise, &finder(), &truth, [60, 60, 20], 0.2);
    let moved = |index: usize, change: f64| {
        let mut parameters = finder::<f64>().mount().parameters();
        parameters[index] += change;
        let finder = RangeFinder::new(*finder::<f64>().camera(), Mount::new(parameters).expect("a mount"));
        let pose = solve_with(&finder, &matches, MotionModel::Wheeled).pose;
        Vector3::new(pose.x, pose.y, pose.heading)
    };
    let by_mount = solve::<f64>(&matches, MotionModel::Wheeled).by_mount;
    let single = solve::<f32>(&matches, MotionModel::Wheeled).by_mount.map(f64::from);
    for (index, column) in by_mount.column_iter().enumerate() {
        let size = 1e-3;
        let slope = (moved(index, size) - moved(index, -size)) / (2.0 * size);
        assert!((column - slope).norm() < 0.05 * slope.norm(), "{index}: {column} {slope}");
        assert!((single.column(index) - column).norm() < 0.02 * column.norm(), "{index}: {single} {column}");
    }
}

#[test]
fn a_mount_that_is_off_makes_wheels_and_pictures_differ_as_the_derivative_says() {
    let arc = Vector2::new(0.2_f64, 0.05);
    let truth = Pose::new(arc.x * arc.y.sin() / arc.y, arc.x * (1.0 - arc.y.cos()) / arc.y, arc.y);
    let matches = corridor(&mut Noise::new(11), &finder(), &truth, [100, 60, 20], 0.05);
    // Wheels that are right, and believed so little that the pictures alone make the step.
    let wheels = MotionPrior { arc, covariance: Matrix2::identity() };
    let config = OdometryConfig { keyframe_path: 0.1, ..OdometryConfig::default() };
    let differ = |index: usize, error: f64| {
        let mut parameters = finder::<f64>().mount().parameters();
        parameters[index] -= error;
        let finder = RangeFinder::new(*finder::<f64>().camera(), Mount::new(parameters).expect("a mount"));
        let mut tracks = vec![Track::default(); matches.len()];
        let report = VisualOdometry::new().step(&config, &finder, &matches, 0.1, Some(&wheels), &mut tracks);
        report.disagreement.expect("a keyframe's end")
    };
    for index in 0..4 {
        let size = 2e-3;
        let found = (differ(index, size).arc - differ(index, -size).arc) / (2.0 * size);
        let expected = differ(index, 0.0).by_mount.column(index).into_owned();
        assert!((found - expected).norm() < 0.05 * expected.norm().max(0.02), "{index}: {found} {expected}");
    }
}

#[test]
fn matches_of_a_floor_tell_by_how_much_the_mount_is_off() {
    let truth = Pose::new(0.2, 0.005, 0.05);
    let errors = [0.0002, -0.0007, 0.0005];
    let mut parameters = finder::<f64>().mount().parameters();
    parameters.iter_mut().skip(1).zip(errors).for_each(|(parameter, error)| *parameter -= error);
    let believed = RangeFinder::new(*finder::<f64>().camera(), Mount::new(parameters).expect("a mount"));
    let (mut told, trials) = (0.0, 40);
    for seed in 0..trials {
        let matches = corridor(&mut Noise::new(seed), &finder(), &truth, [120, 0, 0], 0.2);
        let found = solve_with(&believed, &matches, MotionModel::Wheeled).mount.expect("an angle");
        let off = Vector3::from(errors) - found.errors;
        told += off.dot(&(found.covariance.try_inverse().expect("positive") * off)) / (3 * trials) as f64;
    }
    assert!(told > 0.6 && told < 1.6, "NEES per angle {told}");
}

#[test]
fn a_camera_that_is_knocked_between_two_pictures_says_by_how_much() {
    let before = finder::<f64>();
    let truth = Pose::new(0.12, 0.002, 0.03);
    for (seed, knock) in (1_u64..).zip([[0.0, 0.0], [1.0, 0.0], [0.0, -1.0], [-2.5, 1.5]]) {
        let mut parameters = before.mount().parameters();
        for (parameter, degrees) in parameters.iter_mut().skip(1).zip(knock) {
            *parameter += f64::to_radians(degrees);
        }
        let after = RangeFinder::new(*before.camera(), Mount::new(parameters).expect("a mount"));
        let matches = corridor_seen_by(&mut Noise::new(seed), [&before, &after], &truth, [80, 60, 30], 0.3);
        let mut tracks = vec![Track::default(); matches.len()];
        let mut odometry = VisualOdometry::new();
        let report = odometry.step(&OdometryConfig::default(), &before, &matches, 0.5, None, &mut tracks);
        if knock == [0.0; 2] {
            assert_eq!(report.jolt, None);
            continue;
        }
        let jolt = report.jolt.expect("it was knocked");
        let body = after.robot_from_cam() * before.robot_from_cam().transpose();
        let error = jolt.angles - Vector2::new(body.m13, body.m32);
        println!(
            "{knock:?}: {:?} ± {:?}",
            jolt.angles.map(f64::to_degrees),
            jolt.covariance.diagonal().map(f64::sqrt)
        );
        assert!(error.amax() < 0.002, "{knock:?}: {error}");
        assert!(
            report.new_keyframe && (report.increment.x - truth.x).abs() < 0.004,
            "{:?}",
            report.increment
        );
    }
}

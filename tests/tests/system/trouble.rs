//! Wheels that read wrongly all the time, a camera that is knocked, a robot that pitches, and a rolling shutter, in a simulated corridor whose corners are given exactly
//! but for their noise. With pictures: `cargo run -p monorange-tests --example trouble`.
use monorange_core::geometry::{Mount, RangeFinder, wrap_angle};
use monorange_core::lines::Corner;
use monorange_core::pipeline::{
    Carrier, Config, Memory, MotionFrom, MotionNoise, Odometry, OnHeap, Pipeline,
};
use monorange_core::slam::Verdict;
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, TrueCorner, default_rig};
use monorange_tests::Noise;
use monorange_tests::corridor::{Trouble, config_for, median, run_into};
use nalgebra::{Matrix2, Vector3};

const FRAMES: usize = 400;
const CORNER_STD: f64 = 0.4;

fn simulation(seed: u64, tilt: f64) -> Simulation {
    pitching(seed, tilt, 0.0)
}

/// One that pitches by so much to either side, once a second.
fn pitching(seed: u64, tilt: f64, pitch: f64) -> Simulation {
    let scene = Scene::corridor(&SceneConfig { seed, ..Default::default() });
    let rig = default_rig().unwrap();
    let mut parameters = rig.mount().parameters();
    parameters[1] += tilt;
    let rig = RangeFinder::new(*rig.camera(), Mount::new(parameters).unwrap());
    Simulation::new(scene, rig, SimConfig { seed, frames: FRAMES, walkers: 0, pitch, ..Default::default() })
        .unwrap()
}

/// Six in ten of the corners in view.
fn corners(simulation: &Simulation, frame: usize, noise: &mut Noise) -> Vec<Corner> {
    let seen = simulation.visible_corners(frame);
    let near =
        seen.into_iter().filter(|corner| corner.hidden.is_none() && (0.5..5.0).contains(&corner.range));
    let mut corners = Vec::new();
    for corner in near {
        let error = [noise.normal(), noise.normal()].map(|error| CORNER_STD * error);
        if noise.uniform(0.0, 1.0) < 0.6 && corners.len() < 16 {
            corners.push(Corner {
                pixel: (corner.pixel + nalgebra::Vector2::from(error)).cast(),
                covariance: Matrix2::identity() * (CORNER_STD * CORNER_STD) as f32,
                vertical: 0,
                floor: 0,
                brighter_right: corner.id % 2 == 0,
                brighter_below: corner.id % 4 < 2,
            });
        }
    }
    corners
}

struct Drive {
    pipeline: Pipeline<OnHeap>,
    /// Of the poses of the last quarter, a degree of freedom.
    nees: f64,
    knocked: Vec<usize>,
    /// |range error| / range of corners 2.5 to 3.5 m away, the middle one.
    range_error: f64,
}

/// Drives; the wheels read `long` too long, and from the picture `from` on the camera is that of `after`.
fn drive(before: &Simulation, after: &Simulation, from: usize, long: f64, motion: MotionNoise) -> Drive {
    drive_with(Config { motion, ..config_for(before).unwrap() }, before, after, from, long, None)
}

/// As [`drive`], where an IMU with this standard deviation is on board, with one.
fn drive_with(
    config: Config,
    before: &Simulation,
    after: &Simulation,
    from: usize,
    long: f64,
    imu: Option<f64>,
) -> Drive {
    let camera = *before.rig().camera();
    let memory = Memory::on_heap(camera.width(), camera.height(), 256);
    let mut pipeline = Pipeline::new(config, memory).unwrap();
    let mut noise = Noise::new(before.config().seed);
    let world_from_start = before.true_pose(0);
    let (mut nees, mut knocked, mut range_errors) = (0.0, Vec::new(), Vec::new());
    for frame in 0..FRAMES {
        let time = before.time(frame);
        if frame > 0 {
            let (twist, seconds) = (before.odometry(frame - 1), (time - before.time(frame - 1)) as f32);
            let (v, omega) = ((twist.speed * (1.0 + long)) as f32, twist.turn as f32);
            pipeline.odometry(time, &Odometry::Velocity { v, omega, seconds }).unwrap();
        }
        let shown = if frame < from { before } else { after };
        let seen = corners(shown, frame, &mut noise);
        if let Some(std) = imu {
            let [level, leaning] =
                [before.rig(), &before.true_rig(frame)].map(|rig| rig.mount().parameters()[1]);
            let pitch = leaning - level + std * noise.normal();
            pipeline.attitude(pitch as f32, (std * noise.normal()) as f32, std as f32).unwrap();
        }
        let report = pipeline.observe(time, &seen).unwrap();
        let is_as_found = |pixel| seen.iter().any(|corner| corner.pixel == pixel);
        assert!(report.corners.iter().all(|corner| is_as_found(corner.pixel)), "frame {frame}");
        if report.map.knocked {
            knocked.push(frame);
        }
        for corner in &report.corners {
            let distance = |truth: &TrueCorner| (truth.pixel - corner.pixel.cast::<f64>()).norm();
            let truth = shown.visible_corners(frame);
            let truth = truth.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
            if (2.5..3.5).contains(&truth.range) {
                range_errors.push((f64::from(corner.range) / truth.range - 1.0).abs());
            }
        }
        if frame >= FRAMES * 3 / 4 {
            let truth = world_from_start.inverse().compose(&before.true_pose(frame));
            let error = Vector3::new(
                f64::from(report.pose.x) - truth.x,
                f64::from(report.pose.y) - truth.y,
                wrap_angle(f64::from(report.pose.heading) - truth.heading),
            );
            let inverse = report.pose_covariance.cast::<f64>().try_inverse().unwrap();
            nees += error.dot(&(inverse * error)) / (3.0 * FRAMES as f64 / 4.0);
        }
    }
    range_errors.sort_by(f64::total_cmp);
    Drive { pipeline, nees, knocked, range_error: median(&range_errors) }
}

#[test]
fn wheels_that_read_5_percent_long_are_found_and_right_ones_stay() {
    for (seed, long) in [(21, 0.05), (22, -0.05), (23, 0.0)] {
        let simulation = simulation(seed, 0.0);
        let motion = config_for(&simulation).unwrap().motion;
        let found = drive(&simulation, &simulation, FRAMES, long, motion.with_scales());
        let filter = found.pipeline.filter();
        let (error, covariance) = (filter.wheels_error().unwrap(), filter.wheels_error_covariance().unwrap());
        let std = covariance.m11.sqrt();
        let missing = (1.0 / (1.0 + long) - 1.0) as f32;
        println!("seed {seed}: {error:?} of {missing}, σ {std}, NEES/3 {}", found.nees);
        assert!(
            (error.x - missing).abs() < 3.0 * std && std < 0.02,
            "{error:?} ± {std}, should be {missing}"
        );
        assert!(found.nees < 3.0, "NEES/3 {}", found.nees);
        assert_eq!((found.pipeline.health().verdict(), found.knocked), (Verdict::Consistent, vec![]));
        if long != 0.0 {
            let trusted = drive(&simulation, &simulation, FRAMES, long, motion);
            println!("  taken at their word: NEES/3 {}", trusted.nees);
            assert!(trusted.nees > 3.0 * found.nees.max(1.0), "the law is about something: {}", trusted.nees);
        }
    }
}

#[test]
fn a_camera_that_is_knocked_by_a_degree_is_noticed_and_its_tilt_found_anew() {
    for (seed, tilt) in [(24, 1_f64), (25, -1.0)] {
        let (before, after) = (simulation(seed, 0.0), simulation(seed, tilt.to_radians()));
        let motion = config_for(&before).unwrap().motion.with_scales();
        let found = drive(&before, &after, FRAMES / 2, 0.0, motion);
        let error = found.pipeline.filter().mount_error().unwrap().y.to_degrees();
        println!("seed {seed}: {:?}, {error:.3}°, NEES/3 {}", found.knocked, found.nees);
        let first = found.knocked.first().copied().unwrap();
        assert!((FRAMES / 2..FRAMES / 2 + 30).contains(&first), "noticed at {first}");
        assert!((f64::from(error) - tilt).abs() < 0.3, "{error}°");
        let walking = Config { motion, mount_walk: 0.001, ..config_for(&before).unwrap() };
        let found = drive_with(walking, &before, &after, FRAMES / 2, 0.0, None);
        let error = found.pipeline.filter().mount_error().unwrap().y.to_degrees();
        println!("  that may give way: {error:.3}°, NEES/3 {}", found.nees);
        assert!((f64::from(error) - tilt).abs() < 0.1 && found.nees < 3.0, "{error}°, NEES/3 {}", found.nees);
    }
}

/// With pictures: where they move the robot, the floor says what the corners do not.
#[test]
#[ignore = "golden run: cargo xtask test"]
fn a_camera_that_is_knocked_while_pictures_move_the_robot_is_estimated_anew() {
    let (wheels, none) = (MotionFrom::ByCarrier, MotionFrom::Pictures);
    let cases = [
        ("tilt", 1, Carrier::Floor, wheels),
        ("roll", 2, Carrier::Map, none),
        ("yaw", 3, Carrier::Floor, wheels),
    ];
    std::thread::scope(|scope| {
        for (angle, parameter, carrier, motion_from) in cases {
            scope.spawn(move || {
                let straight = walked(31, default_rig().unwrap());
                let mut parameters = straight.rig().mount().parameters();
                parameters[parameter] += 1_f64.to_radians();
                let knocked =
                    walked(31, RangeFinder::new(*straight.rig().camera(), Mount::new(parameters).unwrap()));
                let trouble = Trouble { knock: Some((KNOCKED / 2, &knocked)), ..Trouble::default() };
                let config = Config { carrier, motion_from, ..config_for(&straight).unwrap() };
                let score = run_into(&straight, config, &trouble).unwrap();
                let found = score.mount[0][parameter].to_degrees();
                println!(
                    "{angle}: {found:.2}°, {:.3} in 3σ, NEES/3 {:.2}",
                    score.within_3_sigma,
                    score.nees / 3.0
                );
                assert!(score.within_3_sigma > 0.9 && score.nees < 6.0, "{angle}");
            });
        }
    });
}

/// Pictures of a drive in which the camera is knocked half-way.
const KNOCKED: usize = 240;

fn walked(seed: u64, rig: RangeFinder<f64>) -> Simulation {
    let scene = Scene::corridor(&SceneConfig { seed, ..Default::default() });
    Simulation::new(scene, rig, SimConfig { seed, frames: KNOCKED, ..Default::default() }).unwrap()
}

#[test]
fn a_robot_that_pitches_is_ranged_with_the_attitude_of_its_own_picture() {
    for seed in [26, 27, 28] {
        let simulation = pitching(seed, 0.0, 1.5_f64.to_radians());
        let stiff = config_for(&simulation).unwrap();
        let swaying = Config { sway: 1.5_f32.to_radians(), ..stiff };
        let [found, wrong] =
            [swaying, stiff].map(|config| drive_with(config, &simulation, &simulation, FRAMES, 0.0, None));
        let told = drive_with(stiff, &simulation, &simulation, FRAMES, 0.0, Some(0.1_f64.to_radians()));
        let verdict = found.pipeline.health().verdict();
        println!("seed {seed}: {:.4} at 3 m, NEES/3 {}, {verdict:?}", found.range_error, found.nees);
        println!("  as if it were stiff: {:.4}, NEES/3 {}", wrong.range_error, wrong.nees);
        println!("  with an IMU: {:.4}, NEES/3 {}", told.range_error, told.nees);
        assert!(found.range_error < 0.03, "{} of the range", found.range_error);
        assert!(told.range_error < 0.015 && told.nees < 3.0, "{} of the range", told.range_error);
        assert_eq!(told.pipeline.health().verdict(), Verdict::Consistent);
        assert_eq!(verdict, Verdict::Consistent);
        assert!(wrong.range_error > 0.06, "the law is about something: {}", wrong.range_error);
        assert_ne!(wrong.pipeline.health().verdict(), Verdict::Consistent);
    }
}

/// The middle one of the corners' errors of bearing (rad), of a robot that turns by 0.4 to 0.6 rad/s, by a shutter of 33 ms.
fn error_in_turns(readout: f32) -> f64 {
    let looks = SceneConfig { seed: 28, ..Default::default() };
    let (frames, rig) = (300, default_rig().unwrap());
    let drive = SimConfig {
        seed: 28,
        frames,
        walkers: 0,
        interval: 0.2,
        speed: 0.8,
        readout: 0.033,
        ..Default::default()
    };
    let simulation = Simulation::new(Scene::office(&looks), rig, drive).unwrap();
    let config = Config { readout, ..config_for(&simulation).unwrap() };
    let memory = Memory::on_heap(rig.camera().width(), rig.camera().height(), 256);
    let mut pipeline = Pipeline::new(config, memory).unwrap();
    let mut errors = Vec::new();
    for frame in 1..frames {
        let (time, twist) = (simulation.time(frame), simulation.true_twist(frame));
        let (v, omega) = (twist.speed as f32, twist.turn as f32);
        pipeline.odometry(time, &Odometry::Velocity { v, omega, seconds: 0.2 }).unwrap();
        let truth = simulation.visible_corners(frame);
        let covariance = Matrix2::identity() * 0.01;
        let exact = truth.iter().filter(|corner| corner.range < 5.0).map(|corner| Corner {
            pixel: corner.pixel.cast(),
            covariance,
            ..Default::default()
        });
        let exact: Vec<_> = exact.take(16).collect();
        let near: Vec<_> = truth.iter().filter(|corner| corner.range < 5.0).take(16).collect();
        let report = pipeline.observe(time, &exact).unwrap();
        if (0.4..0.6).contains(&twist.turn.abs()) && report.corners.len() == near.len() {
            let pairs = report.corners.iter().zip(near);
            errors.extend(pairs.map(|(found, truth)| (f64::from(found.bearing) - truth.bearing).abs()));
        }
    }
    assert!(errors.len() > 50, "{} corners in turns", errors.len());
    errors.sort_by(f64::total_cmp);
    median(&errors)
}

#[test]
fn a_rolling_shutter_that_is_told_of_hardly_bends_a_turn() {
    let [untold, told] = [0.0, 0.033].map(error_in_turns);
    println!("bearings are {:.4}° off, {:.4}° told of it", untold.to_degrees(), told.to_degrees());
    assert!(told < untold / 5.0, "{told} rad of {untold}");
}

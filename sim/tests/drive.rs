//! Motion, odometry, people and laser.
use monorange_core::geometry::wrap_angle;
use monorange_sim::{
    LaserConfig, MAX_WALKING_SPEED, OdometryNoise, Scene, SceneConfig, SimConfig, Simulation, default_rig,
};
use nalgebra::Vector2;

fn simulate(scene: Scene, config: SimConfig) -> Simulation {
    Simulation::new(scene, default_rig().expect("valid"), config).expect("valid")
}

fn corridor(config: SimConfig) -> Simulation {
    simulate(Scene::corridor(&SceneConfig::default()), config)
}

#[test]
fn the_loop_closes_and_the_robot_keeps_clear_of_walls() {
    for scene in [Scene::corridor(&SceneConfig::default()), Scene::office(&SceneConfig::default())] {
        let config = SimConfig { frames: 1200, walkers: 0, ..SimConfig::default() };
        let name = scene.name();
        let simulation = Simulation::new(scene, default_rig().expect("valid"), config).expect("valid");
        let pose = |frame| simulation.true_pose(frame);
        let start = pose(0);
        // Back at the start after a lap, heading the same way.
        let (lap, distance) = (100..1200)
            .map(|frame| (frame, (pose(frame).position() - start.position()).norm()))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .expect("frames");
        assert!(distance < 0.25, "{name}: {distance} m from the start at frame {lap}");
        assert!(wrap_angle(pose(lap).heading - start.heading).abs() < 0.2);
        let length = lap as f64 * config.speed * config.interval;
        assert!(length > if name == "corridor" { 60.0 } else { 20.0 }, "{name}: {length} m a lap");
        for frame in 0..1200 {
            let twist = simulation.true_twist(frame);
            assert!(twist.turn.abs() <= 1.5 * twist.speed + 1e-12);
            let stepped = twist.step(&pose(frame), config.interval);
            if frame + 1 < 1200 {
                assert!((stepped.position() - pose(frame + 1).position()).norm() < 1e-12);
            }
            let place = pose(frame).position();
            for turn in (0..24).filter(|_| frame % 5 == 0) {
                let angle = f64::from(turn) * core::f64::consts::TAU / 24.0;
                let direction = Vector2::new(angle.cos(), angle.sin());
                let (distance, _) = simulation.scene().cast(place, direction).expect("closed");
                assert!(distance > 0.3, "{name}: {distance} m from a wall at frame {frame}");
            }
        }
    }
}

#[test]
fn walkers_walk_and_never_jump_and_never_stand_in_a_wall_or_the_robot() {
    for scene in [Scene::corridor(&SceneConfig::default()), Scene::office(&SceneConfig::default())] {
        let name = scene.name();
        let config = SimConfig { walkers: 5, interval: 0.1, frames: 2000, ..SimConfig::default() };
        let simulation = Simulation::new(scene, default_rig().expect("valid"), config).expect("valid");
        let (mut stopped, mut seen) = (0, 0);
        for frame in 1..simulation.len() {
            let robot = simulation.true_pose(frame);
            for (now, before) in simulation.walkers(frame).iter().zip(simulation.walkers(frame - 1)) {
                let moved = (now.position - before.position).norm();
                // Sideways of a bend the outer lane is longer than the path: 1.6 times at its tightest.
                assert!(moved <= 1.6 * MAX_WALKING_SPEED * config.interval, "{name} {frame}: {moved} m");
                stopped += usize::from(moved < 1e-6);
                let away = now.position - robot.position();
                assert!(away.norm() > 0.2, "{name} {frame}: {} m from the robot", away.norm());
                if away.norm() > 1e-9 && frame % 20 == 0 {
                    for foot in now.feet() {
                        let sight = foot - robot.position();
                        seen += usize::from(robot.inverse_transform(foot).x > 0.0);
                        // From the walker's middle to the foot there is no wall.
                        let stride = foot - now.position;
                        let wall = simulation.scene().cast(now.position, stride);
                        assert!(wall.is_none_or(|(distance, _)| distance > 1.0), "{name} {frame}");
                        assert!(sight.norm() > 0.05, "{name} {frame}");
                    }
                }
            }
        }
        assert!(stopped > 100, "{name}: {stopped} times someone stood still");
        assert!(seen > 200, "{name}: {seen} feet before the robot");
    }
}

/// χ² of the odometry's errors under the stated deviations: 2 a frame. The scale errors are common to a run, so
/// runs differ a little more than independent noise would: the bound is on the mean of 20 runs.
#[test]
fn odometry_errors_have_the_stated_deviations() {
    let scene = Scene::corridor(&SceneConfig::default());
    for scale in [1.0, 3.0] {
        let (mut sum, mut count) = ([0.0; 2], 0.0);
        let mut drift = 0.0;
        for seed in 0..20 {
            let config = SimConfig {
                seed,
                walkers: 0,
                frames: 500,
                odometry_noise_scale: scale,
                ..SimConfig::default()
            };
            let simulation = simulate(scene.clone(), config);
            let noise = simulation.odometry_noise();
            assert_eq!(noise, OdometryNoise::default().scaled(scale));
            let (mut turned, mut variance) = (0.0, 0.0);
            for frame in 0..simulation.len() {
                let (truth, measured) = (simulation.true_twist(frame), simulation.odometry(frame));
                let std = noise.std(truth);
                let errors =
                    [(measured.speed - truth.speed) / std.speed, (measured.turn - truth.turn) / std.turn];
                sum = [sum[0] + errors[0] * errors[0], sum[1] + errors[1] * errors[1]];
                count += 1.0;
                turned += measured.turn - truth.turn;
                variance += std.turn * std.turn;
            }
            drift += turned * turned / variance;
        }
        // 10,000 samples: the mean of χ²(1) is 1 ± 0.014; 3σ.
        for mean in sum.map(|sum| sum / count) {
            assert!((mean - 1.0).abs() < 0.04, "{mean}");
        }
        // Heading drift of whole runs against the white-noise sum: χ²(20)/20, 3σ is 0.95, scale errors add little.
        let drift = drift / 20.0;
        assert!((0.2..2.0).contains(&drift), "drift {drift}");
    }
}

#[test]
fn laser_ranges_agree_with_ray_casting_within_their_noise() {
    let config = SimConfig { walkers: 0, frames: 200, ..SimConfig::default() };
    let simulation = corridor(config);
    let LaserConfig { range_std, max_range, beams, .. } = config.laser;
    let (mut sum, mut count) = (0.0, 0.0);
    for frame in (0..200).step_by(10) {
        let pose = simulation.true_pose(frame);
        let scan = simulation.laser(frame);
        assert_eq!(scan.len(), beams);
        for beam in scan {
            let angle = pose.heading + beam.bearing;
            let direction = Vector2::new(angle.cos(), angle.sin());
            let (truth, _) = simulation.scene().cast(pose.position(), direction).expect("closed");
            match beam.range {
                Some(range) => {
                    let error = (range - truth) / range_std;
                    assert!(error.abs() < 6.0, "{range} instead of {truth}");
                    sum += error * error;
                    count += 1.0;
                }
                None => assert!(truth > max_range - 6.0 * range_std),
            }
        }
    }
    assert!((sum / count - 1.0_f64).abs() < 0.1, "χ² {}", sum / count);
}

#[test]
fn people_stop_laser_beams() {
    let simulation = corridor(SimConfig { walkers: 4, ..SimConfig::default() });
    let mut hits = 0;
    for frame in 0..200 {
        let pose = simulation.true_pose(frame);
        for beam in simulation.laser(frame) {
            let angle = pose.heading + beam.bearing;
            let direction = Vector2::new(angle.cos(), angle.sin());
            let (wall, _) = simulation.scene().cast(pose.position(), direction).expect("closed");
            if let Some(range) = beam.range.filter(|range| *range < wall - 0.1) {
                let end = pose.position() + direction * range;
                let nearest = simulation.walkers(frame).iter().flat_map(|walker| walker.feet());
                let nearest = nearest.map(|foot| (foot - end).norm()).fold(f64::MAX, f64::min);
                assert!(nearest < 0.15, "an echo {nearest} m from any leg");
                hits += 1;
            }
        }
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn absurd_settings_are_named() {
    let settings = [
        SimConfig { interval: 0.0, ..SimConfig::default() },
        SimConfig { speed: f64::NAN, ..SimConfig::default() },
        SimConfig { pixel_noise: -1.0, ..SimConfig::default() },
        SimConfig { interval: 10.0, ..SimConfig::default() },
    ];
    let names = settings.map(|config| {
        let scene = Scene::table2(&SceneConfig::default());
        let error = Simulation::new(scene, default_rig().expect("valid"), config).err().expect("refused");
        error.to_string()
    });
    for (message, name) in names.iter().zip(["interval", "speed", "pixel_noise", "interval · speed"]) {
        assert!(message.starts_with(name), "{message}");
    }
}

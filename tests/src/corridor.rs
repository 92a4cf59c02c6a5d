//! The pipeline on a simulated corridor, and how well it did against the truth.
use monorange_core::Result;
use monorange_core::geometry::{Pose, RangeFinder, wrap_angle};
use monorange_core::image::Grey;
use monorange_core::pipeline::{Config, Memory, MotionFrom, MotionNoise, Odometry, OnHeap, Pipeline};
use monorange_core::slam::{Reason, Verdict};
use monorange_sim::{MOUNT_STD, Simulation};
use nalgebra::{Vector2, Vector3};

/// The rig in the pipeline's precision.
///
/// # Errors
/// None for a rig that is valid already.
pub fn single_precision(finder: &RangeFinder<f64>) -> Result<RangeFinder<f32>> {
    finder.cast()
}

/// The settings that fit a simulation: its rig, and the noise its odometry was drawn with.
///
/// # Errors
/// None for a simulation that could be made.
pub fn config_for(simulation: &Simulation) -> Result<Config> {
    let mut config = Config::new(single_precision(simulation.rig())?);
    let [height, tilt, roll, yaw, ..] = MOUNT_STD.map(|std| std as f32);
    config.mount_std = [height, tilt, roll, yaw];
    let noise = simulation.odometry_noise();
    config.motion = MotionNoise {
        speed_by_speed: noise.speed_by_speed.hypot(noise.speed_scale) as f32,
        turn_by_turn: noise.turn_by_turn.hypot(noise.turn_scale) as f32,
        turn_by_speed: noise.turn_by_speed as f32,
        ..MotionNoise::default()
    };
    Ok(config)
}

/// The start is known exactly: for so many pictures the pose's covariance is nearly singular, and NEES only rounding.
const SETTLED: usize = 10;

/// What goes wrong on a drive that the settings do not tell of.
#[derive(Default)]
pub struct Trouble<'a> {
    /// Shares by which the wheels read travel and turn too long.
    pub wheels_long: [f64; 2],
    /// From this picture on the camera sits as this simulation of the same drive has it.
    pub knock: Option<(usize, &'a Simulation)>,
}

/// Metres after a knock from which on poses are judged again.
const RECOVERY: f64 = 20.0;

/// How a run went.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// As the filter itself says.
    pub verdict: Verdict,
    /// What it says against itself.
    pub reason: Option<Reason>,
    /// The wheels' errors as estimated and their standard deviations.
    pub wheels: [[f32; 3]; 2],
    /// The mount's.
    pub mount: [[f32; 4]; 2],
    /// Share of the poses within 3σ, the worst of x, y, heading, from 20 m after a knock on.
    pub recovered: f64,
    /// Length of the way, m.
    pub path: f64,
    /// Corners reported, and those within 3 px of a true one that could be seen.
    pub corners: [usize; 2],
    /// True corners that could be seen at 0.5 m to 6 m, and those that were reported.
    pub visible: [usize; 2],
    /// |range error| / range of true corners within 3 m, sorted.
    pub range_errors: Vec<f64>,
    /// The same of those 2.5 to 3.5 m away.
    pub range_errors_at_3_m: Vec<f64>,
    /// Distance from the true position at the end, m.
    pub end_error: f64,
    /// Root mean square distance from the true position, m.
    pub position_rms: f64,
    /// The worst of x, y, heading: share of poses within 3σ.
    pub within_3_sigma: f64,
    /// Mean NEES of the pose (3 is right).
    pub nees: f64,
    /// Landmarks at the end, and true corners that were ever reported.
    pub map: [usize; 2],
    /// Distances of landmarks from the nearest true corner, m, sorted.
    pub landmark_errors: Vec<f64>,
    /// Updates by a corner that is not the landmark's true one, and updates.
    pub wrong: [usize; 2],
}

impl Score {
    /// Share of reported corners that are true.
    pub fn precision(&self) -> f64 {
        self.corners[1] as f64 / self.corners[0].max(1) as f64
    }

    /// Share of visible corners that are reported.
    pub fn recall(&self) -> f64 {
        self.visible[1] as f64 / self.visible[0].max(1) as f64
    }

    /// Share of the way that the end is off by.
    pub fn end_share(&self) -> f64 {
        self.end_error / self.path
    }
}

/// The middle one of sorted numbers; 0 without any.
pub fn median(sorted: &[f64]) -> f64 {
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Runs the pipeline over a whole simulation.
///
/// # Errors
/// What the pipeline or the simulator refuses.
pub fn run(simulation: &Simulation, config: Config) -> Result<Score> {
    run_into(simulation, config, &Trouble::default())
}

/// As [`run`], into trouble. Where the motion is the pictures' there are no wheels.
///
/// # Errors
/// As [`run`].
pub fn run_into(simulation: &Simulation, config: Config, trouble: &Trouble<'_>) -> Result<Score> {
    let with_wheels = config.motion_from != MotionFrom::Pictures;
    let camera = *simulation.rig().camera();
    let (width, height) = (camera.width(), camera.height());
    let mut pipeline = Pipeline::<OnHeap>::new(config, Memory::on_heap(width, height, 512))?;
    let mut pixels = vec![0; width * height];
    let mut score = Score::default();
    let world_from_start = simulation.true_pose(0);
    let (mut squares, mut inside, mut nees) = (0.0, [0usize; 3], 0.0);
    let (mut knocked_at, mut recovered, mut judged) = (f64::INFINITY, [0usize; 3], 0);
    let mut reported = std::collections::BTreeSet::new();
    let mut owners = std::collections::BTreeMap::new();
    for frame in 0..simulation.len() {
        let time = simulation.time(frame);
        if let Some(before) = frame.checked_sub(1) {
            let (twist, seconds) = (simulation.odometry(before), time - simulation.time(before));
            let [v, omega] =
                [twist.speed * (1.0 + trouble.wheels_long[0]), twist.turn * (1.0 + trouble.wheels_long[1])];
            let (v, omega) = (v as f32, omega as f32);
            if with_wheels {
                pipeline.odometry(time, &Odometry::Velocity { v, omega, seconds: seconds as f32 })?;
            }
            let [from, to] = [before, frame].map(|frame| simulation.true_pose(frame).position());
            score.path += (to - from).norm();
        }
        let knocked = trouble.knock.filter(|(from, _)| frame >= *from).map(|(_, knocked)| knocked);
        if knocked.is_some() {
            knocked_at = knocked_at.min(score.path);
        }
        let seen = knocked.unwrap_or(simulation);
        seen.render(frame, &mut pixels)?;
        let report = pipeline.step(time, Grey::new(&pixels, width, height)?)?;

        let truth = seen.visible_corners(frame);
        for corner in &report.corners {
            let pixel: Vector2<f64> = corner.pixel.cast();
            let distance = |true_pixel: Vector2<f64>| (true_pixel - pixel).norm();
            let nearest = truth.iter().min_by(|a, b| distance(a.pixel).total_cmp(&distance(b.pixel)));
            let nearest = nearest.filter(|true_corner| distance(true_corner.pixel) <= 3.0);
            score.corners[0] += 1;
            score.corners[1] += usize::from(nearest.is_some());
            let Some(true_corner) = nearest else { continue };
            reported.insert(true_corner.id);
            let range_error = (f64::from(corner.range) / true_corner.range - 1.0).abs();
            if true_corner.range <= 3.0 {
                score.range_errors.push(range_error);
            }
            if (2.5..3.5).contains(&true_corner.range) {
                score.range_errors_at_3_m.push(range_error);
            }
            if let (Some(landmark), Some(_)) = (corner.outcome.landmark, corner.outcome.nis) {
                let owner = *owners.entry(landmark).or_insert(true_corner.id);
                score.wrong[0] += usize::from(owner != true_corner.id);
                score.wrong[1] += 1;
            }
        }
        for true_corner in truth.iter().filter(|corner| (0.5..6.0).contains(&corner.range)) {
            let seen = |pixel: Vector2<f32>| (pixel.cast::<f64>() - true_corner.pixel).norm() <= 3.0;
            score.visible[0] += 1;
            score.visible[1] += usize::from(report.corners.iter().any(|corner| seen(corner.pixel)));
        }

        let start_from_robot = world_from_start.inverse().compose(&simulation.true_pose(frame));
        let estimate =
            Pose::<f64>::new(report.pose.x.into(), report.pose.y.into(), report.pose.heading.into());
        let error = Vector3::<f64>::new(
            estimate.x - start_from_robot.x,
            estimate.y - start_from_robot.y,
            wrap_angle(estimate.heading - start_from_robot.heading),
        );
        let covariance = report.pose_covariance.cast::<f64>();
        let after = score.path >= knocked_at + RECOVERY;
        judged += usize::from(after);
        for axis in 0..3 {
            let holds = error[axis].abs() <= 3.0 * covariance[(axis, axis)].sqrt() + 1e-6;
            inside[axis] += usize::from(holds);
            recovered[axis] += usize::from(holds && after);
        }
        if frame >= SETTLED {
            nees += covariance.try_inverse().map_or(f64::INFINITY, |inverse| error.dot(&(inverse * error)));
        }
        score.end_error = error.xy().norm();
        squares += error.xy().norm_squared();
    }
    let frames = simulation.len() as f64;
    score.position_rms = (squares / frames).sqrt();
    score.recovered = recovered.into_iter().min().unwrap_or(0) as f64 / f64::from(judged.max(1) as u32);
    (score.verdict, score.reason) = (pipeline.health().verdict(), pipeline.health().reason());
    let filter = pipeline.filter();
    if let (Some(error), Some(covariance)) = (filter.wheels_error(), filter.wheels_error_covariance()) {
        score.wheels = [error.into(), covariance.diagonal().map(f32::sqrt).into()];
    }
    if let (Some(error), Some(covariance)) = (filter.mount_error(), filter.mount_error_covariance()) {
        score.mount = [error.into(), covariance.diagonal().map(f32::sqrt).into()];
    }
    score.within_3_sigma = inside.into_iter().min().unwrap_or(0) as f64 / frames;
    score.nees = nees / (frames - SETTLED as f64).max(1.0);
    score.range_errors.sort_by(f64::total_cmp);
    score.range_errors_at_3_m.sort_by(f64::total_cmp);
    let landmarks = pipeline.filter().landmarks().iter();
    let confirmed: Vec<_> =
        landmarks.filter(|landmark| landmark.status == monorange_core::slam::Status::Confirmed).collect();
    score.map = [confirmed.len(), reported.len()];
    for position in confirmed.iter().filter_map(|landmark| pipeline.filter().position(landmark)) {
        let in_world = world_from_start.transform(position.cast());
        let distances = simulation.landmarks().iter().map(|landmark| (landmark.position - in_world).norm());
        score.landmark_errors.push(distances.fold(f64::INFINITY, f64::min));
    }
    score.landmark_errors.sort_by(f64::total_cmp);
    Ok(score)
}

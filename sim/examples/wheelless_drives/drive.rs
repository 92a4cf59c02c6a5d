//! Seeded drives without wheels: mixed scenes, walkers and contrast, and whether the verdict tells the truth about them.
use monorange_core::Result;
use monorange_core::geometry::{Camera, Mount, Pose, RangeFinder, wrap_angle};
use monorange_core::image::Grey;
use monorange_core::pipeline::{Config, Memory, MotionFrom, MovedBy, OnHeap, Pipeline};
use monorange_core::slam::Verdict;
use monorange_sim::{MOUNT_STD, Random, Scene, SceneConfig, SimConfig, Simulation, Stream, default_rig};
use nalgebra::{Matrix3, Vector3};

/// Pictures of a drive.
pub(crate) const FRAMES: usize = 250;

/// Of the pictures, against Table 1's.
const SCALE: f64 = 0.75;

/// A drive and how its pictures are spoilt.
pub(crate) struct Course {
    /// Scene, walkers and contrast in words.
    pub(crate) title: String,
    /// The camera as its owner measured its mount.
    finder: RangeFinder<f32>,
    simulation: Simulation,
    contrast: f64,
    flicker: f64,
}

/// Table 1's camera with three quarters of its pixels a side, on a mount that is off by what its owner's care leaves.
fn rigs(random: &mut Random) -> Result<[RangeFinder<f64>; 2]> {
    let full = default_rig()?;
    let camera = full.camera();
    let principal = camera.principal().map(|centre| (centre + 0.5) * SCALE - 0.5);
    let (focal, skew) = (camera.focal() * SCALE, camera.skew() * SCALE);
    let camera = Camera::with_lens(240, 180, focal.into(), principal.into(), skew, *camera.lens())?;
    let nominal = full.mount().parameters();
    // Uniform with the standard deviation that is told.
    let true_mount = core::array::from_fn(|at| nominal[at] + MOUNT_STD[at] * random.within(-1.7, 1.7));
    Ok([RangeFinder::new(camera, Mount::new(nominal)?), RangeFinder::new(camera, Mount::new(true_mount)?)])
}

/// The drive that the seed chooses.
///
/// # Errors
/// None in practice: all settings lie within what the simulator takes.
pub(crate) fn course(seed: u64) -> Result<Course> {
    let mut random = Random::new(seed, Stream::Experiment(18));
    let [nominal, rig] = rigs(&mut random)?;
    let scene_config = SceneConfig {
        seed,
        texture: random.within(0.4, 1.2),
        posters: random.unit() < 0.7,
        ..SceneConfig::default()
    };
    let office = random.unit() < 0.5;
    let scene = if office { Scene::office(&scene_config) } else { Scene::corridor(&scene_config) };
    let walkers = random.within(0.0, 13.0) as usize;
    let speed = random.within(0.15, 0.4);
    let contrast = if random.unit() < 0.6 { 1.0 } else { random.within(0.25, 1.0) };
    let flicker = if random.unit() < 0.7 { 0.0 } else { 0.2 };
    let settings = SimConfig { seed, frames: FRAMES, walkers, speed, ..SimConfig::default() };
    let simulation = Simulation::new(scene, rig, settings)?;
    let name = simulation.scene().name();
    let title =
        format!("{seed} {name}, {walkers} walkers, {speed:.2} m/s, contrast {contrast:.2} ± {flicker}");
    Ok(Course { title, finder: nominal.cast()?, simulation, contrast, flicker })
}

impl Course {
    /// Draws a picture with its contrast, and with a lamp that flickers.
    fn render(&self, frame: usize, random: &mut Random, pixels: &mut [u8]) -> Result<()> {
        self.simulation.render(frame, pixels)?;
        let Self { contrast, flicker, .. } = *self;
        let gain = contrast * (1.0 + random.within(-flicker, flicker));
        let shift = 100.0 * flicker * random.within(-1.0, 1.0);
        if contrast < 1.0 || flicker > 0.0 {
            for pixel in pixels {
                let grey = 128.0 + gain * (f64::from(*pixel) - 128.0) + shift;
                *pixel = grey.round().clamp(0.0, 255.0) as u8;
            }
        }
        Ok(())
    }
}

/// How a drive went, and what the filter said of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Judged {
    /// Length of the way, m.
    pub(crate) path: f64,
    /// Distance from the true position at the end, m.
    pub(crate) end_error: f64,
    /// Mean NEES of the pose over 3; infinite where a covariance is not positive definite.
    pub(crate) nees: f64,
    /// Share of poses of whose three errors all are within 3σ; one that cannot be judged is not.
    pub(crate) within_3_sigma: f64,
    /// Poses whose covariance is not positive definite.
    pub(crate) indefinite: usize,
    /// Pictures whose motion was not measured.
    pub(crate) unmeasured: usize,
    /// The largest standard deviation of the heading, rad.
    pub(crate) heading_std: f64,
    /// At the end of the drive.
    pub(crate) verdict: Verdict,
    /// Why.
    pub(crate) why: String,
}

impl Judged {
    /// Whether nobody should believe the run.
    pub(crate) fn is_wrong(&self) -> bool {
        !(self.nees <= 5.0 && self.end_error <= 0.05 * self.path)
    }

    /// Whether everybody can.
    pub(crate) fn is_right(&self) -> bool {
        self.nees < 2.0 && !self.is_wrong()
    }
}

/// Pictures after which the pose's covariance is regular.
const SETTLED: usize = 10;

/// Goes through a drive without wheels.
///
/// # Errors
/// What the pipeline or the simulator refuses.
pub(crate) fn judge(course: &Course) -> Result<Judged> {
    let Course { finder, simulation, .. } = course;
    let mut config = Config::new(*finder);
    config.motion_from = MotionFrom::Pictures;
    config.mount_std = core::array::from_fn(|at| MOUNT_STD[at] as f32);
    let (width, height) = (finder.camera().width(), finder.camera().height());
    let mut pipeline = Pipeline::<OnHeap>::new(config, Memory::on_heap(width, height, 512))?;
    let mut random = Random::new(simulation.config().seed, Stream::Experiment(19));
    let mut pixels = vec![0; width * height];
    let mut judged = Judged::default();
    let (mut inside, mut sum) = (0usize, 0.0);
    let world_from_start = simulation.true_pose(0);
    let mut before = world_from_start;
    for index in 0..FRAMES {
        course.render(index, &mut random, &mut pixels)?;
        let report = pipeline.step(simulation.time(index), Grey::new(&pixels, width, height)?)?;
        judged.unmeasured += usize::from(report.moved_by == MovedBy::Held);
        let true_pose = simulation.true_pose(index);
        let truth = world_from_start.inverse().compose(&true_pose);
        judged.path += (true_pose.position() - before.position()).norm();
        before = true_pose;
        let error = Vector3::new(
            f64::from(report.pose.x) - truth.x,
            f64::from(report.pose.y) - truth.y,
            wrap_angle(f64::from(report.pose.heading) - truth.heading),
        );
        judged.end_error = error.xy().norm();
        let covariance: Matrix3<f64> = report.pose_covariance.cast();
        judged.heading_std = judged.heading_std.max(covariance.m33.max(0.0).sqrt());
        if index < SETTLED {
            inside += 1;
            continue;
        }
        let mut real = covariance;
        real.fill_upper_triangle_with_lower_triangle();
        match real.cholesky() {
            Some(_) => {
                let nees = pipeline.filter().pose_nees(&Pose::new(
                    truth.x as f32,
                    truth.y as f32,
                    truth.heading as f32,
                ));
                sum += nees.map_or(f64::INFINITY, f64::from);
                let within = |axis: usize| error[axis].abs() <= 3.0 * covariance[(axis, axis)].sqrt();
                inside += usize::from((0..3).all(within));
            }
            None => {
                judged.indefinite += 1;
                sum = f64::INFINITY;
            }
        }
    }
    judged.nees = sum / 3.0 / (FRAMES - SETTLED) as f64;
    judged.within_3_sigma = inside as f64 / FRAMES as f64;
    judged.verdict = pipeline.health().verdict();
    let health = pipeline.health();
    let frames = &health.frames;
    judged.why = format!(
        "NIS {:.2} beyond {}/{} σ_p {:.3} of the path, strangers {:.2?} {:?}",
        health.mean_nis(),
        health.beyond_gate,
        health.measurements,
        frames.last.map_or(0.0, |frame| frame.position_variance.sqrt()) / frames.path,
        frames.strangers(),
        health.reason()
    );
    Ok(judged)
}

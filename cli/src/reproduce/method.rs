//! The ways to run the pipeline that are compared: ours, and the paper's with and without its homography.
use monorange_core::features::Features;
use monorange_core::geometry::Pose;
use monorange_core::image::Grey;
use monorange_core::pipeline::{Carrier, Config, Memory, Odometry, OnHeap, Pipeline, Report};
use monorange_formats::evaluation::Pair;
use monorange_formats::files::Stamped;
use monorange_formats::{Error, Result};
use monorange_sim::Simulation;

/// A way to run the pipeline.
#[derive(Clone, Copy)]
pub(super) struct Method {
    /// Its name in tables.
    pub(super) name: &'static str,
    /// Its settings, from the defaults for the drive.
    pub(super) config: fn(Config) -> Config,
}

/// Ours first.
pub(super) const METHODS: [Method; 3] = [
    Method { name: "ours", config: |defaults| Config { carrier: Carrier::Floor, ..defaults } },
    Method { name: "as in the paper", config: paper },
    Method {
        name: "paper, no homography",
        config: |defaults| Config { carrier: Carrier::Map, ..paper(defaults) },
    },
];

fn paper(defaults: Config) -> Config {
    let Config { motion, finder, .. } = defaults;
    Config { motion, ..Config::as_in_the_paper(finder) }
}

/// A method on its way through a drive.
pub(super) struct Runner {
    pub(super) pipeline: Pipeline<OnHeap>,
    pub(super) pairs: Vec<Pair>,
}

impl Runner {
    pub(super) fn new(method: &Method, defaults: Config, frames: usize) -> Result<Self> {
        let config = (method.config)(defaults);
        let camera = config.finder.camera();
        let memory = Memory::on_heap(camera.width(), camera.height(), 512);
        let pipeline = Pipeline::new(config, memory).map_err(Error::new)?;
        Ok(Self { pipeline, pairs: Vec::with_capacity(frames) })
    }

    /// Takes the wheels' reading since the picture before, and the picture.
    pub(super) fn step(
        &mut self,
        time: f64,
        wheels: Option<Odometry>,
        picture: Grey<'_>,
        features: &Features,
    ) -> monorange_core::Result<Report> {
        if let Some(reading) = wheels {
            self.pipeline.odometry(time, &reading)?;
        }
        self.pipeline.step_with_features(time, picture, features, |_| ())
    }

    /// Keeps the pose for the errors.
    pub(super) fn note(&mut self, time: f64, truth: Pose<f64>) {
        let filter = self.pipeline.filter();
        let Pose { x, y, heading } = filter.pose();
        let pose = Pose { x: x.into(), y: y.into(), heading: heading.into() };
        let estimate = Stamped { time, pose, covariance: Some(filter.pose_covariance().cast()) };
        self.pairs.push(Pair { estimate, truth });
    }
}

/// What the wheels say of the way from the frame before.
pub(super) fn wheels_before(simulation: &Simulation, frame: usize) -> Option<Odometry> {
    let before = frame.checked_sub(1)?;
    let (twist, seconds) = (simulation.odometry(before), simulation.time(frame) - simulation.time(before));
    let (v, omega) = (twist.speed as f32, twist.turn as f32);
    Some(Odometry::Velocity { v, omega, seconds: seconds as f32 })
}

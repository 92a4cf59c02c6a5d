//! The front door: rows of pictures and odometry in; pose, map and a report out.
//!
//! ```text
//! odometry ──────────────► predict                                                     (8), (12)
//! rows ──► extractor ──► corners ──► pixel, or range and bearing, with covariance      (1)–(7)
//!   │                                  └► association ──► update, birth, upkeep        (9), (13)
//!   └► features ──► homography ──► the robot's step, and where known corners have gone (10), (11)
//! ```
//!
//! [`Config`] is checked once; [`Pipeline`] is the state, and obeys its configuration; each picture gives a
//! [`Report`]. A picture comes whole ([`Pipeline::step`]) or row by row as a serial line delivers it
//! ([`begin`](Pipeline::begin), [`push_row`](Pipeline::push_row), [`finish`](Pipeline::finish)): the same code, and
//! the same bits on every target.
//!
//! The last line of the picture above is worked only where the configuration asks for it ([`Config::carrier`],
//! [`Config::motion_from`]), and needs the features `alloc` and `sift`; without them such a configuration is refused.
mod config;
mod coverage;
mod motion_noise;
#[cfg(all(feature = "alloc", feature = "sift"))]
mod pictures;
#[cfg(all(feature = "alloc", feature = "sift"))]
mod pixel_association;
#[cfg(all(feature = "alloc", feature = "proposals"))]
mod proposed;
#[cfg(all(feature = "alloc", feature = "proposals"))]
mod recovery;
#[cfg(feature = "alloc")]
mod relocation;
mod report;
mod settings;
mod sightings;
mod snapshot;
mod steady;
mod storage;
mod sway;
#[cfg(all(feature = "alloc", feature = "sift"))]
mod visual_motion;

pub use crate::association::Carrier;
pub use config::{Config, CornersFrom, Model, MotionFrom, MountError};
pub use coverage::Coverage;
pub use motion_noise::{MotionNoise, Odometry};
#[cfg(all(feature = "alloc", feature = "proposals"))]
pub use recovery::{Recovered, Recovery};
#[cfg(feature = "alloc")]
pub use relocation::Located;
pub use report::{CornerReport, MovedBy, Report, Stage};
pub use settings::{setting_number, settings};
pub use snapshot::{saved_map, state_len};
#[cfg(feature = "alloc")]
pub use storage::OnHeap;
pub use storage::{Lent, Memory, Storage};
#[cfg(all(feature = "alloc", feature = "sift"))]
pub use visual_motion::{Look, VisualConfig, VisualMotion, VisualStep};

use crate::Result;
use crate::geometry::{Pose, RangeFinder};
use crate::image::Grey;
use crate::lines::{Corner, EdgePoint, Extraction, Extractor, MAX_CORNERS, Truncations};
use crate::slam::{Feature, Filter, Health, Increment, Landmark, Map, MapReport, Outcome};
use coverage::Intervals;
use nalgebra::{Matrix3, Vector3};
#[cfg(all(feature = "alloc", feature = "sift"))]
use pictures::Pictures;
use sightings::{Sightings, alike};
use steady::Moment;

/// The whole pipeline over memory of the kind `S`.
///
/// ```
/// # #[cfg(feature = "alloc")] {
/// use monorange_core::geometry::{Camera, Mount, RangeFinder};
/// use monorange_core::image::Grey;
/// use monorange_core::pipeline::{Config, Memory, Odometry, Pipeline};
/// const W: usize = 160;
/// const H: usize = 120;
/// // A wall's edge at u = 80 comes down to the floor at v = 70.
/// let pixels: Vec<u8> =
///     (0..W * H).map(|k| if k / W > 70 { 60 } else if k % W > 80 { 180 } else { 120 }).collect();
/// let camera = Camera::new(W, H, [180.0, 180.0], [80.0, 60.0], 0.0, Default::default())?;
/// let finder = RangeFinder::new(camera, Mount::new([0.4, 0.1, 0.0, 0.0, 0.0, 0.0])?);
/// let mut pipeline = Pipeline::new(Config::new(finder), Memory::on_heap(W, H, 32))?;
/// pipeline.odometry(0.1, &Odometry::Velocity { v: 0.2, omega: 0.0, seconds: 0.1 })?;
/// let report = pipeline.step(0.1, Grey::new(&pixels, W, H)?)?;
/// assert_eq!(report.corners.len(), 1);
/// assert!((report.corners[0].range - 2.5).abs() < 0.1);
/// # }
/// # Ok::<(), monorange_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Pipeline<S: Storage> {
    config: Config,
    extractor: Extractor<S::Words, S::Masks, S::Points, S::Extraction>,
    map: Map<f32, S::Numbers, S::Landmarks>,
    frame: u32,
    intervals: Intervals,
    moment: Moment,
    /// What pictures tell beside their corners, where they are asked.
    #[cfg(all(feature = "alloc", feature = "sift"))]
    pictures: Option<alloc::boxed::Box<Pictures>>,
    /// Finds the corners in the extractor's place, where it is asked.
    #[cfg(all(feature = "alloc", feature = "proposals"))]
    proposer: Option<alloc::boxed::Box<crate::proposals::OnHeap>>,
}

impl<S: Storage> Pipeline<S> {
    /// A pipeline at the world's origin with an empty map.
    ///
    /// # Errors
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) for an unusable setting, [`Error::Size`](crate::Error::Size)
    /// when `memory` is too small, [`Error::Unsupported`](crate::Error::Unsupported) where this build lacks what the
    /// settings ask for.
    pub fn new(config: Config, memory: Memory<S>) -> Result<Self> {
        let config = config.validated()?;
        config.supported()?;
        let Memory { words, masks, points, extraction, numbers, landmarks } = memory;
        let extractor = Extractor::with(config.extract, config.finder, words, masks, points, extraction)?;
        let filter = Filter::new(numbers, landmarks, Pose::default(), Matrix3::zeros(), config.filter)?;
        let map = Map::new(filter, config.map)?;
        Ok(Self {
            #[cfg(all(feature = "alloc", feature = "sift"))]
            pictures: Pictures::new(&config)?,
            #[cfg(all(feature = "alloc", feature = "proposals"))]
            proposer: proposed::proposer(&config)?,
            config,
            extractor,
            map,
            frame: 0,
            intervals: Intervals::default(),
            moment: Moment::default(),
        })
    }

    /// The settings.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Pose, map and their covariance.
    pub fn filter(&self) -> &Filter<f32, S::Numbers, S::Landmarks> {
        self.map.filter()
    }

    /// How far the filter's own figures can be believed.
    pub fn health(&self) -> &Health<f32> {
        self.map.health()
    }

    /// Pictures so far.
    pub fn frames(&self) -> u32 {
        self.frame
    }

    /// The range finder with the mount as estimated so far.
    pub fn finder(&self) -> RangeFinder<f32> {
        self.filter().finder().unwrap_or(self.config.finder)
    }

    /// Takes one reading of the robot's odometry, which holds for its seconds up to `time`. Any number may come
    /// between two pictures, in order and cut at the pictures' times; what the intervals leave out or cover twice is in
    /// the [`Report`].
    ///
    /// The robot moves at once, or with the next picture where that has its part in the motion; where none comes,
    /// [`advance`](Self::advance) or another sensor's [`measure`](Self::measure) moves it.
    ///
    /// # Errors
    /// [`Error::TimeBackwards`](crate::Error::TimeBackwards);
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) for a number that is not finite.
    pub fn odometry(&mut self, time: f64, odometry: &Odometry) -> Result<()> {
        self.moved(time, &self.config.motion.increment(odometry))?;
        self.moment.note(odometry);
        self.intervals.reading(time, odometry.seconds().into());
        Ok(())
    }

    /// Takes a step of the robot with its covariance, from the time of the reading before up to `time` in seconds, as
    /// other sensors measure it. It stands for [`odometry`](Self::odometry).
    ///
    /// # Errors
    /// As [`odometry`](Self::odometry).
    pub fn motion(&mut self, time: f64, increment: &Increment<f32>) -> Result<()> {
        self.moved(time, increment)?;
        self.intervals.step(time);
        Ok(())
    }

    /// Brings the robot up to `time` where no picture comes: what waits for one moves it now, and it stands from there on.
    ///
    /// # Errors
    /// As [`odometry`](Self::odometry).
    pub fn advance(&mut self, time: f64) -> Result<()> {
        #[cfg(all(feature = "alloc", feature = "sift"))]
        if let Some((until, step)) = self.pictures.as_deref_mut().and_then(Pictures::take_waiting) {
            self.map.filter_mut().predict_driven(until, &step)?;
        }
        if time <= self.filter().time() {
            return Ok(());
        }
        let still = Increment { delta: Vector3::zeros(), covariance: Matrix3::zeros() };
        self.map.filter_mut().predict(time, &still)
    }

    /// Moves the robot, or keeps the step for the picture that has its part in it.
    fn moved(&mut self, time: f64, step: &Increment<f32>) -> Result<()> {
        #[cfg(all(feature = "alloc", feature = "sift"))]
        if let Some(pictures) = &mut self.pictures {
            let filter = self.map.filter_mut();
            return pictures.take_step(filter, time, step);
        }
        self.map.filter_mut().predict_driven(time, step)
    }

    /// Takes a whole picture, as of `time` in seconds.
    ///
    /// # Errors
    /// As [`push_row`](Self::push_row) and [`finish`](Self::finish).
    pub fn step(&mut self, time: f64, picture: Grey<'_>) -> Result<Report> {
        self.step_timed(time, picture, |_| ())
    }

    /// As [`step`](Self::step); `ended` is called at the end of each stage, for a clock.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn step_timed(
        &mut self,
        time: f64,
        picture: Grey<'_>,
        mut ended: impl FnMut(Stage),
    ) -> Result<Report> {
        self.push_rows(picture)?;
        ended(Stage::Rows);
        self.finish_timed(time, ended)
    }

    fn push_rows(&mut self, picture: Grey<'_>) -> Result<()> {
        self.begin();
        picture.rows().try_for_each(|row| self.push_row(row))
    }

    /// Begins a picture; one that was not finished is forgotten.
    pub fn begin(&mut self) {
        self.extractor.begin();
        #[cfg(all(feature = "alloc", feature = "proposals"))]
        if let Some(proposer) = &mut self.proposer {
            proposer.begin();
        }
        #[cfg(all(feature = "alloc", feature = "sift"))]
        if let Some(pictures) = &mut self.pictures {
            pictures.begin();
        }
    }

    /// Takes the next row of the picture.
    ///
    /// # Errors
    /// [`Error::Size`](crate::Error::Size) for a row of another width or one too many.
    pub fn push_row(&mut self, pixels: &[u8]) -> Result<()> {
        self.push_row_to_extractor(pixels)?;
        #[cfg(all(feature = "alloc", feature = "sift"))]
        if let Some(pictures) = &mut self.pictures {
            pictures.push_row(pixels);
        }
        Ok(())
    }

    fn push_row_to_extractor(&mut self, pixels: &[u8]) -> Result<()> {
        #[cfg(all(feature = "alloc", feature = "proposals"))]
        if let Some(proposer) = &mut self.proposer {
            return proposer.push_row(pixels);
        }
        self.extractor.push_row(pixels)
    }

    /// The corners of the picture at hand, and what did not fit.
    fn corners(&mut self) -> Result<(heapless::Vec<Corner, MAX_CORNERS>, Truncations)> {
        #[cfg(all(feature = "alloc", feature = "proposals"))]
        if let Some(proposer) = &mut self.proposer {
            return proposed::corners(proposer);
        }
        let extraction = self.extractor.finish()?;
        Ok((extraction.corners.clone(), extraction.truncations))
    }

    /// Ends the picture: it moves the robot where it has its part in that, and its corners correct pose and map.
    ///
    /// # Errors
    /// [`Error::Size`](crate::Error::Size) when rows are missing,
    /// [`Error::TimeBackwards`](crate::Error::TimeBackwards).
    pub fn finish(&mut self, time: f64) -> Result<Report> {
        self.finish_timed(time, |_| ())
    }

    /// As [`finish`](Self::finish); `ended` is called at the end of each stage but the rows', for a clock.
    ///
    /// # Errors
    /// As [`finish`](Self::finish).
    pub fn finish_timed(&mut self, time: f64, ended: impl FnMut(Stage)) -> Result<Report> {
        let mut report = Report::default();
        self.finish_into(time, &mut report, ended)?;
        Ok(report)
    }

    /// As [`finish_timed`](Self::finish_timed), with the report in the caller's memory: it is long for the stack of a
    /// microcontroller. After an error it says nothing.
    ///
    /// # Errors
    /// As [`finish`](Self::finish).
    pub fn finish_into(
        &mut self,
        time: f64,
        report: &mut Report,
        mut ended: impl FnMut(Stage),
    ) -> Result<()> {
        let (corners, truncations) = self.corners()?;
        ended(Stage::Corners);
        #[cfg(all(feature = "alloc", feature = "sift"))]
        if self.pictures.is_some() {
            self.finish_seeing(time, &corners, None, report, ended)?;
            report.truncations = truncations;
            return Ok(());
        }
        ended(Stage::Motion);
        self.observe_into(time, &corners, report)?;
        report.truncations = truncations;
        ended(Stage::Filter);
        Ok(())
    }

    /// What the lines' extractor found in the last picture, after [`finish`](Self::finish).
    ///
    /// # Errors
    /// [`Error::Size`](crate::Error::Size) when the picture is not complete, and where proposals stand in for lines.
    pub fn extraction(&mut self) -> Result<&Extraction> {
        self.extractor.finish()
    }

    /// What finds the corners where the configuration asks for [`CornersFrom::Proposals`], with what it found in the last picture.
    #[cfg(all(feature = "alloc", feature = "proposals"))]
    pub fn proposer(&self) -> Option<&crate::proposals::OnHeap> {
        self.proposer.as_deref()
    }

    /// The last picture's edge points.
    pub fn edge_points(&self) -> &[EdgePoint] {
        self.extractor.edge_points()
    }

    /// Takes floor corners that were found elsewhere, at most [`MAX_CORNERS`]; of each, pixel, covariance and which
    /// sides are brighter count.
    ///
    /// # Errors
    /// [`Error::TimeBackwards`](crate::Error::TimeBackwards).
    pub fn observe(&mut self, time: f64, corners: &[Corner]) -> Result<Report> {
        let mut report = Report::default();
        self.observe_into(time, corners, &mut report)?;
        Ok(report)
    }

    /// As [`observe`](Self::observe), with the report in the caller's memory; after an error it says nothing.
    ///
    /// # Errors
    /// As [`observe`](Self::observe).
    pub fn observe_into(&mut self, time: f64, corners: &[Corner], report: &mut Report) -> Result<()> {
        self.moment.begin();
        let mut seen = Sightings::default();
        self.sight_all(corners, &mut seen, &mut report.corners);
        self.advance(time)?;
        let mut outcomes = [Outcome::default(); MAX_CORNERS];
        let looks_alike = |index: usize, landmark: &Landmark<f32>| seen.looks_alike(index, landmark);
        self.sway();
        let map = self.map.observe(&seen.features, looks_alike, &mut outcomes)?;
        self.range_again(report);
        for (corner, outcome) in report.corners.iter_mut().zip(&outcomes) {
            corner.outcome = *outcome;
        }
        self.report(time, &seen, map, report);
        Ok(())
    }

    /// What the picture brought, beside its corners.
    fn report(&mut self, time: f64, seen: &Sightings, map: MapReport, report: &mut Report) {
        report.frame = self.frame;
        self.frame += 1;
        report.time = time;
        report.pose = self.filter().pose();
        report.pose_covariance = self.filter().pose_covariance();
        report.without_range = seen.without_range;
        report.moved_by = if self.intervals.moved() { MovedBy::Odometry } else { MovedBy::Nothing };
        report.carried_by = Carrier::Map;
        report.odometry = self.intervals.picture(time);
        report.map = map;
        report.truncations = Default::default();
        seen.as_found(&mut report.corners);
        self.moment.seen = true;
    }

    /// Takes what another sensor measured at `time`: a laser's corners by range and bearing, a beacon's range.
    /// `outcomes` receives one line for each.
    ///
    /// # Errors
    /// [`Error::Size`](crate::Error::Size) when `outcomes` is shorter than `features`,
    /// [`Error::TimeBackwards`](crate::Error::TimeBackwards).
    pub fn measure(
        &mut self,
        time: f64,
        features: &[Feature<f32>],
        outcomes: &mut [Outcome<f32>],
    ) -> Result<MapReport> {
        self.advance(time)?;
        let looks_alike = |index: usize, landmark: &Landmark<f32>| {
            features.get(index).is_some_and(|one| alike(one, landmark))
        };
        self.map.observe(features, looks_alike, outcomes)
    }
}

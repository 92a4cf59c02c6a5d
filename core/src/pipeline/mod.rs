//! The front door: rows of pictures and odometry in; pose, map and a report out.
//!
//! ```text
//! odometry ──────────────► predict                                                     (8), (12)
//! rows ──► extractor ──► corners ──► pixel, or range and bearing, with covariance      (1)–(7)
//!                                      └► association ──► update, birth, upkeep        (9), (13)
//! ```
//!
//! [`Config`] is checked once; the state is the [`Pipeline`]'s filter and extractor; each picture gives a
//! [`Report`]. A picture comes whole ([`Pipeline::step`]) or row by row as a serial line delivers it
//! ([`begin`](Pipeline::begin), [`push_row`](Pipeline::push_row), [`finish`](Pipeline::finish)): the same code, and
//! the same bits on every target.
mod config;
mod motion_noise;
mod pixel_association;
mod report;
mod snapshot;
mod storage;
#[cfg(all(feature = "alloc", feature = "sift"))]
mod visual_motion;

pub use config::{Config, Model, MountError};
pub use motion_noise::{MotionNoise, Odometry};
pub use pixel_association::{Carrier, MAX_REMEMBERED, PixelAssociation};
pub use report::{CornerReport, Report};
pub use snapshot::state_len;
#[cfg(feature = "alloc")]
pub use storage::OnHeap;
pub use storage::{Memory, Storage};
#[cfg(all(feature = "alloc", feature = "sift"))]
pub use visual_motion::{VisualConfig, VisualMotion, VisualStep};

use crate::Result;
use crate::geometry::{Pose, RangeFinder};
use crate::image::Grey;
use crate::lines::{Corner, EdgePoint, Extraction, Extractor, MAX_CORNERS};
use crate::slam::{Feature, Filter, Health, Increment, Landmark, Map, MapReport, Measurement, Outcome};
use nalgebra::{Matrix2, Matrix3, Vector3};

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
    extractor: Extractor<S::Words, S::Masks, S::Points>,
    map: Map<f32, S::Numbers, S::Landmarks>,
    frame: u32,
}

impl<S: Storage> Pipeline<S> {
    /// A pipeline at the world's origin with an empty map.
    ///
    /// # Errors
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) for an unusable setting, [`Error::Size`](crate::Error::Size)
    /// when `memory` is too small.
    pub fn new(config: Config, memory: Memory<S>) -> Result<Self> {
        let config = config.validated()?;
        let Memory { words, masks, points, numbers, landmarks } = memory;
        let extractor = Extractor::new(config.extract, config.finder, words, masks, points)?;
        let filter = Filter::new(numbers, landmarks, Pose::default(), Matrix3::zeros(), config.filter)?;
        let map = Map::new(filter, config.map)?;
        Ok(Self { config, extractor, map, frame: 0 })
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

    /// Moves the robot by one reading of its odometry, up to `time` in seconds.
    ///
    /// # Errors
    /// [`Error::TimeBackwards`](crate::Error::TimeBackwards);
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) for a number that is not finite.
    pub fn odometry(&mut self, time: f64, odometry: &Odometry) -> Result<()> {
        self.map.filter_mut().predict(time, &self.config.motion.increment(odometry))
    }

    /// Moves the robot by a step with its covariance, up to `time` in seconds: from other sensors, or from the
    /// pictures themselves.
    ///
    /// # Errors
    /// As [`odometry`](Self::odometry).
    pub fn motion(&mut self, time: f64, increment: &Increment<f32>) -> Result<()> {
        self.map.filter_mut().predict(time, increment)
    }

    /// As [`motion`](Self::motion), of a step that the camera itself measured: the mount's errors, which are states of the
    /// filter, are shared by all such steps; and where the wheels measured it too, what they differ by corrects the mount.
    ///
    /// # Errors
    /// As [`odometry`](Self::odometry).
    #[cfg(all(feature = "alloc", feature = "sift"))]
    pub fn motion_seen(&mut self, time: f64, step: &VisualStep) -> Result<()> {
        let filter = self.map.filter_mut();
        filter.predict_seen(time, &step.increment, &step.by_mount)?;
        if let Some(by) = &step.disagreement {
            filter.update_mount(&by.arc, &by.covariance, &by.by_mount)?;
        }
        Ok(())
    }

    /// Takes a whole picture, as of `time` in seconds.
    ///
    /// # Errors
    /// As [`push_row`](Self::push_row) and [`finish`](Self::finish).
    pub fn step(&mut self, time: f64, picture: Grey<'_>) -> Result<Report> {
        self.begin();
        for row in picture.rows() {
            self.push_row(row)?;
        }
        self.finish(time)
    }

    /// Begins a picture; one that was not finished is forgotten.
    pub fn begin(&mut self) {
        self.extractor.begin();
    }

    /// Takes the next row of the picture.
    ///
    /// # Errors
    /// [`Error::Size`](crate::Error::Size) for a row of another width or one too many.
    pub fn push_row(&mut self, pixels: &[u8]) -> Result<()> {
        self.extractor.push_row(pixels)
    }

    /// Ends the picture: its corners correct pose and map.
    ///
    /// # Errors
    /// [`Error::Size`](crate::Error::Size) when rows are missing,
    /// [`Error::TimeBackwards`](crate::Error::TimeBackwards).
    pub fn finish(&mut self, time: f64) -> Result<Report> {
        let extraction = self.extractor.finish()?;
        let (corners, truncations) = (extraction.corners.clone(), extraction.truncations);
        let report = self.observe(time, &corners)?;
        Ok(Report { truncations, ..report })
    }

    /// What the extractor found in the last picture, after [`finish`](Self::finish).
    ///
    /// # Errors
    /// [`Error::Size`](crate::Error::Size) when the picture is not complete.
    pub fn extraction(&mut self) -> Result<&Extraction> {
        self.extractor.finish()
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
        let mut seen = self.sightings(corners);
        self.stand_until(time)?;
        let mut outcomes = [Outcome::default(); MAX_CORNERS];
        let looks_alike = |index: usize, landmark: &Landmark<f32>| seen.looks_alike(index, landmark);
        let map = self.map.observe(&seen.features, looks_alike, &mut outcomes)?;
        for (corner, outcome) in seen.corners.iter_mut().zip(outcomes) {
            corner.outcome = outcome;
        }
        Ok(self.report(time, seen, map))
    }

    /// The corners that have a range worth the name, as the filter takes them.
    fn sightings(&self, corners: &[Corner]) -> Sightings {
        let finder = self.finder();
        let mut seen = Sightings::default();
        for corner in corners {
            let used = self.sight(&finder, corner).and_then(|(report, feature)| {
                seen.corners.push(report).ok()?;
                seen.features.push(feature).ok()
            });
            seen.without_range += u32::from(used.is_none());
        }
        seen
    }

    /// Lets time pass without a motion.
    fn stand_until(&mut self, time: f64) -> Result<()> {
        if time <= self.filter().time() {
            return Ok(());
        }
        let still = Increment { delta: Vector3::zeros(), covariance: Matrix3::zeros() };
        self.map.filter_mut().predict(time, &still)
    }

    /// What the picture brought.
    fn report(&mut self, time: f64, seen: Sightings, map: MapReport) -> Report {
        let Sightings { corners, without_range, .. } = seen;
        self.frame += 1;
        Report {
            frame: self.frame - 1,
            time,
            pose: self.filter().pose(),
            pose_covariance: self.filter().pose_covariance(),
            corners,
            without_range,
            map,
            truncations: Default::default(),
        }
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
        self.stand_until(time)?;
        let looks_alike = |index: usize, landmark: &Landmark<f32>| {
            features.get(index).is_some_and(|one| alike(one, landmark))
        };
        self.map.observe(features, looks_alike, outcomes)
    }

    /// A corner as the filter takes it, or `None` where it has no range worth the name.
    fn sight(&self, finder: &RangeFinder<f32>, corner: &Corner) -> Option<(CornerReport, Feature<f32>)> {
        let (pixel, floor) = (corner.pixel, self.config.corner_std_floor_px);
        let covariance = corner.covariance + Matrix2::identity() * (floor * floor);
        let sighting = finder.sight(pixel).ok()?;
        if sighting.range > self.config.max_range() {
            return None;
        }
        let measurement = match self.config.model {
            Model::Pixel => Measurement::Pixel { pixel, covariance },
            Model::RangeBearing => Measurement::from_floor_pixel(finder, pixel, &covariance)?,
        };
        let report = CornerReport {
            pixel,
            pixel_covariance: covariance,
            range: sighting.range,
            bearing: sighting.bearing,
            covariance: sighting.noise(&covariance),
            outcome: Outcome::default(),
        };
        Some((
            report,
            Feature { pixel: Some(pixel), descriptor: Some(looks(corner)), ..Feature::new(measurement) },
        ))
    }
}

/// A picture's corners as reported and as the map takes them, one to one.
#[derive(Default)]
struct Sightings {
    corners: heapless::Vec<CornerReport, MAX_CORNERS>,
    features: heapless::Vec<Feature<f32>, MAX_CORNERS>,
    without_range: u32,
}

impl Sightings {
    /// Whether a feature may be of a landmark by its looks.
    fn looks_alike(&self, index: usize, landmark: &Landmark<f32>) -> bool {
        self.features.get(index).is_some_and(|feature| alike(feature, landmark))
    }
}

/// Whether a measurement may be of a landmark by its looks; a laser's has none.
fn alike(feature: &Feature<f32>, landmark: &Landmark<f32>) -> bool {
    match (feature.descriptor, landmark.descriptor) {
        (Some(seen), Some(known)) => seen == known,
        _ => true,
    }
}

/// What a corner looks like from anywhere: which side of the vertical edge and of the floor's edge is brighter.
fn looks(corner: &Corner) -> u32 {
    u32::from(corner.brighter_right) | u32::from(corner.brighter_below) << 1
}

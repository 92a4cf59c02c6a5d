//! The robot's motion from its pictures, for sequences that come without odometry.
//!
//! ```text
//! picture → SIFT → matches with the keyframe → metric step over the floor, with covariance → Pipeline::motion
//! ```
//!
//! Memory grows with the picture (about 65 bytes a pixel), so this is for hosts and browsers: features `alloc` and
//! `sift`. The equations are those of [`homography`](crate::homography).
use crate::features::{
    Candidate, Keypoint, Match as Pair, MatchConfig, Nearest, Sift, SiftConfig, SiftDescriptor, SiftWork,
    match_descriptors, sift_samples_len,
};
use crate::geometry::RangeFinder;
use crate::homography::{Match, OdometryConfig, Track, VisualOdometry};
use crate::image::Grey;
use crate::slam::Increment;
use crate::{Error, Result};
use alloc::vec;
use alloc::vec::Vec;
use nalgebra::Vector3;

/// Settings of [`VisualMotion`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisualConfig {
    /// How a step follows from matches.
    pub odometry: OdometryConfig<f32>,
    /// Which keypoints.
    pub sift: SiftConfig,
    /// Which pairs.
    pub matching: MatchConfig,
    /// Standard deviation of a keypoint, px.
    pub keypoint_std_px: f32,
}

impl Default for VisualConfig {
    fn default() -> Self {
        let acceleration = 0.3; // of a robot that drives indoors
        Self {
            odometry: OdometryConfig {
                acceleration_std: acceleration,
                turn_acceleration_std: acceleration,
                ..OdometryConfig::default()
            },
            sift: SiftConfig { doubled: false, contrast: 0.02, ..SiftConfig::default() },
            matching: MatchConfig::default(),
            keypoint_std_px: 0.3,
        }
    }
}

/// A step between two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisualStep {
    /// From the robot at the last picture to the robot at this one.
    pub increment: Increment<f32>,
    /// Whether the pictures gave it; else the last velocity was held.
    pub measured: bool,
    /// Matches with the keyframe.
    pub matches: usize,
}

#[derive(Clone, Debug, Default)]
struct Features {
    keypoints: Vec<Keypoint>,
    descriptors: Vec<SiftDescriptor>,
}

/// Keyframe, last velocity and working memory.
#[derive(Clone, Debug)]
pub struct VisualMotion {
    config: VisualConfig,
    sift: Sift,
    odometry: VisualOdometry<f32>,
    samples: Vec<i16>,
    candidates: Vec<Candidate>,
    keyframe: Option<Features>,
    last_time: f64,
}

impl VisualMotion {
    /// At rest, for pictures of this size.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an unusable setting.
    pub fn new(config: VisualConfig, width: usize, height: usize) -> Result<Self> {
        let std = config.keypoint_std_px;
        if !(std.is_finite() && std > 0.0) {
            let expected = "a finite number above 0";
            return Err(Error::OutOfRange { name: "visual.keypoint_std_px", value: std.into(), expected });
        }
        Ok(Self {
            config,
            sift: Sift::new(config.sift)?,
            odometry: VisualOdometry::new(),
            samples: vec![0; sift_samples_len(width, height, &config.sift)],
            candidates: vec![Candidate::default(); (width * height / 20).max(100)],
            keyframe: None,
            last_time: 0.0,
        })
    }

    /// The step from the last picture to this one, taken at `time` seconds; `None` at the first.
    ///
    /// # Errors
    /// [`Error::Size`] for a picture larger than [`new`](Self::new) was told; [`Error::TimeBackwards`].
    pub fn step(
        &mut self,
        finder: &RangeFinder<f32>,
        time: f64,
        picture: Grey<'_>,
    ) -> Result<Option<VisualStep>> {
        let seen = self.features(picture)?;
        let Some(keyframe) = &self.keyframe else {
            (self.keyframe, self.last_time) = (Some(seen), time);
            return Ok(None);
        };
        if time <= self.last_time {
            return Err(Error::TimeBackwards { time, last: self.last_time });
        }
        let seconds = (time - self.last_time) as f32;
        let matches = self.matches(keyframe, &seen)?;
        let mut tracks = vec![Track::default(); matches.len()];
        let report = self.odometry.step(&self.config.odometry, finder, &matches, seconds, None, &mut tracks);
        if report.new_keyframe {
            self.keyframe = Some(seen);
        }
        self.last_time = time;
        let step = report.increment;
        let delta = Vector3::new(step.x, step.y, step.heading);
        Ok(Some(VisualStep {
            increment: Increment { delta, covariance: report.increment_covariance },
            measured: report.measured,
            matches: matches.len(),
        }))
    }

    fn features(&mut self, picture: Grey<'_>) -> Result<Features> {
        let room = self.candidates.len() / 2;
        let mut features =
            Features { keypoints: vec![Keypoint::default(); room], descriptors: vec![[0; 128]; room] };
        let mut work = SiftWork { samples: &mut self.samples, candidates: &mut self.candidates };
        let report =
            self.sift.detect(picture, &mut work, &mut features.keypoints, &mut features.descriptors)?;
        features.keypoints.truncate(report.keypoints);
        features.descriptors.truncate(report.keypoints);
        Ok(features)
    }

    fn matches(&self, keyframe: &Features, seen: &Features) -> Result<Vec<Match<f32>>> {
        let mut work = vec![Nearest::default(); keyframe.keypoints.len() + seen.keypoints.len()];
        let mut pairs = vec![Pair::default(); keyframe.keypoints.len().min(seen.keypoints.len())];
        let config = &self.config.matching;
        let report =
            match_descriptors(&keyframe.descriptors, &seen.descriptors, config, &mut work, &mut pairs)?;
        let variance = self.config.keypoint_std_px * self.config.keypoint_std_px;
        let pairs = pairs.iter().take(report.matches);
        Ok(pairs
            .filter_map(|pair| {
                let (from, to) = (keyframe.keypoints.get(pair.first)?, seen.keypoints.get(pair.second)?);
                Some(Match::new(from.pixel, to.pixel, variance, variance))
            })
            .collect())
    }
}

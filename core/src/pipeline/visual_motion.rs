//! The robot's motion from its pictures, for sequences that come without odometry.
//!
//! ```text
//! picture ─┬─► SIFT      ─► matches with the keyframe ─┬─► metric step over the floor, with covariance ─► the filter
//!          └─► texture   ─► patches of the floor      ─┘
//! ```
//!
//! Memory grows with the picture (about 65 bytes a pixel), so this is for hosts and browsers: features `alloc` and
//! `sift`. The equations are those of [`homography`](crate::homography).
use crate::features::{Detector, FeatureKind, Features, MatchConfig, SiftConfig};
use crate::geometry::{Camera, RangeFinder};
use crate::homography::{
    Disagreement, FloorTexture, GroundMotion, HomographyConfig, HomographyEstimate, Jolt, Match, MotionPrior,
    MountEvidence, NoMotion, OdometryConfig, Track, VisualOdometry, estimate_homography, floor_matches,
};
use crate::image::Grey;
use crate::slam::Increment;
use crate::{Error, Result};
use alloc::vec;
use alloc::vec::Vec;
use nalgebra::{Matrix2, Matrix3, Matrix3x4, Vector2, Vector3};

/// Settings of [`VisualMotion`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisualConfig {
    /// How a step follows from matches.
    pub odometry: OdometryConfig<f32>,
    /// Which keypoints.
    pub features: FeatureKind,
    /// Which pairs.
    pub matching: MatchConfig,
    /// Standard deviation of a keypoint, px.
    pub keypoint_std_px: f32,
    /// Factor of a step's covariance, for two things that it leaves out. The steps of one keyframe's pictures are
    /// differences of poses that share the keyframe's noise, so that errors of consecutive steps are negatively correlated; their
    /// covariances, which add up to the last pose's, ignore that. And errors of keypoints on one surface are correlated where
    /// the view changes: in simulated corridors the squared error of the turn since the
    /// keyframe was 1.4 times its variance with a keyframe every picture, 2.2 times with one every half of the camera's
    /// height, and 3.8 times with one every height; the path's 0.8 to 1.3 times (`visual_odometry corridor default=
    /// keyframe=0.25 keyframe=1` of the tests' examples, "since keyframe").
    pub covariance_factor: f32,
}

/// Factor of the covariance of what a keyframe says of the mount, and what is added to the angles' deviations, rad. Its errors are those of the next
/// keyframes too: of a floor that mirrors, of a wall's edge. On `dev_home` and `dev_office`, which they were chosen on, twelve
/// keyframes' medians are off by up to 0.3° of tilt and 0.7° of roll and yaw, while each keyframe says 0.1 to 0.4° and is that far from its
/// neighbours.
const MOUNT_FACTOR: f32 = 100.0;
const MOUNT_STD: f32 = core::f32::consts::PI / 180.0;

/// Keypoints on the floor that tell a motion at least, where its texture does not.
const FEW_ON_FLOOR: f32 = 12.0;

impl Default for VisualConfig {
    fn default() -> Self {
        let acceleration = 5.0; // of a car that brakes: no more than a hint, or the steps' errors would all be one
        Self {
            odometry: OdometryConfig {
                acceleration_std: acceleration,
                turn_acceleration_std: acceleration,
                ..OdometryConfig::default()
            },
            features: FeatureKind::Sift(SiftConfig::default()),
            matching: MatchConfig::default(),
            keypoint_std_px: 0.3,
            covariance_factor: 6.0,
        }
    }
}

/// A step between two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisualStep {
    /// From the robot at the last picture to the robot at this one.
    pub increment: Increment<f32>,
    /// ∂increment/∂(height, tilt, roll, yaw) of the mount.
    pub by_mount: Matrix3x4<f32>,
    /// ∂increment/∂(the wheels' errors), as in [`OdometryReport`](crate::homography::OdometryReport).
    pub by_wheels: Matrix3<f32>,
    /// How the wheels differ from the pictures, where a keyframe ends that both have measured.
    pub disagreement: Option<Disagreement<f32>>,
    /// What the matches say of the mount, where a keyframe ends, as far as it can be taken for knowledge.
    pub mount: Option<MountEvidence<f32>>,
    /// How the camera was knocked since the keyframe, if it was.
    pub jolt: Option<Jolt<f32>>,
    /// Whether the pictures gave it; else the last velocity was held.
    pub measured: bool,
    /// Matches with the keyframe.
    pub matches: usize,
    /// The motion since the keyframe, or why the pictures give none.
    pub motion: core::result::Result<GroundMotion<f32>, NoMotion>,
    /// The free homography of rays, keyframe to this picture, where it is wanted and there is one.
    pub free: Option<HomographyEstimate<f32>>,
    /// Whether this picture is the keyframe from here on.
    pub new_keyframe: bool,
}

/// What a picture shows, as [`VisualMotion::follow`] takes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Its keypoints.
    pub features: Features,
    /// Its texture, where floor is sought by it too.
    pub texture: Option<FloorTexture>,
}

/// Keyframe, last velocity and working memory.
#[derive(Clone, Debug)]
pub struct VisualMotion {
    config: VisualConfig,
    detector: Detector,
    odometry: VisualOdometry<f32>,
    keyframe: Option<Look>,
    last_time: f64,
    /// Whether the free homography is estimated even where the floor's is found.
    free_wanted: bool,
}

impl VisualConfig {
    /// Whether motion can follow with these settings.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name of the first value that cannot be used.
    pub fn check(&self) -> Result<()> {
        let positive = [
            ("visual.keypoint_std_px", self.keypoint_std_px),
            ("visual.covariance_factor", self.covariance_factor),
        ];
        for (name, number) in positive {
            if !(number.is_finite() && number > 0.0) {
                return Err(Error::OutOfRange { name, value: number.into(), expected: "finite and above 0" });
            }
        }
        Ok(())
    }
}

impl VisualMotion {
    /// At rest.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an unusable setting.
    pub fn new(config: VisualConfig) -> Result<Self> {
        config.check()?;
        Ok(Self {
            config,
            detector: Detector::new(config.features)?,
            odometry: VisualOdometry::new(),
            keyframe: None,
            last_time: 0.0,
            free_wanted: false,
        })
    }

    /// The same, with the free homography estimated in every picture.
    pub(super) fn with_free_homography(self) -> Self {
        Self { free_wanted: true, ..self }
    }

    /// A picture's keypoints, as [`follow`](Self::follow) takes them.
    pub(super) fn detect(&mut self, picture: Grey<'_>) -> Result<Features> {
        self.detector.detect(picture)
    }

    /// The step from the last picture to this one, taken at `time` seconds; `None` at the first.
    ///
    /// # Errors
    /// [`Error::Size`] for a picture of more than 16,384 pixels a side; [`Error::TimeBackwards`].
    pub fn step(
        &mut self,
        finder: &RangeFinder<f32>,
        time: f64,
        picture: Grey<'_>,
    ) -> Result<Option<VisualStep>> {
        self.step_with(finder, time, None, picture)
    }

    /// As [`step`](Self::step) with `odometry`, the wheels' step since the last picture: the step is then both
    /// together.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn step_with(
        &mut self,
        finder: &RangeFinder<f32>,
        time: f64,
        odometry: Option<&Increment<f32>>,
        picture: Grey<'_>,
    ) -> Result<Option<VisualStep>> {
        let features = self.detector.detect(picture)?;
        let texture = Some(FloorTexture::new(finder.camera(), picture));
        self.follow(finder, time, odometry, Look { features, texture })
    }

    /// As [`step_with`](Self::step_with), of what was found elsewhere.
    ///
    /// # Errors
    /// [`Error::TimeBackwards`].
    pub fn follow(
        &mut self,
        finder: &RangeFinder<f32>,
        time: f64,
        odometry: Option<&Increment<f32>>,
        seen: Look,
    ) -> Result<Option<VisualStep>> {
        let Some(keyframe) = &self.keyframe else {
            (self.keyframe, self.last_time) = (Some(seen), time);
            return Ok(None);
        };
        if time <= self.last_time {
            return Err(Error::TimeBackwards { time, last: self.last_time });
        }
        let seconds = (time - self.last_time) as f32;
        let mut matches = self.matches(&keyframe.features, &seen.features)?;
        let wheels = odometry.map(prior);
        let (of_keypoints, mut config) = (matches.len(), self.config.odometry);
        if let (Some(before), Some(now)) = (&keyframe.texture, &seen.texture) {
            let (turn, spread) =
                self.odometry.turn(&self.config.odometry, finder, &matches, seconds, wheels.as_ref());
            matches.extend(floor_matches(finder, [before, now], turn, spread));
            if matches.len() == of_keypoints {
                config.least_floor = FEW_ON_FLOOR;
            }
        }
        let mut tracks = vec![Track::default(); matches.len()];
        let report = self.odometry.step(&config, finder, &matches, seconds, wheels.as_ref(), &mut tracks);
        let wanted = self.free_wanted || report.motion.is_err();
        let of_keypoints = matches.get(..of_keypoints).unwrap_or_default();
        let free = if wanted { free_homography(finder.camera(), of_keypoints) } else { None };
        if report.new_keyframe {
            self.keyframe = Some(seen);
        }
        self.last_time = time;
        let step = report.increment;
        let delta = Vector3::new(step.x, step.y, step.heading);
        let factor = if report.measured { self.config.covariance_factor } else { 1.0 };
        let covariance = report.increment_covariance * factor;
        let mount = report.motion.as_ref().ok().and_then(|motion| motion.mount);
        let mount = mount.map(believed);
        Ok(Some(VisualStep {
            increment: Increment { delta, covariance },
            by_mount: report.increment_by_mount,
            by_wheels: report.increment_by_wheels,
            disagreement: report
                .disagreement
                .map(|one| Disagreement { covariance: one.covariance * factor, ..one }),
            mount: mount.filter(|_| report.new_keyframe && report.jolt.is_none()),
            jolt: report.jolt.map(|jolt| Jolt { covariance: jolt.covariance * factor, ..jolt }),
            measured: report.measured,
            matches: matches.len(),
            motion: report.motion,
            free,
            new_keyframe: report.new_keyframe,
        }))
    }

    fn matches(&self, keyframe: &Features, seen: &Features) -> Result<Vec<Match<f32>>> {
        let variance = self.config.keypoint_std_px * self.config.keypoint_std_px;
        let pairs = keyframe.matches(seen, &self.config.matching)?;
        let ends = pairs
            .iter()
            .filter_map(|pair| Some((keyframe.keypoints.get(pair.first)?, seen.keypoints.get(pair.second)?)));
        Ok(ends.map(|(from, to)| Match::new(from.pixel, to.pixel, variance, variance)).collect())
    }
}

/// What a keyframe says of the mount, as knowledge.
fn believed(said: MountEvidence<f32>) -> MountEvidence<f32> {
    let shared = Matrix3::from_diagonal_element(MOUNT_STD * MOUNT_STD);
    MountEvidence { covariance: said.covariance * MOUNT_FACTOR + shared, ..said }
}

/// The wheels' step as path and turn.
fn prior(step: &Increment<f32>) -> MotionPrior<f32> {
    let path = step.delta.xy().norm();
    let arc = Vector2::new(if step.delta.x < 0.0 { -path } else { path }, step.delta.z);
    let c = &step.covariance;
    // The wheels may stand still, and then know it exactly.
    let floor = Matrix2::from_diagonal(&Vector2::new(1e-8, 1e-8));
    MotionPrior { arc, covariance: Matrix2::new(c.m11, c.m13, c.m31, c.m33) + floor }
}

/// The homography that most rays agree with.
fn free_homography(camera: &Camera<f32>, matches: &[Match<f32>]) -> Option<HomographyEstimate<f32>> {
    if !cfg!(feature = "free-homography") {
        return None; // `Config::supported` has refused to want it
    }
    let rays: Vec<_> = matches.iter().filter_map(|pair| pair.as_rays(camera)).collect();
    let mut posteriors = vec![0.0; rays.len()];
    let config = HomographyConfig { scale_noise: true, ..HomographyConfig::default() };
    estimate_homography(&config, &rays, &mut posteriors).ok()
}

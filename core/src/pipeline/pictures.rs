//! What pictures tell beside their corners: the robot's step, and where the landmarks' corners have gone.
//!
//! ```text
//! rows ──► features ──► matches with the keyframe ──► floor's homography ──► the robot's step   VisualMotion
//!                                                 └─► and the free one   ──► corners carried    PixelAssociation
//! ```
//!
//! Who moves the robot: the pictures, fused with the odometry's steps since the last one, where the configuration says
//! so or the floor carries the corners; elsewhere the odometry alone, reading by reading.
use super::pixel_association::PixelAssociation;
use super::visual_motion::{Look, VisualMotion, VisualStep};
use super::{Carrier, Config, MotionFrom, MovedBy, Pipeline, Report, Stage, Storage};
use crate::features::Features;
use crate::geometry::Camera;
use crate::homography::FloorTexture;
use crate::image::Grey;
use crate::lines::Corner;
use crate::slam::{Filter, Increment, Landmark};
use crate::{Error, Result};
use alloc::boxed::Box;
use alloc::vec::Vec;
use nalgebra::Vector2;

/// By how much the camera's yaw may change over a metre driven, rad, chosen on four simulated drives that knock it by a degree: a knock about the vertical looks like a turn of the robot, and what is
/// driven after it tells them apart only if the yaw was not held for certain.
const YAW_WALK: f32 = 0.0009;

/// Keyframe, corners in it, and the picture at hand.
#[derive(Clone, Debug)]
pub(super) struct Pictures {
    visual: VisualMotion,
    pixels: PixelAssociation,
    /// The picture at hand, as far as its rows have come.
    rows: Vec<u8>,
    /// The odometry's steps since the last picture, one after the other.
    steps: Option<Increment<f32>>,
    /// Those of them that have not moved the robot yet.
    waiting: Option<Increment<f32>>,
    /// Until when they reach.
    reached: f64,
    /// Whether some of them moved the robot before the picture came, for another sensor's sake.
    moved_early: bool,
    /// Whether pictures have their part in the robot's motion.
    move_robot: bool,
    /// Whether the floor's homography carries corners and does nothing else. It then takes the mount as measured: with the
    /// filter's estimate, which moves from picture to picture, 3.9 % of the corners miss their landmarks among people.
    carry_alone: bool,
}

impl Pictures {
    /// `None` where the configuration does not ask pictures.
    pub(super) fn new(config: &Config) -> Result<Option<Box<Self>>> {
        if !config.asks_pictures() {
            return Ok(None);
        }
        let mut visual = config.visual;
        let motion = &mut visual.odometry.motion;
        for std in [&mut motion.pitch_std, &mut motion.roll_std, &mut motion.tilt_std] {
            *std = std.max(config.sway);
        }
        let visual = VisualMotion::new(visual)?;
        Ok(Some(Box::new(Self {
            visual: if config.carrier == Carrier::Free { visual.with_free_homography() } else { visual },
            pixels: PixelAssociation::new(config.carrier),
            rows: Vec::new(),
            steps: None,
            waiting: None,
            reached: 0.0,
            moved_early: false,
            carry_alone: config.carrier == Carrier::Floor && config.motion_from == MotionFrom::Odometry,
            move_robot: match config.motion_from {
                MotionFrom::Pictures => true,
                MotionFrom::ByCarrier => config.carrier == Carrier::Floor,
                MotionFrom::Odometry => false,
            },
        })))
    }

    pub(super) fn begin(&mut self) {
        self.rows.clear();
    }

    pub(super) fn push_row(&mut self, pixels: &[u8]) {
        self.rows.extend_from_slice(pixels);
    }

    /// Takes a step of the odometry: moves the robot, or waits for the picture that has its part in the motion.
    pub(super) fn take_step<N, L>(
        &mut self,
        filter: &mut Filter<f32, N, L>,
        time: f64,
        step: &Increment<f32>,
    ) -> Result<()>
    where
        N: AsRef<[f32]> + AsMut<[f32]>,
        L: AsRef<[Landmark<f32>]> + AsMut<[Landmark<f32>]>,
    {
        if self.move_robot {
            let last = self.reached.max(filter.time());
            if !(time >= last && time.is_finite()) {
                return Err(Error::TimeBackwards { time, last });
            }
            step.check()?;
            self.reached = time;
            self.waiting = followed_by(self.waiting, step);
        } else {
            filter.predict_driven(time, step)?;
        }
        self.steps = followed_by(self.steps, step);
        Ok(())
    }

    /// What waits for the picture, and until when it reaches: for a measurement of another sensor that comes before.
    pub(super) fn take_waiting(&mut self) -> Option<(f64, Increment<f32>)> {
        let waiting = self.waiting.take()?;
        self.moved_early = true;
        Some((self.reached, waiting))
    }

    /// The landmarks' corners in the keyframe.
    pub(super) fn pixels(&mut self) -> &mut PixelAssociation {
        &mut self.pixels
    }

    /// The features of the picture at hand.
    fn detect(&mut self, width: usize, height: usize) -> Result<Features> {
        self.visual.detect(Grey::new(&self.rows, width, height)?)
    }

    /// The texture of the picture at hand.
    fn texture(&self, camera: &Camera<f32>) -> Option<FloorTexture> {
        let picture = Grey::new(&self.rows, camera.width(), camera.height()).ok()?;
        Some(FloorTexture::new(camera, picture))
    }

    /// Who moves the robot over a picture that gave this step.
    fn moved_by(&self, step: Option<&VisualStep>, wheels: bool) -> MovedBy {
        match (step.filter(|_| self.move_robot && !self.moved_early), wheels) {
            (None, false) => MovedBy::Nothing,
            (None, true) => MovedBy::Odometry,
            (Some(step), _) if !step.measured => MovedBy::Held,
            (Some(_), false) => MovedBy::Pictures,
            (Some(_), true) => MovedBy::Both,
        }
    }
}

fn followed_by(before: Option<Increment<f32>>, step: &Increment<f32>) -> Option<Increment<f32>> {
    Some(before.map_or(*step, |before| before.then(step)))
}

impl<S: Storage> Pipeline<S> {
    /// As [`step_timed`](Self::step_timed), with the picture's features found elsewhere: several pipelines may share
    /// one detector. Where the configuration does not ask pictures, they are left aside.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn step_with_features(
        &mut self,
        time: f64,
        picture: Grey<'_>,
        features: &Features,
        mut ended: impl FnMut(Stage),
    ) -> Result<Report> {
        if self.pictures.is_none() {
            return self.step_timed(time, picture, ended);
        }
        self.push_rows(picture)?;
        ended(Stage::Rows);
        let (corners, truncations) = self.corners()?;
        ended(Stage::Corners);
        let mut report = Report::default();
        self.finish_seeing(time, &corners, Some(features.clone()), &mut report, ended)?;
        Ok(Report { truncations, ..report })
    }

    /// The picture's part in the motion, then its corners with the help of those that were carried.
    pub(super) fn finish_seeing(
        &mut self,
        time: f64,
        corners: &[Corner],
        features: Option<Features>,
        report: &mut Report,
        mut ended: impl FnMut(Stage),
    ) -> Result<()> {
        let (moved_by, knocked) = self.move_by_picture(time, features)?;
        ended(Stage::Motion);
        self.observe_carried(time, corners, report)?;
        ended(Stage::Filter);
        report.moved_by = moved_by;
        report.map.knocked |= knocked;
        Ok(())
    }

    /// Moves the robot as the picture says; by what it was moved, and whether the camera was knocked meanwhile.
    fn move_by_picture(&mut self, time: f64, features: Option<Features>) -> Result<(MovedBy, bool)> {
        self.moment.begin();
        let (measured, estimated, steady) = (self.config.finder, self.finder(), self.is_steady());
        let sway = self.config.sway;
        let Some(pictures) = self.pictures.as_deref_mut() else { return Ok((MovedBy::Nothing, false)) };
        let finder = if pictures.carry_alone { measured } else { estimated };
        let mut features = match features {
            Some(features) => features,
            None => pictures.detect(finder.camera().width(), finder.camera().height())?,
        };
        // Of a picture that is not steady its pixels alone could be put right.
        let texture = if steady { pictures.texture(finder.camera()) } else { None };
        if !steady {
            for keypoint in &mut features.keypoints {
                keypoint.pixel = self.steady(&finder, keypoint.pixel);
            }
        }
        let Some(pictures) = self.pictures.as_deref_mut() else { return Ok((MovedBy::Nothing, false)) };
        let wheels = pictures.steps.map(|read| self.map.filter().driven(&read).0);
        let step = pictures.visual.follow(&finder, time, wheels.as_ref(), Look { features, texture })?;
        pictures.pixels.look(step.as_ref());
        let moved_by = pictures.moved_by(step.as_ref(), wheels.is_some());
        let seconds = (time - self.map.filter().time()) as f32;
        if let Some(step) = step.as_ref().filter(|_| wheels.is_none() && seconds > 0.0) {
            self.moment.velocity =
                Some(Vector2::new(step.increment.delta.x, step.increment.delta.z) / seconds);
        }
        (pictures.steps, pictures.moved_early) = (None, false);
        let (waiting, mut knocked) = (pictures.waiting.take(), false);
        match (moved_by, step, waiting) {
            (MovedBy::Pictures | MovedBy::Both | MovedBy::Held, Some(step), _) => {
                self.map.filter_mut().predict_seen(time, &step.increment, &step.by_mount, &step.by_wheels)?;
                let metres = step.increment.delta.xy().norm();
                self.map.filter_mut().change_yaw(YAW_WALK * libm::sqrtf(metres));
                if let Some(jolt) = &step.jolt {
                    knocked = true;
                    self.map.take_jolt(&jolt.angles, &jolt.covariance);
                }
                let filter = self.map.filter_mut();
                if let Some(evidence) = step.mount.as_ref().filter(|_| steady && sway == 0.0) {
                    filter.update_mount(&evidence.errors, &evidence.covariance)?;
                }
                // What the wheels measured otherwise is the mount's error, or their own.
                if let Some(by) = &step.disagreement {
                    filter.update_shared(&by.arc, &by.covariance, &by.by_mount, &by.by_wheels)?;
                }
            }
            (_, _, Some(waiting)) => self.map.filter_mut().predict_driven(time, &waiting)?,
            _ => {}
        }
        Ok((moved_by, knocked))
    }

    /// The pictures' part of a fresh pipeline, for one that is put elsewhere.
    pub(super) fn forget_pictures(&mut self) {
        if let Ok(pictures) = Pictures::new(&self.config) {
            self.pictures = pictures;
        }
    }
}

//! A robot that was carried away is found again in the map that it has made.
//!
//! It does not know that it was: its wheels stood. What tells is that the corners which it should see are not where they should be,
//! picture after picture. Then a second pipeline begins, at an unknown place of the map as it was before ([`Pipeline::locate`]), and has the
//! same pictures and readings. Where it finds itself somewhere else than the first one believes, it takes the first one's place; where it
//! finds itself there, or the corners come back, nothing has happened.
//!
//! ```text
//! Σ met < 0.3 Σ expected          over the last ten pictures, of landmarks from before them
//! dᵀ (P₁ + P₂)⁻¹ d > χ²(3)        d: from the one's pose to the other's
//! ```
//!
//! *Limits.* On hosts alone, with what finds corners there: it would take 7 kB of the page's first load. A second pipeline takes as long as
//! the first. A covariance that is kept in factors has no second. A robot that is put down where the map has nothing goes on beside it.
use super::relocation::Located;
use super::{Config, Memory, Odometry, OnHeap, Pipeline, Report, saved_map, state_len};
use crate::Result;
use crate::geometry::Pose;
use crate::image::Grey;
use crate::slam::{Covariance, Filter, Landmark, Status};
use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Pictures that are judged together.
const WINDOW: usize = 10;
/// Landmarks that they should have shown, all together.
const ENOUGH: u32 = 25;
/// Part of them that must have been met: in a simulated corridor (seed 33) half of them are in the median where all is well, and less than this
/// in one window of twenty; in most windows of a robot that was carried away it is a tenth.
const LEAST: f32 = 0.3;
/// And from which on all is well again.
const WELL: f32 = 0.5;
/// Metres between two states that are kept: more than a window takes.
const APART: f32 = 3.0;
/// Pictures after which the second pipeline gives up.
const PATIENCE: usize = 400;
/// χ²(3) at 0.9999: poses that are farther apart are two places.
const ELSEWHERE: f32 = 21.1;

/// Watches a pipeline, picture by picture.
#[derive(Clone, Debug)]
pub struct Recovery {
    config: Config,
    landmarks: usize,
    /// The last two states, the older one first.
    kept: [Option<Kept>; 2],
    window: VecDeque<Seen>,
    second: Option<Box<Second>>,
}

/// A robot that was carried away and is found.
#[derive(Debug)]
pub struct Recovered {
    /// When it was missed, s: the poses since then are wrong, and those in [`reports`](Self::reports) in their place.
    pub since: f64,
    /// Where the second pipeline's world is in the map, and which of its landmarks are the map's.
    pub located: Located,
    /// The poses in the second pipeline's world, and its landmarks, of each picture since then.
    pub reports: Vec<Report>,
    /// Covariance of the pose in the second pipeline's world when it was found.
    pub own_covariance: Matrix3<f32>,
}

#[derive(Clone, Debug)]
struct Kept {
    time: f64,
    path: f32,
    state: Vec<u8>,
}

#[derive(Clone, Copy, Debug)]
struct Seen {
    time: f64,
    expected: u32,
    met: u32,
}

#[derive(Clone, Debug)]
struct Second {
    pipeline: Pipeline<OnHeap>,
    /// The map in which it looks for its place, and of when it is.
    state: Vec<u8>,
    before: f64,
    since: f64,
    reports: Vec<Report>,
}

impl Recovery {
    /// Watches pipelines of this configuration, with room for so many landmarks.
    pub fn new(config: &Config, landmarks: usize) -> Self {
        let (kept, window) = ([None, None], VecDeque::new());
        Self { config: *config, landmarks, kept, window, second: None }
    }

    /// Takes what the pipeline was given by [`Pipeline::odometry`].
    ///
    /// # Errors
    /// As there.
    pub fn odometry(&mut self, time: f64, odometry: &Odometry) -> Result<()> {
        self.second.as_mut().map_or(Ok(()), |second| second.pipeline.odometry(time, odometry))
    }

    /// Takes what the pipeline was given by [`Pipeline::attitude`].
    ///
    /// # Errors
    /// As there.
    pub fn attitude(&mut self, pitch: f32, roll: f32, std: f32) -> Result<()> {
        self.second.as_mut().map_or(Ok(()), |second| second.pipeline.attitude(pitch, roll, std))
    }

    /// Whether the robot is missed, and looked for.
    pub fn is_looking(&self) -> bool {
        self.second.is_some()
    }

    /// Takes the picture that gave `report`, and puts the pipeline to where the robot is found. With `fixed` the map stays as it is, as in
    /// [`Pipeline::locate`].
    ///
    /// # Errors
    /// As [`Pipeline::step`] and [`Pipeline::locate`].
    pub fn look(
        &mut self,
        pipeline: &mut Pipeline<OnHeap>,
        report: &Report,
        picture: Grey<'_>,
        fixed: bool,
    ) -> Result<Option<Recovered>> {
        // A state that is kept in factors cannot be begun in.
        if self.config.filter.covariance != Covariance::Packed {
            return Ok(None);
        }
        self.note(pipeline, report);
        let Some(mut second) = self.second.take() else {
            match self.share_met() {
                Some(share) if share < LEAST => self.begin(report.time)?,
                _ => self.keep(pipeline, report.time)?,
            }
            return Ok(None);
        };
        let seen = second.pipeline.step(report.time, picture)?;
        let own_covariance = second.pipeline.filter().pose_covariance();
        let map = saved_map(&second.state)?;
        let located = second.pipeline.locate(&map, 0.0, fixed, &seen)?;
        second.reports.push(seen);
        let Some(located) = located else {
            let is_well = self.share_met().is_some_and(|share| share > WELL);
            if !is_well && second.reports.len() < PATIENCE {
                self.second = Some(second);
            } else {
                self.forget();
            }
            return Ok(None);
        };
        self.forget();
        if !are_apart(pipeline.filter(), second.pipeline.filter()) {
            return Ok(None);
        }
        let Second { pipeline: found, since, reports, .. } = *second;
        *pipeline = found;
        Ok(Some(Recovered { since, located, reports, own_covariance }))
    }

    /// Counts the landmarks from before the window that should be in view, and those that were met.
    fn note(&mut self, pipeline: &Pipeline<OnHeap>, report: &Report) {
        let began = self.window.front().map_or(report.time, |seen| seen.time);
        let before = self.second.as_ref().map_or(began, |second| second.before);
        let filter = pipeline.filter();
        let is_old = |landmark: &&Landmark<f32>| {
            landmark.status == Status::Confirmed && landmark.in_view && landmark.first_time < before
        };
        let is_met = |landmark: &&Landmark<f32>| {
            report.corners.iter().any(|corner| {
                corner.outcome.decision.is_update() && corner.outcome.landmark == Some(landmark.id)
            })
        };
        let expected = filter.landmarks().iter().filter(is_old).count() as u32;
        let met = filter.landmarks().iter().filter(is_old).filter(is_met).count() as u32;
        if self.window.len() == WINDOW {
            self.window.pop_front();
        }
        self.window.push_back(Seen { time: report.time, expected, met });
    }

    /// The part of the expected landmarks that was met, once there were enough.
    fn share_met(&self) -> Option<f32> {
        let sum = |count: fn(&Seen) -> u32| self.window.iter().map(count).sum::<u32>();
        let (expected, met) = (sum(|seen| seen.expected), sum(|seen| seen.met));
        (self.window.len() == WINDOW && expected >= ENOUGH).then(|| met as f32 / expected as f32)
    }

    /// Keeps the state now and then.
    fn keep(&mut self, pipeline: &mut Pipeline<OnHeap>, time: f64) -> Result<()> {
        let path = pipeline.health().frames.path;
        if self.kept[1].as_ref().is_some_and(|last| path - last.path < APART) {
            return Ok(());
        }
        let filter = pipeline.filter();
        let mut state = alloc::vec![0; state_len(filter.states().0, filter.landmarks().len())];
        let length = pipeline.save(&mut state)?;
        state.truncate(length);
        self.kept[0] = self.kept[1].replace(Kept { time, path, state });
        Ok(())
    }

    /// Begins to look for the robot, in the map as it was before the window.
    fn begin(&mut self, time: f64) -> Result<()> {
        let before = self.window.front().map_or(time, |seen| seen.time);
        let kept =
            self.kept.iter_mut().rev().find(|kept| kept.as_ref().is_some_and(|kept| kept.time < before));
        let Some(Kept { time: before, state, .. }) = kept.and_then(Option::take) else { return Ok(()) };
        let camera = self.config.finder.camera();
        let memory = Memory::on_heap(camera.width(), camera.height(), self.landmarks);
        let mut pipeline = Pipeline::new(self.config, memory)?;
        pipeline.advance(time)?;
        pipeline.number_from(saved_map(&state)?.next_id());
        self.second = Some(Box::new(Second { pipeline, state, before, since: time, reports: Vec::new() }));
        Ok(())
    }

    /// Begins to watch anew.
    fn forget(&mut self) {
        (self.kept, self.second) = ([None, None], None);
        self.window.clear();
    }
}

/// Whether two filters have the robot at two places.
fn are_apart<S, L>(one: &Filter<f32, S, L>, other: &Filter<f32, S, L>) -> bool
where
    S: AsRef<[f32]> + AsMut<[f32]>,
    L: AsRef<[Landmark<f32>]> + AsMut<[Landmark<f32>]>,
{
    let Pose { x, y, heading } = one.pose().inverse().compose(&other.pose());
    let difference = one.pose().rotation() * Vector2::new(x, y);
    let difference = Vector3::new(difference.x, difference.y, heading);
    let both = one.pose_covariance() + other.pose_covariance();
    both.cholesky().is_none_or(|root| difference.dot(&root.solve(&difference)) > ELSEWHERE)
}

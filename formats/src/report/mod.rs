//! What a run found: `report.html`, one file that says how far the run went and how certain it is, and the plain
//! files beside it. The command line and the page in the browser write them with the same code.
//!
//! The report holds its pictures and needs no network. Drawings are SVG whose colours are the page's own variables,
//! so that they follow the reader's light or dark setting.
pub mod chart;
mod corners;
pub mod floor_plan;
mod outputs;
mod page;
mod plots;
mod setup;
mod shot;
mod subject;
mod svg;

pub use outputs::OUTPUTS;
pub use page::page;
pub use setup::{SettingLine, Setup};
pub use shot::{SHOTS, Shot, shot};
pub use subject::Subject;
pub use svg::escape;

/// The style of every page.
pub const STYLE: &str = include_str!("report.css");

use crate::{
    Error,
    evaluation::{MapErrors, Pair, TrajectoryErrors},
    files::{MapPoint, Stamped},
};
use monorange_core::pipeline::Carrier;
use monorange_core::slam::{Decision, Reason, Verdict};
use nalgebra::{Matrix2, Vector2};
use serde::Serialize;
use std::collections::BTreeMap;

/// One measurement and what the filter did with it: a row of `observations.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Seconds.
    pub time: f64,
    /// Index of the frame in its folder.
    pub frame: usize,
    /// (u, v), where a camera saw it.
    pub pixel: Option<Vector2<f32>>,
    /// Its covariance, px²; not in the file.
    pub pixel_covariance: Option<Matrix2<f32>>,
    /// Metres.
    pub range: Option<f32>,
    /// Radians.
    pub bearing: Option<f32>,
    /// Which landmark.
    pub landmark: Option<u32>,
    /// What the filter did with it.
    pub decision: Decision,
    /// Normalised innovation squared.
    pub nis: Option<f32>,
}

/// Milliseconds that a stage took, one for every frame.
#[derive(Clone, Debug, Default)]
pub struct Stage {
    /// What it does.
    pub name: &'static str,
    /// Milliseconds.
    pub times_ms: Vec<f64>,
}

/// What a run found.
pub struct Run {
    /// Name of the sequence.
    pub title: String,
    /// The command line.
    pub command: String,
    /// What the filter was given.
    pub subject: Subject,
    /// What it was run with.
    pub setup: Setup,
    /// Frames in the folder, or times with a measurement in the log.
    pub frames: usize,
    /// Those that were used.
    pub frames_used: usize,
    /// Frames that could not be read, with the reason.
    pub left_out: Vec<String>,
    /// Poses, one a frame used; of a log also one a line of odometry.
    pub trajectory: Vec<Stamped>,
    /// Poses with the truth in the map's frame; empty without truth.
    pub pairs: Vec<Pair>,
    /// Errors, where there is truth.
    pub errors: Option<TrajectoryErrors>,
    /// Errors of the map, where the true one is given.
    pub map_errors: Option<MapErrors>,
    /// Landmarks.
    pub map: Vec<MapPoint>,
    /// True landmarks in the map's frame.
    pub true_map: Vec<Vector2<f64>>,
    /// Laser echoes in the map's frame.
    pub laser: Vec<Vector2<f64>>,
    /// All measurements.
    pub observations: Vec<Observation>,
    /// Corners that had no range worth the name.
    pub without_range: u32,
    /// Landmarks for which there was no room.
    pub no_room: u32,
    /// When the camera seems to have been knocked, seconds.
    pub knocked: Vec<f64>,
    /// Steps that the pictures did not give, where the motion comes from them.
    pub unmeasured: Option<usize>,
    /// Who predicted the corners' pixels, where a homography was to carry them.
    pub carried: Option<Carried>,
    /// What became of the saved map that it began in.
    pub in_map: Option<InMap>,
    /// The filter's own verdict.
    pub verdict: Verdict,
    /// What speaks against the filter, where anything does.
    pub reason: Option<Reason>,
    /// Mean normalised innovation squared a degree of freedom, over the last measurements; 1 is right.
    pub mean_nis: f32,
    /// Stages in order.
    pub stages: Vec<Stage>,
    /// Chosen frames.
    pub shots: Vec<Shot>,
    /// What looked wrong and was used all the same.
    pub warnings: Vec<String>,
}

/// Pictures by what predicted their corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Carried {
    /// The floor's homography.
    pub floor: usize,
    /// The free homography of eight parameters.
    pub free: usize,
    /// No homography was good enough: the map.
    pub map: usize,
}

impl Carried {
    /// Counts a picture.
    pub fn count(&mut self, by: Carrier) {
        match by {
            Carrier::Floor => self.floor += 1,
            Carrier::Free => self.free += 1,
            Carrier::Map => self.map += 1,
        }
    }
}

/// The place of a run in a saved map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InMap {
    /// The map's file.
    pub map: String,
    /// How long it took to find the place, s; `None` where it was not found.
    pub found_after_s: Option<f64>,
    /// And how far, m.
    pub found_after_m: Option<f64>,
    /// Landmarks of the map by which it was recognised.
    pub recognised: usize,
    /// Whether the map stays as it is: what it does not have is rejected.
    pub localise_only: bool,
}

/// `report.json`; metres, radians and seconds.
#[derive(Serialize)]
pub struct Summary<'a> {
    version: &'static str,
    title: &'a str,
    command: &'a str,
    frames: usize,
    frames_used: usize,
    left_out: &'a [String],
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    warnings: &'a [String],
    seconds: f64,
    path: f64,
    end: [f64; 3],
    end_std: [f64; 3],
    landmarks: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    measurements: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    corners: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    corners_without_range: Option<u32>,
    births_without_room: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    visual_steps_not_measured: Option<usize>,
    #[serde(skip_serializing_if = "<[f64]>::is_empty")]
    camera_knocked_at: &'a [f64],
    corners_carried_by: Option<Carried>,
    #[serde(skip_serializing_if = "Option::is_none")]
    in_map: &'a Option<InMap>,
    decisions: BTreeMap<&'static str, usize>,
    verdict: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'static str>,
    mean_nis_per_dof: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    errors: &'a Option<TrajectoryErrors>,
    #[serde(skip_serializing_if = "Option::is_none")]
    map_errors: &'a Option<MapErrors>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    stages_ms: BTreeMap<&'static str, [f64; 3]>,
    settings: BTreeMap<String, String>,
}

impl Run {
    fn seen_from_above(&self) -> floor_plan::FromAbove<'_> {
        let Self { trajectory, pairs, map, true_map, laser, .. } = self;
        floor_plan::FromAbove { trajectory, pairs, map, true_map, laser }
    }

    /// Length of the estimated path, m.
    pub fn path(&self) -> f64 {
        let step = |pair: &[Stamped]| match pair {
            [a, b] => (b.pose.position() - a.pose.position()).norm(),
            _ => 0.0,
        };
        self.trajectory.windows(2).map(step).sum()
    }

    /// From the first to the last frame, s.
    pub fn seconds(&self) -> f64 {
        self.trajectory.last().map_or(0.0, |stamped| stamped.time) - self.start()
    }

    /// Standard deviations of the last pose: x, y, heading.
    pub fn end_std(&self) -> [f64; 3] {
        let last = self.trajectory.last().and_then(|stamped| stamped.covariance).unwrap_or_default();
        [last.m11, last.m22, last.m33].map(|variance| variance.max(0.0).sqrt())
    }

    /// How many measurements met each decision.
    pub fn decisions(&self) -> BTreeMap<&'static str, usize> {
        let mut counts = BTreeMap::new();
        for observation in &self.observations {
            *counts.entry(observation.decision.as_str()).or_default() += 1;
        }
        counts
    }

    /// How many measurements met one of these decisions.
    pub fn count(&self, decisions: &[Decision]) -> usize {
        self.observations.iter().filter(|seen| decisions.contains(&seen.decision)).count()
    }

    /// Warns of results that are hardly worth their names.
    pub fn warn(&self) {
        let decisions = self.decisions();
        let [rejected, gated] = ["rejected", "gated"].map(|word| decisions.get(word).copied().unwrap_or(0));
        let measured = self.observations.len();
        // What a map does not have that stays as it is says nothing about units.
        let localise_only = self.in_map.as_ref().is_some_and(|map| map.localise_only);
        if 2 * (rejected + gated) > measured && measured > 10 && !localise_only {
            let words = self.subject.long();
            let cause =
                format!("of {measured} {words} {rejected} were rejected and {gated} lay beyond their gates");
            Error::new(cause)
                .help("check units, standard deviations and the mount before the results are used")
                .warn();
        }
        if self.no_room > 0 {
            let cause = format!("there was no room for a landmark {} times", self.no_room);
            Error::new(cause).help("give a larger --max-landmarks").warn();
        }
        if measured <= 10 && self.map.is_empty() && self.frames_used > 5 {
            let words = self.subject.long();
            Error::new(format!(
                "{measured} {words} were found in {} frames, and no landmark",
                self.frames_used
            ))
            .help(match self.subject {
                Subject::FloorCorners => "check the mount: `tilt_deg` is degrees downwards, `height` metres",
                Subject::Measurements => "the trajectory is the odometry's alone",
            })
            .warn();
        }
        let inside = self.errors.as_ref().and_then(|errors| errors.nees).map(|nees| nees.inside_3_sigma);
        if let Some(inside) = inside.filter(|inside| *inside < 0.5 && self.verdict == Verdict::Consistent) {
            let cause = format!("only {:.1} % of the poses are within 3σ of the truth", 100.0 * inside);
            Error::new(cause)
                .help("no innovation shows it: check units, signs and frame of the truth, and of odometry and mount")
                .warn();
        }
        if matches!(self.verdict, Verdict::Doubtful | Verdict::Lost) {
            let help = match self.reason {
                Some(Reason::Attitude) => {
                    "say in the rig by how much tilt and roll change from picture to picture (`sway = 0.02` under `[filter]`, rad), or give --attitude"
                }
                _ => {
                    "check units and signs of odometry, measurements and mount, and their standard deviations"
                }
            };
            Error::new(format!("the filter calls its result {}", self.verdict.as_str())).help(help).warn();
        }
        if self.map.is_empty() && measured > 10 {
            Error::new(format!("no landmark came of {measured} {}", self.subject.long()))
                .help("the trajectory is the odometry's alone")
                .warn();
        }
    }

    /// When the camera seems to have been knocked, in words.
    pub fn knocked_when(&self) -> Option<String> {
        let (first, more) = self.knocked.split_first()?;
        let often = match more.len() {
            0 => String::new(),
            1 => " and once more".to_owned(),
            more => format!(" and {more} times after that"),
        };
        Some(format!("{:.1} s after the start{often}", first - self.start()))
    }

    /// What `report.json` holds.
    pub fn summary(&self) -> Summary<'_> {
        let end = self.trajectory.last().map(|stamped| stamped.pose).unwrap_or_default();
        let corners = self.subject == Subject::FloorCorners;
        Summary {
            version: env!("CARGO_PKG_VERSION"),
            title: &self.title,
            command: &self.command,
            frames: self.frames,
            frames_used: self.frames_used,
            left_out: &self.left_out,
            warnings: &self.warnings,
            seconds: self.seconds(),
            path: self.path(),
            end: [end.x, end.y, end.heading],
            end_std: self.end_std(),
            landmarks: self.map.len(),
            measurements: (!corners).then_some(self.observations.len()),
            corners: corners.then_some(self.observations.len()),
            corners_without_range: corners.then_some(self.without_range),
            births_without_room: self.no_room,
            visual_steps_not_measured: self.unmeasured,
            camera_knocked_at: &self.knocked,
            corners_carried_by: self.carried,
            in_map: &self.in_map,
            decisions: self.decisions(),
            verdict: self.verdict.as_str(),
            reason: self.reason.map(Reason::as_str),
            mean_nis_per_dof: self.mean_nis,
            errors: &self.errors,
            map_errors: &self.map_errors,
            stages_ms: self.stages.iter().map(|stage| (stage.name, stage.mean_median_max())).collect(),
            settings: self
                .setup
                .settings
                .iter()
                .map(|setting| (setting.name.clone(), setting.value.clone()))
                .collect(),
        }
    }

    fn start(&self) -> f64 {
        self.trajectory.first().map_or(0.0, |stamped| stamped.time)
    }
}

impl Stage {
    /// Mean, median and largest time, ms.
    pub fn mean_median_max(&self) -> [f64; 3] {
        let mut sorted = self.times_ms.clone();
        sorted.sort_by(f64::total_cmp);
        let mean = sorted.iter().sum::<f64>() / sorted.len().max(1) as f64;
        let at = |index: usize| sorted.get(index).copied().unwrap_or_default();
        [mean, at(sorted.len() / 2), at(sorted.len().saturating_sub(1))]
    }
}

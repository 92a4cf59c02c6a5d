use super::Shot;
use crate::{
    evaluation::{Align, MAX_TRUTH_GAP, Pair, TrajectoryErrors, Truth, trajectory_errors},
    files::{MapPoint, Rig, Stamped},
};
use monorange_core::pipeline::CornerReport;
use nalgebra::{Matrix2, Vector2};
use serde::Serialize;
use std::collections::BTreeMap;

/// One floor corner and what the filter did with it: a row of `observations.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Seconds.
    pub time: f64,
    /// Index of the frame in its folder.
    pub frame: usize,
    /// (u, v).
    pub pixel: Vector2<f32>,
    /// Its covariance, px²; not in the file.
    pub pixel_covariance: Matrix2<f32>,
    /// Metres.
    pub range: f32,
    /// Radians.
    pub bearing: f32,
    /// Which landmark.
    pub landmark: Option<u32>,
    /// `update`, `birth`, `gated`, `tentative` or `rejected`.
    pub decision: &'static str,
    /// Normalised innovation squared.
    pub nis: Option<f32>,
}

impl Observation {
    /// What the pipeline says of a corner.
    pub fn new(time: f64, frame: usize, corner: &CornerReport) -> Self {
        Self {
            time,
            frame,
            pixel: corner.pixel,
            pixel_covariance: corner.pixel_covariance,
            range: corner.range,
            bearing: corner.bearing,
            landmark: corner.outcome.landmark,
            decision: corner.outcome.decision.as_str(),
            nis: corner.outcome.nis,
        }
    }

    /// Whether the filter took it for a landmark that it knew.
    pub fn is_matched(&self) -> bool {
        matches!(self.decision, "update" | "tentative")
    }
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
    /// The rig with its settings.
    pub rig: Rig,
    /// Frames in the folder.
    pub frames: usize,
    /// Frames that could not be read, with the reason.
    pub left_out: Vec<String>,
    /// Poses, one a frame used.
    pub trajectory: Vec<Stamped>,
    /// Poses with the truth in the map's frame; empty without truth.
    pub pairs: Vec<Pair>,
    /// Errors, where there is truth.
    pub errors: Option<TrajectoryErrors>,
    /// Landmarks.
    pub map: Vec<MapPoint>,
    /// True landmarks in the map's frame.
    pub true_map: Vec<Vector2<f64>>,
    /// Laser echoes in the map's frame.
    pub laser: Vec<Vector2<f64>>,
    /// All floor corners.
    pub observations: Vec<Observation>,
    /// Corners that had no range worth the name.
    pub without_range: u32,
    /// Landmarks for which there was no room.
    pub no_room: u32,
    /// Steps that the pictures did not give, where the motion comes from them.
    pub unmeasured: Option<usize>,
    /// The filter's own verdict, or `unchecked` where no corner was matched.
    pub verdict: &'static str,
    /// Mean normalised innovation squared a degree of freedom, over the last measurements; 1 is right.
    pub mean_nis: f32,
    /// Stages in order.
    pub stages: Vec<Stage>,
    /// Chosen frames.
    pub shots: Vec<Shot>,
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
    seconds: f64,
    path: f64,
    end: [f64; 3],
    end_std: [f64; 3],
    landmarks: usize,
    corners: usize,
    corners_without_range: u32,
    births_without_room: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    visual_steps_not_measured: Option<usize>,
    decisions: BTreeMap<&'static str, usize>,
    verdict: &'static str,
    mean_nis_per_dof: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    errors: &'a Option<TrajectoryErrors>,
    stages_ms: BTreeMap<&'static str, [f64; 3]>,
    settings: BTreeMap<String, String>,
}

/// The stages of a frame, in their order.
const STAGES: [&str; 5] =
    ["read the picture", "edges", "lines and corners", "motion", "association and filter"];

impl Run {
    /// A run of so many frames that has found nothing yet.
    pub fn new(title: String, command: String, rig: Rig, frames: usize) -> Self {
        Self {
            title,
            command,
            rig,
            frames,
            left_out: Vec::new(),
            trajectory: Vec::new(),
            pairs: Vec::new(),
            errors: None,
            map: Vec::new(),
            true_map: Vec::new(),
            laser: Vec::new(),
            observations: Vec::new(),
            without_range: 0,
            no_room: 0,
            unmeasured: None,
            verdict: "unchecked",
            mean_nis: 1.0,
            stages: STAGES.map(|name| Stage { name, times_ms: Vec::new() }).into(),
            shots: Vec::new(),
        }
    }

    /// Puts the truth beside what was found. Truth, laser and true landmarks are moved by the true pose at `start`,
    /// where the world of the run begins; `false` where the truth has none there.
    pub fn compare(
        &mut self,
        start: f64,
        truth: &[Stamped],
        laser: &[Vector2<f64>],
        landmarks: &[Vector2<f64>],
    ) -> bool {
        let truth = Truth::new(truth, MAX_TRUTH_GAP);
        let Some(first) = truth.at(start) else { return false };
        let map_from_world = first.inverse();
        let moved = |points: &[Vector2<f64>]| points.iter().map(|at| map_from_world.transform(*at)).collect();
        (self.laser, self.true_map) = (moved(laser), moved(landmarks));
        self.pairs = truth.pairs(&self.trajectory);
        for pair in &mut self.pairs {
            pair.truth = map_from_world.compose(&pair.truth);
        }
        self.errors = Some(trajectory_errors(&self.pairs, Align::None, 1.0));
        true
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

    /// How many corners met each decision.
    pub fn decisions(&self) -> BTreeMap<&'static str, usize> {
        let mut counts = BTreeMap::new();
        for observation in &self.observations {
            *counts.entry(observation.decision).or_default() += 1;
        }
        counts
    }

    /// What `report.json` holds.
    pub fn summary(&self) -> Summary<'_> {
        let end = self.trajectory.last().map(|stamped| stamped.pose).unwrap_or_default();
        Summary {
            version: env!("CARGO_PKG_VERSION"),
            title: &self.title,
            command: &self.command,
            frames: self.frames,
            frames_used: self.trajectory.len(),
            left_out: &self.left_out,
            seconds: self.seconds(),
            path: self.path(),
            end: [end.x, end.y, end.heading],
            end_std: self.end_std(),
            landmarks: self.map.len(),
            corners: self.observations.len(),
            corners_without_range: self.without_range,
            births_without_room: self.no_room,
            visual_steps_not_measured: self.unmeasured,
            decisions: self.decisions(),
            verdict: self.verdict,
            mean_nis_per_dof: self.mean_nis,
            errors: &self.errors,
            stages_ms: self.stages.iter().map(|stage| (stage.name, stage.mean_median_max())).collect(),
            settings: crate::files::SETTINGS
                .iter()
                .map(|setting| {
                    (format!("{}.{}", setting.section, setting.key), setting.value(&self.rig.settings))
                })
                .collect(),
        }
    }

    pub(super) fn start(&self) -> f64 {
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

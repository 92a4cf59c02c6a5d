//! The run of a camera: how it begins, what it sees, and how it compares with the truth.
use super::{Observation, Run, Setup, Stage, Subject};
use crate::{
    evaluation::{Align, MAX_TRUTH_GAP, Truth, trajectory_errors},
    files::{Rig, Stamped},
};
use monorange_core::geometry::Pose;
use monorange_core::pipeline::CornerReport;
use monorange_core::slam::Verdict;
use nalgebra::Vector2;

/// The stages of a frame, in their order.
const STAGES: [&str; 5] =
    ["read the picture", "edges", "lines and corners", "motion", "association and filter"];

impl Run {
    /// A run of so many pictures that has found nothing yet.
    pub fn of_pictures(title: String, command: String, rig: &Rig, frames: usize) -> Self {
        Self {
            title,
            command,
            subject: Subject::FloorCorners,
            setup: Setup::of_rig(rig),
            frames,
            frames_used: 0,
            left_out: Vec::new(),
            trajectory: Vec::new(),
            pairs: Vec::new(),
            errors: None,
            map_errors: None,
            map: Vec::new(),
            true_map: Vec::new(),
            laser: Vec::new(),
            observations: Vec::new(),
            without_range: 0,
            no_room: 0,
            knocked: Vec::new(),
            unmeasured: None,
            carried: None,
            in_map: None,
            verdict: Verdict::Unchecked,
            reason: None,
            mean_nis: 1.0,
            stages: STAGES.map(|name| Stage { name, times_ms: Vec::new() }).into(),
            shots: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Puts the truth beside what was found, and gives its world in the run's map; `None` where the truth covers no pose. Where that is
    /// not `known` already, truth, laser and true landmarks are moved by the true pose at `start`, where the world of the run begins, or
    /// else by the first pose that the truth covers.
    pub fn compare(
        &mut self,
        start: f64,
        known: Option<Pose<f64>>,
        truth: &[Stamped],
        laser: &[Vector2<f64>],
        landmarks: &[Vector2<f64>],
    ) -> Option<Pose<f64>> {
        let truth = Truth::new(truth, MAX_TRUTH_GAP);
        let map_from_world = match known {
            Some(known) => known,
            None => truth.map_from_world(start, &self.trajectory)?,
        };
        let moved = |points: &[Vector2<f64>]| points.iter().map(|at| map_from_world.transform(*at)).collect();
        (self.laser, self.true_map) = (moved(laser), moved(landmarks));
        self.pairs = truth.pairs(&self.trajectory);
        for pair in &mut self.pairs {
            pair.truth = map_from_world.compose(&pair.truth);
        }
        if self.pairs.is_empty() {
            return None;
        }
        self.errors = Some(trajectory_errors(&self.pairs, Align::None, 1.0));
        Some(map_from_world)
    }
}

impl Observation {
    /// What the pipeline says of a corner.
    pub fn of_corner(time: f64, frame: usize, corner: &CornerReport) -> Self {
        Self {
            time,
            frame,
            pixel: Some(corner.pixel),
            pixel_covariance: Some(corner.pixel_covariance),
            range: Some(corner.range),
            bearing: Some(corner.bearing),
            landmark: corner.outcome.landmark,
            decision: corner.outcome.decision,
            nis: corner.outcome.nis,
        }
    }

    /// Whether the filter took it for a landmark that it knew.
    pub fn is_matched(&self) -> bool {
        self.decision.is_update()
    }
}

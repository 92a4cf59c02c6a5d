//! The map's upkeep: who is who, who is born, who is believed, who goes.
//!
//! A frame's measurements pass through five steps, as data in the stages of `frame.rs`:
//!
//! 1. *Candidates*: pairs of measurement and landmark whose normalised innovation is below the match threshold; where there
//!    is none, below the birth threshold.
//! 2. *Pairing*: each measurement and each landmark at most once, by joint compatibility or exclusive nearest.
//! 3. *Update* of the pairs, all together. Measurements that another association names go through the first three steps
//!    before the others.
//! 4. *Births*: a measurement that is further than the birth threshold from every landmark starts a tentative one.
//!    Between the two thresholds it does neither, and is reported as gated: a duplicate costs more than a miss. A
//!    landmark that another measurement of the frame is of does not count, unless both may be the same sighting.
//! 5. *Upkeep*: a tentative landmark is confirmed at k sightings, and deleted when it was expected in m frames and
//!    seen in fewer than k. A landmark that is expected in view and stays unseen while its neighbour within
//!    `merge_distance` takes all its sightings is its duplicate if the two are surely one: they are made one, and the joint
//!    covariance learns that they are.
mod candidates;
mod config;
mod frame;
mod knock;
mod merging;
mod pairing;
mod stacked;
mod upkeep;

pub use config::{Feature, Hint, MapConfig, MapReport, Pairing, View};
pub(crate) use config::{MAP, MAP_REFERENCES};

use frame::{Frame, Round, Standing, Standings};

use crate::slam::filter::Filter;
use crate::slam::filter::{Decision, Outcome};
use crate::slam::health::{FrameEvidence, Health};
use crate::slam::landmark::{Landmark, Status};
use crate::{Error, Real, Result};

/// The filter with its map's upkeep: measurements without names in, decisions out.
#[derive(Clone, Copy, Debug)]
pub struct Map<T, S, L> {
    pub(in crate::slam) filter: Filter<T, S, L>,
    config: MapConfig<T>,
    pub(in crate::slam) health: Health<T>,
    pub(in crate::slam) next_id: u32,
    pub(in crate::slam) frame: u32,
}

/// Measurements of a frame; those beyond it are rejected and counted.
pub const MAX_FEATURES: usize = 64;

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    /// A map kept by `filter`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when a threshold is not above 0, or the birth threshold is below the match threshold.
    pub fn new(filter: Filter<T, S, L>, config: MapConfig<T>) -> Result<Self> {
        let config = config.validated()?;
        let next_id = filter.landmarks().iter().map(|landmark| landmark.id + 1).max().unwrap_or(0);
        Ok(Self { filter, config, health: Health::default(), next_id, frame: 0 })
    }

    /// The filter.
    pub fn filter(&self) -> &Filter<T, S, L> {
        &self.filter
    }

    /// The filter, to predict with.
    pub fn filter_mut(&mut self) -> &mut Filter<T, S, L> {
        &mut self.filter
    }

    /// The filter, without its map.
    pub fn into_filter(self) -> Filter<T, S, L> {
        self.filter
    }

    /// The settings.
    pub fn config(&self) -> &MapConfig<T> {
        &self.config
    }

    /// Figures of the updates so far, and the verdict.
    pub fn health(&self) -> &Health<T> {
        &self.health
    }

    /// Frames so far.
    pub fn frame(&self) -> u32 {
        self.frame
    }

    /// Takes in a frame's measurements, made at the filter's time; `outcomes` receives one line for each.
    ///
    /// `may_be` can forbid pairs: whether the measurement of this index may be of this landmark, by its looks or by
    /// pixels. `|_, _| true` leaves the choice to the map.
    ///
    /// # Errors
    /// [`Error::Size`] when `outcomes` is shorter than `features`. Whatever is wrong with a measurement is in its
    /// outcome.
    pub fn observe(
        &mut self,
        features: &[Feature<T>],
        may_be: impl Fn(usize, &Landmark<T>) -> bool,
        outcomes: &mut [Outcome<T>],
    ) -> Result<MapReport> {
        let Some(outcomes) = outcomes.get_mut(..features.len()) else {
            let (got, expected) = (outcomes.len(), features.len());
            return Err(Error::Size { name: "outcomes", got, expected });
        };
        outcomes.fill(Outcome::default()); // rejected, where nothing better is found
        self.frame = self.frame.saturating_add(1);
        let mut report = MapReport::default();
        self.expect();
        let finder = self.filter.finder();
        let frame = Frame { features, may_be: &may_be, finder: finder.as_ref() };
        let mut standings = Standings::new();
        let _ = standings.resize(features.len().min(MAX_FEATURES), Standing::Unsound); // of that capacity
        for round in [Round::Named, Round::Free] {
            self.correct(&frame, round, &mut standings, outcomes, &mut report); // steps 1 to 3
        }
        if report.knocked {
            self.health.knocks = self.health.knocks.saturating_add(1);
            self.forget_tentative();
        }
        self.give_birth(features, &standings, outcomes, &mut report); // step 4
        self.note(outcomes, &mut report);
        self.keep_up(outcomes, &mut report); // step 5
        Ok(report)
    }

    /// Counts what became of the measurements, and tells the health.
    fn note(&mut self, outcomes: &[Outcome<T>], report: &mut MapReport) {
        for outcome in outcomes {
            let threshold = of_dof(self.filter.config().gate_nis, outcome.dof);
            self.health.note(outcome, threshold);
            match outcome.decision {
                Decision::Update | Decision::Tentative => report.updates += 1,
                Decision::Gated => report.gated += 1,
                Decision::Rejected => report.rejected += 1,
                Decision::Birth => {}
            }
            report.inflated += u32::from(outcome.inflation > T::one());
        }
        self.health.frames.note(&self.evidence(report));
    }

    fn evidence(&self, report: &MapReport) -> FrameEvidence<T> {
        let (pose, covariance) = (self.filter.pose(), self.filter.pose_covariance());
        let confirmed = |landmark: &&Landmark<T>| landmark.in_view && landmark.status == Status::Confirmed;
        FrameEvidence {
            position: [pose.x, pose.y],
            position_variance: covariance.m11 + covariance.m22,
            heading_variance: covariance.m33,
            resets: self.filter.resets(),
            expected: self.filter.landmarks().iter().filter(confirmed).count() as u32,
            updates: report.updates,
            refused: report.gated + report.ambiguous,
            births: report.births,
            moved: self.filter.moved(self.health.knocked()),
        }
    }

    /// Notes which landmarks are in view, as predicted.
    fn expect(&mut self) {
        let view = self.config.view;
        let heading = self.filter.heading();
        // A margin for the error of the prediction: landmarks at the rim are neither expected nor missed.
        let (near, far) = (view.near * T::lit(1.1), view.far * T::lit(0.9));
        for slot in 0..self.filter.landmarks().len() {
            let Some(landmark) = self.filter.landmarks().get(slot) else { continue };
            let in_view = self.filter.relative_at(landmark, heading).point().is_some_and(|point| {
                let (range, bearing) = (point.norm(), point.y.atan2(point.x).abs());
                range > near && range < far && bearing <= view.half_angle * T::lit(0.9)
            });
            if let Some(record) = self.filter.landmarks_mut().get_mut(slot) {
                record.in_view = in_view;
            }
        }
    }
}

/// A threshold's value for a measurement of so many degrees of freedom.
fn of_dof<T>([one, two]: [T; 2], dof: usize) -> T {
    if dof == 1 { one } else { two }
}

//! A frame's measurements, stage by stage: each stage is a type that owns what is known by then.
//!
//! | stage | what is known |
//! |---|---|
//! | [`Frame`] | what came in |
//! | [`Sighted`] | a measurement that passed its check |
//! | [`Candidates`], and a [`Standing`] for each measurement | pairs, linearised, and the nearest landmark |
//! | [`Paired`] | the pairs that are to be updated with |
//! | [`Outcome`] | what became of a measurement, for the caller |
use super::stacked::Pair;
use super::{Feature, Hint, MAX_FEATURES};
use crate::Real;
use crate::association::{Candidate, MAX_CANDIDATES, MAX_JOINT_CANDIDATES, exclusive_nearest};
use crate::geometry::RangeFinder;
use crate::slam::filter::{Decision, Outcome};
use crate::slam::landmark::Landmark;
use nalgebra::{Matrix2, Vector2};

/// What came in.
pub(super) struct Frame<'a, T> {
    pub(super) features: &'a [Feature<T>],
    pub(super) may_be: &'a dyn Fn(usize, &Landmark<T>) -> bool,
    pub(super) finder: Option<&'a RangeFinder<T>>,
}

/// Measurements that another association names are paired first: the rest is judged by what those say of the state.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Round {
    Named,
    Free,
}

/// A measurement that passed its check.
pub(super) struct Sighted<'a, T> {
    pub(super) index: usize,
    pub(super) feature: &'a Feature<T>,
}

impl<'a, T: Real> Frame<'a, T> {
    /// The measurements of a round.
    pub(super) fn sighted(&self, round: Round) -> impl Iterator<Item = Sighted<'a, T>> + use<'a, T> {
        let named = round == Round::Named;
        let all = self.features.iter().enumerate().map(|(index, feature)| Sighted { index, feature });
        all.filter(move |Sighted { feature, .. }| {
            (feature.hint != Hint::Free) == named && feature.measurement.check().is_ok()
        })
    }
}

/// Where each of a frame's measurements stands.
pub(super) type Standings<T> = heapless::Vec<Standing<T>, MAX_FEATURES>;

/// Where a measurement stands among the landmarks.
#[derive(Clone, Copy)]
pub(super) enum Standing<T> {
    /// It can't be used: it failed its check, or the filter refused it.
    Unsound,
    /// There is no landmark that it may be of.
    Alone,
    /// It is further than the birth threshold from every landmark, of which this is the nearest.
    Stranger(Nearest<T>),
    /// It is within the birth threshold of this landmark, and not of it.
    Gated(Nearest<T>),
    /// It is of the landmark with this id.
    Paired(u32),
}

/// The landmark that a measurement is nearest to, and how near.
#[derive(Clone, Copy)]
pub(super) struct Nearest<T> {
    pub(super) landmark: u32,
    pub(super) innovation: Vector2<T>,
    pub(super) covariance: Matrix2<T>,
    pub(super) nis: T,
}

impl<T: Real> Nearest<T> {
    /// The outcome of a measurement of `dof` that is of no landmark.
    pub(super) fn outcome(&self, decision: Decision, dof: usize) -> Outcome<T> {
        let Self { landmark, innovation, covariance, nis } = *self;
        let (landmark, nis) = (Some(landmark), Some(nis));
        Outcome { decision, landmark, innovation, covariance, nis, dof, ..Outcome::default() }
    }
}

impl<T: Real> Standing<T> {
    /// Where the filter's outcome leaves it.
    pub(super) fn after(outcome: &Outcome<T>) -> Self {
        let Outcome { decision, landmark, innovation, covariance, nis, .. } = *outcome;
        match (decision, landmark, nis) {
            (Decision::Gated, Some(landmark), Some(nis)) => {
                Self::Gated(Nearest { landmark, innovation, covariance, nis })
            }
            (_, Some(landmark), _) if decision.is_update() => Self::Paired(landmark),
            _ => Self::Unsound,
        }
    }
}

/// Pairs of measurement and landmark within their gates, measurement by measurement.
pub(super) struct Candidates<T> {
    pub(super) list: heapless::Vec<Candidate<T>, MAX_CANDIDATES>,
    /// The first of them linearised, as many as a search looks at: for all there is no room on a microcontroller's stack.
    pub(super) linear: heapless::Vec<Pair<T>, MAX_JOINT_CANDIDATES>,
    /// Those beyond the capacity.
    pub(super) dropped: u32,
}

impl<T: Real> Candidates<T> {
    pub(super) const fn new() -> Self {
        Self { list: heapless::Vec::new(), linear: heapless::Vec::new(), dropped: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.list.clear();
        self.linear.clear();
        self.dropped = 0;
    }

    pub(super) fn push(&mut self, candidate: Candidate<T>, pair: Pair<T>) {
        match self.list.push(candidate) {
            Ok(()) => _ = self.linear.push(pair), // beyond the capacity it is linearised again
            Err(_) => self.dropped += 1,
        }
    }

    /// All that are left.
    pub(super) fn paired(&self) -> Paired<'_, T> {
        let Self { list, linear, dropped } = self;
        Paired { list, linear, dropped: *dropped, ambiguous: 0, truncated: false }
    }

    /// The exclusive nearest.
    pub(super) fn nearest(&mut self) -> Paired<'_, T> {
        exclusive_nearest(&mut self.list);
        self.paired()
    }
}

/// The pairs that are to be updated with.
#[derive(Clone, Copy)]
pub(super) struct Paired<'a, T> {
    pub(super) list: &'a [Candidate<T>],
    pub(super) linear: &'a [Pair<T>],
    /// Candidates beyond the capacity.
    pub(super) dropped: u32,
    /// Pairs left out because another explanation is as likely.
    pub(super) ambiguous: u32,
    /// Whether the search did not look at everything.
    pub(super) truncated: bool,
}

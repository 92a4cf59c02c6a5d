//! What the page's modules tell one another of a run, defined once for Rust and for JavaScript.
//!
//! Three WebAssembly modules have three memories; what goes from one to another is a [`Record`] in bytes. What goes
//! to the page by the dozen (corners, landmarks) is rows of a `Float32Array`; [`rows`] writes a row's columns once,
//! as a structure here and as an enumeration of column numbers in JavaScript.
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

pub mod record;
pub mod rows;

pub use record::{Frame, MapPoint, Reading, Record};
pub use rows::{Beam, BeamKind, Corner, Landmark, Line, Predicted};

use monorange_core::slam;
use serde::{Deserialize, Serialize};
use wasm_bindgen::prelude::*;

/// What became of a corner.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Decision {
    /// It corrected a landmark.
    Update = 0,
    /// It is a new landmark.
    Birth = 1,
    /// It is too far from its landmark.
    Gated = 2,
    /// It may become a landmark.
    Tentative = 3,
    /// It was refused.
    Rejected = 4,
}

/// The pairs of this enumeration and the core's, which has no numbers of its own.
const DECISIONS: [(Decision, slam::Decision); 5] = [
    (Decision::Update, slam::Decision::Update),
    (Decision::Birth, slam::Decision::Birth),
    (Decision::Gated, slam::Decision::Gated),
    (Decision::Tentative, slam::Decision::Tentative),
    (Decision::Rejected, slam::Decision::Rejected),
];

impl From<slam::Decision> for Decision {
    fn from(decision: slam::Decision) -> Self {
        match decision {
            slam::Decision::Update => Self::Update,
            slam::Decision::Birth => Self::Birth,
            slam::Decision::Gated => Self::Gated,
            slam::Decision::Tentative => Self::Tentative,
            slam::Decision::Rejected => Self::Rejected,
        }
    }
}

impl From<Decision> for slam::Decision {
    fn from(decision: Decision) -> Self {
        DECISIONS
            .into_iter()
            .find_map(|(ours, theirs)| (ours == decision).then_some(theirs))
            .unwrap_or(Self::Rejected)
    }
}

impl Decision {
    /// The decision of this number in a row.
    pub fn of(number: f32) -> Option<Self> {
        DECISIONS.into_iter().find_map(|(ours, _)| (ours as u32 as f32 == number).then_some(ours))
    }
}

/// The filter's verdict on itself.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// No corner was matched yet.
    #[default]
    Unchecked = 0,
    /// The errors are as large as the filter says.
    Consistent = 1,
    /// Not to be relied on.
    Doubtful = 2,
    /// The pose is not known.
    Lost = 3,
}

impl From<slam::Verdict> for Verdict {
    fn from(verdict: slam::Verdict) -> Self {
        match verdict {
            slam::Verdict::Unchecked => Self::Unchecked,
            slam::Verdict::Consistent => Self::Consistent,
            slam::Verdict::Doubtful => Self::Doubtful,
            slam::Verdict::Lost => Self::Lost,
        }
    }
}

impl From<Verdict> for slam::Verdict {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Unchecked => Self::Unchecked,
            Verdict::Consistent => Self::Consistent,
            Verdict::Doubtful => Self::Doubtful,
            Verdict::Lost => Self::Lost,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decision_keeps_its_meaning_and_its_number() {
        for (ours, theirs) in DECISIONS {
            assert_eq!((Decision::from(theirs), slam::Decision::from(ours)), (ours, theirs));
            assert_eq!(Decision::of(ours as u32 as f32), Some(ours));
        }
        assert_eq!(Decision::of(f32::NAN), None);
    }
}

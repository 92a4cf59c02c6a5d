//! What is measured of known landmarks, and what became of it.
use crate::Real;
use crate::slam::models::Measurement;
use nalgebra::{Matrix2, Vector2};

/// A measurement of a landmark that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation<T> {
    /// Which landmark.
    pub landmark: u32,
    /// What was measured.
    pub measurement: Measurement<T>,
}

/// What became of a measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Decision {
    /// It corrected the state.
    Update,
    /// It started a landmark.
    Birth,
    /// It lay beyond the gate, or between the thresholds for a match and a birth.
    Gated,
    /// It corrected the state through a landmark that is not yet confirmed.
    Tentative,
    /// It could not be used.
    #[default]
    Rejected,
}

impl Decision {
    /// Whether it corrected the state.
    pub const fn is_update(self) -> bool {
        matches!(self, Self::Update | Self::Tentative)
    }

    /// The word for it in `observations.csv`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Update => "update",
            Self::Birth => "birth",
            Self::Gated => "gated",
            Self::Tentative => "tentative",
            Self::Rejected => "rejected",
        }
    }
}

/// What became of a measurement, with its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome<T> {
    /// What was done.
    pub decision: Decision,
    /// The landmark it was of, or the nearest one when it was gated.
    pub landmark: Option<u32>,
    /// ν.
    pub innovation: Vector2<T>,
    /// S, before any inflation.
    pub covariance: Matrix2<T>,
    /// νᵀS⁻¹ν, before any inflation; `None` for births and rejections.
    pub nis: Option<T>,
    /// Degrees of freedom of `nis`.
    pub dof: usize,
    /// The factor on R that the soft gate needed; 1 inside the gate.
    pub inflation: T,
}

impl<T: Real> Default for Outcome<T> {
    fn default() -> Self {
        Self {
            decision: Decision::Rejected,
            landmark: None,
            innovation: Vector2::zeros(),
            covariance: Matrix2::zeros(),
            nis: None,
            dof: 0,
            inflation: T::one(),
        }
    }
}

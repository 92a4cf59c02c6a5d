//! Homographies between two pictures, with their covariance.
mod estimate;
mod matches;
mod normal_equations;
mod refine;
mod robust;
mod sample;

pub use estimate::{Homography, PredictedPoint};
pub use matches::Match;
pub use robust::{HomographyConfig, HomographyEstimate, direct_linear_transform, estimate_homography};

/// Why there is no homography: an outcome, not a broken contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoHomography {
    /// Fewer than four matches.
    TooFewMatches,
    /// The slice for the posteriors is shorter than the matches.
    TooFewPosteriors,
    /// A coordinate or variance is not a finite number, or a variance is not above 0.
    NotFinite,
    /// The points of one of the pictures coincide or lie on a line.
    Degenerate,
    /// No more matches agree than chance would give.
    NoConsensus,
}

impl core::fmt::Display for NoHomography {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::TooFewMatches => "a homography needs at least four matches",
            Self::TooFewPosteriors => "there is less room for posteriors than there are matches",
            Self::NotFinite => "a match holds a number that is not finite, or a variance that is not above 0",
            Self::Degenerate => "the matched points coincide or lie on a line",
            Self::NoConsensus => "no more matches agree on a homography than chance would give",
        })
    }
}

impl core::error::Error for NoHomography {}

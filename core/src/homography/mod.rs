//! Homographies between two pictures, with their covariance.
//!
//! ```text
//! p̂ = M p                                     divided by the third component, which must be positive       (10)
//! S = J_M Σ_M J_Mᵀ + M' Σ_m M'ᵀ               covariance of p̂; association adds Σ_f                        (11)
//! r = p' − π(M p̃) − A (p − p̃)                 residual with the point's own two unknowns p̃ eliminated
//! d = rᵀ S_r⁻¹ r,   S_r = Σ' + A Σ Aᵀ         squared Mahalanobis distance, χ²₂ for a right match
//! ℓ = Σ ln(1 + γ a/((1 − γ) 2π √det S_r) · e^(−d/2))      log-likelihood, right matches against wrong ones
//! Σ_M = B (Bᵀ [Σ w JᵀS_r⁻¹J] B)⁻¹ Bᵀ          B: orthonormal basis across M (9×8), so Σ_M has rank 8
//! ```
//!
//! | symbol | in code | shape, unit |
//! |---|---|---|
//! | M | [`Homography::matrix`] | 3×3, first picture → second, ‖M‖ = 1 (Frobenius) |
//! | Σ_M | [`Homography::covariance`] | 9×9, elements row by row, rank 8: zero along M |
//! | J_M, M' | [`Homography::by_matrix`], [`Homography::by_point`] | 2×9, 2×2 |
//! | A | ∂π(M p)/∂p | 2×2 |
//! | Σ, Σ' | [`Match::from_cov`], [`Match::to_cov`] | 2×2, px² |
//! | γ, a | share of right matches, area that wrong ones spread over | –, px² |
//! | w | posterior of a match | 0 … 1 |
//!
//! **How.** Samples of four matches, seeded, give M in closed form (projective bases); samples that no plane seen
//! from one side gives are dropped unscored, and a model is tried on 64 matches before the rest. The best is
//! optimised with the noise first taken for larger, then refined by expectation–maximisation with damped Newton
//! steps on the Gold Standard cost of Hartley & Zisserman (*Multiple View Geometry*, 2nd ed., algorithm 4.3; errors
//! in both pictures). There is no threshold in the refinement: a match counts by its posterior, which costs no
//! efficiency, so that the covariance is honest (`tests/tests/system/homography.rs`: NEES 8.05 of 8 over 4,800 problems).
//!
//! **Numbers.** Everything is computed in Hartley's normalised coordinates, f32 included. Working memory is a few
//! kilobytes of stack, whatever the number of matches. The covariance is first order and holds from four matches
//! on (Criminisi, Reid & Zisserman, BMVC 1997).
//!
//! **The floor.** [`ground_motion`] takes the robot's step from matches on and above the floor. Where the floor has few
//! keypoints, `floor_matches` (feature `alloc`) finds patches of its texture.
//!
//! **Limits.** One plane a call, or a camera that only turns. Mirrored pictures are not found. With fewer than
//! half of the matches right, raise [`HomographyConfig::max_samples`].
//!
//! Source: the paper's equations (10) and (11), corrected: (11) needs Σ_M carried into the picture first.
mod confirmation;
mod estimate;
#[cfg(feature = "alloc")]
mod floor_texture;
mod ground_motion;
mod jolt;
mod matches;
mod motion_likelihood;
mod normal_equations;
mod odometry;
mod planar;
mod refine;
mod robust;
mod sample;
#[cfg(test)]
mod tests;

pub use estimate::{Homography, PredictedPoint};
#[cfg(feature = "alloc")]
pub use floor_texture::{FloorTexture, floor_matches};
pub use ground_motion::{
    GroundMotion, GroundMotionConfig, MotionModel, MotionPrior, MountEvidence, NoMotion, ground_motion,
};
pub use jolt::Jolt;
pub use matches::{Match, UNEVEN_VAR_PX2};
pub use motion_likelihood::{Membership, Track};
pub use odometry::{Disagreement, OdometryConfig, OdometryReport, VisualOdometry};
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

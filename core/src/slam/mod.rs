//! The filter: a robot and its landmarks, estimated together.
//!
//! State x = (p, θ, l₁ … l_N) and covariance P of ordinary, additive errors, all in the world. J = [0 −1; 1 0],
//! V(a) the mean rotation of an arc of a ([`arc_rotation`]), d = R(θ)ᵀ(l − p) a landmark in the robot's frame.
//!
//! ```text
//! predict   p⁺ = p + R(θ) d_u,  θ⁺ = θ + Δθ;   P ← F P Fᵀ + Q,   F = I + J(p⁺ − p) e_θᵀ             (8), (12)
//! update    ν = z − h(d),  S = H P Hᵀ + R,  K = P Hᵀ S⁻¹,  δ = K ν,  P ← P − K S Kᵀ                 (9), (13)
//! retract   θ⁺ = θ + δ_θ,  q⁺ = q + V(δ_θ) δ_q       for the robot's and every landmark's position q
//! reset     P ← A P Aᵀ,  A = I + a e_θᵀ,  a_q = J (q⁺ − q)
//! birth     l = p + R(θ) d(z),  P_l· = G P_r·,  P_ll = G P_rr Gᵀ + R(θ) Σ_d R(θ)ᵀ,  G = [I, J(l − p)]
//! ```
//!
//! Retract and reset are the only difference between the right-invariant filter and the textbook's. No measurement sees the whole
//! map turn about the origin; with these two lines the covariance does not shrink in that direction. Without them the paper's
//! filter becomes too sure of its heading on long loops (normalised error 33 instead of 1; with them 1.2; `cargo test -p monorange-tests slam_consistency::`).
//!
//! | symbol | in code | shape, unit |
//! |---|---|---|
//! | p, θ | [`Filter::pose`] | m, rad, world |
//! | l_i | [`Filter::position`] | m, world |
//! | P | [`Filter::covariance_at`] | n × n, n = 3 (+ 4 mount) (+ 3 wheels) + 2 N, packed |
//! | d_u, Δθ, their covariance | [`Increment`] | m, rad, robot |
//! | z, R | [`Measurement`] | see [`Linearised`] for others |
//! | ν, S, νᵀS⁻¹ν | [`Outcome`] | |
//!
//! Equation numbers are the paper's, corrected where it slips: the inverse in K, atan2 and wrapping in (9). Sources:
//! A. Barrau and S. Bonnabel, "An EKF-SLAM algorithm with consistency properties", 2015; T. Zhang et al.,
//! "Convergence and consistency analysis for a 3-D invariant-EKF SLAM", 2017; G. P. Huang, A. I. Mourikis and S. I.
//! Roumeliotis, "Observability-based rules for designing consistent EKF SLAM estimators", 2010 (first estimates).
//!
//! *Parts.* `Increment` moves the robot; `Measurement` and the models linearise what is seen; `Filter` keeps state and
//! covariance, [packed or in factors](Covariance); [`Map`] decides who is who, who is born and who goes; [`Health`]
//! says whether to believe it; [`RingStart`] waits with landmarks known by their range alone.
//!
//! *Cost.* A prediction touches three rows, O(n). A landmark's update costs one pass over the packed P, n²/2 numbers,
//! and up to four landmarks of a frame share it. Memory: [`storage_len`] numbers, 12,864 bytes in `f32` for 32 landmarks.
//!
//! *Limits.* First order: errors of the heading of tens of degrees within one update are beyond it. Past predictions
//! are not linearised again, so that on a kilometres-long loop the map is off the batch optimum. Noise is white: what several measurements share must be a state (the mount, the wheels) or be
//! allowed for in their variance.
mod consistency;
mod covariance;
mod filter;
mod health;
mod landmark;
mod map;
mod models;
mod positive;
#[cfg(feature = "alloc")]
mod registration;
mod ring;
mod snapshot;

pub use covariance::packed_len;
pub use filter::{
    Covariance, Decision, Filter, FilterConfig, Observation, Outcome, Variant, WHEEL_STATES, states_for,
    storage_len,
};
pub(crate) use filter::{FILTER, FILTER_REFERENCES};
pub use health::{FrameEvidence, FrameHealth, Health, KNOWN_HEADING, Reason, Verdict};
pub use landmark::{Form, Landmark, Status};
pub use map::{Feature, Hint, MAX_FEATURES, Map, MapConfig, MapReport, Pairing, View};
pub(crate) use map::{MAP, MAP_REFERENCES};
pub use models::{
    Increment, Integration, JacobianCheck, LinearisationPoint, Linearised, Measurement, arc_rotation,
    check_jacobians,
};
#[cfg(feature = "alloc")]
pub use registration::{Place, Registration, register};
pub use ring::RingStart;
pub use snapshot::{MAP_BYTES, SavedMap, snapshot_len};

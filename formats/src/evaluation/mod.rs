//! How good a trajectory and a map are, against the truth.
//!
//! With the truth T_k and the estimate T̂_k (`world_from_robot`), aligned by S,
//!
//! ```text
//! absolute   ‖ p_k − S p̂_k ‖,   wrap(θ_k − θ̂_k − θ_S)
//! relative   E = (T_i⁻¹ T_j)⁻¹ (T̂_i⁻¹ T̂_j)      over stretches i…j of a fixed length of the true path
//! NEES       eᵀ P⁻¹ e,   e = ((V(a)⁻¹ + a J)(p̂ − p), a),  a = wrap(θ̂ − θ)      3 is right on average
//! ```
//!
//! The error e is measured in the filter's own tangent space (V and J as in [`monorange_core::slam`]); near the
//! truth it is (p̂ − p, θ̂ − θ). NEES is given only without alignment, which would hide what it measures.
//!
//! Source: Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", 2012 (absolute and relative);
//! Bar-Shalom, Li, Kirubarajan, "Estimation with applications to tracking and navigation", 2001 (NEES).
mod alignment;
mod map;
mod trajectory;
mod truth;

pub use alignment::{Align, Alignment};
pub use map::{MapErrors, MapPairing, map_errors};
pub use trajectory::{Spread, TrajectoryErrors, nees, trajectory_errors};
pub use truth::{MAX_TRUTH_GAP, Pair, Truth};

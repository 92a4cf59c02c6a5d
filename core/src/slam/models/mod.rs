//! What moves the robot and what is measured, each with its linearisation.
//!
//! | file | what it holds |
//! |---|---|
//! | `motion` | a step of the robot with its covariance: (8), (12) |
//! | `measurement` | what a sensor may say of a landmark |
//! | `linearise` | innovation and Jacobians of each: (9) |
//! | `self_check` | Jacobians of one's own measurement against central differences |
//!
//! A new measurement is a variant in `measurement` and its prediction in `linearise`; `self_check`'s tests list it.
pub(in crate::slam) mod linearise;
pub(in crate::slam) mod measurement;
pub(in crate::slam) mod motion;
mod self_check;

pub use linearise::Linearised;
pub use measurement::Measurement;
pub use motion::{Increment, Integration, arc_rotation};
pub use self_check::{JacobianCheck, LinearisationPoint, check_jacobians};

//! The filter.
mod birth;
mod consistency;
mod factored;
mod filter;
mod landmark;
mod measurement;
mod model;
mod motion;
mod packed;
mod triangle;
mod update;

pub use filter::{Covariance, Filter, FilterConfig, Variant, states_for, storage_len};
pub use landmark::{Form, Landmark, Status};
pub use measurement::Measurement;
pub use model::Linearised;
pub use motion::{Increment, Integration, arc_rotation};
pub use triangle::packed_len;
pub use update::{Decision, Observation, Outcome};

//! The filter.
mod birth;
mod consistency;
mod factored;
mod filter;
mod health;
mod landmark;
mod map;
mod measurement;
mod model;
mod motion;
mod packed;
mod ring;
mod snapshot;
mod triangle;
mod update;

pub use filter::{Covariance, Filter, FilterConfig, Variant, states_for, storage_len};
pub use health::{Health, Verdict};
pub use landmark::{Form, Landmark, Status};
pub use map::{Feature, Hint, MAX_FEATURES, Map, MapConfig, MapReport, Pairing, View};
pub use measurement::Measurement;
pub use model::Linearised;
pub use motion::{Increment, Integration, arc_rotation};
pub use ring::RingStart;
pub use snapshot::{MAP_BYTES, snapshot_len};
pub use triangle::packed_len;
pub use update::{Decision, Observation, Outcome};

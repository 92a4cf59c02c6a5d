//! Who is who: measurements and landmarks.
mod gate;

pub use gate::{CHI2_99, Gate, inflation, normalised_square};
pub(crate) use gate::{cholesky, forward};

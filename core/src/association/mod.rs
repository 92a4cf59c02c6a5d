//! Who is who: measurements and landmarks.
mod gate;
mod joint;
mod pixels;

pub use gate::{CHI2_99, Gate, inflation, normalised_square};
pub(crate) use gate::{cholesky, forward};
pub(crate) use joint::sort_for_search;
pub use joint::{
    Candidate, Correlated, JointResult, MAX_CANDIDATES, MAX_JOINT_CANDIDATES, MAX_PAIRS, exclusive_nearest,
    joint_compatibility,
};
pub use pixels::{
    Carrier, Corner, PixelMemory, PixelPairing, PixelReport, Remembered, carry_pixel, choose_carrier,
};

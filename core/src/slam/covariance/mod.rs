//! The covariance in memory: a triangle of numbers, its two forms, and the passes over it.
//!
//! | file | what it holds |
//! |---|---|
//! | `triangle` | the upper triangle by rows, in a slice that the caller lends |
//! | `row` | the sparse rows of H that every pass takes |
//! | `packed` | P itself: predict, P Hᵀ, append |
//! | `downdate` | P ← P − K S Kᵀ for one to four landmarks in one pass, vectorised |
//! | `factored` | P = U D Uᵀ: the same operations, positive by construction |
pub(in crate::slam) mod downdate;
pub(in crate::slam) mod factored;
pub(in crate::slam) mod packed;
mod row;
pub(in crate::slam) mod triangle;

pub(in crate::slam) use row::{Row, Rows};
pub use triangle::packed_len;

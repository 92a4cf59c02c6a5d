//! Grey pictures by rows: binning, smoothing, gradient, edge masks, noise.
//!
//! Every kernel takes row slices and writes row slices; nobody holds a picture. A row that is computed from n
//! neighbours is n − 1 values shorter than they are, so borders need no special case: what cannot be computed
//! without inventing pixels is not computed. In the order in which a picture goes through them:
//!
//! ```text
//! b = [1 4 6 4 1]                 binomial, variance 1 px²
//! S = (bᵀ b ∗ I) / 16             u16, 16 to a grey level
//! G_u = [−1 0 1]   ∗ [1 2 1]ᵀ ∗ S     i16, 128 to a grey level per pixel
//! G_v = [−1 0 1]ᵀ ∗ [1 2 1]   ∗ S
//! M = { |G| ≥ T }                 one bit a pixel
//! M ∘ E = (M ⊖ E) ⊕ E             opening: keeps what a run E fits into
//! ```
//!
//! | symbol | in code | unit | largest value |
//! |---|---|---|---|
//! | I | rows of `u8` | grey level | 255 |
//! | bᵀ ∗ I | [`smooth_row`] | 1/16 grey level | 4080 |
//! | S | [`smooth_column`] | 1/16 grey level | 4080 |
//! | G_u, G_v | [`gradient_row`] | 1/128 grey level per pixel | ±16 320, stored with [`GRADIENT_ZERO`] added |
//! | M | [`threshold_row`] | bit, first pixel in bit 0 of word 0 | – |
//!
//! White noise of variance σ² in I has variance 303 σ² in G (its kernel's squared norm over 16²) and is
//! correlated along an edge over about four pixels: [`NOISE_GAIN`], [`correlation_length`].
//!
//! Loops have no branches, and take as many 16-bit values at a time as the processor can: see the module `lanes`.
mod binned;
mod gradient;
mod grey;
mod lanes;
mod mask;
mod noise;
mod rows;
mod smooth;

pub use binned::{GreyMemory, add_binned};
pub use gradient::{
    GRADIENT_SCALE, GRADIENT_ZERO, NOISE_GAIN, column_sums, correlation_length, gradient_row,
};
pub use grey::Grey;
pub use mask::{close_column, close_row, intersect, mask_bit, mask_len, open_row, threshold_row, unite};
pub use noise::{GradientLevel, NoiseLevel};
pub use rows::{GradientRows, MARGIN, MAX_OPENING, OpeningRows, line_buffers};
pub use smooth::{smooth_column, smooth_row};

//! Straight edges and the corners of the floor, from the rows of a picture as they come.
//!
//! A floor corner is the foot of a vertical edge on an edge of the floor: both lie on the floor there, so that
//! [`geometry`](crate::geometry) gives its range and bearing. The steps are those of the paper's section 3:
//!
//! ```text
//! rows → smooth → gradient → threshold, closing, opening       crate::image, 4 to 9 rows behind the newest
//!      → maxima across the edge, sub-pixel                     edge.rs,   a bounded list of points
//!      → undistorted                                           lens.rs,   by a coarse grid
//!      → Hough by gradient direction, a kind and polarity at a time    hough.rs
//!      → weighted total least squares, segments                fit.rs, search.rs
//!      → crossings with support, covariance                    corner.rs  (7)
//!
//! members.rs   lists of points by their indices: those of a pass, those near a line, those of each line
//! memory.rs    how many words and points an extractor is lent
//! ```
//!
//! | symbol | in code | unit |
//! |---|---|---|
//! | n, c | [`Line::normal`], [`Line::centroid`] | –, ideal px |
//! | θ, ρ | direction and distance of the Hough transform | 256ths of a turn, px |
//! | x, Σ | [`Corner::pixel`], [`Corner::covariance`] | px and px² as in the picture |
//! | σ | [`Extraction::noise_std`] | grey levels |
//!
//! An *ideal* pixel is where a camera without lens distortion would see the same ray; lines are straight there.
//!
//! *Floor edges* lie within ±60° of the horizontal and below the top of the region of interest. *Vertical edges*
//! are those that point to the vanishing point of gravity, which follows from the mount's tilt and roll.
//!
//! **Cost.** No frame is held: an extractor for 320×240 stays below 48 KiB (a test says so), of which 18 kB are edge
//! points and 17 kB line buffers, reused by the Hough transform. Instructions a frame on a Cortex-M7 are in
//! `mcu/README.md`. **Limits.** The outermost four pixels give no edges. A mount that looks down by more than about
//! 40° shows verticals that lean by more than `vertical_spread` towards the sides. Edges closer than about 3 px are
//! seen as one.
//!
//! Source: the paper, section 3; gradient-directed voting after F. O'Gorman and M. B. Clowes, "Finding picture
//! edges through collinearity of feature points", 1976.
mod config;
mod corner;
pub(crate) mod edge;
pub(crate) mod edge_search;
mod extraction;
mod extractor;
pub(crate) mod fit;
mod hough;
pub(crate) mod lens;
mod members;
mod memory;
mod search;

pub use config::ExtractConfig;
pub(crate) use config::{EXTRACT, EXTRACT_REFERENCES};
pub use edge::EdgePoint;
pub use extraction::{Corner, Extraction, Line, MAX_CORNERS, MAX_LINES, Truncations};
pub use extractor::Extractor;
pub use memory::{mask_words, point_count, row_words};

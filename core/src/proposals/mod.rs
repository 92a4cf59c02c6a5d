//! Straight edges and the corners of the floor, from the rows of a picture as they come.
//!
//! A floor corner is the foot of a vertical edge on an edge of the floor: both lie on the floor there, so that
//! [`geometry`](crate::geometry) gives its range and bearing. It is looked for from the foot outwards:
//!
//! ```text
//! rows → binned → smooth → gradient → threshold      crate::image, 4 rows behind the newest
//!      → maxima across the edge, sub-pixel           edge_search.rs, with crate::lines
//!      → undistorted, what they can be               crate::lines, view.rs
//!      → a bounded list                              edge.rs, edge_list.rs
//!      → vertical edges, linked by gravity           vertical.rs
//!      → bends of the floor's edge                   kink.rs
//!      → floor lines beside them, feet               floor_line.rs, foot.rs
//!      → features, probability                       candidate.rs, features.rs, score.rs
//!      → crossings with covariance                   proposal.rs, lines of crate::lines  (7)
//!      → of several in one place the best            decision.rs
//! ```
//!
//! | symbol | in code | unit |
//! |---|---|---|
//! | n, c | [`Line::normal`](crate::lines::Line::normal), [`Line::centroid`](crate::lines::Line::centroid) | –, ideal px |
//! | x, Σ | [`Corner::pixel`], [`Corner::covariance`] | px and px² as in the picture |
//! | p | [`Corner::probability`] | – |
//! | σ | [`Extraction::noise_std`] | grey levels |
//!
//! An *ideal* pixel is where a camera without lens distortion would see the same ray; lines are straight there. A *unit* is
//! 1/370 rad, 0.155°: lengths are angles, so that one configuration serves every camera. Pictures whose focal length is above
//! [`ProposalConfig::max_focal_px`] are made smaller by whole numbers of pixels as their rows come.
//!
//! *Vertical* is an edge that points to the vanishing point of gravity, which follows from the mount's tilt and roll; any other
//! edge below the horizon may be the *floor's*, at every angle; an edge near gravity may be both. An edge is what exceeds the
//! gradient's own noise, which is measured in every picture: thirty percent of the pixels lie below 0.845 of its deviation.
//!
//! A *proposal* is a place that may be a corner: where floor lines to the left and right cross a vertical edge near or above its
//! lower end (shadows and reflections prolong it below its foot), or where the floor's edge bends. Its probability comes from a
//! small network that was fitted to rendered rooms and drives (`tests/scoring`), and is calibrated on rooms left out. A *corner* is
//! a proposal above [`ProposalConfig::min_probability`], of several in one place the likeliest, of a skirting board's edges the
//! lower. Where what the left and the right say disagrees, the covariance grows by it.
//!
//! **Beside [`lines`](crate::lines).** There a picture has few corners that hold without a doubt, here four to five times as many
//! on photographs, each with a probability. The pipeline takes these
//! where [`Config::corners_from`](crate::pipeline::Config::corners_from) asks for them.
//!
//! **Cost.** Twice the instructions of [`lines`](crate::lines). No frame is held: an extractor for 320×240 stays below
//! 56 KiB (a test says so), of which 22 kB are edge points, 10 kB line buffers and 5 kB means of 4 × 4 pixels. **Limits.** The
//! outermost four pixels give no edges. Edges closer than about 3 px are seen as one. On floors full of joints the list of points fills: those without a vertical edge near go first.
mod candidate;
mod config;
mod decision;
mod edge;
mod edge_list;
mod edge_search;
mod extraction;
mod extractor;
#[cfg(test)]
mod extractor_tests;
mod features;
mod floor_line;
mod foot;
mod kink;
mod memory;
mod proposal;
mod scale;
mod score;
mod score_weights;
mod vertical;
mod view;

pub use candidate::Candidate;
pub use config::ProposalConfig;
pub use edge::EdgePoint;
pub use extraction::{Corner, Extraction, MAX_CORNERS, MAX_LINES, MAX_PROPOSALS, Truncations};
pub use extractor::Extractor;
pub use features::{CONTEXT_SIDE, FEATURE_NAMES, FEATURES, Features, PATCH_SIDE};
#[cfg(feature = "alloc")]
pub use memory::OnHeap;
pub use memory::{mask_words, point_count, row_words};
pub use proposal::Proposal;

//! The virtual scan: how far the floor is free, in every direction, from one picture.
//!
//! A **beam** is the vertical plane through the lens at a bearing; it begins at the point of the floor under the lens, and so do ranges. Its image is a path from the lower border of the picture up to the
//! horizon; what stands upright at that bearing is seen along the same path, above its foot. The path is sampled at equal steps of the
//! picture (two rows at 365 px of focal length). Each sample has a hazard: the probability that something's foot is there, given that the
//! floor is free up to there. The distribution of the foot over the samples follows:
//!
//! ```text
//! h_k = 1 / (1 + exp(−z_k))                      hazard of sample k, from its log-odds z_k
//! S_k = Π_{i ≤ k} (1 − h_i)                      the floor is free up to and with sample k
//! p_k = S_{k−1} h_k                              the foot is at sample k
//! free  = the first sample with 1 − S_k > α, less what its window reaches
//! range = Σ k p_k / Σ p_k about the first sample with 1 − S_k > β
//! ```
//!
//! Log-odds come from twenty pieces of evidence through one layer of 32 rectified sums: steps of the level at three lengths, whether a
//! step lasts upwards, whether the beams beside have it too, upright contrast above and below, texture above and below, and how far
//! the level is from the floor's. All are measured in units of the floor's own look at that distance: the typical step, spread, texture and
//! upright contrast of a floor, from the picture itself (medians over the beams, which from sample to sample may change only as a
//! floor's look does), and from the floor of the pictures before, where there is one. A picture at a third of the contrast gives about the
//! same numbers.
//!
//! With odometry the log-odds of the last picture (against a foot they count for less than for one) are carried along on the floor and count in part
//! ([`ScanConfig::memory`]).
//!
//! | symbol | name in code | unit |
//! |---|---|---|
//! | z | `log_odds` | – |
//! | α | [`ScanConfig::free_quantile`] | – |
//! | β | [`ScanConfig::foot_quantile`] | – |
//!
//! *Where the constants come from.* The weights were fitted (Adam, log loss) on simulated drives with five walkers, seeds 101 and 102 of
//! corridor and office, against the simulator's laser, and on two rendered drives against theirs. Quantiles and memory were chosen on the
//! same drives. Other seeds judge: `cargo test -p monorange-tests scan::`.
//!
//! *Cost.* About 300 KiB in fixed arrays for 96 beams of 128 samples, no heap.
//!
//! *Limits.* One picture does not tell a marking from an obstacle: what looks like a foot ends the free floor. A hole ends it only where its
//! rim or what lies in it looks unlike the floor. An obstacle that reaches below the picture's lower border has no foot to be seen: it is
//! known by looking unlike the floor seen before.
mod decision;
mod evidence;
mod look;
mod motion;
mod network;
mod path;
mod profile;
mod reading;
mod scanner;
mod weights;

pub use motion::motion_in_run;
pub use reading::{Kind, Reading};
pub use scanner::{ScanConfig, Scanner};

/// The most beams of a scan.
pub const BEAMS: usize = 96;
/// The most samples of a beam.
const SAMPLES: usize = 128;

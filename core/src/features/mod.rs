//! Keypoints, their descriptors, and which of two pictures belong together.
//!
//! | detector | for | memory |
//! |---|---|---|
//! | [`BriefRows`], [`detect_brief`]: FAST-9 corners with oriented BRIEF | a microcontroller, or speed | 59 bytes a column |
//! | [`Sift`]: blobs of any scale (feature `sift`) | a host or browser, large changes of view, precision | 65 bytes a pixel |
//!
//! With an allocator (feature `alloc`) `Detector` runs either kind and keeps their memory.
//!
//! Both write [`Keypoint`]s and descriptors to slices that the caller lends, and say what had no room.
//! [`match_descriptors`] pairs either kind of descriptor; [`match_where`] restricts it to predicted positions.
//! FAST corners sit on whole pixels and have one scale; SIFT's are good to 0.3 px.
mod brief;
#[cfg(feature = "alloc")]
mod detector;
mod fast;
mod keypoint;
mod matching;
mod rows;
#[cfg(feature = "sift")]
mod sift;

pub use brief::BriefDescriptor;
#[cfg(feature = "alloc")]
pub use detector::{Descriptors, Detector, ENOUGH_KEYPOINTS, FeatureKind, Features, MAX_KEYPOINTS};
pub use fast::{FastReport, detect_fast};
pub use keypoint::Keypoint;
pub use matching::{
    Descriptor, Match, MatchConfig, MatchReport, Nearest, Prediction, match_descriptors, match_where,
};
pub use rows::{BriefReport, BriefRows, brief_work_len, detect_brief};
#[cfg(feature = "sift")]
pub use sift::{
    Candidate, GridCap, Sift, SiftConfig, SiftDescriptor, SiftReport, SiftWork, sift_samples_len,
};

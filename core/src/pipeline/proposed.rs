//! Corners from proposals, as the pipeline takes them.
use super::{Config, CornersFrom};
use crate::Result;
use crate::lines::{Corner, MAX_CORNERS, Truncations};
use crate::proposals::{OnHeap, ProposalConfig};
use alloc::boxed::Box;

/// How much larger a corner's variance is for the filter than for one picture: a soft shadow or a rounded edge puts the same
/// corner off the same way in every picture, and the filter takes pictures as independent.
///
/// Chosen on simulated corridors and offices (seeds 301, 302) and both rendered drives, which the score was fitted to as well: of 1,
/// 2, 3, 4 and 5 the least whose NEES is below 5 on each.
const REPEATED: f32 = 4.0;

/// The extractor, where the configuration asks for it.
pub(super) fn proposer(config: &Config) -> Result<Option<Box<OnHeap>>> {
    if config.corners_from == CornersFrom::Lines {
        return Ok(None);
    }
    Ok(Some(Box::new(OnHeap::on_heap(ProposalConfig::default(), config.finder)?)))
}

/// The corners of a whole picture, the likeliest first, and what did not fit.
pub(super) fn corners(proposer: &mut OnHeap) -> Result<(heapless::Vec<Corner, MAX_CORNERS>, Truncations)> {
    let extraction = proposer.finish()?;
    let corners = extraction.corners.iter().map(|corner| Corner {
        pixel: corner.pixel,
        covariance: corner.covariance * REPEATED,
        brighter_right: corner.brighter_right,
        brighter_below: corner.brighter_below,
        ..Corner::default()
    });
    let lost = extraction.truncations;
    let truncations = Truncations { lines: lost.lines, corners: lost.corners, ..Truncations::default() };
    Ok((corners.take(MAX_CORNERS).collect(), truncations))
}

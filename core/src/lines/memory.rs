//! How much memory an extractor is lent.
use super::lens::LENS_WORDS;
use super::search::WORDS_BY_POINT;
use crate::image::{MAX_OPENING, OpeningRows, line_buffers, mask_len};

/// The 16-bit words that an extractor for pictures of this size should be lent: line buffers, a Hough
/// accumulator with cells of 2 px, and lists of the edge points, one after the other.
pub const fn row_words(width: usize, height: usize) -> usize {
    let accumulator = 44 * (width + height / 4).div_ceil(2);
    let rows = line_buffers(kept_rows(MAX_OPENING)) * width;
    let lists = WORDS_BY_POINT * point_count(width, height);
    let most = if accumulator > rows { accumulator } else { rows };
    if most > lists { most } else { lists }
}

/// Rows of gradient between the newest and the one above the one that is opened.
pub(super) const fn kept_rows(opening: usize) -> usize {
    opening + 2
}

/// The 32-bit words that an extractor for pictures of this width needs: masks, and the lens's displacements.
pub const fn mask_words(width: usize) -> usize {
    row_masks(width) + LENS_WORDS
}

/// Those of them that are masks.
pub(super) const fn row_masks(width: usize) -> usize {
    OpeningRows::words(width) + mask_len(width)
}

/// A number of edge points that serves pictures of this size well: 2 % of the pixels.
pub const fn point_count(width: usize, height: usize) -> usize {
    let count = width * height / 50;
    if count > 65_535 {
        65_535
    } else if count < 64 {
        64
    } else {
        count
    }
}

//! How much memory an extractor is lent.
use crate::image::{GreyMemory, line_buffers, mask_len};
use crate::lines::lens::LENS_WORDS;
#[cfg(feature = "alloc")]
use {
    super::{EdgePoint, Extractor, ProposalConfig},
    crate::{Result, geometry::RangeFinder},
    alloc::{vec, vec::Vec},
};

/// Rows of gradient that are kept: a maximum is one between two neighbours.
pub(super) const KEPT_ROWS: usize = 3;

/// The 16-bit words that an extractor for pictures of this size needs: line buffers, and what the picture looked like.
pub const fn row_words(width: usize, height: usize) -> usize {
    rows(width) + GreyMemory::words(width, height)
}

/// Those of them that are line buffers.
pub(super) const fn rows(width: usize) -> usize {
    line_buffers(KEPT_ROWS) * width
}

/// The 32-bit words that an extractor for pictures of this width needs: a mask, and the lens's displacements.
pub const fn mask_words(width: usize) -> usize {
    mask_len(width) + LENS_WORDS
}

/// A number of edge points that serves pictures of this size well: 3.6 % of the pixels.
pub const fn point_count(width: usize, height: usize) -> usize {
    let count = width * height / 28;
    if count > 65_535 {
        65_535
    } else if count < 64 {
        64
    } else {
        count
    }
}

/// An extractor that owns its memory.
#[cfg(feature = "alloc")]
pub type OnHeap = Extractor<Vec<u16>, Vec<u32>, Vec<EdgePoint>>;

#[cfg(feature = "alloc")]
impl OnHeap {
    /// An extractor for the pictures of `finder`'s camera, with memory from the heap.
    ///
    /// # Errors
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) for an unusable configuration.
    pub fn on_heap(config: ProposalConfig, finder: RangeFinder<f32>) -> Result<Self> {
        let (width, height) = (finder.camera().width(), finder.camera().height());
        let points = vec![EdgePoint::default(); point_count(width, height)];
        Self::new(config, finder, vec![0; row_words(width, height)], vec![0; mask_words(width)], points)
    }
}

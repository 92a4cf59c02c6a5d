//! The core's floor-corner extractors and its scan, with memory from the heap.
use crate::{Error, Result, files::Rig};
use monorange_core::{
    lines::{EdgePoint, Extractor, mask_words, point_count, row_words},
    scan::{ScanConfig, Scanner},
};

/// An extractor that owns its memory.
pub type HeapExtractor = Extractor<Vec<u16>, Vec<u32>, Vec<EdgePoint>>;

/// An extractor for the rig's pictures.
///
/// # Errors
/// When a setting is out of its range.
pub fn extractor(rig: &Rig) -> Result<HeapExtractor> {
    let camera = rig.finder.camera();
    let (width, height) = (camera.width(), camera.height());
    let points = point_count(width, height);
    let finder = rig.settings.finder;
    Extractor::new(
        rig.settings.extract,
        finder,
        vec![0; row_words(width, height)],
        vec![0; mask_words(width)],
        vec![EdgePoint::default(); points],
    )
    .map_err(Error::new)
}

/// The virtual scan of the rig's pictures.
///
/// # Errors
/// When a setting is out of its range, or the camera sees no floor.
pub fn scanner(rig: &Rig, config: ScanConfig) -> Result<Box<Scanner>> {
    let finder = rig.finder.cast().map_err(Error::new)?;
    let mount_std = rig.mount_std.map(|std| std as f32);
    Scanner::new(config, finder, mount_std, rig.pixel_covariance().cast()).map(Box::new).map_err(Error::new)
}

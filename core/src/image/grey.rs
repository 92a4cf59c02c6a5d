use crate::{Error, Result};

/// A borrowed 8-bit grey picture; pixel (0, 0) is the centre of the top-left one.
#[derive(Clone, Copy, Debug)]
pub struct Grey<'a> {
    pixels: &'a [u8],
    width: usize,
    height: usize,
}

impl<'a> Grey<'a> {
    /// A view of `pixels`, row-major, without padding between rows.
    ///
    /// # Errors
    /// [`Error::Size`] unless there are exactly `width * height` pixels, and at least one.
    ///
    /// ```
    /// let picture = monorange_core::image::Grey::new(&[1, 2, 3, 4, 5, 6], 3, 2)?;
    /// assert_eq!(picture.row(1), [4, 5, 6]);
    /// # Ok::<(), monorange_core::Error>(())
    /// ```
    pub fn new(pixels: &'a [u8], width: usize, height: usize) -> Result<Self> {
        match width.checked_mul(height) {
            Some(expected) if expected == pixels.len() && expected > 0 => Ok(Self { pixels, width, height }),
            expected => Err(Error::Size {
                name: "pixels",
                got: pixels.len(),
                expected: expected.unwrap_or(usize::MAX).max(1),
            }),
        }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row-major.
    pub fn pixels(&self) -> &'a [u8] {
        self.pixels
    }

    /// The pixels of row `v`, or an empty slice below the picture.
    pub fn row(&self, v: usize) -> &'a [u8] {
        self.pixels.chunks_exact(self.width).nth(v).unwrap_or_default()
    }

    /// The rows from top to bottom.
    pub fn rows(&self) -> core::slice::ChunksExact<'a, u8> {
        self.pixels.chunks_exact(self.width)
    }
}

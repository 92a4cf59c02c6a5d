//! Pictures made smaller by rows as they come: sums of whole squares of pixels, and a coarse memory of what was seen.

/// Adds a row of pixels to the sums of a row that is `factor` times narrower; what is left at the right end is left out.
///
/// ```
/// let mut sums = [0; 2];
/// monorange_core::image::add_binned(&[1, 2, 3, 4, 9], 2, &mut sums);
/// assert_eq!(sums, [3, 7]);
/// ```
pub fn add_binned(pixels: &[u8], factor: usize, sums: &mut [u16]) {
    for (sum, square) in sums.iter_mut().zip(pixels.chunks_exact(factor.max(1))) {
        *sum = square.iter().fold(*sum, |sum, pixel| sum.wrapping_add(u16::from(*pixel)));
    }
}

/// A picture's means over squares of [`CELL`](Self::CELL) pixels, in lent words of two cells each.
pub struct GreyMemory<'a> {
    cells: &'a mut [u8],
    columns: usize,
    rows: usize,
}

impl<'a> GreyMemory<'a> {
    /// Pixels along a cell's side.
    pub const CELL: usize = 4;
    /// Parts of a cell in [`at`](Self::at).
    pub const PARTS: i32 = 256;

    /// Words for pictures of this size.
    pub const fn words(width: usize, height: usize) -> usize {
        (width / Self::CELL * (height / Self::CELL)).div_ceil(2)
    }

    /// A view of `words`, which hold the same cells as before; `None` when they are too few.
    pub fn new(words: &'a mut [u16], width: usize, height: usize) -> Option<Self> {
        let cells = bytemuck::cast_slice_mut(words.get_mut(..Self::words(width, height))?);
        Some(Self { cells, columns: width / Self::CELL, rows: height / Self::CELL })
    }

    /// Takes row `row` of the picture; rows come in order.
    pub fn push(&mut self, row: usize, pixels: &[u8]) {
        let (row, part) = (row / Self::CELL, (row % Self::CELL) as u16);
        if row >= self.rows {
            return;
        }
        let cells = self.cells.get_mut(row * self.columns..).unwrap_or_default();
        for (cell, square) in cells.iter_mut().zip(pixels.chunks_exact(Self::CELL)) {
            let sum: u16 = square.iter().map(|pixel| u16::from(*pixel)).sum();
            let mean = (sum + Self::CELL as u16 / 2) / Self::CELL as u16;
            // The mean of the rows so far; of the first row, what was there before counts for nothing.
            *cell = ((u16::from(*cell) * part + mean + part.div_ceil(2)) / (part + 1)) as u8;
        }
    }

    /// The mean of the cell that a pixel lies in, of the nearest one beyond the border.
    pub fn cell(&self, u: f32, v: f32) -> u8 {
        let clamp = |at: f32, count: usize| (at.max(0.0) as usize / Self::CELL).min(count.saturating_sub(1));
        let cell = clamp(v, self.rows) * self.columns + clamp(u, self.columns);
        self.cells.get(cell).copied().unwrap_or(0)
    }

    /// Whether a pixel's place lies within the cells.
    pub fn contains(&self, u: f32, v: f32) -> bool {
        let end = |count: usize| (count * Self::CELL) as f32 - 1.0;
        u >= 0.0 && v >= 0.0 && u < end(self.columns) && v < end(self.rows)
    }

    /// A pixel's coordinate in [`PARTS`](Self::PARTS) of a cell from the first cell's centre.
    pub fn parts(pixel: f32) -> i32 {
        ((pixel - 0.5 * (Self::CELL as f32 - 1.0)) * (Self::PARTS as f32 / Self::CELL as f32)) as i32
    }

    /// The grey level at a place in parts of a cell, bilinear between cells; beyond the border the border's.
    #[inline]
    pub fn at(&self, u: i32, v: i32) -> u8 {
        let most = |count: usize| count.saturating_sub(1) as i32 * Self::PARTS;
        let (u, v) = (u.clamp(0, most(self.columns)), v.clamp(0, most(self.rows)));
        let (u, v) = (u as u32, v as u32);
        let parts = Self::PARTS as u32;
        let (s, t) = (u % parts, v % parts);
        let first = (v / parts) as usize * self.columns + (u / parts) as usize;
        let pair = |start: usize| match self.cells.get(start..start + 2) {
            Some(&[left, right]) => u32::from(left) * (parts - s) + u32::from(right) * s,
            _ => u32::from(self.cells.get(start).copied().unwrap_or(0)) * parts,
        };
        let upper = pair(first);
        let lower = if t > 0 { pair(first + self.columns) } else { 0 };
        ((upper * (parts - t) + lower * t + parts * parts / 2) / (parts * parts)) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{vec, vec::Vec};

    #[test]
    fn a_ramp_is_remembered_as_a_ramp() {
        let (width, height) = (40, 31);
        let mut words = vec![0xffff; GreyMemory::words(width, height)];
        let mut memory = GreyMemory::new(&mut words, width, height).unwrap();
        for row in 0..height {
            let pixels: Vec<u8> = (0..width).map(|u| (2 * u + 4 * row) as u8).collect();
            memory.push(row, &pixels);
        }
        for (u, v) in [(10.0, 10.0), (7.5, 3.0), (22.0, 20.5)] {
            let expected = 2.0 * u + 4.0 * v;
            let found = f32::from(memory.at(GreyMemory::parts(u), GreyMemory::parts(v)));
            assert!((found - expected).abs() <= 1.5, "{found} at {u}, {v}");
        }
        assert!(memory.contains(0.0, 0.0) && !memory.contains(39.5, 0.0) && !memory.contains(5.0, 28.0));
    }
}

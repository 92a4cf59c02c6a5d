//! Line buffers over lent memory: the last rows of every stage, and no frame.
#![allow(clippy::indexing_slicing, reason = "ring indices are taken modulo the ring's length")]
use super::{close_column, column_sums, gradient_row, intersect, mask_len, smooth_column, smooth_row, unite};
use core::ops::Range;

/// Rows of 16-bit words that [`GradientRows`] needs to keep the last `kept` rows of gradient, a picture's width each.
pub const fn line_buffers(kept: usize) -> usize {
    10 + 2 * kept
}
/// Columns and rows of the picture before the first gradient.
pub const MARGIN: usize = 3;
/// The longest run of [`OpeningRows`].
pub const MAX_OPENING: usize = 6;

/// From rows of pixels to the last rows of gradient.
pub struct GradientRows<'a> {
    along: [&'a mut [u16]; 5],
    smooth: [&'a mut [u16]; 3],
    sum: &'a mut [u16],
    difference: &'a mut [u16],
    gradient_u: &'a mut [u16],
    gradient_v: &'a mut [u16],
    /// Values of a row of gradient.
    columns: usize,
}

impl<'a> GradientRows<'a> {
    /// A view of `words`, which hold the same buffers as at the row before; `None` when there are fewer than
    /// [`line_buffers`] words a column, or too few columns for a gradient with neighbours.
    pub fn new(words: &'a mut [u16], width: usize, kept: usize) -> Option<Self> {
        let smoothed = width.checked_sub(4)?;
        let columns = width.checked_sub(2 * MARGIN).filter(|columns| *columns > 2)?;
        let mut rest = words;
        let mut next = |values| rest.split_off_mut(..values);
        Some(Self {
            along: [next(smoothed)?, next(smoothed)?, next(smoothed)?, next(smoothed)?, next(smoothed)?],
            smooth: [next(smoothed)?, next(smoothed)?, next(smoothed)?],
            sum: next(smoothed)?,
            difference: next(smoothed)?,
            gradient_u: next(kept * columns)?,
            gradient_v: next(kept * columns)?,
            columns,
        })
    }

    /// Takes row `newest` of the picture; the gradient's newest row is then `newest` − [`MARGIN`], from row 6 on.
    pub fn push(&mut self, newest: usize, pixels: &[u8]) {
        smooth_row(pixels, self.along[newest % 5]);
        if newest < 4 {
            return;
        }
        let along = core::array::from_fn(|k| &*self.along[(newest + 1 + k) % 5]); // from the oldest
        smooth_column(along, self.smooth[newest % 3]);
        if newest < 6 {
            return;
        }
        let smooth = core::array::from_fn(|k| &*self.smooth[(newest + 1 + k) % 3]);
        column_sums(smooth, self.sum, self.difference);
        let place = self.place(newest - MARGIN);
        gradient_row(
            self.sum,
            self.difference,
            &mut self.gradient_u[place.clone()],
            &mut self.gradient_v[place],
        );
    }

    /// (G_u, G_v) in a row of the picture that still is kept; value 0 belongs to column [`MARGIN`].
    pub fn gradient(&self, row: usize) -> (&[u16], &[u16]) {
        let place = self.place(row);
        (&self.gradient_u[place.clone()], &self.gradient_v[place])
    }

    /// Where a row's gradient is kept.
    fn place(&self, row: usize) -> Range<usize> {
        let start = row * self.columns % self.gradient_u.len();
        start..start + self.columns
    }
}

/// Closing by three and opening by a run along the columns, for mask rows as they come.
pub struct OpeningRows<'a> {
    raw: [&'a mut [u32]; 3],
    closed: &'a mut [u32],
    eroded: &'a mut [u32],
    opened: &'a mut [u32],
    words: usize,
    run: usize,
}

impl<'a> OpeningRows<'a> {
    /// 32-bit words that a picture of this width needs.
    pub const fn words(width: usize) -> usize {
        (2 * MAX_OPENING + 4) * mask_len(width)
    }

    /// A view of `words`, which hold the same rows as before (zeros at the start of a picture), for an opening by
    /// `run` rows; `None` when there are fewer than [`words`](Self::words) of them or the run is not within
    /// 1 ..= [`MAX_OPENING`].
    pub fn new(words: &'a mut [u32], width: usize, run: usize) -> Option<Self> {
        if !(1..=MAX_OPENING).contains(&run) {
            return None;
        }
        let row = mask_len(width);
        let mut rest = words;
        let mut next = |rows| rest.split_off_mut(..rows * row);
        Some(Self {
            raw: [next(1)?, next(1)?, next(1)?],
            closed: next(run)?,
            eroded: next(run)?,
            opened: next(1)?,
            words: row,
            run,
        })
    }

    /// Takes row `newest` of the mask, which `fill` writes, and returns row `newest` − run of the opened one.
    pub fn push(&mut self, newest: usize, fill: impl FnOnce(&mut [u32])) -> &[u32] {
        fill(self.raw[newest % 3]);
        let [above, at] = [1, 2].map(|k| &*self.raw[(newest + k) % 3]);
        let ring_row = |row: usize| (row % self.run) * self.words..(row % self.run + 1) * self.words;
        // The row before can be closed now; the last `run` closed rows make one eroded row, the last `run` eroded
        // rows one opened row. The rings hold exactly these.
        let previous = ring_row(newest + self.run - 1);
        close_column(above, at, self.raw[newest % 3], &mut self.closed[previous]);
        intersect(self.closed.chunks_exact(self.words), &mut self.eroded[ring_row(newest)]);
        unite(self.eroded.chunks_exact(self.words), self.opened);
        self.opened
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::mask_bit;
    use std::{string::String, vec, vec::Vec};

    /// Opens the columns of a picture drawn with characters.
    fn opened(picture: &[&str], run: usize) -> Vec<String> {
        let width = picture[0].len();
        let mut words = vec![0; OpeningRows::words(width)];
        let mut out = Vec::new();
        for row in 0..picture.len() + run {
            let mut view = OpeningRows::new(&mut words, width, run).unwrap();
            let result = view.push(row, |mask| {
                mask.fill(0);
                let line = picture.get(row).unwrap_or(&"");
                for (k, _) in line.bytes().enumerate().filter(|(_, c)| *c == b'#') {
                    mask[k / 32] |= 1 << (k % 32);
                }
            });
            if row >= run {
                out.push((0..width).map(|k| if mask_bit(result, k) { '#' } else { '.' }).collect());
            }
        }
        out
    }

    #[test]
    fn columns_keep_runs_that_are_long_enough_once_their_gaps_are_closed() {
        let before = [
            "#.#..#..................................#", //
            "#.#.....................................#",
            "#......#................................#",
            "..#...............................#......",
            "..#...............................#.....#",
            "#.................................#.....#",
        ];
        let expected = [
            "#.#.....................................#",
            "#.#.....................................#",
            "#.#.....................................#",
            "..#...............................#.....#",
            "..#...............................#.....#",
            "..................................#.....#",
        ];
        let actual = opened(&before, 3);
        assert_eq!(actual, expected, "\nactual\n{}\nexpected\n{}", actual.join("\n"), expected.join("\n"));
    }

    #[test]
    fn a_run_of_one_only_closes() {
        assert_eq!(opened(&["#.", "..", "##", "..", "..", ".#"], 1), ["#.", "#.", "##", "..", "..", ".#"]);
    }

    #[test]
    fn narrow_pictures_have_no_gradient_rows() {
        assert!(GradientRows::new(&mut [0; 1000], 8, 3).is_none());
        assert!(GradientRows::new(&mut [0; 1000], 9, 3).is_some());
        assert!(GradientRows::new(&mut [0; 60], 9, 3).is_none());
    }
}

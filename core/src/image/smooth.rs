use super::lanes::{Lanes, VECTORS, Word, each};

const EVEN_BYTES: u32 = 0x00ff_00ff;

/// Writes [1 4 6 4 1] ∗ `row`, which is four values shorter than `row`, into the start of `out`; value 0
/// belongs to pixel 2.
///
/// ```
/// let mut out = [0; 3];
/// monorange_core::image::smooth_row(&[10, 10, 10, 10, 10, 26, 10], &mut out);
/// assert_eq!(out, [160, 176, 224]);
/// ```
pub fn smooth_row(row: &[u8], out: &mut [u16]) {
    let done = if VECTORS { 0 } else { smooth_fours(row, out) };
    let length = out.len().min(row.len().saturating_sub(4));
    let Some(out) = out.get_mut(done..length) else { return };
    let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|k| row.get(done + k..length + k).unwrap_or_default());
    for (((((out, a), b), c), d), e) in out.iter_mut().zip(a).zip(b).zip(c).zip(d).zip(e) {
        let [a, b, c, d, e] = [a, b, c, d, e].map(|pixel| u16::from(*pixel));
        *out = a + e + 4 * (b + c + d) + 2 * c;
    }
}

/// [`smooth_row`] for whole fours of values, two in a word each; returns how many values those are.
fn smooth_fours(row: &[u8], out: &mut [u16]) -> usize {
    let words = |start: usize| row.get(start..).unwrap_or_default().as_chunks::<4>().0;
    let (quads, _) = out.as_chunks_mut::<4>();
    let mut done = 0;
    for (((quad, at), next), last) in quads.iter_mut().zip(words(0)).zip(words(2)).zip(words(4)) {
        // Pixels 0, 2 and 1, 3; 2, 4 and 3, 5; 4, 6 and 5, 7.
        let [[a, b], [c, d], [e, f]] = [at, next, last].map(|bytes| {
            let word = u32::from_le_bytes(*bytes);
            [word & EVEN_BYTES, word >> 8 & EVEN_BYTES]
        });
        let even = a + e + 4 * (b + c + d) + 2 * c;
        let odd = b + f + 4 * (c + d + e) + 2 * d;
        let [first, third] = [even as u16, (even >> 16) as u16];
        let [second, fourth] = [odd as u16, (odd >> 16) as u16];
        *quad = [first, second, third, fourth];
        done += 4;
    }
    done
}

/// Writes [1 4 6 4 1]ᵀ ∗ `rows` / 16, rounded, for rows made by [`smooth_row`], from the topmost on.
pub fn smooth_column(rows: [&[u16]; 5], out: &mut [u16]) {
    // At most 16 · 4080 + 8 < 2¹⁶.
    each(rows, [out], |[a, b, c, d, e]: [Word; 5]| {
        [(a + e + (b + c + d).up::<2>() + c.up::<1>() + Word::splat(8)).down::<4>()]
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    #[test]
    fn white_stays_white_without_overflow() {
        let mut row = [0; 4];
        smooth_row(&[255; 8], &mut row);
        assert_eq!(row, [4080; 4]);
        let mut out = [0; 4];
        smooth_column([&row; 5], &mut out);
        assert_eq!(out, [4080; 4]);
    }

    proptest! {
        #[test]
        fn every_value_is_the_weighted_sum_of_its_neighbours(
            pixels in prop::collection::vec(any::<u8>(), 5..80), levels in prop::array::uniform5(prop::collection::vec(0..=4080_u16, 1..40)),
        ) {
            let mut row = vec![0; pixels.len() - 4];
            smooth_row(&pixels, &mut row);
            let weights = [1_u16, 4, 6, 4, 1];
            let mut fours = vec![0; row.len()];
            let done = smooth_fours(&pixels, &mut fours);
            prop_assert_eq!(&fours[..done], &row[..done]);
            prop_assert_eq!(done, row.len() / 4 * 4);
            for (k, value) in row.iter().enumerate() {
                prop_assert_eq!(*value, (0..5).map(|i| weights[i] * u16::from(pixels[k + i])).sum::<u16>());
            }
            let length = levels.iter().map(Vec::len).min().unwrap();
            let mut out = vec![0; length];
            smooth_column(std::array::from_fn(|row| &levels[row][..length]), &mut out);
            for (k, value) in out.iter().enumerate() {
                prop_assert_eq!(*value, ((0..5).map(|i| weights[i] * levels[i][k]).sum::<u16>() + 8) / 16);
            }
        }
    }

    #[test]
    fn a_row_shorter_than_the_kernel_gives_nothing() {
        let mut out = [7; 2];
        smooth_row(&[1, 2, 3, 4], &mut out);
        assert_eq!(out, [7; 2]);
    }
}

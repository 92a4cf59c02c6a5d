use super::lanes::{both, join, pairs, split};

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
    let words = |start: usize| row.get(start..).unwrap_or_default().as_chunks::<4>().0;
    let (quads, rest) = out.as_chunks_mut::<4>();
    let done = 4 * quads.len();
    for (((quad, at), next), last) in quads.iter_mut().zip(words(0)).zip(words(2)).zip(words(4)) {
        // Pixels 0, 2 and 1, 3; 2, 4 and 3, 5; 4, 6 and 5, 7.
        let [[a, b], [c, d], [e, f]] = [at, next, last].map(|bytes| {
            let word = u32::from_le_bytes(*bytes);
            [word & EVEN_BYTES, word >> 8 & EVEN_BYTES]
        });
        let even = a + e + 4 * (b + c + d) + 2 * c;
        let odd = b + f + 4 * (c + d + e) + 2 * d;
        let [first, second] = split(even & 0xffff | odd << 16);
        let [third, fourth] = split(even >> 16 | odd & 0xffff_0000);
        *quad = [first, second, third, fourth];
    }
    for (out, window) in rest.iter_mut().zip(row.get(done..).unwrap_or_default().windows(5)) {
        if let &[a, b, c, d, e] = window {
            let [a, b, c, d, e] = [a, b, c, d, e].map(u16::from);
            *out = a + e + 4 * (b + d) + 6 * c;
        }
    }
}

/// Writes [1 4 6 4 1]ᵀ ∗ `rows` / 16, rounded, for rows made by [`smooth_row`], from the topmost on.
pub fn smooth_column(rows: [&[u16]; 5], out: &mut [u16]) {
    // At most 16 · 4080 + 8 < 2¹⁶.
    let smoothed = |[a, b, c, d, e]: [u32; 5]| {
        (a + e + 4 * (b + c + d) + 2 * c + const { both(8) }) >> 4 & const { both(0xfff) }
    };
    let last = out.len().saturating_sub(1);
    let [a, b, c, d, e] = rows.map(|row| pairs(row, 0));
    let (out_pairs, rest) = out.as_chunks_mut::<2>();
    for (((((out, a), b), c), d), e) in out_pairs.iter_mut().zip(a).zip(b).zip(c).zip(d).zip(e) {
        *out = split(smoothed([a, b, c, d, e].map(|pair| join(*pair))));
    }
    if let [out] = rest {
        *out = smoothed(rows.map(|row| row.get(last).copied().unwrap_or(0).into())) as u16;
    }
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

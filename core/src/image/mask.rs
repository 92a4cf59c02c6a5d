//! One bit a pixel, 32 to a word: thresholds and morphology.
//!
//! Structuring elements are straight runs: along a row for edges of the floor, along a column for vertical
//! ones. Opening by a run of n keeps a pixel exactly if n set pixels in a row contain it; closing fills gaps of
//! one pixel.
use super::gradient::GRADIENT_ZERO;
use super::lanes::both;

/// The longest run of [`open_row`].
const MAX_RUN: usize = 32;

/// Words that hold the bits of a row of `width` pixels.
pub const fn mask_len(width: usize) -> usize {
    width.div_ceil(32)
}

/// Bit `column` of a row, false beyond its end.
pub fn mask_bit(mask: &[u32], column: usize) -> bool {
    mask.get(column / 32).is_some_and(|word| word >> (column % 32) & 1 == 1)
}

/// Sets the bits of the pixels whose gradient, stored with [`GRADIENT_ZERO`] added, has at least the magnitude `threshold`,
/// and clears the rest.
///
/// ```
/// use monorange_core::image::{GRADIENT_ZERO, threshold_row};
/// let mut mask = [u32::MAX];
/// threshold_row(&[0, 500, -600, 499].map(|g| GRADIENT_ZERO.wrapping_add_signed(g)), 500, &mut mask);
/// assert_eq!(mask, [0b0110]);
/// ```
pub fn threshold_row(gradient: &[u16], threshold: u16, mask: &mut [u32]) {
    // Whether g ≥ T and whether g ≤ −T, as the highest bit of a sum and of a difference.
    let threshold = threshold.min(GRADIENT_ZERO);
    let limits = [both(GRADIENT_ZERO - threshold), both(3 * GRADIENT_ZERO - threshold)];
    let mut words = mask.iter_mut();
    let (chunks, rest) = gradient.as_chunks::<32>();
    for (chunk, word) in chunks.iter().zip(&mut words) {
        *word = strong_bits(chunk, limits);
    }
    let mut last = [GRADIENT_ZERO; 32];
    last.iter_mut().zip(rest).for_each(|(last, g)| *last = *g);
    let mut last_word = strong_bits(&last, limits);
    for word in words {
        *word = last_word;
        last_word = 0;
    }
}

/// The browser's vectors gather the highest bits of sixteen bytes in one instruction.
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
#[inline(always)]
fn strong_bits(chunk: &[u16; 32], limits: [u32; 2]) -> u32 {
    use core::arch::wasm32::{
        i8x16_bitmask, i8x16_narrow_i16x8, i16x8_add, i16x8_sub, u16x8, u32x4_splat, v128_or,
    };
    let [above, below] = limits.map(|limit| u32x4_splat(limit));
    let (eights, _) = chunk.as_chunks::<8>();
    let strong = |k: usize| {
        let [a, b, c, d, e, f, g, h] = eights.get(k).copied().unwrap_or_default();
        let g = u16x8(a, b, c, d, e, f, g, h);
        v128_or(i16x8_add(g, above), i16x8_sub(below, g))
    };
    let sixteen = |k: usize| u32::from(i8x16_bitmask(i8x16_narrow_i16x8(strong(k), strong(k + 1))));
    sixteen(0) | sixteen(2) << 16
}

#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
#[inline(always)]
fn strong_bits(chunk: &[u16; 32], [above, below]: [u32; 2]) -> u32 {
    let (pairs, _) = chunk.as_chunks::<2>();
    // Pair k's two bits go to k and 16 + k, by halves: four lanes at once where there are lanes.
    let pair = |k: usize| {
        let g = pairs.get(k).map_or(0, |pair| super::lanes::join(*pair));
        ((g + above) | (below - g)) & const { both(1 << 15) }
    };
    let mut fours = [0; 4];
    for (k, four) in fours.iter_mut().enumerate() {
        *four = (pair(k) >> 8 | pair(k + 8)) >> 4 | pair(k + 4) >> 8 | pair(k + 12);
    }
    let [a, b, c, d] = fours;
    let mut bits = (a >> 2 | c) >> 1 | b >> 2 | d;
    if bits == 0 {
        return 0; // as most are
    }
    // The halves are interleaved (H. S. Warren, "Hacker's Delight", 7-2).
    for (shift, middle) in [(8, 0x0000_ff00), (4, 0x00f0_00f0), (2, 0x0c0c_0c0c), (1, 0x2222_2222)] {
        let moved = (bits ^ bits >> shift) & middle;
        bits ^= moved ^ moved << shift;
    }
    bits
}

/// Fills gaps of one pixel along the row.
pub fn close_row(mask: &mut [u32]) {
    let mut left = 0; // the word before, as it was
    for k in 0..mask.len() {
        let right = mask.get(k + 1).copied().unwrap_or(0);
        if let Some(word) = mask.get_mut(k) {
            let was = *word;
            *word |= (was << 1 | left >> 31) & (was >> 1 | right << 31);
            left = was;
        }
    }
}

/// Fills gaps of one pixel along the columns: `at` ∪ (`above` ∩ `below`).
pub fn close_column(above: &[u32], at: &[u32], below: &[u32], out: &mut [u32]) {
    for (((out, above), at), below) in out.iter_mut().zip(above).zip(at).zip(below) {
        *out = at | above & below;
    }
}

/// Clears the pixels that no run of `run` set pixels along the row contains; a run below 2 keeps everything,
/// above 32 counts as 32.
pub fn open_row(mask: &mut [u32], run: usize) {
    let run = run.min(MAX_RUN);
    // Erosion looks to the right only, so it can go forwards in place; dilation the other way.
    for k in 0..mask.len() {
        let right = u64::from(mask.get(k + 1).copied().unwrap_or(0));
        if let Some(word) = mask.get_mut(k).filter(|word| **word != 0) {
            let window = right << 32 | u64::from(*word);
            *word = (1..run).fold(window, |eroded, shift| eroded & window >> shift) as u32;
        }
    }
    for k in (0..mask.len()).rev() {
        let left = k.checked_sub(1).and_then(|k| mask.get(k).copied()).unwrap_or(0);
        if let Some(word) = mask.get_mut(k).filter(|word| **word | left != 0) {
            let window = u64::from(*word) << 32 | u64::from(left);
            *word = ((1..run).fold(window, |dilated, shift| dilated | window << shift) >> 32) as u32;
        }
    }
}

/// Writes the intersection of the rows: an erosion along the columns.
pub fn intersect<'a>(rows: impl Iterator<Item = &'a [u32]>, out: &mut [u32]) {
    out.fill(u32::MAX);
    for row in rows {
        out.iter_mut().zip(row).for_each(|(out, word)| *out &= word);
    }
}

/// Writes the union of the rows: a dilation along the columns.
pub fn unite<'a>(rows: impl Iterator<Item = &'a [u32]>, out: &mut [u32]) {
    out.fill(0);
    for row in rows {
        out.iter_mut().zip(row).for_each(|(out, word)| *out |= word);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::{string::String, vec, vec::Vec};

    fn mask_from(picture: &str) -> Vec<u32> {
        let mut mask = vec![0; mask_len(picture.len())];
        for (column, _) in picture.bytes().enumerate().filter(|(_, c)| *c == b'#') {
            mask[column / 32] |= 1 << (column % 32);
        }
        mask
    }

    fn picture_from(mask: &[u32], width: usize) -> String {
        (0..width).map(|column| if mask_bit(mask, column) { '#' } else { '.' }).collect()
    }

    fn assert_row(kernel: impl Fn(&mut [u32]), before: &str, expected: &str) {
        let mut mask = mask_from(before);
        kernel(&mut mask);
        let actual = picture_from(&mask, before.len());
        assert_eq!(actual, expected, "\n  before {before}\n  actual {actual}\nexpected {expected}");
    }

    #[test]
    fn opening_by_three_drops_shorter_runs_also_across_words() {
        assert_row(
            |mask| open_row(mask, 3),
            "##.###..#.####.............##.####.#..###.##",
            "...###....####................####....###...",
        );
    }

    #[test]
    fn closing_fills_single_gaps_also_across_words() {
        assert_row(
            close_row,
            "#.#..##...............#.......#.#.#..#",
            "###..##...............#.......#####..#",
        );
    }

    #[test]
    fn closing_along_columns_bridges_one_row() {
        let rows = ["#.##.", "#..#.", ".#.#."].map(mask_from);
        let mut out = vec![0];
        close_column(&rows[0], &rows[1], &rows[2], &mut out);
        assert_eq!(picture_from(&out, 5), "#..#.");
        close_column(&rows[0], &mask_from("....."), &rows[2], &mut out);
        assert_eq!(picture_from(&out, 5), "...#.");
    }

    #[test]
    fn rows_erode_and_dilate_along_columns() {
        let rows = ["##.#", "###.", "#.#."].map(mask_from);
        let (mut eroded, mut dilated) = (vec![0], vec![0]);
        intersect(rows.iter().map(Vec::as_slice), &mut eroded);
        unite(rows.iter().map(Vec::as_slice), &mut dilated);
        assert_eq!(picture_from(&eroded, 4), "#...");
        assert_eq!(picture_from(&dilated, 4), "####");
    }

    proptest! {
        #[test]
        fn threshold_is_the_magnitude_pixel_by_pixel(
            gradient in prop::collection::vec(-16_320_i16..=16_320, 0..100), threshold in 1_u16..=16_320,
        ) {
            let words: Vec<u16> = gradient.iter().map(|g| GRADIENT_ZERO.wrapping_add_signed(*g)).collect();
            let mut mask = vec![0xdead_beef; mask_len(gradient.len()) + 1];
            threshold_row(&words, threshold, &mut mask);
            for column in 0..mask.len() * 32 {
                let expected = gradient.get(column).is_some_and(|g| g.unsigned_abs() >= threshold);
                prop_assert_eq!(mask_bit(&mask, column), expected, "column {}", column);
            }
        }

        #[test]
        fn opening_keeps_exactly_the_runs_that_are_long_enough(
            picture in "[#.]{1,100}", run in 1_usize..=9,
        ) {
            let mut mask = mask_from(&picture);
            open_row(&mut mask, run);
            let expected: String = picture
                .split_inclusive('.')
                .flat_map(|piece| {
                    let length = piece.trim_end_matches('.').len();
                    let kept = if length >= run { "#" } else { "." };
                    [kept.repeat(length), ".".repeat(piece.len() - length)]
                })
                .collect();
            prop_assert_eq!(picture_from(&mask, picture.len()), expected);
        }
    }
}

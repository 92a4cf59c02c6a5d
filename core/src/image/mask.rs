//! One bit a pixel, 32 to a word: thresholds and morphology.
//!
//! Structuring elements are straight runs: along a row for edges of the floor, along a column for vertical
//! ones. Opening by a run of n keeps a pixel exactly if n set pixels in a row contain it; closing fills gaps of
//! one pixel. A row costs about ten operations for 32 pixels.

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

/// Sets the bits of the pixels whose signed gradient has at least the magnitude `threshold`, clears the rest.
///
/// ```
/// let mut mask = [u32::MAX];
/// let gradient = [0, 500, (-600_i16) as u16, 499];
/// monorange_core::image::threshold_row(&gradient, 500, &mut mask);
/// assert_eq!(mask, [0b0110]);
/// ```
pub fn threshold_row(gradient: &[u16], threshold: u16, mask: &mut [u32]) {
    // |g| < T as one unsigned comparison: g + T − 1 lies in 0 ..= 2T − 2.
    let (shift, last) = (threshold.wrapping_sub(1), 2 * threshold.saturating_sub(1));
    let strong = |g: u16| u8::from(g.wrapping_add(shift) > last);
    let mut words = mask.iter_mut();
    let chunks = gradient.chunks_exact(32);
    let rest = chunks.remainder();
    for (chunk, word) in chunks.zip(&mut words) {
        let mut flags = [0_u8; 32];
        for (flag, g) in flags.iter_mut().zip(chunk) {
            *flag = strong(*g);
        }
        *word = pack(&flags);
    }
    let mut flags = [0_u8; 32];
    for (flag, g) in flags.iter_mut().zip(rest) {
        *flag = strong(*g);
    }
    let mut last_word = pack(&flags);
    for word in words {
        *word = last_word;
        last_word = 0;
    }
}

/// 32 bytes of 0 or 1 as bits, four at a time: the product moves byte k's bit to bit 24 + k.
fn pack(flags: &[u8; 32]) -> u32 {
    let (groups, _) = flags.as_chunks::<4>();
    groups.iter().enumerate().fold(0, |word, (k, group)| {
        let bits = u32::from_le_bytes(*group).wrapping_mul(0x0102_0408) >> 24 & 0xf;
        word | bits << (4 * k)
    })
}

/// Clears the bits of the pixels whose magnitude is not above `before`'s, not at least `after`'s, or below `other`'s:
/// what stays are the maxima across an edge along its dominant axis. Bit k belongs to value k of `at` and `other`, and
/// to value k + shift of the rows `before` and `after` that come with a shift; pixels without both are cleared.
pub fn keep_maxima(
    before: (&[u16], isize),
    at: &[u16],
    after: (&[u16], isize),
    other: &[u16],
    mask: &mut [u32],
) {
    let magnitude = |g: u16| (g as i16).wrapping_abs();
    let chunk = |row: &[u16], start: isize| {
        let mut values = [u16::MAX >> 1; 32]; // no neighbour: larger than any gradient
        let skipped = start.min(0).unsigned_abs();
        let row = row.get(start.max(0).unsigned_abs()..).unwrap_or_default();
        if let Some(values) = values.get_mut(skipped..) {
            values.iter_mut().zip(row).for_each(|(value, g)| *value = *g);
        }
        values
    };
    for (start, word) in (0_isize..).step_by(32).zip(mask).filter(|(_, word)| **word != 0) {
        let (middle, other) = (chunk(at, start), chunk(other, start));
        let (before, after) = (chunk(before.0, start + before.1), chunk(after.0, start + after.1));
        let mut flags = [0_u8; 32];
        for ((((flag, at), before), after), other) in
            flags.iter_mut().zip(middle).zip(before).zip(after).zip(other)
        {
            let size = magnitude(at);
            *flag = u8::from(size > magnitude(before))
                & u8::from(size >= magnitude(after))
                & u8::from(size >= magnitude(other));
        }
        *word &= pack(&flags);
    }
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
        if let Some(word) = mask.get_mut(k) {
            let window = right << 32 | u64::from(*word);
            *word = (1..run).fold(window, |eroded, shift| eroded & window >> shift) as u32;
        }
    }
    for k in (0..mask.len()).rev() {
        let left = k.checked_sub(1).and_then(|k| mask.get(k).copied()).unwrap_or(0);
        if let Some(word) = mask.get_mut(k) {
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
    fn maxima_along_a_row_stay_and_borders_go() {
        let row: Vec<u16> = [9_i16, 1, 5, -7, 2, 8, 8, 3, 9].map(|g| g as u16).into();
        let other = [0, 0, 0, 0, 0, 9, 0, 0, 0];
        let mut mask = [u32::MAX];
        keep_maxima((&row, -1), &row, (&row, 1), &other, &mut mask);
        assert_eq!(picture_from(&mask, 9), "...#.....");
        keep_maxima((&row, -1), &row, (&row, 1), &[0; 9], &mut mask);
        assert_eq!(picture_from(&mask, 9), "...#.....");
        let mut mask = [u32::MAX];
        keep_maxima((&row, -1), &row, (&row, 1), &[0; 9], &mut mask);
        assert_eq!(picture_from(&mask, 9), "...#.#...", "the first of two equals");
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
            gradient in prop::collection::vec(-16_320_i16..=16_320, 0..100), threshold in 1_u16..16_000,
        ) {
            let words: Vec<u16> = gradient.iter().map(|g| *g as u16).collect();
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

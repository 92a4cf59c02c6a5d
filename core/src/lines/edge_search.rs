#![allow(clippy::indexing_slicing, reason = "kernel: a bit's number is masked to its window")]
use super::edge::{EdgeList, EdgePoint, Profile, Slope, maximum};
use crate::image::{GRADIENT_ZERO, MARGIN, close_row, open_row, threshold_row};

/// What an edge can be, by the direction of its gradient.
pub(super) const VERTICAL: u8 = 1;
pub(super) const FLOOR: u8 = 2;

/// Three rows of (G_u, G_v), as they are stored; value 0 belongs to column [`MARGIN`].
type Rows<'a> = [(&'a [u16], &'a [u16]); 3];

/// The search for the edge points of a row, the maxima of the gradient across edges.
///
/// Steep edges (|G_u| ≥ |G_v|) have their maxima along the row, the others along the column. What is below the threshold or
/// not opened by a run along the edge's dominant axis is no edge; along the columns others have opened the rows before.
pub(super) struct EdgeSearch<'a> {
    /// [`VERTICAL`], [`FLOOR`] or nothing for every direction.
    pub(super) kinds: &'a [u8; 256],
    /// As stored, without the offset.
    pub(super) threshold: u16,
    /// Pixels in a row of the opening.
    pub(super) run: usize,
    /// First row of the region of interest of the floor's edges.
    pub(super) floor_top: usize,
}

impl EdgeSearch<'_> {
    /// Adds the edge points of row `centre`: `steep` are the pixels of steep edges, `rows` the gradients around it.
    pub(super) fn row(
        &self,
        centre: usize,
        steep: &[u32],
        rows: Rows<'_>,
        flat: &mut [u32],
        points: &mut [EdgePoint],
        edges: &mut EdgeList,
    ) {
        let in_region = centre >= self.floor_top;
        let wanted = if in_region { VERTICAL | FLOOR } else { VERTICAL };
        let mut take = |edges: &mut EdgeList, index: usize, steep: bool, profile: Profile| {
            let [_, (u, v), _] = profile;
            // Closing adds weak pixels.
            if (if steep { u } else { v }).unsigned_abs() < u32::from(self.threshold) {
                return;
            }
            let slope = Slope::new(u as f32, v as f32);
            let of_kind =
                self.kinds.get(usize::from(slope.direction)).is_some_and(|kinds| kinds & wanted != 0);
            if of_kind && let Some(maximum) = maximum(profile) {
                edges.push(points, (index + MARGIN, centre), steep, &slope, maximum);
            }
        };
        let [_, at, _] = rows;
        let [first, second] = &mut [[0; 34]; 2];
        let steep = if edges.keeps_row(centre) { steep } else { &[] };
        for (word, bits) in steep.iter().enumerate().filter(|(_, bits)| **bits != 0) {
            let along = window(at.0, 32 * word, 1, first);
            let across = window(at.1, 32 * word, 1, second);
            for bit in ones(steep_maxima(along, *bits)) {
                if let Some(profile) = steep_profile(along, across, bit) {
                    take(edges, 32 * word + bit, true, profile);
                }
            }
        }
        if !in_region {
            return;
        }
        threshold_row(at.1, self.threshold, flat);
        close_row(flat);
        open_row(flat, self.run);
        let [[a, b, c], [d, e, f]] = &mut [[[0; 32]; 3]; 2];
        for (word, bits) in flat.iter().enumerate() {
            let bits = bits & edges.kept_columns(32 * word + MARGIN);
            if bits == 0 {
                continue; // as most are
            }
            let [above, at, below] = rows;
            let along = [(above.1, &mut *a), (at.1, &mut *b), (below.1, &mut *c)]
                .map(|(row, spare)| window(row, 32 * word, 0, spare));
            let across = [(above.0, &mut *d), (at.0, &mut *e), (below.0, &mut *f)]
                .map(|(row, spare)| window(row, 32 * word, 0, spare));
            for bit in ones(flat_maxima(&along, bits)) {
                if let Some(profile) = flat_profile(&along, &across, bit) {
                    take(edges, 32 * word + bit, false, profile);
                }
            }
        }
    }
}

/// The places of the bits that are set.
pub(crate) fn ones(bits: u32) -> impl Iterator<Item = usize> {
    let mut left = bits;
    core::iter::from_fn(move || {
        let bit = left.trailing_zeros();
        left &= left.wrapping_sub(1);
        (bit < 32).then_some(bit as usize)
    })
}

/// Values of a row from `start` − `before` on; in `spare`, with more than any gradient beyond the row's ends, where those are in
/// the way.
pub(crate) fn window<'a, const N: usize>(
    row: &'a [u16],
    start: usize,
    before: usize,
    spare: &'a mut [u16; N],
) -> &'a [u16; N] {
    let first = start.checked_sub(before);
    if let Some(window) = first.and_then(|first| row.get(first..)?.first_chunk()) {
        return window;
    }
    for (place, value) in spare.iter_mut().enumerate() {
        let column = (start + place).checked_sub(before);
        *value = column.and_then(|column| row.get(column).copied()).unwrap_or(u16::MAX);
    }
    spare
}

fn signed(gradient: u16) -> i32 {
    i32::from(gradient) - i32::from(GRADIENT_ZERO)
}

/// |G|, from a gradient as it is stored.
fn size(gradient: u16) -> u32 {
    signed(gradient).unsigned_abs()
}

/// Those of the bits at which a size is a maximum among three, the first of equals. Whether it is cannot be foreseen: no branch.
#[inline(always)]
fn maxima(bits: u32, sizes: impl Fn(usize) -> [u32; 3]) -> u32 {
    let mut found = 0;
    for bit in ones(bits) {
        let [before, at, after] = sizes(bit);
        found |= u32::from((at > before) & (at >= after)) << bit;
    }
    found
}

/// The bits at which |G_u| has a maximum along the row; value 0 of the window comes before bit 0.
pub(crate) fn steep_maxima(u: &[u16; 34], bits: u32) -> u32 {
    maxima(bits, |bit| [0, 1, 2].map(|k| size(u[(bit & 31) + k])))
}

/// The bits at which |G_v| has a maximum along the column.
pub(crate) fn flat_maxima(v: &[&[u16; 32]; 3], bits: u32) -> u32 {
    maxima(bits, |bit| v.map(|row| size(row[bit & 31])))
}

/// The gradients at a bit and its neighbours in the row, if |G_u| is not below |G_v| there.
#[inline]
pub(crate) fn steep_profile(u: &[u16; 34], v: &[u16; 34], bit: usize) -> Option<Profile> {
    let at = |k: usize| (signed(u[(bit & 31) + k]), signed(v[(bit & 31) + k]));
    let (along, across) = at(1);
    (along.abs() >= across.abs()).then(|| [at(0), at(1), at(2)])
}

/// The gradients at a bit in three rows, if |G_v| is above |G_u| there: the diagonal belongs to the steep edges.
#[inline]
pub(crate) fn flat_profile(v: &[&[u16; 32]; 3], u: &[&[u16; 32]; 3], bit: usize) -> Option<Profile> {
    let at = |row: usize| (signed(u[row][bit & 31]), signed(v[row][bit & 31]));
    let (across, along) = at(1);
    (along.abs() > across.abs()).then(|| [at(0), at(1), at(2)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{vec, vec::Vec};

    fn stored(row: &[i16]) -> Vec<u16> {
        row.iter().map(|g| GRADIENT_ZERO.wrapping_add_signed(*g)).collect()
    }

    #[test]
    fn ones_are_found_also_at_both_ends() {
        let found = |bits| ones(bits).collect::<Vec<_>>();
        assert_eq!(found(0), []);
        assert_eq!(found(u32::MAX), (0..32).collect::<Vec<_>>());
        assert_eq!(found(0b1000_0000_0000_0000_0000_0000_0110_1101), [0, 2, 3, 5, 6, 31]);
    }

    #[test]
    fn steep_maxima_have_two_smaller_neighbours_and_the_first_of_equals_counts() {
        let row = stored(&[9, 1, 5, -7, 2, 8, 8, 3, 9]);
        let [first, second] = &mut [[0; 34]; 2];
        let along = window(&row, 0, 1, first);
        for (other, expected) in [(0, vec![3, 5]), (8, vec![5]), (9, vec![])] {
            let row = stored(&[other; 9]);
            let across = window(&row, 0, 1, second);
            let found =
                ones(steep_maxima(along, 0x1ff)).filter(|bit| steep_profile(along, across, *bit).is_some());
            assert_eq!(found.collect::<Vec<_>>(), expected);
        }
    }

    #[test]
    fn flat_maxima_are_larger_than_above_not_smaller_than_below_and_off_the_diagonal() {
        let along = [[5, 9, 9, 0, 8, 8], [9, 9, -9, 9, 9, 7], [9, 0, 0, -10, 0, 0]];
        let across = [[0, 0, 0, 0, 9, 6]; 3];
        let padded = |rows: [[i16; 6]; 3]| {
            rows.map(|row| {
                let mut spare = [0; 32];
                *window(&stored(&row), 0, 0, &mut spare)
            })
        };
        let (along, across) = (padded(along), padded(across));
        let (along, across) = (along.each_ref(), across.each_ref());
        let found =
            ones(flat_maxima(&along, 0x3f)).filter(|bit| flat_profile(&along, &across, *bit).is_some());
        assert_eq!(found.collect::<Vec<_>>(), [0]);
        assert_eq!(flat_profile(&along, &across, 0), Some([(0, 5), (0, 9), (0, 9)]));
    }

    #[test]
    fn windows_reach_beyond_both_ends_of_a_row() {
        let row: Vec<u16> = (0..40).collect();
        let spare = &mut [0; 34];
        let first = *window(&row, 0, 1, spare);
        assert_eq!((first[0], first[1], first[33]), (u16::MAX, 0, 32));
        assert_eq!(window(&row, 3, 1, spare)[..], row[2..36]);
        let second = *window(&row, 32, 1, spare);
        assert_eq!((second[0], second[8], second[9]), (31, 39, u16::MAX));
        assert_eq!(*window(&row, 64, 0, spare), [u16::MAX; 34]);
    }
}

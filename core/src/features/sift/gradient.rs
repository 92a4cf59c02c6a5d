//! Gradients of short runs of a row, in polar form: only round keypoints, never of whole planes.
#![allow(
    clippy::indexing_slicing,
    reason = "rows are cut to one length before the loop, which then vectorises"
)]

use super::polar::{exp_of_minus, turn_and_magnitude};
use super::scale_space::Planes;
use crate::vectors::widest;

/// Columns in the widest window: a descriptor of the largest scale, 1.6 · 2^(3.5/3) · 3 · 2.5 · √2 to each side.
pub(super) const MAX_RUN: usize = 84;

/// Direction in turns and length in the planes' units, of as many samples as were asked for last.
pub(super) struct Gradients {
    pub(super) turns: [f32; MAX_RUN],
    pub(super) lengths: [f32; MAX_RUN],
}

impl Gradients {
    pub(super) fn new() -> Self {
        Self { turns: [0.0; MAX_RUN], lengths: [0.0; MAX_RUN] }
    }

    /// Takes the gradients at columns `first .. first + count` of row `y`, which must not touch the rim.
    pub(super) fn take(&mut self, planes: &Planes, level: usize, y: usize, first: usize, count: usize) {
        let above = &planes.row(level, y - 1)[first..][..count];
        let below = &planes.row(level, y + 1)[first..][..count];
        let left = &planes.row(level, y)[first - 1..][..count];
        let right = &planes.row(level, y)[first + 1..][..count];
        let polar = [&mut self.turns[..count], &mut self.lengths[..count]];
        widest!(([left, right, above, below], polar), differences);
    }
}

/// Directions and lengths of (right − left, below − above).
#[inline(always)]
fn differences((rows, [turns, lengths]): ([&[i16]; 4], [&mut [f32]; 2])) {
    let count = turns.len();
    let ([left, right, above, below], lengths) = (rows.map(|row| &row[..count]), &mut lengths[..count]);
    for x in 0..count {
        let across = f32::from(right[x].wrapping_sub(left[x]));
        let down = f32::from(below[x].wrapping_sub(above[x]));
        (turns[x], lengths[x]) = turn_and_magnitude(across, down);
    }
}

/// A window of samples round a keypoint, `radius` to each side but inside the rim of the plane.
#[derive(Clone, Copy)]
pub(super) struct Window {
    pub(super) first: usize,
    pub(super) last: usize,
    centre: f32,
}

impl Window {
    /// Along an axis of `length` samples; `None` where nothing is inside.
    pub(super) fn new(centre: f32, radius: f32, length: usize) -> Option<Self> {
        let first = libm::ceilf(centre - radius).max(1.0) as usize;
        let last = (libm::floorf(centre + radius).max(0.0) as usize).min(length.saturating_sub(2));
        (first <= last && last - first < MAX_RUN).then_some(Self { first, last, centre })
    }

    /// exp(−d²/2σ²) for each of the window's samples.
    pub(super) fn weights(&self, sigma: f32) -> [f32; MAX_RUN] {
        let scale = 0.5 / (sigma * sigma);
        let start = self.first as f32 - self.centre;
        core::array::from_fn(|n| {
            let distance = start + n as f32;
            exp_of_minus((distance * distance * scale).min(4.8))
        })
    }
}

//! 128 numbers that describe a keypoint's surroundings, turned and scaled with it.
//!
//! A square of 4 × 4 cells, each 3σ wide, lies along the keypoint's direction. Every gradient in it is shared
//! between the cells and the 8 directions beside it (trilinearly), with its length times a Gaussian of two
//! cells. The 128 sums h are normalised, cut at 0.2 and normalised again (against glare), and written as bytes:
//!
//! ```text
//! plain      d = 512 · h/‖h‖₂            RootSIFT      d = 512 · √(h/‖h‖₁)
//! ```
//!
//! The Euclidean distance of root descriptors is the Hellinger distance of the histograms, which matches better.
//! Order: row of cells (down), column (right), direction (from the keypoint's, towards +y).
//!
//! Sources: Lowe 2004, section 6; R. Arandjelović and A. Zisserman, "Three things everyone should know to
//! improve object retrieval", CVPR 2012, section 3.
#![allow(clippy::indexing_slicing, reason = "cells are within the histogram by the window's construction")]
#![allow(clippy::needless_range_loop, reason = "one index runs through many arrays")]

use super::SiftDescriptor;
use super::gradient::{Gradients, MAX_RUN, Window};
use super::polar::floor_small;
use super::scale_space::Planes;
use crate::vectors::widest;

/// Cells a side.
const CELLS: usize = 4;
/// Directions a cell.
const DIRECTIONS: usize = 8;
/// Width of a cell in standard deviations of the keypoint.
const CELL_SIGMAS: f32 = 3.0;
/// Half the square in cells, with the half cell that reaches over its edge; less, so that rounding stays inside.
const REACH: f32 = 2.499;
/// Histogram strides: an extra cell on every side and two extra directions take what falls outside.
const CELL_STRIDE: usize = DIRECTIONS + 2;
const ROW_STRIDE: usize = CELL_STRIDE * (CELLS + 2);
const LENGTH: usize = ROW_STRIDE * (CELLS + 2);
/// Part of the norm that one number may have.
const CUT: f32 = 0.2;

/// The descriptor at (x, y) of G_`level` with the direction `turn` (in turns).
pub(super) fn describe(
    planes: &Planes,
    level: usize,
    [x, y]: [f32; 2],
    sigma: f32,
    turn: f32,
    root: bool,
) -> SiftDescriptor {
    let histogram = histogram(planes, level, [x, y], sigma * CELL_SIGMAS, turn);
    quantised(&closed(&histogram), root)
}

/// Samples of one row within the square: where they fall, and how much.
struct Run {
    cells: [u32; MAX_RUN],
    row_parts: [f32; MAX_RUN],
    column_parts: [f32; MAX_RUN],
    direction_parts: [f32; MAX_RUN],
    amounts: [f32; MAX_RUN],
}

fn histogram(planes: &Planes, level: usize, [x, y]: [f32; 2], cell: f32, turn: f32) -> [f32; LENGTH] {
    let mut bins = [0.0; LENGTH];
    let (sine, cosine) = libm::sincosf(turn * core::f32::consts::TAU);
    let radius = REACH * cell * (sine.abs() + cosine.abs());
    let windows = (Window::new(x, radius, planes.width), Window::new(y, radius, planes.height));
    let (Some(columns), Some(rows)) = windows else { return bins };
    let deviation = cell * (CELLS as f32 / 2.0);
    let (across, down) = (columns.weights(deviation), rows.weights(deviation));
    let (c, s) = (cosine / cell, sine / cell);
    let mut gradients = Gradients::new();
    let mut run = Run {
        cells: [0; MAX_RUN],
        row_parts: [0.0; MAX_RUN],
        column_parts: [0.0; MAX_RUN],
        direction_parts: [0.0; MAX_RUN],
        amounts: [0.0; MAX_RUN],
    };
    for (row, row_weight) in (rows.first..=rows.last).zip(down) {
        // |c·dx + s·dy| < reach and |c·dy − s·dx| < reach, solved for dx.
        let dy = row as f32 - y;
        let (from, to) = inside(c, s * dy);
        let (from2, to2) = inside(-s, c * dy);
        let first = libm::ceilf(x + from.max(from2)).max(columns.first as f32) as usize;
        let last = libm::floorf(x + to.min(to2)).min(columns.last as f32) as usize;
        if last < first {
            continue;
        }
        let count = last - first + 1;
        gradients.take(planes, level, row, first, count);
        let start = first as f32 - x;
        let weights = &across[first - columns.first..][..count];
        let turned = Turned { along: [c, s], start: [start, dy], turn };
        widest!((&turned, &gradients, (weights, row_weight), &mut run), Turned::place);
        spread(&run, count, &mut bins);
    }
    bins
}

/// A row of the picture in the square's frame.
struct Turned {
    /// Cosine and sine of its direction, by cells a pixel.
    along: [f32; 2],
    /// Its first sample from the keypoint, px.
    start: [f32; 2],
    /// The keypoint's direction, turns.
    turn: f32,
}

impl Turned {
    /// Where its samples fall, as many as there are weights.
    #[inline(always)]
    fn place((row, gradients, (weights, row_weight), run): (&Self, &Gradients, (&[f32], f32), &mut Run)) {
        let Self { along: [c, s], start: [start, dy], turn } = *row;
        for (n, weight) in weights.iter().enumerate().take(MAX_RUN) {
            let dx = start + n as f32;
            let column = c * dx + s * dy + 2.5;
            let row = c * dy - s * dx + 2.5;
            let direction = gradients.turns[n] - turn;
            let direction = if direction < 0.0 { direction + 1.0 } else { direction } * DIRECTIONS as f32;
            let (row_cell, row_part) = floor_small(row);
            let (column_cell, column_part) = floor_small(column);
            let (direction_bin, direction_part) = floor_small(direction);
            run.cells[n] = row_cell * ROW_STRIDE as u32 + column_cell * CELL_STRIDE as u32 + direction_bin;
            run.row_parts[n] = row_part;
            run.column_parts[n] = column_part;
            run.direction_parts[n] = direction_part;
            run.amounts[n] = gradients.lengths[n] * (weight * row_weight);
        }
    }
}

/// The interval of dx in which |slope · dx + offset| is below the reach.
fn inside(slope: f32, offset: f32) -> (f32, f32) {
    const EVERYWHERE: f32 = 1e4;
    if slope.abs() < 1e-6 {
        return if offset.abs() < REACH { (-EVERYWHERE, EVERYWHERE) } else { (EVERYWHERE, -EVERYWHERE) };
    }
    let (a, b) = ((-REACH - offset) / slope, (REACH - offset) / slope);
    if a < b { (a, b) } else { (b, a) }
}

/// Adds the run's samples to the eight bins beside each.
fn spread(run: &Run, count: usize, bins: &mut [f32; LENGTH]) {
    const SPAN: usize = ROW_STRIDE + CELL_STRIDE + 2;
    for n in 0..count {
        let place = run.cells[n] as usize;
        let Some(near) = bins.get_mut(place..place + SPAN) else { continue };
        let amount = run.amounts[n];
        let lower = amount * run.row_parts[n];
        let upper = amount - lower;
        let rows = [upper, lower];
        for (row, amount) in rows.into_iter().enumerate() {
            let right = amount * run.column_parts[n];
            for (column, amount) in [amount - right, right].into_iter().enumerate() {
                let later = amount * run.direction_parts[n];
                let cell = row * ROW_STRIDE + column * CELL_STRIDE;
                near[cell] += amount - later;
                near[cell + 1] += later;
            }
        }
    }
}

/// The 128 inner bins, with the directions closed to a ring.
fn closed(bins: &[f32; LENGTH]) -> [f32; 128] {
    let mut closed = [0.0; 128];
    for (index, cell) in closed.chunks_exact_mut(DIRECTIONS).enumerate() {
        let place = (index / CELLS + 1) * ROW_STRIDE + (index % CELLS + 1) * CELL_STRIDE;
        let open = &bins[place..place + CELL_STRIDE];
        cell.copy_from_slice(&open[..DIRECTIONS]);
        cell[0] += open[DIRECTIONS];
        cell[1] += open[DIRECTIONS + 1];
    }
    closed
}

fn quantised(bins: &[f32; 128], root: bool) -> SiftDescriptor {
    let norm = |values: &[f32; 128]| libm::sqrtf(values.iter().fold(0.0, |sum, v| sum + v * v));
    let limit = CUT * norm(bins);
    let cut = bins.map(|bin| if bin > limit { limit } else { bin });
    let total = if root { cut.iter().fold(0.0, |sum, v| sum + v) } else { norm(&cut) };
    if total <= 0.0 {
        return [0; 128];
    }
    cut.map(|bin| {
        let part = bin / total;
        let part = if root { libm::sqrtf(part) } else { part };
        (512.0 * part + 0.5) as u8
    })
}

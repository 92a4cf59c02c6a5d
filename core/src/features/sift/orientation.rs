//! The directions of a keypoint: peaks of the histogram of gradient directions round it.
//!
//! 36 bins; each gradient within 4.5σ adds its length, weighted by a Gaussian of 1.5σ, to the two bins beside
//! its direction. The histogram is smoothed twice by [1 2 1]/4, and every peak of at least 0.8 of the highest
//! gives a keypoint of its own, placed by a parabola through the peak and its neighbours.
//!
//! Source: Lowe 2004, section 5.
#![allow(
    clippy::indexing_slicing,
    reason = "bins are taken modulo their number, or below it by construction"
)]

use super::gradient::{Gradients, Window};
use super::polar::floor_small;
use super::scale_space::Planes;

const BINS: usize = 36;
/// Peaks are at least this part of the highest.
const PEAK_RATIO: f32 = 0.8;
/// Directions a keypoint can have.
pub(super) const MAX_DIRECTIONS: usize = 4;

/// The directions at (x, y) of G_`level`, in turns, strongest bins in rising order of direction.
pub(super) fn directions(
    planes: &Planes,
    level: usize,
    [x, y]: [f32; 2],
    sigma: f32,
) -> heapless::Vec<f32, MAX_DIRECTIONS> {
    let mut peaks = heapless::Vec::new();
    let windows = (Window::new(x, 4.5 * sigma, planes.width), Window::new(y, 4.5 * sigma, planes.height));
    let (Some(columns), Some(rows)) = windows else { return peaks };
    let histogram = smoothed(&histogram(planes, level, &columns, &rows, 1.5 * sigma));

    let highest = histogram.iter().fold(0.0_f32, |most, &bin| if bin > most { bin } else { most });
    for bin in 0..BINS {
        let (before, here) = (histogram[(bin + BINS - 1) % BINS], histogram[bin]);
        let after = histogram[(bin + 1) % BINS];
        if here > before && here > after && here >= PEAK_RATIO * highest {
            let offset = 0.5 * (before - after) / (before - 2.0 * here + after);
            let turn = (bin as f32 + offset) / BINS as f32;
            // More peaks than room would take five of at least 0.8: the first four do.
            let _ = peaks.push(if turn < 0.0 { turn + 1.0 } else { turn });
        }
    }
    peaks
}

fn histogram(planes: &Planes, level: usize, columns: &Window, rows: &Window, sigma: f32) -> [f32; BINS + 2] {
    let (across, down) = (columns.weights(sigma), rows.weights(sigma));
    let count = columns.last - columns.first + 1;
    let mut gradients = Gradients::new();
    let mut bins = [0.0; BINS + 2];
    for (y, row_weight) in (rows.first..=rows.last).zip(down) {
        gradients.take(planes, level, y, columns.first, count);
        for ((&turn, &length), &weight) in
            gradients.turns[..count].iter().zip(&gradients.lengths).zip(&across)
        {
            let (bin, part) = floor_small(turn * BINS as f32);
            let (bin, amount) = ((bin as usize).min(BINS), length * weight * row_weight);
            bins[bin + 1] += amount * part;
            bins[bin] += amount - amount * part;
        }
    }
    bins
}

fn smoothed(open: &[f32; BINS + 2]) -> [f32; BINS] {
    let mut ring = [0.0; BINS];
    ring.copy_from_slice(&open[..BINS]);
    ring[0] += open[BINS];
    ring[1] += open[BINS + 1];
    for _ in 0..2 {
        let before = ring;
        for (bin, value) in ring.iter_mut().enumerate() {
            let (left, right) = (before[(bin + BINS - 1) % BINS], before[(bin + 1) % BINS]);
            *value = 0.25 * (left + right) + 0.5 * before[bin];
        }
    }
    ring
}

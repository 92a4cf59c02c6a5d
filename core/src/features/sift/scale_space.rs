//! The Gaussian pyramid.
//!
//! Octave i holds six planes G₀ … G₅ with σₖ = 1.6 · 2^(k/3) in its own samples; its size halves from one
//! octave to the next, and sample x of octave i is pixel x · 2^(i − doubled). Differences D = Gₖ₊₁ − Gₖ are
//! formed where they are used.
//!
//! A plane smoothed by σ ≥ 2.5 has nothing above half of the sampling rate (the rest is exp(−σ²π²/8) < 4·10⁻⁴),
//! so every second sample says it all. That saves most of the work:
//!
//! ```text
//! next G₀ = G₃↓   next G₁ = G₄↓   next G₂ = G₅↓            (no arithmetic: 2.5 % of the samples at most)
//! G₃ = blur(G₂↓ ↑)    G₄ = blur(next G₀ ↑)    G₅ = blur(next G₁ ↑)        (half the taps, see `blur`)
//! ```
//!
//! and in a doubled first octave G₀ … G₃ come straight from the picture in the same way.
//!
//! | symbol | in code | unit |
//! |---|---|---|
//! | σ₀ = 1.6 | [`SIGMA`] | samples of the octave |
//! | S = 3 | [`INTERVALS`] | scales an octave |
//! | 0.6 | [`PRESMOOTHING`] | px |
//!
//! Source: Lowe 2004, section 3.
#![allow(clippy::indexing_slicing, reason = "offsets come from one layout, checked against the memory once")]

use super::blur::{Gaussian, Source, scratch_len, smooth};
use crate::image::Grey;

/// Scales an octave: Lowe's best.
pub(super) const INTERVALS: usize = 3;
/// Planes an octave.
pub(super) const PLANES: usize = INTERVALS + 3;
/// Standard deviation of G₀ in samples of its octave.
const SIGMA: f32 = 1.6;
/// Smoothing of every plane beyond its σ, in pixels: fine detail is where noise and resampling make keypoints
/// that are not found again. The camera's own blur is not deducted either.
const PRESMOOTHING: f32 = 0.6;
/// Below this many samples a side, an octave has no inside to find keypoints in.
const MIN_SIDE: usize = 16;
/// More octaves than a picture of 2¹⁶ pixels a side has.
pub(super) const MAX_OCTAVES: usize = 14;

/// Where an octave lies in the pyramid's memory.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Octave {
    pub(super) width: usize,
    pub(super) height: usize,
    start: usize,
}

impl Octave {
    fn plane_len(&self) -> usize {
        self.width * self.height
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        Self { width, height, start: self.start + PLANES * self.plane_len() }
    }
}

/// Sizes and places of all octaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    octaves: [Octave; MAX_OCTAVES],
    count: usize,
    doubled: bool,
}

impl Layout {
    pub(super) fn new(width: usize, height: usize, doubled: bool) -> Self {
        let factor = if doubled { 2 } else { 1 };
        let mut octave = Octave { width: width * factor, height: height * factor, start: 0 };
        let mut layout = Self { octaves: Default::default(), count: 0, doubled };
        while layout.count < MAX_OCTAVES && octave.width.min(octave.height) >= MIN_SIDE {
            layout.octaves[layout.count] = octave;
            layout.count += 1;
            octave = octave.halved();
        }
        layout
    }

    pub(super) fn octaves(&self) -> &[Octave] {
        &self.octaves[..self.count]
    }

    /// Samples of the planes of all octaves and, as scratch for the last, two more half its size.
    pub(super) fn planes_len(&self) -> usize {
        self.octaves().last().map_or(0, |last| last.halved().start + 2 * last.halved().plane_len())
    }

    /// Samples that building the pyramid needs beside the planes.
    pub(super) fn scratch_len(&self) -> usize {
        self.octaves().first().map_or(0, |first| scratch_len(first.width))
    }

    /// The factor from samples of octave `index` to pixels.
    pub(super) fn pixels_per_sample(&self, index: usize) -> f32 {
        let samples = (1_u32 << index) as f32;
        if self.doubled { samples * 0.5 } else { samples }
    }
}

/// The planes of one octave.
#[derive(Clone, Copy)]
pub(super) struct Planes<'a> {
    samples: &'a [i16],
    pub(super) width: usize,
    pub(super) height: usize,
}

impl<'a> Planes<'a> {
    pub(super) fn of(octave: &Octave, pyramid: &'a [i16]) -> Self {
        let samples = &pyramid[octave.start..][..PLANES * octave.plane_len()];
        Self { samples, width: octave.width, height: octave.height }
    }

    /// Row `y` of G_`level`.
    pub(super) fn row(&self, level: usize, y: usize) -> &'a [i16] {
        &self.samples[(level * self.height + y) * self.width..][..self.width]
    }
}

/// The standard deviation of G_`level`.
fn sigma(level: usize) -> f32 {
    SIGMA * libm::exp2f(level as f32 / INTERVALS as f32)
}

/// The blur of a keypoint found at `level` of an octave, in samples of that octave.
pub(super) fn sigma_at(level: f32, pixels_per_sample: f32) -> f32 {
    joined(SIGMA * libm::exp2f(level / INTERVALS as f32), PRESMOOTHING / pixels_per_sample)
}

/// What takes a blur of `from` to one of `to`.
fn step(from: f32, to: f32) -> f32 {
    libm::sqrtf(to * to - from * from)
}

/// One blur after another.
fn joined(first: f32, second: f32) -> f32 {
    libm::sqrtf(first * first + second * second)
}

/// Fills `pyramid` ([`Layout::planes_len`] samples) from the picture.
pub(super) fn build(picture: Grey, layout: &Layout, pyramid: &mut [i16], scratch: &mut [i16]) {
    for (index, octave) in layout.octaves().iter().enumerate() {
        let (width, plane) = (octave.width, octave.plane_len());
        let half = octave.halved();
        let (planes, after) = pyramid[octave.start..].split_at_mut(PLANES * plane);
        let (next0, after) = after.split_at_mut(half.plane_len());
        let next1 = &mut after[..half.plane_len()];

        if index > 0 {
            // G₀ … G₂ were left here by the octave before.
        } else if layout.doubled {
            for level in 0..=INTERVALS {
                let kernel = Gaussian::doubled(joined(sigma(level), 2.0 * PRESMOOTHING));
                smooth(
                    Source::Picture(picture),
                    &kernel,
                    &mut planes[level * plane..][..plane],
                    width,
                    scratch,
                );
            }
        } else {
            let kernel = Gaussian::same_size(joined(SIGMA, PRESMOOTHING));
            smooth(Source::Picture(picture), &kernel, &mut planes[..plane], width, scratch);
            for level in 1..INTERVALS {
                let kernel = Gaussian::same_size(step(sigma(level - 1), sigma(level)));
                let (below, here) = planes.split_at_mut(level * plane);
                let source = Source::Plane { samples: &below[(level - 1) * plane..], width };
                smooth(source, &kernel, &mut here[..plane], width, scratch);
            }
        }
        let mut finish = |level: usize, half_plane: &[i16], planes: &mut [i16]| {
            let kernel = Gaussian::doubled(step(sigma(level - 1), sigma(level)));
            let source = Source::Plane { samples: half_plane, width: half.width };
            smooth(source, &kernel, &mut planes[level * plane..][..plane], width, scratch);
        };
        if index > 0 || !layout.doubled {
            halve(&planes[(INTERVALS - 1) * plane..], width, next0);
            finish(INTERVALS, next0, planes);
        }
        halve(&planes[INTERVALS * plane..][..plane], width, next0);
        finish(INTERVALS + 1, next0, planes);
        halve(&planes[(INTERVALS + 1) * plane..][..plane], width, next1);
        finish(INTERVALS + 2, next1, planes);
        if index + 1 < layout.count {
            let next2 = &mut after[half.plane_len()..][..half.plane_len()];
            halve(&planes[(INTERVALS + 2) * plane..][..plane], width, next2);
        }
    }
}

/// Every second sample of every second row.
fn halve(plane: &[i16], width: usize, out: &mut [i16]) {
    let rows = plane.chunks_exact(width).step_by(2);
    for (out_row, row) in out.chunks_exact_mut(width.div_ceil(2)).zip(rows) {
        for (out, pair) in out_row.iter_mut().zip(row.chunks(2)) {
            *out = pair[0];
        }
    }
}

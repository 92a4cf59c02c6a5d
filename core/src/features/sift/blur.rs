//! Separable Gaussian smoothing of 15-bit pictures, at the same size or onto a grid twice as fine.
//!
//! A row of Gaussian taps is symmetric, so two samples share one multiplication:
//!
//! ```text
//! same size         out(x)      = Σₙ k₂ₙ   · [in(x − n) + in(x + n)]          (with the tap at distance n)
//! doubled, even     out(2x)     = Σₙ k₂ₙ   · [in(x − n) + in(x + n)]
//! doubled, odd      out(2x + 1) = Σₙ k₂ₙ₊₁ · [in(x − n) + in(x + 1 + n)]      Σ k = ½ in each line
//! ```
//!
//! The centre is paired with itself, at half its weight. Doubling is the convolution of the picture with
//! zeros between its samples, so sample x stays at 2x exactly, it costs half the taps, and the horizontal pass
//! runs on half of the output's rows. The images of the spectrum that the zeros create are attenuated by
//! exp(−σ²π²/2): 5·10⁻⁴ at σ = 1.25, the smallest used here.
//!
//! Samples have 7 fractional bits (0 … 32,640), a pair's sum fits u16, weights are Q16, and a product keeps its
//! high half: one instruction for eight pixels on SSE2 and NEON, and integers give the same bits at any vector
//! width. Truncation leaves noise of 0.01 grey levels, far below a camera's.
//!
//! Source: D. G. Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 60(2), 2004, section 3.
#![allow(
    clippy::indexing_slicing,
    reason = "rows are cut to one length before the loops, which then vectorise"
)]

use crate::image::Grey;

/// Pairs of taps in one line of the equations above: enough for σ = 3.1 doubled, 1.9 at the same size.
const MAX_PAIRS: usize = 8;
/// Taps reach this many standard deviations, which leaves out 5·10⁻⁴ of the weight.
const REACH: f32 = 3.5;
/// Samples repeated past each end of a row.
const PAD: usize = MAX_PAIRS;
/// Filtered rows that the vertical pass keeps.
const RING: usize = 2 * MAX_PAIRS;

/// What is smoothed: a picture or a plane of 15-bit samples.
#[derive(Clone, Copy)]
pub(super) enum Source<'a> {
    Picture(Grey<'a>),
    Plane { samples: &'a [i16], width: usize },
}

impl Source<'_> {
    fn size(&self) -> (usize, usize) {
        match self {
            Self::Picture(picture) => (picture.width(), picture.height()),
            Self::Plane { samples, width } => (*width, samples.len() / width),
        }
    }

    fn copy_row(&self, y: usize, out: &mut [i16]) {
        match self {
            Self::Picture(picture) => {
                for (out, &pixel) in out.iter_mut().zip(picture.row(y)) {
                    *out = i16::from(pixel) << 7;
                }
            }
            Self::Plane { samples, width } => {
                out.copy_from_slice(&samples[y * width..][..*width]);
            }
        }
    }
}

/// The weights of one line of the equations.
#[derive(Clone, Copy, Default)]
struct Phase {
    pairs: usize,
    weights: [u16; MAX_PAIRS],
}

/// A sampled Gaussian.
pub(super) struct Gaussian {
    even: Phase,
    /// Only where the grid is doubled.
    odd: Option<Phase>,
}

impl Gaussian {
    /// A standard deviation of `sigma` output samples, at the same size.
    pub(super) fn same_size(sigma: f32) -> Self {
        Self { even: phase(sigma, 0, 1), odd: None }
    }

    /// A standard deviation of `sigma` output samples, onto a grid twice as fine.
    pub(super) fn doubled(sigma: f32) -> Self {
        Self { even: phase(sigma, 0, 2), odd: Some(phase(sigma, 1, 2)) }
    }
}

/// The taps at distances `first`, `first + step`, …
fn phase(sigma: f32, first: usize, step: usize) -> Phase {
    let reach = libm::ceilf(REACH * sigma) as usize;
    let mut exact = [0.0_f32; MAX_PAIRS];
    let mut phase = Phase::default();
    for (exact, distance) in exact.iter_mut().zip((first..=reach).step_by(step)) {
        let deviations = distance as f32 / sigma;
        let share = if distance == 0 { 0.5 } else { 1.0 };
        *exact = share * libm::expf(-0.5 * deviations * deviations);
        phase.pairs += 1;
    }
    let total: f32 = exact.iter().sum();
    // Rounded weights must sum to one half, or a constant picture would change.
    let mut rest = 1 << 15;
    for (weight, exact) in phase.weights.iter_mut().zip(exact) {
        *weight = libm::roundf(exact / total * 32768.0) as u16;
        rest -= i32::from(*weight);
    }
    phase.weights[0] = (i32::from(phase.weights[0]) + rest) as u16;
    phase
}

/// Samples of scratch that [`smooth`] needs for rows of `width` output samples.
pub(super) fn scratch_len(width: usize) -> usize {
    (RING + 3) * width + 2 * PAD
}

/// Writes the smoothed source to `out`, whose rows have `width` samples; what a doubled source has beyond
/// `out` is left out.
pub(super) fn smooth(source: Source, kernel: &Gaussian, out: &mut [i16], width: usize, scratch: &mut [i16]) {
    let (source_width, source_height) = source.size();
    let (padded, scratch) = scratch.split_at_mut(source_width + 2 * PAD);
    let (even, scratch) = scratch.split_at_mut(source_width);
    let (odd, scratch) = scratch.split_at_mut(source_width);
    let ring = &mut scratch[..RING * width];
    let phases = if kernel.odd.is_some() { 2 } else { 1 };

    let mut filtered = 0;
    let mut out_rows = out.chunks_exact_mut(width);
    for base in 0..source_height {
        while filtered < source_height.min(base + MAX_PAIRS + 1) {
            source.copy_row(filtered, &mut padded[PAD..PAD + source_width]);
            let (first, last) = (padded[PAD], padded[PAD + source_width - 1]);
            padded[..PAD].fill(first);
            padded[PAD + source_width..].fill(last);
            let row = &mut ring[filtered % RING * width..][..width];
            let pair = |shift: usize| {
                let padded = &*padded;
                move |n: usize| (&padded[PAD - n..], &padded[PAD + n + shift..])
            };
            match &kernel.odd {
                None => weigh_pairs(&kernel.even, pair(0), row),
                Some(odd_phase) => {
                    weigh_pairs(&kernel.even, pair(0), even);
                    weigh_pairs(odd_phase, pair(1), odd);
                    interleave(even, odd, row);
                }
            }
            filtered += 1;
        }
        for shift in 0..phases {
            let Some(out_row) = out_rows.next() else { return };
            let phase = kernel.odd.as_ref().filter(|_| shift == 1).unwrap_or(&kernel.even);
            let row = |y: usize| &ring[y.min(source_height - 1) % RING * width..][..width];
            weigh_pairs(phase, |n| (row(base.saturating_sub(n)), row(base + n + shift)), out_row);
        }
    }
}

fn interleave(even: &[i16], odd: &[i16], out: &mut [i16]) {
    let mut pairs = out.chunks_exact_mut(2);
    for ((pair, &even), &odd) in pairs.by_ref().zip(even).zip(odd) {
        pair[0] = even;
        pair[1] = odd;
    }
    if let ([last], Some(&even)) = (pairs.into_remainder(), even.last()) {
        *last = even;
    }
}

/// out = Σₙ weightₙ · (lowerₙ + upperₙ), where `pair(n)` gives the n-th two rows.
fn weigh_pairs<'a>(phase: &Phase, pair: impl Fn(usize) -> (&'a [i16], &'a [i16]), out: &mut [i16]) {
    // The number of pairs is a constant inside the loop over pixels, so that the sum stays in registers.
    match phase.pairs {
        1 => weigh::<1>(phase, pair, out),
        2 => weigh::<2>(phase, pair, out),
        3 => weigh::<3>(phase, pair, out),
        4 => weigh::<4>(phase, pair, out),
        5 => weigh::<5>(phase, pair, out),
        6 => weigh::<6>(phase, pair, out),
        7 => weigh::<7>(phase, pair, out),
        _ => weigh::<8>(phase, pair, out),
    }
}

#[inline(never)]
fn weigh<'a, const N: usize>(phase: &Phase, pair: impl Fn(usize) -> (&'a [i16], &'a [i16]), out: &mut [i16]) {
    let length = out.len();
    let lower: [&[i16]; N] = core::array::from_fn(|n| &pair(n).0[..length]);
    let upper: [&[i16]; N] = core::array::from_fn(|n| &pair(n).1[..length]);
    let weights: [u16; N] = core::array::from_fn(|n| phase.weights[n]);
    // Every product loses half a unit on average.
    let bias = (N / 2) as u16;
    for (x, out) in out.iter_mut().enumerate() {
        let mut sum = bias;
        for n in 0..N {
            let both = lower[n][x].wrapping_add(upper[n][x]).cast_unsigned();
            sum = sum.wrapping_add(((u32::from(both) * u32::from(weights[n])) >> 16) as u16);
        }
        *out = sum.cast_signed();
    }
}

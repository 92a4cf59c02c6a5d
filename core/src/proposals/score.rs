//! How likely a candidate is a corner of the floor.
//!
//! A network of two small layers looks at the features, at the grey near the foot and at that farther round it:
//!
//! ```text
//! x = clip((shape(feature) − mean) / spread)          p = clip((grey − mean of it) / (its deviation + noise))
//! a = relu(P p + b_p), relu(F x + b_f)                h = relu(H a + b_h)
//! logit = o·h + s·x + q·(plain features) + b          probability = 1 / (1 + exp(−logit))
//! ```
//!
//! The last part is a logistic score of a few features in plain scales, fitted alone: what it says carries over to other cameras and
//! places better than what a network learns, and the sum of both better than either.
//!
//! What is brighter on the left of its vertical edge is mirrored first: left and right cannot matter. So is what has no such edge
//! and falls more to the left. The weights and
//! what they were fitted to are in `score_weights.rs`, which `tests/scoring/train.py` writes, calibration included. Sums go
//! in the weights' order and nothing is fused, so that all platforms agree; 5,600 multiplications a candidate.
use super::features::{CONTEXT_SIDE, Features, PATCH_SIDE};
use super::score_weights as weights;
use weights::{FEATURE_UNITS, HIDDEN_UNITS, INPUTS, PATCH_UNITS, PIXELS};

/// Inputs end at so many standard deviations.
const LIMIT: f32 = 4.0;
/// Samples along a side of the nearer picture as the network sees it: means of 2 × 2.
const POOLED_SIDE: usize = PATCH_SIDE / 2;

/// How a feature's scale is made even.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// As it is.
    Plain,
    /// ln(1 + x) of what is never negative.
    Log,
    /// The same of the size, with the sign.
    Signed,
}

/// A feature as the network takes it.
pub(super) struct Input {
    /// Its place among [`Features::values`].
    pub(super) index: usize,
    pub(super) shape: Shape,
    pub(super) mean: f32,
    /// One over its deviation.
    pub(super) gain: f32,
}

/// A layer's weights, of whole numbers with a scale for each of its outputs.
pub(super) struct Layer<const I: usize, const O: usize> {
    pub(super) weights: [[i8; I]; O],
    pub(super) scale: [f32; O],
    pub(super) bias: [f32; O],
}

impl<const I: usize, const O: usize> Layer<I, O> {
    fn relu(&self, inputs: &[f32; I], out: &mut [f32]) {
        let rows = self.weights.iter().zip(&self.scale).zip(&self.bias);
        for (((weights, scale), bias), out) in rows.zip(out) {
            let mut sum = 0.0;
            for (weight, input) in weights.iter().zip(inputs) {
                sum += f32::from(*weight) * input;
            }
            let sum = sum * scale + bias;
            *out = if sum > 0.0 { sum } else { 0.0 };
        }
    }
}

/// The probability that a candidate is a corner of the floor.
pub(super) fn probability(
    features: &Features,
    patch: &[u8; PATCH_SIDE * PATCH_SIDE],
    context: &[u8; CONTEXT_SIDE * CONTEXT_SIDE],
) -> f32 {
    1.0 / (1.0 + libm::expf(-logit(features, patch, context)))
}

fn logit(
    features: &Features,
    patch: &[u8; PATCH_SIDE * PATCH_SIDE],
    context: &[u8; CONTEXT_SIDE * CONTEXT_SIDE],
) -> f32 {
    let polarity = features.vertical_brighter_right;
    let turned = polarity < 0.0 || (polarity == 0.0 && features.left_fall > features.right_fall);
    let seen = if turned { mirrored(features) } else { *features };
    let values = seen.values();
    let mut inputs = [0.0; INPUTS];
    for (input, out) in weights::SCALES.iter().zip(&mut inputs) {
        let value = values.get(input.index).copied().unwrap_or(0.0);
        *out = limited((shaped(value, input.shape) - input.mean) * input.gain);
    }

    let mut pixels = [0.0; PIXELS];
    let (near, far) = pixels.split_at_mut(POOLED_SIDE * POOLED_SIDE);
    pooled(patch, turned, near);
    for (row, out) in context.chunks_exact(CONTEXT_SIDE).zip(far.chunks_exact_mut(CONTEXT_SIDE)) {
        for (k, (grey, out)) in row.iter().zip(out.iter_mut()).enumerate() {
            let mirror = row.get(CONTEXT_SIDE - 1 - k).unwrap_or(grey);
            *out = f32::from(if turned { *mirror } else { *grey });
        }
    }
    relative(near, features.noise);
    relative(far, features.noise);

    let mut first = [0.0; PATCH_UNITS + FEATURE_UNITS];
    let (by_patch, by_features) = first.split_at_mut(PATCH_UNITS);
    weights::PATCH.relu(&pixels, by_patch);
    weights::FEATURE.relu(&inputs, by_features);
    let mut second = [0.0; HIDDEN_UNITS];
    weights::HIDDEN.relu(&first, &mut second);
    let mut logit = weights::BIAS;
    for (weight, value) in weights::OUT.iter().zip(&second) {
        logit += weight * value;
    }
    for (weight, value) in weights::STRAIGHT.iter().zip(&inputs) {
        logit += weight * value;
    }
    for (weight, value) in weights::PLAIN.iter().zip(&plain(features)) {
        logit += if value.is_nan() { 0.0 } else { weight * value };
    }
    logit
}

/// What the straight score sees, to be weighted and summed.
fn plain(f: &Features) -> [f32; 12] {
    let flag = |yes: bool| if yes { 1.0 } else { 0.0 };
    let length = libm::logf(f.vertical_length.max(5.0));
    [
        libm::logf(f.unlike_floor + 0.3),
        0.25 * length * length,
        libm::logf(f.contrast_above + 0.5),
        libm::logf(f.texture_below + 0.5),
        f.vertical_width.min(4.0),
        f.edge_below.min(4.0),
        f.vertical_below.min(1.0),
        f.below_end.clamp(0.0, 20.0) / 10.0,
        f.lines_below.min(3.0),
        flag(f.both == 0.0 || f.left_brighter_below == f.right_brighter_below),
        f.vertical_turn,
        flag(f.vertical_length == 0.0),
    ]
}

/// The features of the picture's mirror image.
fn mirrored(f: &Features) -> Features {
    Features {
        left_points: f.right_points,
        left_length: f.right_length,
        left_begin: f.right_begin,
        left_gradient: f.right_gradient,
        left_width: f.right_width,
        left_residual: f.right_residual,
        left_fall: f.right_fall,
        left_brighter_below: f.right_brighter_below,
        left_sight: -f.right_sight,
        right_points: f.left_points,
        right_length: f.left_length,
        right_begin: f.left_begin,
        right_gradient: f.left_gradient,
        right_width: f.left_width,
        right_residual: f.left_residual,
        right_fall: f.left_fall,
        right_brighter_below: f.left_brighter_below,
        right_sight: -f.left_sight,
        above_left: f.above_right,
        above_right: f.above_left,
        below_left: f.below_right,
        below_right: f.below_left,
        ..*f
    }
}

fn shaped(value: f32, shape: Shape) -> f32 {
    match shape {
        Shape::Plain => value,
        Shape::Log => libm::log1pf(if value > 0.0 { value } else { 0.0 }),
        Shape::Signed => {
            let size = libm::log1pf(value.abs());
            if value < 0.0 { -size } else { size }
        }
    }
}

/// Within the limits; what is not a number says nothing.
fn limited(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-LIMIT, LIMIT) }
}

/// Means of 2 × 2 samples of a picture, or of its mirror image.
fn pooled(patch: &[u8; PATCH_SIDE * PATCH_SIDE], turned: bool, out: &mut [f32]) {
    for (rows, out) in patch.chunks_exact(2 * PATCH_SIDE).zip(out.chunks_exact_mut(POOLED_SIDE)) {
        let (upper, lower) = rows.split_at(PATCH_SIDE);
        for (k, (upper, lower)) in upper.chunks_exact(2).zip(lower.chunks_exact(2)).enumerate() {
            let sum: u16 = upper.iter().chain(lower).map(|grey| u16::from(*grey)).sum();
            if let Some(out) = out.get_mut(if turned { POOLED_SIDE - 1 - k } else { k }) {
                *out = f32::from(sum) * 0.25;
            }
        }
    }
}

/// Grey levels less their mean, over their deviation and the noise.
fn relative(grey: &mut [f32], noise: f32) {
    let share = 1.0 / grey.len().max(1) as f32;
    let mut sum = 0.0;
    for value in grey.iter() {
        sum += value;
    }
    let mean = sum * share;
    let mut squares = 0.0;
    for value in grey.iter_mut() {
        *value -= mean;
        squares += *value * *value;
    }
    let gain = 1.0 / (libm::sqrtf(squares * share) + noise.max(0.1));
    for value in grey {
        *value = limited(*value * gain);
    }
}

#[cfg(test)]
#[path = "score_test.rs"]
mod tests;

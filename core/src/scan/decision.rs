//! Where a beam's floor ends: the distribution of the foot over the samples, and what is said of it.
use super::SAMPLES;
use super::network::hazard;

/// Where the floor of a beam ends, in samples from the lower border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct End {
    /// The floor is seen clear up to here.
    pub(super) free: f32,
    /// The foot, and its variance in samples²; none where no foot was found.
    pub(super) foot: Option<(f32, f32)>,
    /// Probability of the foot within what its variance describes.
    pub(super) certainty: f32,
}

/// What is asked of the distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Quantiles {
    /// Probability that the floor ends before `free`.
    pub(super) free: f32,
    /// Probability that it ends before the samples of the foot.
    pub(super) foot: f32,
}

/// Samples about the foot over which its place is averaged: before and after.
const ABOUT: [usize; 2] = [2, 4];

/// Samples by which the first that may be the foot lies before the foot, since its neighbours may be it as well.
const EARLY: f32 = 0.35;

/// The end of a beam whose samples `first .. last` have these log-odds.
pub(super) fn end(log_odds: &[f32; SAMPLES], first: usize, last: usize, ask: Quantiles) -> End {
    let mut mass = [0.0_f32; SAMPLES];
    let mut survival = 1.0_f32;
    let (mut free, mut foot) = (None, None);
    for ((sample, odds), mass) in log_odds.iter().enumerate().zip(&mut mass).take(last).skip(first) {
        let hazard = hazard(*odds);
        *mass = survival * hazard;
        survival *= 1.0 - hazard;
        if free.is_none() && 1.0 - survival > ask.free {
            free = Some(sample);
        }
        if foot.is_none() && 1.0 - survival > ask.foot {
            foot = Some(sample);
        }
    }
    // A sample that may be the foot is not free, nor is the half of the one before that its window reaches.
    let free = free.unwrap_or(last) as f32 - 1.5;
    let free = free.max(first as f32 - 1.0);
    let Some(at) = foot else { return End { free, foot: None, certainty: 0.0 } };
    let about = at.saturating_sub(ABOUT[0]).max(first)..(at + ABOUT[1]).min(last);
    let masses = || about.clone().filter_map(|sample| Some((sample as f32, *mass.get(sample)?)));
    let total: f32 = masses().map(|(_, mass)| mass).sum();
    let mean = masses().map(|(sample, mass)| sample * mass).sum::<f32>() / total.max(1e-9);
    let spread = masses().map(|(sample, mass)| (sample - mean) * (sample - mean) * mass).sum::<f32>();
    let mean = mean + EARLY;
    // What rounding to whole samples leaves: 1/12.
    let variance = spread / total.max(1e-9) + 1.0 / 12.0;
    End { free: free.min(mean - 0.5), foot: Some((mean, variance)), certainty: total }
}

//! What speaks for the foot of something at a sample of a beam.
use super::look::{Look, mean};
use super::profile::Profile;
use super::{BEAMS, SAMPLES};

/// Numbers of evidence.
pub(super) const INPUTS: usize = 20;

/// What the evidence is taken from.
pub(super) struct Seen<'a> {
    pub(super) profile: &'a Profile,
    pub(super) look: &'a Look,
    pub(super) steps: &'a Steps,
    /// Standard deviation of the picture's noise, grey levels.
    pub(super) noise: f32,
    pub(super) beams: usize,
    pub(super) samples: usize,
}

/// Steps of the level, beam by beam: (mean of four samples above − mean of four below) over what is typical of the floor.
pub(super) type Steps = [[f32; SAMPLES]; BEAMS];

/// Grey levels that count for nothing, beside the floor's own variation.
fn scale(typical: f32, noise: f32) -> f32 {
    typical + 0.5 * noise + 0.4
}

fn soft(value: f32) -> f32 {
    value / (3.0 + value.abs())
}

/// The steps of all beams.
pub(super) fn steps(
    profile: &Profile,
    look: &Look,
    noise: f32,
    beams: usize,
    samples: usize,
    steps: &mut Steps,
) {
    for (cells, steps) in profile.level.iter().zip(steps.iter_mut()).take(beams) {
        let cells = cells.get(..samples).unwrap_or_default();
        for (sample, step) in steps.iter_mut().enumerate().take(samples) {
            let k = sample as isize;
            let [typical, level, ..] = look.get(sample);
            let below = mean(cells, k - 4, k).unwrap_or(level);
            let above = mean(cells, k + 1, k + 5).unwrap_or(below);
            *step = (above - below) / scale(typical, noise);
        }
    }
}

/// The evidence at one sample of one beam whose first sample in the picture is `first`.
pub(super) fn evidence(seen: &Seen<'_>, beam: usize, first: usize, sample: usize) -> Option<[f32; INPUTS]> {
    let &Seen { profile, look, steps, noise, beams, samples } = seen;
    let level = profile.level.get(beam)?.get(..samples)?;
    let texture = profile.texture.get(beam)?.get(..samples)?;
    let k = sample as isize;
    let [typical, floor, floor_texture, floor_upright, floor_spread] = look.get(sample);
    let (step_scale, spread_scale) = (scale(typical, noise), scale(floor_spread, noise));
    let lowest = first as isize;
    let below = mean(level, (k - 4).max(lowest), k).unwrap_or(floor);
    let above = mean(level, k + 1, k + 5).unwrap_or(below);
    let far_below = mean(level, (k - 14).max(lowest), (k - 2).max(lowest)).unwrap_or(floor);
    let far_above = mean(level, k + 5, k + 13).unwrap_or(above);
    let fine =
        (mean(level, k + 1, k + 2)? - mean(level, (k - 1).max(lowest), k).unwrap_or(floor)) / step_scale;
    let two =
        (mean(level, k + 1, k + 3)? - mean(level, (k - 2).max(lowest), k).unwrap_or(floor)) / step_scale;
    let four = (above - below) / step_scale;
    let sign = if four < 0.0 { -1.0 } else { 1.0 };
    // The change that lasts: the least of those at several heights.
    let lasting = [3, 6, 10, 15]
        .into_iter()
        .filter_map(|up| mean(level, k + up, k + up + 3))
        .fold(f32::MAX, |least, value| least.min(sign * (value - below)));
    let lasting = if lasting == f32::MAX { 0.0 } else { lasting / step_scale };
    // The same step beside it, up to two samples higher or lower.
    let beside = |other: Option<usize>| {
        let other = other.filter(|other| *other < beams)?;
        let steps = steps.get(other)?;
        (k - 2..=k + 2)
            .filter_map(|at| steps.get(usize::try_from(at).ok()?))
            .map(|step| sign * step)
            .reduce(f32::max)
    };
    let left = beside(beam.checked_sub(1)).unwrap_or(0.0);
    let right = beside(Some(beam + 1)).unwrap_or(0.0);
    let far_left = beside(beam.checked_sub(2)).unwrap_or(0.0);
    let far_right = beside(Some(beam + 2)).unwrap_or(0.0);
    // Whether this sample has the largest step of those around it.
    let own = steps.get(beam)?;
    let around = (k - 3..=k + 3)
        .filter_map(|at| own.get(usize::try_from(at).ok()?))
        .map(|step| sign * step)
        .fold(0.0, f32::max);
    let peak = four.abs() / around.max(0.1);
    let upright_scale = scale(floor_upright, noise);
    let upright = |from: isize, to: isize| {
        (beam.saturating_sub(1)..(beam + 2).min(beams))
            .filter_map(|other| mean(profile.across.get(other)?.get(..samples)?, from, to))
            .map(f32::abs)
            .fold(0.0, f32::max)
            / upright_scale
    };
    let (upright_above, upright_below) = (upright(k + 1, k + 9), upright((k - 8).max(lowest), k.max(lowest)));
    let texture_of = |from: isize, to: isize| mean(texture, from, to).unwrap_or(floor_texture);
    let ratio = |value: f32| (value - floor_texture) / (value + floor_texture + noise + 1.0);
    let dark = (k - 1..=k + 1)
        .filter_map(|at| level.get(usize::try_from(at).ok()?))
        .fold(f32::MAX, |least, at| least.min(*at));
    Some([
        soft(fine.abs()),
        soft(two.abs()),
        soft(four.abs()),
        soft(four),
        soft(lasting),
        peak,
        soft((above - far_below) / spread_scale),
        soft((above - far_below).abs() / step_scale),
        soft((above - floor).abs() / spread_scale),
        soft((below - floor).abs() / spread_scale),
        soft((far_above - far_below).abs() / spread_scale),
        soft(left.min(right)),
        soft(left.max(right)),
        soft(far_left.max(0.0) + far_right.max(0.0)),
        soft(upright_above),
        soft(upright_below),
        ratio(texture_of(k + 1, k + 7)),
        ratio(texture_of((k - 6).max(lowest), k.max(lowest))),
        soft((dark - below) / step_scale),
        step_scale / (step_scale + noise + 0.5),
    ])
}

//! How the floor looks, sample by sample from near to far: what is normal there.
use super::profile::Profile;
use super::{BEAMS, SAMPLES};

/// The floor's look, by sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// Grey level.
    pub(super) level: [f32; SAMPLES],
    /// Typical |difference| of the means of two rows above and two below.
    pub(super) step: [f32; SAMPLES],
    /// Typical |level − level two metres of floor around it|: of a beam from the row's level.
    pub(super) spread: [f32; SAMPLES],
    /// Mean of |I(u + 1) − I(u − 1)|.
    pub(super) texture: [f32; SAMPLES],
    /// Typical |sum over eight samples of the contrast across|, over eight.
    pub(super) upright: [f32; SAMPLES],
    /// Pictures that each sample has been seen in; up to a cap.
    pub(super) seen: [f32; SAMPLES],
}

impl Default for Look {
    fn default() -> Self {
        let zero = [0.0; SAMPLES];
        Self { level: zero, step: zero, spread: zero, texture: zero, upright: zero, seen: zero }
    }
}

/// Samples of a mean over several.
pub(super) fn mean(cells: &[f32], from: isize, to: isize) -> Option<f32> {
    let (from, to) = (from.max(0) as usize, (to.max(0) as usize).min(cells.len()));
    let cells = cells.get(from..to)?;
    if cells.is_empty() { None } else { Some(cells.iter().sum::<f32>() / cells.len() as f32) }
}

/// |step|, |deviation|, texture, |upright| of one beam at one sample.
pub(super) fn measures(profile: &Profile, beam: usize, sample: usize, samples: usize) -> Option<[f32; 4]> {
    let level = profile.level.get(beam)?.get(..samples)?;
    let across = profile.across.get(beam)?.get(..samples)?;
    let texture = profile.texture.get(beam)?.get(..samples)?;
    let k = sample as isize;
    let below = mean(level, k - 2, k).or_else(|| mean(level, k, k + 1))?;
    let above = mean(level, k + 1, k + 3).or_else(|| mean(level, k, k + 1))?;
    let upright = mean(across, k - 4, k + 4)?;
    Some([(above - below).abs(), *level.get(sample)?, *texture.get(sample)?, upright.abs()])
}

fn median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let (_, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
    Some(*median)
}

impl Look {
    /// The look that a picture gives by itself: medians over the beams, from the lower border upwards, which may change from sample
    /// to sample by no more than a floor's look does: what is seen above the floor does not enter at once.
    pub(super) fn of_picture(
        profile: &Profile,
        valid: &[usize; BEAMS],
        beams: usize,
        samples: usize,
    ) -> Self {
        let mut look = Self::default();
        let mut last: Option<[f32; 5]> = None;
        for sample in 0..samples {
            let mut values = [[0.0; BEAMS]; 4];
            let mut count = 0;
            for beam in 0..beams {
                if valid.get(beam).is_some_and(|first| *first > sample) {
                    continue;
                }
                if let Some(measured) = measures(profile, beam, sample, samples) {
                    for (values, value) in values.iter_mut().zip(measured) {
                        if let Some(place) = values.get_mut(count) {
                            *place = value;
                        }
                    }
                    count += 1;
                }
            }
            let mut medians = [0.0; 5];
            if count > 0 {
                for (median_of, values) in medians.iter_mut().zip(&mut values) {
                    *median_of = median(values.get_mut(..count).unwrap_or_default()).unwrap_or(0.0);
                }
                let level = medians[1];
                let levels = values[1].get_mut(..count).unwrap_or_default();
                levels.iter_mut().for_each(|value| *value = (*value - level).abs());
                medians[4] = median(levels).unwrap_or(0.0);
            } else if let Some(last) = last {
                medians = last;
            }
            let now = match last {
                None => medians,
                Some(last) => {
                    let slow = |now: f32, last: f32| {
                        last + (now - last).clamp(-0.04 * last - 0.005, 0.04 * last + 0.005)
                    };
                    [
                        slow(medians[0], last[0]),
                        last[1] + (medians[1] - last[1]).clamp(-0.8, 0.8),
                        slow(medians[2], last[2]),
                        slow(medians[3], last[3]),
                        slow(medians[4], last[4]),
                    ]
                }
            };
            last = Some(now);
            look.set(sample, now, 0.0);
        }
        look
    }

    fn set(&mut self, sample: usize, [step, level, texture, upright, spread]: [f32; 5], seen: f32) {
        let channels = [
            &mut self.step,
            &mut self.level,
            &mut self.texture,
            &mut self.upright,
            &mut self.spread,
            &mut self.seen,
        ];
        for (channel, value) in channels.into_iter().zip([step, level, texture, upright, spread, seen]) {
            if let Some(cell) = channel.get_mut(sample) {
                *cell = value;
            }
        }
    }

    pub(super) fn get(&self, sample: usize) -> [f32; 5] {
        [&self.step, &self.level, &self.texture, &self.upright, &self.spread]
            .map(|channel| channel.get(sample).copied().unwrap_or(0.0))
    }

    pub(super) fn weight(&self, sample: usize) -> f32 {
        self.seen.get(sample).copied().unwrap_or(0.0)
    }

    /// What is remembered where it has been seen, the picture's own elsewhere.
    pub(super) fn blended(memory: &Self, picture: &Self, samples: usize) -> Self {
        let mut look = *picture;
        for sample in 0..samples {
            let weight = (memory.weight(sample) / 3.0).min(1.0);
            let (old, new) = (memory.get(sample), picture.get(sample));
            let mut both = new;
            for (value, old) in both.iter_mut().zip(old) {
                *value += (old - *value) * weight;
            }
            look.set(sample, both, weight);
        }
        look
    }

    /// Remembers a picture whose beams' floor ends before `ends`, a sample each.
    pub(super) fn learn(
        &mut self,
        profile: &Profile,
        valid: &[usize; BEAMS],
        ends: &[usize; BEAMS],
        beams: usize,
        samples: usize,
    ) {
        for sample in 0..samples {
            let (mut sums, mut squares, mut count) = ([0.0; 4], 0.0, 0.0);
            for beam in 0..beams {
                let (first, end) =
                    (valid.get(beam).copied().unwrap_or(0), ends.get(beam).copied().unwrap_or(0));
                if sample < first || sample + 6 >= end {
                    continue;
                }
                let Some(measured) = measures(profile, beam, sample, samples) else { continue };
                for (sum, value) in sums.iter_mut().zip(measured) {
                    *sum += value;
                }
                squares += measured[1] * measured[1];
                count += 1.0;
            }
            if count < 4.0 {
                continue;
            }
            let [step, level, texture, upright] = sums.map(|sum| sum / count);
            let spread = libm::sqrtf((squares / count - level * level).max(0.0)) * 0.67;
            // A mean absolute value of normal noise is 1.18 medians.
            let now = [step * 0.845, level, texture, upright * 0.845, spread];
            let seen = self.weight(sample);
            let rate = 1.0 / (seen + 1.0).min(12.0);
            let mut both = self.get(sample);
            for (value, new) in both.iter_mut().zip(now) {
                *value += (new - *value) * rate;
            }
            self.set(sample, both, (seen + 1.0).min(100.0));
        }
    }
}

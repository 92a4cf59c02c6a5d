//! What is seen along the beams: level, contrast across, and texture, from rows as they come.
use super::path::Paths;
use super::{BEAMS, SAMPLES};

/// Cells of all beams, sample by sample from the lower border.
#[derive(Clone, Debug)]
pub(super) struct Profile {
    /// Mean grey level of a window about the path.
    pub(super) level: [[f32; SAMPLES]; BEAMS],
    /// Mean of its right half minus that of its left half.
    pub(super) across: [[f32; SAMPLES]; BEAMS],
    /// Mean of |I(u + 1) − I(u − 1)| in it.
    pub(super) texture: [[f32; SAMPLES]; BEAMS],
}

impl Default for Profile {
    fn default() -> Self {
        let zero = [[0.0; SAMPLES]; BEAMS];
        Self { level: zero, across: zero, texture: zero }
    }
}

/// The widest picture.
pub(super) const MAX_WIDTH: usize = 2048;

impl Profile {
    pub(super) fn begin(&mut self) {
        for channel in [&mut self.level, &mut self.across, &mut self.texture] {
            channel.as_flattened_mut().fill(0.0);
        }
    }

    /// Takes row `row` of a picture that is `height` rows high.
    pub(super) fn push(&mut self, paths: &Paths, row: usize, height: usize, pixels: &[u8]) {
        let sample = (height - 1 - row) / paths.step();
        if sample >= paths.samples() {
            return;
        }
        let (mut levels, mut slopes) = ([0_u32; MAX_WIDTH + 1], [0_u32; MAX_WIDTH + 1]);
        let mut sum = 0;
        for (total, pixel) in levels.iter_mut().skip(1).zip(pixels) {
            sum += u32::from(*pixel);
            *total = sum;
        }
        sum = 0;
        for (total, window) in slopes.iter_mut().skip(2).zip(pixels.windows(3)) {
            if let [left, _, right] = window {
                sum += u32::from(left.abs_diff(*right));
            }
            *total = sum;
        }
        let half = paths.half_width(sample);
        let share = 1.0 / paths.step() as f32;
        for beam in 0..paths.beams() {
            let Some(column) = paths.column(beam, sample) else { continue };
            let middle = column as usize + 1; // of the sums: pixels left of it
            let (from, to) = (middle.saturating_sub(half).max(2), (middle + half).min(pixels.len() - 1));
            let sums = |sums: &[u32], from: usize, to: usize| {
                let at = |place: usize| sums.get(place).copied().unwrap_or(0);
                (at(to) - at(from)) as f32 / (to - from).max(1) as f32
            };
            let (left, right) = (sums(&levels, from, middle), sums(&levels, middle, to));
            let texture = sums(&slopes, from, to);
            let put = |channel: &mut [[f32; SAMPLES]; BEAMS], value: f32| {
                if let Some(cell) = channel.get_mut(beam).and_then(|cells| cells.get_mut(sample)) {
                    *cell += value * share;
                }
            };
            put(&mut self.level, (left + right) * 0.5);
            put(&mut self.across, right - left);
            put(&mut self.texture, texture);
        }
    }
}

/// Largest second difference that has a class of its own.
const CLASSES: usize = 64;
/// What rounding to whole grey levels leaves at the least: 1/√12.
const QUANTISATION_STD: f32 = 0.288_675_13;

/// The standard deviation of a picture's noise, from rows as they come.
///
/// For white noise of deviation σ the second difference I(u−1) − 2 I(u) + I(u+1) has deviation √6 σ wherever the
/// picture is locally linear. The median of its magnitude, 0.6745 √6 σ, hardly sees the few pixels on edges
/// (one in ten of them raises it by 13 %); fine texture counts as noise, and acts as noise on edges too.
#[derive(Clone, Copy, Debug)]
pub struct NoiseLevel {
    counts: [u32; CLASSES],
}

impl Default for NoiseLevel {
    fn default() -> Self {
        Self { counts: [0; CLASSES] }
    }
}

impl NoiseLevel {
    /// Takes one row into account.
    pub fn add_row(&mut self, row: &[u8]) {
        for window in row.windows(3) {
            if let &[left, at, right] = window {
                let second = (i32::from(left) - 2 * i32::from(at) + i32::from(right)).unsigned_abs() as usize;
                if let Some(count) = self.counts.get_mut(second.min(CLASSES - 1)) {
                    *count += 1;
                }
            }
        }
    }

    /// Standard deviation in grey levels, at least that of rounding.
    pub fn std(&self) -> f32 {
        let half = self.counts.iter().sum::<u32>() as f32 * 0.5;
        let mut below = 0.0;
        for (class, count) in self.counts.iter().enumerate() {
            let count = *count as f32;
            if below + count >= half && count > 0.0 {
                // Class k holds magnitudes from k − ½ to k + ½, class 0 those up to ½.
                let (from, width) = if class == 0 { (0.0, 0.5) } else { (class as f32 - 0.5, 1.0) };
                let median = from + width * (half - below) / count;
                return (median / (0.6745 * 2.449_489_7)).max(QUANTISATION_STD);
            }
            below += count;
        }
        QUANTISATION_STD
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn a_flat_or_empty_picture_has_the_noise_of_rounding() {
        let mut level = NoiseLevel::default();
        assert_eq!(level.std(), QUANTISATION_STD);
        level.add_row(&[9; 50]);
        assert_eq!(level.std(), QUANTISATION_STD);
    }

    #[test]
    fn triangular_noise_is_measured_within_ten_percent_despite_edges() {
        // The sum of two uniform variables of 0 ..= 10: variance 20.
        let mut state = 1_u32;
        let mut uniform = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % 11
        };
        let mut level = NoiseLevel::default();
        for _ in 0..50 {
            let row: Vec<u8> = (0..200)
                .map(|u| (uniform() + uniform() + if u % 100 < 50 { 60 } else { 160 }) as u8)
                .collect();
            level.add_row(&row);
        }
        let expected = 20_f32.sqrt();
        assert!((level.std() / expected - 1.0).abs() < 0.1, "{} instead of {expected}", level.std());
    }
}

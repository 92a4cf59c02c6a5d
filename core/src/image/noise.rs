use super::gradient::{GRADIENT_SCALE, GRADIENT_ZERO};

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

/// Classes of [`GradientLevel`], and gradient units to each: an eighth of a grey level per pixel.
const STEPS: usize = 96;
const STEP: u32 = (GRADIENT_SCALE / 8.0) as u32;

/// The deviation of the gradient where there is no edge, from rows of gradient as they come.
///
/// The length of a Gaussian gradient with deviation g along either axis is below √(−2 ln 0.7) g = 0.845 g for 30 % of the
/// pixels. Few pictures have edges, slopes and shades on more than two thirds of their pixels; fine texture counts as noise.
#[derive(Clone, Copy, Debug)]
pub struct GradientLevel {
    counts: [u32; STEPS],
}

impl Default for GradientLevel {
    fn default() -> Self {
        Self { counts: [0; STEPS] }
    }
}

impl GradientLevel {
    /// Takes a row of gradients, as they are stored, into account.
    pub fn add_row(&mut self, along_u: &[u16], along_v: &[u16]) {
        let size = |gradient: u16| u32::from(gradient.abs_diff(GRADIENT_ZERO));
        for (u, v) in along_u.iter().zip(along_v) {
            let (u, v) = (size(*u), size(*v));
            let (longer, shorter) = if u > v { (u, v) } else { (v, u) };
            // √(u² + v²) by two straight lines, off by less than 2.8 %.
            let (near, far) = (longer * 124 + shorter * 26, longer * 107 + shorter * 70);
            let length = (if near > far { near } else { far }) / 128;
            if let Some(count) = self.counts.get_mut((length / STEP) as usize) {
                *count += 1;
            } else if let Some(last) = self.counts.last_mut() {
                *last += 1;
            }
        }
    }

    /// Deviation of either component, grey levels per pixel; 0 before the first row.
    pub fn std(&self) -> f32 {
        let quantile = self.counts.iter().sum::<u32>() as f32 * 0.3;
        let mut below = 0.0;
        for (class, count) in self.counts.iter().enumerate() {
            let count = *count as f32;
            if below + count >= quantile && count > 0.0 {
                return (class as f32 + (quantile - below) / count) / (8.0 * 0.845);
            }
            below += count;
        }
        0.0
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
    fn the_gradients_deviation_is_found_beside_edges() {
        let mut state = 1_u32;
        let mut uniform = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) as f32 / 65_536.0
        };
        let mut level = GradientLevel::default();
        assert_eq!(level.std(), 0.0);
        for _ in 0..20 {
            let rows = [0, 1].map(|_| {
                let edge = |k: usize| if k.is_multiple_of(10) { 3000.0 } else { 0.0 };
                let gauss = |uniform: &mut dyn FnMut() -> f32| (0..12).map(|_| uniform()).sum::<f32>() - 6.0;
                (0..300)
                    .map(|k| {
                        let value = gauss(&mut uniform) * 1.5 * GRADIENT_SCALE + edge(k);
                        GRADIENT_ZERO.wrapping_add_signed(value as i16)
                    })
                    .collect::<Vec<u16>>()
            });
            level.add_row(&rows[0], &rows[1]);
        }
        assert!((level.std() / 1.5 - 1.0).abs() < 0.12, "{}", level.std());
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

//! From light to bytes: blur, gain, vignette, noise.
use crate::random::{Random, Stream};
use monorange_core::geometry::RangeFinder;

/// Numbers of a [normal quantile table](Sensor): a byte and a half choose one.
const QUANTILES: usize = 4096;

/// What the sensor adds to the picture.
#[derive(Clone)]
pub(crate) struct Sensor {
    width: usize,
    gains: Vec<f32>,
    /// Weight of each of the two neighbours in the blur.
    side_weight: f32,
    /// Standard normal quantiles times the noise's σ.
    noise: Vec<f32>,
}

impl Sensor {
    /// `blur` is a standard deviation in pixels; `vignette` the loss at the picture's corner.
    pub(crate) fn new(rig: &RangeFinder<f64>, gain: f64, vignette: f64, blur: f64, noise: f64) -> Self {
        let camera = rig.camera();
        let (width, height) = (camera.width(), camera.height());
        let (middle_u, middle_v) = ((width as f64 - 1.0) * 0.5, (height as f64 - 1.0) * 0.5);
        let corner2 = middle_u * middle_u + middle_v * middle_v;
        let gains = (0..width * height)
            .map(|index| {
                let (u, v) = ((index % width) as f64 - middle_u, (index / width) as f64 - middle_v);
                (gain * (1.0 - vignette * (u * u + v * v) / corner2.max(1.0))) as f32
            })
            .collect();
        // A kernel [w, 1 − 2w, w] has variance 2w.
        let side_weight = (0.5 * blur * blur).min(1.0 / 3.0) as f32;
        let noise = if noise > 0.0 { normal_quantiles(noise) } else { Vec::new() };
        Self { width, gains, side_weight, noise }
    }

    pub(crate) fn expose(&self, levels: &mut [f32], seed: u64, frame: usize, pixels: &mut [u8]) {
        if self.side_weight > 0.0 {
            self.blur(levels);
        }
        for (level, gain) in levels.iter_mut().zip(&self.gains) {
            *level *= gain;
        }
        if !self.noise.is_empty() {
            let mut bytes = vec![0_u8; 2 * levels.len()];
            Random::new(seed, Stream::Pixels(frame)).fill(&mut bytes);
            for (level, pair) in levels.iter_mut().zip(bytes.chunks_exact(2)) {
                let index = usize::from(u16::from_le_bytes([pair[0], pair[1]])) % QUANTILES;
                *level += self.noise[index];
            }
        }
        for (pixel, level) in pixels.iter_mut().zip(levels.iter()) {
            *pixel = (level + 0.5) as u8;
        }
    }

    fn blur(&self, levels: &mut [f32]) {
        let (width, side) = (self.width, self.side_weight);
        let centre = 1.0 - 2.0 * side;
        for row in levels.chunks_exact_mut(width) {
            let mut before = row[0];
            for column in 0..width {
                let here = row[column];
                let after = row[(column + 1).min(width - 1)];
                row[column] = centre * here + side * (before + after);
                before = here;
            }
        }
        let mut before = levels[..width].to_vec();
        let rows = levels.len() / width;
        for row in 0..rows {
            let (above, below) = levels.split_at_mut((row + 1) * width);
            let here = &mut above[row * width..];
            for column in 0..width {
                let level = here[column];
                let after = below.get(column).copied().unwrap_or(level);
                here[column] = centre * level + side * (before[column] + after);
                before[column] = level;
            }
        }
    }
}

/// Quantiles of N(0, std²) at the middles of equal shares of probability, scaled to exactly that variance.
fn normal_quantiles(std: f64) -> Vec<f32> {
    let half: Vec<f64> = (0..QUANTILES / 2)
        .map(|k| {
            let tail = (k as f64 + 0.5) / QUANTILES as f64; // P(z < −x)
            let (mut low, mut high) = (0.0, 6.0);
            for _ in 0..34 {
                let middle = 0.5 * (low + high);
                if 0.5 * libm::erfc(middle * core::f64::consts::FRAC_1_SQRT_2) > tail {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            low
        })
        .collect();
    let variance = half.iter().map(|x| x * x).sum::<f64>() / half.len() as f64;
    let scale = std / libm::sqrt(variance);
    half.iter().flat_map(|x| [(x * scale) as f32, (-x * scale) as f32]).collect()
}

#[cfg(test)]
mod tests {
    use super::normal_quantiles;

    #[test]
    fn quantiles_have_the_stated_deviation_and_normal_tails() {
        let table = normal_quantiles(2.0);
        let mean_square = table.iter().map(|x| f64::from(x * x)).sum::<f64>() / table.len() as f64;
        assert!((mean_square - 4.0).abs() < 1e-4, "{mean_square}");
        let beyond = table.iter().filter(|x| x.abs() > 4.0).count() as f64 / table.len() as f64;
        assert!((beyond - 0.0455).abs() < 0.002, "P(|z| > 2σ) = {beyond}");
    }
}

//! Square textures that repeat, with averaged levels for every distance.
use crate::random::{Random, Stream};

/// A brightness factor around 1 for every point of a plane.
///
/// Level ℓ holds averages over 2^ℓ × 2^ℓ texels, so that a pixel that covers many texels sees their mean
/// instead of one of them.
pub(crate) struct Texture {
    /// Row-major, each row and column one longer than the texture, so that it wraps without a branch.
    levels: Vec<Vec<u16>>,
    log2_size: u32,
    texels_per_metre: f32,
}

/// What is stored for a factor of 1; factors stay below 2.
const ONE: f32 = 8192.0;
/// One texel in fixed point.
const FRACTION: f32 = 65536.0;
/// More probes than this would overflow the sum.
const MAX_COUNT: u32 = 64;

impl Texture {
    /// From factors, row-major, `1 << log2_size` a side.
    fn new(factors: &[f32], log2_size: u32, texel: f32, contrast: f32) -> Self {
        let mean = factors.iter().sum::<f32>() / factors.len().max(1) as f32;
        let mut level: Vec<f32> = factors.iter().map(|factor| 1.0 + (factor - mean) * contrast).collect();
        let mut levels = vec![quantize(&level, 1 << log2_size)];
        for log2 in (1..=log2_size).rev() {
            let size = 1_usize << log2;
            let pairs = level.chunks_exact(2 * size);
            level = pairs
                .flat_map(|rows| {
                    let (top, bottom) = rows.split_at(size);
                    let columns = top.chunks_exact(2).zip(bottom.chunks_exact(2));
                    columns.map(|(a, b)| (a[0] + a[1] + b[0] + b[1]) * 0.25)
                })
                .collect();
            levels.push(quantize(&level, size / 2));
        }
        Self { levels, log2_size, texels_per_metre: 1.0 / texel }
    }

    /// The level whose texels are about as large as `footprint` (metres).
    #[inline]
    pub(crate) fn level(&self, footprint: f32) -> u32 {
        // The exponent of a floating-point number is the whole part of its logarithm; 1.42 rounds it.
        let texels = footprint * self.texels_per_metre * 1.42;
        let exponent = (texels.to_bits() >> 23) as i32 - 127;
        exponent.clamp(0, self.log2_size as i32) as u32
    }

    /// The mean factor of `count` points `step` apart from `first` (metres), bilinear within a level.
    #[inline]
    pub(crate) fn mean(&self, level: u32, first: [f32; 2], step: [f32; 2], count: u32) -> f32 {
        let Some(texels) = self.levels.get(level as usize) else { return 1.0 };
        // Fixed point with 16 bits of fraction: wraps at 2³² like the texture does at its size.
        let bits = self.log2_size - level;
        let scale = self.texels_per_metre * FRACTION / (1_u32 << level) as f32;
        let mask = (1_u32 << bits) - 1;
        let stride = (1_usize << bits) + 1;
        let fixed = |value: f32| value as i64 as u32;
        let [mut x, mut y] = first.map(|metres| fixed(metres * scale - 0.5 * FRACTION));
        let [step_x, step_y] = step.map(|metres| fixed(metres * scale));
        let mut sum = 0_u32;
        for _ in 0..count.min(MAX_COUNT) {
            let (column, row) = ((x >> 16) & mask, (y >> 16) & mask);
            let (fx, fy) = ((x >> 8) & 255, (y >> 8) & 255);
            let index = row as usize * stride + column as usize;
            let (Some(&[a, b]), Some(&[c, d])) = (
                texels.get(index..).and_then(|texels| texels.first_chunk()),
                texels.get(index + stride..).and_then(|texels| texels.first_chunk()),
            ) else {
                return 1.0;
            };
            let upper = u32::from(a) * (256 - fx) + u32::from(b) * fx;
            let lower = u32::from(c) * (256 - fx) + u32::from(d) * fx;
            sum += (upper * (256 - fy) + lower * fy) >> 8;
            x = x.wrapping_add(step_x);
            y = y.wrapping_add(step_y);
        }
        sum as f32 / (256.0 * ONE * count as f32)
    }

    /// The factor at one point.
    #[inline]
    pub(crate) fn sample(&self, level: u32, x: f32, y: f32) -> f32 {
        self.mean(level, [x, y], [0.0; 2], 1)
    }
}

/// Fixed-point factors of a square level, with its first column and row repeated at the end.
fn quantize(level: &[f32], size: usize) -> Vec<u16> {
    let rows = level.chunks_exact(size).chain(level.chunks_exact(size).take(1));
    let texels = rows.flat_map(|row| row.iter().chain(row.iter().take(1)));
    texels.map(|factor| (factor.clamp(0.0, 1.99) * ONE + 0.5) as u16).collect()
}

/// Terrazzo tiles: chips of light and dark stone in a cloudy ground, tiles of slightly different tone, thin
/// joints. `contrast` 0 is a plain floor.
pub(crate) fn terrazzo(seed: u64, contrast: f32) -> Texture {
    const LOG2_SIZE: u32 = 10;
    const SIZE: usize = 1 << LOG2_SIZE;
    const TEXEL: f32 = 0.003;
    const TILES: usize = 8; // a side: 0.384 m each
    let mut random = Random::new(seed, Stream::FloorTexture);
    let mut factors = vec![1.0_f32; SIZE * SIZE];
    clouds(&mut factors, SIZE, &mut random, &[(16, 0.05), (64, 0.05), (256, 0.05)]);
    for _ in 0..26_000 {
        let centre = (random.index(SIZE), random.index(SIZE));
        // Many small chips, few large ones.
        let size = random.unit();
        let radius = 0.8 + 4.2 * size * size * size;
        let shade = random.within(-0.34, 0.30) as f32;
        let squash = random.within(0.6, 1.6);
        chip(&mut factors, SIZE, centre, [radius * squash, radius / squash], shade);
    }
    let tones: Vec<f32> = (0..TILES * TILES).map(|_| random.within(-0.06, 0.06) as f32).collect();
    let side = SIZE / TILES;
    for (index, factor) in factors.iter_mut().enumerate() {
        let (column, row) = (index % SIZE, index / SIZE);
        *factor += tones[(row / side) * TILES + column / side];
        if column % side == 0 || row % side == 0 {
            *factor -= 0.25;
        }
    }
    Texture::new(&factors, LOG2_SIZE, TEXEL, contrast)
}

/// Painted plaster or wood: faint clouds and grain.
pub(crate) fn plaster(seed: u64, contrast: f32) -> Texture {
    const LOG2_SIZE: u32 = 9;
    const SIZE: usize = 1 << LOG2_SIZE;
    let mut random = Random::new(seed, Stream::WallTexture);
    let mut factors = vec![1.0_f32; SIZE * SIZE];
    clouds(&mut factors, SIZE, &mut random, &[(4, 0.03), (16, 0.025), (64, 0.02), (256, 0.03)]);
    for _ in 0..260 {
        let centre = (random.index(SIZE), random.index(SIZE));
        let shade = random.within(-0.10, 0.05) as f32;
        let radii = [random.within(1.0, 5.0), random.within(1.0, 5.0)];
        chip(&mut factors, SIZE, centre, radii, shade);
    }
    Texture::new(&factors, LOG2_SIZE, 0.004, contrast)
}

/// Adds value noise: for each (cells a side, amplitude) random values, joined smoothly.
fn clouds(factors: &mut [f32], size: usize, random: &mut Random, octaves: &[(usize, f32)]) {
    for &(cells, amplitude) in octaves {
        let values: Vec<f32> =
            (0..cells * cells).map(|_| random.within(-1.0, 1.0) as f32 * amplitude).collect();
        let step = size / cells;
        let blend: Vec<f32> = (0..step)
            .map(|i| {
                let x = i as f32 / step as f32;
                x * x * (3.0 - 2.0 * x)
            })
            .collect();
        let mut across = vec![0.0; cells + 1];
        for (row, factors) in factors.chunks_exact_mut(size).enumerate() {
            let (above, below) = (row / step, (row / step + 1) % cells);
            let down = blend[row % step];
            for (cell, value) in across.iter_mut().enumerate() {
                let column = cell % cells;
                let (upper, lower) = (values[above * cells + column], values[below * cells + column]);
                *value = upper + (lower - upper) * down;
            }
            for (factors, ends) in factors.chunks_exact_mut(step).zip(across.windows(2)) {
                for (factor, right) in factors.iter_mut().zip(&blend) {
                    *factor += ends[0] + (ends[1] - ends[0]) * right;
                }
            }
        }
    }
}

/// Adds an ellipse of `shade`, across the texture's border where needed.
fn chip(factors: &mut [f32], size: usize, centre: (usize, usize), radii: [f64; 2], shade: f32) {
    let [half_width, half_height] = radii.map(|radius| radius as usize + 1);
    for row in 0..=2 * half_height {
        for column in 0..=2 * half_width {
            let x = (column as f64 - half_width as f64) / radii[0];
            let y = (row as f64 - half_height as f64) / radii[1];
            if x * x + y * y <= 1.0 {
                let u = (centre.0 + size + column - half_width) % size;
                let v = (centre.1 + size + row - half_height) % size;
                factors[v * size + u] = 1.0 + (factors[v * size + u] - 1.0) * 0.4 + shade;
            }
        }
    }
}

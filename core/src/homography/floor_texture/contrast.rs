//! A picture's texture without its light.
use alloc::vec;
use alloc::vec::Vec;
use nalgebra::Vector2;

/// A contrast of one standard deviation.
const ONE: f32 = 32.0;
/// Half the sides of the squares that are averaged: over noise, over what is light rather than texture, and over the contrast's
/// surroundings.
const HALF_SIDES: [usize; 3] = [1, 3, 6];
/// Differences are kept in these parts of their sums, or their squares would overflow.
const PARTS: i32 = 64;
/// Below half a grey level it is the camera's noise: squared, in those parts.
const NOISE: f32 = 12.0;

/// (mean₃ − mean₇)/rms₁₃ of squares of so many pixels a side.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Contrast {
    values: Vec<i8>,
    width: usize,
    height: usize,
}

impl Contrast {
    /// Of grey levels from 0 to 255, row by row.
    pub(super) fn of(grey: &[i32], width: usize) -> Self {
        let [fine, light, around] = HALF_SIDES;
        let (near, far) = (box_sums(grey, width, fine), box_sums(grey, width, light));
        let [few, many] = [fine, light].map(|half| area(half) as i32);
        let difference: Vec<_> =
            near.iter().zip(&far).map(|(near, far)| (near * many - far * few) / PARTS).collect();
        let squares: Vec<_> = difference.iter().map(|value| value * value).collect();
        let power = box_sums(&squares, width, around);
        let values = difference.iter().zip(power).map(|(value, power)| {
            let rms = libm::sqrtf(power as f32 / area(around) as f32 + NOISE);
            (*value as f32 / rms * ONE) as i8
        });
        Self { values: values.collect(), width, height: grey.len() / width }
    }

    /// Row by row.
    pub(super) fn values(&self) -> &[i8] {
        &self.values
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// Whether a place is in the picture, so far from its right and lower edge; a ray that is all but level has one a billion pixels away.
    fn holds(&self, at: Vector2<f32>, edge: f32) -> bool {
        let (right, below) = (self.width as f32 - edge, self.height as f32 - edge);
        at.x >= 0.0 && at.y >= 0.0 && at.x < right && at.y < below
    }

    /// At the nearest pixel, where there is one.
    pub(super) fn nearest(&self, at: Vector2<f32>) -> Option<f32> {
        if !self.holds(at, 0.5) {
            return None;
        }
        let (u, v) = ((at.x + 0.5) as u32 as usize, (at.y + 0.5) as u32 as usize);
        self.values.get(v * self.width + u).map(|value| f32::from(*value))
    }

    /// Between four pixels.
    pub(super) fn between(&self, at: Vector2<f32>) -> Option<f32> {
        if !self.holds(at, 1.0) {
            return None;
        }
        let (u, v) = (at.x as u32 as usize, at.y as u32 as usize);
        let start = v * self.width + u;
        let Some([a, b, .., c, d]) = self.values.get(start..start + self.width + 2) else { return None };
        let (x, y) = (at.x - u as f32, at.y - v as f32);
        let [a, b, c, d] = [a, b, c, d].map(|value| f32::from(*value));
        Some((a + (b - a) * x) * (1.0 - y) + (c + (d - c) * x) * y)
    }
}

/// Pixels in such a square.
pub(super) fn area(half: usize) -> usize {
    (2 * half + 1) * (2 * half + 1)
}

/// Sums over squares of `2 half + 1` a side round each place, the edges repeated outwards.
pub(super) fn box_sums(values: &[i32], width: usize, half: usize) -> Vec<i32> {
    let mut across = Vec::with_capacity(values.len());
    let mut padded = Vec::with_capacity(width + 2 * half + 1);
    for row in values.chunks_exact(width) {
        let [first, last] = [row.first(), row.last()].map(|end| end.copied().unwrap_or_default());
        padded.clear();
        padded.extend(core::iter::repeat_n(first, half).chain(row.iter().copied()));
        padded.extend(core::iter::repeat_n(last, half + 1));
        let (before, entering) = padded.split_at(2 * half + 1);
        let mut sum: i32 = before.iter().sum();
        across.extend(entering.iter().zip(&padded).map(|(entering, leaving)| {
            let here = sum;
            sum += entering - leaving;
            here
        }));
    }
    let rows: Vec<&[i32]> = across.chunks_exact(width).collect();
    let last = rows.len().saturating_sub(1);
    let row = |v: usize| rows.get(v.min(last)).copied().unwrap_or_default();
    let mut sums = vec![0; width];
    let add = |sums: &mut [i32], row: &[i32], times: i32| {
        sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value * times);
    };
    add(&mut sums, row(0), half as i32);
    (0..=half).for_each(|v| add(&mut sums, row(v), 1));
    let mut all = Vec::with_capacity(values.len());
    for v in 0..rows.len() {
        all.extend_from_slice(&sums);
        add(&mut sums, row(v + half + 1), 1);
        add(&mut sums, row(v.saturating_sub(half)), -1);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn light_and_its_slope_are_no_contrast_and_noise_is_little() {
        let picture = |texture: &dyn Fn(usize, usize) -> i32| {
            let grey: Vec<i32> =
                (0..40 * 40).map(|k| 60 + (k % 40) as i32 + texture(k % 40, k / 40)).collect();
            Contrast::of(&grey, 40).values[19 * 40 + 19]
        };
        assert_eq!(picture(&|_, _| 0), 0);
        assert!(picture(&|u, v| if (u / 3 + v / 3) % 2 == 0 { 2 } else { -2 }).unsigned_abs() > 16);
    }

    proptest! {
        #[test]
        fn sums_are_those_of_the_squares(width in 1..9_usize, height in 1..9_usize, half in 0..4_usize, seed in any::<u64>()) {
            let values: Vec<_> = (0..width * height).map(|k| (seed.wrapping_mul(2 * k as u64 + 1) >> 56) as i32).collect();
            let sums = box_sums(&values, width, half);
            for (k, sum) in sums.iter().enumerate() {
                let (u, v) = ((k % width) as isize, (k / width) as isize);
                let reach = -(half as isize)..=half as isize;
                let at = |u: isize, v: isize| values[v.clamp(0, height as isize - 1) as usize * width + u.clamp(0, width as isize - 1) as usize];
                let expected: i32 = reach.clone().flat_map(|dv| reach.clone().map(move |du| (du, dv))).map(|(du, dv)| at(u + du, v + dv)).sum();
                prop_assert_eq!(*sum, expected);
            }
        }
    }
}

//! Steps tried on the coarse pictures, hundreds a picture: a loop for the processor's vectors finds the cells that are seen, and sums of whole
//! numbers compare them.
use super::contrast::Contrast;
use crate::vectors::widest;
use alloc::vec;
use alloc::vec::Vec;
use nalgebra::{Matrix3, Vector2};

/// 1.5 · 2²³: added to a number it leaves the nearest whole one in the lowest bits.
const WHOLE: f32 = 12_582_912.0;

/// Points of the floor in the first picture: where their rays go, and their contrasts.
pub(super) struct Points {
    rays: [Vec<f32>; 2],
    contrasts: Vec<i8>,
    /// Where they are seen.
    cells: Vec<u32>,
}

impl Points {
    pub(super) fn new(points: impl Iterator<Item = (Vector2<f32>, i8)>) -> Self {
        let (mut x, mut y, mut contrasts) = (Vec::new(), Vec::new(), Vec::new());
        for (ray, contrast) in points {
            x.push(ray.x);
            y.push(ray.y);
            contrasts.push(contrast);
        }
        Self { cells: vec![0; contrasts.len()], rays: [x, y], contrasts }
    }

    /// By how many standard deviations the textures agree better than by chance, where this homography carries rays to cells of the second.
    #[inline(never)] // three callers would have it each in a page's first load; so below
    pub(super) fn agreement(&mut self, homography: &Matrix3<f32>, second: &Contrast) -> f32 {
        let Self { rays: [x, y], contrasts, cells } = self;
        let size = [second.width(), second.height()].map(|side| side as u32);
        widest!(([&x[..], &y[..]], *homography, size, &mut cells[..]), find);
        let values = second.values();
        let (mut product, mut first, mut other_power, mut count) = (0, 0, 0, 0);
        for (contrast, cell) in contrasts.iter().zip(cells) {
            let Some(other) = values.get(*cell as usize) else { continue };
            let [contrast, other] = [*contrast, *other].map(i32::from);
            product += contrast * other;
            first += contrast * contrast;
            other_power += other * other;
            count += 1;
        }
        let power = first as f32 * other_power as f32;
        let enough = count * 4 > contrasts.len() && power > 0.0;
        if enough { product as f32 / libm::sqrtf(power) * libm::sqrtf(count as f32) } else { 0.0 }
    }
}

/// Rays (x, y), the homography, the size of the second picture, and room for the cells.
type Search<'a> = ([&'a [f32]; 2], Matrix3<f32>, [u32; 2], &'a mut [u32]);

/// The cells where rays are seen, row by row; `u32::MAX` for those that are not.
#[inline(always)]
fn find(([x, y], homography, [width, height], cells): Search<'_>) {
    let [[a, d, g], [b, e, h], [c, f, i]] = homography.data.0;
    for ((x, y), cell) in x.iter().zip(y).zip(cells) {
        let depth = g * x + h * y + i;
        let near = 1.0 / depth;
        let whole = |at: f32| (at * near + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits());
        let (column, row) = (whole(a * x + b * y + c), whole(d * x + e * y + f));
        let seen = (depth > 0.0) & (column < width) & (row < height);
        *cell = if seen { row.wrapping_mul(width).wrapping_add(column) } else { u32::MAX };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_seen_in_the_nearest_cells_or_not_at_all() {
        let homography = Matrix3::new(10.0, 0.0, 2.0, 0.0, 10.0, 1.0, 0.0, 1.0, 1.0);
        let found = |x: f32, y: f32| {
            let mut cells = [7];
            find(([&[x], &[y]], homography, [5, 4], &mut cells));
            cells[0]
        };
        assert_eq!([found(0.0, 0.0), found(0.24, 0.0), found(0.26, 0.0)], [7, 9, u32::MAX]);
        assert_eq!([found(-0.24, 0.0), found(-0.26, 0.0)], [5, u32::MAX]);
        assert_eq!(
            [found(0.0, -1.0), found(0.0, -2.0), found(f32::NAN, 0.0), found(1e30, 0.0)],
            [u32::MAX; 4]
        );
        assert_eq!(found(0.0, 0.3), 3 * 5 + 2);
    }
}

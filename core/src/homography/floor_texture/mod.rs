//! Matches on the floor by its texture: where a floor has few keypoints, or mirrors what is above it, its grain still tells the step.
//!
//! ```text
//! c = (mean₃(I) − mean₇(I))/rms₁₃                           contrast: texture without light
//! z(s, θ) = √n Σ c₁ c₂/√(Σ c₁² Σ c₂²)                       c₂ where H(s, θ), the floor's homography of the step, carries the point
//! Σ_p = σ² C⁻¹ (Σ ∇c₂ ∇c₂ᵀ) C⁻¹,   C = Σ ∇c₁ ∇c₂ᵀ          a patch's place; σ²: what its two pictures differ by
//! ```
//!
//! 1. Every step (s, θ) that a robot can make between two pictures is tried on a coarse picture of rays; one stands out, or there is no
//!    floor in view. It must be likelier by far, for neighbouring pixels are not independent: on dev_home and dev_office, which the
//!    bounds were chosen on, wrong steps came to 43 at most. A school and a warehouse, rendered too, were left to judge.
//! 2. Patches all over the floor are sought where that step has them, to a fraction of a pixel: they are matches like those of
//!    keypoints, and [`ground_motion`](super::ground_motion) takes both.
mod coarse;
mod contrast;
mod patch;
mod search;

use super::Match;
use super::planar::PlanarRig;
use crate::geometry::{Camera, RangeFinder};
use crate::image::Grey;
use alloc::vec;
use alloc::vec::Vec;
use contrast::Contrast;
use nalgebra::{Matrix2, Vector2};

/// Focal length of the coarse picture.
const COARSE_FOCAL: f32 = 180.0;
/// Rays that the coarse picture covers at most, to each side.
const WIDEST: f32 = 1.5;
/// Cells of the fine picture at most: a larger picture's are squares of its pixels.
const MOST_CELLS: f32 = 200_000.0;
/// Cells between two patches.
const SPACING: usize = 16;

/// A picture's texture, as [`floor_matches`] takes it.
#[derive(Clone, Debug, PartialEq)]
pub struct FloorTexture {
    fine: Contrast,
    /// Pixels along a fine cell's side.
    side: f32,
    /// Of rays, as a camera without lens distortion sees them.
    coarse: Contrast,
    /// Ray of the coarse picture's first cell.
    first: Vector2<f32>,
}

impl FloorTexture {
    /// The texture of a picture of this camera.
    pub fn new(camera: &Camera<f32>, picture: Grey<'_>) -> Self {
        let pixels = (picture.width() * picture.height()) as f32;
        let side = libm::ceilf(libm::sqrtf(pixels / MOST_CELLS)) as usize;
        let (grey, across) = binned(picture, side);
        let last = Vector2::new(across, grey.len() / across).map(|cells| (cells * side) as f32 - 1.0);
        let [first, end] = widest_rays(camera, last);
        // Each cell of rays is the mean of the fine cells that it covers.
        let half = (camera.focal().x / side as f32 / COARSE_FOCAL * 0.5) as usize;
        let sums = contrast::box_sums(&grey, across, half);
        let end_cell = ((end - first) * COARSE_FOCAL).map(|cells| cells.max(1.0) as usize);
        let rays =
            (0..=end_cell.y).flat_map(|v| (0..=end_cell.x).map(move |u| Vector2::new(u as f32, v as f32)));
        let means = rays.map(|cell| {
            let pixel = camera.pixel_from_ray(first + cell / COARSE_FOCAL).unwrap_or_default();
            let fine = pixel.sup(&Vector2::zeros()).inf(&last).map(|pixel| (pixel + 0.5) as usize / side);
            sums.get(fine.y * across + fine.x).copied().unwrap_or_default() / contrast::area(half) as i32
        });
        let means: Vec<i32> = means.collect();
        let coarse = Contrast::of(&means, end_cell.x + 1);
        Self { fine: Contrast::of(&grey, across), side: side as f32, coarse, first }
    }

    fn pixel(&self, cell: Vector2<f32>) -> Vector2<f32> {
        cell.map(|cell| (cell + 0.5) * self.side - 0.5)
    }

    fn fine_cell(&self, pixel: Vector2<f32>) -> Vector2<f32> {
        pixel.map(|pixel| (pixel + 0.5) / self.side - 0.5)
    }
}

/// The means of squares of so many pixels a side, and how many are in a row; what is left over at the right and below is left out.
fn binned(picture: Grey<'_>, side: usize) -> (Vec<i32>, usize) {
    let rows = picture.pixels().chunks_exact(picture.width());
    if side == 1 {
        return (rows.flatten().map(|grey| i32::from(*grey)).collect(), picture.width());
    }
    let across = picture.width() / side;
    let mut means = vec![0; across * (picture.height() / side)];
    let rows: Vec<_> = rows.collect();
    for (means, rows) in means.chunks_exact_mut(across).zip(rows.chunks_exact(side)) {
        for row in rows {
            for (sum, pixels) in means.iter_mut().zip(row.chunks_exact(side)) {
                *sum += pixels.iter().map(|grey| i32::from(*grey)).sum::<i32>();
            }
        }
        let area = (side * side) as i32;
        means.iter_mut().for_each(|mean| *mean = (*mean + area / 2) / area);
    }
    (means, across)
}

/// Rays of the middles of the picture's edges: the least of x and y, and the largest.
fn widest_rays(camera: &Camera<f32>, last: Vector2<f32>) -> [Vector2<f32>; 2] {
    let middle = last * 0.5;
    let ray = |u, v| camera.ray_from_pixel(Vector2::new(u, v));
    let wide =
        |coordinate: Option<f32>, otherwise: f32| coordinate.unwrap_or(otherwise).clamp(-WIDEST, WIDEST);
    let across =
        [(0.0, -WIDEST), (last.x, WIDEST)].map(|(u, other)| wide(ray(u, middle.y).map(|ray| ray.x), other));
    let down =
        [(0.0, -WIDEST), (last.y, WIDEST)].map(|(v, other)| wide(ray(middle.x, v).map(|ray| ray.y), other));
    let ([left, right], [top, bottom]) = (across, down);
    [Vector2::new(left, top), Vector2::new(right, bottom)]
}

/// Matches on the floor of two pictures of one camera, in pixels, as many as there are patches that are found again: none where no step
/// stands out. Turns are tried round `turn`, as far as `spread` (rad).
pub fn floor_matches(
    finder: &RangeFinder<f32>,
    [first, second]: [&FloorTexture; 2],
    turn: f32,
    spread: f32,
) -> Vec<Match<f32>> {
    let rig = PlanarRig::new(finder);
    let Some(arc) = search::search(finder, &rig, [first, second], turn, spread) else { return Vec::new() };
    let (camera, homography) = (finder.camera(), search::floor_homography(&rig, arc));
    let middle = SPACING / 2;
    let rows = (middle..first.fine.height()).step_by(SPACING);
    let centres = rows.flat_map(|v| {
        (middle..first.fine.width()).step_by(SPACING).map(move |u| Vector2::new(u as f32, v as f32))
    });
    let carried = |cell: Vector2<f32>| {
        let ray = camera.ray_from_pixel(first.pixel(cell))?;
        let seen = super::normal_equations::Transfer::at(&homography, ray)?.point;
        Some(second.fine_cell(camera.pixel_from_ray(seen)?))
    };
    let follow = |cell: Vector2<f32>| {
        let from = first.pixel(cell);
        camera.ray_from_pixel(from).filter(|ray| search::near_floor(&rig, *ray))?;
        let (to, covariance) = patch::follow([&first.fine, &second.fine], cell, carried)?;
        // The first picture's share is a pixel's, or its covariance would be none.
        let own = Matrix2::from_diagonal_element(1e-4);
        Some(Match {
            from,
            to: second.pixel(to),
            from_cov: own,
            to_cov: covariance * (second.side * second.side),
        })
    };
    centres.filter_map(follow).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Mount, Pose};
    use crate::homography::planar::PlanarStep;

    /// With a picture of so many times 320×240 pixels.
    fn finder(times: usize) -> RangeFinder<f32> {
        let [focal, x, y] = [365.0, 160.0, 120.0].map(|length: f32| length * times as f32);
        let camera =
            Camera::new(320 * times, 240 * times, [focal; 2], [x, y], 0.0, Default::default()).unwrap();
        RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap())
    }

    /// A number from −1 to 1 that belongs to a centimetre of a floor.
    fn grain(seed: i64, x: i64, y: i64) -> f32 {
        let mixed =
            (seed * 7_919 + x * 104_729 + y * 1_299_709).wrapping_mul(0x9E37_79B9_7F4A_7C15_u64 as i64);
        ((mixed ^ (mixed >> 29)).wrapping_mul(0x2545_F491_4F6C_DD1D) >> 40 & 0xffff) as f32 / 32_768.0 - 1.0
    }

    /// A floor with a grain of six grey levels and a lamp that it mirrors, from this pose.
    fn seen(finder: &RangeFinder<f32>, seed: i64, pose: &Pose<f32>) -> Vec<u8> {
        let [width, height] = [finder.camera().width(), finder.camera().height()];
        let times = width as f32 / 320.0;
        let pixel = |k: usize| {
            let pixel = Vector2::new((k % width) as f32, (k / width) as f32);
            let lamp = 80.0 * (-(pixel / times - Vector2::new(150.0, 190.0)).norm_squared() / 300.0).exp();
            let Ok(point) = finder.floor_from_pixel(pixel) else { return 200.0 };
            let at = pose.transform(point) * 100.0;
            let (x, y) = (at.x.floor(), at.y.floor());
            let (right, up) = (at.x - x, at.y - y);
            let corner = |dx, dy| grain(seed, x as i64 + dx, y as i64 + dy);
            let [below, above] = [0, 1].map(|dy| corner(0, dy) * (1.0 - right) + corner(1, dy) * right);
            90.0 + lamp + 6.0 * (below * (1.0 - up) + above * up)
        };
        (0..width * height).map(|k| pixel(k) as u8).collect()
    }

    fn matches(
        finder: &RangeFinder<f32>,
        seeds: [i64; 2],
        step: &Pose<f32>,
        turn: f32,
        spread: f32,
    ) -> Vec<Match<f32>> {
        let camera = finder.camera();
        let [from, to] = [(seeds[0], Pose::default()), (seeds[1], *step)].map(|(seed, pose)| {
            let pixels = seen(finder, seed, &pose);
            FloorTexture::new(camera, Grey::new(&pixels, camera.width(), camera.height()).unwrap())
        });
        floor_matches(finder, [&from, &to], turn, spread)
    }

    /// How many of the matches are where the step carries them, within what they say themselves.
    fn right(finder: &RangeFinder<f32>, matches: &[Match<f32>], step: &Pose<f32>) -> usize {
        let near = finder.camera().width() as f32 / 320.0;
        let carried = |pair: &&Match<f32>| {
            let point = step.inverse_transform(finder.floor_from_pixel(pair.from).unwrap());
            let off = finder.pixel_from_floor(point).unwrap() - pair.to;
            off.dot(&(pair.to_cov.try_inverse().unwrap() * off)) < 9.21 && off.norm() < near
        };
        matches.iter().filter(carried).count()
    }

    #[test]
    fn a_faint_grain_gives_matches_on_a_floor_that_mirrors_a_lamp() {
        for (path, turn) in [(0.1, 0.0), (0.25, 0.02), (0.0, 0.2), (-0.08, -0.1)] {
            are_right(&finder(1), path, turn);
        }
    }

    #[test]
    fn a_large_picture_is_taken_in_squares() {
        are_right(&finder(2), 0.1, 0.0);
    }

    fn are_right(finder: &RangeFinder<f32>, path: f32, turn: f32) {
        let step = PlanarStep::new(path, 0.0, turn).pose();
        let found = matches(finder, [1, 1], &step, turn + 0.004, 0.02);
        let right = right(finder, &found, &step);
        assert!(
            found.len() >= 20 && 10 * right >= 9 * found.len(),
            "{right} of {} {path} {turn}",
            found.len()
        );
    }

    #[test]
    fn a_turn_of_which_nothing_is_known_is_found() {
        let step = PlanarStep::new(0.05, 0.0, -0.3).pose();
        assert!(matches(&finder(1), [1, 1], &step, 0.0, 3.0).len() >= 20);
    }

    #[test]
    fn another_floor_gives_none() {
        for seed in 2..8 {
            assert_eq!(matches(&finder(1), [1, seed], &Pose::new(0.1, 0.0, 0.0), 0.0, 0.02), []);
        }
    }
}

//! Seeded samples of matches and the homography of four of them.
#![allow(clippy::indexing_slicing, reason = "every index counts through an array of fixed length")]
use super::Match;
use crate::Real;
use nalgebra::{Matrix3, Vector2};

/// Deterministic random numbers for sampling: PCG32 (O'Neill 2014), integers only, the same on every target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampler {
    state: u64,
}

impl Sampler {
    pub(super) fn new(seed: u64) -> Self {
        let mut sampler = Self { state: seed.wrapping_add(0x9E37_79B9_7F4A_7C15) };
        sampler.next();
        sampler
    }

    fn next(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let shifted = (((old >> 18) ^ old) >> 27) as u32;
        shifted.rotate_right((old >> 59) as u32)
    }

    /// An index below `count` (the bias of the multiplication is count/2³², nothing for a list of matches).
    pub(super) fn below(&mut self, count: usize) -> usize {
        ((u64::from(self.next()) * count as u64) >> 32) as usize
    }

    /// Four different indices below `count`, which is at least 4.
    pub(super) fn four(&mut self, count: usize) -> [usize; 4] {
        let mut chosen = [0; 4];
        for place in 0..4 {
            chosen[place] = loop {
                let index = self.below(count);
                if !chosen[..place].contains(&index) {
                    break index;
                }
            };
        }
        chosen
    }
}

/// The homography of four matches, third component positive at all of them; `None` for a degenerate sample:
/// three points (nearly) on a line in either picture, or an arrangement that no plane seen from one side gives.
///
/// With the fourth points as origins and cᵢ the cross product of the other two points, each plane's projective
/// basis is explicit and M = Σᵢ (c'ᵢ/cᵢ) p'ᵢ (pⱼ × pₖ)ᵀ (Hartley & Zisserman, ch. 2, exercise on projective bases). The signs
/// of cᵢ and c'ᵢ must agree, which rejects most samples that hold a wrong match before any match is scored.
pub(super) fn homography_of_four<T: Real>(sample: &[Match<T>; 4]) -> Option<Matrix3<T>> {
    let [a, b, c, d] = sample;
    let from = Corners::new([a.from, b.from, c.from], d.from);
    let to = Corners::new([a.to, b.to, c.to], d.to);
    let (var_from, var_to) = d.variances();
    if !from.well_spread(var_from) || !to.well_spread(var_to) {
        return None;
    }
    let mut matrix = Matrix3::zeros();
    for (i, (j, k)) in [(1, 2), (2, 0), (0, 1)].into_iter().enumerate() {
        let ratio = to.cross[i] / from.cross[i];
        let same_side = ratio > T::zero();
        if !same_side {
            return None;
        }
        let line = from.points[j].push(T::one()).cross(&from.points[k].push(T::one()));
        matrix += to.points[i].push(T::one()) * line.transpose() * ratio;
    }
    let same_hand = to.area * from.area > T::zero();
    if !same_hand {
        return None;
    }
    if to.area < T::zero() {
        matrix = -matrix;
    }
    // Back to the pictures' own origins: M ← T(d') M T(−d).
    let last = matrix.column(0) * d.from.x + matrix.column(1) * d.from.y;
    matrix.set_column(2, &(matrix.column(2) - last));
    let third = matrix.row(2).into_owned();
    matrix.set_row(0, &(matrix.row(0) + third * d.to.x));
    matrix.set_row(1, &(matrix.row(1) + third * d.to.y));
    Some(matrix)
}

/// Three points relative to a fourth, and the doubled areas of the four triangles.
struct Corners<T> {
    points: [Vector2<T>; 3],
    cross: [T; 3],
    area: T,
}

/// Fewest standard deviations that the third corner of a triangle must stand off the opposite side.
const MIN_ALTITUDE: f64 = 4.0;

impl<T: Real> Corners<T> {
    fn new(points: [Vector2<T>; 3], origin: Vector2<T>) -> Self {
        let points = points.map(|point| point - origin);
        let [a, b, c] = points;
        let cross = [b.perp(&c), c.perp(&a), a.perp(&b)];
        let area = cross[0] + cross[1] + cross[2];
        Self { points, cross, area }
    }

    fn well_spread(&self, variance: T) -> bool {
        let [a, b, c] = self.points;
        let sides = [a, b, c, b - c, c - a, a - b].map(|side| side.norm_squared());
        let longest2 = sides.into_iter().fold(T::zero(), |longest, side| longest.max(side));
        // Exact points still need a base wide enough for the scalar's rounding.
        let altitude2 = variance * T::lit(MIN_ALTITUDE * MIN_ALTITUDE);
        let limit = longest2 * altitude2.max(longest2 * T::lit(1e-6));
        let [ca, cb, cc] = self.cross;
        [ca, cb, cc, self.area].into_iter().all(|doubled_area| doubled_area * doubled_area > limit)
    }
}

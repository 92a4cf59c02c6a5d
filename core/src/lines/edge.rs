use super::fit::EdgeSample;
use super::lens::LensGrid;
use crate::image::GRADIENT_SCALE;
use nalgebra::Vector2;

/// Directions are counted in 256 steps to a turn.
pub(crate) const STEPS: f32 = 256.0;
/// Half a grey level per pixel, as gradients are stored.
const HALF_LEVEL: f32 = GRADIENT_SCALE / 2.0;
/// Strides from one kept point of a steep edge to the next: upright lines are longer than those of the floor, and neighbours' noise is
/// so much alike that every fourth pixel still says 97 % of what all say.
pub(super) const STEEP_STRIDES: usize = 2;
/// Largest sub-pixel offset of a maximum between three samples.
const MAX_OFFSET: f32 = 0.75;

/// A point on an edge: where an ideal camera would see it, and the gradient there. 12 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EdgePoint {
    pub(super) position: Vector2<f32>,
    /// Of the gradient, from dark to bright, in 256ths of a turn from u to v.
    pub(super) direction: u8,
    /// Gradient in half grey levels per pixel.
    pub(super) strength: u8,
    /// Curvature of the logarithm of the gradient's profile across the edge, in 256ths of 1/px².
    pub(super) curvature: u8,
    /// Line that the point belongs to, or one of the values below.
    pub(super) owner: u8,
}

/// The point belongs to no line.
pub(super) const NO_OWNER: u8 = 255;
/// Added to an owner for points too close to a corner to fit lines to.
pub(super) const NEAR_CORNER: u8 = 64;

impl EdgePoint {
    /// Where an ideal camera, without lens distortion, would see the point, in pixels.
    pub fn ideal(&self) -> Vector2<f32> {
        self.position
    }

    /// Which way it gets brighter, in radians from u to v.
    pub fn direction(&self) -> f32 {
        f32::from(self.direction) * (core::f32::consts::TAU / STEPS)
    }
}

impl EdgeSample for EdgePoint {
    fn place(&self) -> Vector2<f32> {
        self.position
    }

    fn gradient(&self) -> f32 {
        0.5 * f32::from(self.strength)
    }

    fn curvature(&self) -> u8 {
        self.curvature
    }
}

/// Gradients of three neighbouring pixels across an edge, as (G_u, G_v).
pub(crate) type Profile = [(i32, i32); 3];

/// The maximum of a gradient profile: sub-pixel offset from the middle sample and curvature of the profile's logarithm.
///
/// Samples are projected on the middle gradient; through their logarithms goes a parabola, which is exact for the
/// Gaussian profile of a blurred step, where a parabola through the samples themselves is off by 0.02 px. The
/// logarithm of a ratio m/s is 2 (m − s)/(m + s) up to its cube over 12.
pub(crate) fn maximum(profile: Profile) -> Option<(f32, f32)> {
    let [before, (u, v), after] = profile;
    let projected = |(a, b): (i32, i32)| (a * u + b * v) as f32; // at most 2 · 16320² < 2³¹
    let middle = projected((u, v));
    let [before, after] = [before, after].map(|sample| {
        // Not `max`: where the processor has none it is a call.
        let (sample, least) = (projected(sample), 0.1 * middle);
        if sample > least { sample } else { least }
    });
    // Both logarithms over the same divisor, (m + before) (m + after)/2.
    let left = (middle - before) * (middle + after);
    let right = (middle - after) * (middle + before);
    let curvature = 2.0 * (left + right) / ((middle + before) * (middle + after));
    let offset = 0.5 * (left - right) / (left + right);
    (curvature > 0.01 && offset.abs() <= MAX_OFFSET).then_some((offset, curvature))
}

/// What a gradient's shorter part over its longer one says.
pub(crate) struct Slope {
    longer: f32,
    ratio: f32,
    /// In 256ths of a turn, off by at most one.
    pub(crate) direction: u8,
}

impl Slope {
    pub(crate) fn new(x: f32, y: f32) -> Self {
        let (longer, shorter) = if x.abs() >= y.abs() { (x.abs(), y.abs()) } else { (y.abs(), x.abs()) };
        let ratio = if longer > 0.0 { shorter / longer } else { 0.0 };
        // atan r ≈ r (π/4 + 0.273 (1 − r)), off by less than 0.22°.
        let eighth = ratio * (32.0 + 11.123 * (1.0 - ratio));
        let quarter = if x.abs() >= y.abs() { eighth } else { 64.0 - eighth };
        let half = if x >= 0.0 { quarter } else { 128.0 - quarter };
        let turn = if y >= 0.0 { half } else { 256.0 - half };
        Self { longer, ratio, direction: (turn + 0.5) as u32 as u8 }
    }

    /// Length of the gradient, off by less than 0.15 %: √(1 + r²) by its parabola in r² through 0, ½ and 1.
    pub(crate) fn length(&self) -> f32 {
        let squared = self.ratio * self.ratio;
        self.longer * (1.0 + squared * (0.484_767 - 0.070_553 * squared))
    }

    /// The square of what is shorter along the gradient than along the axis it is nearest to.
    pub(crate) fn foreshortening(&self) -> f32 {
        1.0 + self.ratio * self.ratio
    }
}

/// A direction in 256ths of a turn, off by at most one.
pub(super) fn steps_from_direction(x: f32, y: f32) -> u8 {
    Slope::new(x, y).direction
}

/// Cosines of the directions of the first quarter of a turn, made when the program is built: the same bits on every target.
#[allow(clippy::indexing_slicing, reason = "a place out of bounds would not build")]
static COSINES: [f32; 65] = {
    let mut cosines = [0.0; 65];
    let mut step = 0;
    while step <= 64 {
        // The Taylor series of the sine of the rest of the quarter turn.
        let angle = (64 - step) as f64 * (core::f64::consts::PI / 128.0);
        let (mut sum, mut term, mut power) = (0.0, angle, 1.0);
        while power < 30.0 {
            sum += term;
            term *= -angle * angle / ((power + 1.0) * (power + 2.0));
            power += 2.0;
        }
        cosines[step] = sum as f32;
        step += 1;
    }
    cosines
};

/// The unit vector of a direction in 256ths of a turn.
#[inline]
pub(crate) fn unit(direction: u8) -> Vector2<f32> {
    let cosine = |step: u8| {
        let from_axis = step.min(step.wrapping_neg());
        let size = COSINES.get(usize::from(from_axis.min(128 - from_axis))).copied().unwrap_or(0.0);
        if from_axis > 64 { -size } else { size }
    };
    Vector2::new(cosine(direction), cosine(direction.wrapping_sub(64)))
}

/// The bookkeeping of a list of edge points that is thinned, not cut, when there are more than fit: the stride
/// doubles and every second point along every edge goes, so that what remains covers the picture evenly.
///
/// Points enter with their position in the picture's pixels, in the order of rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeList {
    /// Points in the list.
    pub(super) len: usize,
    /// Pixels along a flat edge from one kept point to the next; along a steep edge [`STEEP_STRIDES`] times as many.
    pub(super) stride: usize,
    /// Points that were found: `stride` for every one that was kept at the time.
    pub(super) found: u32,
}

impl EdgeList {
    pub(super) fn new() -> Self {
        Self { len: 0, stride: 1, found: 0 }
    }

    /// Adds a point found at a pixel, unless thinning drops it.
    pub(super) fn push(
        &mut self,
        points: &mut [EdgePoint],
        (column, row): (usize, usize),
        steep: bool,
        slope: &Slope,
        (offset, curvature): (f32, f32),
    ) {
        let (u, v) = (column as f32, row as f32);
        let point = EdgePoint {
            position: if steep { Vector2::new(u + offset, v) } else { Vector2::new(u, v + offset) },
            direction: slope.direction,
            strength: (slope.length() / HALF_LEVEL + 0.5) as u8,
            // The samples were taken along an axis; along the normal the profile is narrower by the cosine.
            curvature: (curvature * slope.foreshortening() * 256.0 + 0.5) as u8,
            owner: NO_OWNER,
        };
        while (if steep { self.keeps_row(row) } else { column & (self.stride - 1) == 0 })
            && !points.is_empty()
        {
            if let Some(slot) = points.get_mut(self.len) {
                *slot = point;
                self.len += 1;
                self.found =
                    self.found.saturating_add((if steep { STEEP_STRIDES } else { 1 } * self.stride) as u32);
                return;
            }
            self.thin(points);
        }
    }

    /// The pixels along a flat edge that thinning keeps, of the 32 from column `first` on.
    pub(super) fn kept_columns(&self, first: usize) -> u32 {
        let every = if self.stride < 32 { u32::MAX / ((1 << self.stride) - 1) } else { 1 };
        let offset = first.wrapping_neg() & (self.stride - 1); // a power of two
        if offset < 32 { every << offset } else { 0 }
    }

    /// Whether thinning keeps the points of steep edges in a row.
    pub(super) fn keeps_row(&self, row: usize) -> bool {
        row & (STEEP_STRIDES * self.stride - 1) == 0
    }

    /// Doubles the stride.
    fn thin(&mut self, points: &mut [EdgePoint]) {
        self.stride *= 2;
        let stride = self.stride;
        self.retain(points, |point| {
            // A point on a steep edge lies exactly on a row, one on a flat edge exactly on a column.
            let (x, y) = (point.position.x, point.position.y);
            let (along, stride) =
                if y == (y as u32) as f32 { (y, STEEP_STRIDES * stride) } else { (x, stride) };
            along as usize & (stride - 1) == 0
        });
    }

    /// Moves every point to where an ideal camera would see it; drops those outside the lens model.
    pub(super) fn undistort(&mut self, points: &mut [EdgePoint], lens: &LensGrid<'_>) {
        self.retain(points, |point| {
            let normal = unit(point.direction);
            let tangent = Vector2::new(normal.y, -normal.x);
            let ideal = lens.ideal_from_pixel(point.position, tangent);
            if let Some((position, seen)) = ideal {
                point.position = position;
                // The lens turns by little: the angle is its tangent.
                let turn = tangent.perp(&seen) / tangent.dot(&seen) * (STEPS / core::f32::consts::TAU);
                point.direction = point.direction.wrapping_add((turn + 128.5) as u8).wrapping_sub(128);
            }
            ideal.is_some()
        });
    }

    fn retain(&mut self, points: &mut [EdgePoint], mut keep: impl FnMut(&mut EdgePoint) -> bool) {
        let mut kept = 0;
        for index in 0..self.len {
            let Some(mut point) = points.get(index).copied() else { break };
            if keep(&mut point) {
                if let Some(slot) = points.get_mut(kept) {
                    *slot = point;
                }
                kept += 1;
            }
        }
        self.len = kept;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn directions_are_within_one_step() {
        for step in 0..2560 {
            let angle = step as f32 * core::f32::consts::TAU / 2560.0;
            let steps = f32::from(steps_from_direction(angle.cos() * 7.0, angle.sin() * 7.0));
            let error = (steps - step as f32 / 10.0 + 128.0).rem_euclid(256.0) - 128.0;
            assert!(error.abs() <= 0.7, "{error} steps at {angle} rad");
        }
    }

    #[test]
    fn lengths_are_within_their_bound() {
        for step in 0..2560 {
            let (sin, cos) = (step as f32 * core::f32::consts::TAU / 2560.0).sin_cos();
            let length = Slope::new(cos * 7.0, sin * 7.0).length();
            assert!((length / 7.0 - 1.0).abs() < 0.0015, "{length} at {step}");
        }
    }

    #[test]
    fn columns_that_are_kept_are_multiples_of_the_stride() {
        for stride in [1, 2, 8, 32, 64] {
            let list = EdgeList { stride, ..EdgeList::new() };
            for first in 0..200 {
                let expected = (0..32).filter(|k| (first + k) % stride == 0).map(|k| 1 << k).sum::<u32>();
                assert_eq!(list.kept_columns(first), expected, "stride {stride} from column {first}");
            }
        }
    }

    #[test]
    fn unit_vectors_are_the_nearest_to_their_directions() {
        for step in 0..=255 {
            let angle = f64::from(step) * std::f64::consts::TAU / 256.0;
            let exact = Vector2::new(angle.cos() as f32, angle.sin() as f32);
            assert!((unit(step) - exact).amax() < 1e-7, "{step}");
        }
        assert_eq!((unit(64).x, unit(128).y), (0.0, 0.0));
    }

    #[test]
    fn the_maximum_of_a_gaussian_profile_is_found_within_two_thousandths() {
        for tenth in -5..=5 {
            let offset = tenth as f32 / 10.0;
            let profile = [-1.0_f32, 0.0, 1.0].map(|x| {
                let value = 8000.0 * (-(x - offset).powi(2) / (2.0 * 2.0)).exp();
                ((value * 0.8) as i32, (value * 0.6) as i32)
            });
            let (found, curvature) = maximum(profile).unwrap();
            assert!((found - offset).abs() < 2e-3, "{found} instead of {offset}");
            assert!((curvature - 0.5).abs() < 0.02, "{curvature}");
        }
    }

    #[test]
    fn a_full_list_is_thinned_evenly() {
        let mut points = [EdgePoint::default(); 64];
        let mut list = EdgeList::new();
        for row in 0..200 {
            for column in [10, 50] {
                if list.keeps_row(row) {
                    list.push(&mut points, (column, row), true, &Slope::new(1000.0, 0.0), (0.25, 0.5));
                }
            }
        }
        assert_eq!((list.found, list.stride), (400, 4));
        let rows: Vec<f32> = points[..list.len].iter().step_by(2).map(|p| p.position.y).collect();
        assert_eq!(rows, (0..25).map(|k| k as f32 * 8.0).collect::<Vec<_>>());
        assert!(points[..list.len].iter().all(|p| p.owner == NO_OWNER));
    }
}

use super::lens::LensGrid;
use crate::image::GRADIENT_SCALE;
use nalgebra::Vector2;

/// Directions are counted in 256 steps to a turn.
pub(super) const STEPS: f32 = 256.0;
/// Half a grey level per pixel, as gradients are stored.
const HALF_LEVEL: u32 = GRADIENT_SCALE as u32 / 2;
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

/// Gradients of three neighbouring pixels across an edge, as (G_u, G_v).
pub(super) type Profile = [(i32, i32); 3];

/// The maximum of a gradient profile: sub-pixel offset from the middle sample and curvature of the profile's logarithm.
///
/// Samples are projected on the middle gradient; through their logarithms goes a parabola, which is exact for the
/// Gaussian profile of a blurred step, where a parabola through the samples themselves is off by 0.02 px. The
/// logarithm of a ratio r is 2 (r − 1)/(r + 1) up to (ln r)³/12.
pub(super) fn maximum(profile: Profile) -> Option<(f32, f32)> {
    let [before, (u, v), after] = profile;
    let projected = |(a, b): (i32, i32)| (a * u + b * v) as f32; // at most 2 · 16320² < 2³¹
    let middle = projected((u, v));
    let fall = |sample: f32| {
        // Not `max`: where the processor has none it is a call.
        let least = 0.1 * middle;
        let sample = if sample > least { sample } else { least };
        2.0 * (middle - sample) / (middle + sample)
    };
    let (left, right) = (fall(projected(before)), fall(projected(after)));
    let curvature = left + right;
    let offset = 0.5 * (left - right) / curvature;
    (curvature > 0.01 && offset.abs() <= MAX_OFFSET).then_some((offset, curvature))
}

/// A direction in 256ths of a turn, off by at most one.
pub(super) fn steps_from_direction(x: f32, y: f32) -> u8 {
    let (long, short) = if x.abs() >= y.abs() { (x.abs(), y.abs()) } else { (y.abs(), x.abs()) };
    let ratio = if long > 0.0 { short / long } else { 0.0 };
    // atan r ≈ r (π/4 + 0.273 (1 − r)), off by less than 0.22°.
    let eighth = ratio * (32.0 + 11.123 * (1.0 - ratio));
    let quarter = if x.abs() >= y.abs() { eighth } else { 64.0 - eighth };
    let half = if x >= 0.0 { quarter } else { 128.0 - quarter };
    let turn = if y >= 0.0 { half } else { 256.0 - half };
    (turn + 0.5) as u32 as u8
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
pub(super) fn unit(direction: u8) -> Vector2<f32> {
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
    /// Every how many pixels along its dominant axis an edge keeps a point.
    pub(super) stride: usize,
    /// Points that were found, whether kept or not.
    pub(super) found: u32,
}

impl EdgeList {
    pub(super) fn new() -> Self {
        Self { len: 0, stride: 1, found: 0 }
    }

    /// Whether thinning keeps an edge point at this pixel; counts it either way.
    pub(super) fn wants(
        &mut self,
        (column, row): (usize, usize),
        (gradient_u, gradient_v): (i32, i32),
    ) -> bool {
        self.found = self.found.saturating_add(1);
        let along = if gradient_u.abs() >= gradient_v.abs() { row } else { column };
        along & (self.stride - 1) == 0 // a power of two
    }

    /// Adds the maximum `(offset, curvature)` found across the edge at a pixel with this gradient.
    pub(super) fn push(
        &mut self,
        points: &mut [EdgePoint],
        (column, row): (usize, usize),
        (gradient_u, gradient_v): (i32, i32),
        direction: u8,
        (offset, curvature): (f32, f32),
    ) {
        let steep = gradient_u.abs() >= gradient_v.abs();
        let (u, v) = (column as f32, row as f32);
        let (gu, gv) = (gradient_u as f32, gradient_v as f32);
        let longer = gu.abs().max(gv.abs());
        let length = (gradient_u * gradient_u + gradient_v * gradient_v).unsigned_abs().isqrt();
        // The samples were taken along an axis; along the normal the profile is narrower by the cosine.
        let curvature = curvature * ((gu * gu + gv * gv) / (longer * longer));
        let point = EdgePoint {
            position: if steep { Vector2::new(u + offset, v) } else { Vector2::new(u, v + offset) },
            direction,
            strength: u8::try_from((length + HALF_LEVEL / 2) / HALF_LEVEL).unwrap_or(u8::MAX),
            curvature: (curvature * 256.0 + 0.5) as u8,
            owner: NO_OWNER,
        };
        while (if steep { row } else { column }).is_multiple_of(self.stride) && !points.is_empty() {
            if let Some(slot) = points.get_mut(self.len) {
                *slot = point;
                self.len += 1;
                return;
            }
            self.thin(points);
        }
    }

    /// Doubles the stride.
    fn thin(&mut self, points: &mut [EdgePoint]) {
        self.stride *= 2;
        let stride = self.stride;
        self.retain(points, |point| {
            // A point on a steep edge lies exactly on a row, one on a flat edge exactly on a column.
            let (x, y) = (point.position.x, point.position.y);
            let along = if y == (y as u32) as f32 { y } else { x };
            (along as usize).is_multiple_of(stride)
        });
    }

    /// Moves every point to where an ideal camera would see it; drops those outside the lens model.
    pub(super) fn undistort(&mut self, points: &mut [EdgePoint], lens: &LensGrid<'_>) {
        self.retain(points, |point| {
            let normal = unit(point.direction);
            let tangent = Vector2::new(normal.y, -normal.x);
            let ideal = lens.ideal_from_pixel(point.position, tangent);
            if let Some((position, tangent)) = ideal {
                point.position = position;
                point.direction = steps_from_direction(-tangent.y, tangent.x);
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
                if list.wants((column, row), (1000, 0)) {
                    list.push(&mut points, (column, row), (1000, 0), 0, (0.25, 0.5));
                }
            }
        }
        assert_eq!((list.found, list.stride), (400, 8));
        let rows: Vec<f32> = points[..list.len].iter().step_by(2).map(|p| p.position.y).collect();
        assert_eq!(rows, (0..25).map(|k| k as f32 * 8.0).collect::<Vec<_>>());
        assert!(points[..list.len].iter().all(|p| p.owner == NO_OWNER));
    }
}

use crate::lines::edge::STEPS;
use crate::lines::fit::EdgeSample;
use nalgebra::Vector2;

/// Rows from one point of a steep edge to the next: upright lines are longer than those of the floor, and neighbours' noise is so
/// much alike that every second one says nearly all that all say.
pub(super) const STEEP_STRIDE: usize = 2;
/// Positions are counted in these parts of a pixel.
const PARTS: f32 = 32.0;
/// The point may be on a vertical edge.
pub(super) const VERTICAL: u8 = 1;
/// The point may be on an edge of the floor.
pub(super) const FLOOR: u8 = 2;
/// The point was found in an odd column along a flat edge: neighbours say nearly the same.
pub(super) const SPARE: u8 = 4;

/// A point on an edge: where an ideal camera would see it, and the gradient there. 8 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EdgePoint {
    /// From the principal point, in [`PARTS`] of a pixel.
    x: i16,
    y: i16,
    /// Of the gradient, from dark to bright, in 256ths of a turn from u to v.
    pub(super) direction: u8,
    /// Gradient, by [`strength_code`].
    strength: u8,
    /// Curvature of the logarithm of the gradient's profile across the edge, in 256ths of 1/px².
    pub(super) curvature: u8,
    /// What it may be.
    kinds: u8,
}

/// A gradient in eighths of a grey level per pixel up to 16, in whole levels above.
fn strength_code(gradient: f32) -> u8 {
    let fine = (gradient * 8.0 + 0.5) as u32;
    (if fine < 128 { fine } else { 112 + fine / 8 }).min(255) as u8
}

impl EdgePoint {
    /// A point at a place from the principal point, px; `None` where it is too far from there.
    pub(super) fn new(
        place: Vector2<f32>,
        direction: u8,
        gradient: f32,
        curvature: f32,
        kinds: u8,
    ) -> Option<Self> {
        let [x, y] = [place.x, place.y].map(|at| libm::floorf(at * PARTS + 0.5));
        let limit = f32::from(i16::MAX);
        if !(x.abs() < limit && y.abs() < limit) {
            return None;
        }
        Some(Self {
            x: x as i16,
            y: y as i16,
            direction,
            strength: strength_code(gradient),
            curvature: (curvature * 256.0 + 0.5) as u8,
            kinds,
        })
    }

    /// From the principal point, where an ideal camera would see it, px of the picture searched.
    #[inline]
    pub(super) fn place(&self) -> Vector2<f32> {
        Vector2::new(f32::from(self.x) * (1.0 / PARTS), f32::from(self.y) * (1.0 / PARTS))
    }

    /// The smaller coordinate downwards alone.
    #[inline]
    pub(super) fn down(&self) -> f32 {
        f32::from(self.y) * (1.0 / PARTS)
    }

    /// Grey levels per pixel.
    #[inline]
    pub(super) fn gradient(&self) -> f32 {
        let code = u32::from(self.strength);
        (if code < 128 { code } else { (code - 112) * 8 }) as f32 * 0.125
    }

    /// The gradient's code: larger for stronger ones.
    #[inline]
    pub(super) fn strength(&self) -> u8 {
        self.strength
    }

    /// Whether it may be on an edge of this kind.
    #[inline]
    pub(super) fn is(&self, kind: u8) -> bool {
        self.kinds & kind != 0
    }

    /// Which way it gets brighter, in radians from u to v.
    pub fn direction(&self) -> f32 {
        f32::from(self.direction) * (core::f32::consts::TAU / STEPS)
    }
}

impl EdgeSample for EdgePoint {
    fn place(&self) -> Vector2<f32> {
        Self::place(self)
    }

    fn gradient(&self) -> f32 {
        Self::gradient(self)
    }

    fn curvature(&self) -> u8 {
        self.curvature
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_keeps_place_and_gradient_as_well_as_eight_bytes_can() {
        let place = Vector2::new(-151.237, 88.013);
        for gradient in [0.52, 3.3, 15.7, 16.4, 77.0, 127.0] {
            let point = EdgePoint::new(place, 7, gradient, 0.5, FLOOR).unwrap();
            assert!((point.place() - place).amax() <= 0.5 / PARTS);
            let error = (point.gradient() - gradient).abs();
            assert!(error <= 0.07 || error <= 0.03 * gradient, "{} for {gradient}", point.gradient());
            assert!(point.is(FLOOR) && !point.is(VERTICAL));
        }
        assert!(EdgePoint::new(Vector2::new(1100.0, 0.0), 0, 1.0, 0.5, FLOOR).is_none());
        assert_eq!(size_of::<EdgePoint>(), 8);
    }
}

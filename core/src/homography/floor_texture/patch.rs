//! Where a patch of the floor went, to a fraction of a pixel, with its covariance.
use super::contrast::Contrast;
use nalgebra::{Matrix2, Vector2};

/// A patch's side with its edge, px.
const SIDE: usize = 15;
/// Newton's steps.
const STEPS: usize = 5;
/// Pixels by which a step no longer matters.
const SETTLED: f32 = 0.03;
/// Pixels by which a patch is away from where the step has it, at most: what an error of the mount may do.
const MOST: f32 = 2.0;
/// Correlation of the two at least.
const ALIKE: f32 = 0.5;
/// Neighbouring pixels share their noise, since they were averaged over 3×3.
const SHARED: f32 = 9.0;
/// Variance of a patch's place at least, px².
const LEAST: f32 = 0.01;

/// Where the patch round `from` is, near where the step carries it, and the covariance of that in the second picture.
pub(super) fn follow(
    [first, second]: [&Contrast; 2],
    from: Vector2<f32>,
    carried: impl Fn(Vector2<f32>) -> Option<Vector2<f32>>,
) -> Option<(Vector2<f32>, Matrix2<f32>)> {
    let carried = Carried::of(|offset| carried(from + offset))?;
    let (to, by_from) = (carried.middle, carried.slope);
    let before = Window::filled(|offset| first.nearest(from + offset))?;
    let mut shift = Vector2::zeros();
    for step in 0..STEPS {
        let moved = by_from * shift;
        let now = Window::filled(|offset| second.between(carried.at(offset) + moved))?;
        let (mut both, mut own, mut push) = (Matrix2::zeros(), Matrix2::zeros(), Vector2::zeros());
        let (mut product, mut power, mut other_power) = (0.0, 0.0, 0.0);
        for ((value, slope), (other, other_slope)) in before.inside().zip(now.inside()) {
            both += slope * other_slope.transpose();
            own += other_slope * other_slope.transpose();
            push += other_slope * (value - other);
            product += value * other;
            power += value * value;
            other_power += other * other;
        }
        // The two pictures' noise is not the same, so that it is not taken for texture.
        let information = (both + both.transpose()) * 0.5;
        let is_textured = information.m11 > 0.0 && information.determinant() > 0.0;
        let inverse = information.try_inverse().filter(|_| is_textured)?;
        let change = inverse * push;
        if step + 1 == STEPS || change.norm() < SETTLED {
            let alike = product / libm::sqrtf(power * other_power);
            let count = (SIDE - 2) * (SIDE - 2);
            let noise = (power + other_power - product * 2.0) / count as f32 * SHARED;
            let covariance = inverse * own * inverse * noise + Matrix2::from_diagonal_element(LEAST);
            let sound = alike > ALIKE && covariance.trace() < MOST * MOST;
            return sound.then(|| (to + by_from * shift, by_from * covariance * by_from.transpose()));
        }
        shift += change;
        let near = shift.norm() < MOST;
        if !near {
            return None;
        }
    }
    None
}

/// Where a step carries a patch's pixels, to the second order: the first alone puts its middle a fiftieth of a pixel off, which is a thousandth
/// of the step, the same way in every patch.
struct Carried {
    middle: Vector2<f32>,
    slope: Matrix2<f32>,
    /// Half the second derivatives: along u, along v, and both.
    bend: [Vector2<f32>; 3],
}

impl Carried {
    fn of(carried: impl Fn(Vector2<f32>) -> Option<Vector2<f32>>) -> Option<Self> {
        let reach = (SIDE / 2) as f32;
        let at = |u: f32, v: f32| carried(Vector2::new(u, v) * reach);
        let middle = at(0.0, 0.0)?;
        let (right, left, below, above) = (at(1.0, 0.0)?, at(-1.0, 0.0)?, at(0.0, 1.0)?, at(0.0, -1.0)?);
        let mixed = at(1.0, 1.0)? + at(-1.0, -1.0)? - at(1.0, -1.0)? - at(-1.0, 1.0)?;
        let slope = Matrix2::from_columns(&[right - left, below - above]) / (2.0 * reach);
        let twice = 2.0 * reach * reach;
        let bend = [
            (right + left - middle * 2.0) / twice,
            (below + above - middle * 2.0) / twice,
            mixed / (2.0 * twice),
        ];
        Some(Self { middle, slope, bend })
    }

    fn at(&self, offset: Vector2<f32>) -> Vector2<f32> {
        let [along_u, along_v, both] = self.bend;
        self.middle
            + self.slope * offset
            + along_u * (offset.x * offset.x)
            + along_v * (offset.y * offset.y)
            + both * (offset.x * offset.y)
    }
}

/// A patch's contrast, with the edge that its slopes need.
struct Window([f32; SIDE * SIDE]);

impl Window {
    fn filled(contrast: impl Fn(Vector2<f32>) -> Option<f32>) -> Option<Self> {
        let mut window = [0.0; SIDE * SIDE];
        let middle = (SIDE / 2) as f32;
        for (row, v) in window.chunks_exact_mut(SIDE).zip(0..) {
            for (value, u) in row.iter_mut().zip(0..) {
                *value = contrast(Vector2::new(u as f32 - middle, v as f32 - middle))?;
            }
        }
        Some(Self(window))
    }

    /// Contrasts and their slopes.
    fn inside(&self) -> impl Iterator<Item = (f32, Vector2<f32>)> {
        let rows = self.0.chunks_exact(SIDE);
        let triples = rows.clone().zip(rows.clone().skip(1)).zip(rows.skip(2));
        triples.flat_map(move |((above, row), below)| {
            let [above, below] = [above, below].map(|row| row.iter().skip(1));
            let inner = row.windows(3).zip(above).zip(below);
            inner.filter_map(|((row, above), below)| {
                let [left, value, right] = row else { return None };
                Some((*value, Vector2::new(right - left, below - above) * 0.5))
            })
        })
    }
}

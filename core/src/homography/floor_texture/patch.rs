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

/// Where the patch round `from` is, near `to`, and the covariance of that in the second picture; `by_from` turns the first picture's
/// differences into the second's.
pub(super) fn follow(
    [first, second]: [&Contrast; 2],
    from: Vector2<f32>,
    to: Vector2<f32>,
    by_from: &Matrix2<f32>,
) -> Option<(Vector2<f32>, Matrix2<f32>)> {
    let before = Window::filled(|offset| first.nearest(from + offset))?;
    let mut shift = Vector2::zeros();
    for step in 0..STEPS {
        let now = Window::filled(|offset| second.between(to + by_from * (offset + shift)))?;
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

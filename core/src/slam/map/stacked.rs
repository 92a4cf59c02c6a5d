//! Pairs as the joint search sees them: one stacked measurement, and how its parts are correlated.
use crate::Real;
use crate::association::Correlated;
use crate::slam::covariance::Rows;
use crate::slam::covariance::packed;
use crate::slam::filter::Filter;
use crate::slam::landmark::Landmark;
use nalgebra::{Matrix2, Vector2};

/// Robot and mount, in which all pairs meet.
const SHARED: usize = 7;

/// What is known of a pair; a frame has up to [`MAX_JOINT_CANDIDATES`](crate::association::MAX_JOINT_CANDIDATES) of them
/// on the stack.
pub(super) struct Pair<T> {
    pub(super) innovation: Vector2<T>,
    pub(super) noise: Matrix2<T>,
    /// n ln 2π + 2 ln(λ |∂l/∂z|).
    pub(super) offset: T,
    /// H.
    pub(super) rows: Rows<T>,
}

/// A pair with what the search asks for again and again.
pub(super) struct Stacked<T> {
    pair: Pair<T>,
    /// H P Hᵀ + R.
    covariance: Matrix2<T>,
    /// The first rows of P Hᵀ.
    shared: [[T; 2]; SHARED],
}

impl<T: Real> Stacked<T> {
    pub(super) fn new<S, L>(filter: &Filter<T, S, L>, pair: Pair<T>) -> Self
    where
        S: AsRef<[T]> + AsMut<[T]>,
        L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>,
    {
        let shared = core::array::from_fn(|row| filter.times_row(row, &pair.rows));
        Self { covariance: filter.cross(&pair.rows) + pair.noise, shared, pair }
    }
}

pub(super) struct Pairs<'a, T, S, L> {
    pub(super) pairs: &'a [Stacked<T>],
    pub(super) filter: &'a Filter<T, S, L>,
}

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Correlated<T>
    for Pairs<'_, T, S, L>
{
    fn innovation(&self, candidate: usize) -> Vector2<T> {
        self.pairs.get(candidate).map_or_else(Vector2::zeros, |one| one.pair.innovation)
    }

    fn covariance(&self, left: usize, right: usize) -> Matrix2<T> {
        let (Some(a), Some(b)) = (self.pairs.get(left), self.pairs.get(right)) else {
            return Matrix2::zeros();
        };
        if left == right {
            return a.covariance;
        }
        let times_row = |row: usize| {
            b.shared.get(row).copied().unwrap_or_else(|| self.filter.times_row(row, &b.pair.rows))
        };
        packed::cross(&a.pair.rows, times_row)
    }

    fn noise(&self, candidate: usize) -> Matrix2<T> {
        self.pairs.get(candidate).map_or_else(Matrix2::zeros, |one| one.pair.noise)
    }

    fn offset(&self, candidate: usize) -> T {
        self.pairs.get(candidate).map_or(T::zero(), |one| one.pair.offset)
    }
}

//! Pairs as the joint search sees them: one stacked measurement, and how its parts are correlated.
use super::frame::Candidates;
use super::{Map, MapConfig};
use crate::Real;
use crate::association::{
    Candidate, Correlated, JointResult, MAX_JOINT_CANDIDATES, joint_compatibility, sort_for_search,
};
use crate::slam::covariance::Rows;
use crate::slam::covariance::packed;
use crate::slam::filter::Filter;
use crate::slam::landmark::Landmark;
use nalgebra::{Matrix2, Vector2};

/// Robot and mount, in which all pairs meet.
const SHARED: usize = 7;

/// A pair, linearised; a frame has up to [`MAX_JOINT_CANDIDATES`] of them
/// on the stack.
#[derive(Clone)]
pub(super) struct Pair<T> {
    /// Which measurement, or landmark seen, and which landmark: their indices.
    pub(super) of: (usize, usize),
    pub(super) innovation: Vector2<T>,
    pub(super) noise: Matrix2<T>,
    /// n ln 2π + 2 ln(λ |∂l/∂z|).
    pub(super) offset: T,
    /// H.
    pub(super) rows: Rows<T>,
}

/// A candidate's, where it was kept.
pub(super) fn linear<'a, T>(pairs: &'a [Pair<T>], candidate: &Candidate<T>) -> Option<&'a Pair<T>> {
    pairs.iter().find(|pair| pair.of == (candidate.observation, candidate.landmark))
}

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Map<T, S, L> {
    /// The likeliest set of at most [`MAX_JOINT_CANDIDATES`] candidates, which come back in the order of the search.
    pub(super) fn search(&self, candidates: &mut Candidates<T>) -> JointResult {
        let Candidates { list, linear: pairs, .. } = candidates;
        sort_for_search(list);
        // One after the other into its place: as a whole the list is too long to be moved on a microcontroller's stack.
        let mut stacked = heapless::Vec::<_, MAX_JOINT_CANDIDATES>::new();
        for pair in list.iter().filter_map(|candidate| linear(pairs, candidate)) {
            let _ = stacked.push(Stacked::new(&self.filter, pair)); // there are no more
        }
        let correlated = Pairs { pairs: &stacked, filter: &self.filter };
        let MapConfig { joint_nodes, ambiguity, caution, .. } = self.config;
        joint_compatibility(list, &correlated, joint_nodes, ambiguity, caution)
    }
}

/// A pair with what the search asks for again and again.
struct Stacked<'a, T> {
    pair: &'a Pair<T>,
    /// H P Hᵀ + R.
    covariance: Matrix2<T>,
    /// The first rows of P Hᵀ.
    shared: [[T; 2]; SHARED],
}

impl<'a, T: Real> Stacked<'a, T> {
    fn new<S, L>(filter: &Filter<T, S, L>, pair: &'a Pair<T>) -> Self
    where
        S: AsRef<[T]> + AsMut<[T]>,
        L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>,
    {
        let shared = core::array::from_fn(|row| filter.times_row(row, &pair.rows));
        Self { covariance: filter.cross(&pair.rows) + pair.noise, shared, pair }
    }
}

struct Pairs<'a, T, S, L> {
    pairs: &'a [Stacked<'a, T>],
    filter: &'a Filter<T, S, L>,
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

//! Which of several landmarks a frame's measurements are of: exclusive nearest, and joint compatibility.
//!
//! A measurement may lie in the gates of several landmarks, and landmarks in the gates of several measurements.
//! *Exclusive nearest* takes pairs in the order of their cost ν ᵀS⁻¹ν + ln|S| (twice the negative logarithm of the
//! likelihood), each measurement and each landmark once. *Joint compatibility* (Neira and Tardós, 2001) asks more:
//! that all pairs together fit one error of the robot's pose. With the stacked innovation ν and its covariance S,
//!
//! ```text
//! νᵀ S⁻¹ ν ≤ χ²(Σ degrees of freedom)
//! ```
//!
//! and among the sets that fit, the largest, and among those the likeliest, wins. S is factored as the search goes
//! down, one block row a pair, so a step costs O(pairs²). The search is bounded: it visits at most a given number of
//! nodes and keeps the best set found, which is never worse than the one greedy descent finds first.
#![allow(
    clippy::indexing_slicing,
    reason = "kernel: indices are bounded by MAX_PAIRS and the candidates' length"
)]
use super::gate::{cholesky, forward};
use crate::Real;
use crate::sort::sort_by_key;
use nalgebra::{Matrix2, Vector2};

/// Measurements that one joint search pairs.
pub const MAX_PAIRS: usize = 16;
/// Pairs of measurement and landmark that one frame considers.
pub const MAX_CANDIDATES: usize = 128;

/// A measurement that lies in the gate of a landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate<T> {
    /// Index of the measurement.
    pub observation: usize,
    /// Index of the landmark.
    pub landmark: usize,
    /// νᵀS⁻¹ν + ln|S|.
    pub cost: T,
    /// Degrees of freedom.
    pub dof: usize,
}

/// What the joint search must know about pairs: their innovations, and how they are correlated.
pub trait Correlated<T> {
    /// ν of a candidate.
    fn innovation(&self, candidate: usize) -> Vector2<T>;
    /// The block of S between two candidates: H P Hᵀ, and R added where they are the same.
    fn covariance(&self, left: usize, right: usize) -> Matrix2<T>;
}

/// Keeps, in place, the exclusive nearest candidates; `candidates` comes back sorted by measurement.
pub fn exclusive_nearest<T: Real>(candidates: &mut heapless::Vec<Candidate<T>, MAX_CANDIDATES>) {
    sort_by_key(candidates, |pair| (pair.cost, pair.observation, pair.landmark));
    let mut kept = 0;
    for index in 0..candidates.len() {
        let next = candidates[index];
        let free =
            |pair: &Candidate<T>| pair.observation != next.observation && pair.landmark != next.landmark;
        if candidates[..kept].iter().all(free) {
            candidates[kept] = next;
            kept += 1;
        }
    }
    candidates.truncate(kept);
    sort_by_key(candidates, |pair| pair.observation);
}

/// Sorts by measurement, and those of one measurement by cost: the first descent of a joint search is then the greedy one.
pub(crate) fn sort_for_search<T: Real>(candidates: &mut [Candidate<T>]) {
    sort_by_key(candidates, |pair| (pair.observation, pair.cost, pair.landmark));
}

/// A set of pairs.
#[derive(Clone, Debug, Default)]
pub struct JointResult {
    /// Indices of the chosen candidates.
    pub chosen: heapless::Vec<usize, MAX_PAIRS>,
    /// Whether the search ended before it had looked everywhere.
    pub truncated: bool,
    /// Pairs of the best set that were left out as ambiguous.
    pub ambiguous: usize,
}

/// The largest jointly compatible set of candidates within a budget of `nodes`.
///
/// `candidates` must be sorted by measurement. A pair is left out as ambiguous when its measurement could be of
/// another free landmark at a joint cost that is less than `ambiguity` higher (2 ln of the ratio of likelihoods): a
/// wrong pair costs the map, a missed one only its information.
pub fn joint_compatibility<T: Real>(
    candidates: &[Candidate<T>],
    correlated: &impl Correlated<T>,
    nodes: usize,
    ambiguity: T,
) -> JointResult {
    let mut search = Search {
        candidates,
        correlated,
        root: [[T::zero(); 2]; ROWS * MAX_PAIRS],
        whitened: [Vector2::zeros(); MAX_PAIRS],
        path: heapless::Vec::new(),
        best: heapless::Vec::new(),
        best_cost: T::zero(),
        nodes,
    };
    search.descend(0, T::zero(), T::zero(), 0);
    let truncated = search.nodes == 0;
    let mut chosen = search.best.clone();
    chosen.retain(|index| !search.ambiguous(*index, ambiguity));
    JointResult { truncated, ambiguous: search.best.len() - chosen.len(), chosen }
}

/// Rows of the factor, a block of 2 × 2 each: two scalar rows a pair.
const ROWS: usize = 2 * MAX_PAIRS;

struct Search<'a, T, C> {
    candidates: &'a [Candidate<T>],
    correlated: &'a C,
    /// L of S by blocks: row `pair`, block `other` at [2·(pair·MAX_PAIRS + other)], two scalar rows.
    root: [[T; 2]; ROWS * MAX_PAIRS],
    whitened: [Vector2<T>; MAX_PAIRS],
    path: heapless::Vec<usize, MAX_PAIRS>,
    best: heapless::Vec<usize, MAX_PAIRS>,
    best_cost: T,
    nodes: usize,
}

impl<T: Real, C: Correlated<T>> Search<'_, T, C> {
    fn descend(&mut self, from: usize, nis: T, cost: T, dof: usize) {
        let better = self.path.len() > self.best.len()
            || (self.path.len() == self.best.len() && !self.path.is_empty() && cost < self.best_cost);
        if better {
            self.best.clone_from(&self.path);
            self.best_cost = cost;
        }
        let Some(next) = self.candidates.get(from) else { return };
        if self.path.is_full() || self.path.len() + self.observations_left(from) < self.best.len() {
            return;
        }
        let observation = next.observation;
        let group = self.candidates[from..].iter().take_while(|pair| pair.observation == observation).count();
        for index in from..from + group {
            let pair = self.candidates[index];
            if self.path.iter().any(|chosen| self.candidates[*chosen].landmark == pair.landmark) {
                continue;
            }
            if self.nodes == 0 {
                return;
            }
            self.nodes -= 1;
            let Some((step, log_determinant)) = self.extend(index) else { continue };
            let (total, freedom) = (nis + step, dof + pair.dof);
            if total > chi2_99(freedom) || self.path.push(index).is_err() {
                continue;
            }
            self.descend(from + group, total, cost + step + log_determinant, freedom);
            self.path.pop();
        }
        // Without this measurement, while that can still win.
        if self.path.len() + self.observations_left(from + group) >= self.best.len() {
            self.descend(from + group, nis, cost, dof);
        }
    }

    /// Whether a chosen pair's measurement could as well be of another landmark that no other measurement has.
    fn ambiguous(&mut self, chosen: usize, margin: T) -> bool {
        let best = self.best.clone();
        let observation = self.candidates[chosen].observation;
        for (index, other) in self.candidates.iter().enumerate() {
            let taken = best.iter().any(|pair| self.candidates[*pair].landmark == other.landmark);
            if other.observation != observation || taken {
                continue;
            }
            let swapped = best.iter().map(|pair| if *pair == chosen { index } else { *pair });
            if self.cost_of(swapped).is_some_and(|cost| cost < self.best_cost + margin) {
                return true;
            }
        }
        false
    }

    /// The joint cost of a set, `None` where it is not jointly compatible.
    fn cost_of(&mut self, set: impl Iterator<Item = usize>) -> Option<T> {
        self.path.clear();
        let (mut nis, mut cost, mut dof) = (T::zero(), T::zero(), 0);
        for index in set {
            let (step, log_determinant) = self.extend(index)?;
            (nis, cost, dof) = (nis + step, cost + step + log_determinant, dof + self.candidates[index].dof);
            self.path.push(index).ok()?;
        }
        (nis <= chi2_99(dof)).then_some(cost)
    }

    fn observations_left(&self, from: usize) -> usize {
        let rest = &self.candidates[from..];
        let changes = rest.iter().zip(rest.iter().skip(1)).filter(|(a, b)| a.observation != b.observation);
        changes.count() + usize::from(!rest.is_empty())
    }

    fn block(&self, row: usize, column: usize) -> Matrix2<T> {
        let at = 2 * (row * MAX_PAIRS + column);
        let ([a, b], [c, d]) = (self.root[at], self.root[at + 1]);
        Matrix2::new(a, b, c, d)
    }

    /// Appends a block row to L for the candidate; its share of νᵀS⁻¹ν and of ln|S|.
    fn extend(&mut self, index: usize) -> Option<(T, T)> {
        let row = self.path.len();
        let mut own = self.correlated.covariance(index, index);
        let mut innovation = self.correlated.innovation(index);
        for column in 0..row {
            let mut block = self.correlated.covariance(index, self.path[column]);
            for before in 0..column {
                block -= self.block(row, before) * self.block(column, before).transpose();
            }
            // X Lᵀ = block, with the lower triangular L of the column's own block.
            let own_root = self.block(column, column);
            let (l11, l21, l22) = (own_root.m11, own_root.m21, own_root.m22);
            let solve = |x: T, y: T| {
                let first = x / l11;
                [first, (y - first * l21) / l22]
            };
            let at = 2 * (row * MAX_PAIRS + column);
            self.root[at] = solve(block.m11, block.m12);
            self.root[at + 1] = solve(block.m21, block.m22);
            let block = self.block(row, column);
            own -= block * block.transpose();
            innovation -= block * self.whitened[column];
        }
        let root = cholesky(&own)?;
        let whitened = forward(&root, &innovation);
        let at = 2 * (row * MAX_PAIRS + row);
        self.root[at] = [root[0], T::zero()];
        self.root[at + 1] = [root[1], root[2]];
        self.whitened[row] = whitened;
        let log_determinant = T::lit(2.0) * (root[0] * root[2]).ln();
        Some((whitened.norm_squared(), log_determinant))
    }
}

/// χ² at 0.99 by Wilson and Hilferty's cube: within 0.5 % from 2 degrees of freedom on.
fn chi2_99<T: Real>(dof: usize) -> T {
    if let Some(exact) = dof.checked_sub(1).and_then(|at| super::CHI2_99.get(at)) {
        return T::lit(*exact);
    }
    let share = T::lit(2.0 / (9.0 * dof as f64));
    let root = T::one() - share + T::lit(2.326_348) * share.sqrt();
    T::lit(dof as f64) * root * root * root
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Measurements of a line of landmarks by a robot whose own position is uncertain: all innovations share it.
    struct Line {
        innovations: [f64; 4],
        shared: f64,
        own: f64,
    }

    impl Correlated<f64> for Line {
        fn innovation(&self, candidate: usize) -> Vector2<f64> {
            Vector2::new(self.innovations[candidate], 0.0)
        }
        fn covariance(&self, left: usize, right: usize) -> Matrix2<f64> {
            let own = if left == right { self.own } else { 0.0 };
            Matrix2::new(self.shared + own, 0.0, 0.0, if left == right { 1.0 } else { 0.0 })
        }
    }

    fn pair(observation: usize, landmark: usize, cost: f64) -> Candidate<f64> {
        Candidate { observation, landmark, cost, dof: 1 }
    }

    #[test]
    fn a_shared_error_is_followed_where_each_nearest_is_wrong() {
        // Landmarks at 0 and 1; the robot is off by 0.9. Measurement 0 (of landmark 0) lies at 0.9: nearest is
        // landmark 1 (−0.1), but then measurement 1, at 1.9, has only an error of 0.9 against landmark 1 to offer.
        let candidates = [pair(0, 1, 0.01), pair(0, 0, 0.81), pair(1, 1, 0.81)];
        let line = Line { innovations: [-0.1, 0.9, 0.9, 0.0], shared: 1.0, own: 0.001 };
        let result = joint_compatibility(&candidates, &line, 100, 0.0);
        assert_eq!(&result.chosen[..], &[1, 2]);
        assert!(!result.truncated);
        let mut nearest = heapless::Vec::from_slice(&candidates).unwrap();
        exclusive_nearest(&mut nearest);
        assert_eq!(&nearest[..], &[pair(0, 1, 0.01)]);
    }

    #[test]
    fn a_pair_that_does_not_fit_the_others_is_left_out() {
        let candidates = [pair(0, 0, 0.8), pair(1, 1, 0.8), pair(2, 2, 0.8)];
        let line = Line { innovations: [0.9, 0.9, -0.9, 0.0], shared: 1.0, own: 0.001 };
        assert_eq!(&joint_compatibility(&candidates, &line, 100, 0.0).chosen[..], &[0, 1]);
    }

    #[test]
    fn a_spent_budget_is_reported() {
        let candidates = [pair(0, 0, 0.8), pair(1, 1, 0.8), pair(2, 2, 0.8)];
        let line = Line { innovations: [0.9, 0.9, -0.9, 0.0], shared: 1.0, own: 0.001 };
        let result = joint_compatibility(&candidates, &line, 2, 0.0);
        assert!(result.truncated);
        assert_eq!(&result.chosen[..], &[0, 1]);
    }

    #[test]
    fn the_gate_grows_with_the_degrees_of_freedom_as_chi_squared_does() {
        for (dof, expected) in [(1, 6.635), (2, 9.210), (4, 13.277), (10, 23.209), (32, 53.486)] {
            assert!((chi2_99::<f64>(dof) / expected - 1.0).abs() < 0.005);
        }
    }
}

//! Which of several landmarks a frame's measurements are of: exclusive nearest, and joint compatibility.
//!
//! A measurement may lie in the gates of several landmarks, and landmarks in the gates of several measurements; and
//! it may be of a landmark that is not in the map at all. The cost of a pair is twice the negative logarithm of its
//! likelihood, ν ᵀS⁻¹ν + ln|S|, less that of a landmark not yet mapped, so that 0 is as likely as a new one:
//!
//! ```text
//! c = ν ᵀS⁻¹ν + ln|S| + n ln 2π + 2 ln(λ |∂l/∂z|)        λ: new landmarks a square metre, n: dimension of z
//! ```
//!
//! Where the pose is uncertain S is large and the cost is high however small ν is: anything would have fitted.
//!
//! *Exclusive nearest* takes pairs in the order of their cost, each measurement and each landmark once. *Joint
//! compatibility* (after Neira and Tardós, 2001) asks that all pairs together fit one error of the robot's pose: with
//! the stacked innovation ν and its covariance S of a whole set,
//!
//! ```text
//! νᵀ S⁻¹ ν ≤ χ²(Σ degrees of freedom)
//! ```
//!
//! so that pairs which are each beyond their own gate fit where all share one error, as when a wheel slipped,
//! and of the sets that fit, the likeliest wins (not the largest, as in the original: a landmark that was never mapped
//! would be forced upon one that was). Then every other set that is nearly as likely is looked at: a pair that one of
//! them does without is *ambiguous* and left out. Weak pairs, the usual ones when a
//! loop closes, are left out unless together they lower the cost by `ambiguity`. A wrong pair costs the map, a missed one only
//! its information.
//!
//! S is factored as the search goes down, one block row a pair, so a step costs O(pairs²). The search is bounded: a
//! branch ends where even a perfect fit of all that is left could not win (S of a pair is never below its R), it
//! visits at most a given number of nodes, and keeps the best set found, which is never worse than greedy descent's.
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
/// Pairs among which one joint search looks.
pub const MAX_JOINT_CANDIDATES: usize = 48;

/// A measurement that lies in the gate of a landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate<T> {
    /// Index of the measurement.
    pub observation: usize,
    /// Index of the landmark.
    pub landmark: usize,
    /// How much less likely than the others, of which only the order counts; or the cost of the module page.
    pub cost: T,
    /// νᵀS⁻¹ν of the pair by itself.
    pub nis: T,
    /// Degrees of freedom.
    pub dof: usize,
}

/// What the joint search must know about pairs: their innovations, and how they are correlated.
pub trait Correlated<T> {
    /// ν of a candidate.
    fn innovation(&self, candidate: usize) -> Vector2<T>;
    /// The block of S between two candidates: H P Hᵀ, and R added where they are the same.
    fn covariance(&self, left: usize, right: usize) -> Matrix2<T>;
    /// R of a candidate.
    fn noise(&self, candidate: usize) -> Matrix2<T>;
    /// What its cost has beside νᵀS⁻¹ν + ln|S|: n ln 2π + 2 ln(λ |∂l/∂z|).
    fn offset(&self, candidate: usize) -> T;
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

/// The surest measurement's candidates first, and each measurement's in the order of their cost: the first descent of a
/// joint search is then the greedy one. For at most [`MAX_PAIRS`] measurements; those beyond come last.
pub(crate) fn sort_for_search<T: Real>(candidates: &mut [Candidate<T>]) {
    let mut least = heapless::Vec::<(usize, T), MAX_PAIRS>::new();
    for pair in candidates.iter() {
        match least.iter_mut().find(|(observation, _)| *observation == pair.observation) {
            Some((_, cost)) => *cost = cost.min(pair.cost),
            None => {
                let _ = least.push((pair.observation, pair.cost)); // beyond the capacity: last
            }
        }
    }
    sort_by_key(candidates, |pair| {
        let surest = least.iter().find(|(observation, _)| *observation == pair.observation);
        let least = surest.map_or(T::zero(), |(_, cost)| *cost);
        (surest.is_none(), least, pair.observation, pair.cost, pair.landmark)
    });
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

/// The likeliest jointly compatible set of candidates within a budget of `nodes`, without its ambiguous pairs.
///
/// `candidates` must be grouped by measurement, the surest measurements first; those beyond
/// [`MAX_JOINT_CANDIDATES`] are not looked at. A pair is ambiguous when a set without
/// it, which pairs some measurement otherwise, costs less than `ambiguity` more; and so are the pairs that are not cheaper
/// than a new landmark by `caution` each by itself, unless together they make the set cheaper by `ambiguity`.
pub fn joint_compatibility<T: Real>(
    candidates: &[Candidate<T>],
    correlated: &impl Correlated<T>,
    nodes: usize,
    ambiguity: T,
    caution: T,
) -> JointResult {
    // Beside the search: within, it would be on a microcontroller's stack twice.
    let mut root = [[T::zero(); 2]; 2 * BLOCKS];
    let mut search = Search {
        candidates,
        correlated,
        root: &mut root,
        whitened: [Vector2::zeros(); MAX_PAIRS],
        floor: heapless::Vec::new(),
        freedom: heapless::Vec::new(),
        path: heapless::Vec::new(),
        best: heapless::Vec::new(),
        best_cost: T::zero(),
        margin: None,
        rivalled: [false; MAX_PAIRS],
        nodes,
    };
    search.bound();
    search.descend(0, T::zero(), T::zero(), 0);
    let mut truncated = search.nodes == 0;
    if candidates.len() > search.best.len() && !search.best.is_empty() {
        (search.margin, search.nodes) = (Some(ambiguity), nodes);
        search.descend(0, T::zero(), T::zero(), 0);
        if search.nodes == 0 {
            truncated = true;
            search.doubt_all_with_rivals();
        }
    }
    search.keep_the_sure_unless_the_rest_agrees(ambiguity, caution);
    let pairs = search.best.iter().zip(search.rivalled);
    let chosen =
        pairs.filter(|(_, rivalled)| !rivalled).map(|(index, _)| *index).collect::<heapless::Vec<_, _>>();
    JointResult { truncated, ambiguous: search.best.len() - chosen.len(), chosen }
}

/// Blocks of 2 × 2 in the lower triangle of the factor.
const BLOCKS: usize = MAX_PAIRS * (MAX_PAIRS + 1) / 2;

/// Where a block of the packed lower triangle begins, in scalar rows.
fn block_at(row: usize, column: usize) -> usize {
    row * (row + 1) + 2 * column
}

struct Search<'a, T, C> {
    candidates: &'a [Candidate<T>],
    correlated: &'a C,
    /// L of S by blocks of two scalar rows each, the lower triangle row by row: see [`block_at`].
    root: &'a mut [[T; 2]; 2 * BLOCKS],
    whitened: [Vector2<T>; MAX_PAIRS],
    /// What the measurements from a candidate's on can cost at least, by candidate.
    floor: heapless::Vec<T, MAX_JOINT_CANDIDATES>,
    /// The degrees of freedom that they can add at most, by candidate.
    freedom: heapless::Vec<usize, MAX_JOINT_CANDIDATES>,
    path: heapless::Vec<usize, MAX_PAIRS>,
    best: heapless::Vec<usize, MAX_PAIRS>,
    best_cost: T,
    /// Once the best set is known: how much more its rivals may cost.
    margin: Option<T>,
    /// Which pairs of the best set some rival does without.
    rivalled: [bool; MAX_PAIRS],
    nodes: usize,
}

impl<T: Real, C: Correlated<T>> Search<'_, T, C> {
    fn bound(&mut self) {
        let least = |index: usize| {
            let [l11, _, l22] = cholesky(&self.correlated.noise(index))?;
            Some(T::lit(2.0) * (l11 * l22).ln() + self.correlated.offset(index))
        };
        let searched = self.candidates.len().min(MAX_JOINT_CANDIDATES); // those beyond end the search
        let _ = self.floor.resize(searched, T::zero());
        let _ = self.freedom.resize(searched, 0);
        let (mut after, mut own, mut freedom) = (T::zero(), T::zero(), 0);
        for index in (0..searched).rev() {
            let next = self.candidates.get(index + 1).map(|pair| pair.observation);
            if next != Some(self.candidates[index].observation) {
                (after, own) = (after + own, T::zero());
                freedom += self.candidates[index].dof;
            }
            own = least(index).map_or(own, |cost| own.min(cost));
            self.floor[index] = after + own;
            self.freedom[index] = freedom;
        }
    }

    fn descend(&mut self, from: usize, nis: T, cost: T, dof: usize) {
        if nis <= chi2_99(dof) {
            self.visit(cost);
        }
        let (Some(next), Some(floor)) = (self.candidates.get(from), self.floor.get(from)) else { return };
        if self.path.is_full() || cost + *floor >= self.limit() {
            return;
        }
        let observation = next.observation;
        let group = self.candidates[from..].iter().take_while(|pair| pair.observation == observation).count();
        let to_come = self.freedom.get(from + group).copied().unwrap_or(0);
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
            // The pairs to come may bring the whole set within its gate.
            if total > chi2_99(freedom + to_come) || self.path.push(index).is_err() {
                continue;
            }
            let added = step + log_determinant + self.correlated.offset(index);
            self.descend(from + group, total, cost + added, freedom);
            self.path.pop();
        }
        self.descend(from + group, nis, cost, dof); // without this measurement
    }

    /// What a set may cost to be of interest.
    fn limit(&self) -> T {
        self.best_cost + self.margin.unwrap_or(T::zero())
    }

    /// Takes note of the set at hand: as the best one, or as a rival of the best one.
    fn visit(&mut self, cost: T) {
        if cost >= self.limit() {
            return;
        }
        if self.margin.is_none() {
            self.best.clone_from(&self.path);
            self.best_cost = cost;
        } else if self.path.iter().any(|index| !self.best.contains(index)) {
            for (pair, rivalled) in self.best.iter().zip(&mut self.rivalled) {
                *rivalled |= !self.path.contains(pair);
            }
        }
    }

    /// A search for rivals that ended early proves nothing: every pair whose measurement or landmark is in another
    /// candidate too may have one.
    fn doubt_all_with_rivals(&mut self) {
        for (index, rivalled) in self.best.iter().zip(&mut self.rivalled) {
            let own = self.candidates[*index];
            let contested = |pair: &Candidate<T>| {
                (pair.observation == own.observation) != (pair.landmark == own.landmark)
            };
            *rivalled |= self.candidates.iter().any(contested);
        }
    }

    /// Pairs that are outside their own gate, or not likelier than a new landmark by `caution` when looked at alone, need the
    /// others' word: all of them together must make the set likelier by the margin, or they go.
    fn keep_the_sure_unless_the_rest_agrees(&mut self, margin: T, caution: T) {
        let (best, candidates) = (self.best.clone(), self.candidates);
        let fits = |pair: &Candidate<T>| pair.cost < -caution && pair.nis <= chi2_99(pair.dof);
        let sure = |index: &usize| candidates.get(*index).is_some_and(fits);
        if best.iter().all(sure) {
            return;
        }
        let without = self.cost_of(best.iter().copied().filter(sure));
        if without.is_none_or(|cost| self.best_cost <= cost - margin) {
            return;
        }
        for (index, rivalled) in best.iter().zip(&mut self.rivalled) {
            *rivalled |= !sure(index);
        }
    }

    /// The joint cost of a set, `None` where S cannot be factored.
    fn cost_of(&mut self, set: impl Iterator<Item = usize>) -> Option<T> {
        self.path.clear();
        let mut cost = T::zero();
        for index in set {
            let (step, log_determinant) = self.extend(index)?;
            cost += step + log_determinant + self.correlated.offset(index);
            self.path.push(index).ok()?;
        }
        Some(cost)
    }

    fn block(&self, row: usize, column: usize) -> Matrix2<T> {
        let at = block_at(row, column);
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
            let at = block_at(row, column);
            self.root[at] = solve(block.m11, block.m12);
            self.root[at + 1] = solve(block.m21, block.m22);
            let block = self.block(row, column);
            own -= block * block.transpose();
            innovation -= block * self.whitened[column];
        }
        let root = cholesky(&own)?;
        let whitened = forward(&root, &innovation);
        let at = block_at(row, row);
        self.root[at] = [root[0], T::zero()];
        self.root[at + 1] = [root[1], root[2]];
        self.whitened[row] = whitened;
        let log_determinant = T::lit(2.0) * (root[0] * root[2]).ln();
        Some((whitened.norm_squared(), log_determinant))
    }
}

/// χ² at 0.99 by Wilson and Hilferty's cube: within 0.5 % from 2 degrees of freedom on.
fn chi2_99<T: Real>(dof: usize) -> T {
    let Some(at) = dof.checked_sub(1) else { return T::zero() };
    if let Some(exact) = super::CHI2_99.get(at) {
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
    #[derive(Clone, Copy)]
    struct Line {
        innovations: [f64; 4],
        shared: f64,
        own: f64,
        offset: f64,
    }

    impl Correlated<f64> for Line {
        fn innovation(&self, candidate: usize) -> Vector2<f64> {
            Vector2::new(self.innovations[candidate], 0.0)
        }
        fn covariance(&self, left: usize, right: usize) -> Matrix2<f64> {
            let own = if left == right { self.own } else { 0.0 };
            Matrix2::new(self.shared + own, 0.0, 0.0, if left == right { 1.0 } else { 0.0 })
        }
        fn noise(&self, _: usize) -> Matrix2<f64> {
            Matrix2::new(self.own, 0.0, 0.0, 1.0)
        }
        fn offset(&self, _: usize) -> f64 {
            self.offset
        }
    }

    fn pair(observation: usize, landmark: usize, cost: f64) -> Candidate<f64> {
        Candidate { observation, landmark, cost, nis: 0.0, dof: 1 }
    }

    #[test]
    fn a_shared_error_is_followed_where_each_nearest_is_wrong() {
        // Landmarks at 0 and 1; the robot is off by 0.9. Measurement 0 (of landmark 0) lies at 0.9: nearest is
        // landmark 1 (−0.1), but then measurement 1, at 1.9, has only an error of 0.9 against landmark 1 to offer.
        let candidates = [pair(0, 1, 0.01), pair(0, 0, 0.81), pair(1, 1, 0.81)];
        let line = Line { innovations: [-0.1, 0.9, 0.9, 0.0], shared: 1.0, own: 0.001, offset: 0.0 };
        let result = joint_compatibility(&candidates, &line, 100, 0.0, 0.0);
        assert_eq!(&result.chosen[..], &[1, 2]);
        assert!(!result.truncated);
        let mut nearest = heapless::Vec::from_slice(&candidates).unwrap();
        exclusive_nearest(&mut nearest);
        assert_eq!(&nearest[..], &[pair(0, 1, 0.01)]);
    }

    #[test]
    fn a_pair_that_does_not_fit_the_others_is_left_out() {
        let candidates = [pair(0, 0, 0.8), pair(1, 1, 0.8), pair(2, 2, 0.8)];
        let line = Line { innovations: [0.9, 0.9, -0.9, 0.0], shared: 1.0, own: 0.001, offset: -1.0 };
        assert_eq!(&joint_compatibility(&candidates, &line, 100, 0.0, 0.0).chosen[..], &[0, 1]);
    }

    #[test]
    fn a_single_pair_that_anything_would_have_fitted_is_left_out_and_two_that_agree_are_not() {
        let line = Line { innovations: [0.3, 0.3, 0.0, 0.0], shared: 4.0, own: 0.001, offset: 0.0 };
        assert!(joint_compatibility(&[pair(0, 0, 0.0)], &line, 100, 0.0, 0.0).chosen.is_empty());
        let both = [pair(0, 0, 0.0), pair(1, 1, 0.0)];
        assert_eq!(&joint_compatibility(&both, &line, 100, 0.0, 0.0).chosen[..], &[0, 1]);
    }

    #[test]
    fn pairs_beyond_their_own_gates_count_where_all_have_the_same_error() {
        // The robot slipped by 3.3 standard deviations: the three that agree are within their common gate, one is not.
        let line = Line { innovations: [1.0, 1.0, 1.0, 1.0], shared: 0.09, own: 0.001, offset: 0.0 };
        let slipped = |measurement| Candidate { nis: 11.0, ..pair(measurement, measurement, 0.0) };
        let all = [slipped(0), slipped(1), slipped(2)];
        assert_eq!(&joint_compatibility(&all, &line, 100, 0.0, 0.0).chosen[..], &[0, 1, 2]);
        assert!(joint_compatibility(&all[..1], &line, 100, 0.0, 0.0).chosen.is_empty());
        let apart = Line { innovations: [1.0, -1.0, 1.0, -1.0], ..line };
        assert!(joint_compatibility(&all, &apart, 100, 0.0, 0.0).chosen.is_empty());
    }

    #[test]
    fn a_row_that_fits_as_well_one_landmark_further_on_is_ambiguous() {
        // Two measurements of landmarks 0 and 1, or of 1 and 2: the offsets differ by the same 0.4 m.
        let candidates = [pair(0, 0, 0.0), pair(0, 1, 0.0), pair(1, 1, 0.0), pair(1, 2, 0.0)];
        let line = Line { innovations: [0.2, -0.2, 0.2, -0.2], shared: 0.1, own: 0.001, offset: 0.0 };
        let result = joint_compatibility(&candidates, &line, 100, 1.0, 0.0);
        assert_eq!((result.chosen.len(), result.ambiguous), (0, 2));
        let sure = Line { innovations: [0.0, -0.4, 0.0, -0.4], ..line };
        assert_eq!(&joint_compatibility(&candidates, &sure, 100, 1.0, 0.0).chosen[..], &[0, 2]);
    }

    #[test]
    fn a_spent_budget_is_reported() {
        let candidates = [pair(0, 0, 0.8), pair(1, 1, 0.8), pair(2, 2, 0.8)];
        let line = Line { innovations: [0.9, 0.9, -0.9, 0.0], shared: 1.0, own: 0.001, offset: -1.0 };
        let result = joint_compatibility(&candidates, &line, 2, 0.0, 0.0);
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

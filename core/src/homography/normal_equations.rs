//! One pass over the matches: their posterior weights, the likelihood, and the normal equations of M.
use super::Match;
use super::matches::Normalisation;
use crate::Real;
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2};

/// What a pass needs besides M and the matches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mixture<T> {
    pub(super) from: Normalisation<T>,
    pub(super) to: Normalisation<T>,
    /// γ, the share of right matches.
    pub(super) share: T,
    /// A, the area that wrong matches spread over, in the units of normalised `to` points squared.
    pub(super) area: T,
    /// Factor on the covariances: the noise's variance factor, and more while the search anneals.
    pub(super) variance_factor: T,
}

/// Σ over the matches; `hessian` and `gradient` are those of ½ Σ w d with respect to the nine elements of M, row
/// by row.
#[derive(Clone, Copy, Debug)]
pub(super) struct NormalEquations<T> {
    pub(super) hessian: SMatrix<T, 9, 9>,
    pub(super) gradient: SVector<T, 9>,
    /// Log-likelihood ratio against "all matches are wrong".
    pub(super) score: T,
    /// Σ w, the number of right matches.
    pub(super) mass: T,
    /// Σ w d.
    pub(super) chi2: T,
    /// Σ w and Σ w d of the matches with d below [`CORE_DISTANCE2`].
    pub(super) core: [T; 2],
}

/// Below this d a match belongs to the core, by whose scatter the noise is judged: χ²₂ has 86 % of its mass there.
pub(super) const CORE_DISTANCE2: f64 = 4.0;
/// Mean of d in the core when the covariances are right: (2 − (2 + c) e^(−c/2))/(1 − e^(−c/2)) at c = 4.
pub(super) const CORE_MEAN: f64 = 1.373_929_429_001_337;

/// Beyond this d a match has no weight and costs no second look: e^(−25) of a density of 10⁵ is nothing.
pub(super) const MAX_DISTANCE2: f64 = 50.0;

/// M at one point: u = π(M x), A = ∂u/∂x, third component w.
pub(super) struct Transfer<T> {
    pub(super) point: Vector2<T>,
    pub(super) by_from: Matrix2<T>,
    pub(super) third: T,
}

impl<T: Real> Transfer<T> {
    pub(super) fn at(m: &Matrix3<T>, x: Vector2<T>) -> Option<Self> {
        let third = m.m31 * x.x + m.m32 * x.y + m.m33;
        let in_front = third > T::zero();
        if !in_front {
            return None;
        }
        let scale = T::one() / third;
        let u = (m.m11 * x.x + m.m12 * x.y + m.m13) * scale;
        let v = (m.m21 * x.x + m.m22 * x.y + m.m23) * scale;
        let by_from =
            Matrix2::new(m.m11 - u * m.m31, m.m12 - u * m.m32, m.m21 - v * m.m31, m.m22 - v * m.m32) * scale;
        Some(Self { point: Vector2::new(u, v), by_from, third })
    }
}

/// S⁻¹ and det S of the residual's covariance S = Σ_to + A Σ_from Aᵀ.
pub(super) fn residual_information<T: Real>(
    by_from: &Matrix2<T>,
    from_cov: &Matrix2<T>,
    to_cov: &Matrix2<T>,
) -> (Matrix2<T>, T) {
    let s = to_cov + by_from * from_cov * by_from.transpose();
    let determinant = s.m11 * s.m22 - s.m12 * s.m21;
    (Matrix2::new(s.m22, -s.m12, -s.m21, s.m11) / determinant, determinant)
}

/// The posterior that a match is right and its log-likelihood ratio ln(1 + e^t), from the log-odds t.
pub(super) fn posterior<T: Real>(log_odds: T) -> (T, T) {
    let rest = (-log_odds.abs()).exp();
    // ln(1 + q) for small q: the next term, q³/3, is below 1e-8 there.
    let small = rest < T::lit(2e-3);
    let log = if small { rest * (T::one() - rest * T::lit(0.5)) } else { rest.ln_1p() };
    let weight = T::one() / (T::one() + rest);
    if log_odds > T::zero() { (weight, log_odds + log) } else { (rest * weight, log) }
}

/// A pass in normalised coordinates: the Gold Standard with each match's own two unknowns eliminated.
///
/// The point x̃ that truly was matched lies on the line of sight of both; with it the residual is
/// r = y − π(M x̃) − A (x − x̃), and x̃ = x + Σ_from Aᵀ S⁻¹ r makes it the maximum-likelihood one. One such step
/// from the measured point leaves an error of third order in the noise.
pub(super) fn normal_equations<T: Real>(
    m: &Matrix3<T>,
    matches: &[Match<T>],
    mixture: &Mixture<T>,
    mut keep: impl FnMut(usize, T),
) -> NormalEquations<T> {
    let Mixture { from, to, share, area, variance_factor } = *mixture;
    let (from_scale2, to_scale2) =
        (from.scale * from.scale * variance_factor, to.scale * to.scale * variance_factor);
    let prior_odds = share * area / ((T::one() - share) * T::two_pi());
    let (half, none) = (T::lit(0.5), T::lit(1e-6));
    let mut sums = Sums::default();
    let (mut score, mut mass, mut chi2) = (T::zero(), T::zero(), T::zero());
    let mut core = [T::zero(); 2];
    for (index, pair) in matches.iter().enumerate() {
        keep(index, T::zero());
        let (x, y) = (from.apply(pair.from), to.apply(pair.to));
        let (from_cov, to_cov) = (pair.from_cov * from_scale2, pair.to_cov * to_scale2);
        let Some(seen) = Transfer::at(m, x) else { continue };
        let residual = y - seen.point;
        // The trace bounds S from above: most wrong matches end here.
        let bound = to_cov.trace() + seen.by_from.norm_squared() * from_cov.trace();
        let near = residual.norm_squared() < bound * T::lit(MAX_DISTANCE2);
        if !near {
            continue;
        }
        let (information, _) = residual_information(&seen.by_from, &from_cov, &to_cov);
        let shift = from_cov * seen.by_from.tr_mul(&(information * residual));
        let corrected = x + shift;
        let Some(seen) = Transfer::at(m, corrected) else { continue };
        let residual = y - seen.point + seen.by_from * shift;
        let (information, determinant) = residual_information(&seen.by_from, &from_cov, &to_cov);
        let whitened = information * residual;
        let distance2 = residual.dot(&whitened);
        let odds = prior_odds / determinant.sqrt();
        let (weight, gain) = posterior(odds.ln() - half * distance2);
        if weight < none {
            continue;
        }
        keep(index, weight);
        score += gain;
        mass += weight;
        chi2 += weight * distance2;
        if distance2 < T::lit(CORE_DISTANCE2) {
            let [core_mass, core_chi2] = &mut core;
            *core_mass += weight;
            *core_chi2 += weight * distance2;
        }
        sums.add(
            (corrected, T::one() / seen.third),
            seen.point,
            &(information * weight),
            &(whitened * weight),
        );
    }
    let (hessian, gradient) = sums.assemble();
    NormalEquations { hessian, gradient, score, mass, chi2, core }
}

/// The distinct sums of JᵀS⁻¹J and JᵀS⁻¹r: J has the rows (p, 0, −u p)/w and (0, p, −v p)/w with p = (x, y, 1), so
/// each 3×3 block is a weighted sum of p pᵀ.
#[derive(Default)]
pub(super) struct Sums<T> {
    blocks: [[T; 6]; 6],
    gradient: [[T; 3]; 3],
}

impl<T: Real> Sums<T> {
    /// Adds a match: the point `x` with the inverse of its third component, where M carries it, and S⁻¹ and
    /// S⁻¹ r times the match's weight.
    pub(super) fn add(
        &mut self,
        (x, inverse): (Vector2<T>, T),
        carried: Vector2<T>,
        information: &Matrix2<T>,
        whitened: &Vector2<T>,
    ) {
        let (u, v) = (carried.x, carried.y);
        let (px, py, pz) = (x.x * inverse, x.y * inverse, inverse);
        let outer = [px * px, px * py, px * pz, py * py, py * pz, pz * pz];
        let (s11, s12, s22) = (information.m11, information.m12, information.m22);
        let (su, sv) = (s11 * u + s12 * v, s12 * u + s22 * v);
        let coefficients = [s11, s12, s22, -su, -sv, su * u + sv * v];
        for (block, coefficient) in self.blocks.iter_mut().zip(coefficients) {
            for (sum, product) in block.iter_mut().zip(outer) {
                *sum += coefficient * product;
            }
        }
        let by_row = [whitened.x, whitened.y, -(whitened.x * u + whitened.y * v)];
        for (row, coefficient) in self.gradient.iter_mut().zip(by_row) {
            for (sum, p) in row.iter_mut().zip([px, py, pz]) {
                *sum += coefficient * p;
            }
        }
    }

    pub(super) fn assemble(&self) -> (SMatrix<T, 9, 9>, SVector<T, 9>) {
        let mut hessian = SMatrix::<T, 9, 9>::zeros();
        let places = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)];
        for ((row, column), [xx, xy, xz, yy, yz, zz]) in places.into_iter().zip(self.blocks) {
            let block = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            hessian.fixed_view_mut::<3, 3>(3 * row, 3 * column).copy_from(&block);
            hessian.fixed_view_mut::<3, 3>(3 * column, 3 * row).copy_from(&block);
        }
        let mut gradient = SVector::<T, 9>::zeros();
        for (row, values) in self.gradient.iter().enumerate() {
            gradient.fixed_rows_mut::<3>(3 * row).copy_from_slice(values);
        }
        (hessian, gradient)
    }
}

//! Levenberg–Marquardt on the mixture likelihood, for any parametrisation of M.
use super::Match;
use super::estimate::{elements, matrix_of};
use super::normal_equations::{CORE_MEAN, Mixture, NormalEquations, normal_equations};
use crate::Real;
use nalgebra::{Matrix3, SMatrix, SVector};

/// A family of homographies with P parameters.
pub(super) trait Family<T: Real, const P: usize>: Copy {
    /// M in normalised coordinates.
    fn matrix(&self) -> Matrix3<T>;
    /// ∂M/∂step at step = 0, elements row by row.
    fn tangent(&self) -> SMatrix<T, 9, P>;
    /// The member that a step leads to.
    fn moved(&self, step: &SVector<T, P>) -> Self;
}

/// All homographies: the unit sphere of nine elements, stepped in its tangent space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Free<T> {
    matrix: Matrix3<T>,
}

impl<T: Real> Free<T> {
    pub(super) fn new(matrix: Matrix3<T>) -> Self {
        Self { matrix: matrix / matrix.norm() }
    }
}

impl<T: Real> Family<T, 8> for Free<T> {
    fn matrix(&self) -> Matrix3<T> {
        self.matrix
    }

    /// Columns 2 to 9 of the Householder reflection that takes m to ∓e₁: an orthonormal basis across m.
    fn tangent(&self) -> SMatrix<T, 9, 8> {
        let m = elements(&self.matrix);
        let sign = if self.matrix.m11 < T::zero() { -T::one() } else { T::one() };
        let v = m + SVector::<T, 9>::ith(0, sign);
        let factor = T::lit(2.0) / v.norm_squared();
        let reflection = SMatrix::<T, 9, 9>::identity() - v * v.transpose() * factor;
        reflection.fixed_columns::<8>(1).into_owned()
    }

    fn moved(&self, step: &SVector<T, 8>) -> Self {
        Self::new(matrix_of(&(elements(&self.matrix) + self.tangent() * step)))
    }
}

/// Where a refinement ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refined<T, M, const P: usize> {
    pub(super) model: M,
    pub(super) sums: NormalEquations<T>,
    /// Inverse of the covariance of the P parameters.
    pub(super) information: SMatrix<T, P, P>,
    pub(super) mixture: Mixture<T>,
}

/// How far a refinement goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    pub(super) iterations: usize,
    /// Re-estimate the noise's variance factor from the residuals.
    pub(super) scale_noise: bool,
}

/// The member of the family that is most likely near `start`, or `None` when the matches do not determine it.
///
/// Expectation–maximisation with a Newton step each: the weights and the share of right matches from the last
/// pass, the step from its normal equations, damped and taken back when the likelihood falls.
pub(super) fn refine<T: Real, M: Family<T, P>, const P: usize>(
    start: M,
    matches: &[Match<T>],
    mut mixture: Mixture<T>,
    effort: Effort,
    mut keep: impl FnMut(usize, T),
) -> Option<Refined<T, M, P>> {
    let count = T::lit(matches.len() as f64);
    let mut model = start;
    let mut sums = normal_equations(&model.matrix(), matches, &mixture, &mut keep);
    let mut damping = T::zero();
    // Whether the last pass was made elsewhere, or with another mixture, than where the refinement stands.
    let mut stale = false;
    for _ in 0..effort.iterations {
        let tangent = model.tangent();
        let mut information = tangent.tr_mul(&(sums.hessian * tangent));
        for (i, mut column) in information.column_iter_mut().enumerate() {
            if let Some(diagonal) = column.get_mut(i) {
                *diagonal *= T::one() + damping;
            }
        }
        let gradient = tangent.tr_mul(&sums.gradient);
        let step = information.cholesky()?.solve(&gradient);
        let decrement = step.dot(&gradient);
        if !decrement.is_finite() {
            return None;
        }
        let moved = model.moved(&step);
        let tried = normal_equations(&moved.matrix(), matches, &mixture, &mut keep);
        // The score of a sum of hundreds of matches is only as exact as the scalar.
        let slack = (T::one() + sums.score.abs()) * T::default_epsilon() * T::lit(16.0);
        // At the top the noise is still to be found, whatever the last bits of the score say.
        let at_top = effort.scale_noise && decrement < T::lit(1e-4);
        if tried.score + slack < sums.score && !at_top {
            stale = true;
            damping = if damping > T::zero() { damping * T::lit(10.0) } else { T::lit(1e-2) };
            if damping > T::lit(1e4) {
                break;
            }
            continue;
        }
        damping *= T::lit(0.1);
        if damping < T::lit(1e-4) {
            damping = T::zero();
        }
        (model, sums) = (moved, tried);
        let before = mixture;
        let (lowest, highest) = (T::lit(0.05), T::lit(0.98));
        mixture.share = (sums.mass / count).max(lowest).min(highest);
        if effort.scale_noise {
            let factor = mixture.variance_factor * core_factor::<T, P>(&sums);
            mixture.variance_factor = factor.max(T::lit(0.01)).min(T::lit(100.0));
        }
        let settled = (before.variance_factor / mixture.variance_factor - T::one()).abs() < T::lit(0.01);
        if !settled {
            // Scores under different noise do not compare.
            sums = normal_equations(&model.matrix(), matches, &mixture, &mut keep);
        }
        stale = settled && (before.share - mixture.share).abs() > T::lit(0.05);
        if decrement < T::lit(1e-4) && settled {
            break;
        }
    }
    if stale {
        sums = normal_equations(&model.matrix(), matches, &mixture, &mut keep);
    }
    let tangent = model.tangent();
    let information = tangent.tr_mul(&(sums.hessian * tangent));
    Some(Refined { model, sums, information, mixture })
}

/// One Newton step of [`refine`], on faith: for a model that is far from its best, where every step gains.
pub(super) fn step<T: Real, M: Family<T, P>, const P: usize>(
    model: &M,
    matches: &[Match<T>],
    mixture: &Mixture<T>,
) -> Option<M> {
    let sums = normal_equations(&model.matrix(), matches, mixture, |_, _| ());
    let tangent = model.tangent();
    let information = tangent.tr_mul(&(sums.hessian * tangent));
    let step = information.cholesky()?.solve(&tangent.tr_mul(&sums.gradient));
    step.iter().all(|element| element.is_finite()).then(|| model.moved(&step))
}

/// How much larger the residuals are than the covariances say, Σ w d over its degrees of freedom; 1 when there
/// is none to spare.
pub(super) fn variance_factor<T: Real, const P: usize>(sums: &NormalEquations<T>) -> T {
    let freedom = sums.mass * T::lit(2.0) - T::lit(P as f64);
    let enough = freedom > T::one() && sums.chi2 > T::zero();
    if enough { (sums.chi2 / freedom).max(T::lit(0.01)).min(T::lit(100.0)) } else { T::one() }
}

/// How much larger the residuals of the core are than the covariances say. Matches beside the plane are no noise of
/// those on it: by all residuals the variance would grow until it takes them in, and they would pull.
fn core_factor<T: Real, const P: usize>(sums: &NormalEquations<T>) -> T {
    let [mass, chi2] = sums.core;
    let freedom = sums.mass * T::lit(2.0) - T::lit(P as f64);
    let enough = freedom > T::one() && chi2 > T::zero();
    if enough { chi2 / (mass * T::lit(CORE_MEAN)) * (sums.mass * T::lit(2.0) / freedom) } else { T::one() }
}

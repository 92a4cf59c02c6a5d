//! How far off the step may be, by its matches and by the mount.
use super::{MotionProblem, MountEvidence, RefinedStep};
use crate::Real;
use crate::geometry::{Mount, RangeFinder};
use crate::homography::motion_likelihood::{StepEquations, Track, Trial};
use crate::homography::planar::{PlanarRig, STEP};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// How much more uncertain a step may be without one of its matches, in variance.
const LEVERAGE: f64 = 9.0;

/// By which the mount is changed to see what changes with it: rad, and in parts of its height.
const CHANGE: f64 = 1e-3;
/// Angles beyond which a likelihood's curvature says nothing, rad.
const FAR: f64 = 0.1;

/// Of a positive definite matrix.
#[inline(never)]
fn inverse<T: Real>(matrix: SMatrix<T, STEP, STEP>) -> Option<SMatrix<T, STEP, STEP>> {
    matrix.cholesky().map(|root| root.inverse())
}

/// What the mount's height, tilt, roll and yaw change.
pub(super) struct ByMount<T> {
    /// ∂gradient/∂mount.
    pub(super) gradient: SMatrix<T, STEP, 4>,
    /// Log-likelihoods with a little more of each, and a little less.
    scores: [[T; 2]; 4],
}

impl<T: Real> MotionProblem<'_, T> {
    /// H⁻¹, and the covariance of the parameters.
    ///
    /// H⁻¹ would be the covariance if the mixture were the truth. It is not: points above the floor are wherever things
    /// are, those near it pass for floor, and more of them on the left than on the right turn the step. What each match
    /// does to the step tells how much: the change that leaving it out makes, δᵢ = (H − Hᵢ)⁻¹ sᵢ, squared and added up
    /// (the jackknife; for regressions MacKinnon & White 1985). A sum of few squares is itself uncertain: with ν of
    /// them counting (Satterthwaite 1946) the error is Student's, whose variance is ν/(ν − 2) times as large. Four or
    /// fewer tell too little to replace H⁻¹, and are added to it. Hᵢ is the mixture's curvature at one match and can be
    /// anything: where H − Hᵢ is all but singular though the step is well known, its inverse says nothing of the step, and
    /// the change is taken to the first order, H⁻¹ sᵢ.
    pub(super) fn covariance(
        &self,
        refined: &RefinedStep<T>,
        tracks: &[Track<T>],
    ) -> Option<(SMatrix<T, STEP, STEP>, SMatrix<T, STEP, STEP>)> {
        let RefinedStep { step, sums, scene } = refined;
        let constrained = |hessian| self.constrained(step, &StepEquations { hessian, ..*sums }).0;
        let inverse_of = |hessian| inverse(constrained(hessian));
        let trial = Trial::new(&self.rig, step, *scene);
        let observed = trial.parts(tracks).fold(SMatrix::zeros(), |sum, part| sum + part.information);
        // Far from its assumptions what is missing can be too much.
        let certain = inverse_of(observed);
        let inverse = self.freed(certain.or_else(|| inverse_of(sums.hessian))?);

        // The priors are taken at their word.
        let prior = self.freed(constrained(SMatrix::zeros()));
        let mut covariance = inverse * prior * inverse;
        let mut squares = SVector::<T, STEP>::zeros();
        for part in trial.parts(tracks) {
            let rest = inverse_of(observed - part.information);
            let rest = rest.map(|rest| self.freed(rest)).filter(|rest| {
                let most = T::lit(LEVERAGE);
                rest.diagonal()
                    .iter()
                    .zip(inverse.diagonal().iter())
                    .all(|(rest, whole)| *rest <= *whole * most)
            });
            let change = rest.unwrap_or(inverse) * part.score;
            covariance += change * change.transpose();
            let share = (inverse * part.information * inverse).diagonal();
            squares += share.component_mul(&share);
        }
        let few = T::lit(4.0);
        let freedom = inverse.diagonal().zip_map(&squares, |variance, squares| {
            let square = variance * variance;
            if square > T::zero() { square / squares.max(square * T::default_epsilon()) } else { few }
        });
        let students = freedom.map(|freedom| {
            let freedom = freedom.max(few);
            (freedom / (freedom - T::lit(2.0))).sqrt()
        });
        let students = SMatrix::from_diagonal(&students);
        let covariance = students * covariance * students;
        let told =
            freedom.iter().zip(self.priors()).all(|(freedom, prior)| prior.is_none() || *freedom > few);
        Some((inverse, if told { covariance } else { covariance + inverse }))
    }

    /// The matrix without the parameters that are held fixed.
    #[inline(never)]
    fn freed(&self, mut matrix: SMatrix<T, STEP, STEP>) -> SMatrix<T, STEP, STEP> {
        for (index, prior) in self.priors().into_iter().enumerate() {
            if prior.is_none() {
                matrix.row_mut(index).fill(T::zero());
                matrix.column_mut(index).fill(T::zero());
            }
        }
        matrix
    }

    /// Likelihood and its gradient by the mount, by central differences. Where the gradient is zero, the step moves by H⁻¹ times what the
    /// mount changes of it (the implicit function theorem).
    pub(super) fn by_mount(&self, refined: &RefinedStep<T>, tracks: &[Track<T>]) -> ByMount<T> {
        let size = T::lit(CHANGE);
        let mut by_mount = ByMount { gradient: SMatrix::zeros(), scores: [[T::zero(); 2]; 4] };
        let columns = by_mount.gradient.column_iter_mut().zip(&mut by_mount.scores).enumerate();
        for (index, (mut column, scores)) in columns {
            let change = if index == 0 { size * self.finder.mount().height() } else { size };
            let [after, before] =
                [change, -change].map(|change| self.moved(refined, tracks, &[(index, change)]));
            if let Some((after, before)) = after.zip(before) {
                column.copy_from(&((after.gradient - before.gradient) / (change + change)));
                *scores = [after.score, before.score];
            }
        }
        by_mount
    }

    /// The likelihood's gradient and curvature by tilt, roll and yaw, the step's parameters taken out of the curvature (Schur's complement), as
    /// errors with their covariance. `None` where it has no maximum there.
    pub(super) fn mount_evidence(
        &self,
        by_mount: &ByMount<T>,
        refined: &RefinedStep<T>,
        tracks: &[Track<T>],
        inverse: &SMatrix<T, STEP, STEP>,
    ) -> Option<MountEvidence<T>> {
        let (size, here) = (T::lit(CHANGE), refined.sums.score);
        let [_, angles @ ..] = by_mount.scores;
        let gradient = Vector3::from(angles.map(|[after, before]| (after - before) / (size + size)));
        let square = size * size;
        let curvature = |sum: T| -(sum + here) / square;
        let [tilt, roll, yaw] = angles.map(|[after, before]| curvature(after + before - here * T::lit(3.0)));
        let both = |[one, other]: [usize; 2]| {
            let moved = self.moved(refined, tracks, &[(one, size), (other, size)])?.score;
            let alone =
                [one, other].map(|index| by_mount.scores.get(index).map_or(here, |[after, _]| *after));
            Some(curvature(moved - alone[0] - alone[1]))
        };
        let (tilt_roll, tilt_yaw, roll_yaw) = (both([1, 2])?, both([1, 3])?, both([2, 3])?);
        let whole =
            Matrix3::new(tilt, tilt_roll, tilt_yaw, tilt_roll, roll, roll_yaw, tilt_yaw, roll_yaw, yaw);
        let step_by_angles = by_mount.gradient.fixed_columns::<3>(1).into_owned();
        let information = whole - step_by_angles.tr_mul(&(inverse * step_by_angles));
        let covariance = information.cholesky()?.inverse();
        let errors = covariance * gradient;
        (errors.amax() < T::lit(FAR)).then_some(MountEvidence { errors, covariance })
    }

    /// The matches' equations at the step, under another mount.
    #[inline(never)]
    fn moved(
        &self,
        refined: &RefinedStep<T>,
        tracks: &[Track<T>],
        changes: &[(usize, T)],
    ) -> Option<StepEquations<T>> {
        let mut parameters = self.finder.mount().parameters();
        for (index, change) in changes {
            *parameters.get_mut(*index)? += *change;
        }
        let moved = RangeFinder::new(*self.finder.camera(), Mount::new(parameters).ok()?);
        Some(Trial::new(&PlanarRig::new(&moved), &refined.step, refined.scene).equations(tracks))
    }
}

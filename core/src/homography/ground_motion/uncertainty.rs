//! How far off the step may be, by its matches and by the mount.
use super::{MotionProblem, RefinedStep};
use crate::Real;
use crate::geometry::{Mount, RangeFinder};
use crate::homography::motion_likelihood::{StepEquations, Track, Trial};
use crate::homography::planar::{PlanarRig, STEP};
use nalgebra::{SMatrix, SVector};

/// How much more uncertain a step may be without one of its matches, in variance.
const LEVERAGE: f64 = 9.0;

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
        let trial = Trial::new(&self.rig, step, *scene);
        let observed = trial.parts(tracks).fold(SMatrix::zeros(), |sum, part| sum + part.information);
        // Far from its assumptions what is missing can be too much.
        let certain = constrained(observed).cholesky();
        let inverse = self.freed(certain.or_else(|| constrained(sums.hessian).cholesky())?.inverse());

        // The priors are taken at their word.
        let prior = self.freed(constrained(SMatrix::zeros()));
        let mut covariance = inverse * prior * inverse;
        let mut squares = SVector::<T, STEP>::zeros();
        for part in trial.parts(tracks) {
            let rest = constrained(observed - part.information).cholesky();
            let rest = rest.map(|rest| self.freed(rest.inverse())).filter(|rest| {
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
    fn freed(&self, mut matrix: SMatrix<T, STEP, STEP>) -> SMatrix<T, STEP, STEP> {
        for (index, prior) in self.priors().into_iter().enumerate() {
            if prior.is_none() {
                matrix.row_mut(index).fill(T::zero());
                matrix.column_mut(index).fill(T::zero());
            }
        }
        matrix
    }

    /// ∂gradient/∂(height, tilt, roll, yaw) at a step, by central differences. Where the gradient is zero, the step
    /// moves by H⁻¹ times that (the implicit function theorem).
    pub(super) fn gradient_by_mount(
        &self,
        refined: &RefinedStep<T>,
        tracks: &[Track<T>],
    ) -> SMatrix<T, STEP, 4> {
        let mount = self.finder.mount();
        let size = T::lit(1e-3);
        let gradient = |index: usize, change: T| {
            let mut parameters = mount.parameters();
            if let Some(parameter) = parameters.get_mut(index) {
                *parameter += change;
            }
            let moved = RangeFinder::new(*self.finder.camera(), Mount::new(parameters).ok()?);
            let rig = PlanarRig::new(&moved);
            Some(Trial::new(&rig, &refined.step, refined.scene).equations(tracks).gradient)
        };
        let mut jacobian = SMatrix::<T, STEP, 4>::zeros();
        for (index, mut column) in jacobian.column_iter_mut().enumerate() {
            let change = if index == 0 { size * mount.height() } else { size };
            if let Some((after, before)) = gradient(index, change).zip(gradient(index, -change)) {
                column.copy_from(&((after - before) / (change + change)));
            }
        }
        jacobian
    }
}

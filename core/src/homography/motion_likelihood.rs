//! What a match says about the robot's step, whether its point lies on the floor or not.
use super::Match;
use super::estimate::elements;
use super::normal_equations::{MAX_DISTANCE2, Sums, Transfer, residual_information};
use super::planar::{PlanarRig, PlanarStep, STEP, View};
use crate::Real;
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2};

/// Where a matched point is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Membership<T> {
    /// Probability that it lies on the floor.
    pub floor: T,
    /// Probability that it stands still, above the floor.
    pub upright: T,
}

/// A match while its robot's step is sought: scratch memory before, the verdict after.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Track<T> {
    /// The match as rays (x, y) of the camera's frame; `None` outside the lens model.
    pub(super) rays: Option<Match<T>>,
    /// Where its point is; all zero for a match that is wrong or moves.
    pub membership: Membership<T>,
}

/// Shares of floor points and of still points above it among the matches; the rest is wrong or moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shares<T> {
    pub(super) floor: T,
    pub(super) upright: T,
}

/// What a pass needs besides the step and the matches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<T> {
    pub(super) shares: Shares<T>,
    /// Area that wrong matches spread over, in rays squared.
    pub(super) area: T,
    pub(super) variance_factor: T,
}

/// Σ over the matches: normal equations of the step, likelihood, memberships.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepEquations<T> {
    pub(super) hessian: SMatrix<T, STEP, STEP>,
    pub(super) gradient: SVector<T, STEP>,
    pub(super) score: T,
    pub(super) floor: T,
    pub(super) upright: T,
    /// Matches inside the lens model.
    pub(super) count: T,
    /// Σ of squared Mahalanobis distances by their posteriors, and how many numbers went in.
    pub(super) chi2: T,
    pub(super) measurements: T,
}

/// What a match alone says of the step.
pub(super) struct Part<T> {
    pub(super) information: SMatrix<T, STEP, STEP>,
    pub(super) score: SVector<T, STEP>,
}

/// A view made ready to try matches on.
pub(super) struct Trial<T> {
    view: View<T>,
    homography: Matrix3<T>,
    essential: Matrix3<T>,
    scene: Scene<T>,
}

/// The floor's part of a match: residual r = x₂ − π(H x₁), S⁻¹ r, S⁻¹, J = ∂π/∂H.
struct FloorPart<T> {
    log_density: T,
    distance2: T,
    whitened: Vector2<T>,
    information: Matrix2<T>,
    corrected: Vector2<T>,
    predicted: Vector2<T>,
    inverse_third: T,
}

/// The epipolar part: e = x₂ᵀ E x₁ over its standard deviation.
struct EpipolarPart<T> {
    log_density: T,
    normalised: T,
    std: T,
    /// ∂(x₂ᵀ E x₁)/∂E at the points that explain the match best, where it is zero.
    by_essential: SVector<T, 9>,
    edge: Edge<T>,
}

/// Length over which points above the floor spread along their epipolar lines, in rays.
const STRETCH: f64 = 0.25;

/// What "not below the floor" asks of the floor's predicted point: gradient and curvature of ln Φ.
struct Edge<T> {
    gradient: Vector2<T>,
    information: Matrix2<T>,
}

impl<T: Real> Trial<T> {
    pub(super) fn new(rig: &PlanarRig<T>, step: &PlanarStep<T>, scene: Scene<T>) -> Self {
        let view = rig.view(step);
        Self { homography: view.homography(), essential: view.essential(), view, scene }
    }

    /// The Gold Standard's residual, as for a free homography: at the point x̃ that explains both pictures best.
    fn floor_part(&self, pair: &Match<T>) -> Option<FloorPart<T>> {
        let x = pair.from;
        let below = self.view.floor.dot(&x.push(T::one())) > T::zero();
        let seen = Transfer::at(&self.homography, x).filter(|_| below)?;
        let factor = self.scene.variance_factor;
        let (from_cov, to_cov) = (pair.from_cov * factor, pair.to_cov * factor);
        let residual = pair.to - seen.point;
        let (information, _) = residual_information(&seen.by_from, &from_cov, &to_cov);
        let shift = from_cov * seen.by_from.tr_mul(&(information * residual));
        // The first order is not worth following to points that the noise cannot explain.
        let far = residual.dot(&(information * residual)) > T::lit(MAX_DISTANCE2);
        let shift = if far { Vector2::zeros() } else { shift };
        let corrected = x + shift;
        let seen = Transfer::at(&self.homography, corrected)?;
        let residual = pair.to - seen.point + seen.by_from * shift;
        let (information, determinant) = residual_information(&seen.by_from, &from_cov, &to_cov);
        let whitened = information * residual;
        let distance2 = residual.dot(&whitened);
        let density = self.scene.shares.floor / (T::two_pi() * determinant.sqrt());
        let log_density = density.ln() - distance2 * T::lit(0.5);
        let inverse_third = T::one() / seen.third;
        Some(FloorPart {
            log_density,
            distance2,
            whitened,
            information,
            corrected,
            predicted: seen.point,
            inverse_third,
        })
    }

    /// A still point above the floor is nearer than the floor on the same ray, and moves further along its
    /// epipolar line than the floor would: spread evenly over [`STRETCH`] from there, the edge blurred by the noise.
    fn epipolar_part(&self, pair: &Match<T>, floor: Option<&FloorPart<T>>) -> Option<EpipolarPart<T>> {
        let (x1, x2) = (pair.from.push(T::one()), pair.to.push(T::one()));
        let line = self.essential * x1;
        let other = self.essential.tr_mul(&x2);
        let (across, across_other) = (line.xy(), other.xy());
        let variance = (across.dot(&(pair.to_cov * across))
            + across_other.dot(&(pair.from_cov * across_other)))
            * self.scene.variance_factor;
        let moving = variance > T::lit(1e-30);
        if !moving {
            return None;
        }
        let std = variance.sqrt();
        let normalised = x2.dot(&line) / std;
        let spread = std / across.norm();
        // Where the point would be at the floor, or at infinity above the horizon, and where to it goes from there.
        let inverse_far = self.view.floor.dot(&x1).max(T::zero());
        let far = self.view.rotation * x1 + self.view.translation * inverse_far;
        let ahead = far.z > T::zero();
        if !ahead {
            return None;
        }
        let far_point = far.xy() / far.z;
        let along = self.view.translation.xy() - far_point * self.view.translation.z;
        let direction = along / along.norm();
        let reach = (pair.to - far_point).dot(&direction);
        let edge_std =
            floor.map_or(spread, |part| T::one() / direction.dot(&(part.information * direction)).sqrt());
        // Φ by the logistic function, within 0.01.
        let slope = T::lit(1.702) / edge_std;
        let beyond = T::one() / (T::one() + (-reach * slope).exp());
        let within = beyond > T::lit(1e-6) && reach < T::lit(STRETCH);
        if !within {
            return None;
        }
        let density = self.scene.shares.upright * beyond / (T::two_pi().sqrt() * spread * T::lit(STRETCH));
        let log_density = density.ln() - normalised * normalised * T::lit(0.5);
        let push = slope * (T::one() - beyond);
        let edge = Edge {
            gradient: direction * -push,
            information: direction * direction.transpose() * (push * slope * beyond),
        };
        let correction = normalised / std * self.scene.variance_factor;
        let (x1, x2) = (
            pair.from - pair.from_cov * across_other * correction,
            pair.to - pair.to_cov * across * correction,
        );
        let by_essential = elements(&(x2.push(T::one()) * x1.push(T::one()).transpose()));
        Some(EpipolarPart { log_density, normalised, std, by_essential, edge })
    }

    fn wrong(&self) -> T {
        let share = T::one() - self.scene.shares.floor - self.scene.shares.upright;
        (share / self.scene.area).ln()
    }

    /// Log-likelihood ratio of the matches against all being wrong, with the larger part for their sum.
    pub(super) fn score(&self, tracks: &[Track<T>], stride: usize) -> T {
        let wrong = self.wrong();
        let pairs = tracks.iter().step_by(stride).filter_map(|track| track.rays.as_ref());
        pairs.fold(T::zero(), |score, pair| {
            let floor = self.floor_part(pair);
            let upright = self.epipolar_part(pair, floor.as_ref()).map_or(wrong, |part| part.log_density);
            score + floor.map_or(wrong, |part| part.log_density).max(upright).max(wrong) - wrong
        })
    }

    /// Where a match's point is.
    pub(super) fn membership(&self, track: &Track<T>) -> Membership<T> {
        let weigh = |pair| {
            let floor = self.floor_part(pair);
            let epipolar = self.epipolar_part(pair, floor.as_ref());
            weigh(&floor, &epipolar, self.wrong()).0
        };
        track.rays.as_ref().map_or(Membership::default(), weigh)
    }

    /// What each match alone says of the step: its information and its score s̄ = Σ wₖ sₖ, the gradient.
    ///
    /// The information is that of [`equations`] less what is missing because no one says where the match's point is
    /// (Louis 1982), the spread of its score over the possibilities, Σ wₖ sₖ sₖᵀ − s̄ s̄ᵀ.
    ///
    /// [`equations`]: Self::equations
    pub(super) fn parts(&self, tracks: &[Track<T>]) -> impl Iterator<Item = Part<T>> {
        let (floor_by_step, essential_by_step) =
            (self.view.homography_by_step(), self.view.essential_by_step());
        tracks.iter().filter_map(move |track| {
            let pair = track.rays.as_ref()?;
            let floor = self.floor_part(pair);
            let epipolar = self.epipolar_part(pair, floor.as_ref());
            let Membership { floor: on, upright: off } = weigh(&floor, &epipolar, self.wrong()).0;
            let through_floor = |part: &FloorPart<T>, information: &Matrix2<T>, whitened: &Vector2<T>| {
                let mut sums = Sums::default();
                sums.add((part.corrected, part.inverse_third), part.predicted, information, whitened);
                let (hessian, gradient) = sums.assemble();
                (floor_by_step.tr_mul(&(hessian * floor_by_step)), floor_by_step.tr_mul(&gradient))
            };
            let nothing = (SMatrix::zeros(), SVector::zeros());
            let (on_information, on_score) =
                floor.as_ref().map_or(nothing, |part| through_floor(part, &part.information, &part.whitened));
            let (off_information, off_score) = epipolar.as_ref().map_or(nothing, |part| {
                let Edge { gradient, information } = &part.edge;
                let edge =
                    floor.as_ref().map_or(nothing, |floor| through_floor(floor, information, gradient));
                let jacobian = essential_by_step.tr_mul(&part.by_essential) / part.std;
                (edge.0 + jacobian * jacobian.transpose(), edge.1 - jacobian * part.normalised)
            });
            let score = on_score * on + off_score * off;
            let missing = on_score * on_score.transpose() * on + off_score * off_score.transpose() * off
                - score * score.transpose();
            Some(Part { information: on_information * on + off_information * off - missing, score })
        })
    }

    /// A pass with posteriors.
    pub(super) fn equations(&self, tracks: &[Track<T>]) -> StepEquations<T> {
        let (floor_by_step, essential_by_step) =
            (self.view.homography_by_step(), self.view.essential_by_step());
        let mut sums = Sums::default();
        let mut hessian = SMatrix::<T, STEP, STEP>::zeros();
        let mut gradient = SVector::<T, STEP>::zeros();
        let wrong = self.wrong();
        let (mut score, mut floor_mass, mut upright_mass) = (T::zero(), T::zero(), T::zero());
        let (mut chi2, mut measurements) = (T::zero(), T::zero());
        let none = T::lit(1e-6);
        let mut count = T::zero();
        for pair in tracks.iter().filter_map(|track| track.rays.as_ref()) {
            count += T::one();
            let floor = self.floor_part(pair);
            let epipolar = self.epipolar_part(pair, floor.as_ref());
            let (membership, total) = weigh(&floor, &epipolar, wrong);
            score += total.ln();
            if let Some(part) = &floor {
                let weight = membership.floor;
                floor_mass += weight;
                chi2 += weight * part.distance2;
                measurements += weight * T::lit(2.0);
                let (mut whitened, mut information) = (part.whitened * weight, part.information * weight);
                if let Some(EpipolarPart { edge, .. }) = &epipolar {
                    whitened += edge.gradient * membership.upright;
                    information += edge.information * membership.upright;
                }
                if information.trace() > none * part.information.trace() {
                    sums.add((part.corrected, part.inverse_third), part.predicted, &information, &whitened);
                }
            }
            if let Some(part) = epipolar.filter(|_| membership.upright > none) {
                let weight = membership.upright;
                upright_mass += weight;
                chi2 += weight * part.normalised * part.normalised;
                measurements += weight;
                let jacobian = essential_by_step.tr_mul(&part.by_essential) / part.std;
                gradient -= jacobian * (part.normalised * weight);
                hessian += jacobian * weight * jacobian.transpose();
            }
        }
        let (floor_hessian, floor_gradient) = sums.assemble();
        hessian += floor_by_step.tr_mul(&(floor_hessian * floor_by_step));
        gradient += floor_by_step.tr_mul(&floor_gradient);
        StepEquations {
            hessian,
            gradient,
            score,
            floor: floor_mass,
            upright: upright_mass,
            count,
            chi2,
            measurements,
        }
    }
}

/// The posteriors, and the likelihood ratio against the match being wrong.
fn weigh<T: Real>(
    floor: &Option<FloorPart<T>>,
    epipolar: &Option<EpipolarPart<T>>,
    wrong: T,
) -> (Membership<T>, T) {
    let odds =
        |log_density: Option<T>| log_density.map_or(T::zero(), |log| (log - wrong).min(T::lit(60.0)).exp());
    let floor_odds = odds(floor.as_ref().map(|part| part.log_density));
    let upright_odds = odds(epipolar.as_ref().map(|part| part.log_density));
    let total = T::one() + floor_odds + upright_odds;
    (Membership { floor: floor_odds / total, upright: upright_odds / total }, total)
}

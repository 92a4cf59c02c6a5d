//! The robot's step from matches: rotation from all that stands still, length from the floor.
mod uncertainty;

use super::motion_likelihood::{Membership, Scene, Shares, StepEquations, Track, Trial};
use super::planar::{PlanarRig, PlanarStep, STEP};
use super::robust::meaningful;
use super::sample::Sampler;
use super::{Homography, Jolt, Match};
use crate::Real;
use crate::geometry::{Pose, RangeFinder};
use nalgebra::{Matrix2, Matrix3, Matrix3x4, SMatrix, SVector, Vector2, Vector3};

/// How the robot can move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotionModel {
    /// Along arcs, without sideways slip of the robot's origin: the paper's control (v, ω).
    #[default]
    Wheeled,
    /// Freely in the plane: dx, dy, dθ.
    Free,
}

/// Settings of [`ground_motion`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundMotionConfig<T> {
    /// How the robot can move.
    pub model: MotionModel,
    /// Standard deviation of the body's pitch from picture to picture in radians; 0 holds it fixed.
    pub pitch_std: T,
    /// Standard deviation of the body's pitch at the first picture, against the mount's tilt, in radians; 0 holds it
    /// fixed.
    pub tilt_std: T,
    /// Standard deviation of the body's roll from picture to picture in radians; 0 holds it fixed.
    pub roll_std: T,
    /// Chance of having drawn a sample without a wrong match when the search stops.
    pub confidence: T,
    /// Samples drawn at most.
    pub max_samples: u32,
    /// Seed of the samples.
    pub seed: u64,
    /// Whether to estimate the noise's variance factor from the residuals and to scale the covariance with it.
    pub scale_noise: bool,
}

impl<T: Real> Default for GroundMotionConfig<T> {
    fn default() -> Self {
        Self {
            model: MotionModel::Wheeled,
            pitch_std: T::zero(),
            roll_std: T::zero(),
            tilt_std: T::zero(),
            confidence: T::lit(0.99),
            max_samples: 100,
            seed: 1,
            scale_noise: false,
        }
    }
}

/// What is known of a step beforehand: from odometry, or from the last step and how fast the robot can change it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionPrior<T> {
    /// Path along the arc (m) and turn (rad).
    pub arc: Vector2<T>,
    /// Covariance of the arc.
    pub covariance: Matrix2<T>,
}

/// A metric step of the robot between two pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundMotion<T> {
    /// first_robot_from_second_robot: (dx, dy, dθ) in the robot's frame at the first picture.
    pub pose: Pose<T>,
    /// Covariance of (dx, dy, dθ) from the scatter of the matches; rank 2 for [`MotionModel::Wheeled`].
    pub covariance: Matrix3<T>,
    /// ∂(dx, dy, dθ)/∂(height, tilt, roll, yaw) of the mount: how its error, which all steps share, goes into the step.
    pub by_mount: Matrix3x4<T>,
    /// What the matches say of the mount, where they say anything.
    pub mount: Option<MountEvidence<T>>,
    /// How the body pitched and rolled between the pictures; zero where the configuration holds that fixed.
    pub attitude: Jolt<T>,
    /// ∂arc/∂(what was known of it beforehand): how much of the prior is in the step; zero without one.
    pub arc_by_prior: Matrix2<T>,
    /// Path along the arc (m) and turn (rad): v Δt and ω Δt of the paper's control.
    pub arc: Vector2<T>,
    /// Covariance of the arc.
    pub arc_covariance: Matrix2<T>,
    /// The floor-induced homography of **rays**, first picture to second, with its covariance (rank of the step's).
    pub floor_homography: Homography<T>,
    /// Expected number of matches on the floor.
    pub floor: T,
    /// Expected number of matches that stand still above the floor.
    pub upright: T,
    /// Squared residuals per degree of freedom: 1 when the matches' covariances are right.
    pub variance_factor: T,
    /// Samples drawn.
    pub samples: u32,
}

/// What matches say of the mount's angles, whatever the step is: a floor moves in the picture as it does under one tilt, roll and yaw only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountEvidence<T> {
    /// By how much tilt, roll and yaw (rad) are more than the mount has them.
    pub errors: Vector3<T>,
    /// Its covariance, rad².
    pub covariance: Matrix3<T>,
}

/// Why there is no motion: an outcome, not a broken contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoMotion {
    /// Fewer than two matches lie below the horizon in both pictures.
    TooFewMatches,
    /// There are fewer tracks than matches.
    TooFewTracks,
    /// No more matches agree than chance would give.
    NoConsensus,
    /// The matches that agree do not determine the step.
    Degenerate,
}

impl core::fmt::Display for NoMotion {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::TooFewMatches => "the robot's step needs at least two matches below the horizon",
            Self::TooFewTracks => "there are fewer tracks than matches",
            Self::NoConsensus => "no more matches agree on a step over the floor than chance would give",
            Self::Degenerate => "the matches that agree do not determine the step",
        })
    }
}

impl core::error::Error for NoMotion {}

/// The robot's step between the pictures of some matches (in pixels), fused with what was known beforehand;
/// `tracks` receives where each match's point is.
///
/// # Errors
/// [`NoMotion`], every variant.
#[inline(never)] // two callers would have it twice in a page's first load
pub fn ground_motion<T: Real>(
    config: &GroundMotionConfig<T>,
    finder: &RangeFinder<T>,
    matches: &[Match<T>],
    prior: Option<&MotionPrior<T>>,
    tracks: &mut [Track<T>],
) -> Result<GroundMotion<T>, NoMotion> {
    let tracks = tracks.get_mut(..matches.len()).ok_or(NoMotion::TooFewTracks)?;
    for (track, pair) in tracks.iter_mut().zip(matches) {
        *track = Track { rays: pair.as_rays(finder.camera()), membership: Membership::default() };
    }
    let problem = MotionProblem::new(config, finder, prior, tracks)?;
    let (start, samples) = problem.search(tracks);
    let refined = problem.refine(start, tracks, T::one(), 20).ok_or(NoMotion::Degenerate)?;
    let outcome = problem.conclude(&refined, tracks, samples);
    if outcome.is_ok() {
        let trial = Trial::new(&problem.rig, &refined.step, refined.scene);
        for track in tracks.iter_mut() {
            track.membership = trial.membership(track);
        }
    }
    outcome
}

/// Matches that a step is tried on before the rest.
const PREVIEW: usize = 128;

/// Steps that are refined before the best is chosen.
const FINALISTS: usize = 3;

struct MotionProblem<'a, T> {
    config: &'a GroundMotionConfig<T>,
    finder: &'a RangeFinder<T>,
    /// Arc and information.
    prior: Option<(Vector2<T>, Matrix2<T>)>,
    rig: PlanarRig<T>,
    /// Area of the picture in rays squared.
    area: T,
    /// Matches below the horizon in both pictures.
    candidates: usize,
    /// Mean variance of a match, both pictures together, in rays squared.
    variance: T,
}

struct RefinedStep<T> {
    step: PlanarStep<T>,
    sums: StepEquations<T>,
    scene: Scene<T>,
}

impl<'a, T: Real> MotionProblem<'a, T> {
    fn new(
        config: &'a GroundMotionConfig<T>,
        finder: &'a RangeFinder<T>,
        prior: Option<&MotionPrior<T>>,
        tracks: &[Track<T>],
    ) -> Result<Self, NoMotion> {
        let rig = PlanarRig::new(finder);
        let (mut candidates, mut variance) = (0, T::zero());
        for pair in tracks.iter().filter_map(|track| track.rays.as_ref()) {
            if rig.floor_from_ray(pair.from).is_some() && rig.floor_from_ray(pair.to).is_some() {
                candidates += 1;
                variance += pair.variances().0 + pair.variances().1;
            }
        }
        if candidates < 2 {
            return Err(NoMotion::TooFewMatches);
        }
        let (camera, focal) = (finder.camera(), finder.camera().focal());
        let area = T::lit((camera.width() * camera.height()) as f64) / (focal.x * focal.y);
        let prior = prior.and_then(|prior| Some((prior.arc, prior.covariance.try_inverse()?)));
        Ok(Self {
            config,
            finder,
            prior,
            rig,
            area,
            candidates,
            variance: variance / T::lit(candidates as f64),
        })
    }

    fn scene(&self, variance_factor: T) -> Scene<T> {
        let shares = Shares { floor: T::lit(0.3), upright: T::lit(0.4) };
        Scene { shares, area: self.area, variance_factor }
    }

    /// The best of the guess, standing still and sampled steps, with the number of samples drawn: the most
    /// promising few by a part of the matches, refined a little and then compared by all of them.
    fn search(&self, tracks: &[Track<T>]) -> (PlanarStep<T>, u32) {
        let stride = tracks.len().div_ceil(PREVIEW).max(1);
        let preview = |step: PlanarStep<T>| {
            let trial = Trial::new(&self.rig, &step, self.scene(T::lit(9.0)));
            let part = T::lit(stride as f64);
            (trial.score(tracks, stride) + self.prior_score(&step) / part, step)
        };
        // A step of exactly zero has no direction for the epipolar lines.
        let still = PlanarStep::new(self.rig.height * T::lit(1e-4), T::zero(), T::zero());
        let mut finalists = [preview(still); FINALISTS];
        let mut sampler = Sampler::new(self.config.seed);
        let mut drawn = 0;
        while drawn < self.config.max_samples {
            drawn += 1;
            let Some(tried) = self.sample(&mut sampler, tracks).map(preview) else { continue };
            let mut incoming = tried;
            for place in &mut finalists {
                if incoming.0 > place.0 {
                    core::mem::swap(&mut incoming, place);
                }
            }
        }
        let guess = self.prior.map(|(arc, _)| PlanarStep::new(arc.x, T::zero(), arc.y));
        let candidates = finalists.into_iter().map(|(_, step)| step).chain(guess);
        let mut best = None;
        for candidate in candidates {
            let annealed = [16.0, 4.0].into_iter().try_fold(candidate, |step, factor| {
                let sums = Trial::new(&self.rig, &step, self.scene(T::lit(factor))).equations(tracks);
                self.newton(&step, &sums).map(|(change, _)| PlanarStep(step.0 + change))
            });
            let Some(step) = annealed else { continue };
            let likelihood = Trial::new(&self.rig, &step, self.scene(T::one())).score(tracks, 1);
            let score = likelihood + self.prior_score(&step);
            if best.is_none_or(|(highest, _)| score > highest) {
                best = Some((score, step));
            }
        }
        (best.map_or(still, |(_, step)| step), drawn)
    }

    /// The step that one floor match (wheeled) or two (free) ask for.
    fn sample(&self, sampler: &mut Sampler, tracks: &[Track<T>]) -> Option<PlanarStep<T>> {
        // Most matches can lie above the horizon: try a few for one that does not.
        let mut draw = || {
            (0..20).find_map(|_| {
                let pair = tracks.get(sampler.below(tracks.len()))?.rays?;
                Some((self.rig.floor_from_ray(pair.from)?, self.rig.floor_from_ray(pair.to)?))
            })
        };
        let (before, after) = draw()?;
        match self.config.model {
            MotionModel::Wheeled => arc_through(before, after),
            MotionModel::Free => {
                let (other_before, other_after) = draw()?;
                let (a, b) = (other_before - before, other_after - after);
                let distinct = a.norm_squared() > T::zero() && b.norm_squared() > T::zero();
                let turn = distinct.then(|| b.perp(&a).atan2(b.dot(&a)))?;
                let shift = before - Pose::new(T::zero(), T::zero(), turn).transform(after);
                Some(PlanarStep::from_pose(&Pose::new(shift.x, shift.y, turn)))
            }
        }
    }

    /// Prior information of the parameters; `None` for one that is held fixed.
    fn priors(&self) -> [Option<T>; STEP] {
        let attitude = |std: T| (std > T::zero()).then(|| T::one() / (std * std));
        let slip = (self.config.model == MotionModel::Free).then(T::zero);
        let Self { config, .. } = self;
        let [pitch, roll, tilt] = [config.pitch_std, config.roll_std, config.tilt_std].map(attitude);
        [Some(T::zero()), slip, Some(T::zero()), pitch, roll, tilt]
    }

    /// Information and gradient with priors, the fixed parameters' rows emptied.
    #[inline(never)] // as the next ones: 6×6 matrices unrolled at each call are a tenth of a page's pipeline
    fn constrained(
        &self,
        step: &PlanarStep<T>,
        sums: &StepEquations<T>,
    ) -> (SMatrix<T, STEP, STEP>, SVector<T, STEP>) {
        let (mut information, mut gradient) = (sums.hessian, sums.gradient);
        if let Some((arc, prior)) = &self.prior {
            let push = prior * (arc - step.arc());
            for (row, from) in [(0, 0), (2, 1)] {
                gradient.fixed_rows_mut::<1>(row).add_scalar_mut(push.fixed_rows::<1>(from).x);
                for (column, of) in [(0, 0), (2, 1)] {
                    let element = prior.fixed_view::<1, 1>(from, of).x;
                    information.fixed_view_mut::<1, 1>(row, column).add_scalar_mut(element);
                }
            }
        }
        for (index, prior) in self.priors().into_iter().enumerate() {
            match prior {
                Some(prior) => {
                    let value = step.0.fixed_rows::<1>(index).x;
                    let mut diagonal = information.fixed_view_mut::<1, 1>(index, index);
                    diagonal.add_scalar_mut(prior);
                    gradient.fixed_rows_mut::<1>(index).add_scalar_mut(-prior * value);
                }
                None => {
                    information.row_mut(index).fill(T::zero());
                    information.column_mut(index).fill(T::zero());
                    information.fixed_view_mut::<1, 1>(index, index).fill(T::one());
                    gradient.row_mut(index).fill(T::zero());
                }
            }
        }
        (information, gradient)
    }

    fn prior_score(&self, step: &PlanarStep<T>) -> T {
        let half = T::lit(0.5);
        let arc = self.prior.map_or(T::zero(), |(arc, information)| {
            let error = step.arc() - arc;
            -half * error.dot(&(information * error))
        });
        let values = step.0.iter().zip(self.priors());
        values.fold(arc, |score, (value, prior)| score - half * *value * *value * prior.unwrap_or(T::zero()))
    }

    /// Expectation–maximisation with damped Newton steps, as for a free homography.
    fn refine(
        &self,
        start: PlanarStep<T>,
        tracks: &[Track<T>],
        variance_factor: T,
        iterations: usize,
    ) -> Option<RefinedStep<T>> {
        let mut scene = self.scene(variance_factor);
        let mut step = start;
        let pass =
            |step: &PlanarStep<T>, scene: Scene<T>| Trial::new(&self.rig, step, scene).equations(tracks);
        let mut sums = pass(&step, scene);
        let mut shrink = T::one();
        for _ in 0..iterations {
            let (full, decrement) = self.newton(&step, &sums)?;
            let moved = PlanarStep(step.0 + full * shrink);
            let tried = pass(&moved, scene);
            let (before, after) =
                (sums.score + self.prior_score(&step), tried.score + self.prior_score(&moved));
            let slack = (T::one() + before.abs()) * T::default_epsilon() * T::lit(16.0);
            if after + slack < before {
                shrink *= T::lit(0.3);
                if shrink < T::lit(1e-3) {
                    break;
                }
                continue;
            }
            shrink = (shrink * T::lit(3.0)).min(T::one());
            step = moved;
            let count = tried.count.max(T::one());
            let share = |mass: T| (mass / count).max(T::lit(0.02)).min(T::lit(0.9));
            let (floor, upright) = (share(tried.floor), share(tried.upright));
            let last_shares = scene.shares;
            let room = T::lit(0.98) / (floor + upright).max(T::lit(0.98));
            scene.shares = Shares { floor: floor * room, upright: upright * room };
            let last_factor = scene.variance_factor;
            if self.config.scale_noise {
                let factor = scene.variance_factor * self.variance_factor(&tried);
                scene.variance_factor = factor.max(T::lit(0.25)).min(T::lit(4.0));
            }
            let settled = (last_factor / scene.variance_factor - T::one()).abs() < T::lit(0.01);
            // A pass with the new mixture, unless it is all but the old one.
            let changed = (last_shares.floor - scene.shares.floor).abs() > T::lit(0.02);
            sums = if changed || !settled { pass(&step, scene) } else { tried };
            if decrement < T::lit(1e-4) && settled {
                break;
            }
        }
        Some(RefinedStep { step, sums, scene })
    }

    /// Newton's step and its decrement gᵀ H⁻¹ g, or `None` where the matches do not determine it.
    fn newton(&self, step: &PlanarStep<T>, sums: &StepEquations<T>) -> Option<(SVector<T, STEP>, T)> {
        let (information, gradient) = self.constrained(step, sums);
        let change = information.cholesky()?.solve(&gradient);
        let decrement = change.dot(&gradient);
        decrement.is_finite().then_some((change, decrement))
    }

    fn variance_factor(&self, sums: &StepEquations<T>) -> T {
        let freedom = sums.measurements - T::lit(2.0);
        let enough = freedom > T::one() && sums.chi2 > T::zero();
        if enough { (sums.chi2 / freedom).max(T::lit(0.25)).min(T::lit(4.0)) } else { T::one() }
    }

    fn conclude(
        &self,
        refined: &RefinedStep<T>,
        tracks: &[Track<T>],
        samples: u32,
    ) -> Result<GroundMotion<T>, NoMotion> {
        let RefinedStep { step, sums, .. } = refined;
        let gate = T::pi() * T::lit(9.21) * self.variance;
        let sample = if self.config.model == MotionModel::Free { 2 } else { 1 };
        if !meaningful(self.candidates, sums.floor, sample, gate / (self.area * T::lit(0.5))) {
            return Err(NoMotion::NoConsensus);
        }
        let (inverse, covariance) = self.covariance(refined, tracks).ok_or(NoMotion::Degenerate)?;
        if !covariance.iter().chain(step.0.iter()).all(|value| value.is_finite()) {
            return Err(NoMotion::Degenerate);
        }
        let pose_by_step = step.pose_by_step();
        let by_mount = self.by_mount(refined, tracks);
        let arc_covariance = Matrix2::new(covariance.m11, covariance.m13, covariance.m31, covariance.m33);
        let view = self.rig.view(step);
        let by_step = view.homography_by_step();
        let floor_homography = Homography::new(view.homography(), by_step * covariance * by_step.transpose())
            .ok_or(NoMotion::Degenerate)?;
        Ok(GroundMotion {
            pose: step.pose(),
            covariance: pose_by_step * covariance * pose_by_step.transpose(),
            by_mount: pose_by_step * inverse * by_mount.gradient,
            mount: self.mount_evidence(&by_mount, refined, tracks, &inverse),
            attitude: Jolt {
                angles: step.0.fixed_rows::<2>(3).into_owned(),
                covariance: covariance.fixed_view::<2, 2>(3, 3).into_owned(),
            },
            arc_by_prior: self.prior.map_or_else(Matrix2::zeros, |(_, information)| {
                Matrix2::new(inverse.m11, inverse.m13, inverse.m31, inverse.m33) * information
            }),
            arc: step.arc(),
            arc_covariance,
            floor_homography,
            floor: sums.floor,
            upright: sums.upright,
            variance_factor: refined.scene.variance_factor * self.variance_factor(sums),
            samples,
        })
    }
}

/// The arc that carries a floor point seen at `before` to where it is seen at `after`, both in the robot's frame:
/// before = R(θ) after + V(θ) (s, 0), two equations for s and θ, by Newton's method from θ = 0.
fn arc_through<T: Real>(before: Vector2<T>, after: Vector2<T>) -> Option<PlanarStep<T>> {
    let mut step = PlanarStep::new(before.x - after.x, T::zero(), T::zero());
    for _ in 0..5 {
        let pose = step.pose();
        let residual = before - pose.transform(after);
        let turned = pose.rotation() * after;
        let by_step = step.pose_by_step();
        let along = by_step.fixed_view::<2, 1>(0, 0).into_owned();
        let turning = by_step.fixed_view::<2, 1>(0, 2) + Vector2::new(-turned.y, turned.x);
        let determinant = along.perp(&turning);
        let solvable = determinant.abs() > T::lit(1e-6);
        if !solvable {
            return None;
        }
        let forward = residual.perp(&turning) / determinant;
        let turn = along.perp(&residual) / determinant;
        step = PlanarStep(step.0 + PlanarStep::new(forward, T::zero(), turn).0);
    }
    let plausible = step.0.iter().all(|value| value.is_finite()) && step.arc().y.abs() < T::frac_pi_2();
    plausible.then_some(step)
}

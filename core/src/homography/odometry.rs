//! Visual odometry: the robot's motion picture by picture, measured against keyframes.
use super::jolt::jolted;
use super::motion_likelihood::Track;
use super::{GroundMotion, GroundMotionConfig, Jolt, Match, MotionPrior, NoMotion, ground_motion};
use crate::Real;
use crate::geometry::{Pose, RangeFinder, told_from_noise};
use nalgebra::{Matrix2, Matrix2x3, Matrix2x4, Matrix3, Matrix3x2, Matrix3x4, SymmetricEigen, Vector2};

/// Settings of [`VisualOdometry`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryConfig<T> {
    /// How a step is estimated.
    pub motion: GroundMotionConfig<T>,
    /// How fast the robot changes its speed, m/s².
    pub acceleration_std: T,
    /// How fast the robot changes its turn rate, rad/s².
    pub turn_acceleration_std: T,
    /// Speed and turn rate of a robot of which nothing has been measured yet, m/s and rad/s: what bridges a picture whose
    /// motion is not measured, until the robot has shown how it drives.
    pub rest_std: [T; 2],
    /// Sideways error for each metre driven.
    pub slip: T,
    /// Path after which the picture becomes the keyframe, in heights of the camera.
    pub keyframe_path: T,
    /// Turn after which the picture becomes the keyframe, rad.
    pub keyframe_turn: T,
    /// Matches on the floor below which the picture becomes the keyframe.
    pub keyframe_floor: T,
    /// Matches on the floor below which it tells no motion: a few may all be what a floor mirrors.
    pub least_floor: T,
}

impl<T: Real> Default for OdometryConfig<T> {
    fn default() -> Self {
        Self {
            motion: GroundMotionConfig { scale_noise: true, ..GroundMotionConfig::default() },
            acceleration_std: T::lit(2.0),
            turn_acceleration_std: T::lit(2.0),
            rest_std: [T::lit(1.0), T::lit(0.5)],
            slip: T::lit(0.002),
            keyframe_path: T::lit(0.5),
            keyframe_turn: T::lit(0.15),
            keyframe_floor: T::lit(20.0),
            least_floor: T::zero(),
        }
    }
}

/// Where the camera is against its keyframe, and how fast it moved last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisualOdometry<T> {
    /// keyframe_robot_from_robot, at the last picture, with its covariance.
    since_keyframe: Pose<T>,
    since_keyframe_covariance: Matrix3<T>,
    since_keyframe_by_mount: Matrix3x4<T>,
    since_keyframe_by_wheels: Matrix3<T>,
    /// What the wheels alone say since the keyframe, and the covariance of its arc: the pictures' part of the last step
    /// must not come back as a prior, since this step's matches share the keyframe's noise with it.
    wheels: (Pose<T>, Matrix2<T>),
    /// Last (v, ω) with its covariance, once there is one.
    velocity: Option<(Vector2<T>, Matrix2<T>)>,
    habits: Habits<T>,
    /// Since the motion was measured last.
    blind: Blind<T>,
}

/// How the robot has driven so far, in (v, ω).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Habits<T> {
    /// Its largest speed and turn rate.
    reach: Vector2<T>,
    /// Squares of the changes from one picture to the next, added up, and how many.
    changes: (Vector2<T>, T),
}

/// Pictures in a row whose motion was not measured, bridged by the last velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Blind<T> {
    pictures: T,
    seconds: T,
    /// Of path and turn since then.
    variance: Vector2<T>,
}

/// Pictures that what is assumed of a robot's changes of speed counts for, beside those that were seen.
const ASSUMED: f64 = 10.0;

impl<T: Real> Habits<T> {
    fn new() -> Self {
        Self { reach: Vector2::zeros(), changes: (Vector2::zeros(), T::zero()) }
    }

    fn note(&mut self, velocity: &Vector2<T>, before: Option<Vector2<T>>) {
        self.reach = self.reach.zip_map(velocity, |most, now| most.max(now.abs()));
        if let Some(before) = before {
            let change = velocity - before;
            self.changes.0 += change.component_mul(&change);
            self.changes.1 += T::one();
        }
    }

    /// Variances of (v, ω) so many pictures after a velocity of these variances was measured: it changes as it did before,
    /// and does not leave what the robot can do.
    fn variances(&self, config: &OdometryConfig<T>, start: &Vector2<T>, pictures: T) -> Vector2<T> {
        let assumed = T::lit(ASSUMED);
        let [speed, turn] = config.rest_std;
        let (rest, (squares, count)) = (Vector2::new(speed * speed, turn * turn), self.changes);
        // Half of what it is at rest, which a robot may take up between two pictures.
        let change = (squares + rest * (assumed * T::lit(0.25))) / (count + assumed);
        let seen = self.reach.component_mul(&self.reach);
        let most = if count > assumed { Vector2::new(seen.x, seen.y.max(rest.y)) } else { seen.sup(&rest) };
        (start + change * pictures).inf(&most)
    }
}

impl<T: Real> Blind<T> {
    fn not() -> Self {
        Self { pictures: T::zero(), seconds: T::zero(), variance: Vector2::zeros() }
    }
}

/// What a picture told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryReport<T> {
    /// The motion from the keyframe to this picture, or why there is none.
    pub motion: Result<GroundMotion<T>, NoMotion>,
    /// How the camera was knocked between the keyframe and this picture, if it was.
    pub jolt: Option<Jolt<T>>,
    /// previous_robot_from_robot: the step since the last picture.
    pub increment: Pose<T>,
    /// Covariance of the increment (dx, dy, dθ). Along a keyframe's pictures they add up to the keyframe's own
    /// motion's covariance, not to more: errors against one keyframe do not accumulate.
    pub increment_covariance: Matrix3<T>,
    /// ∂increment/∂(height, tilt, roll, yaw) of the mount, whose error all steps share.
    pub increment_by_mount: Matrix3x4<T>,
    /// ∂increment/∂(the wheels' errors): a share of their travel, a share of their turn, and a turn for each metre
    /// ([`Filter::wheels_error`](crate::slam::Filter::wheels_error)); zero without wheels.
    pub increment_by_wheels: Matrix3<T>,
    /// How the wheels differ from the pictures, where a keyframe ends that both have measured.
    pub disagreement: Option<Disagreement<T>>,
    /// Whether the increment comes from the pictures; else it is the prior: odometry, or the last velocity held.
    pub measured: bool,
    /// Whether the caller must keep this picture's features as those of the new keyframe.
    pub new_keyframe: bool,
}

/// The wheels' motion since the keyframe minus the fused motion of wheels and pictures: evidence of the mount's errors, which only
/// the pictures see, and of the wheels' own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement<T> {
    /// In path (m) and turn (rad).
    pub arc: Vector2<T>,
    /// Its covariance.
    pub covariance: Matrix2<T>,
    /// Its derivative with respect to the errors of the mount's height, tilt, roll and yaw.
    pub by_mount: Matrix2x4<T>,
    /// And with respect to those of the wheels.
    pub by_wheels: Matrix2x3<T>,
}

impl<T: Real> Default for VisualOdometry<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> VisualOdometry<T> {
    /// The state at the first picture, which is the first keyframe.
    pub fn new() -> Self {
        Self {
            since_keyframe: Pose::default(),
            since_keyframe_covariance: Matrix3::zeros(),
            since_keyframe_by_mount: Matrix3x4::zeros(),
            since_keyframe_by_wheels: Matrix3::zeros(),
            wheels: (Pose::default(), Matrix2::zeros()),
            velocity: None,
            habits: Habits::new(),
            blind: Blind::not(),
        }
    }

    /// The motion over a picture whose features were matched with the keyframe's: `matches` run from the keyframe to
    /// this picture, `dt` is the time since the last picture (s), `odometry` the wheels' step since then, if there
    /// are wheels; `tracks` is memory to work in, a place for each match.
    ///
    /// Nothing is known of the first step's length without odometry; from then on the last velocity, changed by the
    /// accelerations of the configuration, helps to find it. Where the pictures give none, the last velocity itself
    /// stands in for it, with what the robot can do in that time: velocities that are wrong stay wrong, so that the
    /// deviation of the path grows with the time since the last measured picture, not with its root.
    pub fn step(
        &mut self,
        config: &OdometryConfig<T>,
        finder: &RangeFinder<T>,
        matches: &[Match<T>],
        dt: T,
        odometry: Option<&MotionPrior<T>>,
        tracks: &mut [Track<T>],
    ) -> OdometryReport<T> {
        let prior = self.prior(config, dt, odometry);
        let rigid = ground_motion(&config.motion, finder, matches, prior.as_ref(), tracks);
        let jolted = jolted(&rigid, &config.motion, finder, matches, prior.as_ref(), tracks);
        let (motion, jolt) = jolted.map_or((rigid, None), |(motion, jolt)| (Ok(motion), Some(jolt)));
        let known = odometry.and(prior.as_ref());
        let motion = motion.and_then(|motion| match known {
            _ if motion.floor < config.least_floor => Err(NoMotion::NoConsensus),
            Some(wheels) if knows_less(&motion, wheels) => Err(NoMotion::Degenerate),
            _ => Ok(motion),
        });
        let by_wheels = known.map_or_else(Matrix2x3::zeros, |wheels| arc_by_wheels(wheels));
        let Step { increment, covariance: mut increment_covariance, by_mount, by_wheels } = match &motion {
            Ok(motion) => self.follow(motion, &by_wheels, dt),
            Err(_) => self.coast(config, odometry, dt),
        };
        let disagreement = match (&motion, odometry) {
            (Ok(motion), Some(_)) if jolt.is_none() => prior.map(|wheels| disagreement(&wheels, motion)),
            _ => None,
        };
        let slip = config.slip * increment.position().norm();
        increment_covariance.m22 += slip * slip;
        // As far as the next picture will be.
        let path = self.since_keyframe.position().norm() + increment.position().norm();
        let turn = self.since_keyframe.heading.abs() + increment.heading.abs();
        let new_keyframe = motion.as_ref().map_or(true, |motion| motion.floor < config.keyframe_floor)
            || jolt.is_some()
            || path > config.keyframe_path * finder.mount().height()
            || turn > config.keyframe_turn;
        if new_keyframe {
            let Self { velocity, habits, blind, .. } = *self;
            *self = Self { velocity, habits, blind, ..Self::new() };
        }
        OdometryReport {
            measured: motion.is_ok(),
            disagreement: disagreement.filter(|_| new_keyframe),
            motion,
            jolt,
            increment,
            increment_covariance,
            increment_by_mount: by_mount,
            increment_by_wheels: by_wheels,
            new_keyframe,
        }
    }

    /// The turn since the keyframe that these matches or what is known beforehand tell, and how far it may be off (rad): what
    /// [`step`](Self::step) would find, without taking it.
    #[cfg(feature = "alloc")]
    pub fn turn(
        &self,
        config: &OdometryConfig<T>,
        finder: &RangeFinder<T>,
        matches: &[Match<T>],
        dt: T,
        odometry: Option<&MotionPrior<T>>,
    ) -> (T, T) {
        let mut tracks = alloc::vec![Track::default(); matches.len()];
        let prior = { *self }.prior(config, dt, odometry);
        let motion = ground_motion(&config.motion, finder, matches, prior.as_ref(), &mut tracks);
        let (arc, covariance) = match (motion, prior) {
            (Ok(motion), _) => (motion.arc, motion.arc_covariance),
            (_, Some(prior)) => (prior.arc, prior.covariance),
            _ => (Vector2::zeros(), Matrix2::identity()),
        };
        (arc.y, covariance.m22.sqrt() * T::lit(6.0))
    }

    /// What is known of the motion since the keyframe beforehand: the wheels', this step's too, or the last velocity held.
    fn prior(
        &mut self,
        config: &OdometryConfig<T>,
        dt: T,
        odometry: Option<&MotionPrior<T>>,
    ) -> Option<MotionPrior<T>> {
        match odometry {
            Some(step) => Some(self.wheels_since_keyframe(step)),
            None => self.held_velocity(config, dt).map(|step| self.prior_since_keyframe(&step)),
        }
    }

    fn held_velocity(&self, config: &OdometryConfig<T>, dt: T) -> Option<MotionPrior<T>> {
        let (velocity, covariance) = self.velocity?;
        let change = Vector2::new(config.acceleration_std, config.turn_acceleration_std) * (dt * dt);
        let change = Matrix2::from_diagonal(&change.component_mul(&change));
        Some(MotionPrior { arc: velocity * dt, covariance: covariance * (dt * dt) + change })
    }

    /// The wheels' step since the last picture, added to theirs since the keyframe.
    fn wheels_since_keyframe(&mut self, step: &MotionPrior<T>) -> MotionPrior<T> {
        let (pose, covariance) = self.wheels;
        self.wheels = (pose.compose(&arc_pose(step.arc)), covariance + step.covariance);
        MotionPrior { arc: arc_to(&self.wheels.0), covariance: self.wheels.1 }
    }

    /// The step expected since the last picture, carried on from the keyframe.
    fn prior_since_keyframe(&self, step: &MotionPrior<T>) -> MotionPrior<T> {
        let pose = self.since_keyframe.compose(&arc_pose(step.arc));
        let before = &self.since_keyframe_covariance;
        let known = Matrix2::new(before.m11, before.m13, before.m31, before.m33);
        MotionPrior { arc: arc_to(&pose), covariance: step.covariance + known }
    }

    fn follow(&mut self, motion: &GroundMotion<T>, wheels: &Matrix2x3<T>, dt: T) -> Step<T> {
        let increment = self.since_keyframe.inverse().compose(&motion.pose);
        // Σ_increment = R₀ᵀ (Σ_now − F Σ_before Fᵀ) R₀, with F how the earlier pose's error carries on.
        let moved = motion.pose.position() - self.since_keyframe.position();
        let one = T::one();
        let zero = T::zero();
        let carry = Matrix3::new(one, zero, -moved.y, zero, one, moved.x, zero, zero, one);
        let gained = motion.covariance - carry * self.since_keyframe_covariance * carry.transpose();
        let turn = turned(&self.since_keyframe);
        let covariance = positive_part(&(turn.transpose() * gained * turn), &motion.covariance);
        let before = self.velocity.filter(|_| self.blind == Blind::not()).map(|(velocity, _)| velocity);
        self.blind = Blind::not();
        self.velocity = (dt > zero).then(|| {
            let arc = Vector2::new(increment.x, increment.heading);
            self.habits.note(&(arc / dt), before);
            let spread = Matrix2::new(covariance.m11, covariance.m13, covariance.m31, covariance.m33);
            (arc / dt, spread / (dt * dt))
        });
        let by_mount = turn.transpose() * (motion.by_mount - carry * self.since_keyframe_by_mount);
        let now = pose_by_arc(motion.arc) * motion.arc_by_prior * wheels;
        let by_wheels = turn.transpose() * (now - carry * self.since_keyframe_by_wheels);
        self.since_keyframe = motion.pose;
        self.since_keyframe_covariance = motion.covariance;
        self.since_keyframe_by_mount = motion.by_mount;
        self.since_keyframe_by_wheels = now;
        Step { increment, covariance, by_mount, by_wheels }
    }

    /// No motion was measured: the wheels', and without them the last velocity's.
    fn coast(&mut self, config: &OdometryConfig<T>, wheels: Option<&MotionPrior<T>>, dt: T) -> Step<T> {
        let step = match wheels {
            Some(step) => {
                self.velocity = (dt > T::zero()).then(|| (step.arc / dt, step.covariance / (dt * dt)));
                *step
            }
            None => self.bridge(config, dt),
        };
        let pose = arc_pose(step.arc);
        let by_arc = pose_by_arc(step.arc);
        self.since_keyframe = self.since_keyframe.compose(&pose);
        Step {
            increment: pose,
            covariance: by_arc * step.covariance * by_arc.transpose(),
            by_mount: Matrix3x4::zeros(),
            by_wheels: wheels.map_or_else(Matrix3::zeros, |wheels| by_arc * arc_by_wheels(wheels)),
        }
    }

    /// The step of the last velocity, with what the path since it was measured is more uncertain than before the step.
    fn bridge(&mut self, config: &OdometryConfig<T>, dt: T) -> MotionPrior<T> {
        let [speed, turn] = config.rest_std;
        let rest = || (Vector2::zeros(), Matrix2::new(speed * speed, T::zero(), T::zero(), turn * turn));
        let (velocity, covariance) = self.velocity.unwrap_or_else(rest);
        let before = self.blind.variance;
        let blind = &mut self.blind;
        blind.pictures += T::one();
        blind.seconds += dt;
        let rates = self.habits.variances(config, &covariance.diagonal(), blind.pictures);
        blind.variance = (rates * (blind.seconds * blind.seconds)).sup(&before);
        let gained = Matrix2::from_diagonal(&(blind.variance - before));
        MotionPrior { arc: velocity * dt, covariance: gained }
    }
}

/// A step since the last picture.
struct Step<T> {
    increment: Pose<T>,
    covariance: Matrix3<T>,
    by_mount: Matrix3x4<T>,
    by_wheels: Matrix3<T>,
}

/// Whether pictures and wheels together know an arc less by far than the wheels alone: then the matches contradict each other.
/// Twice the deviation is what a few of them may leave. A velocity that is held is a guess, and no such judge.
fn knows_less<T: Real>(motion: &GroundMotion<T>, wheels: &MotionPrior<T>) -> bool {
    let most = wheels.covariance * T::lit(4.0);
    motion.arc_covariance.m11 > most.m11 || motion.arc_covariance.m22 > most.m22
}

fn disagreement<T: Real>(wheels: &MotionPrior<T>, motion: &GroundMotion<T>) -> Disagreement<T> {
    // The path lies along the chord, which has turned by half the arc.
    let (sin, cos) = (motion.arc.y * T::lit(0.5)).sin_cos();
    let along = motion.by_mount.row(0) * cos + motion.by_mount.row(1) * sin;
    Disagreement {
        arc: wheels.arc - motion.arc,
        covariance: wheels.covariance + motion.arc_covariance,
        by_mount: Matrix2x4::from_rows(&[along, motion.by_mount.row(2).into_owned()]),
        by_wheels: (motion.arc_by_prior - Matrix2::identity()) * arc_by_wheels(wheels),
    }
}

/// ∂(path, turn)/∂(the wheels' errors).
fn arc_by_wheels<T: Real>(wheels: &MotionPrior<T>) -> Matrix2x3<T> {
    let (path, turn) = (wheels.arc.x, told_from_noise(wheels.arc.y, wheels.covariance.m22));
    Matrix2x3::new(path, T::zero(), T::zero(), T::zero(), turn, path)
}

fn pose_by_arc<T: Real>(arc: Vector2<T>) -> Matrix3x2<T> {
    let by_step = super::planar::PlanarStep::new(arc.x, T::zero(), arc.y).pose_by_step();
    Matrix3x2::from_columns(&[by_step.column(0), by_step.column(2)])
}

fn arc_pose<T: Real>(arc: Vector2<T>) -> Pose<T> {
    super::planar::PlanarStep::new(arc.x, T::zero(), arc.y).pose()
}

/// Path and turn of an arc that ends there.
fn arc_to<T: Real>(pose: &Pose<T>) -> Vector2<T> {
    let path = pose.position().norm();
    Vector2::new(if pose.x < T::zero() { -path } else { path }, pose.heading)
}

fn turned<T: Real>(pose: &Pose<T>) -> Matrix3<T> {
    pose.rotation().to_homogeneous()
}

/// The covariance with its eigenvalues held above a hundredth of the whole's: the difference of two estimates'
/// covariances need not be one.
fn positive_part<T: Real>(difference: &Matrix3<T>, whole: &Matrix3<T>) -> Matrix3<T> {
    let symmetric = (difference + difference.transpose()) * T::lit(0.5);
    // Metres and radians apart: scale to correlations of the whole first.
    let scale = whole.diagonal().map(|variance| variance.max(T::lit(1e-12)).sqrt());
    let inverse = scale.map(|value| T::one() / value);
    let scaled = Matrix3::from_diagonal(&inverse) * symmetric * Matrix3::from_diagonal(&inverse);
    // Bounded, for its iteration does not end on numbers that are not finite.
    let Some(mut eigen) = SymmetricEigen::try_new(scaled, T::default_epsilon(), 100) else { return *whole };
    eigen.eigenvalues.apply(|value| *value = value.max(T::lit(0.01)));
    let back = Matrix3::from_diagonal(&scale);
    back * eigen.recompose() * back
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Camera, Mount};

    #[test]
    fn pictures_without_a_motion_are_bridged_by_what_the_robot_does_in_that_time() {
        let camera = Camera::new(320, 240, [365.0_f64; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
        let mut odometry = VisualOdometry::new();
        let straight = Vector2::new(0.2, 0.0);
        (0..50).for_each(|_| odometry.habits.note(&straight, Some(straight)));
        odometry.velocity = Some((straight, Matrix2::identity() * 1e-4));
        let mut turned = 0.0;
        let turned = [(); 4].map(|()| {
            let report = odometry.step(&OdometryConfig::default(), &finder, &[], 0.6, None, &mut []);
            assert!(!report.measured && (report.increment.x - 0.12).abs() < 1e-9);
            turned += report.increment_covariance.m33;
            f64::sqrt(turned)
        });
        // Within one picture it hardly turns; four that are missed can hide a bend. It never turns faster than it can.
        assert!(turned[0] > 0.03 && turned[0] < 0.1, "{turned:?}");
        assert!(turned[3] > 4.0 * turned[0] && turned[3] < 4.0 * 0.6 * 0.5, "{turned:?}");
    }

    #[test]
    fn a_first_picture_without_a_motion_is_bridged_by_what_any_robot_does() {
        let camera = Camera::new(320, 240, [365.0_f64; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
        let report = VisualOdometry::new().step(&OdometryConfig::default(), &finder, &[], 0.1, None, &mut []);
        let std = report.increment_covariance.diagonal().map(f64::sqrt);
        assert!((std.x - 0.1).abs() < 0.01 && (std.z - 0.05).abs() < 0.01, "{std}");
    }
}

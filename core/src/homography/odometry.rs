//! Visual odometry: the robot's motion picture by picture, measured against keyframes.
use super::motion_likelihood::Track;
use super::{GroundMotion, GroundMotionConfig, Match, MotionPrior, NoMotion, ground_motion};
use crate::Real;
use crate::geometry::{Pose, RangeFinder};
use nalgebra::{Matrix2, Matrix2x4, Matrix3, Matrix3x4, SymmetricEigen, Vector2};

/// Settings of [`VisualOdometry`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryConfig<T> {
    /// How a step is estimated.
    pub motion: GroundMotionConfig<T>,
    /// How fast the robot changes its speed, m/s².
    pub acceleration_std: T,
    /// How fast the robot changes its turn rate, rad/s².
    pub turn_acceleration_std: T,
    /// Sideways error for each metre driven.
    pub slip: T,
    /// Path after which the picture becomes the keyframe, in heights of the camera.
    pub keyframe_path: T,
    /// Turn after which the picture becomes the keyframe, rad.
    pub keyframe_turn: T,
    /// Matches on the floor below which the picture becomes the keyframe.
    pub keyframe_floor: T,
}

impl<T: Real> Default for OdometryConfig<T> {
    fn default() -> Self {
        Self {
            motion: GroundMotionConfig { scale_noise: true, ..GroundMotionConfig::default() },
            acceleration_std: T::lit(2.0),
            turn_acceleration_std: T::lit(2.0),
            slip: T::lit(0.002),
            keyframe_path: T::lit(0.5),
            keyframe_turn: T::lit(0.15),
            keyframe_floor: T::lit(20.0),
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
    /// What the wheels alone say since the keyframe, and the covariance of its arc: the pictures' part of the last step
    /// must not come back as a prior, since this step's matches share the keyframe's noise with it.
    wheels: (Pose<T>, Matrix2<T>),
    /// Last (v, ω) with its covariance, once there is one.
    velocity: Option<(Vector2<T>, Matrix2<T>)>,
}

/// What a picture told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryReport<T> {
    /// The motion from the keyframe to this picture, or why there is none.
    pub motion: Result<GroundMotion<T>, NoMotion>,
    /// previous_robot_from_robot: the step since the last picture.
    pub increment: Pose<T>,
    /// Covariance of the increment (dx, dy, dθ). Along a keyframe's pictures they add up to the keyframe's own
    /// motion's covariance, not to more: errors against one keyframe do not accumulate.
    pub increment_covariance: Matrix3<T>,
    /// ∂increment/∂(height, tilt, roll, yaw) of the mount, whose error all steps share.
    pub increment_by_mount: Matrix3x4<T>,
    /// How the wheels differ from the pictures, where a keyframe ends that both have measured.
    pub disagreement: Option<Disagreement<T>>,
    /// Whether the increment comes from the pictures; else it is the prior: odometry, or the last velocity held.
    pub measured: bool,
    /// Whether the caller must keep this picture's features as those of the new keyframe.
    pub new_keyframe: bool,
}

/// The wheels' motion since the keyframe minus the fused motion of wheels and pictures: evidence of the mount's errors, which only
/// the pictures see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement<T> {
    /// In path (m) and turn (rad).
    pub arc: Vector2<T>,
    /// Its covariance.
    pub covariance: Matrix2<T>,
    /// Its derivative with respect to the errors of the mount's height, tilt, roll and yaw.
    pub by_mount: Matrix2x4<T>,
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
            wheels: (Pose::default(), Matrix2::zeros()),
            velocity: None,
        }
    }

    /// The motion over a picture whose features were matched with the keyframe's: `matches` run from the keyframe to
    /// this picture, `dt` is the time since the last picture (s), `odometry` the wheels' step since then, if there
    /// are wheels; `tracks` receives where each match's point is.
    ///
    /// Nothing is known of the first step's length without odometry; from then on the last velocity, changed by the
    /// accelerations of the configuration, stands in for it.
    pub fn step(
        &mut self,
        config: &OdometryConfig<T>,
        finder: &RangeFinder<T>,
        matches: &[Match<T>],
        dt: T,
        odometry: Option<&MotionPrior<T>>,
        tracks: &mut [Track<T>],
    ) -> OdometryReport<T> {
        let held = self.held_velocity(config, dt);
        let prior = match odometry {
            Some(step) => Some(self.wheels_since_keyframe(step)),
            None => held.map(|step| self.prior_since_keyframe(&step)),
        };
        let motion = ground_motion(&config.motion, finder, matches, prior.as_ref(), tracks);
        let (increment, mut increment_covariance, increment_by_mount) = match &motion {
            Ok(motion) => self.follow(motion, dt),
            Err(_) => self.coast(odometry.or(held.as_ref()), dt),
        };
        let disagreement = match (&motion, odometry) {
            (Ok(motion), Some(_)) => prior.map(|wheels| disagreement(&wheels, motion)),
            _ => None,
        };
        let slip = config.slip * increment.position().norm();
        increment_covariance.m22 += slip * slip;
        let path = self.since_keyframe.position().norm();
        let new_keyframe = motion.as_ref().map_or(true, |motion| motion.floor < config.keyframe_floor)
            || path > config.keyframe_path * finder.mount().height()
            || self.since_keyframe.heading.abs() > config.keyframe_turn;
        if new_keyframe {
            *self = Self { velocity: self.velocity, ..Self::new() };
        }
        OdometryReport {
            measured: motion.is_ok(),
            disagreement: disagreement.filter(|_| new_keyframe),
            motion,
            increment,
            increment_covariance,
            increment_by_mount,
            new_keyframe,
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

    fn follow(&mut self, motion: &GroundMotion<T>, dt: T) -> (Pose<T>, Matrix3<T>, Matrix3x4<T>) {
        let increment = self.since_keyframe.inverse().compose(&motion.pose);
        // Σ_increment = R₀ᵀ (Σ_now − F Σ_before Fᵀ) R₀, with F how the earlier pose's error carries on.
        let moved = motion.pose.position() - self.since_keyframe.position();
        let one = T::one();
        let zero = T::zero();
        let carry = Matrix3::new(one, zero, -moved.y, zero, one, moved.x, zero, zero, one);
        let gained = motion.covariance - carry * self.since_keyframe_covariance * carry.transpose();
        let turn = turned(&self.since_keyframe);
        let covariance = positive_part(&(turn.transpose() * gained * turn), &motion.covariance);
        self.velocity = (dt > zero).then(|| {
            let arc = Vector2::new(increment.x, increment.heading);
            let spread = Matrix2::new(covariance.m11, covariance.m13, covariance.m31, covariance.m33);
            (arc / dt, spread / (dt * dt))
        });
        let by_mount = turn.transpose() * (motion.by_mount - carry * self.since_keyframe_by_mount);
        self.since_keyframe = motion.pose;
        self.since_keyframe_covariance = motion.covariance;
        self.since_keyframe_by_mount = motion.by_mount;
        (increment, covariance, by_mount)
    }

    /// No motion was measured: the prior's, and without one a step of unknown length.
    fn coast(&mut self, expected: Option<&MotionPrior<T>>, dt: T) -> (Pose<T>, Matrix3<T>, Matrix3x4<T>) {
        let unknown = MotionPrior { arc: Vector2::zeros(), covariance: Matrix2::identity() };
        let step = expected.copied().unwrap_or(unknown);
        self.velocity = (dt > T::zero()).then(|| (step.arc / dt, step.covariance / (dt * dt)));
        let pose = arc_pose(step.arc);
        let by_arc = super::planar::PlanarStep::new(step.arc.x, T::zero(), step.arc.y).pose_by_step();
        let by_arc = nalgebra::Matrix3x2::from_columns(&[by_arc.column(0), by_arc.column(2)]);
        self.since_keyframe = self.since_keyframe.compose(&pose);
        (pose, by_arc * step.covariance * by_arc.transpose(), Matrix3x4::zeros())
    }
}

fn disagreement<T: Real>(wheels: &MotionPrior<T>, motion: &GroundMotion<T>) -> Disagreement<T> {
    // The path lies along the chord, which has turned by half the arc.
    let (sin, cos) = (motion.arc.y * T::lit(0.5)).sin_cos();
    let along = motion.by_mount.row(0) * cos + motion.by_mount.row(1) * sin;
    Disagreement {
        arc: wheels.arc - motion.arc,
        covariance: wheels.covariance + motion.arc_covariance,
        by_mount: Matrix2x4::from_rows(&[along, motion.by_mount.row(2).into_owned()]),
    }
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

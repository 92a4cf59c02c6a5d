//! The wheels' readings, and how far they can be believed.
use crate::Result;
use crate::setting::{self, settings};
use crate::slam::{Increment, Integration};
use nalgebra::{Matrix2, Matrix3, Vector3};

/// How well the robot's wheels tell its motion.
///
/// The standard deviations of one reading (v, ω) that held for Δt seconds are
///
/// ```text
/// σ_v² = (speed_by_speed · v)² + speed_floor²
/// σ_ω² = (turn_by_turn · ω)² + (turn_by_speed · v)² + turn_floor²
/// ```
///
/// taken as independent from reading to reading, and as constant during one. Increments (d_x, d_y, Δθ) since the
/// reading before are treated alike, with v Δt the distance driven; what lies across the robot gets
/// `slip_by_speed` of it.
///
/// What the wheels read wrongly all the time is no noise of that kind. The last three numbers are the standard deviations of
/// such errors before anything is measured: the filter has them as states ([`predict_driven`](crate::slam::Filter::predict_driven))
/// and finds them against the map. With all three 0 the wheels are taken at their word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionNoise {
    /// Speed error for each m/s.
    pub speed_by_speed: f32,
    /// Turn rate error for each rad/s.
    pub turn_by_turn: f32,
    /// Turn rate error for each m/s, rad/m.
    pub turn_by_speed: f32,
    /// Sideways error for each metre driven.
    pub slip_by_speed: f32,
    /// Speed error at rest, m/s.
    pub speed_floor: f32,
    /// Turn rate error at rest, rad/s.
    pub turn_floor: f32,
    /// Share of the way that the wheels leave out or add, all the time.
    pub speed_scale: f32,
    /// Share of the turn.
    pub turn_scale: f32,
    /// Turn that comes with each metre, rad/m, as where one wheel is larger than the other.
    pub turn_bias: f32,
}

impl Default for MotionNoise {
    fn default() -> Self {
        Self {
            speed_by_speed: 0.05,
            turn_by_turn: 0.05,
            turn_by_speed: 0.05,
            slip_by_speed: 0.01,
            speed_floor: 1e-3,
            turn_floor: 1e-3,
            speed_scale: 0.0,
            turn_scale: 0.0,
            turn_bias: 0.0,
        }
    }
}

impl MotionNoise {
    /// The noise itself if every number can be used.
    ///
    /// # Errors
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) for a number that is not finite or below 0.
    pub fn validated(self) -> Result<Self> {
        let mut noise = self;
        setting::check(&MOTION_NOISE, &mut noise)?;
        Ok(self)
    }

    /// The same for wheels that nobody has measured: what a host takes where the rig does not say.
    pub fn with_scales(self) -> Self {
        Self { speed_scale: 0.03, turn_scale: 0.01, turn_bias: 0.001, ..self }
    }

    /// The same for wheels that are right on average.
    pub fn without_scales(self) -> Self {
        Self { speed_scale: 0.0, turn_scale: 0.0, turn_bias: 0.0, ..self }
    }

    /// Standard deviations of what is wrong all the time, as the filter's states have them; `None` where nothing is.
    pub(super) fn scale_std(&self) -> Option<[f32; 3]> {
        let stds = [self.speed_scale, self.turn_scale, self.turn_bias];
        // One that is known exactly is a state that hardly moves: the filter wants variances above 0.
        stds.iter().any(|std| *std > 0.0).then(|| stds.map(|std| std.max(1e-6)))
    }

    /// The step that a reading makes, with its covariance.
    pub fn increment(&self, odometry: &Odometry) -> Increment<f32> {
        match *odometry {
            Odometry::Velocity { v, omega, seconds } => {
                let ([v_part, omega_part], [v_floor, omega_floor]) =
                    (self.proportional(v, omega), self.floors());
                let covariance = Matrix2::new(v_part + v_floor, 0.0, 0.0, omega_part + omega_floor);
                Increment::from_velocity(v, omega, seconds, &covariance, Integration::Arc)
            }
            Odometry::Increment { forward, left, turn, seconds } => {
                // As velocities over one second; only the floors depend on how long it took.
                let distance = libm::sqrtf(forward * forward + left * left);
                let [along, heading] = self.proportional(distance, turn);
                let [speed_floor, turn_floor] = self.floors().map(|var| var * seconds * seconds);
                let across = square(self.slip_by_speed * distance);
                let diagonal = [along + speed_floor, across + speed_floor, heading + turn_floor];
                Increment {
                    delta: Vector3::new(forward, left, turn),
                    covariance: Matrix3::from_diagonal(&diagonal.into()),
                }
            }
        }
    }

    /// Variances of (v, ω) that grow with the motion.
    fn proportional(&self, v: f32, omega: f32) -> [f32; 2] {
        [square(self.speed_by_speed * v), square(self.turn_by_turn * omega) + square(self.turn_by_speed * v)]
    }

    /// Variances of (v, ω) at rest.
    fn floors(&self) -> [f32; 2] {
        [square(self.speed_floor), square(self.turn_floor)]
    }
}

settings! { MOTION_NOISE, MOTION_NOISE_REFERENCES, MotionNoise, "filter" {
    21 speed_by_speed: Number [speed_by_speed] (0, 100), "Standard deviation of the odometry's speed, for each m/s.", "Judgement: near the 0.04 that the simulator draws; measure your robot's.";
    22 turn_by_turn: Number [turn_by_turn] (0, 100), "Standard deviation of the odometry's turn rate, for each rad/s.", "Judgement: the simulator draws 0.05; measure your robot's.";
    23 turn_by_speed: Number [turn_by_speed] (0, 100, "rad/m"), "Standard deviation of the odometry's turn rate, for each m/s.", "Judgement: near the 0.04 that the simulator draws; measure your robot's.";
    24 slip_by_speed: Number [slip_by_speed] (0, 100), "Standard deviation across the robot, for each metre driven (increments only).", "Judgement.";
    25 speed_floor: Number [speed_floor] (0, 100, "m/s"), "Standard deviation of the odometry's speed at rest.", "Judgement: above 0, so that a filter at rest stays positive definite.";
    26 turn_floor: Number [turn_floor] (0, 100, "rad/s"), "Standard deviation of the odometry's turn rate at rest.", "Judgement: as speed_floor.";
    61 speed_scale: Number [speed_scale] (0, 1), "Standard deviation of the share by which the wheels read every way too long or too short; the filter estimates it. With this and the next two 0 the wheels are taken to be right on average.", "0 is what every target has; slam of a host takes 0.03 where the rig gives none of the three: on the simulated corridors 1 to 4 wheels 5 % long are found then, and right ones lose 0.02 % of the path.";
    62 turn_scale: Number [turn_scale] (0, 1), "Standard deviation of the share by which they read every turn too large or too small.", "As speed_scale, 0.01 on a host: with 0.02 one of the four corridors closed on a wrong door.";
    63 turn_bias: Number [turn_bias] (0, 10, "rad/m"), "Standard deviation of the turn that they leave out for each metre driven, as where one wheel is larger than the other.", "As turn_scale, 0.001 on a host.";
}}

fn square(x: f32) -> f32 {
    x * x
}

/// One reading of the robot's odometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Odometry {
    /// Speed (m/s) and turn rate (rad/s) that held for some time.
    Velocity {
        /// Forward, m/s.
        v: f32,
        /// To the left, rad/s.
        omega: f32,
        /// How long.
        seconds: f32,
    },
    /// What the robot moved since the reading before, in its own frame then.
    Increment {
        /// d_x, m.
        forward: f32,
        /// d_y, m.
        left: f32,
        /// Δθ, rad.
        turn: f32,
        /// Since the reading before.
        seconds: f32,
    },
}

impl Odometry {
    /// How long it held.
    pub fn seconds(&self) -> f32 {
        match *self {
            Self::Velocity { seconds, .. } | Self::Increment { seconds, .. } => seconds,
        }
    }
}

//! Wheel odometry with slip.
//!
//! Each line's speed and turn rate are wrong by
//!
//! ```text
//! v̂ = v (1 + b + a n₁),      ω̂ = ω (1 + g + c n₂) + d v n₃,      nᵢ ~ N(0, 1) anew in each line,
//! ```
//!
//! with b ~ N(0, σ_b²), g ~ N(0, σ_g²) drawn once a run (wheels of slightly wrong size). A filter that takes
//! [`OdometryNoise::std`] as white noise is consistent: b and g are far smaller than a and c, so that their sum
//! over a loop stays below the random part's.
use crate::path::Twist;
use crate::random::{Random, Stream};

/// Standard deviations of the odometry's errors, each as a fraction of the motion that causes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryNoise {
    /// a: speed error for each m/s, anew in each line.
    pub speed_by_speed: f64,
    /// c: turn rate error for each rad/s, anew in each line.
    pub turn_by_turn: f64,
    /// d: turn rate error (rad/s) for each m/s, anew in each line.
    pub turn_by_speed: f64,
    /// σ_b: scale error of the speed, once a run.
    pub speed_scale: f64,
    /// σ_g: scale error of the turn rate, once a run.
    pub turn_scale: f64,
}

impl Default for OdometryNoise {
    fn default() -> Self {
        Self {
            speed_by_speed: 0.04,
            turn_by_turn: 0.05,
            turn_by_speed: 0.04,
            speed_scale: 0.0015,
            turn_scale: 0.003,
        }
    }
}

impl OdometryNoise {
    /// The same with every standard deviation multiplied.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            speed_by_speed: self.speed_by_speed * factor,
            turn_by_turn: self.turn_by_turn * factor,
            turn_by_speed: self.turn_by_speed * factor,
            speed_scale: self.speed_scale * factor,
            turn_scale: self.turn_scale * factor,
        }
    }

    /// Standard deviations of (speed, turn rate) of one line of odometry during a motion: what a filter's Q is
    /// built from.
    ///
    /// ```
    /// use monorange_sim::{OdometryNoise, Twist};
    /// let std = OdometryNoise::default().std(Twist { speed: 0.2, turn: 0.0 });
    /// assert!((std.speed - 0.2 * 0.040).abs() < 1e-4);
    /// ```
    pub fn std(&self, motion: Twist) -> Twist {
        let root = |a: f64, b: f64, c: f64| libm::sqrt(a * a + b * b + c * c);
        let Twist { speed, turn } = motion;
        Twist {
            speed: root(self.speed_by_speed * speed, self.speed_scale * speed, 0.0),
            turn: root(self.turn_by_turn * turn, self.turn_scale * turn, self.turn_by_speed * speed),
        }
    }

    /// What the wheels report for the true motions.
    pub(crate) fn measure(&self, motions: &[Twist], seed: u64) -> Vec<Twist> {
        let mut random = Random::new(seed, Stream::Odometry);
        let speed_scale = 1.0 + self.speed_scale * random.normal();
        let turn_scale = 1.0 + self.turn_scale * random.normal();
        let measured = motions.iter().map(|motion| {
            let slip = [random.normal(), random.normal(), random.normal()];
            Twist {
                speed: motion.speed * (speed_scale + self.speed_by_speed * slip[0]),
                turn: motion.turn * (turn_scale + self.turn_by_turn * slip[1])
                    + self.turn_by_speed * motion.speed * slip[2],
            }
        });
        measured.collect()
    }
}

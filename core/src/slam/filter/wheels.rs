//! What the wheels read wrongly all the time, as states: their travel by a share, their turn by a share, and a turn that comes
//! with the travel, as of a wheel that is larger than the other.
//!
//! ```text
//! Δθ⁺ = Δθ (1 + g) + b |d|,      d⁺ = R((Δθ⁺ − Δθ)/2) d (1 + s),      |d| negative when driving back
//! ∂/∂s = (d⁺/(1 + s), 0),    ∂/∂g = (½ Δθ J d⁺, Δθ),    ∂/∂b = (½ |d| J d⁺, |d|)
//! ```
//!
//! | symbol | in code | unit |
//! |---|---|---|
//! | d, Δθ | [`Increment::delta`] as read | m, rad |
//! | s, g, b | [`Filter::wheels_error`]: true minus read | share, share, rad/m |
//!
//! In g's place a turn counts only where it is beyond three deviations of its own noise: of a straight drive the wheels read nothing
//! but noise, and noise times a share is the smaller, the more of it is taken off (regression dilution).
//!
//! The chord of an arc turns by half of what the arc turns. White noise, which [`Increment::covariance`] is, averages out over a
//! drive and these do not: wheels that read 5 % long bend the map, and the white noise promises 0.2 % after 600 steps of 5 %.
//! J. Borenstein and L. Feng, "Measurement and correction of systematic odometry errors in mobile robots", 1996.
//!
//! *Limits.* First order in the errors: 10 % of a step's turn of 0.3 rad.
use super::knock::let_go;
use super::{Covariance, Filter, Parts, ROBOT};
use crate::geometry::told_from_noise;
use crate::slam::covariance::{factored, packed};
use crate::slam::landmark::Landmark;
use crate::slam::models::Increment;
use crate::{Real, Result};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// What of the prior's deviations comes back over a metre driven: tyres lose air, and another floor has another grip. After 100 m
/// that is a fifth of them.
const WALK: f64 = 0.02;

impl<T: Real, S: AsRef<[T]> + AsMut<[T]>, L: AsRef<[Landmark<T>]> + AsMut<[Landmark<T>]>> Filter<T, S, L> {
    /// Predicts the robot's motion up to `time` seconds by a step that its wheels read. Where their errors are states, it is
    /// corrected by them and the robot's rows get their share; elsewhere this is [`predict`](Self::predict).
    ///
    /// # Errors
    /// As [`predict`](Self::predict).
    pub fn predict_driven(&mut self, time: f64, read: &Increment<T>) -> Result<()> {
        let turn = self.pose().rotation().to_homogeneous();
        let (step, by_wheels) = self.driven(read);
        self.predict(time, &step)?;
        self.predict_by_wheels(&(turn * by_wheels), step.delta.xy().norm());
        Ok(())
    }

    /// A step of the wheels as it is with their errors as estimated, and its derivative with respect to them.
    pub fn driven(&self, read: &Increment<T>) -> (Increment<T>, Matrix3<T>) {
        let Some(error) = self.wheels_error() else { return (*read, Matrix3::zeros()) };
        let [scale, turn_scale, bias]: [T; 3] = error.into();
        let (path, turn): (Vector2<T>, T) = (read.delta.xy(), read.delta.z);
        let way = if path.x < T::zero() { -path.norm() } else { path.norm() };
        let half = T::lit(0.5);
        let turned = told_from_noise(turn, read.covariance.m33);
        let more = turned * turn_scale + way * bias;
        let (sin, cos) = (more * half).sin_cos();
        let bent = Matrix2::new(cos, -sin, sin, cos) * path;
        let path = bent * (T::one() + scale);
        let across = Vector2::new(-path.y, path.x) * half;
        let by_wheels = Matrix3::from_columns(&[
            bent.push(T::zero()),
            (across * turned).push(turned),
            (across * way).push(way),
        ]);
        (Increment { delta: path.push(turn + more), covariance: read.covariance }, by_wheels)
    }

    /// The robot's rows' share of the wheels' errors after a step of so many metres, `by_wheels` in the world.
    pub(super) fn predict_by_wheels(&mut self, by_wheels: &Matrix3<T>, metres: T) {
        let Some(stds) = self.config.wheels_std else { return };
        let (at, form) = (self.wheels_at(), self.config.covariance);
        let Parts { work, mut p, .. } = self.parts();
        // The column before the wheels' makes them four, as the mount's are; nothing comes of it.
        let four = by_wheels.insert_column(0, T::zero());
        match form {
            Covariance::Packed => packed::predict_shared(&mut p, at - 1, &four),
            Covariance::Factored => factored::predict_shared(&mut p, at - 1, &four),
        }
        for (index, std) in stds.into_iter().enumerate() {
            let walk = T::lit(WALK) * std;
            let gained = walk * walk * metres;
            match form {
                Covariance::Packed => p.set(at + index, at + index, p.at(at + index, at + index) + gained),
                Covariance::Factored => factored::add_variance(&mut p, at + index, gained, work),
            }
        }
    }

    /// Squares of how many of their prior's deviations the mount's and the wheels' errors have moved, the largest of each, the
    /// mount's angles having been let go so often, and swaying; 0 where they are no states.
    pub(in crate::slam) fn moved(&self, knocks: u32) -> [T; 2] {
        let largest = |at: usize, stds: &[T], more: [T; 4]| {
            let variances = stds.iter().zip(more).map(|(std, more)| *std * *std + more);
            let squares = (at..).zip(variances).map(|(at, variance)| self.x(at) * self.x(at) / variance);
            squares.fold(T::zero(), |most: T, square| most.max(square))
        };
        let (mount, wheels) = (self.config.mount_std, self.config.wheels_std);
        let knocks = T::lit(f64::from(knocks));
        let sway = self.config.sway * self.config.sway;
        let [height, tilt, roll, yaw] = let_go().map(|variance: T| variance * knocks);
        let more = [height, tilt + sway, roll + sway, yaw];
        [
            mount.map_or(T::zero(), |stds| largest(ROBOT, &stds, more)),
            wheels.map_or(T::zero(), |stds| largest(self.wheels_at(), &stds, [T::zero(); 4])),
        ]
    }

    /// Where the wheels' states begin.
    pub(in crate::slam) fn wheels_at(&self) -> usize {
        ROBOT + self.config.mount_std.map_or(0, |stds| stds.len())
    }

    /// Errors of the wheels, where they are states: shares of travel and turn that are missing in what they read, and the turn
    /// that is missing for each metre, rad/m.
    pub fn wheels_error(&self) -> Option<Vector3<T>> {
        let at = self.wheels_at();
        self.config.wheels_std.map(|_| Vector3::from_fn(|row, _| self.x(at + row)))
    }

    /// Covariance of [`wheels_error`](Self::wheels_error).
    pub fn wheels_error_covariance(&self) -> Option<Matrix3<T>> {
        let at = self.wheels_at();
        self.config
            .wheels_std
            .map(|_| Matrix3::from_fn(|row, column| self.covariance_at(at + row, at + column)))
    }
}

//! How the robot moves and leans, as the host tells it, and its motion between readings that were lost.
use super::Dispatch;
use crate::Engine;
use embedded_io::Write;
use monorange_protocol::message::{Attitude, Cause, Motion, Odometry};

/// Gaps in odometry up to this are rounding, not a lost message.
const ODOMETRY_SLACK_US: u64 = 1_000;
/// The last velocity is taken to hold for so long: after that the robot is not taken to have moved on.
const ODOMETRY_HOLD_US: u64 = 1_000_000;

impl<E: Engine> Dispatch<E> {
    pub(super) fn attitude(&mut self, attitude: &Attitude, port: &mut impl Write) {
        if !self.engine.is_configured() {
            return self.fault(Cause::NotConfigured, 0, port);
        }
        if self.engine.attitude(attitude).is_err() {
            self.fault(Cause::Odometry, 2, port);
        }
    }

    pub(super) fn odometry(&mut self, odometry: &Odometry, port: &mut impl Write) {
        if !self.engine.is_configured() {
            return self.fault(Cause::NotConfigured, 0, port);
        }
        let sound = odometry.duration.is_finite() && odometry.duration >= 0.0;
        let lost = self.last_motion.filter(|_| sound).and_then(|last| held(&last, odometry));
        let moved = lost.map_or(Ok(()), |lost| self.engine.odometry(&lost));
        if !sound {
            return self.fault(Cause::Odometry, 0, port);
        }
        if let Err(error) = moved.and_then(|()| self.engine.odometry(odometry)) {
            let backwards = matches!(error, monorange_core::Error::TimeBackwards { .. });
            return self.fault(Cause::Odometry, backwards.into(), port);
        }
        self.last_motion = Some(*odometry);
        self.last_time_us = odometry.until_us;
    }
}

/// The motion between the last reading and this one, if some were lost: the last velocity holds, for a second at most.
fn held(last: &Odometry, next: &Odometry) -> Option<Odometry> {
    let began_us = next.until_us.saturating_sub((next.duration * 1e6 + 0.5) as u64);
    let gap_us = began_us.checked_sub(last.until_us)?;
    if gap_us < ODOMETRY_SLACK_US {
        return None;
    }
    let held_us = gap_us.min(ODOMETRY_HOLD_US);
    let duration = held_us as f32 * 1e-6;
    let share = duration / last.duration;
    let motion = match last.motion {
        Motion::Increment { forward, left, turn } if share.is_finite() => {
            Motion::Increment { forward: forward * share, left: left * share, turn: turn * share }
        }
        velocity => velocity,
    };
    Some(Odometry { until_us: last.until_us.saturating_add(held_us), duration, motion })
}

//! Motion between readings of odometry that were lost.
use monorange_protocol::message::{Motion, Odometry};

/// Gaps in odometry up to this are rounding, not a lost message.
const ODOMETRY_SLACK_US: u64 = 1_000;
/// The last velocity is taken to hold for so long: after that the robot is not taken to have moved on.
const ODOMETRY_HOLD_US: u64 = 1_000_000;

/// The motion between the last reading and this one, if some were lost: the last velocity holds, for a second at most.
pub(super) fn held(last: &Odometry, next: &Odometry) -> Option<Odometry> {
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

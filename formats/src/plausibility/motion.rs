use super::{median, quantile};
use crate::{Error, Result};
use monorange_core::geometry::wrap_angle;
use std::{f64::consts::PI, path::Path};

/// What a trajectory has beyond the floor's plane, at one pose.
#[derive(Clone, Copy, Debug)]
pub struct Attitude {
    /// (x, y, z), m.
    pub position: [f64; 3],
    /// (x, y, z, w).
    pub quaternion: [f64; 4],
}

impl Attitude {
    /// The angle between its z axis and the world's.
    fn lean(&self) -> f64 {
        let [x, y, z, w] = self.quaternion;
        libm::acos(((w * w + z * z - x * x - y * y) / (x * x + y * y + z * z + w * w)).clamp(-1.0, 1.0))
    }
}

/// Looks at what is dropped when poses in three dimensions are taken for a robot's on the floor.
///
/// # Errors
/// When the motion is not in the plane of x and y, or the attitudes are not those of a robot: quaternions with w first, a
/// camera's axes.
pub fn check_attitudes(path: &Path, poses: &[Attitude]) -> Result<()> {
    let extent = |axis: usize| {
        let values = || poses.iter().filter_map(|pose| pose.position.get(axis).copied());
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    let [across, up] = [extent(0).max(extent(1)), extent(2)];
    if up > 0.3 && up > 0.5 * across {
        let cause = format!(
            "it moves {up:.2} m along z and {across:.2} m along x and y: not on a floor, or in a camera's axes (z ahead)"
        );
        return Err(Error::new(cause).at(path).help(
            "give the robot's poses with z up; from a camera's axes: x = z, y = -x, and the heading about the vertical",
        ));
    }
    let Some(lean) = median(poses.iter().map(Attitude::lean)) else { return Ok(()) };
    if lean > 0.35 {
        let first = |pose: &Attitude| {
            let [x, y, z, w] = pose.quaternion;
            Attitude { quaternion: [y, z, w, x], ..*pose }.lean()
        };
        let error = Error::new(format!(
            "its attitudes lean by {:.0}° in the median: not those of a robot on a floor",
            lean.to_degrees()
        ));
        return Err(error.at(path).help(match median(poses.iter().map(first)) {
            Some(upright) if upright < 0.17 => {
                "the quaternions look as if qw came first: the order is `t tx ty tz qx qy qz qw`"
            }
            _ => "give the robot's attitude (x ahead, z up), not the camera's",
        }));
    }
    if lean > 0.09 {
        let cause = format!(
            "its attitudes lean by {:.0}° in the median; only the heading is used",
            lean.to_degrees()
        );
        Error::new(cause)
            .at(path)
            .help("give the robot's attitude, not the camera's, if that is not meant")
            .warn();
    }
    if up > 0.3 && up > 0.02 * across {
        let cause = format!("its z, over {up:.2} m, is passed over: the floor is taken to be flat");
        Error::new(cause).at(path).help("lengths along a slope come out short").warn();
    }
    Ok(())
}

/// Warns about headings of `t, x, y, heading` that are degrees: beyond a turn, and along the way driven only when they are read so.
pub fn check_headings(path: &Path, poses: &[[f64; 4]]) {
    let largest = poses.iter().map(|pose| pose[3].abs()).fold(0.0, f64::max);
    let off = |unit: f64| {
        median(poses.windows(2).filter_map(|pair| {
            let &[[_, x, y, heading], [_, later_x, later_y, _]] = pair else { return None };
            let (ahead, aside) = (later_x - x, later_y - y);
            // Modulo half a turn: a robot may back up.
            let angle = wrap_angle(2.0 * (libm::atan2(aside, ahead) - heading * unit)) / 2.0;
            (libm::hypot(ahead, aside) > 1e-3).then_some(angle.abs())
        }))
    };
    let degrees = match (off(1.0), off(PI / 180.0)) {
        (Some(as_radians), Some(as_degrees)) => as_degrees < 0.3 && as_radians > 2.0 * as_degrees,
        _ => true,
    };
    if largest > 2.0 * PI * 1.01 && degrees {
        let cause = format!("its headings reach {largest:.0}: they look like degrees");
        Error::new(cause).at(path).help("headings are radians: divide degrees by 57.29578").warn();
    }
}

/// A turn between two lines of odometry: a difference of wrapped headings is wrapped back; `true` where it was.
///
/// # Errors
/// When it is more than a whole turn.
pub fn wrapped_turn(turn: f64) -> Result<(f64, bool)> {
    if turn.abs() > 2.0 * PI + 1e-3 {
        let cause = format!(
            "`dtheta` is {turn}, more than a whole turn since the line before: it looks like degrees"
        );
        return Err(Error::new(cause).help("turns are radians: divide degrees by 57.29578"));
    }
    let wrapped = turn.abs() > PI + 1e-6;
    Ok((if wrapped { wrap_angle(turn) } else { turn }, wrapped))
}

/// Looks at one number of a line of odometry: a speed, a turn rate, a way.
///
/// # Errors
/// When it is larger than anything that drives or turns has: the filter would have no number for what follows.
pub fn check_reading(name: &str, number: f64) -> Result<()> {
    if number.abs() < 1e5 {
        return Ok(());
    }
    let error = Error::new(format!("`{name}` is {number:e}: nothing drives or turns so"));
    Err(error.help("lengths are metres, angles radians, times seconds; remove the line if it is a fault"))
}

/// Warns about ways between poses that nothing drives: (line, metres, seconds) of every step.
pub fn check_jumps(path: &Path, steps: impl IntoIterator<Item = (u64, f64, f64)>) {
    // 360 km/h, and beyond what a satellite receiver errs by.
    let jumps: Vec<_> =
        steps.into_iter().filter(|(_, way, seconds)| *way > 100.0 * seconds && *way > 10.0).collect();
    if let Some((line, way, seconds)) = jumps.first() {
        let more = if jumps.len() > 1 { format!(" ({} such steps)", jumps.len()) } else { String::new() };
        let cause = format!("the pose is {way:.0} m from the line before's, {seconds:.3} s earlier{more}");
        Error::new(cause)
            .at_line(path, *line)
            .help("nothing drives so: remove the line if it is a fault")
            .warn();
    }
}

/// Warns about speeds (m/s) and turn rates (rad/s) that no robot has.
pub fn check_motion(path: &Path, speeds_and_turns: impl IntoIterator<Item = [f64; 2]>) {
    let (mut speeds, mut turns) = (Vec::new(), Vec::new());
    for [speed, turn] in speeds_and_turns {
        speeds.extend((speed != 0.0).then_some(speed.abs()));
        turns.extend((turn != 0.0).then_some(turn.abs()));
    }
    let fast = speeds
        .iter()
        .copied()
        .filter(|speed| *speed > 100.0)
        .fold((0, 0.0), |(count, fastest), speed| (count + 1, f64::max(fastest, speed)));
    let lines = speeds.len();
    // 54 km/h: a car in a town is not faster in the median, and 0.2 m/s in centimetres are 20.
    if let Some(speed) = median(speeds).filter(|speed| *speed > 15.0) {
        let cause = format!(
            "the median speed is {speed:.0} m/s: it looks like centimetres or millimetres, or the times are not seconds"
        );
        Error::new(cause).at(path).help("lengths are metres, times seconds").warn();
    } else if let (count @ 1.., fastest) = fast {
        let cause = format!("{count} of {lines} speeds are above 100 m/s, up to {fastest:.0} m/s");
        Error::new(cause).at(path).help("nothing drives so: remove the lines if they are faults").warn();
    }
    // A robot that turns on the spot makes a turn in a second or two.
    if let Some(turn) = quantile(turns, 0.95).filter(|turn| *turn > 2.0 * PI) {
        let cause =
            format!("turn rates reach {turn:.0} rad/s, more than a turn in a second: they look like degrees");
        Error::new(cause).at(path).help("angles are radians: divide degrees by 57.29578").warn();
    }
}

/// Counts pictures that are the one before, pixel for pixel, while the wheels turn: a sensor's noise is never twice the
/// same, a stale buffer is.
#[derive(Clone, Debug, Default)]
pub struct FrozenCamera {
    last: Option<u64>,
    way: f64,
    seen: usize,
    frozen: usize,
}

impl FrozenCamera {
    /// Looks at a picture and at the way that the wheels have made since the one before, m.
    pub fn look(&mut self, pixels: &[u8], way: f64) {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        pixels.hash(&mut hasher);
        let now = hasher.finish();
        self.seen += 1;
        if self.last.replace(now) == Some(now) && way > 0.01 {
            self.frozen += 1;
            self.way += way;
        }
    }

    /// Warns if there were such pictures; `true` where they are so many that nothing was checked by them.
    pub fn judge(&self) -> bool {
        if self.frozen > 0 {
            let cause = format!(
                "{} of {} pictures are the one before, pixel for pixel, while the wheels drove {:.2} m",
                self.frozen, self.seen, self.way
            );
            Error::new(cause).help("the camera or its driver froze: leave these pictures out").warn();
        }
        self.is_frozen()
    }

    /// Whether such pictures are so many that nothing was checked by them.
    pub fn is_frozen(&self) -> bool {
        5 * self.frozen > self.seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_of_wrapped_headings_is_wrapped_back() {
        let (turn, wrapped) = wrapped_turn(-6.08319).unwrap();
        assert!(wrapped && (turn - 0.2).abs() < 1e-4);
        assert_eq!(wrapped_turn(-PI).unwrap(), (-PI, false));
        assert!(wrapped_turn(20.0).unwrap_err().to_string().contains("degrees"));
    }
}

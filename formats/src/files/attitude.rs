use super::Table;
use crate::{Error, Result};
use std::path::Path;

/// A line so near to a picture's time is of the picture, s.
const AT_ONCE: f64 = 0.02;
/// Lines of an IMU farther apart than this say nothing of a picture between them, s.
const MAX_GAP: f64 = 0.2;
/// Standard deviation of an angle where the file does not say it: of a small IMU's filter on a robot that drives, rad.
const STD: f64 = 0.003;
/// No robot that drives leans further, rad.
const MOST: f64 = 0.8;

/// How a robot leans, as an IMU tells it over time.
#[derive(Clone, Debug)]
pub struct Attitudes {
    /// Time (s), pitch, roll, and the standard deviation of each (rad), in the order of time.
    rows: Vec<[f64; 4]>,
}

impl Attitudes {
    /// The attitudes in a CSV: `t,pitch,roll` in rad (pitch about the robot's y axis, nose down positive; roll about its x axis,
    /// left side up positive), or an orientation as ROS has it, `t,qx,qy,qz,qw`. A column `std` gives the standard deviation
    /// of either angle (rad), 0.003 without it.
    ///
    /// # Errors
    /// When the file cannot be read, lacks a column, holds something else than finite numbers, its times run backwards, or the
    /// angles are degrees.
    pub fn read(path: &Path) -> Result<Self> {
        let table = Table::read(path)?;
        let angles: Vec<[f64; 3]> = match table.has("qw") {
            true => {
                let rows = table.numbers(["t", "qx", "qy", "qz", "qw"])?;
                let length = |[_, x, y, z, w]: &[f64; 5]| (x * x + y * y + z * z + w * w).sqrt();
                if let Some(row) = rows.iter().position(|row| !(0.9..1.1).contains(&length(row))) {
                    let length = rows.get(row).map_or(0.0, length);
                    let error = Error::new(format!("the quaternion's length is {length}, must be 1"));
                    let help = "give a unit quaternion; zeros are an IMU that estimates no attitude";
                    return Err(error.at_line(path, table.line_of(row)).help(help));
                }
                rows.into_iter().map(from_quaternion).collect()
            }
            false => table.numbers(["t", "pitch", "roll"])?,
        };
        table.check_order(angles.iter().map(|[time, ..]| *time))?;
        let stds = if table.has("std") { table.optional_numbers("std")? } else { Vec::new() };
        let stds = stds.into_iter().map(|std| std.unwrap_or(STD)).chain(std::iter::repeat(STD));
        let rows: Vec<_> =
            angles.into_iter().zip(stds).map(|([time, pitch, roll], std)| [time, pitch, roll, std]).collect();
        if rows.is_empty() {
            return Err(Error::new("holds no attitude").at(path).help("give lines of t,pitch,roll"));
        }
        for (index, [_, pitch, roll, std]) in rows.iter().enumerate() {
            if pitch.abs().max(roll.abs()) > MOST {
                let cause = format!("the robot leans by {pitch} and {roll} rad");
                return Err(Error::new(cause).at_line(path, table.line_of(index)).help(
                    "angles are radians, 0 where it stands level; the attitude is the robot's (x ahead, z up), not the camera's",
                ));
            }
            if !(0.0..=MOST).contains(std) {
                let cause = format!("a standard deviation is {std} rad");
                return Err(Error::new(cause).at_line(path, table.line_of(index)).help("give 0 to 0.8"));
            }
        }
        Ok(Self { rows })
    }

    /// Pitch, roll and their standard deviation at a time: between the lines on either side, or those of a line within 0.02 s; `None` where
    /// there is none and the lines are more than 0.2 s apart.
    pub fn at(&self, time: f64) -> Option<[f64; 3]> {
        let after = self.rows.partition_point(|[then, ..]| *then < time);
        let next = self.rows.get(after);
        let before = after.checked_sub(1).and_then(|before| self.rows.get(before)).or(next)?;
        let next = next.unwrap_or(before);
        let [since, until, gap] = [time - before[0], next[0] - time, next[0] - before[0]];
        if gap > MAX_GAP || gap == 0.0 && since.abs() > AT_ONCE {
            let near = [(before, since), (next, until)].into_iter().find(|(_, away)| away.abs() <= AT_ONCE);
            return near.map(|(&[_, pitch, roll, std], _)| [pitch, roll, std]);
        }
        let share = if gap > 0.0 { since / gap } else { 0.0 };
        Some([1, 2, 3].map(|column| before[column] + share * (next[column] - before[column])))
    }

    /// Fails when it says nothing of any of these times, and warns where it is silent about some.
    ///
    /// # Errors
    /// Names the file and both spans.
    pub fn check_cover(&self, path: &Path, times: &[f64]) -> Result<()> {
        let silent = times.iter().filter(|time| self.at(**time).is_none()).count();
        if silent == 0 {
            return Ok(());
        }
        let ends = |first: Option<f64>, last: Option<f64>| {
            format!("{} s to {} s", first.unwrap_or(0.0), last.unwrap_or(0.0))
        };
        let own = ends(self.rows.first().map(|row| row[0]), self.rows.last().map(|row| row[0]));
        let frames = ends(times.first().copied(), times.last().copied());
        let error = Error::new(format!(
            "covers {own}, the frames {frames}: of {silent} of {} frames it tells no attitude",
            times.len()
        ))
        .at(path);
        if silent == times.len() {
            return Err(error.help("give the attitude on the frames' clock, at least five lines a second"));
        }
        error.help("those frames are taken as level").warn();
        Ok(())
    }
}

/// Pitch and roll of a line of time and quaternion.
fn from_quaternion([time, x, y, z, w]: [f64; 5]) -> [f64; 3] {
    let square = x * x + y * y + z * z + w * w;
    let pitch = libm::asin((2.0 * (w * y - z * x) / square).clamp(-1.0, 1.0));
    let roll = libm::atan2(2.0 * (w * x + y * z) / square, 1.0 - 2.0 * (x * x + y * y) / square);
    [time, pitch, roll]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::memory;

    fn read(text: &str) -> Result<Attitudes> {
        memory::offer("imu.csv", text.as_bytes().to_vec());
        Attitudes::read(Path::new("imu.csv"))
    }

    #[test]
    fn an_attitude_lies_between_the_lines_on_either_side() {
        let attitudes =
            read("t,pitch,roll,std\n1,0.01,0.02,0.004\n1.1,0.03,0.02,0.004\n2,0,0,0.01\n").unwrap();
        let [pitch, roll, std] = attitudes.at(1.05).unwrap();
        assert!((pitch - 0.02).abs() < 1e-12 && (roll - 0.02).abs() < 1e-12 && (std - 0.004).abs() < 1e-12);
        assert_eq!(attitudes.at(1.5), None);
        assert_eq!(attitudes.at(0.99).unwrap()[0], 0.01);
        assert_eq!(attitudes.at(1.99).unwrap()[0], 0.0);
        assert_eq!(attitudes.at(2.01).unwrap()[0], 0.0);
        assert_eq!(attitudes.at(0.5), None);
        assert!(attitudes.check_cover(Path::new("imu.csv"), &[1.05]).is_ok());
        let error = attitudes.check_cover(Path::new("imu.csv"), &[7.0]).unwrap_err().to_string();
        assert!(error.contains("imu.csv") && error.contains("7 s"), "{error}");
    }

    #[test]
    fn a_quaternion_is_its_pitch_and_roll_whatever_the_heading() {
        // R_z(2) R_y(0.05) R_x(−0.02).
        let half = |angle: f64| (libm::sin(angle / 2.0), libm::cos(angle / 2.0));
        let ((sy, cy), (sp, cp), (sr, cr)) = (half(2.0), half(0.05), half(-0.02));
        let [w, x] = [cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy];
        let [y, z] = [cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy];
        let [pitch, roll, _] = read(&format!("t,qx,qy,qz,qw\n1,{x},{y},{z},{w}\n")).unwrap().at(1.0).unwrap();
        assert!((pitch - 0.05).abs() < 1e-12 && (roll + 0.02).abs() < 1e-12, "{pitch} {roll}");
    }

    #[test]
    fn degrees_are_refused_with_the_line() {
        let error = read("t,pitch,roll\n1,0.1,0\n2,3.5,0\n").unwrap_err().to_string();
        assert!(error.contains("imu.csv") && error.contains('3') && error.contains("radians"), "{error}");
    }
}

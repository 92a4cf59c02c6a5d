use super::Table;
use crate::{
    Error, Result,
    plausibility::{self, Attitude},
};
use monorange_core::geometry::Pose;
use nalgebra::Matrix3;
use std::{
    io::{self, Write},
    path::Path,
};

/// The robot in the world at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamped {
    /// Seconds.
    pub time: f64,
    /// `world_from_robot`.
    pub pose: Pose<f64>,
    /// Covariance of (x, y, heading), where the file gives one.
    pub covariance: Option<Matrix3<f64>>,
}

const COVARIANCES: [&str; 6] = ["var_x", "cov_xy", "cov_xh", "var_y", "cov_yh", "var_h"];

/// A trajectory from TUM (`t tx ty tz qx qy qz qw`, separated by blanks), CSV (`t,x,y,heading`, with or without
/// covariances; or `t,x,y,z,qx,qy,qz,qw` in any order, as EuRoC has them), or KITTI (twelve numbers a line, with
/// `times.txt` beside); which of them, the first line tells.
///
/// Of poses at one time the first is kept, with a warning.
///
/// # Errors
/// When the file cannot be read, holds no pose, a line is malformed, times run backwards or are no seconds, or the poses
/// are not those of a robot on a floor.
pub fn read_trajectory(path: &Path) -> Result<Vec<Stamped>> {
    parse(path, &super::read_text(path)?)
}

/// The first line that says something.
fn first_line(text: &str) -> Option<&str> {
    text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'))
}

/// Whether a text begins with numbers between blanks, TUM's eight or KITTI's twelve.
pub(super) fn is_columns(text: &str) -> bool {
    let words = || first_line(text).into_iter().flat_map(str::split_whitespace);
    words().count() >= 8 && words().all(super::table::is_decimal_comma_or_number)
}

/// As [`read_trajectory`], of a text that came from `path`.
pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<Stamped>> {
    let poses = match first_line(text) {
        None => Vec::new(),
        Some(line) if line.split_whitespace().all(super::table::is_decimal_comma_or_number) => {
            from_columns(path, text)?
        }
        Some(line) if line.contains([',', ';', '\t']) => from_csv(&Table::parse(path, text)?)?,
        Some(_) => from_columns(path, text)?,
    };
    if poses.is_empty() {
        return Err(Error::new("holds no pose").at(path).help("give a TUM file or a CSV with t,x,y,heading"));
    }
    in_order(path, poses)
}

/// On a clock of seconds, one pose a time.
fn in_order(path: &Path, mut poses: Vec<(Stamped, u64)>) -> Result<Vec<Stamped>> {
    let unit = plausibility::seconds_of_clock(path, poses.iter().map(|(stamped, _)| stamped.time));
    let mut trajectory: Vec<Stamped> = Vec::with_capacity(poses.len());
    let (mut equal, mut steps) = (Vec::new(), Vec::new());
    for (stamped, line) in &mut poses {
        stamped.time /= unit;
        match trajectory.last() {
            Some(last) if stamped.time < last.time => {
                let cause = format!("time {} is before the line before's, {}", stamped.time, last.time);
                return Err(Error::new(cause).at_line(path, *line).help("sort the lines by time"));
            }
            Some(last) if stamped.time == last.time => equal.push(*line),
            last => {
                if let Some(last) = last {
                    let way = (stamped.pose.position() - last.pose.position()).norm();
                    steps.push((*line, way, stamped.time - last.time));
                }
                trajectory.push(*stamped);
            }
        }
    }
    plausibility::check_jumps(path, steps);
    if let Some(first) = equal.first() {
        let cause = format!("{} poses have the time of the line before", equal.len());
        Error::new(cause).at_line(path, *first).help("the first of each is kept").warn();
    }
    let times: Vec<_> = trajectory.iter().map(|stamped| stamped.time).collect();
    plausibility::check_steps(path, &times)?;
    Ok(trajectory)
}

fn from_csv(table: &Table) -> Result<Vec<(Stamped, u64)>> {
    if !table.has("heading") && table.has("qw") {
        let rows = table.numbers(["t", "x", "y", "z", "qx", "qy", "qz", "qw"])?;
        return from_rows(table.path(), rows.into_iter().zip(table.lines()));
    }
    let poses = table.numbers(["t", "x", "y", "heading"])?;
    plausibility::check_headings(table.path(), &poses);
    let mut covariances = vec![Vec::new(); poses.len()];
    for column in COVARIANCES {
        for (row, number) in covariances.iter_mut().zip(table.optional_numbers(column)?) {
            row.extend(number);
        }
    }
    let full = |row: Vec<f64>| match *row.as_slice() {
        [xx, xy, xh, yy, yh, hh] => Some(Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh)),
        _ => None,
    };
    let stamped = |([time, x, y, heading], row): ([f64; 4], _)| Stamped {
        time,
        pose: Pose::new(x, y, heading),
        covariance: full(row),
    };
    Ok(poses.into_iter().zip(covariances).map(stamped).zip(table.lines()).collect())
}

/// Lines of numbers between blanks: TUM's eight, or KITTI's twelve.
fn from_columns(path: &Path, text: &str) -> Result<Vec<(Stamped, u64)>> {
    let mut rows = Vec::new();
    for (line, content) in (1_u64..).zip(text.lines()) {
        let content = content.split('#').next().unwrap_or_default();
        let cells: Vec<_> =
            content.split(|c: char| c.is_whitespace()).filter(|cell| !cell.is_empty()).collect();
        if cells.is_empty() {
            continue;
        }
        let numbers: Option<Vec<f64>> =
            cells.iter().map(|cell| cell.parse().ok().filter(|x: &f64| x.is_finite())).collect();
        rows.push((line, numbers, cells.iter().any(|cell| super::table::is_decimal_comma(cell))));
    }
    if rows.first().is_some_and(|(_, numbers, _)| numbers.as_ref().is_some_and(|numbers| numbers.len() == 12))
    {
        return kitti(
            path,
            rows.into_iter().map(|(line, numbers, _)| (line, numbers.unwrap_or_default())).collect(),
        );
    }
    let row = |(line, numbers, comma): (u64, Option<Vec<f64>>, bool)| match numbers.as_deref() {
        Some(&[t, x, y, z, qx, qy, qz, qw]) => Ok(([t, x, y, z, qx, qy, qz, qw], line)),
        _ => Err(Error::new("is not eight finite numbers").at_line(path, line).help(match comma {
            true => "a decimal comma is not read, only a decimal point: write 0.5, not 0,5",
            false => "a TUM line is `t tx ty tz qx qy qz qw`",
        })),
    };
    let rows: Vec<_> = rows.into_iter().map(row).collect::<Result<_>>()?;
    from_rows(path, rows.into_iter())
}

fn from_rows(path: &Path, rows: impl Iterator<Item = ([f64; 8], u64)>) -> Result<Vec<(Stamped, u64)>> {
    let (mut poses, mut attitudes) = (Vec::new(), Vec::new());
    for ([time, x, y, z, qx, qy, qz, qw], line) in rows {
        let norm2 = qx * qx + qy * qy + qz * qz + qw * qw;
        if (norm2 - 1.0).abs() > 0.01 {
            return Err(Error::new(format!("the quaternion's length is {:.3}, must be 1", norm2.sqrt()))
                .at_line(path, line)
                .help("a TUM line is `t tx ty tz qx qy qz qw`"));
        }
        let heading = libm::atan2(2.0 * (qw * qz + qx * qy), norm2 - 2.0 * (qy * qy + qz * qz));
        poses.push((Stamped { time, pose: Pose::new(x, y, heading), covariance: None }, line));
        attitudes.push(Attitude { position: [x, y, z], quaternion: [qx, qy, qz, qw] });
    }
    plausibility::check_attitudes(path, &attitudes)?;
    Ok(poses)
}

/// KITTI's poses: the left camera in its first frame (x right, y down, z ahead), row by row, without times.
fn kitti(path: &Path, rows: Vec<(u64, Vec<f64>)>) -> Result<Vec<(Stamped, u64)>> {
    let beside = path.with_file_name("times.txt");
    let times = super::read_times(&beside).map_err(|_| {
        Error::new("holds twelve numbers a line, KITTI's poses, which have no times").at(path).help(
            "put the sequence's times.txt beside it, or write `t,x,y,heading` with x = z, y = -x of the file",
        )
    })?;
    if times.len() != rows.len() {
        let cause = format!("has {} times for {} poses", times.len(), rows.len());
        return Err(Error::new(cause).at(beside).help("give one time for every pose"));
    }
    Error::new(
        "KITTI's poses are the camera's (z ahead): they are read as x = z, y = -x, its height passed over",
    )
    .at(path)
    .help("give the robot's own poses if the camera is not over its centre")
    .warn();
    let pose = |((line, row), time): ((u64, Vec<f64>), f64)| match *row.as_slice() {
        [r11, _, _, x, _, _, _, _, r31, _, _, z] => {
            // The camera's x axis is the robot's right.
            let heading = libm::atan2(r31, r11);
            Ok((Stamped { time, pose: Pose::new(z, -x, heading), covariance: None }, line))
        }
        _ => Err(Error::new("is not twelve finite numbers")
            .at_line(path, line)
            .help("correct or remove the line")),
    };
    rows.into_iter().zip(times).map(pose).collect()
}

/// Writes TUM: `t tx ty tz qx qy qz qw`, the robot in the world.
///
/// # Errors
/// When writing fails.
pub fn write_tum(out: &mut dyn Write, trajectory: &[Stamped]) -> io::Result<()> {
    for Stamped { time, pose, .. } in trajectory {
        // Not the platform's: the file must be the same in a browser.
        let (qz, qw) = libm::sincos(pose.heading / 2.0);
        writeln!(out, "{time} {} {} 0 0 0 {qz} {qw}", pose.x, pose.y)?;
    }
    Ok(())
}

/// Writes CSV: `t,x,y,heading` and the six distinct covariances, which are empty where there are none.
///
/// # Errors
/// When writing fails.
pub fn write_trajectory(out: &mut dyn Write, trajectory: &[Stamped]) -> io::Result<()> {
    writeln!(out, "t,x,y,heading,{}", COVARIANCES.join(","))?;
    for Stamped { time, pose, covariance } in trajectory {
        write!(out, "{time},{},{},{}", pose.x, pose.y, pose.heading)?;
        match covariance {
            Some(c) => writeln!(out, ",{},{},{},{},{},{}", c.m11, c.m12, c.m13, c.m22, c.m23, c.m33)?,
            None => writeln!(out, ",,,,,,")?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{files::memory, warnings};

    fn read(name: &str, text: &str) -> Result<Vec<Stamped>> {
        warnings::forget();
        memory::offer(name, text.as_bytes().to_vec());
        read_trajectory(Path::new(name))
    }

    #[test]
    fn euroc_truth_is_read_as_published() {
        let text = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]\n\
                    1403636580838555648,1,2,0,0.8,0,0,0.6,0\n1403636580938555648,2,2,0,0.8,0,0,0.6,0\n";
        let poses = read("data.csv", text).unwrap();
        assert!((poses[0].time - 1_403_636_580.838_555).abs() < 1e-5 && poses[1].pose.x == 2.0);
        assert!((poses[0].pose.heading - 2.0 * 0.6_f64.asin()).abs() < 1e-12);
        assert!(warnings::fresh()[0].contains("nanoseconds"));
    }

    #[test]
    fn kitti_poses_are_taken_into_the_plane() {
        let turn = 0.3_f64;
        let (s, c) = turn.sin_cos();
        // Ahead and then a turn to the left: the camera's x axis turns away from the way it came.
        let text = format!("1 0 0 0 0 1 0 0 0 0 1 0\n{c} 0 {} 0 0 1 0 0 {s} 0 {c} 5\n", -s);
        assert!(read("poses.txt", &text).unwrap_err().to_string().contains("have no times"));
        memory::offer("times.txt", b"0\n1e-1\n".to_vec());
        let poses = read("poses.txt", &text).unwrap();
        assert!((poses[1].pose.heading - turn).abs() < 1e-12 && poses[1].pose.x == 5.0);
        memory::withdraw_all();
    }

    #[test]
    fn poses_that_are_not_a_robots_are_refused() {
        let path = |line: fn(f64) -> String| (0..20).map(|k| line(f64::from(k))).collect::<String>();
        let first = path(|k| format!("{k} {k} 0 0 {} 0 0 {}\n", (0.1 * k).cos(), (0.1 * k).sin()));
        assert!(read("w.tum", &first).unwrap_err().to_string().contains("qw came first"));
        let axes = path(|k| format!("{k} {} 0 {k} 0 0 0 1\n", 0.02 * k));
        assert!(read("z.tum", &axes).unwrap_err().to_string().contains("camera's axes"));
        let ramp = path(|k| format!("{k} {k} 0 {} 0 0 0 1\n", 0.1 * k));
        read("ramp.tum", &ramp).unwrap();
        assert!(warnings::fresh()[0].contains("passed over"));
        let degrees = path(|k| {
            format!("{k},{},{},{}\n", (0.2 * k).sin(), 1.0 - (0.2 * k).cos(), (0.2 * k).to_degrees())
        });
        read("d.csv", &format!("t,x,y,heading\n{degrees}")).unwrap();
        assert!(warnings::fresh()[0].contains("degrees"));
    }

    #[test]
    fn a_csv_without_covariances_is_read() {
        let poses =
            read("own.csv", "t,x,y,heading,var_x,cov_xy,cov_xh,var_y,cov_yh,var_h\n0,1,2,0,,,,,,\n").unwrap();
        assert_eq!((poses[0].pose.x, poses[0].covariance), (1.0, None));
        for heading in ["yaw", "Theta [rad]"] {
            let poses = read("other.csv", &format!("time,x,y,{heading}\n0,1,2,0.5\n")).unwrap();
            assert_eq!(poses[0].pose.heading, 0.5);
        }
    }
}

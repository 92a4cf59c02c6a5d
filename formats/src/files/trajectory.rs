use super::Table;
use crate::{Error, Result};
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

/// A trajectory from TUM (`t tx ty tz qx qy qz qw`, separated by spaces) or CSV (`t,x,y,heading`, with or without
/// covariances); which of them, the first line tells.
///
/// # Errors
/// When the file cannot be read, holds no pose, a line is malformed, or times do not grow.
pub fn read_trajectory(path: &Path) -> Result<Vec<Stamped>> {
    let text = super::read_text(path)?;
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
    let trajectory = match first {
        None => Vec::new(),
        Some(line) if line.contains(',') => from_csv(&Table::parse(path, &text)?)?,
        Some(_) => from_tum(path, &text)?,
    };
    if trajectory.is_empty() {
        return Err(Error::new("holds no pose").at(path).help("give a TUM file or a CSV with t,x,y,heading"));
    }
    Ok(trajectory)
}

fn from_csv(table: &Table) -> Result<Vec<Stamped>> {
    let poses = table.numbers(["t", "x", "y", "heading"])?;
    table.check_order(poses.iter().map(|pose| pose[0]))?;
    let covariances: Vec<_> = if table.has(COVARIANCES[0]) {
        let packed = table.numbers(COVARIANCES)?;
        let full = |[xx, xy, xh, yy, yh, hh]: [f64; 6]| Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh);
        packed.into_iter().map(|row| Some(full(row))).collect()
    } else {
        vec![None; poses.len()]
    };
    let stamped = |([time, x, y, heading], covariance): ([f64; 4], _)| Stamped {
        time,
        pose: Pose::new(x, y, heading),
        covariance,
    };
    Ok(poses.into_iter().zip(covariances).map(stamped).collect())
}

fn from_tum(path: &Path, text: &str) -> Result<Vec<Stamped>> {
    let mut trajectory = Vec::new();
    let mut lines = Vec::new();
    for (line, content) in (1_u64..).zip(text.lines()) {
        let content = content.split('#').next().unwrap_or_default();
        let cells: Vec<_> = content.split_whitespace().map(str::parse::<f64>).collect();
        if cells.is_empty() {
            continue;
        }
        let numbers: Option<Vec<f64>> =
            cells.into_iter().map(|cell| cell.ok().filter(|x| x.is_finite())).collect();
        let Some(&[time, x, y, _, qx, qy, qz, qw]) = numbers.as_deref() else {
            return Err(Error::new("is not eight finite numbers")
                .at_line(path, line)
                .help("a TUM line is `t tx ty tz qx qy qz qw`"));
        };
        let norm2 = qx * qx + qy * qy + qz * qz + qw * qw;
        if (norm2 - 1.0).abs() > 0.01 {
            return Err(Error::new(format!("the quaternion's length is {:.3}, must be 1", norm2.sqrt()))
                .at_line(path, line)
                .help("a TUM line is `t tx ty tz qx qy qz qw`"));
        }
        let heading = libm::atan2(2.0 * (qw * qz + qx * qy), norm2 - 2.0 * (qy * qy + qz * qz));
        trajectory.push(Stamped { time, pose: Pose::new(x, y, heading), covariance: None });
        lines.push(line);
    }
    super::table::check_order(path, trajectory.iter().map(|stamped| stamped.time).zip(lines))?;
    Ok(trajectory)
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

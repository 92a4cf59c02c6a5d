use super::{LogSighting, Recording, SensorLog};
use crate::files::{MapPoint, Odometry, Stamped, Table, read_text};
use crate::{Error, Result};
use monorange_core::geometry::{Pose, wrap_angle};
use nalgebra::Vector2;
use std::fmt::Write;
use std::path::Path;

/// Measurements from a CSV `t,range,bearing[,id][,var_range,var_bearing]`; an empty range is a bearing alone, an
/// empty bearing a range alone.
///
/// # Errors
/// When the file cannot be read, lacks a column, times run backwards, or a line has neither range nor bearing.
pub fn read_sightings(path: &Path) -> Result<Vec<LogSighting>> {
    let table = Table::read(path)?;
    let times = table.numbers(["t"])?;
    for column in ["range", "bearing"] {
        if !table.has(column) {
            let help = "the header must be `t,range,bearing`, with or without `id,var_range,var_bearing`";
            return Err(Error::new(format!("has no column `{column}`")).at(path).help(help));
        }
    }
    let column = |name| table.optional_numbers(name);
    let (ranges, bearings, ids) = (column("range")?, column("bearing")?, column("id")?);
    let (range_variances, bearing_variances) = (column("var_range")?, column("var_bearing")?);
    let mut sightings: Vec<LogSighting> = Vec::with_capacity(times.len());
    for (row, (&[time], line)) in times.iter().zip(table.lines()).enumerate() {
        let (range, bearing) = (ranges[row], bearings[row]);
        if range.is_none() && bearing.is_none() {
            let help = "give at least one of them, or remove the line";
            return Err(Error::new("has neither range nor bearing").at_line(path, line).help(help));
        }
        if sightings.last().is_some_and(|last| last.time > time) {
            let help = "sort the lines by time";
            return Err(Error::new(format!("time {time} lies before the line above"))
                .at_line(path, line)
                .help(help));
        }
        let id = ids[row].map(|id| id as u32);
        let variances = [range_variances[row], bearing_variances[row]];
        sightings.push(LogSighting { time, id, range, bearing, variances, covariance: 0.0 });
    }
    Ok(sightings)
}

/// Seconds from an odometry line of MRCLAM to the motion: it holds what the robot was told. Against the truth the half-second
/// turns of all five robots fit best 0.20 to 0.27 s later, with half the error; the sightings have no such delay.
const MRCLAM_DELAY: f64 = 0.2;

/// One robot of a UTIAS MRCLAM folder: `RobotN_Odometry.dat`, `RobotN_Measurement.dat`, `RobotN_Groundtruth.dat`,
/// `Landmark_Groundtruth.dat`, and `Barcodes.dat` to tell landmarks (subjects 6 to 20) from robots and misread
/// barcodes, which are left out.
pub(super) fn mrclam(folder: &Path, robot: u32) -> Result<Recording> {
    let mut subjects = std::collections::HashMap::new();
    for [subject, barcode] in columns(&folder.join("Barcodes.dat"))? {
        subjects.insert(barcode as u32, subject as u32);
    }
    let mut text = String::from("t,v,omega\n");
    let mut last = f64::NEG_INFINITY;
    let path = folder.join(format!("Robot{robot}_Odometry.dat"));
    for [time, v, omega] in columns(&path)? {
        if time > last {
            let effect = time + MRCLAM_DELAY;
            let _ = writeln!(text, "{effect},{v},{omega}"); // a String takes everything
            last = time;
        }
    }
    let odometry = Odometry::from_table(&Table::parse(&path, &text)?)?;
    let measured = columns(&folder.join(format!("Robot{robot}_Measurement.dat")))?;
    let sightings = measured.into_iter().filter_map(|[time, barcode, range, bearing]| {
        let id = subjects.get(&(barcode as u32)).copied().filter(|subject| *subject > 5)?;
        Some(LogSighting { id: Some(id), ..LogSighting::range_bearing(time, range, bearing) })
    });
    let log = SensorLog { odometry, sightings: sightings.collect() };
    let truth = columns(&folder.join(format!("Robot{robot}_Groundtruth.dat")))?.into_iter().map(stamped);
    let true_map = columns(&folder.join("Landmark_Groundtruth.dat"))?.into_iter().map(map_point);
    Ok(Recording { log, truth: truth.collect(), true_map: true_map.collect() })
}

/// The Victoria Park log as factor-graph text (`ODOMETRY i j dx dy dθ …`, `LANDMARK pose id x y …`): a second a
/// step. The sightings' variance is the file's, 0.4 m² each way.
pub(super) fn victoria_park(path: &Path) -> Result<Recording> {
    let text = read_text(path)?;
    let mut odometry = String::from("t,dx,dy,dtheta\n0,0,0,0\n");
    let mut steps = std::collections::HashMap::from([(0_u32, 0.0)]);
    let mut time = 0.0;
    let mut sightings = Vec::new();
    for (line, content) in (1_u64..).zip(text.lines()) {
        let mut cells = content.split_whitespace();
        let kind = cells.next().unwrap_or_default();
        let numbers: Vec<f64> = cells.map_while(|cell| cell.parse().ok()).collect();
        match (kind, numbers.as_slice()) {
            ("ODOMETRY", [_, to, dx, dy, turn, ..]) => {
                time += 1.0;
                steps.insert(*to as u32, time);
                let _ = writeln!(odometry, "{time},{dx},{dy},{turn}"); // a String takes everything
            }
            ("LANDMARK", [pose, id, x, y, variance, _, _]) => {
                let time = *steps
                    .get(&(*pose as u32))
                    .ok_or_else(|| Error::new("a pose without odometry").at_line(path, line))?;
                let range = x.hypot(*y);
                // Equal variances in x and y are equal variances along and across the ray.
                let variances = [Some(*variance), Some(variance / (range * range))];
                let sighting = LogSighting::range_bearing(time, range, y.atan2(*x));
                sightings.push(LogSighting { id: Some(*id as u32), variances, ..sighting });
            }
            ("", _) => {}
            _ => return Err(Error::new("is neither ODOMETRY nor LANDMARK with numbers").at_line(path, line)),
        }
    }
    sightings.sort_by(|a, b| a.time.total_cmp(&b.time));
    let odometry = Odometry::from_table(&Table::parse(path, &odometry)?)?;
    let log = SensorLog { odometry, sightings };
    Ok(Recording { log, truth: Vec::new(), true_map: Vec::new() })
}

/// A log of ranges to radio beacons: `PlazaN_DR.csv` (way and turn since the line before), `PlazaN_TD.csv`,
/// `PlazaN_GT.csv` and `PlazaN_TL.csv`. The true headings of log 2 point backwards, against the way the robot drives:
/// they are turned round.
pub(super) fn plaza(folder: &Path, number: u32) -> Result<Recording> {
    let file = |kind: &str| folder.join(format!("Plaza{number}_{kind}.csv"));
    let table = |kind| Table::read(&file(kind));
    let mut text = String::from("t,v,omega\n");
    let steps = table("DR")?.numbers(["t", "d_dist", "d_theta"])?;
    for [before, after] in steps.windows(2).filter_map(|pair| <[_; 2]>::try_from(pair).ok()) {
        let seconds = after[0] - before[0];
        let _ = writeln!(text, "{},{},{}", before[0], after[1] / seconds, after[2] / seconds); // a String takes everything
    }
    let odometry = Odometry::from_table(&Table::parse(&file("DR"), &text)?)?;
    let ranges = table("TD")?.numbers(["t", "receiver_beacon_id", "range_m"])?;
    let sighting = |[time, beacon, range]: [f64; 3]| LogSighting {
        id: Some(beacon as u32),
        bearing: None,
        ..LogSighting::range_bearing(time, range, 0.0)
    };
    let log = SensorLog { odometry, sightings: ranges.into_iter().map(sighting).collect() };
    let turned = if number == 2 { std::f64::consts::PI } else { 0.0 };
    let truth = table("GT")?.numbers(["t", "x", "y", "theta"])?.into_iter();
    let truth = truth.map(|[time, x, y, heading]| stamped([time, x, y, wrap_angle(heading + turned)]));
    let true_map = table("TL")?.numbers(["beacon_id", "x", "y"])?.into_iter().map(map_point);
    Ok(Recording { log, truth: truth.collect(), true_map: true_map.collect() })
}

fn stamped([time, x, y, heading]: [f64; 4]) -> Stamped {
    Stamped { time, pose: Pose::new(x, y, heading), covariance: None }
}

fn map_point([id, x, y]: [f64; 3]) -> MapPoint {
    MapPoint { id: id as u64, position: Vector2::new(x, y), covariance: None, seen: 0, first_and_last: None }
}

/// The numbers of a text of columns, `#` for comments.
fn columns<const N: usize>(path: &Path) -> Result<Vec<[f64; N]>> {
    let text = read_text(path)?;
    let lines =
        (1_u64..).zip(text.lines()).filter(|(_, line)| !line.starts_with('#') && !line.trim().is_empty());
    lines
        .map(|(number, line)| {
            let cells: Vec<f64> = line.split_whitespace().map_while(|cell| cell.parse().ok()).collect();
            let cells = cells.get(..N).and_then(|cells| <[f64; N]>::try_from(cells).ok());
            cells.ok_or_else(|| Error::new(format!("is not {N} numbers")).at_line(path, number))
        })
        .collect()
}

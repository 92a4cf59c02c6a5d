use super::{LogSighting, Recording, SensorLog};
use crate::files::{MapPoint, Odometry, Stamped, Table, read_text};
use crate::{Error, Result, plausibility};
use monorange_core::geometry::{Pose, wrap_angle};
use nalgebra::Vector2;
use std::fmt::Write;
use std::path::Path;

/// Measurements from a CSV `t,range,bearing[,id][,var_range,var_bearing]`; an empty range is a bearing alone, an
/// empty bearing a range alone.
///
/// # Errors
/// When the file cannot be read, lacks a column, times run backwards, a line has neither range nor bearing, or holds a
/// name, range, bearing or variance that cannot be one.
pub fn read_sightings(path: &Path) -> Result<Vec<LogSighting>> {
    let table = Table::read(path)?;
    let times = table.numbers(["t"])?;
    if times.is_empty() {
        return Err(Error::new("holds no measurement").at(path).help("give `t,range,bearing` a line"));
    }
    let (ranged, seen) = (table.has("range"), table.has("bearing"));
    if !(ranged && seen) {
        table.numbers(["range", "bearing"])?; // its error names the columns that are there
    }
    let column = |name| table.optional_numbers(name);
    let (ranges, bearings, ids) = (column("range")?, column("bearing")?, table.optional_names("id")?);
    let (range_variances, bearing_variances) = (column("var_range")?, column("var_bearing")?);
    let unit = plausibility::seconds_of_clock(path, times.iter().map(|[time]| *time));
    let mut sightings: Vec<LogSighting> = Vec::with_capacity(times.len());
    for (row, (&[time], line)) in times.iter().zip(table.lines()).enumerate() {
        let time = time / unit;
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
        let variances = [range_variances[row], bearing_variances[row]];
        sightings.push(LogSighting { time, id: ids[row], range, bearing, variances, covariance: 0.0 });
    }
    plausibility::check_sightings(path, &sightings, |row| table.line_of(row))?;
    Ok(sightings)
}

/// Puts measurements that are not in the order of time into it, and says so.
fn sort_by_time(path: &Path, sightings: &mut [LogSighting]) {
    let swapped = sightings.windows(2).filter(|pair| matches!(pair, [a, b] if b.time < a.time)).count();
    if swapped > 0 {
        sightings.sort_by(|a, b| a.time.total_cmp(&b.time));
        let cause = format!("{swapped} of {} measurements lie before the line above", sightings.len());
        Error::new(cause).at(path).help("they are sorted by time").warn();
    }
}

/// Seconds from an odometry line of MRCLAM to the motion: it holds what the robot was told. Against the truth the half-second
/// turns of all five robots fit best 0.20 to 0.27 s later, with half the error; the sightings have no such delay.
const MRCLAM_DELAY: f64 = 0.2;

/// One robot of a UTIAS MRCLAM folder: `RobotN_Odometry.dat`, `RobotN_Measurement.dat`, `RobotN_Groundtruth.dat`,
/// `Landmark_Groundtruth.dat`, and `Barcodes.dat` to tell landmarks (subjects 6 to 20) from robots and misread
/// barcodes, which are left out.
pub(super) fn mrclam(folder: &Path, robot: u32) -> Result<Recording> {
    let mut subjects = std::collections::HashMap::new();
    let path = folder.join("Barcodes.dat");
    for ([subject, barcode], line) in columns(&path)? {
        let whole = |number| plausibility::landmark_name(number).map_err(|error| error.at_line(&path, line));
        subjects.insert(whole(barcode)?, whole(subject)?);
    }
    let mut text = String::from("t,v,omega\n");
    let mut last = f64::NEG_INFINITY;
    let path = folder.join(format!("Robot{robot}_Odometry.dat"));
    let (mut rows, mut left_out) = (0, 0);
    for ([time, v, omega], _) in columns(&path)? {
        rows += 1;
        left_out += usize::from(time < last);
        if time > last {
            let effect = time + MRCLAM_DELAY;
            let _ = writeln!(text, "{effect},{v},{omega}"); // a String takes everything
            last = time;
        }
    }
    if left_out > 0 {
        let cause = format!("{left_out} of {rows} lines lie before the line above");
        Error::new(cause).at(&path).help("they are left out").warn();
    }
    let odometry = Odometry::from_table(&Table::parse(&path, &text)?)?;
    let path = folder.join(format!("Robot{robot}_Measurement.dat"));
    let (mut sightings, mut lines) = (Vec::new(), Vec::new());
    for ([time, barcode, range, bearing], line) in columns(&path)? {
        let barcode = plausibility::landmark_name(barcode).map_err(|error| error.at_line(&path, line))?;
        let Some(id) = subjects.get(&barcode).copied().filter(|subject| *subject > 5) else { continue };
        sightings.push(LogSighting { id: Some(id), ..LogSighting::range_bearing(time, range, bearing) });
        lines.push(line);
    }
    plausibility::check_sightings(&path, &sightings, |row| lines.get(row).copied().unwrap_or_default())?;
    sort_by_time(&path, &mut sightings);
    let log = SensorLog { odometry, sightings };
    let truth = columns(&folder.join(format!("Robot{robot}_Groundtruth.dat")))?
        .into_iter()
        .map(|(row, _)| stamped(row));
    let path = folder.join("Landmark_Groundtruth.dat");
    let true_map = columns(&path)?
        .into_iter()
        .map(|(row, line)| map_point(row).map_err(|error| error.at_line(&path, line)));
    let mut truth: Vec<_> = truth.collect();
    let poses = truth.len();
    truth.dedup_by(|later, earlier| later.time <= earlier.time);
    if truth.len() < poses {
        let cause =
            format!("{} of {poses} true poses are not later than the one before", poses - truth.len());
        Error::new(cause).at(folder).help("they are left out").warn();
    }
    Ok(Recording { log, truth, true_map: true_map.collect::<Result<_>>()? })
}

/// The Victoria Park log as factor-graph text (`ODOMETRY i j dx dy dθ …`, `LANDMARK pose id x y …`): a second a
/// step. The sightings' variance is the file's, 0.4 m² each way.
pub(super) fn victoria_park(path: &Path) -> Result<Recording> {
    let text = read_text(path)?;
    let mut odometry = String::from("t,dx,dy,dtheta\n0,0,0,0\n");
    let mut steps = std::collections::HashMap::from([(0_u32, 0.0)]);
    let mut time = 0.0;
    let mut sightings = Vec::new();
    let whole =
        |number: &f64, line| plausibility::landmark_name(*number).map_err(|error| error.at_line(path, line));
    for (line, content) in (1_u64..).zip(text.lines()) {
        let mut cells = content.split_whitespace();
        let kind = cells.next().unwrap_or_default();
        let numbers: Vec<f64> = cells.map_while(|cell| cell.parse().ok()).collect();
        match (kind, numbers.as_slice()) {
            ("ODOMETRY", [_, to, dx, dy, turn, ..]) => {
                time += 1.0;
                steps.insert(whole(to, line)?, time);
                let _ = writeln!(odometry, "{time},{dx},{dy},{turn}"); // a String takes everything
            }
            ("LANDMARK", [pose, id, x, y, variance, _, _]) => {
                let time = *steps
                    .get(&whole(pose, line)?)
                    .ok_or_else(|| Error::new("a pose without odometry").at_line(path, line))?;
                let range = x.hypot(*y);
                // Equal variances in x and y are equal variances along and across the ray.
                let variances = [Some(*variance), Some(variance / (range * range))];
                let sighting = LogSighting::range_bearing(time, range, y.atan2(*x));
                sightings.push(LogSighting { id: Some(whole(id, line)?), variances, ..sighting });
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
    let sighting = |[time, beacon, range]: [f64; 3]| {
        let id = plausibility::landmark_name(beacon).map_err(|error| error.at(file("TD")))?;
        Ok(LogSighting { id: Some(id), bearing: None, ..LogSighting::range_bearing(time, range, 0.0) })
    };
    let mut sightings: Vec<_> = ranges.into_iter().map(sighting).collect::<Result<_>>()?;
    sort_by_time(&file("TD"), &mut sightings);
    let log = SensorLog { odometry, sightings };
    let turned = if number == 2 { std::f64::consts::PI } else { 0.0 };
    let truth = table("GT")?.numbers(["t", "x", "y", "theta"])?.into_iter();
    let truth = truth.map(|[time, x, y, heading]| stamped([time, x, y, wrap_angle(heading + turned)]));
    let beacons = table("TL")?.numbers(["beacon_id", "x", "y"])?.into_iter();
    let true_map = beacons.map(|row| map_point(row).map_err(|error| error.at(file("TL"))));
    Ok(Recording { log, truth: truth.collect(), true_map: true_map.collect::<Result<_>>()? })
}

fn stamped([time, x, y, heading]: [f64; 4]) -> Stamped {
    Stamped { time, pose: Pose::new(x, y, heading), covariance: None }
}

fn map_point([id, x, y]: [f64; 3]) -> Result<MapPoint> {
    let id = plausibility::landmark_name(id)?.into();
    Ok(MapPoint { id, position: Vector2::new(x, y), covariance: None, seen: 0, first_and_last: None })
}

/// The numbers of a text of columns with their lines, `#` for comments.
fn columns<const N: usize>(path: &Path) -> Result<Vec<([f64; N], u64)>> {
    let text = read_text(path)?;
    let lines =
        (1_u64..).zip(text.lines()).filter(|(_, line)| !line.starts_with('#') && !line.trim().is_empty());
    if lines.clone().next().is_none() {
        return Err(Error::new("is empty").at(path).help(format!("every line holds {N} numbers")));
    }
    lines
        .map(|(number, line)| {
            let cells: Vec<f64> = line.split_whitespace().map_while(|cell| cell.parse().ok()).collect();
            let cells = cells.get(..N).and_then(|cells| <[f64; N]>::try_from(cells).ok());
            let cells = cells.filter(|cells| cells.iter().all(|cell| cell.is_finite()));
            let help = "correct the line, or remove it";
            cells.map(|cells| (cells, number)).ok_or_else(|| {
                Error::new(format!("is not {N} finite numbers")).at_line(path, number).help(help)
            })
        })
        .collect()
}

use super::median;
use crate::{Error, Result, sensor_log::LogSighting};
use monorange_core::geometry::{Camera, wrap_angle};
use nalgebra::Vector2;
use std::{collections::HashMap, f64::consts::PI, path::Path};

/// The name of a landmark that a number is.
///
/// # Errors
/// When it is not whole, below 0 or too large: rounded, two landmarks would become one.
pub fn landmark_name(number: f64) -> Result<u32> {
    // The largest number stands for "none" in some places.
    if number.fract() == 0.0 && (0.0..f64::from(u32::MAX)).contains(&number) {
        return Ok(number as u32);
    }
    let error = Error::new(format!("is {number}, must be a whole number from 0 to 4294967294"));
    Err(error.help(match number < 0.0 {
        true => "leave the cell empty if the landmark is not known, or number the landmarks from 0",
        false => "give every landmark a whole number",
    }))
}

/// Looks at the sightings of a log; `line` gives the line of each.
///
/// # Errors
/// With the line of a range that is not above 0, a bearing of more than a turn, or a variance that is not above 0.
pub fn check_sightings(path: &Path, sightings: &[LogSighting], line: impl Fn(usize) -> u64) -> Result<()> {
    let at =
        |row: usize, cause: String, help: &str| Err(Error::new(cause).at_line(path, line(row)).help(help));
    for (row, sighting) in sightings.iter().enumerate() {
        if let Some(range) = sighting.range.filter(|range| *range <= 0.0) {
            let help = "a sensor's word for no echo? Leave the cell empty, or remove the line";
            return at(row, format!("the range is {range}, must be above 0"), help);
        }
        if let Some(bearing) = sighting.bearing.filter(|bearing| bearing.abs() > 2.0 * std::f64::consts::PI) {
            let help = "bearings are radians: divide degrees by 57.29578";
            return at(
                row,
                format!("the bearing is {bearing}, more than a whole turn: it looks like degrees"),
                help,
            );
        }
        for (variance, name) in sighting.variances.into_iter().zip(["var_range", "var_bearing"]) {
            if let Some(variance) = variance.filter(|variance| *variance <= 0.0) {
                let help = "leave the cell empty if it is not known; no measurement is exact";
                return at(row, format!("`{name}` is {variance}, must be above 0"), help);
            }
        }
    }
    let Some(usual) = median(sightings.iter().filter_map(|sighting| sighting.range)) else { return Ok(()) };
    for (row, sighting) in sightings.iter().enumerate() {
        // Landmarks of one drive are not that unlike: 65.535 m, 10000 and the like are words for no echo.
        if let Some(range) = sighting.range.filter(|range| *range > 100.0 && *range > 20.0 * usual) {
            let cause = format!("the range is {range}, among ranges of {usual} in the median");
            return at(row, cause, "a sensor's word for no echo? Leave the cell empty, or remove the line");
        }
    }
    if let Some(range) = Some(usual).filter(|range| *range > 500.0) {
        let cause = format!("the median range is {range} m: it looks like millimetres or centimetres");
        Error::new(cause).at(path).help("ranges are metres: divide them").warn();
    }
    Ok(())
}

/// Fails when measured ranges are many times what the mount as given makes of their pixels.
///
/// # Errors
/// With the unit that they look like.
pub fn check_known_ranges(pairs: impl IntoIterator<Item = (f64, f64)>) -> Result<()> {
    let Some(ratio) = median(pairs.into_iter().map(|(measured, seen)| measured / seen)) else {
        return Ok(());
    };
    let unit = match ratio {
        // A mount measured by hand is off by less than a factor of five, or its height is in another unit too.
        ratio if ratio > 300.0 => "millimetres",
        ratio if ratio > 20.0 => "centimetres",
        ratio if ratio < 0.05 => "kilometres, or the rig's height like centimetres",
        _ => return Ok(()),
    };
    let cause = format!(
        "the ranges are {ratio:.3} times what the rig's mount makes of their pixels: they look like {unit}"
    );
    Err(Error::new(cause).help("lengths are metres, in the points and in the rig"))
}

/// Warns when ranges to named landmarks change faster than the robot drives: no unit of length does that but a wrong one.
/// `way` is the robot's between two times, m.
pub fn check_ranges_by_way(path: &Path, sightings: &[LogSighting], way: impl Fn(f64, f64) -> f64) {
    let (mut driven, mut before) = (0.0, None);
    let mut anchors = HashMap::new();
    let mut ratios = Vec::new();
    for sighting in sightings {
        driven += before.replace(sighting.time).map_or(0.0, |before| way(before, sighting.time));
        let (Some(id), Some(range)) = (sighting.id, sighting.range) else { continue };
        let (at, from) = *anchors.entry(id).or_insert((driven, range));
        // Over a metre the noise of a range is small beside the way.
        if driven - at >= 1.0 {
            ratios.push((range - from).abs() / (driven - at));
            anchors.insert(id, (driven, range));
        }
    }
    let count = ratios.len();
    if let Some(ratio) = median(ratios).filter(|ratio| *ratio > 8.0 && count >= 5) {
        let unit = if ratio > 150.0 { "millimetres" } else { "centimetres" };
        let cause = format!(
            "the ranges change by {ratio:.0} m for a metre that the robot drives: they look like {unit}"
        );
        Error::new(cause).at(path).help("lengths are metres, in measurements and odometry").warn();
    }
}

/// Warns when bearings of named landmarks turn as if the robot turned or drove the other way; `step` is its motion between
/// two times: (forward, left), m, and turn, rad.
pub fn check_bearings_by_turns(
    path: &Path,
    sightings: &[LogSighting],
    step: impl Fn(f64, f64) -> (Vector2<f64>, f64),
) {
    let mut before: HashMap<u32, (f64, f64, f64)> = HashMap::new();
    // Errors of the predicted bearing: as given, with the other turn, with the other way.
    let mut errors = [Vec::new(), Vec::new(), Vec::new()];
    for sighting in sightings {
        let (Some(id), Some(range), Some(bearing)) = (sighting.id, sighting.range, sighting.bearing) else {
            continue;
        };
        let Some((time, range, at)) = before.insert(id, (sighting.time, range, bearing)) else { continue };
        let seconds = sighting.time - time;
        if !(seconds > 0.0 && seconds < 2.0) {
            continue;
        }
        let (way, turn) = step(time, sighting.time);
        let (sin, cos) = libm::sincos(at);
        let error = |way: Vector2<f64>, turn: f64| {
            let place = Vector2::new(range * cos, range * sin) - way;
            wrap_angle(bearing - (libm::atan2(place.y, place.x) - turn)).abs()
        };
        let mirrored = Vector2::new(way.x, -way.y);
        for (errors, error) in
            errors.iter_mut().zip([error(way, turn), error(mirrored, -turn), error(-way, turn)])
        {
            errors.push(error);
        }
    }
    let count = errors[0].len();
    let [as_given, turned, back] = errors.map(|errors| median(errors).unwrap_or_default());
    let (off, words) = match turned <= back {
        true => (turned, "positive to the right, or the turn rates are"),
        false => (back, "of a robot that drives backwards"),
    };
    if count >= 20 && as_given > 0.005 && off < 0.3 * as_given {
        let cause = format!("the bearings turn against what the odometry says: they look {words}");
        Error::new(cause).at(path).help("bearings and turns are positive to the left, speeds ahead").warn();
    }
}

/// Fails when bearings are not those of their pixels but would be, read in another way; (measured, seen), rad.
///
/// # Errors
/// With the way they look: degrees, positive to the right, from another axis.
pub fn check_known_bearings(pairs: &[(f64, f64)]) -> Result<()> {
    let off = |read: fn(f64) -> f64| {
        median(pairs.iter().map(|(measured, seen)| wrap_angle(read(*measured) - seen).abs()))
            .unwrap_or_default()
    };
    let as_given = off(|bearing| bearing);
    // The mount by hand may be a few degrees off.
    if as_given < 0.15 || pairs.len() < 3 {
        return Ok(());
    }
    let others = [
        (off(f64::to_radians), "they look like degrees", "divide degrees by 57.29578"),
        (
            off(|bearing| -bearing),
            "they look positive to the right",
            "bearings are positive to the left, as y is",
        ),
        (
            off(|bearing| PI / 2.0 - bearing),
            "x and y look exchanged",
            "x is ahead, y to the left, bearings from x on",
        ),
    ];
    match others.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((off, looks, help)) if off < 0.25 * as_given => {
            let degrees = as_given.to_degrees();
            let cause =
                format!("the bearings are {degrees:.0}° from those of their pixels in the median: {looks}");
            Err(Error::new(cause).help(help))
        }
        _ => Ok(()),
    }
}

/// Warns when pixels are none of this camera's pictures: parts of the picture's width, or all of them outside.
pub fn check_pixels(path: &Path, pixels: &[[f64; 2]], camera: &Camera<f64>) {
    let size = [camera.width() as f64, camera.height() as f64];
    let parts = |pixel: &[f64; 2]| pixel.iter().all(|place| (-0.01..=1.01).contains(place));
    if pixels.iter().all(parts) && pixels.iter().flatten().any(|place| place.fract() != 0.0) {
        Error::new(
            "all pixels lie within one pixel of the corner: they look like parts of the picture's size",
        )
        .at(path)
        .help("give pixels: multiply u by the width and v by the height")
        .warn();
    } else if !pixels.is_empty()
        && pixels
            .iter()
            .all(|pixel| pixel.iter().zip(size).any(|(place, size)| *place < -0.5 || *place > size - 0.5))
    {
        let [width, height] = size;
        Error::new(format!("none of the {} pixels lies in the picture of {width}×{height}", pixels.len()))
            .at(path)
            .help("give pixels of pictures of the rig's size")
            .warn();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warnings;

    #[test]
    fn ranges_that_change_faster_than_the_robot_drives_are_another_unit() {
        let said = |unit: f64| {
            warnings::forget();
            let sighting = |step: u32| {
                let time = f64::from(step);
                LogSighting {
                    id: Some(step % 2),
                    ..LogSighting::range_bearing(time, unit * (30.0 - 0.7 * time), 0.1)
                }
            };
            let sightings: Vec<_> = (0..30).map(sighting).collect();
            check_ranges_by_way(Path::new("m.csv"), &sightings, |from, to| to - from);
            warnings::fresh()
        };
        assert!(said(1.0).is_empty());
        assert!(said(100.0)[0].starts_with("m.csv: the ranges change by 70 m"));
        assert!(said(1000.0)[0].contains("millimetres"));
    }

    #[test]
    fn bearings_read_in_another_way_are_named() {
        let seen = [0.26, -0.3, 0.25, -0.2, 0.02];
        let words = |read: fn(f64) -> f64| {
            let pairs: Vec<_> = seen.iter().map(|seen| (read(*seen), *seen)).collect();
            check_known_bearings(&pairs).map_err(|error| error.to_string())
        };
        words(|bearing| bearing).unwrap();
        words(|bearing| bearing + 0.3).unwrap(); // a mount that is turned
        assert!(words(f64::to_degrees).unwrap_err().contains("degrees"));
        assert!(words(|bearing| -bearing).unwrap_err().contains("to the right"));
        assert!(words(|bearing| PI / 2.0 - bearing).unwrap_err().contains("exchanged"));
    }
}

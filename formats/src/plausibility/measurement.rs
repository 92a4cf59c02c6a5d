use super::median;
use crate::{Error, Result, sensor_log::LogSighting};
use std::path::Path;

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
    if let Some(range) =
        median(sightings.iter().filter_map(|sighting| sighting.range)).filter(|range| *range > 500.0)
    {
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

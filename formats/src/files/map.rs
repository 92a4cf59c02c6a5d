use super::Table;
use crate::{Error, Result};
use monorange_core::slam::{Filter, Landmark, Status};
use nalgebra::{Matrix2, Vector2};
use std::{
    io::{self, Write},
    path::Path,
};

/// A landmark of a map file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapPoint {
    /// Its number.
    pub id: u64,
    /// (x, y) in the world, m.
    pub position: Vector2<f64>,
    /// Covariance of the position, where the file gives one, m².
    pub covariance: Option<Matrix2<f64>>,
    /// Sightings.
    pub seen: u64,
    /// Time of the first and of the last sighting, s.
    pub first_and_last: Option<[f64; 2]>,
}

/// The confirmed landmarks of a filter whose clock began at `start` seconds.
pub fn confirmed_map<S, L>(filter: &Filter<f32, S, L>, start: f64) -> Vec<MapPoint>
where
    S: AsRef<[f32]> + AsMut<[f32]>,
    L: AsRef<[Landmark<f32>]> + AsMut<[Landmark<f32>]>,
{
    let confirmed = filter.landmarks().iter().filter(|landmark| landmark.status == Status::Confirmed);
    let points = confirmed.filter_map(|landmark| {
        Some(MapPoint {
            id: landmark.id.into(),
            position: filter.position(landmark)?.cast(),
            covariance: filter.position_covariance(landmark).map(|covariance| covariance.cast()),
            seen: landmark.seen.into(),
            first_and_last: Some([landmark.first_time + start, landmark.last_time + start]),
        })
    });
    points.collect()
}

const HEADER: &str = "id,x,y,var_x,cov_xy,var_y,seen,first_t,last_t";

/// The landmarks of a CSV `id,x,y`, with or without `var_x,cov_xy,var_y,seen,first_t,last_t`.
///
/// # Errors
/// When the file cannot be read, lacks a column or holds something else than finite numbers.
pub fn read_map(path: &Path) -> Result<Vec<MapPoint>> {
    let table = Table::read(path)?;
    let rows = table.numbers(["id", "x", "y"])?;
    let names = table.optional_names("id")?;
    let mut taken = std::collections::HashMap::new();
    for (name, line) in names.iter().flatten().zip(table.lines()) {
        if let Some(before) = taken.insert(*name, line) {
            return Err(Error::new(format!("the landmark {name} is there already, in line {before}"))
                .at_line(path, line)
                .help("give every landmark a name of its own"));
        }
    }
    let [xx, xy, yy] = ["var_x", "cov_xy", "var_y"].map(|column| table.optional_numbers(column));
    let packed = xx?.into_iter().zip(xy?).zip(yy?);
    let covariances = packed.map(|((xx, xy), yy)| Some(Matrix2::new(xx?, xy?, xy?, yy?)));
    let [seen, first, last] = ["seen", "first_t", "last_t"].map(|column| table.optional_numbers(column));
    let counts = seen?.into_iter().zip(first?).zip(last?);
    let points = rows.into_iter().zip(covariances).zip(counts);
    Ok(points
        .map(|(([id, x, y], covariance), ((seen, first), last))| MapPoint {
            id: id as u64,
            position: Vector2::new(x, y),
            covariance,
            seen: seen.unwrap_or(0.0) as u64,
            first_and_last: first.zip(last).map(|(first, last)| [first, last]),
        })
        .collect())
}

/// Writes a map as CSV.
///
/// # Errors
/// When writing fails.
pub fn write_map(out: &mut dyn Write, map: &[MapPoint]) -> io::Result<()> {
    writeln!(out, "{HEADER}")?;
    for point in map {
        write!(out, "{},{},{}", point.id, point.position.x, point.position.y)?;
        match point.covariance {
            Some(c) => write!(out, ",{},{},{}", c.m11, c.m12, c.m22)?,
            None => write!(out, ",,,")?,
        }
        match point.first_and_last {
            Some([first, last]) => writeln!(out, ",{},{first},{last}", point.seen)?,
            None => writeln!(out, ",{},,", point.seen)?,
        }
    }
    Ok(())
}

/// Writes a map as PLY, landmarks as points of the floor z = 0 with their largest standard deviation.
///
/// # Errors
/// When writing fails.
pub fn write_ply(out: &mut dyn Write, map: &[MapPoint]) -> io::Result<()> {
    writeln!(
        out,
        "ply\nformat ascii 1.0\ncomment landmarks on the floor, metres\nelement vertex {}",
        map.len()
    )?;
    for property in ["float x", "float y", "float z", "int id", "float std", "int seen"] {
        writeln!(out, "property {property}")?;
    }
    writeln!(out, "end_header")?;
    for point in map {
        let std = point.covariance.map_or(0.0, |c| c.symmetric_eigenvalues().max().max(0.0).sqrt());
        let (x, y) = (point.position.x as f32, point.position.y as f32);
        writeln!(out, "{x} {y} 0 {} {} {}", point.id, std as f32, point.seen)?;
    }
    Ok(())
}

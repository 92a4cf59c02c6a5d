//! `calibrate-mount`: how the camera sits on the robot, from what it sees.
use super::rig_file::RigFile;
use crate::{
    calibration::{self, Calibration, Evidence},
    outputs::{Outputs, to_file_or_stdout},
    sequence::{Sequence, SequenceFiles},
};
use clap::{Args, ValueEnum};
use monorange_core::calibration::{Fitted, KnownPoint, PointNoise};
use monorange_formats::{
    Error, Result,
    files::{Rig, Table},
    plausibility,
};
use nalgebra::Vector2;
use std::path::{Path, PathBuf};

/// How the camera sits on the robot, from floor points of known place or from a sequence of pictures.
///
/// Three kinds of evidence. `--points`: CSV `u,v,range,bearing` or `u,v,x,y` (m, rad, robot frame), by least
/// squares; one point that all others contradict is left out and named, a lens that is not above the place you measured
/// from is found (forward, left), and where several measurements are bad they count less. `--frames` with `--odometry`: a drive, in which
/// the floor's corners must move as the wheels say. `--frames` alone: edges that are vertical in the world, which
/// tell tilt and roll. Gives each parameter with its standard deviation, and for points the residuals, also of every
/// point from the fit to the others.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 10 --out corridor-10
  printf 'u,v,range,bearing\\n60,200,0.88,0.26\\n250,195,0.92,-0.30\\n60,150,1.33,0.25\\n240,140,1.48,-0.26\\n' > points.csv
  monorange calibrate-mount --rig corridor-10/rig.toml --points points.csv --fit tilt,roll,yaw --out fitted.toml")]
pub struct Arguments {
    #[command(flatten)]
    rig: RigFile,
    /// Floor points of known place (CSV u,v,range,bearing or u,v,x,y).
    #[arg(long, value_name = "FILE", conflicts_with = "frames", required_unless_present = "frames")]
    points: Option<PathBuf>,
    /// A folder of pictures instead of points.
    #[arg(long, value_name = "DIR")]
    frames: Option<PathBuf>,
    /// Odometry of the pictures' drive (CSV).
    #[arg(long, value_name = "FILE", requires = "frames")]
    odometry: Option<PathBuf>,
    /// Times of the frames, one a line, s; `times.txt` beside their folder without it.
    #[arg(long, value_name = "FILE", requires = "frames")]
    times: Option<PathBuf>,
    /// What is fitted; by default all that the evidence tells.
    #[arg(long, value_enum, value_delimiter = ',')]
    fit: Vec<Parameter>,
    /// Standard deviation of a point's pixel, px.
    #[arg(long, value_name = "PX", default_value_t = 1.0)]
    pixel_std: f64,
    /// Standard deviation of a measured range, % of it.
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0)]
    range_std: f64,
    /// Standard deviation of a measured bearing, rad.
    #[arg(long, value_name = "RAD", default_value_t = 0.01)]
    bearing_std: f64,
    /// Write the rig with the fitted mount to this file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Parameter {
    Tilt,
    Roll,
    Yaw,
    Height,
    Forward,
    Left,
}

/// Runs the command.
///
/// # Errors
/// When a file is missing or malformed, or the evidence does not determine what is to be fitted.
pub fn run(arguments: &Arguments) -> Result<()> {
    let rig = arguments.rig.read()?;
    let calibration = match (&arguments.points, &arguments.frames) {
        (Some(points), _) => from_points(arguments, &rig, points)?,
        (None, Some(frames)) => from_frames(arguments, &rig, frames)?,
        (None, None) => {
            return Err(Error::new("there is nothing to fit to").help("give --points or --frames"));
        }
    };
    if calibration
        .parameters
        .iter()
        .any(|parameter| !(parameter.fitted.is_finite() && parameter.std.is_finite()))
    {
        return Err(Error::new(
            "the fit does not come to finite numbers: the evidence contradicts the rig's mount",
        )
        .help("correct the points, or height and tilt in the rig file"));
    }
    if let Some(out) = &arguments.out {
        let text = calibration.rig_text(&arguments.rig.rig, out)?;
        let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let name = out.file_name().ok_or_else(|| Error::new("is not a file's name").at(out))?;
        let mut outputs = Outputs::into_folder(folder)?;
        outputs.write(&name.to_string_lossy(), |file| file.write_all(text.as_bytes()))?;
        outputs.commit()?;
    }
    let text = match arguments.json {
        true => serde_json::to_string_pretty(&calibration).map_err(Error::new)? + "\n",
        false => calibration.to_string(),
    };
    to_file_or_stdout(None, |to| to.write_all(text.as_bytes()))
}

fn fitted(chosen: &[Parameter], all: Fitted) -> Fitted {
    if chosen.is_empty() {
        return all;
    }
    let order = [
        Parameter::Height,
        Parameter::Tilt,
        Parameter::Roll,
        Parameter::Yaw,
        Parameter::Forward,
        Parameter::Left,
    ];
    Fitted(order.map(|parameter| chosen.contains(&parameter)))
}

fn from_points(arguments: &Arguments, rig: &Rig, path: &Path) -> Result<Calibration> {
    let points = known_points(path, rig)?;
    let seen: Vec<_> = points
        .iter()
        .filter_map(|point| Some((point.range_bearing, rig.finder.sight(point.pixel).ok()?)))
        .collect();
    let ranges = seen.iter().map(|(known, sighting)| (known.x, sighting.range));
    plausibility::check_known_ranges(ranges).map_err(|error| error.at(path))?;
    if let Some((place, point)) =
        points.iter().enumerate().find(|(_, point)| point.range_bearing.y.abs() > std::f64::consts::PI)
    {
        let cause =
            format!("the bearing is {}, more than half a turn: it looks like degrees", point.range_bearing.y);
        return Err(Error::new(cause)
            .at(path)
            .help(format!("bearings are radians: divide degrees by 57.29578 (point {})", place + 1)));
    }
    let bearings: Vec<_> = seen.iter().map(|(known, sighting)| (known.y, sighting.bearing)).collect();
    plausibility::check_known_bearings(&bearings).map_err(|error| error.at(path))?;
    let noise = PointNoise {
        pixel_std_px: arguments.pixel_std,
        range_std_share: arguments.range_std / 100.0,
        bearing_std: arguments.bearing_std,
    };
    let noise = noise.validated().map_err(Error::new)?;
    let (chosen, free) = (fitted(&arguments.fit, Fitted::HEIGHT_AND_ANGLES), arguments.fit.is_empty());
    calibration::from_points(rig, &points, &noise, chosen, free).map_err(|error| {
        error.at(path).help("add points, near and far, left and right, or fit less: --fit tilt,roll,yaw")
    })
}

/// The points of a table, by range and bearing or by place.
fn known_points(path: &Path, rig: &Rig) -> Result<Vec<KnownPoint>> {
    let table = Table::read(path)?;
    let by_place = table.has("x") && !table.has("range");
    let rows = table.numbers(if by_place { ["u", "v", "x", "y"] } else { ["u", "v", "range", "bearing"] })?;
    let known = |[u, v, a, b]: [f64; 4]| {
        let (pixel, place) = (Vector2::new(u, v), Vector2::new(a, b));
        if by_place {
            KnownPoint::from_place(pixel, place)
        } else {
            KnownPoint { pixel, range_bearing: place }
        }
    };
    let points: Vec<_> = rows.into_iter().map(known).collect();
    if points.is_empty() {
        return Err(Error::new("holds no point")
            .at(path)
            .help("give `u,v,range,bearing` or `u,v,x,y` a line, near and far, left and right"));
    }
    let camera = rig.finder.camera();
    let [width, height] = [camera.width(), camera.height()].map(|size| size as f64);
    let outside = |pixel: &Vector2<f64>| {
        let inside = |place: f64, size: f64| (-0.5..=size - 0.5).contains(&place);
        !(inside(pixel.x, width) && inside(pixel.y, height))
    };
    if let Some((point, line)) = points.iter().zip(table.lines()).find(|(point, _)| outside(&point.pixel)) {
        let (u, v) = (point.pixel.x, point.pixel.y);
        return Err(Error::new(format!("the pixel ({u}, {v}) is not in the picture of {width}×{height}"))
            .at_line(path, line)
            .help("give pixels of pictures of the rig's size"));
    }
    match points.iter().zip(table.lines()).find(|(point, _)| point.range_bearing.x <= 0.0) {
        Some((_, line)) => Err(Error::new("the range is not above 0")
            .at_line(path, line)
            .help("give the distance in metres")),
        None => Ok(points),
    }
}

fn from_frames(arguments: &Arguments, rig: &Rig, frames: &Path) -> Result<Calibration> {
    let evidence = if arguments.odometry.is_some() { Evidence::Drive } else { Evidence::Verticals };
    let told = match evidence {
        Evidence::Drive => Fitted::HEIGHT_AND_ANGLES,
        _ => Fitted::TILT_AND_ROLL,
    };
    let chosen = fitted(&arguments.fit, told);
    if chosen.0.into_iter().zip(told.0).any(|(chosen, told)| chosen && !told) {
        return Err(Error::new("vertical edges tell tilt and roll only")
            .help("leave --fit away, or give --odometry or --points"));
    }
    let (times, odometry) = (arguments.times.as_deref(), arguments.odometry.as_deref());
    match evidence {
        Evidence::Drive => {
            let files = SequenceFiles { frames, times, odometry, attitude: None, truth: None };
            calibration::from_drive(rig, &Sequence::read(files, rig)?, chosen)
        }
        _ => calibration::from_verticals(rig, frames, chosen),
    }
}

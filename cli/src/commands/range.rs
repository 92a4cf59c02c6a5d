//! `range`: pixels of the floor, or the feet of boxes → range and bearing with their covariance.
use super::rig_file::RigFile;
use crate::outputs::to_file_or_stdout;
use clap::Args;
use monorange_core::geometry::NoFloor;
use monorange_formats::{
    Error, Result,
    files::{Rig, STANDARD_INPUT, Table, read_standard_input},
    plausibility,
};
use nalgebra::{Matrix2, Vector2};
use std::path::{Path, PathBuf};

/// Pixels of the floor, or a detector's boxes, to range, bearing and position, each with its covariance.
///
/// Reads CSV with the columns `u,v`, or `u0,v0,u1,v1` for boxes: a box stands where the middle of its lower edge is. Writes, line for line,
/// `u,v,range,bearing,var_range,cov_range_bearing,var_bearing,x,y,status` and then what other columns there are, a label for instance. The
/// status is `ok`, `above_horizon`, `outside_image` (for a box that the picture cuts off below, too) or `outside_lens_model`; with
/// --height-above-floor above the lens `below_horizon`. The numbers are empty unless it is `ok`.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 10 --out corridor-10
  printf 'u,v\\n160,200\\n40,150\\n' | monorange range --rig corridor-10/rig.toml
  printf 'label,u0,v0,u1,v1\\nchair,100,60,220,200\\n' | monorange range --rig corridor-10/rig.toml")]
pub struct Arguments {
    #[command(flatten)]
    rig: RigFile,
    /// CSV with the columns u,v or u0,v0,u1,v1; standard input without it.
    pixels: Option<PathBuf>,
    /// What is seen is not on the floor but so high above it, m: a switch, a lamp, a marker on a wall.
    #[arg(long, value_name = "M", default_value_t = 0.0, allow_negative_numbers = true)]
    height_above_floor: f64,
    /// Standard deviation of a box's lower edge, px. To the side its foot is known to a sixth of its width.
    #[arg(long, value_name = "PX", default_value_t = 2.0)]
    box_std: f64,
    /// Add the mount's own uncertainty, which is common to all pixels, to the pixel's.
    #[arg(long)]
    mount_uncertainty: bool,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// What the output names itself.
const COLUMNS: [&str; 10] =
    ["u", "v", "range", "bearing", "var_range", "cov_range_bearing", "var_bearing", "x", "y", "status"];
const BOX: [&str; 4] = ["u0", "v0", "u1", "v1"];

/// Runs the command.
///
/// # Errors
/// When a file is missing or malformed.
pub fn run(arguments: &Arguments) -> Result<()> {
    let rig = arguments.rig.read()?;
    let table = match &arguments.pixels {
        Some(path) => Table::read(path)?,
        None => Table::parse(Path::new(STANDARD_INPUT), &read_standard_input()?)?,
    };
    let finder = rig.finder.of_height(arguments.height_above_floor).map_err(|error| {
        Error::new(error)
            .help("give --height-above-floor in metres; at the lens's own height every ray is level")
    })?;
    let pixels = arguments.pixels(&table, &rig)?;
    let others = table.others(&[COLUMNS.as_slice(), &BOX].concat());
    to_file_or_stdout(arguments.out.as_deref(), |out| {
        let names: String = others.iter().map(|(name, _)| format!(",{}", cell(name))).collect();
        writeln!(out, "{}{names}", COLUMNS.join(","))?;
        for (row, Pixel { u, v, covariance, whole }) in pixels.into_iter().enumerate() {
            let seen = if whole { finder.sight(Vector2::new(u, v)) } else { Err(NoFloor::OutsideImage) };
            write!(out, "{u},{v},")?;
            match seen {
                Ok(sighting) => {
                    let mut covariance = sighting.noise(&covariance);
                    if arguments.mount_uncertainty {
                        covariance += sighting.systematic(&rig.mount_std);
                    }
                    let (range, bearing, point) = (sighting.range, sighting.bearing, sighting.point_in_robot);
                    let (m11, m12, m22) = (covariance.m11, covariance.m12, covariance.m22);
                    write!(out, "{range},{bearing},{m11},{m12},{m22},{},{},ok", point.x, point.y)?;
                }
                Err(reason) => write!(out, ",,,,,,,{}", status(reason, finder.mount().height()))?,
            }
            for (_, cells) in &others {
                write!(out, ",{}", cell(cells.get(row).copied().unwrap_or_default()))?;
            }
            writeln!(out)?;
        }
        Ok(())
    })
}

/// A point of the picture whose range is asked for.
struct Pixel {
    u: f64,
    v: f64,
    covariance: Matrix2<f64>,
    /// Whether the picture shows it: a box that the lower border cuts off has its foot elsewhere.
    whole: bool,
}

impl Arguments {
    fn pixels(&self, table: &Table, rig: &Rig) -> Result<Vec<Pixel>> {
        let camera = rig.finder.camera();
        if !table.has("u0") || table.has("u") {
            let pixels = table.numbers(["u", "v"])?;
            plausibility::check_pixels(table.path(), &pixels, camera);
            let covariance = rig.pixel_covariance();
            return Ok(pixels.into_iter().map(|[u, v]| Pixel { u, v, covariance, whole: true }).collect());
        }
        if !(self.box_std.is_finite() && self.box_std > 0.0) {
            return Err(Error::new(format!("--box-std is {}, must be above 0 (pixels)", self.box_std))
                .help("2 suits most detectors"));
        }
        let boxes = table.numbers(BOX)?;
        let foot = |&[u0, v0, u1, v1]: &[f64; 4]| {
            let side = ((u1 - u0).abs() / 6.0).max(self.box_std);
            let covariance = Matrix2::new(side * side, 0.0, 0.0, self.box_std * self.box_std);
            let v = v0.max(v1);
            Pixel { u: 0.5 * (u0 + u1), v, covariance, whole: v < camera.height() as f64 - 1.5 }
        };
        let feet: Vec<_> = boxes.iter().map(foot).collect();
        let pixels: Vec<_> = feet.iter().map(|foot| [foot.u, foot.v]).collect();
        plausibility::check_pixels(table.path(), &pixels, camera);
        Ok(feet)
    }
}

/// A text as a cell of a CSV.
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn status(reason: NoFloor, height: f64) -> &'static str {
    match reason {
        NoFloor::AboveHorizon if height < 0.0 => "below_horizon",
        NoFloor::AboveHorizon => "above_horizon",
        NoFloor::OutsideImage => "outside_image",
        NoFloor::OutsideLensModel => "outside_lens_model",
    }
}

//! `range`: pixels of the floor → range and bearing with their covariance.
use super::rig_file::RigFile;
use crate::outputs::to_file_or_stdout;
use clap::Args;
use monorange_core::geometry::NoFloor;
use monorange_formats::{
    Result,
    files::{STANDARD_INPUT, Table, read_standard_input},
    plausibility,
};
use nalgebra::Vector2;
use std::path::{Path, PathBuf};

/// Pixels of the floor to range, bearing and position, each with its covariance.
///
/// Reads CSV with the columns `u,v` and writes, line for line,
/// `u,v,range,bearing,var_range,cov_range_bearing,var_bearing,x,y,status`. The status is `ok`, `above_horizon`,
/// `outside_image` or `outside_lens_model`; the numbers are empty unless it is `ok`.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 10 --out corridor-10
  printf 'u,v\\n160,200\\n40,150\\n' | monorange range --rig corridor-10/rig.toml")]
pub struct Arguments {
    #[command(flatten)]
    rig: RigFile,
    /// CSV with the columns u,v; standard input without it.
    pixels: Option<PathBuf>,
    /// Add the mount's own uncertainty, which is common to all pixels, to the pixel's.
    #[arg(long)]
    mount_uncertainty: bool,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

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
    let pixels = table.numbers(["u", "v"])?;
    plausibility::check_pixels(table.path(), &pixels, rig.finder.camera());
    to_file_or_stdout(arguments.out.as_deref(), |out| {
        writeln!(out, "u,v,range,bearing,var_range,cov_range_bearing,var_bearing,x,y,status")?;
        for [u, v] in pixels {
            let sighting = match rig.finder.sight(Vector2::new(u, v)) {
                Ok(sighting) => sighting,
                Err(reason) => {
                    writeln!(out, "{u},{v},,,,,,,,{}", status(reason))?;
                    continue;
                }
            };
            let mut covariance = sighting.noise(&rig.pixel_covariance());
            if arguments.mount_uncertainty {
                covariance += sighting.systematic(&rig.mount_std);
            }
            let (range, bearing, point) = (sighting.range, sighting.bearing, sighting.point_in_robot);
            let (m11, m12, m22) = (covariance.m11, covariance.m12, covariance.m22);
            writeln!(out, "{u},{v},{range},{bearing},{m11},{m12},{m22},{},{},ok", point.x, point.y)?;
        }
        Ok(())
    })
}

fn status(reason: NoFloor) -> &'static str {
    match reason {
        NoFloor::AboveHorizon => "above_horizon",
        NoFloor::OutsideImage => "outside_image",
        NoFloor::OutsideLensModel => "outside_lens_model",
    }
}

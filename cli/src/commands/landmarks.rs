//! `landmarks`: pictures → floor corners, with an overlay to look at.
use super::rig_file::RigFile;
use crate::{commands::progress, outputs::to_file_or_stdout, overlays::Overlays};
use clap::Args;
use monorange_core::{
    geometry::Sighting,
    proposals::{Corner, Extraction, OnHeap, Proposal, ProposalConfig, Truncations},
};
use monorange_formats::{
    Error, Result,
    draw::{Mark, ORANGE, Overlay, SEEN, Shape},
    files::Rig,
    pictures::{self, Picture},
};
use nalgebra::Matrix2;
use std::{
    collections::BTreeMap,
    fmt::Write as _,
    path::{Path, PathBuf},
};

/// Floor corners of pictures: the feet of vertical edges on edges of the floor.
///
/// Writes `image,u,v,var_u,cov_uv,var_v,range,bearing,var_range,cov_range_bearing,var_bearing,probability`, the likeliest
/// corner of a picture first; range and bearing are empty for a corner that does not look at the floor. The
/// covariances are those of the corner's lines and the rig's `pixel_std` together; `probability` says how likely it is a
/// corner of the floor. A picture that cannot be read is named and left out. The drive's commands look for corners more
/// strictly, by the rig's `[extract]`, which is not used here.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 10 --out corridor-10
  monorange landmarks --rig corridor-10/rig.toml corridor-10/frames/000000.png --overlay corridor-10/overlay")]
pub struct Arguments {
    #[command(flatten)]
    rig: RigFile,
    /// PNG, JPEG or PNM pictures, or folders of them.
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<PathBuf>,
    /// Draw edges, lines, corners, horizon and a 1 m floor grid over every picture, into this folder.
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,
    /// Write every place that may be a corner, however unlikely, several in one place too.
    #[arg(long, conflicts_with = "min_probability")]
    proposals: bool,
    /// Leave out corners less likely than this.
    #[arg(long, value_name = "P", default_value_t = ProposalConfig::default().min_probability, value_parser = probability)]
    min_probability: f32,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When the rig is malformed, a picture has another size than the rig's, or none could be read.
pub fn run(arguments: &Arguments) -> Result<()> {
    let rig = arguments.rig.read()?;
    let config = ProposalConfig { min_probability: arguments.min_probability, ..ProposalConfig::default() };
    let mut extractor = OnHeap::on_heap(config, rig.settings.finder).map_err(Error::new)?;
    let images = expand(&arguments.images)?;
    let camera = rig.finder.camera();
    for image in &images {
        pictures::check_size(image, camera.width(), camera.height())?;
    }
    let mut outputs = arguments.overlay.as_deref().map(Overlays::into_folder).transpose()?;
    let mut table =
        "image,u,v,var_u,cov_uv,var_v,range,bearing,var_range,cov_range_bearing,var_bearing,probability\n"
            .to_owned();
    let mut without = BTreeMap::<&str, usize>::new();
    let (mut read, mut crowded, bar) = (0, 0, progress::bar(images.len(), "pictures"));
    for image in &images {
        bar.inc(1);
        let picture = match Picture::read(image) {
            Ok(picture) => picture,
            Err(error) => {
                bar.suspend(|| crate::warnings::left_out(&error));
                continue;
            }
        };
        read += 1;
        let extraction =
            extractor.extract(picture.grey()?).map_err(|error| Error::new(error).at(image))?.clone();
        if arguments.proposals {
            let proposed = extraction.proposals.iter().map(as_corner);
            proposed.for_each(|corner| table.push_str(&row(&rig, image, &corner)));
        } else {
            extraction.corners.iter().for_each(|corner| table.push_str(&row(&rig, image, corner)));
        }
        if let Some(why) = why_none(&extraction) {
            *without.entry(why).or_default() += 1;
        }
        let Truncations { edge_points, lines, proposals, corners } = extraction.truncations;
        crowded += usize::from(edge_points + lines + proposals + corners > 0);
        if let Some(outputs) = &mut outputs {
            let png = overlay(&rig, &extraction, &extractor, &picture, image)?;
            outputs.write(image, &png)?;
        }
    }
    bar.finish_and_clear();
    if crowded > 0 {
        eprintln!(
            "note: {crowded} of {read} pictures show more edges, lines or corners than are kept; the best ones are"
        );
    }
    for (why, count) in &without {
        eprintln!("note: {count} of {read} pictures have no corner: {why}");
    }
    if read == 0 {
        return Err(Error::new("none of the pictures could be read").help("give PNG, JPEG or PNM pictures"));
    }
    if let Some(outputs) = outputs {
        outputs.commit()?;
    }
    to_file_or_stdout(arguments.out.as_deref(), |out| out.write_all(table.as_bytes()))
}

/// The pictures named, and those in the folders named.
fn expand(images: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut expanded = Vec::new();
    for image in images {
        match image.is_dir() {
            true => expanded.extend(pictures::in_folder(image)?),
            false if image.exists() => expanded.push(image.clone()),
            false => return Err(Error::new("no such file or folder").at(image).help("check the path")),
        }
    }
    Ok(expanded)
}

/// A number from 0 to 1.
fn probability(text: &str) -> std::result::Result<f32, String> {
    let number = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.0..=1.0).contains(&number) { Ok(number) } else { Err("not from 0 to 1".to_owned()) }
}

/// Why a picture has no corner; `None` when it has one.
fn why_none(extraction: &Extraction) -> Option<&'static str> {
    if !extraction.corners.is_empty() {
        return None;
    }
    Some(if extraction.edge_points == 0 {
        "no edge stands out of the noise (give more light)"
    } else if !extraction.proposals.is_empty() {
        "what was found is less likely than --min-probability (--proposals shows it)"
    } else if extraction.vertical_lines.is_empty() {
        "no edge points along gravity (do the rig's tilt and roll fit?), and no edge of the floor bends"
    } else {
        "no edge of the floor meets an upright edge below the horizon (do the rig's tilt and height fit?)"
    })
}

fn as_corner(proposal: &Proposal) -> Corner {
    let Proposal { pixel, covariance, probability, brighter_right, brighter_below, .. } = *proposal;
    Corner { pixel, covariance, probability, brighter_right, brighter_below }
}

fn row(rig: &Rig, image: &Path, corner: &Corner) -> String {
    let (pixel, c) = (corner.pixel, covariance(rig, corner));
    let image = image.display().to_string();
    let image =
        if image.contains([',', '"', '\n']) { format!("\"{}\"", image.replace('"', "\"\"")) } else { image };
    let mut row = format!("{image},{},{},{},{},{}", pixel.x, pixel.y, c.m11, c.m12, c.m22);
    let _ = match sight(rig, corner) {
        Some((sighting, noise)) => writeln!(
            row,
            ",{},{},{},{},{},{}",
            sighting.range, sighting.bearing, noise.m11, noise.m12, noise.m22, corner.probability
        ),
        None => writeln!(row, ",,,,,,{}", corner.probability),
    };
    row
}

fn sight(rig: &Rig, corner: &Corner) -> Option<(Sighting<f64>, Matrix2<f64>)> {
    let sighting = rig.finder.sight(corner.pixel.cast()).ok()?;
    Some((sighting, sighting.noise(&covariance(rig, corner))))
}

/// The corner's own covariance and what the camera's calibration leaves, px².
fn covariance(rig: &Rig, corner: &Corner) -> Matrix2<f64> {
    corner.covariance.cast() + rig.pixel_covariance()
}

fn overlay(
    rig: &Rig,
    extraction: &Extraction,
    extractor: &OnHeap,
    picture: &Picture,
    image: &Path,
) -> Result<Vec<u8>> {
    let mut overlay = Overlay::new(rig, &picture.pixels, 960)?;
    let mut corners: Vec<_> = extraction.corners.iter().map(|corner| (corner, sight(rig, corner))).collect();
    let range = |sighting: &Option<(Sighting<f64>, _)>| sighting.as_ref().map_or(f64::MAX, |(s, _)| s.range);
    corners.sort_by(|a, b| range(&a.1).total_cmp(&range(&b.1))); // the nearest get the room for labels
    let marks: Vec<_> = corners
        .iter()
        .map(|(corner, sighting)| Mark {
            pixel: corner.pixel,
            covariance: covariance(rig, corner).cast(),
            colour: ORANGE,
            shape: if sighting.is_some() { Shape::Dot } else { Shape::Ring },
            labels: match sighting {
                Some((s, noise)) => {
                    vec![format!("{:.2} m ±{:.2}", s.range, noise.m11.sqrt()), format!("{:.2} m", s.range)]
                }
                None => vec!["above the horizon".to_owned()],
            },
        })
        .collect();
    overlay.floor();
    overlay.proposals(extraction, extractor.edge_points().map(|(place, _)| place));
    overlay.explain(&[SEEN]);
    overlay.marks(&marks);
    let name = image.file_name().unwrap_or_default().to_string_lossy();
    let count = marks.len();
    overlay.finish(&format!("{name}   {count} floor corner{}", if count == 1 { "" } else { "s" })).png()
}

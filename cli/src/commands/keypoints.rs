//! `keypoints`: a picture → the points that can be found again in another one.
use crate::outputs::to_file_or_stdout;
use clap::{Args, ValueEnum};
use monorange_core::features::{Descriptors, Detector, FeatureKind, Features, SiftConfig};
use monorange_formats::{Error, Result, pictures::Picture};
use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

/// The points of a picture that can be found again in another one.
///
/// Writes `u,v,scale,angle,response`: the pixel, (0, 0) being the centre of the first; the standard deviation of
/// the Gaussian that it was found at, in pixels; its direction from +u towards +v, in radians; and how distinct it
/// is (for SIFT the contrast of its blob in parts of the grey range, for BRIEF the largest threshold in grey levels
/// that the corner passes).
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 2 --out corridor-2
  monorange keypoints corridor-2/frames/000000.png --features brief")]
pub struct Arguments {
    /// A PNG, JPEG or PNM picture.
    image: PathBuf,
    /// SIFT finds blobs of any scale to a fraction of a pixel, BRIEF finds corners, twenty times as fast.
    #[arg(long, value_enum, default_value_t)]
    features: Kind,
    /// Add the descriptor, byte by byte, as columns `d0` to `d127` (SIFT) or `d31` (BRIEF).
    #[arg(long)]
    descriptors: bool,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Which keypoints.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(super) enum Kind {
    /// Blobs, after Lowe 2004, with RootSIFT descriptors.
    #[default]
    Sift,
    /// FAST-9 corners with oriented BRIEF.
    Brief,
}

impl Kind {
    fn detector(self) -> Result<Detector> {
        let kind = match self {
            Self::Sift => FeatureKind::Sift(SiftConfig::default()),
            Self::Brief => FeatureKind::Brief { threshold: 20 },
        };
        Detector::new(kind).map_err(Error::new)
    }

    /// The keypoints of a picture, those of less contrast too where there are fewer than `wanted`; says so where the capacity
    /// left some out.
    pub(super) fn detect(self, path: &Path, picture: &Picture, wanted: usize) -> Result<Features> {
        let refused = |error| Error::new(error).at(path).help("give a smaller picture");
        let features = self.detector()?.detect_at_least(picture.grey()?, wanted).map_err(refused)?;
        if features.left_out > 0 {
            let (kept, left_out) = (features.keypoints.len(), features.left_out);
            eprintln!("note: {}: {left_out} keypoints more than the {kept} kept", path.display());
        }
        Ok(features)
    }
}

/// Runs the command.
///
/// # Errors
/// When the picture cannot be read, or nothing can be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let features = arguments.features.detect(&arguments.image, &Picture::read(&arguments.image)?, 0)?;
    let mut table = "u,v,scale,angle,response".to_owned();
    let bytes = if arguments.descriptors { bytes(&features.descriptors) } else { Vec::new() };
    let width = match features.descriptors {
        Descriptors::Sift(_) => 128,
        Descriptors::Brief(_) => 32,
    };
    for column in 0..if arguments.descriptors { width } else { 0 } {
        let _ = write!(table, ",d{column}");
    }
    table.push('\n');
    let mut descriptors = bytes.chunks(width);
    for keypoint in &features.keypoints {
        let (pixel, scale, angle, response) =
            (keypoint.pixel, keypoint.scale, keypoint.angle, keypoint.response);
        let _ = write!(table, "{},{},{scale},{angle},{response}", pixel.x, pixel.y);
        for byte in descriptors.next().unwrap_or_default() {
            let _ = write!(table, ",{byte}");
        }
        table.push('\n');
    }
    to_file_or_stdout(arguments.out.as_deref(), |out| out.write_all(table.as_bytes()))
}

/// All descriptors, one after another.
fn bytes(descriptors: &Descriptors) -> Vec<u8> {
    match descriptors {
        Descriptors::Sift(list) => list.concat(),
        Descriptors::Brief(list) => list.iter().flatten().flat_map(|word| word.to_le_bytes()).collect(),
    }
}

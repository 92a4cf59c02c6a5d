//! `match`: two pictures → the homography from one to the other, with its covariance.
use super::keypoints::Kind;
use crate::outputs::to_file_or_stdout;
use clap::Args;
use monorange_core::{
    features::{ENOUGH_KEYPOINTS, Keypoint, MatchConfig},
    homography::{
        Homography, HomographyConfig, HomographyEstimate, Match, NoHomography, estimate_homography,
    },
};
use monorange_formats::{
    Error, Result,
    draw::{Canvas, ORANGE, SKY, Stroke},
    pictures::Picture,
};
use nalgebra::{Matrix2, Vector2};
use serde::Serialize;
use std::{fmt::Write as _, path::PathBuf};

/// The homography from one picture to another, with its covariance.
///
/// Writes JSON: `homography`, nine numbers row by row that carry a pixel of A to one of B, of unit Frobenius norm;
/// `covariance`, 81 numbers, of these nine; `matches` of keypoints, and `inliers` among them that agree; and `rms_px`,
/// the root mean square distance of the inliers from where the homography carries them. It is an error when no
/// homography fits: the message says why.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 2 --out corridor-2
  monorange match corridor-2/frames/000000.png corridor-2/frames/000001.png --pairs corridor-2/pairs.csv")]
pub struct Arguments {
    /// A PNG, JPEG or PNM picture.
    a: PathBuf,
    /// Another one of the same plane, or from the same place.
    b: PathBuf,
    /// SIFT finds blobs of any scale, BRIEF finds corners of one scale, much faster.
    #[arg(long, value_enum, default_value_t)]
    features: Kind,
    /// Write the matches to this file: `ua,va,ub,vb,inlier`.
    #[arg(long, value_name = "FILE")]
    pairs: Option<PathBuf>,
    /// Draw both pictures side by side to this file (PNG): the inliers, and A's outline on B.
    #[arg(long, value_name = "FILE")]
    overlay: Option<PathBuf>,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Serialize)]
struct Summary {
    homography: Vec<f64>,
    covariance: Vec<f64>,
    matches: usize,
    inliers: usize,
    rms_px: f64,
}

/// Runs the command.
///
/// # Errors
/// When a picture cannot be read, or no homography fits.
pub fn run(arguments: &Arguments) -> Result<()> {
    let (a, b) = (Picture::read(&arguments.a)?, Picture::read(&arguments.b)?);
    let first = arguments.features.detect(&arguments.a, &a, ENOUGH_KEYPOINTS)?;
    let second = arguments.features.detect(&arguments.b, &b, ENOUGH_KEYPOINTS)?;
    let ends = first.matches(&second, &MatchConfig::default()).map_err(Error::new)?;
    let ends: Vec<_> =
        ends.iter().map(|pair| [first.keypoints[pair.first], second.keypoints[pair.second]]).collect();
    let counts = [first.keypoints.len(), second.keypoints.len(), ends.len()];
    let found =
        Found::from(&ends, counts[0].min(counts[1])).map_err(|reason| refused(reason, counts, arguments))?;
    let json = serde_json::to_string_pretty(&found.summary()).map_err(Error::new)?;
    if let Some(path) = &arguments.pairs {
        to_file_or_stdout(Some(path), |out| out.write_all(found.table().as_bytes()))?;
    }
    if let Some(path) = &arguments.overlay {
        let png = draw(&a, &b, &found)?;
        to_file_or_stdout(Some(path), |out| out.write_all(&png))?;
    }
    to_file_or_stdout(arguments.out.as_deref(), |out| writeln!(out, "{json}"))
}

fn refused(reason: NoHomography, [in_a, in_b, matches]: [usize; 3], arguments: &Arguments) -> Error {
    let cause =
        format!("{reason} ({in_a} keypoints here, {in_b} in {}, {matches} matches)", arguments.b.display());
    Error::new(cause)
        .at(&arguments.a)
        .help("give two pictures that show the same textured plane, or that were taken from one place")
}

struct Found {
    matches: Vec<Match<f64>>,
    estimate: HomographyEstimate<f64>,
    inliers: Vec<bool>,
}

impl Found {
    /// Of the keypoints of each match, and the number of all in the picture that has fewer.
    fn from(ends: &[[Keypoint; 2]], keypoints: usize) -> std::result::Result<Self, NoHomography> {
        let matches: Vec<_> = ends.iter().map(|[from, to]| Match::of_uneven_keypoints(from, to)).collect();
        let mut posteriors = vec![0.0; matches.len()];
        // A keypoint's variance is that on pictures of a plane: what the pair itself shows counts more.
        let config = HomographyConfig { scale_noise: true, ..HomographyConfig::default() };
        let estimate = estimate_homography(&config, &matches, &mut posteriors)?;
        if !estimate.is_confirmed_by(&matches, ends, keypoints) {
            return Err(NoHomography::NoConsensus);
        }
        let inliers = posteriors.iter().map(|posterior| *posterior > 0.5).collect();
        Ok(Self { matches, estimate, inliers })
    }

    fn homography(&self) -> &Homography<f64> {
        &self.estimate.homography
    }

    fn carry(&self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        self.homography().predict(pixel, &Matrix2::zeros()).map(|predicted| predicted.point)
    }

    fn agreeing(&self) -> impl Iterator<Item = &Match<f64>> {
        self.matches.iter().zip(&self.inliers).filter(|(_, inlier)| **inlier).map(|(pair, _)| pair)
    }

    fn summary(&self) -> Summary {
        let squares =
            self.agreeing().filter_map(|pair| Some((self.carry(pair.from)? - pair.to).norm_squared()));
        let (count, sum) = squares.fold((0, 0.0), |(count, sum), square| (count + 1, sum + square));
        Summary {
            homography: self.homography().matrix().transpose().as_slice().to_vec(),
            covariance: self.homography().covariance().as_slice().to_vec(), // symmetric
            matches: self.matches.len(),
            inliers: self.agreeing().count(),
            rms_px: (sum / f64::from(count.max(1))).sqrt(),
        }
    }

    fn table(&self) -> String {
        let mut table = "ua,va,ub,vb,inlier\n".to_owned();
        for (Match { from, to, .. }, inlier) in self.matches.iter().zip(&self.inliers) {
            let _ = writeln!(table, "{},{},{},{},{}", from.x, from.y, to.x, to.y, u8::from(*inlier));
        }
        table
    }
}

/// Both pictures side by side, the inliers joined, and A's outline on B.
fn draw(a: &Picture, b: &Picture, found: &Found) -> Result<Vec<u8>> {
    let (width, height) = (a.width + b.width, a.height.max(b.height));
    let mut grey = vec![0; width * height];
    for (row, out) in grey.chunks_exact_mut(width).enumerate() {
        for (picture, left) in [(a, 0), (b, a.width)] {
            if let Some(pixels) = picture.pixels.chunks_exact(picture.width).nth(row) {
                out[left..left + picture.width].copy_from_slice(pixels);
            }
        }
    }
    let mut canvas = Canvas::over(&grey, [width, height], 960)?;
    let beside = Vector2::new(a.width as f32, 0.0);
    for pair in found.agreeing() {
        let [from, to] = [pair.from.cast(), pair.to.cast::<f32>() + beside];
        canvas.polyline(&[from, to], Stroke { opacity: 0.35, ..Stroke::solid(SKY, 1.0) });
        for end in [from, to] {
            canvas.dot(canvas.place(end), 2.0, SKY, 1.0);
        }
    }
    let (right, bottom) = (a.width as f64 - 0.5, a.height as f64 - 0.5);
    let corners = [[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom], [-0.5, -0.5]];
    // A corner beyond the plane's horizon has no place on B.
    let outline: Vec<_> = corners.iter().filter_map(|corner| found.carry(Vector2::from(*corner))).collect();
    let outline: Vec<_> = outline.iter().map(|pixel| pixel.cast::<f32>() + beside).collect();
    canvas.polyline(&outline, Stroke::solid(ORANGE, 2.5));
    canvas.png()
}

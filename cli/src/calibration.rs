//! The mount from points, from a drive, or from vertical edges, with its figures for a person and for a program.
use crate::{sequence::Sequence, warnings};
use monorange_core::{
    calibration::{
        DriveStep, Explanation, Fitted, KnownPoint, MountFit, PointNoise, TrackedPoint, VerticalEdge,
        deviations, explain_points, fit_drive, fit_points, fit_verticals, point_residual,
    },
    geometry::{Mount, RangeFinder},
    lines::Corner,
    pipeline::{Carrier, Config, Memory, MotionFrom, MountError, Odometry, OnHeap, Pipeline},
    slam::Decision,
};
use monorange_formats::{
    Error, Result,
    extraction::extractor,
    files::{MOUNT_KEYS, Rig, read_text, with_mount},
    pictures::{self, Picture},
};
use nalgebra::{Matrix2, Matrix3, Vector2};
use serde::Serialize;
use std::{collections::BTreeMap, fmt, path::Path};

/// What the mount was fitted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Evidence {
    /// Floor points of known place.
    Points,
    /// A drive with odometry.
    Drive,
    /// Edges that are vertical in the world.
    Verticals,
}

/// A mount that was fitted, and how well.
#[derive(Clone, Debug, Serialize)]
pub struct Calibration {
    /// What it was fitted to.
    pub evidence: Evidence,
    /// How many points, edges or frames.
    pub count: usize,
    /// Height (m), tilt, roll, yaw (degrees): by hand, fitted, standard deviation.
    pub parameters: Vec<ParameterFit>,
    /// Of points: their residuals.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub residuals: Vec<Residual>,
    /// Largest and mean |range residual| of the points used, % of the range; rms of their bearing residuals, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub summary: Option<Summary>,
    /// What to be careful about.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// The mount.
    #[serde(skip)]
    pub fit: MountFit,
}

/// One parameter of the mount.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterFit {
    /// Its key in a rig file.
    pub name: &'static str,
    /// As the rig file had it.
    pub by_hand: f64,
    /// As fitted.
    pub fitted: f64,
    /// Standard deviation; 0 where it was not fitted.
    pub std: f64,
}

/// A point as measured less as seen.
#[derive(Clone, Debug, Serialize)]
pub struct Residual {
    /// Range, m.
    pub range: f64,
    /// Range, % of the measured one.
    pub range_percent: f64,
    /// Bearing, rad.
    pub bearing: f64,
    /// The same from the fit to all other points, where that is determined: %, rad.
    pub left_out: Option<[f64; 2]>,
    /// Whether the fit used it.
    pub used: bool,
}

/// Figures over the points that were used.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Summary {
    /// Largest |range residual|, %.
    pub range_max_percent: f64,
    /// Mean |range residual|, %.
    pub range_mean_percent: f64,
    /// Root mean square bearing residual, rad.
    pub bearing_rms: f64,
}

impl Summary {
    /// The figures of residuals (% of range, rad).
    pub fn of(residuals: impl Iterator<Item = [f64; 2]> + Clone) -> Self {
        let count = residuals.clone().count().max(1) as f64;
        Self {
            range_max_percent: residuals.clone().map(|[range, _]| range.abs()).fold(0.0, f64::max),
            range_mean_percent: residuals.clone().map(|[range, _]| range.abs()).sum::<f64>() / count,
            bearing_rms: (residuals.map(|[_, bearing]| bearing * bearing).sum::<f64>() / count).sqrt(),
        }
    }
}

/// The mount that sees the points where they were measured, and in the warnings what else explains them (see
/// [`Explanation`]); `lever_arm` as [`explain_points`] has it.
///
/// # Errors
/// When the points do not determine what is to be fitted, or contradict each other and one is not on the floor at all.
pub fn from_points(
    rig: &Rig,
    points: &[KnownPoint],
    noise: &PointNoise,
    fitted: Fitted,
    lever_arm: bool,
) -> Result<Calibration> {
    let (camera, by_hand) = (rig.finder.camera(), rig.finder.mount());
    let (fit, explanation) =
        explain_points(camera, by_hand, points, noise, fitted, lever_arm).map_err(|error| {
            let error = Error::new(error);
            match first_above_horizon(rig, points) {
                Some(words) => error.help(words),
                None => error,
            }
        })?;
    let bad = match explanation {
        Explanation::OnePoint(index) => Some(index),
        _ => None,
    };
    if explanation == Explanation::SeveralErrors
        && let Some(words) = first_above_horizon(rig, points)
    {
        return Err(Error::new(words).help("correct the pixel, or the mount in the rig file"));
    }
    let fitted = if explanation == Explanation::LeverArm { fitted.and_lever_arm() } else { fitted };
    let percent = |finder: &RangeFinder<f64>, point: &KnownPoint| {
        let residual = point_residual(finder, point)?;
        Some([100.0 * residual.x / point.range_bearing.x, residual.y])
    };
    let finder = RangeFinder::new(*camera, fit.mount);
    let residuals: Vec<_> = (0..)
        .zip(points)
        .map(|(index, point)| {
            let others = (0..).zip(points).filter(|(other, _)| *other != index && Some(*other) != bad);
            let without = fit_points(camera, by_hand, others.map(|(_, point)| point), noise, fitted).ok();
            let [range_percent, bearing] = percent(&finder, point).unwrap_or([f64::NAN; 2]);
            Residual {
                range: range_percent / 100.0 * point.range_bearing.x,
                range_percent,
                bearing,
                left_out: without.and_then(|fit| percent(&RangeFinder::new(*camera, fit.mount), point)),
                used: Some(index) != bad,
            }
        })
        .collect();
    let used = residuals.iter().filter(|residual| residual.used);
    let summary = Summary::of(used.map(|residual| [residual.range_percent, residual.bearing]));
    let mut calibration = Calibration::new(Evidence::Points, points.len(), rig, fit);
    let far_off = |(index, point): (usize, &KnownPoint)| {
        let [range, bearing] = deviations(&finder, point, noise)?;
        let what = if range.abs() > bearing.abs() { "range" } else { "bearing" };
        let times = range.abs().max(bearing.abs());
        (times > 3.0).then(|| format!("point {} ({what}, {times:.0} times its deviation)", index + 1))
    };
    let [.., forward, left] = fit.mount.parameters();
    match explanation {
        Explanation::Noise => {}
        Explanation::OnePoint(index) => calibration.warnings.push(format!(
            "point {} contradicts all others and was left out: measure it again",
            index + 1
        )),
        Explanation::LeverArm => calibration.warnings.push(format!(
            "the points were not measured from below the lens: with forward = {forward:.3} m and left = {left:.3} m \
             all of them fit, so these were fitted too; measure them, or give --fit to leave them out"
        )),
        Explanation::SeveralErrors => {
            let named: Vec<_> = points.iter().enumerate().filter_map(far_off).collect();
            calibration.warnings.push(format!(
                "the residuals exceed what the deviations allow, and the worst count least: {}; measure these again, \
                 or check the camera's calibration",
                named.join(", ")
            ));
        }
    }
    calibration.warnings.extend(far_from_by_hand(by_hand, &fit.mount));
    Ok(Calibration { residuals, summary: Some(summary), ..calibration })
}

/// What a person measured and the points contradict: a tilt that is 4° off, a height that is a quarter off.
fn far_from_by_hand(by_hand: &Mount<f64>, fitted: &Mount<f64>) -> Vec<String> {
    let [hand, fit] = [by_hand, fitted].map(|mount| (mount.height(), mount.tilt().to_degrees()));
    let mut words = Vec::new();
    if (fit.1 - hand.1).abs() > 4.0 {
        words.push(format!("the tilt by hand, {:.1}°, is {:.1}° off", hand.1, (fit.1 - hand.1).abs()));
    }
    if !(0.8..1.25).contains(&(fit.0 / hand.0)) {
        words.push(format!("the height by hand, {:.2} m, is {:.2} m off", hand.0, (fit.0 - hand.0).abs()));
    }
    let [by_hand, fitted] = [by_hand, fitted].map(|mount| {
        let [_, _, roll, yaw, ..] = mount.parameters();
        [roll, yaw].map(f64::to_degrees)
    });
    for ((name, hand), fit) in ["roll", "yaw"].into_iter().zip(by_hand).zip(fitted) {
        if (fit - hand).abs() > 10.0 {
            words.push(format!("the {name} by hand, {hand:.1}°, is {:.1}° off", (fit - hand).abs()));
        }
    }
    let remedy = "if the fitted value cannot be right, check the units and the order of the points' columns";
    words.into_iter().map(|words| format!("{words}; {remedy}")).collect()
}

/// Names the first point that the mount by hand sees above the horizon or outside the picture.
fn first_above_horizon(rig: &Rig, points: &[KnownPoint]) -> Option<String> {
    let index = points.iter().position(|point| rig.finder.sight(point.pixel).is_err())?;
    let pixel = points.get(index)?.pixel;
    Some(format!("point {} at pixel ({}, {}) does not see the floor", index + 1, pixel.x, pixel.y))
}

/// Tilt and roll with which the pictures' vertical edges are vertical in the world.
///
/// # Errors
/// When no picture could be read or there are too few edges.
pub fn from_verticals(rig: &Rig, frames: &Path, fitted: Fitted) -> Result<Calibration> {
    let camera = rig.finder.camera();
    let mut extractor = extractor(rig)?;
    let mut edges = Vec::new();
    for image in pictures::in_folder(frames)? {
        pictures::check_size(&image, camera.width(), camera.height())?;
        let picture = match Picture::read(&image) {
            Ok(picture) => picture,
            Err(error) => {
                warnings::left_out(&error);
                continue;
            }
        };
        let extraction = extractor.extract(picture.grey()?).map_err(|error| Error::new(error).at(&image))?;
        edges.extend(extraction.vertical_lines.iter().map(|line| VerticalEdge::from_line(camera, line)));
    }
    let (fit, used) = fit_verticals(rig.finder.mount(), &edges, fitted).map_err(|error| {
        Error::new(error).at(frames).help("give pictures with door posts or corners of walls")
    })?;
    let mut calibration = Calibration::new(Evidence::Verticals, used, rig, fit);
    if used * 2 < edges.len() {
        let left_out = edges.len() - used;
        calibration.warnings.push(format!("{left_out} of {} edges lean and were left out", edges.len()));
    }
    Ok(calibration)
}

/// Before a drive, the mount is taken to be this well known where it is fitted: 5 % of height, 3°, 3°, 3°.
const DRIVE_PRIOR: [f32; 4] = [0.05, 0.0524, 0.0524, 0.0524];

/// The settings with which a drive tells the mount: it is a state of the filter, with a wide prior.
pub fn drive_config(settings: Config, fitted: Fitted) -> Config {
    let height = settings.finder.mount().height();
    let scale = [height, 1.0, 1.0, 1.0];
    let mut mount_std = [0.0; 4];
    for (((std, prior), scale), fitted) in mount_std.iter_mut().zip(DRIVE_PRIOR).zip(scale).zip(fitted.0) {
        *std = if fitted { prior * scale } else { 0.0 };
    }
    // The corners are found before and handed over: no picture is there to carry them.
    let (carrier, motion_from) = (Carrier::Map, MotionFrom::Odometry);
    Config { mount_std, mount_error: MountError::Estimated, carrier, motion_from, ..settings }
}

/// What a picture of a drive shows, and the motion since the one before.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Seconds.
    pub time: f64,
    /// The wheels since the picture before, each with the time at its end.
    pub motions: Vec<(f64, Odometry)>,
    /// Floor corners.
    pub corners: Vec<Corner>,
}

/// Pictures from the first of a step to its last.
const STEP_FRAMES: usize = 4;

/// The mount with which the floor's corners move as the wheels say.
///
/// # Errors
/// When no picture could be read, or the drive does not tell the mount.
pub fn from_drive(rig: &Rig, sequence: &Sequence, fitted: Fitted) -> Result<Calibration> {
    let start = sequence.times.first().copied().unwrap_or_default();
    let mut extractor = extractor(rig)?;
    let mut reached = start;
    let mut drive = Vec::new();
    for (image, time) in sequence.images.iter().zip(&sequence.times) {
        let picture = match image.read() {
            Ok(picture) => picture,
            Err(error) => {
                warnings::left_out(&error);
                continue;
            }
        };
        let extraction =
            extractor.extract(picture.grey()?).map_err(|error| Error::new(error).at(image.name()))?;
        let mut motions = Vec::new();
        let controls = sequence.odometry.as_ref().map(|odometry| odometry.between(reached, *time));
        for control in controls.unwrap_or_default() {
            reached += control.duration;
            motions.push((reached - start, control.reading()));
        }
        reached = *time;
        drive.push(Seen { time: time - start, motions, corners: extraction.corners.to_vec() });
    }
    let (fit, measurements) = fit_seen(rig, &drive, fitted).map_err(|error| {
        error.help("give pictures of a longer drive, with floor corners in them and some turns")
    })?;
    let mut calibration = Calibration::new(Evidence::Drive, drive.len(), rig, fit);
    if measurements < 100 {
        calibration
            .warnings
            .push(format!("only {measurements} corners were seen twice: drive longer, past more corners"));
    }
    Ok(calibration)
}

/// The mount from what a drive shows, and how many corners were followed. The filter says who is who; the corners of
/// every fifth picture are then followed over four, so that no two steps share a picture or an error of the wheels.
///
/// # Errors
/// When the pipeline refuses its settings, or the drive does not determine what is to be fitted.
pub fn fit_seen(rig: &Rig, drive: &[Seen], fitted: Fitted) -> Result<(MountFit, usize)> {
    let config = drive_config(rig.settings, fitted);
    let camera = rig.finder.camera();
    let memory = Memory::on_heap(camera.width(), camera.height(), 512);
    let mut pipeline = Pipeline::<OnHeap>::new(config, memory).map_err(Error::new)?;
    let mut named = Vec::with_capacity(drive.len());
    for seen in drive {
        for (time, motion) in &seen.motions {
            pipeline.odometry(*time, motion).map_err(Error::new)?;
        }
        let report = pipeline.observe(seen.time, &seen.corners).map_err(Error::new)?;
        let taken = [Decision::Update, Decision::Tentative, Decision::Birth];
        let mine = report.corners.iter().filter(|corner| taken.contains(&corner.outcome.decision));
        let corners = mine.filter_map(|corner| {
            Some((
                corner.outcome.landmark?,
                (corner.pixel.cast::<f64>(), corner.pixel_covariance.cast::<f64>()),
            ))
        });
        named.push(corners.collect::<BTreeMap<_, _>>());
    }
    let tracks: Vec<Vec<_>> = named
        .chunks_exact(STEP_FRAMES + 1)
        .map(|frames| {
            let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return Vec::new() };
            let track = |(id, (before, covariance_before)): (&u32, &(Vector2<f64>, Matrix2<f64>))| {
                let (after, covariance_after) = *last.get(id)?;
                let (before, covariance_before) = (*before, *covariance_before);
                Some(TrackedPoint { before, after, covariance_before, covariance_after })
            };
            first.iter().filter_map(track).collect()
        })
        .collect();
    let steps: Vec<_> = drive
        .chunks_exact(STEP_FRAMES + 1)
        .zip(&tracks)
        .filter_map(|(frames, points)| {
            let readings = frames.iter().skip(1).flat_map(|seen| &seen.motions);
            let steps = readings.map(|(_, reading)| config.motion.increment(reading));
            let whole = steps.reduce(|before, step| before.then(&step))?;
            // What a perfect wheel would still be off by.
            let covariance = whole.covariance.cast() + Matrix3::identity() * 1e-8;
            Some(DriveStep { motion: whole.delta.cast(), covariance, points })
        })
        .collect();
    fit_drive(camera, rig.finder.mount(), &steps, fitted).map_err(Error::new)
}

impl Calibration {
    fn new(evidence: Evidence, count: usize, rig: &Rig, fit: MountFit) -> Self {
        let values = rig.finder.mount().parameters().into_iter().zip(fit.mount.parameters()).zip(fit.std());
        let parameters = MOUNT_KEYS.iter().zip(values).map(|((name, _, unit), ((by_hand, fitted), std))| {
            ParameterFit { name, by_hand: by_hand / unit, fitted: fitted / unit, std: std / unit }
        });
        let warnings = fit.indistinct().map(|([one, other], correlation)| {
            format!(
                "{one} and {other} cannot be told apart here (correlation {correlation:.3}): \
                 add points at other distances, or fit only one of them"
            )
        });
        Self {
            evidence,
            count,
            parameters: parameters.collect(),
            residuals: Vec::new(),
            summary: None,
            warnings: warnings.into_iter().collect(),
            fit,
        }
    }

    /// The rig file's text with the fitted mount and its standard deviations; all else stays as it is.
    ///
    /// # Errors
    /// When the rig file cannot be read again.
    pub fn rig_text(&self, rig: &Path, out: &Path) -> Result<String> {
        with_mount(rig, &read_text(rig)?, out, &self.fit.mount, self.fit.std())
    }
}

impl fmt::Display for Calibration {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.evidence {
            Evidence::Points => "floor points",
            Evidence::Drive => "frames of a drive",
            Evidence::Verticals => "vertical edges",
        };
        writeln!(out, "mount from {} {what}", self.count)?;
        for ParameterFit { name, by_hand, fitted, std } in &self.parameters {
            match *std {
                0.0 => writeln!(out, "  {name:<9} {by_hand:>9.4}  as it was")?,
                std => writeln!(out, "  {name:<9} {fitted:>9.4} ± {std:.4}  (by hand {by_hand:.4})")?,
            }
        }
        if let Some(Summary { range_max_percent, range_mean_percent, bearing_rms }) = self.summary {
            writeln!(
                out,
                "  residuals  range {range_max_percent:.2} % at most, {range_mean_percent:.2} % in the mean; bearing {bearing_rms:.4} rad rms"
            )?;
            writeln!(out, "  point      range %   bearing rad    from the fit to the others")?;
        }
        for (index, residual) in self.residuals.iter().enumerate() {
            let Residual { range_percent, bearing, left_out, used, .. } = residual;
            let others = left_out.map_or("not determined".to_owned(), |[range, bearing]| {
                format!("{range:+8.2}   {bearing:+.4}")
            });
            let mark = if *used { "" } else { "   left out" };
            writeln!(out, "  {:<9} {range_percent:+8.2}   {bearing:+.4}       {others}{mark}", index + 1)?;
        }
        for warning in &self.warnings {
            writeln!(out, "  warning: {warning}")?;
        }
        Ok(())
    }
}

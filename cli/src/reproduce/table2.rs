//! Table 2: five floor points, measured by hand and through the camera; and what the mount has to do with it.
//!
//! The paper gives ranges and bearings, not pixels. They are recovered from its calculated columns with an assumed
//! mount; the fit to the measured columns hardly depends on which (see the last table's rows).
use super::{Figures, Section};
use crate::calibration::{self, Calibration, Summary};
use monorange_core::calibration::{Fitted, KnownPoint, PointNoise};
use monorange_core::geometry::{Mount, RangeFinder};
use monorange_core::image::Grey;
use monorange_formats::files::Rig;
use monorange_formats::{Error, Result};
use monorange_sim::{
    MOUNT_STD, PIXEL_STD, Scene, SceneConfig, SimConfig, Simulation, TABLE2_POINTS, default_rig, hand_mounted,
};
use nalgebra::Vector2;

/// What the paper calculated: range (m) and bearing (rad) of its five points.
const CALCULATED: [[f64; 2]; 5] =
    [[1.28, 0.314], [1.82, 0.236], [2.03, 0.240], [1.17, -0.02], [1.54, -0.330]];

/// What was fitted, under its name.
const FITS: [(&str, Fitted); 3] = [
    ("yaw", Fitted([false, false, false, true, false, false])),
    ("yaw, tilt, roll", Fitted::ANGLES),
    ("yaw, tilt, roll, height", Fitted::HEIGHT_AND_ANGLES),
];

/// A tape's noise, and the paper's own of a pixel.
fn tape() -> PointNoise {
    PointNoise { pixel_std_px: PIXEL_STD[0], ..PointNoise::default() }
}

/// Seeds of the simulated replica.
const REPLICAS: u64 = 20;

/// The section.
///
/// # Errors
/// When a fit fails, which would be a mistake here.
pub fn section() -> Result<Section> {
    let rig = assumed(0.40, 12.0)?;
    let points = recovered(&rig)?;
    let published = Summary::of(points.iter().zip(CALCULATED).map(|(point, [range, bearing])| {
        let measured = point.range_bearing;
        [100.0 * (measured.x - range) / measured.x, measured.y - bearing]
    }));
    let fits = FITS
        .iter()
        .map(|(name, fitted)| Ok((*name, calibration::from_points(&rig, &points, &tape(), *fitted, false)?)))
        .collect::<Result<Vec<_>>>()?;
    let words = vec![
        "The published bearings are all low by the same 0.022 rad and the ranges err with a slope from left to right: a mount that is \
         off, not noise. Fitting three angles of the mount to the table’s own ten numbers halves the range error and takes four fifths \
         of the bearing error away. Residuals from the fit to the other four points (<i>left out</i>) say how much of that is \
         fitting noise."
            .to_owned(),
        "The replica drives the whole chain: five crates in a simulated lab, Table 1’s camera with its lens, a mount that is off by \
         1.2° yaw, −0.3° tilt, 0.8° roll and 1 % height, corners found in the pictures."
            .to_owned(),
    ];
    let tables = vec![
        errors(&published, &fits),
        points_table(&points, &fits),
        mounts(&fits),
        assumptions()?,
        replica()?,
    ];
    Ok(Section {
        name: "table2",
        title: "Table 2: five points measured by hand",
        words,
        tables,
        drawings: vec![],
    })
}

fn assumed(height: f64, tilt_deg: f64) -> Result<Rig> {
    let camera = *default_rig().map_err(Error::new)?.camera();
    let mount = Mount::new([height, tilt_deg.to_radians(), 0.0, 0.0, 0.0, 0.0]).map_err(Error::new)?;
    Rig::new(RangeFinder::new(camera, mount), PIXEL_STD, MOUNT_STD)
}

/// The pixels in which the assumed mount sees what the paper calculated, with what it measured.
fn recovered(rig: &Rig) -> Result<Vec<KnownPoint>> {
    let known = |([range, bearing], measured): ([f64; 2], [f64; 2])| {
        let point = Vector2::new(range * bearing.cos(), range * bearing.sin());
        let pixel = rig.finder.pixel_from_floor(point);
        let pixel = pixel.map_err(|_| Error::new("a point of Table 2 is outside the picture"))?;
        Ok(KnownPoint { pixel, range_bearing: measured.into() })
    };
    CALCULATED.into_iter().zip(TABLE2_POINTS).map(known).collect()
}

fn cells(summary: &Summary) -> [String; 3] {
    let Summary { range_max_percent, range_mean_percent, bearing_rms } = summary;
    [format!("{range_max_percent:.2}"), format!("{range_mean_percent:.2}"), format!("{bearing_rms:.4}")]
}

/// Residuals of every point from the fit to the others.
fn left_out(calibration: &Calibration) -> Option<Summary> {
    let residuals: Option<Vec<_>> = calibration.residuals.iter().map(|residual| residual.left_out).collect();
    Some(Summary::of(residuals?.into_iter()))
}

fn errors(published: &Summary, fits: &[(&str, Calibration)]) -> Figures {
    let header = [
        "fitted",
        "range max %",
        "mean %",
        "bearing rms rad",
        "left out: range max %",
        "mean %",
        "bearing rms rad",
    ];
    let mut table = Figures::new("Errors against the hand measurements", &header);
    let none = || [String::from("–"), String::from("–"), String::from("–")];
    table.row(["nothing (as published)".to_owned()].into_iter().chain(cells(published)).chain(none()));
    for (name, fit) in fits {
        let inside = fit.summary.as_ref().map_or_else(none, cells);
        let outside = left_out(fit).as_ref().map_or_else(none, cells);
        table.row([(*name).to_owned()].into_iter().chain(inside).chain(outside));
    }
    table
}

fn points_table(points: &[KnownPoint], fits: &[(&str, Calibration)]) -> Figures {
    let mut header = vec!["point", "measured m", "rad", "published %", "rad"];
    header.extend(fits.iter().flat_map(|(name, _)| [*name, "rad"]));
    let mut table =
        Figures::new("Deviation, point by point: range in % of the measured one, bearing in rad", &header);
    for (index, (point, [range, bearing])) in points.iter().zip(CALCULATED).enumerate() {
        let measured = point.range_bearing;
        let mut row = vec![
            (index + 1).to_string(),
            format!("{:.2}", measured.x),
            format!("{:.3}", measured.y),
            format!("{:+.1}", 100.0 * (measured.x - range) / measured.x),
            format!("{:+.4}", measured.y - bearing),
        ];
        for residual in fits.iter().filter_map(|(_, fit)| fit.residuals.get(index)) {
            row.extend([format!("{:+.2}", residual.range_percent), format!("{:+.4}", residual.bearing)]);
        }
        table.row(row);
    }
    table
}

fn mounts(fits: &[(&str, Calibration)]) -> Figures {
    let mut table = Figures::new(
        "The mount that was fitted, as a change from the assumed one (0.40 m, 12°), ±σ",
        &["fitted", "height m", "tilt °", "roll °", "yaw °"],
    );
    for (name, fit) in fits {
        let change = fit.parameters.iter().take(4).map(|parameter| match parameter.std {
            0.0 => "–".to_owned(),
            std => format!("{:+.3} ± {std:.3}", parameter.fitted - parameter.by_hand),
        });
        table.row([(*name).to_owned()].into_iter().chain(change));
    }
    table
}

/// The same fit from pixels recovered with other mounts.
fn assumptions() -> Result<Figures> {
    let mut table = Figures::new(
        "The fit of yaw, tilt and roll when the pixels are recovered with another mount",
        &["height m, tilt °", "range max %", "mean %", "bearing rms rad", "yaw °"],
    );
    for (height, tilt) in [(0.30, 9.0), (0.40, 12.0), (0.50, 15.0), (0.60, 18.0)] {
        let rig = assumed(height, tilt)?;
        let fit = calibration::from_points(&rig, &recovered(&rig)?, &tape(), Fitted::ANGLES, false)?;
        let summary =
            fit.summary.as_ref().map_or_else(|| [String::new(), String::new(), String::new()], cells);
        let yaw = fit.fit.mount.parameters()[3].to_degrees();
        table.row(
            [format!("{height:.2}, {tilt:.0}")].into_iter().chain(summary).chain([format!("{yaw:+.2}")]),
        );
    }
    Ok(table)
}

/// The points of one simulated lab, as the extractor finds them in the pictures, known to a millimetre.
///
/// # Errors
/// When the simulator or the extractor refuses its settings, which would be a mistake here.
pub fn replica_points(seed: u64) -> Result<Vec<KnownPoint>> {
    let nominal = default_rig().map_err(Error::new)?;
    let truth = hand_mounted(&nominal).map_err(Error::new)?;
    let scene = Scene::table2(&SceneConfig { seed, ..SceneConfig::default() });
    let config = SimConfig { seed, frames: TABLE2_POINTS.len(), walkers: 0, ..SimConfig::default() };
    let lab = Simulation::new(scene, truth, config).map_err(Error::new)?;
    let mut extractor = monorange_formats::extraction::extractor(&Rig::new(nominal, PIXEL_STD, MOUNT_STD)?)?;
    let (width, height) = (truth.camera().width(), truth.camera().height());
    let mut pixels = vec![0; width * height];
    let mut points = Vec::new();
    for (frame, place) in TABLE2_POINTS.into_iter().enumerate() {
        lab.render(frame, &mut pixels).map_err(Error::new)?;
        let picture = Grey::new(&pixels, width, height).map_err(Error::new)?;
        let extraction = extractor.extract(picture).map_err(Error::new)?;
        // A person points at the marked foot; the corner is what was found next to it.
        let marked = lab.corners(frame).into_iter().find(|corner| corner.id as usize == frame);
        let found = extraction.corners.iter().map(|corner| corner.pixel.cast::<f64>());
        let near = marked.and_then(|marked| {
            let distance = |pixel: &Vector2<f64>| (pixel - marked.pixel).norm();
            found.filter(|pixel| distance(pixel) < 3.0).min_by(|a, b| distance(a).total_cmp(&distance(b)))
        });
        points.extend(near.map(|pixel| KnownPoint { pixel, range_bearing: place.into() }));
    }
    Ok(points)
}

/// What the replica's points are known to: 0.3 px of a corner, 2 mm in a metre, 2 mrad.
pub const REPLICA_NOISE: PointNoise =
    PointNoise { pixel_std_px: 0.3, range_std_share: 0.002, bearing_std: 0.002 };

fn replica() -> Result<Figures> {
    let rig = Rig::new(default_rig().map_err(Error::new)?, PIXEL_STD, MOUNT_STD)?;
    let truth = hand_mounted(&rig.finder).map_err(Error::new)?;
    let rows = [("nothing (mounted by hand)", Fitted([false; 6])), FITS[1], FITS[2]];
    let mut residuals = vec![Vec::new(); rows.len()];
    let mut errors = vec![Vec::new(); rows.len()];
    let mut found = 0;
    for seed in 1..=REPLICAS {
        let points = replica_points(seed)?;
        found += points.len();
        for ((_, fitted), (residuals, errors)) in rows.iter().zip(residuals.iter_mut().zip(&mut errors)) {
            let mount = match fitted.count() {
                0 => *rig.finder.mount(),
                count if 2 * points.len() <= count => continue,
                _ => calibration::from_points(&rig, &points, &REPLICA_NOISE, *fitted, false)?.fit.mount,
            };
            let finder = RangeFinder::new(*rig.finder.camera(), mount);
            residuals.extend(points.iter().filter_map(|point| {
                let residual = monorange_core::calibration::point_residual(&finder, point)?;
                Some([100.0 * residual.x / point.range_bearing.x, residual.y])
            }));
            let off = mount
                .parameters()
                .into_iter()
                .zip(truth.mount().parameters())
                .map(|(is, should)| is - should);
            errors.push(off.take(4).collect::<Vec<_>>());
        }
    }
    let caption = format!(
        "Simulated replica, {REPLICAS} labs, {found} of {} marked corners found in the pictures; rms error of the fitted mount",
        5 * REPLICAS
    );
    let header =
        ["fitted", "range max %", "mean %", "bearing rms rad", "height mm", "tilt °", "roll °", "yaw °"];
    let mut table = Figures::new(caption, &header);
    for ((name, _), (residuals, errors)) in rows.iter().zip(residuals.into_iter().zip(errors)) {
        let rms = |index: usize| {
            let squares: f64 = errors.iter().map(|error| error[index] * error[index]).sum();
            (squares / errors.len().max(1) as f64).sqrt()
        };
        let angles = [1, 2, 3].map(|index| format!("{:.3}", rms(index).to_degrees()));
        let summary = cells(&Summary::of(residuals.into_iter()));
        table.row(
            [(*name).to_owned()]
                .into_iter()
                .chain(summary)
                .chain([format!("{:.1}", 1e3 * rms(0))])
                .chain(angles),
        );
    }
    Ok(table)
}

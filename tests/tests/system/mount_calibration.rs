//! A mount that is off by 1.2° of yaw, −0.3° of tilt, 0.8° of roll and 1 % of height is recovered, and its covariance
//! is right: from points, from a drive, and from vertical edges.
use monorange::calibration::{Seen, fit_seen};
use monorange::reproduce::corridor::defaults;
use monorange_core::calibration::{
    Fitted, KnownPoint, MountFit, PointNoise, VerticalEdge, fit_points, fit_verticals,
};
use monorange_core::geometry::{RangeFinder, range_bearing_from_floor};
use monorange_core::image::Grey;
use monorange_core::lines::Corner;
use monorange_core::pipeline::{Config, Odometry};
use monorange_formats::files::Rig;
use monorange_sim::{
    MOUNT_STD, PIXEL_STD, Random, Scene, SceneConfig, SimConfig, Simulation, Stream, default_rig,
    hand_mounted,
};
use nalgebra::{Matrix2, Vector2, Vector6};

const SEEDS: u64 = 100;

/// Normalised errors of many fits.
#[derive(Default)]
struct Tally {
    nees: f64,
    beyond_3_sigma: usize,
    worst: f64,
    fits: usize,
    squares: [f64; 6],
}

impl Tally {
    fn add(&mut self, fit: &MountFit, truth: &RangeFinder<f64>, fitted: Fitted) {
        let (is, should) = (fit.mount.parameters(), truth.mount().parameters());
        let error = Vector6::from_fn(|row, _| is[row] - should[row]);
        // What was not fitted has no variance and does not count.
        let unfitted = Vector6::from(fitted.0.map(|fitted| if fitted { 0.0 } else { 1.0 }));
        let error = error.component_mul(&unfitted.map(|out| 1.0 - out));
        let inverse = (fit.covariance + nalgebra::Matrix6::from_diagonal(&unfitted)).try_inverse().unwrap();
        self.nees += error.dot(&(inverse * error)) / fitted.count() as f64;
        for (index, std) in fit.std().into_iter().enumerate().filter(|(_, std)| *std > 0.0) {
            self.worst = self.worst.max((error[index] / std).abs());
            self.beyond_3_sigma += usize::from(error[index].abs() > 3.0 * std);
            self.squares[index] += error[index] * error[index];
        }
        self.fits += 1;
    }

    fn check(&self, way: &str, parameters: usize) {
        self.print(way, parameters);
        let mean = self.nees / self.fits as f64;
        assert!((0.8..1.25).contains(&mean), "{way}: NEES {mean}");
        // Of Gaussian errors 0.27 % are beyond 3σ; those of a fit that estimates its own noise have longer tails.
        assert!(self.beyond_3_sigma as f64 <= 0.02 * (self.fits * parameters) as f64, "{way}");
    }

    fn rms(&self) -> [f64; 6] {
        self.squares.map(|sum| (sum / self.fits as f64).sqrt())
    }

    fn print(&self, way: &str, parameters: usize) {
        let mean = self.nees / self.fits as f64;
        let [height, tilt, roll, yaw, ..] = self.rms();
        println!(
            "{way}: {} fits, NEES a degree of freedom {mean:.2}, {} of {} beyond 3σ (worst {:.1}σ), rms {:.1} mm {:.3}° {:.3}° {:.3}°",
            self.fits,
            self.beyond_3_sigma,
            self.fits * parameters,
            self.worst,
            1e3 * height,
            tilt.to_degrees(),
            roll.to_degrees(),
            yaw.to_degrees(),
        );
    }
}

fn rigs() -> (RangeFinder<f64>, RangeFinder<f64>) {
    let nominal = default_rig().unwrap();
    (nominal, hand_mounted(&nominal).unwrap())
}

#[test]
fn points_of_known_place_give_the_mount_and_its_covariance() {
    let (nominal, truth) = rigs();
    let noise = PointNoise { pixel_std_px: 0.3, range_std_share: 0.01, bearing_std: 0.01 };
    let mut tally = Tally::default();
    for seed in 1..=SEEDS {
        let mut random = Random::new(seed, Stream::Experiment(2));
        let points: Vec<_> = (0..10)
            .map(|_| {
                let pixel = Vector2::new(random.within(10.0, 310.0), random.within(80.0, 235.0));
                let (range, bearing) = range_bearing_from_floor(truth.floor_from_pixel(pixel).unwrap());
                let clicked = pixel + Vector2::new(random.normal(), random.normal()) * noise.pixel_std_px;
                let range = range * (1.0 + noise.range_std_share * random.normal());
                let bearing = bearing + noise.bearing_std * random.normal();
                KnownPoint { pixel: clicked, range_bearing: Vector2::new(range, bearing) }
            })
            .collect();
        let fit =
            fit_points(nominal.camera(), nominal.mount(), points.iter(), &noise, Fitted::HEIGHT_AND_ANGLES)
                .unwrap();
        tally.add(&fit, &truth, Fitted::HEIGHT_AND_ANGLES);
    }
    tally.check("points", 4);
}

fn drive(seed: u64, frames: usize, truth: &RangeFinder<f64>, walkers: usize) -> Simulation {
    let scene = Scene::corridor(&SceneConfig { seed, ..SceneConfig::default() });
    Simulation::new(scene, *truth, SimConfig { seed, frames, walkers, ..SimConfig::default() }).unwrap()
}

/// The wheels from the frame before to this one.
fn motions(simulation: &Simulation, frame: usize) -> Vec<(f64, Odometry)> {
    let Some(before) = frame.checked_sub(1) else { return Vec::new() };
    let (twist, time) = (simulation.odometry(before), simulation.time(frame));
    let seconds = (time - simulation.time(before)) as f32;
    vec![(time, Odometry::Velocity { v: twist.speed as f32, omega: twist.turn as f32, seconds })]
}

#[test]
fn a_drive_with_odometry_gives_the_mount_and_its_covariance() {
    const CORNER_STD_PX: f64 = 0.3;
    let (nominal, truth) = rigs();
    let mut tally = Tally::default();
    for seed in 1..=SEEDS {
        let simulation = drive(seed, 150, &truth, 0);
        let mut random = Random::new(seed, Stream::Experiment(3));
        let rig = Rig::new(nominal, PIXEL_STD, MOUNT_STD).unwrap();
        let settings = Config { motion: defaults(&simulation).unwrap().motion, ..rig.settings };
        let rig = Rig { settings, ..rig };
        let mut drive = Vec::new();
        for frame in 0..simulation.len() {
            let seen = simulation.visible_corners(frame).into_iter().filter(|seen| seen.range < 5.0);
            let corners = seen.take(16).map(|seen| {
                let noise = Vector2::new(random.normal(), random.normal()) * CORNER_STD_PX;
                Corner {
                    pixel: (seen.pixel + noise).cast(),
                    covariance: Matrix2::identity() * 1e-6,
                    vertical: 0,
                    floor: 0,
                    brighter_right: seen.id & 1 == 1,
                    brighter_below: seen.id & 2 == 2,
                }
            });
            let time = simulation.time(frame);
            drive.push(Seen { time, motions: motions(&simulation, frame), corners: corners.collect() });
        }
        let (fit, _) = fit_seen(&rig, &drive, Fitted::HEIGHT_AND_ANGLES).unwrap();
        tally.add(&fit, &truth, Fitted::HEIGHT_AND_ANGLES);
    }
    tally.check("drive", 4);
}

#[test]
fn vertical_edges_of_pictures_give_tilt_and_roll_and_their_covariance() {
    let (nominal, truth) = rigs();
    let rig = Rig::new(nominal, PIXEL_STD, MOUNT_STD).unwrap();
    let mut extractor = monorange_formats::extraction::extractor(&rig).unwrap();
    let mut pixels = vec![0; 320 * 240];
    let mut tally = Tally::default();
    for seed in 1..=SEEDS {
        let simulation = drive(seed, 161, &truth, 0);
        let mut edges = Vec::new();
        for frame in [0, 80, 160] {
            simulation.render(frame, &mut pixels).unwrap();
            let extraction = extractor.extract(Grey::new(&pixels, 320, 240).unwrap()).unwrap();
            edges.extend(
                extraction.vertical_lines.iter().map(|line| VerticalEdge::from_line(nominal.camera(), line)),
            );
        }
        let (fit, _) = fit_verticals(nominal.mount(), &edges, Fitted::HEIGHT_AND_ANGLES).unwrap();
        tally.add(&fit, &truth, Fitted::TILT_AND_ROLL);
    }
    tally.check("vertical edges", 2);
}

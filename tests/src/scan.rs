//! The virtual scan on a simulated drive, judged by the simulator's laser.
use monorange_core::Result;
use monorange_core::geometry::Pose;
use monorange_core::image::Grey;
use monorange_core::scan::{ScanConfig, Scanner};
use monorange_sim::{MOUNT_STD, PIXEL_STD, Simulation};
use nalgebra::{Matrix2, Vector2};

/// Counts of beams; see the methods for what they are shares of.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// Beams whose laser range is at most 3 m.
    pub near: usize,
    /// Of those, with `range` more than 15 % beyond it, and with `free` so.
    pub too_far: [usize; 2],
    /// Beams whose laser range is at most 6 m, with its foot in the picture.
    pub seen: usize,
    /// Of those, with a range.
    pub covered: usize,
    /// Of those, with a range more than 15 % short of the laser's, and with `free` so.
    pub too_near: [usize; 2],
    /// Of the covered, within 5 % or 5 cm.
    pub close: usize,
    /// Of the covered, within three standard deviations.
    pub within_3_sigma: usize,
}

impl Score {
    /// Share in per cent.
    pub fn percent(count: usize, of: usize) -> f64 {
        100.0 * count as f64 / of.max(1) as f64
    }

    /// One line of a table.
    pub fn row(&self) -> String {
        let p = Self::percent;
        format!(
            "{:6} {:6.2} {:6.2} | {:6} {:6.1} {:6.1} {:6.1} {:6.1} {:6.1}",
            self.near,
            p(self.too_far[0], self.near),
            p(self.too_far[1], self.near),
            self.seen,
            p(self.covered, self.seen),
            p(self.too_near[0], self.seen),
            p(self.too_near[1], self.seen),
            p(self.close, self.covered),
            p(self.within_3_sigma, self.covered),
        )
    }

    /// Adds another's counts.
    pub fn add(&mut self, other: &Self) {
        self.near += other.near;
        self.seen += other.seen;
        self.covered += other.covered;
        self.close += other.close;
        self.within_3_sigma += other.within_3_sigma;
        for side in 0..2 {
            self.too_far[side] += other.too_far[side];
            self.too_near[side] += other.too_near[side];
        }
    }
}

/// The scanner of a simulation's rig.
///
/// # Errors
/// None for a simulation that could be made.
pub fn scanner(simulation: &Simulation, config: ScanConfig) -> Result<Box<Scanner>> {
    let pixel = Vector2::from(PIXEL_STD.map(|std| (std * std) as f32));
    let finder = super::corridor::single_precision(simulation.rig())?;
    Ok(Box::new(Scanner::new(
        config,
        finder,
        MOUNT_STD.map(|std| std as f32),
        Matrix2::from_diagonal(&pixel),
    )?))
}

/// The wheels' report of the motion from a frame to the next.
pub fn motion(simulation: &Simulation, frame: usize) -> Pose<f32> {
    let (twist, interval) = (simulation.odometry(frame), simulation.config().interval);
    let (way, turn) = (twist.speed * interval, twist.turn * interval);
    Pose::new((way * libm::cos(turn * 0.5)) as f32, (way * libm::sin(turn * 0.5)) as f32, turn as f32)
}

/// How well the scans of every frame agree with the laser.
///
/// # Errors
/// None for a simulation that could be made.
pub fn judge(simulation: &Simulation, config: ScanConfig) -> Result<Score> {
    let mut scanner = scanner(simulation, config)?;
    let (width, height) = (simulation.rig().camera().width(), simulation.rig().camera().height());
    let mut pixels = vec![0; width * height];
    let mut score = Score::default();
    for frame in 0..simulation.len() {
        if frame > 0 {
            scanner.moved(&motion(simulation, frame - 1));
        }
        simulation.render(frame, &mut pixels)?;
        let laser = simulation.laser(frame);
        for reading in scanner.scan(Grey::new(&pixels, width, height)?)? {
            let bearing = f64::from(reading.bearing);
            let beam = laser
                .iter()
                .min_by(|a, b| (a.bearing - bearing).abs().total_cmp(&(b.bearing - bearing).abs()));
            let Some(truth) = beam.and_then(|beam| beam.range) else { continue };
            let (range, free) = (reading.range.map(f64::from), f64::from(reading.free));
            if truth <= 3.0 {
                score.near += 1;
                score.too_far[0] += usize::from(range.is_some_and(|range| range > 1.15 * truth));
                score.too_far[1] += usize::from(free > 1.15 * truth);
            }
            let foot = Vector2::new(libm::cos(bearing), libm::sin(bearing)) * truth;
            if truth > 6.0 || simulation.rig().pixel_from_floor(foot).is_err() {
                continue;
            }
            score.seen += 1;
            score.too_near[1] += usize::from(free < 0.85 * truth);
            let Some(range) = range else { continue };
            let error = (range - truth).abs();
            score.covered += 1;
            score.too_near[0] += usize::from(range < 0.85 * truth);
            score.close += usize::from(error <= (0.05 * truth).max(0.05));
            score.within_3_sigma += usize::from(error <= 3.0 * f64::from(reading.var_range).sqrt());
        }
    }
    Ok(score)
}

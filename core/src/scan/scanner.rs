use super::decision::{End, Quantiles, end};
use super::evidence::{self, Seen, Steps, evidence};
use super::look::Look;
use super::network::log_odds;
use super::path::Paths;
use super::profile::{MAX_WIDTH, Profile};
use super::reading::{Kind, Reading};
use super::{BEAMS, SAMPLES};
use crate::geometry::{Mount, Pose, RangeFinder, wrap_angle};
use crate::image::{Grey, NoiseLevel};
use crate::{Error, Result};
use nalgebra::{Matrix2, Vector2};

/// What the scan looks at, and how careful it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanConfig {
    /// Beams, 2 to [`BEAMS`]; 0 for one a degree.
    pub beams: usize,
    /// Bearings of the first and the last beam, rad; `None` for what the picture shows.
    pub field: Option<[f32; 2]>,
    /// Farthest that the floor is looked at, in heights of the camera: 20, where a row of a picture with 365 px of focal length is
    /// worth 0.4 m at 0.4 m of height (2.9° below the horizon).
    pub reach: f32,
    /// Probability that the floor ends before `free` (5 %: on training drives nothing was nearer in 99.5 % of the beams).
    pub free_quantile: f32,
    /// Probability that it ends before `range`'s foot.
    pub foot_quantile: f32,
    /// Least probability of a foot within its variance that counts as known.
    pub least_certainty: f32,
    /// How much of the last picture's log-odds is believed where the robot has moved on.
    pub memory: f32,
}

impl Default for ScanConfig {
    fn default() -> Self {
        Self {
            beams: 0,
            field: None,
            reach: 20.0,
            free_quantile: 0.05,
            foot_quantile: 0.2,
            least_certainty: 0.3,
            memory: 0.3,
        }
    }
}

/// Log-odds that count as nothing known: the share of the samples that are a foot.
const PRIOR: f32 = -4.0;
/// The most that the past speaks for and against a foot.
const PAST: [f32; 2] = [-0.7, 3.0];

/// Makes scans of pictures that come row by row.
#[derive(Clone, Debug)]
pub struct Scanner {
    config: ScanConfig,
    finder: RangeFinder<f32>,
    /// The same where the robot's origin is under the lens: beams and their ranges begin there.
    from_lens: RangeFinder<f32>,
    mount_std: [f32; 6],
    pixel_covariance: Matrix2<f32>,
    paths: Paths,
    /// First sample in the picture, and the one behind the last, of each beam.
    first: [usize; BEAMS],
    last: [usize; BEAMS],
    profile: Profile,
    noise: NoiseLevel,
    row: usize,
    /// The floor's look in the pictures so far.
    memory: Look,
    steps: Steps,
    /// Log-odds of the foot, of this picture and of those before.
    log_odds: Steps,
    past: Steps,
    /// The robot at the last picture in the frame of the robot now; none before the first.
    now_from_past: Option<Pose<f32>>,
    readings: [Reading; BEAMS],
}

impl Scanner {
    /// A scanner for the pictures of `finder`'s camera.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an unusable configuration; [`Error::Size`] for a picture wider than 2048 pixels.
    pub fn new(
        config: ScanConfig,
        finder: RangeFinder<f32>,
        mount_std: [f32; 6],
        pixel_covariance: Matrix2<f32>,
    ) -> Result<Self> {
        let camera = finder.camera();
        if camera.width() > MAX_WIDTH {
            return Err(Error::Size { name: "scan.width", got: camera.width(), expected: MAX_WIDTH });
        }
        let field = config.field.unwrap_or_else(|| seen(&finder));
        let degree = 1_f32.to_radians();
        let (field, beams) = match (config.beams, config.field) {
            (0, None) => {
                let whole = [libm::ceilf(field[0] / degree), libm::floorf(field[1] / degree)];
                (whole.map(|count| count * degree), (whole[1] - whole[0]) as usize + 1)
            }
            (0, Some(_)) => (field, libm::roundf((field[1] - field[0]) / degree) as usize + 1),
            (beams, _) => (field, beams),
        };
        let reach = config.reach * finder.mount().height();
        let [height, tilt, roll, yaw, ..] = finder.mount().parameters();
        let from_lens = RangeFinder::new(*finder.camera(), Mount::new([height, tilt, roll, yaw, 0.0, 0.0])?);
        let paths = Paths::new(&finder, field, beams.min(BEAMS), reach)?;
        let (mut first, mut last) = ([usize::MAX; BEAMS], [0; BEAMS]);
        for (beam, (first, last)) in first.iter_mut().zip(&mut last).enumerate().take(paths.beams()) {
            let inside = (0..paths.samples()).filter(|sample| paths.column(beam, *sample).is_some());
            *last = inside.clone().next_back().map_or(0, |sample| sample + 1);
            *first = inside.min().unwrap_or(usize::MAX);
        }
        let nothing = [[0.0; SAMPLES]; BEAMS];
        Ok(Self {
            config,
            finder,
            from_lens,
            mount_std,
            pixel_covariance,
            paths,
            first,
            last,
            profile: Profile::default(),
            noise: NoiseLevel::default(),
            row: 0,
            memory: Look::default(),
            steps: nothing,
            log_odds: nothing,
            past: nothing,
            now_from_past: None,
            readings: [Reading::default(); BEAMS],
        })
    }

    /// Forgets the rows so far: the next one is the first of a picture.
    pub fn begin(&mut self) {
        self.row = 0;
        self.noise = NoiseLevel::default();
        self.profile.begin();
    }

    /// Takes the robot's motion since the last picture: the robot's frame after it in the frame before it.
    pub fn moved(&mut self, before_from_after: &Pose<f32>) {
        if let Some(now_from_past) = &mut self.now_from_past {
            *now_from_past = before_from_after.inverse().compose(now_from_past);
        }
    }

    /// Forgets the pictures before, as where nothing is known about the motion since.
    pub fn forget_past(&mut self) {
        self.now_from_past = None;
    }

    /// Takes the motion since the last picture, or that nothing is known about it.
    pub fn follow(&mut self, motion: Option<&Pose<f32>>) {
        match motion {
            Some(before_from_after) => self.moved(before_from_after),
            None => self.forget_past(),
        }
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// [`Error::Size`] when the row has not the camera's width, or the picture is already complete.
    pub fn push_row(&mut self, pixels: &[u8]) -> Result<()> {
        let (width, height) = (self.finder.camera().width(), self.finder.camera().height());
        if pixels.len() != width {
            return Err(Error::Size { name: "row", got: pixels.len(), expected: width });
        }
        if self.row >= height {
            return Err(Error::Size { name: "rows", got: self.row + 1, expected: height });
        }
        if self.row.is_multiple_of(16) {
            self.noise.add_row(pixels);
        }
        self.profile.push(&self.paths, self.row, height, pixels);
        self.row += 1;
        Ok(())
    }

    /// The scan of the picture, after its last row: a reading a beam, from right to left.
    ///
    /// # Errors
    /// [`Error::Size`] when rows are missing.
    pub fn finish(&mut self) -> Result<&[Reading]> {
        let height = self.finder.camera().height();
        if self.row != height {
            return Err(Error::Size { name: "rows", got: self.row, expected: height });
        }
        let (beams, samples) = (self.paths.beams(), self.paths.samples());
        let noise = self.noise.std();
        let own = Look::of_picture(&self.profile, &self.first, beams, samples);
        let look = Look::blended(&self.memory, &own, samples);
        evidence::steps(&self.profile, &look, noise, beams, samples, &mut self.steps);
        let seen = Seen { profile: &self.profile, look: &look, steps: &self.steps, noise, beams, samples };
        for beam in 0..beams {
            let (first, last) = limits(&self.first, &self.last, beam);
            for sample in first..last {
                let weighed = evidence(&seen, beam, first, sample);
                let odds = weighed.map_or(PRIOR, |evidence| log_odds(&evidence));
                if let Some(cell) = self.log_odds.get_mut(beam).and_then(|cells| cells.get_mut(sample)) {
                    *cell = odds;
                }
            }
        }
        self.remember();
        let mut ends = [End { free: 0.0, foot: None, certainty: 0.0 }; BEAMS];
        let ask = Quantiles { free: self.config.free_quantile, foot: self.config.foot_quantile };
        let mut floor_ends = [0; BEAMS];
        for (beam, (place, floor)) in ends.iter_mut().zip(&mut floor_ends).enumerate().take(beams) {
            let (first, last) = self.limits(beam);
            if let Some(odds) = self.log_odds.get(beam) {
                *place = end(odds, first, last, ask);
                *floor = place.free.max(0.0) as usize;
            }
        }
        self.memory.learn(&self.profile, &self.first, &floor_ends, beams, samples);
        for beam in 0..beams {
            let reading = self.reading(beam, &ends);
            if let Some(place) = self.readings.get_mut(beam) {
                *place = reading;
            }
        }
        core::mem::swap(&mut self.past, &mut self.log_odds);
        self.now_from_past = Some(Pose::default());
        Ok(self.readings.get(..beams).unwrap_or_default())
    }

    /// The scan of a whole picture: a loop over its rows.
    ///
    /// # Errors
    /// [`Error::Size`] when the picture has not the camera's size.
    pub fn scan(&mut self, picture: Grey<'_>) -> Result<&[Reading]> {
        self.begin();
        for row in picture.rows() {
            self.push_row(row)?;
        }
        self.finish()
    }

    fn limits(&self, beam: usize) -> (usize, usize) {
        limits(&self.first, &self.last, beam)
    }

    /// Adds what the pictures before said about the same places of the floor.
    fn remember(&mut self) {
        let Some(now_from_past) = self.now_from_past else { return };
        let past_from_now = now_from_past.inverse();
        let beams = self.paths.beams();
        let bearings = [self.paths.bearing(0), self.paths.bearing(beams - 1)];
        let per_beam = (bearings[1] - bearings[0]) / (beams - 1) as f32;
        let lever_arm = self.finder.mount().lever_arm();
        for beam in 0..beams {
            let (first, last) = self.limits(beam);
            for sample in first..last {
                let Some(pixel) = self.paths.pixel(beam, sample as f32) else { continue };
                let Ok(point) = self.finder.floor_from_pixel(pixel) else { continue };
                let point = past_from_now.transform(point);
                let Ok(pixel) = self.finder.pixel_from_floor(point) else { continue };
                let offset = point - lever_arm;
                let bearing = libm::atan2f(offset.y, offset.x);
                let at_beam = libm::roundf(wrap_angle(bearing - bearings[0]) / per_beam);
                let at_sample = self.paths.sample(pixel.y);
                if at_beam < 0.0 || at_sample < 0.0 {
                    continue;
                }
                let (at_beam, below) = (at_beam as usize, at_sample as usize);
                let (from, to) = self.limits(at_beam);
                if below < from || below + 1 >= to {
                    continue;
                }
                let Some(cells) = self.past.get(at_beam) else { continue };
                let (Some(low), Some(high)) = (cells.get(below), cells.get(below + 1)) else { continue };
                let past = low + (high - low) * (at_sample - below as f32);
                if let Some(cell) = self.log_odds.get_mut(beam).and_then(|cells| cells.get_mut(sample)) {
                    *cell += (self.config.memory * (past - PRIOR)).clamp(PAST[0], PAST[1]);
                }
            }
        }
    }

    fn reading(&self, beam: usize, ends: &[End; BEAMS]) -> Reading {
        let mut reading = Reading { bearing: self.paths.bearing(beam), ..Reading::default() };
        let Some(end) = ends.get(beam) else { return reading };
        let (first, last) = self.limits(beam);
        let range = |sample: f32| {
            let pixel = self.paths.pixel(beam, sample)?;
            self.from_lens.sight(pixel).ok()
        };
        if last <= first {
            return reading;
        }
        if end.free >= first as f32 {
            let limit = self.config.reach * self.finder.mount().height();
            reading.free = range(end.free).map_or(0.0, |sighting| sighting.range.min(limit));
        }
        let Some((foot, variance)) = end.foot else {
            if end.free + 2.0 >= last as f32 {
                reading.kind = Kind::Beyond;
            }
            return reading;
        };
        if end.certainty < self.config.least_certainty || foot < first as f32 + 1.5 {
            return reading;
        }
        let Some(sighting) = range(foot) else { return reading };
        let step = self.paths.step() as f32;
        let along = Matrix2::new(0.0, 0.0, 0.0, variance * step * step) + self.pixel_covariance;
        let variance_of = sighting.noise(&along).m11 + sighting.systematic(&self.mount_std).m11;
        reading.range = Some(sighting.range);
        reading.var_range = variance_of;
        let beside = |other: Option<usize>| {
            other.filter(|other| *other < self.paths.beams()).and_then(|other| ends.get(other)?.foot)
        };
        let [left, right] = [beside(beam.checked_sub(1)), beside(Some(beam + 1))];
        let follows = |other: Option<(f32, f32)>| other.is_some_and(|(at, _)| (at - foot).abs() < 5.0);
        reading.kind = if follows(left) && follows(right) { Kind::Boundary } else { Kind::Obstacle };
        reading
    }
}

/// The samples of a beam that are in the picture.
fn limits(first: &[usize; BEAMS], last: &[usize; BEAMS], beam: usize) -> (usize, usize) {
    let last = last.get(beam).copied().unwrap_or(0);
    (first.get(beam).copied().unwrap_or(0).min(last), last)
}

/// The bearings that the picture shows on the floor at the middle of its lower half.
fn seen(finder: &RangeFinder<f32>) -> [f32; 2] {
    let camera = finder.camera();
    let row = camera.height() as f32 * 0.6;
    let bearing = |column: f32| {
        let ray = camera.ray_from_pixel(Vector2::new(column, row))?;
        let direction = finder.robot_from_cam() * ray.push(1.0);
        Some(libm::atan2f(direction.y, direction.x))
    };
    let right = bearing(camera.width() as f32 - 3.0).unwrap_or(-0.4);
    let left = bearing(2.0).unwrap_or(0.4);
    [right.min(left), right.max(left)]
}

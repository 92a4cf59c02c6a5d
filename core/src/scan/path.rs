//! Where each beam runs through the picture.
use super::{BEAMS, SAMPLES};
use crate::geometry::RangeFinder;
use crate::{Error, Result};
use nalgebra::Vector2;

/// Parts of a pixel in which places are kept.
const PARTS: f32 = 16.0;
/// A place outside the picture.
const OUTSIDE: i16 = i16::MIN;
/// Steps of a beam's path, even in the angle below the horizon, between which rows are interpolated.
const KNOTS: usize = 33;

/// The beams' paths: bearing by bearing, the floor's ray from the lower border of the picture upwards.
///
/// A beam is the vertical plane through the lens at its bearing. What stands upright at that bearing is seen along the same path, so
/// that the foot of an upright edge is where the path leaves the floor.
#[derive(Clone, Debug)]
pub(super) struct Paths {
    columns: [[i16; SAMPLES]; BEAMS],
    /// Half the width of the window about the path, px.
    half_widths: [u8; SAMPLES],
    bearings: [f32; BEAMS],
    beams: usize,
    samples: usize,
    /// Rows to a sample.
    step: usize,
    height: usize,
}

impl Paths {
    /// The paths of `beams` beams, evenly from `field[0]` to `field[1]` (rad), as far as `reach` metres.
    pub(super) fn new(finder: &RangeFinder<f32>, field: [f32; 2], beams: usize, reach: f32) -> Result<Self> {
        if !(2..=BEAMS).contains(&beams) {
            let (name, value) = ("scan.beams", beams as f64);
            return Err(Error::OutOfRange { name, value, expected: "from 2 to 96" });
        }
        let camera = finder.camera();
        let focal = camera.focal().y;
        let height = camera.height();
        let step = (libm::roundf(focal / 183.0) as usize).max(height.div_ceil(SAMPLES)).max(1);
        let samples = height / step;
        let mut paths = Self {
            columns: [[OUTSIDE; SAMPLES]; BEAMS],
            half_widths: [0; SAMPLES],
            bearings: [0.0; BEAMS],
            beams,
            samples,
            step,
            height,
        };
        let nearest = finder.mount().height() * 0.05;
        for (index, (bearing, columns)) in
            paths.bearings.iter_mut().zip(&mut paths.columns).take(beams).enumerate()
        {
            *bearing = field[0] + (field[1] - field[0]) * (index as f32 / (beams - 1) as f32);
            let direction = Vector2::new(libm::cosf(*bearing), libm::sinf(*bearing));
            let (first, last) = (
                libm::atanf(finder.mount().height() / nearest),
                libm::atanf(finder.mount().height() / reach),
            );
            let mut before: Option<Vector2<f32>> = None;
            for knot in 0..KNOTS {
                // Denser towards the horizon, where a row is many metres.
                let share = knot as f32 / (KNOTS - 1) as f32;
                let depression = first + (last - first) * share;
                let distance = finder.mount().height() / libm::tanf(depression);
                let point = finder.mount().lever_arm() + direction * distance;
                let pixel = finder.pixel_from_floor_unbounded(point).ok();
                if let (Some(a), Some(b)) = (before, pixel) {
                    fill(columns, a, b, camera.width(), height, step);
                }
                before = pixel;
            }
        }
        for (sample, half) in paths.half_widths.iter_mut().enumerate().take(samples) {
            // Two centimetres to each side at 0.4 m of height: wider than most chips of a floor, narrower than a leg of a chair.
            let row = (height - 1 - sample * step) as f32;
            let middle = Vector2::new(camera.width() as f32 * 0.5, row);
            let distance = finder
                .floor_from_pixel(middle)
                .map_or(reach, |point| (point - finder.mount().lever_arm()).norm());
            let wanted = focal * 0.05 * finder.mount().height() / distance.max(0.1);
            let unit = focal / 365.0;
            *half = (libm::roundf(wanted.clamp(2.0 * unit, 8.0 * unit)) as u8).max(1);
        }
        Ok(paths)
    }

    pub(super) fn beams(&self) -> usize {
        self.beams
    }

    pub(super) fn samples(&self) -> usize {
        self.samples
    }

    pub(super) fn step(&self) -> usize {
        self.step
    }

    pub(super) fn bearing(&self, beam: usize) -> f32 {
        self.bearings.get(beam).copied().unwrap_or(0.0)
    }

    pub(super) fn half_width(&self, sample: usize) -> usize {
        usize::from(self.half_widths.get(sample).copied().unwrap_or(1))
    }

    /// The column in which a beam crosses a sample's rows, if it is in the picture there.
    pub(super) fn column(&self, beam: usize, sample: usize) -> Option<f32> {
        let place = *self.columns.get(beam)?.get(sample)?;
        (place != OUTSIDE).then_some(f32::from(place) / PARTS)
    }

    /// The (fractional) sample of a row.
    pub(super) fn sample(&self, row: f32) -> f32 {
        (self.height as f32 - 1.0 - (self.step as f32 - 1.0) * 0.5 - row) / self.step as f32
    }

    /// The pixel at a (fractional) sample of a beam; sample k is the middle of its rows.
    pub(super) fn pixel(&self, beam: usize, sample: f32) -> Option<Vector2<f32>> {
        let below = libm::floorf(sample.max(0.0));
        let first = self.column(beam, below as usize)?;
        let second = self.column(beam, below as usize + 1).unwrap_or(first);
        let row = self.height as f32 - 1.0 - (self.step as f32 - 1.0) * 0.5 - sample * self.step as f32;
        Some(Vector2::new(first + (second - first) * (sample - below), row))
    }
}

/// The columns of the samples whose middle rows lie between two pixels of a path.
fn fill(
    columns: &mut [i16; SAMPLES],
    a: Vector2<f32>,
    b: Vector2<f32>,
    width: usize,
    height: usize,
    step: usize,
) {
    if a.y <= b.y {
        return; // not upwards: beyond what the lens model describes
    }
    let bottom = height as f32 - 1.0 - (step as f32 - 1.0) * 0.5;
    for (sample, place) in columns.iter_mut().enumerate() {
        let row = bottom - (sample * step) as f32;
        if row <= a.y && row > b.y {
            let column = a.x + (b.x - a.x) * ((a.y - row) / (a.y - b.y));
            if column >= 2.0 && column <= width as f32 - 3.0 {
                *place = libm::roundf(column * PARTS) as i16;
            }
        }
    }
}

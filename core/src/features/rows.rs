//! FAST corners with BRIEF descriptors from a stream of rows.
//!
//! A corner at row y is complete when row y + 19 arrives: its descriptor reaches 15 rows down on a picture that
//! is smoothed over 4 more. So 24 rows of picture, 32 smoothed ones and 3 of scores are kept: 59 bytes a column,
//! 18,880 bytes at 320 columns. Corners within 19 pixels of the rim have no descriptor and are not reported.
//!
//! ```text
//! row v arrives → picture ring → smooth row v − 4 → smoothed ring
//!                              → scores of row v − 18 → corners of row v − 19 → direction → descriptor
//! ```
#![allow(clippy::indexing_slicing, reason = "rings are cut to whole rows; rows are one width")]

use super::brief::{self, BriefDescriptor};
use super::{Keypoint, fast};
use crate::image::Grey;
use crate::{Error, Result};
use nalgebra::Vector2;

/// Half the taps of the smoothing, which are 9.
const SMOOTH: usize = 4;
/// Rows from a corner to the last it depends on.
const DELAY: usize = brief::RADIUS + SMOOTH;
const PICTURE_ROWS: usize = 24;
const SMOOTH_ROWS: usize = 32;
const SCORE_ROWS: usize = 3;
/// The binomial of order 8 from its end to its middle; all nine sum to 256.
const BINOMIAL: [u16; SMOOTH + 1] = [1, 8, 28, 56, 70];

/// Bytes of memory that [`BriefRows`] needs for rows of `width` pixels.
///
/// ```
/// assert_eq!(monorange_core::features::brief_work_len(320), 18_880);
/// ```
pub const fn brief_work_len(width: usize) -> usize {
    (PICTURE_ROWS + SMOOTH_ROWS + SCORE_ROWS) * width
}

/// A detector that takes a picture row by row.
#[derive(Debug)]
pub struct BriefRows<'a> {
    picture: &'a mut [u8],
    smoothed: &'a mut [u8],
    scores: &'a mut [u8],
    width: usize,
    threshold: u8,
    rows: usize,
}

impl<'a> BriefRows<'a> {
    /// A detector for rows of `width` pixels with FAST's threshold in grey levels.
    ///
    /// # Errors
    /// [`Error::Size`] when `work` is shorter than [`brief_work_len`], [`Error::OutOfRange`] when the width is 0.
    pub fn new(width: usize, threshold: u8, work: &'a mut [u8]) -> Result<Self> {
        if width == 0 {
            return Err(Error::OutOfRange { name: "width", value: 0.0, expected: "above 0" });
        }
        let (got, expected) = (work.len(), brief_work_len(width));
        let Some(work) = work.get_mut(..expected) else {
            return Err(Error::Size { name: "brief work", got, expected });
        };
        work.fill(0);
        let (picture, work) = work.split_at_mut(PICTURE_ROWS * width);
        let (smoothed, scores) = work.split_at_mut(SMOOTH_ROWS * width);
        Ok(Self { picture, smoothed, scores, width, threshold, rows: 0 })
    }

    /// Takes the next row and calls `found` with the corners of the row 19 above it.
    ///
    /// # Errors
    /// [`Error::Size`] when the row is not as wide as the others.
    pub fn push(&mut self, row: &[u8], mut found: impl FnMut(Keypoint, BriefDescriptor)) -> Result<()> {
        let width = self.width;
        if row.len() != width {
            return Err(Error::Size { name: "row", got: row.len(), expected: width });
        }
        let now = self.rows;
        self.rows += 1;
        self.picture[now % PICTURE_ROWS * width..][..width].copy_from_slice(row);
        if width <= 2 * DELAY {
            return Ok(());
        }
        let picture = |y: usize| &self.picture[y % PICTURE_ROWS * width..][..width];
        if now >= 2 * SMOOTH {
            let out = &mut self.smoothed[(now - SMOOTH) % SMOOTH_ROWS * width..][..width];
            smooth(core::array::from_fn(|n| picture(now - 2 * SMOOTH + n)), out);
        }
        // Scores of the row below the corners'; above the first corners' row they are wanted, too.
        if now < 2 * DELAY - 2 {
            return Ok(());
        }
        let below = now + 1 - DELAY;
        let out = &mut self.scores[below % SCORE_ROWS * width..][..width];
        fast::score_row(core::array::from_fn(|n| picture(below + n - fast::RADIUS)), self.threshold, out);
        if now < 2 * DELAY {
            return Ok(());
        }
        let y = now - DELAY;
        let scores = |y: usize| &self.scores[y % SCORE_ROWS * width..][..width];
        let smoothed: [&[u8]; brief::ROWS] = core::array::from_fn(|n| {
            let y = y + n - brief::RADIUS;
            &self.smoothed[y % SMOOTH_ROWS * width..][..width]
        });
        fast::suppress_row([scores(y - 1), scores(y), scores(y + 1)], |x, score| {
            if (DELAY..width - DELAY).contains(&x) {
                let direction = brief::direction(&smoothed, x);
                let keypoint = Keypoint {
                    pixel: Vector2::new(x as f32, y as f32),
                    var_px2: fast::VAR_PX2,
                    scale: 1.0,
                    angle: libm::atan2f(direction[1], direction[0]),
                    response: f32::from(score),
                };
                found(keypoint, brief::describe(&smoothed, x, direction));
            }
        });
        Ok(())
    }
}

/// The binomial over nine rows, then along the row; the outermost four columns stay as they are.
fn smooth(rows: [&[u8]; 2 * SMOOTH + 1], out: &mut [u8]) {
    const BLOCK: usize = 64;
    let width = out.len();
    let mut start = 0;
    while start + 2 * SMOOTH < width {
        let count = BLOCK.min(width - start - 2 * SMOOTH);
        let mut columns = [0_u8; BLOCK + 2 * SMOOTH];
        let columns = &mut columns[..count + 2 * SMOOTH];
        weigh(rows.map(|row| &row[start..][..count + 2 * SMOOTH]), columns);
        let shifted = core::array::from_fn(|n| &columns[n..][..count]);
        weigh(shifted, &mut out[start + SMOOTH..][..count]);
        start += count;
    }
}

/// The binomial over nine slices of one length.
fn weigh(taps: [&[u8]; 2 * SMOOTH + 1], out: &mut [u8]) {
    let length = out.len();
    let taps = taps.map(|tap| &tap[..length]);
    for x in 0..length {
        let mut sum = 128 + BINOMIAL[SMOOTH] * u16::from(taps[SMOOTH][x]);
        for n in 0..SMOOTH {
            sum += BINOMIAL[n] * (u16::from(taps[n][x]) + u16::from(taps[2 * SMOOTH - n][x]));
        }
        out[x] = (sum >> 8) as u8;
    }
}

/// What [`detect_brief`] found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BriefReport {
    /// Keypoints written, a descriptor each.
    pub keypoints: usize,
    /// Keypoints without room in the output, those furthest down the picture.
    pub truncated: usize,
}

/// Writes a picture's corners, in reading order, and their descriptors to the front of two slices.
///
/// `work` has [`brief_work_len`] bytes. Pictures under 39 pixels a side have no corners with a descriptor.
///
/// # Errors
/// [`Error::Size`] when `work` is too short.
pub fn detect_brief(
    picture: Grey,
    threshold: u8,
    work: &mut [u8],
    keypoints: &mut [Keypoint],
    descriptors: &mut [BriefDescriptor],
) -> Result<BriefReport> {
    let mut detector = BriefRows::new(picture.width(), threshold, work)?;
    let mut report = BriefReport::default();
    let mut places = keypoints.iter_mut().zip(descriptors);
    for row in picture.rows() {
        detector.push(row, |keypoint, descriptor| match places.next() {
            Some(place) => {
                (*place.0, *place.1) = (keypoint, descriptor);
                report.keypoints += 1;
            }
            None => report.truncated += 1,
        })?;
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;
    use std::vec;

    /// Squares of different brightness on a checkered ground.
    fn scene(width: usize, height: usize) -> std::vec::Vec<u8> {
        let pixel = |index: usize| {
            let (x, y) = (index % width, index / width);
            let cell = (x / 9) * 7 + (y / 11) * 5;
            (40 + cell * 37 % 160 + (x * y) % 5) as u8
        };
        (0..width * height).map(pixel).collect()
    }

    #[test]
    fn corners_are_those_of_the_whole_picture_away_from_the_rim() {
        let (width, height) = (90, 70);
        let pixels = scene(width, height);
        let picture = Grey::new(&pixels, width, height).expect("the size is right");
        let mut all = vec![Keypoint::default(); 500];
        let whole = detect_fast_inside(picture, &mut all);
        let mut found = vec![Keypoint::default(); 500];
        let mut descriptors = vec![[0; 8]; 500];
        let mut work = vec![0xaa; brief_work_len(width)];
        let report = detect_brief(picture, 20, &mut work, &mut found, &mut descriptors).expect("room");
        assert!(report.keypoints > 20 && report.truncated == 0);
        let places = |list: &[Keypoint]| list.iter().map(|k| (k.pixel, k.response)).collect::<vec::Vec<_>>();
        assert_eq!(places(&found[..report.keypoints]), places(&whole));
    }

    fn detect_fast_inside(picture: Grey, all: &mut [Keypoint]) -> vec::Vec<Keypoint> {
        let (width, height) = (picture.width(), picture.height());
        let report = super::super::detect_fast(picture, 20, &mut vec![0; 3 * width], all).expect("room");
        let margin = DELAY as f32;
        let inside = |k: &&Keypoint| {
            k.pixel.x >= margin
                && k.pixel.y >= margin
                && k.pixel.x < width as f32 - margin
                && k.pixel.y < height as f32 - margin
        };
        all[..report.keypoints].iter().filter(inside).copied().collect()
    }

    #[test]
    fn a_shifted_picture_has_the_same_descriptors() {
        let (width, height, shift) = (100, 80, 4);
        let pixels = scene(width, height);
        let shifted: vec::Vec<u8> =
            (0..width * height).map(|n| pixels[(n + shift) % (width * height)]).collect();
        let run = |pixels: &[u8]| {
            let (mut found, mut bits) = (vec![Keypoint::default(); 500], vec![[0; 8]; 500]);
            let picture = Grey::new(pixels, width, height).expect("the size is right");
            let report =
                detect_brief(picture, 20, &mut vec![0; brief_work_len(width)], &mut found, &mut bits);
            let count = report.expect("room").keypoints;
            (found[..count].to_vec(), bits[..count].to_vec())
        };
        let ((a, a_bits), (b, b_bits)) = (run(&pixels), run(&shifted));
        let mut common = 0;
        for (keypoint, bits) in a.iter().zip(&a_bits) {
            let place = keypoint.pixel - Vector2::new(shift as f32, 0.0);
            if let Some(other) = b.iter().position(|k| k.pixel == place) {
                assert_eq!((b[other].angle, b_bits[other]), (keypoint.angle, *bits));
                common += 1;
            }
        }
        assert!(common > 20, "{common}");
    }

    #[test]
    fn small_flat_and_long_pictures_have_no_corners() {
        for (width, height) in [(1, 1), (38, 200), (200, 38), (10_000, 40)] {
            let pixels = vec![128; width * height];
            let picture = Grey::new(&pixels, width, height).expect("the size is right");
            let mut work = vec![0; brief_work_len(width)];
            assert_eq!(detect_brief(picture, 1, &mut work, &mut [], &mut []), Ok(BriefReport::default()));
        }
    }

    #[test]
    fn broken_contracts_are_named() {
        let mut work = [0; 59 * 4];
        assert!(matches!(BriefRows::new(0, 20, &mut work), Err(Error::OutOfRange { name: "width", .. })));
        let error = BriefRows::new(5, 20, &mut work).map(|_| ());
        assert_eq!(error, Err(Error::Size { name: "brief work", got: 236, expected: 295 }));
        let mut rows = BriefRows::new(4, 20, &mut work).expect("room");
        assert_eq!(rows.push(&[0; 3], |_, _| ()), Err(Error::Size { name: "row", got: 3, expected: 4 }));
    }
}

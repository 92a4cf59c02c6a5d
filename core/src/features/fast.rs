//! FAST-9 corners: pixels with an arc of nine, of the sixteen on a circle of radius 3, all brighter or all darker.
//!
//! ```text
//!          15  0  1              score = max over the 16 arcs A of nine of
//!       14           2                   max( min_A(Iₙ) − I,  I − max_A(Iₙ) )
//!    13                 3
//!    12        I        4        corner where score > threshold and no neighbour
//!    11                 5        of the 3 × 3 around has a larger score
//!       10           6
//!           9  8  7
//! ```
//!
//! The score is the largest threshold, less one, that the pixel passes. An arc of nine holds two neighbours of
//! the four points 0, 4, 8, 12, so min(max(I₀, I₈), max(I₄, I₁₂)) bounds it: ten integer instructions reject most
//! of sixteen pixels. Only where one of them is left the score is computed, for all sixteen together.
//!
//! Rows come one at a time; seven are looked at together, so that a microcontroller needs no frame. Of two
//! neighbours with equal scores the first in reading order is kept.
//!
//! Source: E. Rosten and T. Drummond, "Machine learning for high-speed corner detection", ECCV 2006; the score
//! as the largest threshold is from the authors' later work (PAMI 32(1), 2010).
#![allow(
    clippy::indexing_slicing,
    reason = "rows are cut to one length before the loops, which then vectorise"
)]

use super::Keypoint;
use crate::image::Grey;
use crate::{Error, Result};
use nalgebra::Vector2;

/// Radius of the circle.
pub(super) const RADIUS: usize = 3;
/// Rows that a score depends on.
pub(super) const ROWS: usize = 2 * RADIUS + 1;
/// Variance of a corner's coordinates in px²: the median of matches on warped pictures.
pub(super) const VAR_PX2: f32 = 0.14;
/// Pixels that are rejected or scored together.
const BLOCK: usize = 16;
/// Columns of a row that holds one block's circles.
const NARROW: usize = BLOCK + 2 * RADIUS;
/// The circle: column and row from the top-left of its square, clockwise from the top.
const CIRCLE: [(usize, usize); 16] = [
    (3, 0),
    (4, 0),
    (5, 1),
    (6, 2),
    (6, 3),
    (6, 4),
    (5, 5),
    (4, 6),
    (3, 6),
    (2, 6),
    (1, 5),
    (0, 4),
    (0, 3),
    (0, 2),
    (1, 1),
    (2, 0),
];

/// Writes the scores of the middle of seven rows; 0 where there is no corner.
pub(super) fn score_row(rows: [&[u8]; ROWS], threshold: u8, scores: &mut [u8]) {
    scores.fill(0);
    let width = scores.len();
    if width < ROWS {
        return;
    }
    if width < NARROW {
        let padded = rows.map(|row| {
            let mut padded = [0; NARROW];
            padded[..width].copy_from_slice(&row[..width]);
            padded
        });
        let mut found = [0; NARROW];
        score_wide(&padded.each_ref().map(|row| &row[..]), threshold, &mut found);
        scores[RADIUS..width - RADIUS].copy_from_slice(&found[RADIUS..width - RADIUS]);
    } else {
        score_wide(&rows, threshold, scores);
    }
}

/// As [`score_row`] for at least [`NARROW`] columns.
fn score_wide(rows: &[&[u8]; ROWS], threshold: u8, scores: &mut [u8]) {
    let width = scores.len();
    let rows = rows.map(|row| &row[..width]);
    let inside = width - 2 * RADIUS;
    for start in (0..inside).step_by(BLOCK) {
        // The last block overlaps its neighbour, whose scores it finds again.
        let start = start.min(inside - BLOCK);
        if promising(&rows, start, threshold) {
            let Some(circle) = circle(&rows, start) else { continue };
            scores[RADIUS + start..][..BLOCK].copy_from_slice(&score_block(&circle, threshold));
        }
    }
}

/// Whether the score of one of a block's pixels can exceed the threshold.
#[inline(always)]
fn promising(rows: &[&[u8]; ROWS], start: usize, threshold: u8) -> bool {
    let at = |(column, row): (usize, usize)| -> &[u8] { &rows[row][start + column..][..BLOCK] };
    let [top, right, bottom, left] = [at(CIRCLE[0]), at(CIRCLE[4]), at(CIRCLE[8]), at(CIRCLE[12])];
    let centre = at((RADIUS, RADIUS));
    let mut bounds = [0; BLOCK];
    for n in 0..BLOCK {
        let bright = top[n].max(bottom[n]).min(left[n].max(right[n])).saturating_sub(centre[n]);
        let dark = centre[n].saturating_sub(top[n].min(bottom[n]).max(left[n].min(right[n])));
        bounds[n] = bright.max(dark).saturating_sub(threshold);
    }
    u128::from_le_bytes(bounds) > 0
}

/// Neighbouring pixels, which a processor with vectors takes as one.
type Lanes = [u8; BLOCK];

/// The circles of a block's pixels and, last, the pixels themselves.
#[inline(always)]
fn circle<'a>(rows: &[&'a [u8]; ROWS], start: usize) -> Option<[&'a Lanes; 17]> {
    let at = |point: usize| {
        let (column, row) = if point < 16 { CIRCLE[point] } else { (RADIUS, RADIUS) };
        rows[row].get(start + column..)?.first_chunk()
    };
    Some([
        at(0)?,
        at(1)?,
        at(2)?,
        at(3)?,
        at(4)?,
        at(5)?,
        at(6)?,
        at(7)?,
        at(8)?,
        at(9)?,
        at(10)?,
        at(11)?,
        at(12)?,
        at(13)?,
        at(14)?,
        at(15)?,
        at(16)?,
    ])
}

/// The scores of a block's pixels, without branches.
#[inline(never)]
fn score_block(circle: &[&Lanes; 17], threshold: u8) -> Lanes {
    let mut scores = [0; BLOCK];
    for lane in 0..BLOCK {
        let points: [u8; 16] = core::array::from_fn(|point| circle[point][lane]);
        let centre = circle[16][lane];
        let brighter = best_arc(&points, u8::MIN, u8::min, u8::max).saturating_sub(centre);
        let darker = centre.saturating_sub(best_arc(&points, u8::MAX, u8::max, u8::min));
        let score = brighter.max(darker);
        scores[lane] = if score > threshold { score } else { 0 };
    }
    scores
}

/// The best over all arcs of the worst of their nine points, from the `worst` there can be.
#[inline(always)]
fn best_arc(circle: &[u8; 16], worst: u8, worse: impl Fn(u8, u8) -> u8, better: impl Fn(u8, u8) -> u8) -> u8 {
    let two: [u8; 8] = core::array::from_fn(|n| worse(circle[2 * n + 1], circle[(2 * n + 2) % 16]));
    let four: [u8; 8] = core::array::from_fn(|n| worse(two[n], two[(n + 1) % 8]));
    (0..8).fold(worst, |best, n| {
        // The arcs that start at 2n and at 2n + 1 share eight points and have one more at either end.
        let eight = worse(four[n], four[(n + 2) % 8]);
        let ninth = better(circle[2 * n], circle[(2 * n + 9) % 16]);
        better(best, worse(eight, ninth))
    })
}

/// Calls `found` with the column and score of every pixel of the middle row that no neighbour outdoes.
pub(super) fn suppress_row([above, here, below]: [&[u8]; 3], mut found: impl FnMut(usize, u8)) {
    let width = here.len();
    if width < ROWS {
        return;
    }
    for (block, scores) in here.chunks(BLOCK).enumerate() {
        let mut left = word(scores);
        while left > 0 {
            let column = left.trailing_zeros() / 8;
            left &= !(0xff << (8 * column));
            // Scores at the rim are 0, so a corner has neighbours on all sides.
            let x = block * BLOCK + column as usize;
            let score = here[x];
            let later = below[x - 1].max(below[x]).max(below[x + 1]).max(here[x + 1]);
            let earlier = above[x - 1].max(above[x]).max(above[x + 1]).max(here[x - 1]);
            if score >= later && score > earlier {
                found(x, score);
            }
        }
    }
}

/// A block's bytes, the first as the lowest; zeros beyond its end.
#[inline(always)]
fn word(block: &[u8]) -> u128 {
    u128::from_le_bytes(block.first_chunk().copied().unwrap_or_else(|| {
        let mut lanes = [0; BLOCK];
        lanes.iter_mut().zip(block).for_each(|(lane, score)| *lane = *score);
        lanes
    }))
}

/// What [`detect_fast`] found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FastReport {
    /// Corners written.
    pub keypoints: usize,
    /// Corners without room in the output, those furthest down the picture.
    pub truncated: usize,
}

/// Writes the FAST-9 corners of a picture, in reading order, to the front of `keypoints`.
///
/// `work` holds three rows of scores. A picture under 7 pixels a side has no corners.
///
/// # Errors
/// [`Error::Size`] when `work` is shorter than `3 * width`.
///
/// ```
/// use monorange_core::{features::{Keypoint, detect_fast}, image::Grey};
/// let mut pixels = [50; 20 * 20];
/// for row in 8..20 {
///     pixels[row * 20 + 8..][..12].fill(200); // a bright square whose corner is at (8, 8)
/// }
/// let mut corners = [Keypoint::default(); 8];
/// let report = detect_fast(Grey::new(&pixels, 20, 20)?, 20, &mut [0; 60], &mut corners)?;
/// assert_eq!((report.keypoints, corners[0].pixel.x, corners[0].pixel.y), (1, 8.0, 8.0));
/// # Ok::<(), monorange_core::Error>(())
/// ```
pub fn detect_fast(
    picture: Grey,
    threshold: u8,
    work: &mut [u8],
    keypoints: &mut [Keypoint],
) -> Result<FastReport> {
    let (width, height) = (picture.width(), picture.height());
    let Some(work) = work.get_mut(..3 * width) else {
        return Err(Error::Size { name: "fast work", got: work.len(), expected: 3 * width });
    };
    work.fill(0);
    let mut report = FastReport::default();
    let mut places = keypoints.iter_mut();
    // Row y is scored, then row y − 1 has all its neighbours. Rows at the rim keep score 0.
    for y in RADIUS..=height.saturating_sub(RADIUS) {
        let scores = &mut work[y % 3 * width..][..width];
        if y + RADIUS < height {
            score_row(core::array::from_fn(|row| picture.row(y + row - RADIUS)), threshold, scores);
        } else {
            scores.fill(0);
        }
        let row = |y: usize| &work[y % 3 * width..][..width];
        suppress_row([row(y - 2), row(y - 1), row(y)], |x, score| {
            let Some(place) = places.next() else {
                report.truncated += 1;
                return;
            };
            *place = Keypoint {
                pixel: Vector2::new(x as f32, (y - 1) as f32),
                var_px2: VAR_PX2,
                scale: 1.0,
                angle: 0.0,
                response: f32::from(score),
            };
            report.keypoints += 1;
        });
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// As the definition says: the largest t − 1 for which an arc of nine is brighter or darker by more than t.
    fn defined_score(picture: &Grey, x: usize, y: usize) -> u8 {
        let pixel = |(column, row): (usize, usize)| i32::from(picture.row(y + row - 3)[x + column - 3]);
        let differences: Vec<i32> = CIRCLE.iter().map(|&at| pixel(at) - pixel((3, 3))).collect();
        let passes = |t: i32| {
            [1, -1]
                .iter()
                .any(|sign| (0..16).any(|start| (0..9).all(|n| sign * differences[(start + n) % 16] > t)))
        };
        (1..=255).rev().find(|t| passes(t - 1)).unwrap_or(0) as u8
    }

    extern crate std;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn scores_are_those_of_the_definition(
            width in 7_usize..40,
            threshold in 1_u8..60,
            seed in proptest::collection::vec(prop_oneof![0_u8..3, 60_u8..64, any::<u8>()], 7 * 40),
        ) {
            let pixels: Vec<u8> = seed[..7 * width].to_vec();
            let picture = Grey::new(&pixels, width, 7).expect("the size is right");
            let mut scores = std::vec![9; width];
            score_row(core::array::from_fn(|row| picture.row(row)), threshold, &mut scores);
            for (x, &found) in scores.iter().enumerate() {
                let inside = (3..width - 3).contains(&x);
                let score = if inside { defined_score(&picture, x, 3) } else { 0 };
                prop_assert_eq!(found, if score > threshold { score } else { 0 }, "column {}", x);
            }
        }
    }

    /// Marks the corners of a drawn picture: `.` is dark, `#` bright, and `o` in the result a corner.
    fn corners(drawing: &[&str]) -> Vec<std::string::String> {
        let (width, height) = (drawing[0].len(), drawing.len());
        let pixels: Vec<u8> =
            drawing.iter().flat_map(|row| row.bytes().map(|c| if c == b'#' { 200 } else { 50 })).collect();
        let mut found = [Keypoint::default(); 16];
        let mut work = std::vec![0; 3 * width];
        let picture = Grey::new(&pixels, width, height).expect("the size is right");
        let report = detect_fast(picture, 20, &mut work, &mut found).expect("the work is long enough");
        let mut marked: Vec<Vec<u8>> = drawing.iter().map(|row| row.bytes().collect()).collect();
        for corner in &found[..report.keypoints] {
            marked[corner.pixel.y as usize][corner.pixel.x as usize] = b'o';
        }
        marked.into_iter().map(|row| std::string::String::from_utf8(row).expect("ASCII")).collect()
    }

    #[test]
    fn dots_and_holes_are_corners_and_edges_are_not() {
        let expected = [
            "....................",
            "....................",
            "....................",
            "....o...............",
            "............o.......",
            "............#.......",
            "....................",
            "....................",
            "....................",
            "....................",
            "####################",
            "####################",
            "####################",
            "####################",
            "#######o############",
            "####################",
            "####################",
            "####################",
        ];
        // A hole is dark: it is drawn as `o` in the bright half.
        let draw = |(y, row): (usize, &&str)| row.replace('o', if y < 10 { "#" } else { "." });
        let drawing: Vec<_> = expected.iter().enumerate().map(draw).collect();
        let drawing: Vec<&str> = drawing.iter().map(|row| row.as_str()).collect();
        assert_eq!(corners(&drawing), expected);
    }

    #[test]
    fn small_flat_and_long_pictures_have_no_corners_and_corners_without_room_are_counted() {
        let mut found = [Keypoint::default(); 1];
        for (width, height) in [(1, 1), (6, 100), (100, 6), (10_000, 7)] {
            let pixels = std::vec![77; width * height];
            let picture = Grey::new(&pixels, width, height).expect("the size is right");
            let report = detect_fast(picture, 1, &mut std::vec![0; 3 * width], &mut found);
            assert_eq!(report, Ok(FastReport::default()));
        }
        let mut pixels = [50; 400];
        for row in 6..14 {
            pixels[row * 20 + 6..][..8].fill(200);
        }
        let picture = Grey::new(&pixels, 20, 20).expect("the size is right");
        let report = detect_fast(picture, 20, &mut [0; 60], &mut found);
        assert_eq!(report, Ok(FastReport { keypoints: 1, truncated: 3 }));
        let error = Error::Size { name: "fast work", got: 59, expected: 60 };
        assert_eq!(detect_fast(picture, 20, &mut [0; 59], &mut found), Err(error));
    }
}

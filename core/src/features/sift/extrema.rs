//! Extrema of the difference of Gaussians, to a fraction of a sample and of a scale.
//!
//! A sample of D_l, l = 1 … 3, is a candidate when it is the largest (or smallest) of the 27 around it in place
//! and scale and beyond a first threshold. Around it D is a quadratic in x = (x, y, l):
//!
//! ```text
//! D(x) = D + gᵀx + ½ xᵀHx        x̂ = −H⁻¹g        D(x̂) = D + ½ gᵀx̂                (Lowe 2, 3)
//! ```
//!
//! with central differences for g and H. While x̂ is more than 0.6 samples off, the neighbour is tried, up to
//! five times. A candidate stays when |D(x̂)| reaches the contrast threshold and the ratio r of the principal
//! curvatures is below the edge threshold: tr(H_xy)² / det(H_xy) < (r + 1)²/r                         (Lowe 4).
//!
//! Cost: the 27 samples are compared by three along each axis, 16 integer instructions on a vector; solving happens at candidates only.
//!
//! Source: Lowe 2004, sections 3.1, 4 and 4.1.
#![allow(clippy::indexing_slicing, reason = "rows share one length; coordinates stay inside the border")]

use super::Candidate;
use super::scale_space::{INTERVALS, PLANES, Planes};
use crate::vectors::widest;
use nalgebra::{Matrix3, Vector3};

/// Samples along an octave's rim where no keypoint is looked for: too little of their surroundings is seen.
const BORDER: usize = 5;
/// Steps to a neighbouring sample before a candidate is given up.
const MAX_STEPS: usize = 5;
/// The neighbour is tried when the extremum lies more than this off: more than half a sample, or noise could
/// send it to and fro between two.
const STEP: f32 = 0.6;
/// After the last step the extremum may lie this far off.
const FARTHEST: f32 = 1.5;
/// Differences of neighbouring planes.
const LAYERS: usize = PLANES - 1;
/// Columns looked at together for a candidate.
const BLOCK: usize = 32;
/// Units of a sample in one grey level.
const UNIT: f32 = 128.0;

/// Samples of scratch for an octave `width` samples wide.
pub(super) fn scratch_len(width: usize) -> usize {
    (5 * LAYERS + 3) * width
}

/// The thresholds, in the units of the planes.
pub(super) struct Thresholds {
    /// Of |D| at a sample, before it is refined.
    coarse: i16,
    /// Of |D(x̂)|.
    contrast: f32,
    /// (r + 1)²/r.
    edge: f32,
}

impl Thresholds {
    /// From Lowe's settings: contrast in parts of the grey range divided by the scales an octave.
    pub(super) fn new(contrast: f32, edge: f32) -> Self {
        let grey = contrast / INTERVALS as f32 * 255.0 * UNIT;
        Self { coarse: (0.5 * grey) as i16, contrast: grey, edge: (edge + 1.0) * (edge + 1.0) / edge }
    }
}

/// Calls `found` with every keypoint of an octave, by rows.
pub(super) fn find(
    planes: &Planes,
    thresholds: &Thresholds,
    scratch: &mut [i16],
    mut found: impl FnMut(Candidate),
) {
    let (width, height) = (planes.width, planes.height);
    if width <= 2 * BORDER || height <= 2 * BORDER {
        return;
    }
    let (differences, scratch) = scratch.split_at_mut(3 * LAYERS * width);
    let (most, scratch) = scratch.split_at_mut(LAYERS * width);
    let (least, scratch) = scratch.split_at_mut(LAYERS * width);
    let (largest, scratch) = scratch.split_at_mut(width);
    let (smallest, scratch) = scratch.split_at_mut(width);
    let marks = &mut scratch[..width];
    let place = |layer: usize, y: usize| (layer * 3 + y % 3) * width;
    let layer_of = |layer: usize| layer * width..(layer + 1) * width;

    for y in BORDER - 1..=height - BORDER {
        for layer in 0..LAYERS {
            let out = &mut differences[place(layer, y)..][..width];
            widest!((planes.row(layer + 1, y), planes.row(layer, y), out), subtract);
        }
        if y < BORDER + 1 {
            continue;
        }
        let centre = y - 1;
        for layer in 0..LAYERS {
            let rows = [y - 2, y - 1, y].map(|y| &differences[place(layer, y)..][..width]);
            let columns = ([rows; 2], [&mut most[layer_of(layer)], &mut least[layer_of(layer)]]);
            widest!(columns, extremes);
        }
        for layer in 1..=INTERVALS {
            let here = &differences[place(layer, centre)..][..width];
            let layers = [layer - 1, layer, layer + 1].map(layer_of);
            let of_three = [&*most, &*least].map(|all| layers.clone().map(|layer| &all[layer]));
            widest!((of_three, [&mut *largest, &mut *smallest]), extremes);
            widest!((here, &*largest, &*smallest, thresholds.coarse, &mut *marks), mark);
            let inside = &marks[BORDER..width - BORDER];
            for (block, group) in inside.chunks(BLOCK).enumerate() {
                if group.iter().fold(0, |any, mark| any | mark) == 0 {
                    continue;
                }
                for (column, _) in group.iter().enumerate().filter(|(_, mark)| **mark != 0) {
                    let x = BORDER + block * BLOCK + column;
                    if let Some(candidate) = refine(planes, thresholds, x, centre, layer) {
                        found(candidate);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn subtract((upper, lower, out): (&[i16], &[i16], &mut [i16])) {
    for ((out, upper), lower) in out.iter_mut().zip(upper).zip(lower) {
        *out = upper.wrapping_sub(*lower);
    }
}

/// Sample by sample the largest of three rows, and the smallest of three others.
#[inline(always)]
fn extremes(([tops, bottoms], [most, least]): ([[&[i16]; 3]; 2], [&mut [i16]; 2])) {
    let length = most.len();
    let ([a, b, c], [d, e, f]) = (tops.map(|row| &row[..length]), bottoms.map(|row| &row[..length]));
    let least = &mut least[..length];
    for x in 0..length {
        most[x] = a[x].max(b[x]).max(c[x]);
        least[x] = d[x].min(e[x]).min(f[x]);
    }
}

/// Marks the samples of a row that are its layer's extrema among three columns each, and beyond the threshold.
#[inline(always)]
fn mark((here, most, least, coarse, marks): (&[i16], &[i16], &[i16], i16, &mut [i16])) {
    let inside = here.len() - 2;
    let three = |row: &'_ [i16]| [0, 1, 2].map(|shift| shift..row.len() - 2 + shift);
    let ([a, b, c], [d, e, f]) = (three(most).map(|cut| &most[cut]), three(least).map(|cut| &least[cut]));
    let (here, marks) = (&here[1..1 + inside], &mut marks[1..1 + inside]);
    for x in 0..inside {
        let (largest, smallest) = (a[x].max(b[x]).max(c[x]), d[x].min(e[x]).min(f[x]));
        let top = (here[x] == largest) & (here[x] > coarse);
        let bottom = (here[x] == smallest) & (here[x] < -coarse);
        marks[x] = i16::from(top | bottom);
    }
}

/// Fits the quadratic round a candidate; `None` where it has no peak, little contrast, or lies on an edge.
fn refine(
    planes: &Planes,
    thresholds: &Thresholds,
    mut x: usize,
    mut y: usize,
    mut layer: usize,
) -> Option<Candidate> {
    let shifted = |at: usize, by: f32| {
        if by > STEP {
            at + 1
        } else if by < -STEP {
            at - 1
        } else {
            at
        }
    };
    for step in 0..=MAX_STEPS {
        let d = |dx: usize, dy: usize, dl: usize| {
            let (level, row, column) = (layer + dl - 1, y + dy - 1, x + dx - 1);
            f32::from(planes.row(level + 1, row)[column] - planes.row(level, row)[column])
        };
        let centre = d(1, 1, 1);
        let gradient = Vector3::new(
            0.5 * (d(2, 1, 1) - d(0, 1, 1)),
            0.5 * (d(1, 2, 1) - d(1, 0, 1)),
            0.5 * (d(1, 1, 2) - d(1, 1, 0)),
        );
        let xx = d(2, 1, 1) + d(0, 1, 1) - 2.0 * centre;
        let yy = d(1, 2, 1) + d(1, 0, 1) - 2.0 * centre;
        let ll = d(1, 1, 2) + d(1, 1, 0) - 2.0 * centre;
        let xy = 0.25 * (d(2, 2, 1) - d(0, 2, 1) - d(2, 0, 1) + d(0, 0, 1));
        let xl = 0.25 * (d(2, 1, 2) - d(0, 1, 2) - d(2, 1, 0) + d(0, 1, 0));
        let yl = 0.25 * (d(1, 2, 2) - d(1, 0, 2) - d(1, 2, 0) + d(1, 0, 0));
        let hessian = Matrix3::new(xx, xy, xl, xy, yy, yl, xl, yl, ll);
        let offset = solve(&hessian, &gradient)?;

        let settled = offset.amax() <= STEP || (step == MAX_STEPS && offset.amax() <= FARTHEST);
        if settled {
            let response = (centre + 0.5 * gradient.dot(&offset)).abs();
            let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
            let round = determinant > 0.0 && trace * trace < thresholds.edge * determinant;
            return (round && response >= thresholds.contrast).then(|| Candidate {
                x: x as f32 + offset.x,
                y: y as f32 + offset.y,
                level: (layer as f32 + offset.z).clamp(0.5, INTERVALS as f32 + 0.5),
                response: response / (UNIT * 255.0),
                octave: 0,
            });
        }
        (x, y, layer) = (shifted(x, offset.x), shifted(y, offset.y), shifted(layer, offset.z));
        let inside = (BORDER..planes.width - BORDER).contains(&x)
            && (BORDER..planes.height - BORDER).contains(&y)
            && (1..=INTERVALS).contains(&layer);
        if !inside {
            return None;
        }
    }
    None
}

/// −H⁻¹g by the adjugate, or `None` where H is singular.
fn solve(h: &Matrix3<f32>, g: &Vector3<f32>) -> Option<Vector3<f32>> {
    let columns = [h.column(0).into_owned(), h.column(1).into_owned(), h.column(2).into_owned()];
    let [a, b, c] = columns;
    let (bc, ca, ab) = (b.cross(&c), c.cross(&a), a.cross(&b));
    let determinant = a.dot(&bc);
    let offset = -Vector3::new(bc.dot(g), ca.dot(g), ab.dot(g)) / determinant;
    offset.iter().all(|value| value.is_finite()).then_some(offset)
}

//! SIFT: keypoints that survive changes of scale, rotation and light, with a descriptor each.
//!
//! The steps, one file each: a Gaussian pyramid ([`scale_space`](self), `blur`), extrema of its differences
//! (`extrema`), directions (`orientation`), descriptors (`descriptor`). This page holds what a caller needs.
//!
//! | choice | here | why |
//! |---|---|---|
//! | first octave | doubled without a shift: pixel x is sample 2x | the usual half-pixel convention moves all keypoints by 0.25 px |
//! | samples | 16-bit integers, 7 fractional bits | 8 at once in SSE2, the same bits everywhere, half the memory of f32 |
//! | planes smoothed by σ ≥ 2.5 | made on every second sample | they hold nothing finer |
//! | gradients | round keypoints only | less than the whole pyramid's |
//! | descriptors | RootSIFT in bytes | matched with integer products |
//! | too many keypoints | the strongest of every grid cell | spread over the picture, which a homography needs |
//!
//! Memory: [`sift_samples_len`] numbers of 16 bits, about 65 bytes a pixel with the doubled octave and 17
//! without, and one [`Candidate`] for every extremum. Nothing is allocated.
//!
//! Source: D. G. Lowe, "Distinctive image features from scale-invariant keypoints", IJCV 60(2), 2004.
mod blur;
mod descriptor;
mod extrema;
mod gradient;
mod orientation;
mod polar;
mod scale_space;
#[cfg(test)]
mod tests;

use super::Keypoint;
use crate::image::Grey;
use crate::sort::sort_by;
use crate::{Error, Result};
use core::cmp::Ordering;
use nalgebra::Vector2;
use scale_space::{Layout, Planes};

/// 128 bytes: 4 × 4 cells by 8 directions, 512 times a unit vector.
pub type SiftDescriptor = [u8; 128];

/// At most `most` keypoints in every square of `cell_px` pixels: the strongest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridCap {
    /// Side of a cell in pixels.
    pub cell_px: usize,
    /// Keypoints kept in a cell, before directions are given.
    pub most: usize,
}

/// The settings of [`Sift`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiftConfig {
    /// Start from the picture at twice its size: about three times the keypoints, at three times the work.
    pub doubled: bool,
    /// The least contrast of a keypoint, in parts of the grey range, over three scales. Where a picture's grey levels spread less
    /// than 25 about their mean it is less by as much, down to a quarter: what is dim or veiled has as many keypoints.
    pub contrast: f32,
    /// The largest ratio of principal curvatures; above it a keypoint lies on an edge and can slide.
    pub edge: f32,
    /// Whether descriptors are RootSIFT.
    pub root: bool,
    /// A limit that spreads the keypoints over the picture.
    pub grid: Option<GridCap>,
}

impl Default for SiftConfig {
    fn default() -> Self {
        Self { doubled: true, contrast: 0.035, edge: 10.0, root: true, grid: None }
    }
}

/// An extremum of the scale space, before it has a direction. Callers only lend memory for them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Candidate {
    /// In samples of the octave.
    x: f32,
    y: f32,
    /// Layer of the differences and the fraction towards its neighbours.
    level: f32,
    response: f32,
    octave: u8,
}

/// Memory that the caller lends.
#[derive(Debug)]
pub struct SiftWork<'a> {
    /// At least [`sift_samples_len`] numbers; what they hold does not matter.
    pub samples: &'a mut [i16],
    /// As many as extrema are expected, some 1 for 150 pixels; when full, the weaker half is dropped.
    pub candidates: &'a mut [Candidate],
}

/// What [`Sift::detect`] found and what it left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SiftReport {
    /// Keypoints written, a descriptor each.
    pub keypoints: usize,
    /// Octaves of the pyramid; 0 where the picture is too small for one.
    pub octaves: usize,
    /// Extrema that passed the contrast and edge tests.
    pub extrema: usize,
    /// Extrema dropped because the candidates' memory was full.
    pub dropped: usize,
    /// Extrema that the grid left out.
    pub thinned: usize,
    /// Keypoints without room in the output.
    pub truncated: usize,
}

/// The length of [`SiftWork::samples`] for pictures of this size.
///
/// ```
/// use monorange_core::features::{SiftConfig, sift_samples_len};
/// let bytes = 2 * sift_samples_len(320, 240, &SiftConfig::default());
/// assert_eq!(bytes, 4_947_440);
/// ```
pub fn sift_samples_len(width: usize, height: usize, config: &SiftConfig) -> usize {
    let layout = Layout::new(width, height, config.doubled);
    let widest = layout.octaves().first().map_or(0, |octave| octave.width);
    layout.planes_len() + layout.scratch_len().max(extrema::scratch_len(widest))
}

/// A detector with checked settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sift {
    config: SiftConfig,
}

impl Sift {
    /// A detector.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when a threshold is not a finite number above 0 or a grid cell is empty.
    pub fn new(config: SiftConfig) -> Result<Self> {
        let check = |ok: bool, name, value: f64, expected| {
            if ok { Ok(()) } else { Err(Error::OutOfRange { name, value, expected }) }
        };
        let SiftConfig { contrast, edge, .. } = config;
        check(contrast > 0.0 && contrast < 1.0, "sift.contrast", contrast.into(), "between 0 and 1")?;
        check(edge >= 1.0 && edge.is_finite(), "sift.edge", edge.into(), "a finite number of at least 1")?;
        if let Some(grid) = config.grid {
            check(grid.cell_px > 0, "sift.grid.cell_px", 0.0, "above 0")?;
            check(grid.most > 0, "sift.grid.most", 0.0, "above 0")?;
        }
        Ok(Self { config })
    }

    /// Writes the picture's keypoints and their descriptors to the front of two slices, and returns how many.
    ///
    /// A picture under 16 pixels a side (8 with the doubled octave) and one without texture have no keypoints.
    ///
    /// # Errors
    /// [`Error::Size`] when `work.samples` is shorter than [`sift_samples_len`], or the picture has more than
    /// 16,384 pixels a side.
    pub fn detect(
        &self,
        picture: Grey,
        work: &mut SiftWork,
        keypoints: &mut [Keypoint],
        descriptors: &mut [SiftDescriptor],
    ) -> Result<SiftReport> {
        let config = &self.config;
        let (width, height) = (picture.width(), picture.height());
        if width.max(height) > MAX_SIDE {
            return Err(Error::Size { name: "picture", got: width.max(height), expected: MAX_SIDE });
        }
        let expected = sift_samples_len(width, height, config);
        if work.samples.len() < expected {
            return Err(Error::Size { name: "sift work samples", got: work.samples.len(), expected });
        }
        let layout = Layout::new(width, height, config.doubled);
        let (pyramid, scratch) = work.samples.split_at_mut(layout.planes_len());
        scale_space::build(picture, &layout, pyramid, scratch);

        let mut list = CandidateList::new(work.candidates);
        let thresholds = extrema::Thresholds::new(config.contrast * dimness(picture), config.edge);
        for (index, octave) in layout.octaves().iter().enumerate() {
            let planes = Planes::of(octave, pyramid);
            extrema::find(&planes, &thresholds, scratch, |candidate| {
                list.push(Candidate { octave: index as u8, ..candidate });
            });
        }
        let mut report = SiftReport {
            octaves: layout.octaves().len(),
            extrema: list.count + list.dropped,
            dropped: list.dropped,
            ..SiftReport::default()
        };
        let candidates = list.distinct();
        let kept = match config.grid {
            Some(grid) => thin(candidates, &layout, width, grid),
            None => candidates.len(),
        };
        report.thinned = candidates.len() - kept;

        let mut places = keypoints.iter_mut().zip(descriptors);
        for candidate in candidates.iter().take(kept) {
            let Some(octave) = layout.octaves().get(usize::from(candidate.octave)) else { continue };
            let planes = Planes::of(octave, pyramid);
            let pixels = layout.pixels_per_sample(usize::from(candidate.octave));
            let place = [candidate.x, candidate.y];
            let sigma = scale_space::sigma_at(candidate.level, pixels);
            let level = libm::roundf(candidate.level) as usize;
            for turn in orientation::directions(&planes, level, place, sigma) {
                let Some((keypoint, descriptor)) = places.next() else {
                    report.truncated += 1;
                    continue;
                };
                let deviation = POSITION_STD * sigma * pixels;
                *keypoint = Keypoint {
                    pixel: Vector2::new(candidate.x * pixels, candidate.y * pixels),
                    var_px2: deviation * deviation,
                    scale: sigma * pixels,
                    angle: (if turn > 0.5 { turn - 1.0 } else { turn }) * core::f32::consts::TAU,
                    response: candidate.response,
                };
                *descriptor = descriptor::describe(&planes, level, place, sigma, turn, config.root);
                report.keypoints += 1;
            }
        }
        Ok(report)
    }
}

/// Standard deviation of a keypoint's coordinates in parts of its scale: 0.04 to 0.055 on matches of real
/// pictures warped by homographies, with noise of 3 grey levels, from scale 1 to 13 px.
const POSITION_STD: f32 = 0.055;
/// Spread of the grey levels (standard deviation) below which a picture is dim: simulated and rendered drives and photographs have
/// 27 to 67 but for a few pictures that face a wall.
const DIM_SPREAD: f32 = 25.0;
/// The least share of the contrast that is asked for: in a picture of one grey level it is noise that is left.
const LEAST_SHARE: f32 = 0.25;

/// The share of the contrast that a keypoint must have in a picture as dim as this.
fn dimness(picture: Grey) -> f32 {
    let (mut sum, mut squares) = (0_u64, 0_u64);
    for pixel in picture.pixels() {
        let grey = u64::from(*pixel);
        sum += grey;
        squares += grey * grey;
    }
    let count = picture.pixels().len().max(1) as f64;
    let mean = sum as f64 / count;
    let spread = libm::sqrt((squares as f64 / count - mean * mean).max(0.0)) as f32;
    (spread / DIM_SPREAD).clamp(LEAST_SHARE, 1.0)
}

/// Larger pictures have more octaves than the layout.
const MAX_SIDE: usize = 16_384;

/// A list in lent memory that keeps the strongest when it is full.
struct CandidateList<'a> {
    memory: &'a mut [Candidate],
    count: usize,
    dropped: usize,
    /// Weaker ones are dropped at once.
    floor: f32,
}

impl<'a> CandidateList<'a> {
    fn new(memory: &'a mut [Candidate]) -> Self {
        Self { memory, count: 0, dropped: 0, floor: 0.0 }
    }

    fn push(&mut self, candidate: Candidate) {
        if self.count == self.memory.len() {
            self.drop_weaker_half();
        }
        match self.memory.get_mut(self.count) {
            Some(place) if candidate.response >= self.floor => {
                *place = candidate;
                self.count += 1;
            }
            _ => self.dropped += 1,
        }
    }

    fn drop_weaker_half(&mut self) {
        let half = self.count / 2;
        if half == 0 {
            return;
        }
        sort(self.memory, &stronger);
        self.floor = self.memory.get(half).map_or(self.floor, |median| median.response);
        self.dropped += self.count - half;
        self.count = half;
    }

    /// The candidates by octave and rows, each once: neighbours can settle at the same extremum.
    fn distinct(self) -> &'a mut [Candidate] {
        let count = self.count;
        let (candidates, _) = self.memory.split_at_mut(count);
        sort(candidates, &by_place);
        let mut kept = 0;
        for index in 0..candidates.len() {
            let Some(&candidate) = candidates.get(index) else { break };
            let again = kept > 0 && candidates.get(kept - 1) == Some(&candidate);
            if !again && let Some(place) = candidates.get_mut(kept) {
                *place = candidate;
                kept += 1;
            }
        }
        candidates.split_at_mut(kept).0
    }
}

/// One sort for every order.
fn sort(candidates: &mut [Candidate], order: &dyn Fn(&Candidate, &Candidate) -> Ordering) {
    sort_by(candidates, |one, other| order(one, other) == Ordering::Greater);
}

fn by_place(a: &Candidate, b: &Candidate) -> Ordering {
    (a.octave.cmp(&b.octave))
        .then(a.y.total_cmp(&b.y))
        .then(a.x.total_cmp(&b.x))
        .then(a.level.total_cmp(&b.level))
}

fn stronger(a: &Candidate, b: &Candidate) -> Ordering {
    b.response.total_cmp(&a.response).then(by_place(a, b))
}

/// Moves the strongest of every cell to the front, in order of place, and returns how many there are.
fn thin(candidates: &mut [Candidate], layout: &Layout, width: usize, grid: GridCap) -> usize {
    let columns = width.div_ceil(grid.cell_px);
    let cell = |candidate: &Candidate| {
        let pixels = layout.pixels_per_sample(usize::from(candidate.octave));
        let index = |value: f32| (value * pixels) as usize / grid.cell_px;
        index(candidate.y) * columns + index(candidate.x)
    };
    sort(candidates, &|a, b| cell(a).cmp(&cell(b)).then(stronger(a, b)));
    let (mut kept, mut current, mut in_cell) = (0, usize::MAX, 0);
    for index in 0..candidates.len() {
        let Some(&candidate) = candidates.get(index) else { break };
        let here = cell(&candidate);
        in_cell = if here == current { in_cell + 1 } else { 1 };
        current = here;
        if in_cell <= grid.most {
            candidates.swap(kept, index);
            kept += 1;
        }
    }
    if let Some(front) = candidates.get_mut(..kept) {
        sort(front, &by_place);
    }
    kept
}

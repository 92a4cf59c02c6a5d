use super::candidate::{Candidate, Measure};
use super::config::ProposalConfig;
use super::decision::{self, Ranked};
use super::edge::EdgePoint;
use super::edge_list::EdgeList;
use super::edge_search::EdgeSearch;
use super::extraction::{Extraction, MAX_PROPOSALS};
use super::features::{CONTEXT_SIDE, PATCH_SIDE};
use super::foot::{Feet, Foot, Rows};
use super::kink::kinks;
use super::memory::{KEPT_ROWS, mask_words, row_words, rows};
use super::proposal::{Members, Proposal, locate, seen};
use super::scale::Scale;
use super::score;
use super::vertical::{Vertical, verticals};
use super::view::View;
use crate::geometry::{Camera, RangeFinder};
use crate::image::{GradientLevel, GradientRows, Grey, GreyMemory, MARGIN, NoiseLevel, add_binned, mask_len};
use crate::lines::edge::unit;
use crate::lines::fit::Sampling;
use crate::lines::lens::LensGrid;
use crate::{Error, Result};
use heapless::Vec;
use nalgebra::Vector2;

/// Rows from one measurement of the noise to the next.
const NOISE_ROWS: usize = 16;
/// Rows from one measurement of the gradient's level to the next.
const LEVEL_ROWS: usize = 8;
/// A foot at a bend lies so near to it, and no other proposal does, units.
const BEND_UNITS: f32 = 2.5;
/// The largest number of pixels that are made one, along either side.
const MAX_BINNING: usize = 16;

/// Finds floor corners in pictures that come row by row.
///
/// Its memory is lent: `R` holds 16-bit words ([`row_words`](super::row_words)), `M` 32-bit ones ([`mask_words`]), `P` edge points
/// ([`point_count`](super::point_count)). Arrays on a microcontroller, `Vec`s on a host.
///
/// ```
/// use monorange_core::geometry::{Camera, Mount, RangeFinder};
/// use monorange_core::image::Grey;
/// use monorange_core::proposals::{EdgePoint, ProposalConfig, Extractor, mask_words, point_count, row_words};
/// const W: usize = 160;
/// const H: usize = 120;
/// // A wall's edge at u = 80 comes down to the floor at v = 70.
/// let pixels: Vec<u8> =
///     (0..W * H).map(|k| if k / W > 70 { 60 } else if k % W > 80 { 180 } else { 120 }).collect();
/// let camera = Camera::new(W, H, [180.0, 180.0], [80.0, 60.0], 0.0, Default::default())?;
/// let finder = RangeFinder::new(camera, Mount::new([0.4, 0.1, 0.0, 0.0, 0.0, 0.0])?);
/// let mut extractor = Extractor::new(
///     ProposalConfig::default(),
///     finder,
///     [0; row_words(W, H)],
///     [0; mask_words(W)],
///     [EdgePoint::default(); point_count(W, H)],
/// )?;
/// let found = extractor.extract(Grey::new(&pixels, W, H)?)?;
/// let proposed = &found.proposals[0];
/// assert!((proposed.pixel - nalgebra::Vector2::new(80.5, 70.5)).norm() < 0.1);
/// # Ok::<(), monorange_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Extractor<R, M, P> {
    config: ProposalConfig,
    finder: RangeFinder<f32>,
    /// The picture that is searched; `binning` × `binning` of the camera's pixels are one of its.
    view: View,
    binning: usize,

    words: R,
    masks: M,
    points: P,

    /// The camera's row that comes next.
    row: usize,
    noise: NoiseLevel,
    level: GradientLevel,
    edges: EdgeList,
    finished: bool,
    extraction: Extraction,
}

impl<R, M, P> Extractor<R, M, P>
where
    R: AsRef<[u16]> + AsMut<[u16]>,
    M: AsRef<[u32]> + AsMut<[u32]>,
    P: AsRef<[EdgePoint]> + AsMut<[EdgePoint]>,
{
    /// An extractor for the pictures of `finder`'s camera, ready for the first row.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an unusable configuration; [`Error::Size`] when `words` holds fewer than [`row_words`] for the
    /// picture that is searched, `masks` fewer than [`mask_words`], or `points` none or more than 65 535.
    pub fn new(
        config: ProposalConfig,
        finder: RangeFinder<f32>,
        words: R,
        mut masks: M,
        points: P,
    ) -> Result<Self> {
        let config = config.validated()?;
        let (binned, binning) = binned(&finder, config.max_focal_px)?;
        let (width, height) = (binned.camera().width(), binned.camera().height());
        let at_least = |name, got: usize, expected: usize| {
            if got >= expected { Ok(()) } else { Err(Error::Size { name, got, expected }) }
        };
        let capacity = points.as_ref().len();
        at_least("extractor.points", capacity, 1)?;
        if capacity > 65_535 {
            return Err(Error::Size { name: "extractor.points", got: capacity, expected: 65_535 });
        }
        let sums = if binning > 1 { width + width.div_ceil(2) } else { 0 };
        at_least("extractor.words", words.as_ref().len(), row_words(width, height) + sums)?;
        at_least("extractor.masks", masks.as_ref().len(), mask_words(width))?;
        let (_, grid) = masks.as_mut().split_at_mut(mask_len(width));
        LensGrid::write(binned.camera(), grid);
        let mut extractor = Self {
            config,
            finder,
            view: View::new(binned),
            binning,
            words,
            masks,
            points,
            row: 0,
            noise: NoiseLevel::default(),
            level: GradientLevel::default(),
            edges: EdgeList::default(),
            finished: false,
            extraction: Extraction::default(),
        };
        extractor.begin();
        Ok(extractor)
    }

    /// The configuration.
    pub fn config(&self) -> &ProposalConfig {
        &self.config
    }

    /// The memory that it was lent.
    pub fn into_memory(self) -> (R, M, P) {
        (self.words, self.masks, self.points)
    }

    /// The 16-bit words it was lent, for any use between pictures: nothing is kept there, and a picture that has begun is
    /// forgotten.
    pub fn scratch(&mut self) -> &mut [u16] {
        self.begin();
        self.words.as_mut()
    }

    /// Forgets the rows so far: the next one is the first of a picture.
    pub fn begin(&mut self) {
        self.row = 0;
        self.noise = NoiseLevel::default();
        self.level = GradientLevel::default();
        self.edges = EdgeList::default();
        self.finished = false;
        self.extraction = Extraction::default();
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// [`Error::Size`] when the row has not the camera's width, or the picture is already complete.
    pub fn push_row(&mut self, pixels: &[u8]) -> Result<()> {
        let camera = self.finder.camera();
        let (width, height) = (camera.width(), camera.height());
        if pixels.len() != width {
            return Err(Error::Size { name: "row", got: pixels.len(), expected: width });
        }
        if self.row >= height {
            return Err(Error::Size { name: "rows", got: self.row + 1, expected: height });
        }
        let newest = self.row;
        self.row += 1;
        let narrow = self.view.camera().width();
        let Some((buffers, grey, rest)) = split(self.words.as_mut(), &self.view) else { return Ok(()) };
        let mut add = |row: usize, pixels: &[u8]| {
            if row.is_multiple_of(NOISE_ROWS) {
                self.noise.add_row(pixels);
            }
            if let Some(mut grey) = GreyMemory::new(grey, narrow, self.view.camera().height()) {
                grey.push(row, pixels);
            }
            let mut edges = RowEdges {
                config: &self.config,
                view: &self.view,
                buffers,
                masks: self.masks.as_mut(),
                points: self.points.as_mut(),
                level: &mut self.level,
                edges: &mut self.edges,
            };
            edges.take(row, pixels);
        };
        if self.binning == 1 {
            add(newest, pixels);
            return Ok(());
        }
        let Some((sums, means)) = rest.split_at_mut_checked(narrow) else { return Ok(()) };
        let (row, part) = (newest / self.binning, newest % self.binning);
        if part == 0 {
            sums.fill(0);
        }
        add_binned(pixels, self.binning, sums);
        if part + 1 == self.binning && row < self.view.camera().height() {
            // The means are bytes, two to a word: the sums' own words are done with.
            let area = (self.binning * self.binning) as u32;
            let means: &mut [u8] = bytemuck::cast_slice_mut(means);
            for (mean, sum) in means.iter_mut().zip(&*sums) {
                *mean = ((u32::from(*sum) + area / 2) / area) as u8;
            }
            add(row, means.get(..narrow).unwrap_or_default());
        }
        Ok(())
    }

    /// What the picture gave, after its last row.
    ///
    /// # Errors
    /// [`Error::Size`] when rows are missing.
    pub fn finish(&mut self) -> Result<&Extraction> {
        self.finish_and(&mut |_: &Candidate| ())
    }

    /// [`finish`](Self::finish), which shows every candidate that was judged, likely or not; none when the picture was finished
    /// before.
    ///
    /// # Errors
    /// [`Error::Size`] when rows are missing.
    pub fn finish_and(&mut self, show: &mut dyn FnMut(&Candidate)) -> Result<&Extraction> {
        let height = self.finder.camera().height();
        if self.row != height {
            return Err(Error::Size { name: "rows", got: self.row, expected: height });
        }
        if !self.finished {
            self.finished = true;
            self.extraction.edge_points = self.edges.found;
            self.extraction.noise_std = self.noise.std();
            self.find(show);
        }
        Ok(&self.extraction)
    }

    /// What the last picture gave, as far as it was [finished](Self::finish).
    pub fn extraction(&self) -> &Extraction {
        &self.extraction
    }

    /// What a whole picture gives: a loop over its rows.
    ///
    /// # Errors
    /// [`Error::Size`] when the picture has not the camera's size.
    pub fn extract(&mut self, picture: Grey<'_>) -> Result<&Extraction> {
        self.begin();
        for row in picture.rows() {
            self.push_row(row)?;
        }
        self.finish()
    }

    /// Where an ideal camera would see the edge points kept, and which way each gets brighter, rad from u to v; after
    /// [`finish`](Self::finish).
    pub fn edge_points(&self) -> impl Iterator<Item = (Vector2<f32>, f32)> {
        let points = self.points.as_ref().get(..self.edges.len).unwrap_or_default();
        let scale = self.scale();
        points.iter().map(move |point| (scale.ideal(point.place()), point.direction()))
    }

    /// From the picture searched to the camera's.
    fn scale(&self) -> Scale {
        Scale::new(&self.view, self.binning)
    }

    /// The proposals and corners of the edge points.
    fn find(&mut self, show: &mut dyn FnMut(&Candidate)) {
        let gradient_noise = self.level.std();
        let threshold = threshold(&self.config, gradient_noise);
        self.extraction.threshold = threshold;
        // Rows were searched with what the rows above them said.
        self.edges.retain(self.points.as_mut(), |point| point.gradient() >= threshold);
        let mut extraction = core::mem::take(&mut self.extraction);
        extraction.truncations.edge_points = self.edges.lost;
        let points = self.points.as_ref().get(..self.edges.len).unwrap_or_default();
        let rows = Rows::new(points);
        let sampling = Sampling { noise_std: extraction.noise_std, stride: 1 };
        let camera = self.view.camera();
        let size = Vector2::new(camera.width() as f32, camera.height() as f32);
        let all = verticals(points, &self.view, self.config.gravity_tolerance);
        extraction.truncations.lines = all.lost;
        let Some((buffers, grey, _)) = split(self.words.as_mut(), &self.view) else { return };
        let bends = kinks(points, buffers, &self.view);
        let Some(grey) = GreyMemory::new(grey, camera.width(), camera.height()) else { return };
        let measure = Measure { view: &self.view, points, rows: &rows, grey: &grey, gradient_noise, size };
        let (mut ranked, scale) = (Ranked::default(), Scale::new(&self.view, self.binning));
        let bends = bends.iter().map(|(_, bend)| bend);
        for vertical in all.found.iter().chain(bends) {
            let feet = Feet::new(vertical, points, &rows, &self.view, &self.config);
            let at_bend = vertical.points() == 0.0;
            let members = Members::new(vertical, points, &rows);
            let strip = measure.strip(vertical, &feet);
            for foot in &feet.found {
                if at_bend && !is_bend(&self.view, &feet, foot, &ranked, vertical) {
                    continue;
                }
                let Some((features, place, frame)) = measure.features(vertical, &feet, &strip, foot) else {
                    continue;
                };
                if features.depression < self.config.min_depression {
                    continue;
                }
                let Some((place, covariance, brighter_below)) =
                    locate(vertical, &feet, foot, points, &members, sampling)
                        .filter(|(located, ..)| (located - place).norm_squared() < 9.0)
                else {
                    continue;
                };
                let Some((pixel, covariance)) = seen(&self.view, place, covariance) else { continue };
                let mut candidate = Candidate {
                    proposal: Proposal {
                        pixel,
                        ideal: place,
                        covariance,
                        probability: 0.0,
                        range: features.range,
                        brighter_right: !at_bend && unit(vertical.direction).dot(&vertical.right()) > 0.0,
                        brighter_below,
                        ends: ends(&self.view, vertical, &feet, foot),
                    },
                    features,
                    patch: [0; PATCH_SIDE * PATCH_SIDE],
                    context: [0; CONTEXT_SIDE * CONTEXT_SIDE],
                };
                let height = self.view.finder.mount().height();
                let distance = libm::sqrtf(features.range * features.range + height * height);
                frame.patch(distance, &mut candidate.patch);
                frame.context(&mut candidate.context);
                candidate.proposal.probability =
                    score::probability(&features, &candidate.patch, &candidate.context);
                ranked.add(candidate.proposal);
                candidate.proposal = scale.proposal(candidate.proposal);
                show(&candidate);
            }
        }
        let places: Vec<Vector2<f32>, MAX_PROPOSALS> = ranked.found.iter().map(|one| one.ideal).collect();
        let (corners, lost) = decision::corners(
            &ranked.found,
            &places,
            &self.view,
            self.config.skirting_height,
            self.config.min_probability,
        );
        extraction.truncations.proposals = ranked.lost;
        extraction.truncations.corners = lost;
        extraction.proposals = ranked.found.iter().map(|one| scale.proposal(*one)).collect();
        extraction.corners = corners;
        for corner in &mut extraction.corners {
            corner.pixel = scale.pixel(corner.pixel);
            corner.covariance = scale.covariance(corner.covariance);
        }
        self.lines(&all.found, &rows, sampling, &mut extraction);
        self.extraction = extraction;
    }

    /// The vertical edges as lines of the camera's picture.
    fn lines(&self, found: &[Vertical], rows: &Rows, sampling: Sampling, extraction: &mut Extraction) {
        let points = self.points.as_ref().get(..self.edges.len).unwrap_or_default();
        let (factor, scale) = (self.binning as f32, self.scale());
        for vertical in found {
            let Some(mut line) = Members::new(vertical, points, rows).line(vertical, None, sampling) else {
                continue;
            };
            let pixel = |place: Vector2<f32>| {
                scale.pixel(self.view.pixel(place).unwrap_or(place + self.view.principal))
            };
            let [first, last] = line.extent.map(|end| pixel(line.centroid + line.along() * end));
            line.ends = if first.y <= last.y { [first, last] } else { [last, first] };
            line.centroid = scale.ideal(line.centroid);
            line.extent = line.extent.map(|end| end * factor);
            line.var_position_px2 *= factor * factor;
            line.residual_px *= factor;
            line.width_px *= factor;
            if extraction.vertical_lines.push(line).is_err() {
                extraction.truncations.lines += 1;
            }
        }
    }
}

/// The far ends of a foot's floor lines, in the picture searched.
fn ends(view: &View, vertical: &Vertical, feet: &Feet, foot: &Foot) -> [Vector2<f32>; 2] {
    let outwards = [-vertical.right(), vertical.right()];
    let mut ends = [Vector2::repeat(f32::NAN); 2];
    for ((side, outwards), end) in feet.sides_of(foot).into_iter().zip(outwards).zip(&mut ends) {
        let Some(side) = side else { continue };
        let depth = side.crossing + side.end * side.along.y / side.along.x;
        if let Some(pixel) = view.pixel(feet.origin + outwards * side.end + vertical.along * depth) {
            *end = pixel;
        }
    }
    ends
}

/// Whether a foot below a bend is the bend, with an edge on either side, and not yet proposed as the foot of an edge.
fn is_bend(view: &View, feet: &Feet, foot: &Foot, ranked: &Ranked, bend: &Vertical) -> bool {
    let near = BEND_UNITS * view.unit.max(0.7);
    let place = feet.origin + bend.along * foot.below;
    let taken = || ranked.found.iter().any(|one| (one.ideal - place).norm_squared() < near * near);
    foot.left.is_some() && foot.right.is_some() && foot.below.abs() <= near && !taken()
}

/// Least gradient of an edge, grey levels per pixel.
fn threshold(config: &ProposalConfig, gradient_noise: f32) -> f32 {
    (config.edge_noise * gradient_noise).max(config.edge_threshold)
}

/// The camera of pictures made smaller until their focal length is not above `most`, on the same mount; and by how many.
fn binned(finder: &RangeFinder<f32>, most: f32) -> Result<(RangeFinder<f32>, usize)> {
    let camera = finder.camera();
    let focal = 0.5 * (camera.focal().x + camera.focal().y);
    let binning = (libm::ceilf(focal / most) as usize).clamp(1, MAX_BINNING);
    let (width, height) = (camera.width() / binning, camera.height() / binning);
    if binning == 1 || width == 0 || height == 0 {
        return Ok((*finder, 1));
    }
    let factor = binning as f32;
    let principal = (camera.principal() - Vector2::repeat(0.5 * (factor - 1.0))) / factor;
    let camera = Camera::with_lens(
        width,
        height,
        (camera.focal() / factor).into(),
        principal.into(),
        camera.skew(),
        *camera.lens(),
    )?;
    Ok((RangeFinder::new(camera, *finder.mount()), binning))
}

/// Line buffers, what the picture looked like, and the rest.
fn split<'a>(words: &'a mut [u16], view: &View) -> Option<(&'a mut [u16], &'a mut [u16], &'a mut [u16])> {
    let camera = view.camera();
    let (buffers, rest) = words.split_at_mut_checked(rows(camera.width()))?;
    let (grey, rest) = rest.split_at_mut_checked(GreyMemory::words(camera.width(), camera.height()))?;
    Some((buffers, grey, rest))
}

/// What turns rows of the picture searched into edge points.
struct RowEdges<'a> {
    config: &'a ProposalConfig,
    view: &'a View,
    buffers: &'a mut [u16],
    masks: &'a mut [u32],
    points: &'a mut [EdgePoint],
    level: &'a mut GradientLevel,
    edges: &'a mut EdgeList,
}

impl RowEdges<'_> {
    /// Takes a row and finds the edge points that are known with it.
    fn take(&mut self, newest: usize, pixels: &[u8]) {
        let camera = self.view.camera();
        let width = camera.width();
        let (mask, grid) = self.masks.split_at_mut(mask_len(width));
        let Some(mut rows) = GradientRows::new(self.buffers, width, KEPT_ROWS) else { return };
        rows.push(newest, pixels);
        let Some(row) = newest.checked_sub(MARGIN).filter(|row| *row >= MARGIN) else { return };
        let (along_u, along_v) = rows.gradient(row);
        if row.is_multiple_of(LEVEL_ROWS) || row == MARGIN {
            self.level.add_row(along_u, along_v);
        }
        let Some(centre) = row.checked_sub(1).filter(|centre| *centre > MARGIN) else { return };
        let gradient_noise = self.level.std();
        let search = EdgeSearch {
            view: self.view,
            lens: LensGrid::new(camera, grid),
            threshold: threshold(self.config, gradient_noise),
            gradient_noise,
        };
        let rows = [centre - 1, centre, centre + 1].map(|row| rows.gradient(row));
        search.row(centre, rows, mask, self.points, self.edges);
    }
}

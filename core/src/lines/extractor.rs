use super::config::ExtractConfig;
use super::corner::{CornerSearch, FLOOR_OWNER, VERTICAL_OWNER};
use super::edge::{EdgeList, EdgePoint, STEPS};
use super::edge_search::{EdgeSearch, FLOOR, VERTICAL};
use super::extraction::{Extraction, Line};
use super::fit::Sampling;
use super::hough::Pass;
use super::lens::LensGrid;
use super::memory::{kept_rows, mask_words, row_masks};
use super::search::{Search, WORDS_BY_POINT};
use crate::geometry::RangeFinder;
use crate::image::{
    GRADIENT_SCALE, GradientRows, Grey, MARGIN, NoiseLevel, OpeningRows, line_buffers, mask_len,
    threshold_row,
};
use crate::{Error, Result};
use core::borrow::BorrowMut;
use nalgebra::Vector2;

/// Rows from one measurement of the noise to the next.
const NOISE_ROWS: usize = 16;

/// Finds floor corners in pictures that come row by row.
///
/// Its memory is lent: `R` holds 16-bit words ([`row_words`](super::row_words)), `M` 32-bit ones ([`mask_words`]), `P` edge points
/// ([`point_count`](super::point_count)). Arrays on a microcontroller, `Vec`s on a host. What it finds is its own, or lent too: `E`.
///
/// ```
/// use monorange_core::geometry::{Camera, Mount, RangeFinder};
/// use monorange_core::image::Grey;
/// use monorange_core::lines::{EdgePoint, ExtractConfig, Extractor, mask_words, point_count, row_words};
/// const W: usize = 160;
/// const H: usize = 120;
/// // A wall's edge at u = 80 comes down to the floor at v = 70.
/// let pixels: Vec<u8> =
///     (0..W * H).map(|k| if k / W > 70 { 60 } else if k % W > 80 { 180 } else { 120 }).collect();
/// let camera = Camera::new(W, H, [180.0, 180.0], [80.0, 60.0], 0.0, Default::default())?;
/// let finder = RangeFinder::new(camera, Mount::new([0.4, 0.1, 0.0, 0.0, 0.0, 0.0])?);
/// let mut extractor = Extractor::new(
///     ExtractConfig::default(),
///     finder,
///     [0; row_words(W, H)],
///     [0; mask_words(W)],
///     [EdgePoint::default(); point_count(W, H)],
/// )?;
/// let found = extractor.extract(Grey::new(&pixels, W, H)?)?;
/// assert_eq!(found.corners.len(), 1);
/// assert!((found.corners[0].pixel - nalgebra::Vector2::new(80.5, 70.5)).norm() < 0.1);
/// # Ok::<(), monorange_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Extractor<R, M, P, E = Extraction> {
    config: ExtractConfig,
    finder: RangeFinder<f32>,
    /// What an edge with this gradient direction can be: [`VERTICAL`], [`FLOOR`], or nothing.
    kinds: [u8; 256],
    passes: [[Pass; 2]; 2],
    threshold: u16,
    /// First row of the region of interest.
    floor_top: usize,
    /// Origin of the Hough transform and largest distance from it.
    origin: Vector2<f32>,
    radius: f32,

    words: R,
    masks: M,
    points: P,

    /// The row that comes next.
    row: usize,
    noise: NoiseLevel,
    edges: EdgeList,
    extraction: E,
}

#[cfg(feature = "alloc")]
impl Extractor<alloc::vec::Vec<u16>, alloc::vec::Vec<u32>, alloc::vec::Vec<EdgePoint>> {
    /// As [`new`](Self::new), in `Vec`s of the size that the camera's pictures need.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn on_heap(config: ExtractConfig, finder: RangeFinder<f32>) -> Result<Self> {
        let (width, height) = (finder.camera().width(), finder.camera().height());
        let words = alloc::vec![0; super::row_words(width, height)];
        let points = alloc::vec![EdgePoint::default(); super::point_count(width, height)];
        Self::new(config, finder, words, alloc::vec![0; super::mask_words(width)], points)
    }
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
    /// [`Error::OutOfRange`] for an unusable configuration; [`Error::Size`] when `words` holds fewer than 24 words
    /// a column (for an opening by 5) or 3 an edge point, `masks` fewer than [`mask_words`], or `points` none or more than 65 535.
    pub fn new(
        config: ExtractConfig,
        finder: RangeFinder<f32>,
        words: R,
        masks: M,
        points: P,
    ) -> Result<Self> {
        Self::with(config, finder, words, masks, points, Extraction::default())
    }
}

impl<R, M, P, E> Extractor<R, M, P, E>
where
    R: AsRef<[u16]> + AsMut<[u16]>,
    M: AsRef<[u32]> + AsMut<[u32]>,
    P: AsRef<[EdgePoint]> + AsMut<[EdgePoint]>,
    E: BorrowMut<Extraction>,
{
    /// As [`new`](Extractor::new), with memory for what it finds as well: the largest part of an extractor, which then is not
    /// moved with it.
    ///
    /// # Errors
    /// As [`new`](Extractor::new).
    pub fn with(
        config: ExtractConfig,
        finder: RangeFinder<f32>,
        words: R,
        mut masks: M,
        points: P,
        extraction: E,
    ) -> Result<Self> {
        let config = config.validated()?;
        let camera = *finder.camera();
        let at_least = |name, got: usize, expected: usize| {
            if got >= expected { Ok(()) } else { Err(Error::Size { name, got, expected }) }
        };
        let capacity = points.as_ref().len();
        at_least("extractor.points", capacity, 1)?;
        if capacity > 65_535 {
            return Err(Error::Size { name: "extractor.points", got: capacity, expected: 65_535 });
        }
        at_least(
            "extractor.words",
            words.as_ref().len(),
            (line_buffers(kept_rows(config.opening)) * camera.width()).max(WORDS_BY_POINT * capacity),
        )?;
        at_least("extractor.masks", masks.as_ref().len(), mask_words(camera.width()))?;

        let (_, grid) = masks.as_mut().split_at_mut(row_masks(camera.width()));
        LensGrid::write(&camera, grid);
        let lens = LensGrid::new(&camera, grid);
        let floor_top = libm::ceilf(config.floor_top * camera.height() as f32) as usize;
        let (origin, radius) = extent(&lens, camera.width(), camera.height());
        let mut extractor = Self {
            config,
            finder,
            kinds: [0; 256],
            passes: passes(&config),
            threshold: (config.edge_threshold * GRADIENT_SCALE) as u16,
            floor_top,
            origin,
            radius,
            words,
            masks,
            points,
            row: 0,
            noise: NoiseLevel::default(),
            edges: EdgeList::new(),
            extraction,
        };
        for (passes, kind) in extractor.passes.into_iter().zip([VERTICAL, FLOOR]) {
            for (direction, kinds) in (0_u8..=255).zip(&mut extractor.kinds) {
                let of_kind = passes.iter().any(|pass| pass.bin(direction).is_some());
                *kinds |= if of_kind { kind } else { 0 };
            }
        }
        extractor.begin();
        Ok(extractor)
    }

    /// The configuration.
    pub fn config(&self) -> &ExtractConfig {
        &self.config
    }

    /// The memory that it was lent.
    pub fn into_memory(self) -> (R, M, P, E) {
        (self.words, self.masks, self.points, self.extraction)
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
        self.edges = EdgeList::new();
        self.extraction.borrow_mut().clear();
        let (rows, _) = self.masks.as_mut().split_at_mut(row_masks(self.finder.camera().width()));
        rows.fill(0);
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
        if newest.is_multiple_of(NOISE_ROWS) {
            self.noise.add_row(pixels);
        }
        if width <= 2 * (MARGIN + 1) {
            return Ok(()); // too narrow for a maximum between two neighbours
        }
        self.find_edges(newest, Some(pixels));
        Ok(())
    }

    /// What the picture gave, after its last row.
    ///
    /// # Errors
    /// [`Error::Size`] when rows are missing.
    pub fn finish(&mut self) -> Result<&Extraction> {
        let height = self.finder.camera().height();
        if self.row != height {
            return Err(Error::Size { name: "rows", got: self.row, expected: height });
        }
        if self.extraction.borrow().noise_std > 0.0 {
            return Ok(self.extraction.borrow()); // asked before
        }
        if self.finder.camera().width() > 2 * (MARGIN + 1) {
            // Rows without edges push the last ones out of the opening.
            (height..height + self.config.opening - 1).for_each(|newest| self.find_edges(newest, None));
        }
        let camera = self.finder.camera();
        let (_, grid) = self.masks.as_ref().split_at(row_masks(camera.width()));
        self.edges.undistort(self.points.as_mut(), &LensGrid::new(camera, grid));
        let extraction = self.extraction.borrow_mut();
        extraction.edge_points = self.edges.found;
        extraction.noise_std = self.noise.std();
        extraction.truncations.edge_stride = self.edges.stride;
        self.find_lines();
        Ok(self.extraction.borrow())
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

    /// The edge points kept, after [`finish`](Self::finish).
    pub fn edge_points(&self) -> &[EdgePoint] {
        self.points.as_ref().get(..self.edges.len).unwrap_or_default()
    }

    /// Takes the pixels of row `newest`, or `None` below the picture, and finds the edge points that are known with it.
    fn find_edges(&mut self, newest: usize, pixels: Option<&[u8]>) {
        let camera = self.finder.camera();
        let (width, run) = (camera.width(), self.config.opening);
        let (masks, flat) = self.masks.as_mut().split_at_mut(OpeningRows::words(width));
        let (Some(mut rows), Some(mut opening), Some(flat)) = (
            GradientRows::new(self.words.as_mut(), width, kept_rows(run)),
            OpeningRows::new(masks, width, run),
            flat.get_mut(..mask_len(width)),
        ) else {
            return;
        };
        if let Some(pixels) = pixels {
            rows.push(newest, pixels);
        }
        let Some(row) = newest.checked_sub(MARGIN).filter(|row| *row >= MARGIN) else { return };
        let steep = opening.push(row, |strong| match pixels {
            Some(_) => threshold_row(rows.gradient(row).0, self.threshold, strong),
            None => strong.fill(0),
        });
        // A maximum is one between two neighbours.
        if let Some(centre) =
            row.checked_sub(run).filter(|row| *row > MARGIN && row + MARGIN + 1 < camera.height())
        {
            let search =
                EdgeSearch { kinds: &self.kinds, threshold: self.threshold, run, floor_top: self.floor_top };
            let rows = [centre - 1, centre, centre + 1].map(|row| rows.gradient(row));
            search.row(centre, steep, rows, flat, self.points.as_mut(), &mut self.edges);
        }
    }

    /// The lines and corners of the edge points.
    fn find_lines(&mut self) {
        let camera = self.finder.camera();
        let height = camera.height() as f32;
        let extraction = self.extraction.borrow_mut();
        let sampling = Sampling { noise_std: extraction.noise_std, stride: self.edges.stride };
        let points = self.points.as_mut().get_mut(..self.edges.len).unwrap_or_default();
        let words = self.words.as_mut();
        let mut search = Search {
            config: &self.config,
            sampling,
            origin: self.origin,
            radius: self.radius,
            min_length: self.config.min_vertical_length * height,
            first_owner: VERTICAL_OWNER,
        };
        let mut truncations = extraction.truncations;
        let upright = |line: &Line| is_upright(&self.finder, line, self.config.gravity_tolerance);
        let [vertical_passes, floor_passes] = self.passes;
        for pass in vertical_passes {
            let skipped = search.run(&pass, points, words, &mut extraction.vertical_lines, &upright);
            truncations.peaks += skipped.peaks;
            truncations.lines += skipped.lines;
        }
        search.min_length = self.config.min_floor_length * height;
        search.first_owner = FLOOR_OWNER;
        let sharp = |line: &Line| line.width_px <= self.config.max_width_px;
        for pass in floor_passes {
            let skipped = search.run(&pass, points, words, &mut extraction.floor_lines, &sharp);
            truncations.peaks += skipped.peaks;
            truncations.lines += skipped.lines;
        }
        extraction.truncations = truncations;
        let finder = &self.finder;
        let corners = CornerSearch { config: &self.config, finder, top: self.floor_top as f32, sampling };
        corners.run(points, words, extraction);

        let pixel = |ideal| camera.pixel_from_ray(camera.ray_from_ideal(ideal)).unwrap_or(ideal);
        let lines = extraction.vertical_lines.iter_mut().map(|line| (line, true));
        for (line, upright) in lines.chain(extraction.floor_lines.iter_mut().map(|line| (line, false))) {
            let [first, last] = line.extent.map(|end| pixel(line.centroid + line.along() * end));
            let ordered = if upright { first.y <= last.y } else { first.x <= last.x };
            line.ends = if ordered { [first, last] } else { [last, first] };
        }
    }
}

/// The passes of the Hough transform for the vertical edges and for the floor's, brighter on one side or the other.
fn passes(config: &ExtractConfig) -> [[Pass; 2]; 2] {
    let steps = |angle: f32| libm::ceilf(angle * (STEPS / core::f32::consts::TAU)) as u8;
    let reach = steps(config.direction_tolerance) / 2;
    let pass = |centre, spread| Pass { centre, spread: steps(spread), reach };
    [[0, 128].map(|c| pass(c, config.vertical_spread)), [64, 192].map(|c| pass(c, config.floor_spread))]
}

/// Whether a line points to the vanishing point of gravity: the direction in which "up" moves the image of a point
/// on the ray (x, y, 1) is (up_x − x up_z, up_y − y up_z).
fn is_upright(finder: &RangeFinder<f32>, line: &Line, tolerance: f32) -> bool {
    let camera = finder.camera();
    let up = finder.horizon();
    let ray = camera.ray_from_ideal(line.centroid);
    let moved = camera.ideal_from_ray(ray + (up.xy() - ray * up.z)) - line.centroid;
    line.normal.dot(&moved).abs() <= libm::sinf(tolerance) * moved.norm()
}

/// The middle of the undistorted picture, and the distance of its farthest point.
fn extent(lens: &LensGrid<'_>, width: usize, height: usize) -> (Vector2<f32>, f32) {
    let last = Vector2::new(width as f32 - 1.0, height as f32 - 1.0);
    let origin = last * 0.5;
    let mut radius = 1.0_f32;
    for (s, t) in [0.0, 0.5, 1.0].into_iter().flat_map(|s| [0.0, 0.5, 1.0].map(|t| (s, t))) {
        let border = Vector2::new(last.x * s, last.y * t);
        let ideal = lens.ideal_from_pixel(border, Vector2::x()).map_or(border, |(ideal, _)| ideal);
        radius = radius.max((ideal - origin).norm());
    }
    (origin, radius)
}

#[cfg(test)]
#[path = "extractor_tests.rs"]
mod tests;

use super::EdgePoint;
use super::edge::steps_from_direction;
use nalgebra::{Matrix2, Vector2};

/// Lines of either kind that an [`Extraction`] holds.
pub const MAX_LINES: usize = 32;
/// Corners that an [`Extraction`] holds.
pub const MAX_CORNERS: usize = 32;

/// A straight edge, as an ideal camera without lens distortion sees it.
///
/// The line is { x : n·x = n·c } with the unit normal n towards the brighter side and c the points' weighted mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Line {
    /// Unit normal n, from dark to bright.
    pub normal: Vector2<f32>,
    /// Weighted mean c of the edge points, ideal pixels.
    pub centroid: Vector2<f32>,
    /// Positions along (−n_v, n_u) of the outermost points from the centroid, px.
    pub extent: [f32; 2],
    /// The ends in the picture's pixels, as seen through the lens: top and bottom of a vertical line, left and
    /// right of a floor line.
    pub ends: [Vector2<f32>; 2],
    /// Variance of the position along the normal at the centroid, px².
    pub var_position_px2: f32,
    /// Variance of the normal's angle, rad²; independent of the position's.
    pub var_angle: f32,
    /// Edge points it was fitted to.
    pub points: u16,
    /// Their root mean square distance, px.
    pub residual_px: f32,
    /// Width of the edge's profile as a Gaussian's deviation, 1.3 px of which the smoothing makes.
    pub width_px: f32,
}

impl Line {
    /// The unit vector along the line, the normal turned by a quarter from u to v.
    pub fn along(&self) -> Vector2<f32> {
        Vector2::new(-self.normal.y, self.normal.x)
    }

    /// Signed distance of an ideal pixel, positive on the brighter side.
    pub fn distance(&self, ideal: Vector2<f32>) -> f32 {
        self.normal.dot(&(ideal - self.centroid))
    }

    /// Position of an ideal pixel along the line, from the centroid.
    pub fn position(&self, ideal: Vector2<f32>) -> f32 {
        self.along().dot(&(ideal - self.centroid))
    }

    /// The end that is lower in the picture, ideal pixels.
    pub(super) fn lower_end(&self) -> Vector2<f32> {
        self.centroid + self.along() * if self.normal.x >= 0.0 { self.extent[1] } else { self.extent[0] }
    }

    /// How far an ideal pixel lies beyond the lower end, px.
    pub(super) fn beyond_lower_end(&self, ideal: Vector2<f32>) -> f32 {
        let beyond = self.along().dot(&(ideal - self.lower_end()));
        if self.normal.x >= 0.0 { beyond } else { -beyond }
    }

    /// Where the line, which must not be upright, crosses a column of ideal pixels.
    pub(super) fn at_column(&self, u: f32) -> Vector2<f32> {
        let along = self.along();
        self.centroid + along * ((u - self.centroid.x) / along.x)
    }

    /// Direction of the normal in 256ths of a turn.
    pub(super) fn direction(&self) -> u8 {
        steps_from_direction(self.normal.x, self.normal.y)
    }

    /// Length in ideal pixels.
    pub fn length(&self) -> f32 {
        self.extent[1] - self.extent[0]
    }

    /// Variance of the distance from the line, at a position along it, px².
    pub fn var_at(&self, position: f32) -> f32 {
        self.var_position_px2 + position * position * self.var_angle
    }
}

/// The foot of a vertical edge on an edge of the floor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// In the picture, as seen through the lens; the centre of the top-left pixel is (0, 0).
    pub pixel: Vector2<f32>,
    /// Covariance of the pixel, px².
    pub covariance: Matrix2<f32>,
    /// Its line in [`Extraction::vertical_lines`].
    pub vertical: u8,
    /// Its line in [`Extraction::floor_lines`].
    pub floor: u8,
    /// Whether the vertical edge is brighter on its right.
    pub brighter_right: bool,
    /// Whether the floor edge is brighter below.
    pub brighter_below: bool,
}

/// What was left out because a capacity was reached; all zero (and a stride of 1) when nothing was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Truncations {
    /// Stride of the kept edge points: one for each `stride` pixels along flat edges and each 2 · `stride` along steep ones.
    pub edge_stride: usize,
    /// Maxima of the Hough transform that were not looked at.
    pub peaks: u32,
    /// Lines given up for longer ones.
    pub lines: u32,
    /// Corners given up for more certain ones.
    pub corners: u32,
}

impl Default for Truncations {
    fn default() -> Self {
        Self::NONE
    }
}

impl Truncations {
    /// Nothing was left out.
    pub const NONE: Self = Self { edge_stride: 1, peaks: 0, lines: 0, corners: 0 };

    /// Whether anything was left out.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }
}

/// What one picture gave.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extraction {
    /// Floor corners, from the most certain to the least.
    pub corners: heapless::Vec<Corner, MAX_CORNERS>,
    /// Edges along gravity.
    pub vertical_lines: heapless::Vec<Line, MAX_LINES>,
    /// Edges that may bound the floor.
    pub floor_lines: heapless::Vec<Line, MAX_LINES>,
    /// Edge points found that may be on a line of either kind, whether kept or not: where only every n-th is looked at, n for each.
    pub edge_points: u32,
    /// Standard deviation of the picture's noise, grey levels.
    pub noise_std: f32,
    /// What did not fit.
    pub truncations: Truncations,
}

impl Extraction {
    /// Memory for one, to be lent to an extractor. All zero, so that a static of it takes no room in flash.
    pub const fn zero() -> Self {
        Self {
            corners: heapless::Vec::new(),
            vertical_lines: heapless::Vec::new(),
            floor_lines: heapless::Vec::new(),
            edge_points: 0,
            noise_std: 0.0,
            truncations: Truncations { edge_stride: 0, ..Truncations::NONE },
        }
    }

    /// Forgets the picture, in place.
    pub fn clear(&mut self) {
        let Self { corners, vertical_lines, floor_lines, edge_points, noise_std, truncations } = self;
        corners.clear();
        vertical_lines.clear();
        floor_lines.clear();
        (*edge_points, *noise_std, *truncations) = (0, 0.0, Truncations::NONE);
    }

    /// The vertical line of a corner of this extraction.
    pub fn vertical_of(&self, corner: &Corner) -> Option<&Line> {
        self.vertical_lines.get(usize::from(corner.vertical))
    }

    /// The floor line of a corner of this extraction.
    pub fn floor_of(&self, corner: &Corner) -> Option<&Line> {
        self.floor_lines.get(usize::from(corner.floor))
    }
}

const _: () = assert!(size_of::<EdgePoint>() == 12);

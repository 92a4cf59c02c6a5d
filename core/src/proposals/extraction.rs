use super::proposal::Proposal;
use crate::lines::Line;
use nalgebra::{Matrix2, Vector2};

/// Vertical lines that an [`Extraction`] holds.
pub const MAX_LINES: usize = 48;
/// Proposals that an [`Extraction`] holds.
pub const MAX_PROPOSALS: usize = 60;
/// Corners that an [`Extraction`] holds.
pub const MAX_CORNERS: usize = 32;

/// The foot of a vertical edge on an edge of the floor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// In the picture, as seen through the lens; the centre of the top-left pixel is (0, 0).
    pub pixel: Vector2<f32>,
    /// Covariance of the pixel, px².
    pub covariance: Matrix2<f32>,
    /// The probability that it is a corner of the floor.
    pub probability: f32,
    /// Whether the vertical edge is brighter on its right.
    pub brighter_right: bool,
    /// Whether the floor edge is brighter below.
    pub brighter_below: bool,
}

/// What was left out because a capacity was reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Truncations {
    /// Edge points given up for stronger ones.
    pub edge_points: u32,
    /// Vertical lines given up for longer ones.
    pub lines: u32,
    /// Proposals given up for likelier ones.
    pub proposals: u32,
    /// Corners given up for likelier ones.
    pub corners: u32,
}

impl Truncations {
    /// Whether anything was left out.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }
}

/// What one picture gave.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extraction {
    /// Floor corners: the proposals that are likely enough, of several in one place the best; from the likeliest down.
    pub corners: heapless::Vec<Corner, MAX_CORNERS>,
    /// Places that may be corners, from the likeliest down.
    pub proposals: heapless::Vec<Proposal, MAX_PROPOSALS>,
    /// Edges along gravity.
    pub vertical_lines: heapless::Vec<Line, MAX_LINES>,
    /// Edge points found that may be on an edge looked for, whether kept or not: where only every n-th is looked at, n for each.
    pub edge_points: u32,
    /// Standard deviation of the picture's noise, grey levels.
    pub noise_std: f32,
    /// Least gradient of an edge in this picture, grey levels per pixel.
    pub threshold: f32,
    /// What did not fit.
    pub truncations: Truncations,
}

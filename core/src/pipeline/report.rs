//! What a picture brought.
use super::Coverage;
use crate::association::Carrier;
use crate::geometry::Pose;
use crate::lines::{MAX_CORNERS, Truncations};
use crate::slam::{MapReport, Outcome};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// What became of one floor corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerReport {
    /// Where it was found in the picture, px.
    pub pixel: Vector2<f32>,
    /// Covariance of the pixel, px².
    pub pixel_covariance: Matrix2<f32>,
    /// From the robot's origin, m.
    pub range: f32,
    /// Positive to the left, rad.
    pub bearing: f32,
    /// Covariance of (range, bearing) as the filter took it.
    pub covariance: Matrix2<f32>,
    /// What the filter did with it.
    pub outcome: Outcome<f32>,
}

/// What moved the robot since the last picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MovedBy {
    /// Nothing: the first picture, or no reading came.
    #[default]
    Nothing,
    /// Its odometry.
    Odometry,
    /// The pictures.
    Pictures,
    /// Odometry and pictures together.
    Both,
    /// The pictures were asked and tell nothing: the odometry, or without it the last velocity, stands in.
    Held,
}

/// A part of the work on a picture, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Its rows: smoothing, gradients, edge points.
    Rows,
    /// Lines and corners.
    Corners,
    /// Features, matches and the robot's step, where pictures are asked for them.
    Motion,
    /// Association, filter and map.
    Filter,
}

/// What one picture brought.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Pictures before this one.
    pub frame: u32,
    /// Seconds.
    pub time: f64,
    /// Robot in the world.
    pub pose: Pose<f32>,
    /// Covariance of (x, y, heading).
    pub pose_covariance: Matrix3<f32>,
    /// The corners with a range, in the order of the extraction.
    pub corners: heapless::Vec<CornerReport, MAX_CORNERS>,
    /// Corners found but not used: above the horizon, outside the lens model, or too near it to have a range.
    pub without_range: u32,
    /// What moved the robot since the last picture.
    pub moved_by: MovedBy,
    /// What carried the landmarks' corners into this picture.
    pub carried_by: Carrier,
    /// How the odometry covered the time since the last picture.
    pub odometry: Coverage,
    /// What happened to the map.
    pub map: MapReport,
    /// Edge points, lines and corners that did not fit.
    pub truncations: Truncations,
}

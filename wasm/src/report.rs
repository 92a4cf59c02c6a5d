//! What one picture brought, as rows of numbers.
use monorange_core::geometry::{Camera, RangeFinder, range_bearing_by_floor};
use monorange_core::lines::{EdgePoint, Extraction};
use monorange_core::pipeline::{self, CornerReport, MovedBy};
use monorange_core::slam::{Decision, Filter, Form, Landmark, Status};
use nalgebra::{Matrix2, SMatrix, Vector2};
use wasm_bindgen::prelude::*;

/// Numbers in a row of [`Report::corners`].
pub const CORNER_COLUMNS: usize = 11;
/// Numbers in a row of [`Report::lines`].
pub const LINE_COLUMNS: usize = 4;

type PipelineFilter = Filter<f32, Vec<f32>, Vec<Landmark<f32>>>;

/// Pose, map and what became of each corner.
#[wasm_bindgen]
pub struct Report {
    pose: [f32; 3],
    covariance: [f32; 6],
    corners: Vec<f32>,
    predicted: Vec<f32>,
    lines: Vec<f32>,
    landmarks: Vec<f32>,
    nis: f32,
    nis_degrees: u32,
    without_range: u32,
    no_room: u32,
    held: bool,
}

#[wasm_bindgen]
impl Report {
    /// x, y (m) and heading (rad) of the robot in the world.
    #[wasm_bindgen(getter)]
    pub fn pose(&self) -> Vec<f32> {
        self.pose.into()
    }

    /// var_x, cov_xy, cov_xh, var_y, cov_yh, var_h.
    #[wasm_bindgen(getter)]
    pub fn covariance(&self) -> Vec<f32> {
        self.covariance.into()
    }

    /// Rows u, v, var_u, cov_uv, var_v, range, bearing, range_std, landmark (−1: none), decision (0 update,
    /// 1 birth, 2 gated, 3 tentative, 4 rejected), NIS (not a number: none).
    #[wasm_bindgen(getter)]
    pub fn corners(&self) -> Vec<f32> {
        self.corners.clone()
    }

    /// Rows landmark, u, v, var_u, cov_uv, var_v, corner (−1: none): where the map expected its landmarks.
    #[wasm_bindgen(getter)]
    pub fn predicted(&self) -> Vec<f32> {
        self.predicted.clone()
    }

    /// Rows u, v, u, v: the ends of the lines found.
    #[wasm_bindgen(getter)]
    pub fn lines(&self) -> Vec<f32> {
        self.lines.clone()
    }

    /// Rows id, x, y, var_x, cov_xy, var_y, seen, confirmed (1; 0 is tentative): the map.
    #[wasm_bindgen(getter)]
    pub fn landmarks(&self) -> Vec<f32> {
        self.landmarks.clone()
    }

    /// Sum of the normalised innovations squared of the matched corners.
    #[wasm_bindgen(getter)]
    pub fn nis(&self) -> f32 {
        self.nis
    }

    /// Degrees of freedom of that sum.
    #[wasm_bindgen(getter, js_name = nisDegrees)]
    pub fn nis_degrees(&self) -> u32 {
        self.nis_degrees
    }

    /// Corners that had no range worth the name.
    #[wasm_bindgen(getter, js_name = withoutRange)]
    pub fn without_range(&self) -> u32 {
        self.without_range
    }

    /// Whether the motion was to come from the pictures, and this one did not tell it.
    #[wasm_bindgen(getter)]
    pub fn held(&self) -> bool {
        self.held
    }

    /// Landmarks for which there was no room.
    #[wasm_bindgen(getter, js_name = noRoom)]
    pub fn no_room(&self) -> u32 {
        self.no_room
    }
}

impl Report {
    pub(crate) fn new(
        seen: &pipeline::Report,
        filter: &PipelineFilter,
        mut predicted: Vec<f32>,
        lines: Vec<f32>,
    ) -> Self {
        let (pose, c) = (seen.pose, seen.pose_covariance);
        let updates = seen.corners.iter().filter(|corner| is_match(corner));
        let (nis, nis_degrees) = updates.clone().fold((0.0, 0), |(sum, degrees), corner| {
            (sum + corner.outcome.nis.unwrap_or(0.0), degrees + corner.outcome.dof as u32)
        });
        for row in predicted.chunks_exact_mut(PREDICTED_COLUMNS) {
            let [landmark, .., corner] = row else { continue };
            let found = seen.corners.iter().position(|seen| {
                is_match(seen) && seen.outcome.landmark.is_some_and(|id| id as f32 == *landmark)
            });
            *corner = found.map_or(-1.0, |index| index as f32);
        }
        Self {
            pose: [pose.x, pose.y, pose.heading],
            covariance: [c.m11, c.m12, c.m13, c.m22, c.m23, c.m33],
            corners: seen.corners.iter().flat_map(corner_row).collect(),
            predicted,
            lines,
            landmarks: filter
                .landmarks()
                .iter()
                .filter_map(|known| landmark_row(filter, known))
                .flatten()
                .collect(),
            nis,
            nis_degrees,
            without_range: seen.without_range,
            no_room: seen.map.no_room,
            held: seen.moved_by == MovedBy::Held,
        }
    }
}

fn is_match(corner: &CornerReport) -> bool {
    matches!(corner.outcome.decision, Decision::Update | Decision::Tentative) && corner.outcome.nis.is_some()
}

fn corner_row(corner: &CornerReport) -> [f32; CORNER_COLUMNS] {
    let decision = match corner.outcome.decision {
        Decision::Update => 0.0,
        Decision::Birth => 1.0,
        Decision::Gated => 2.0,
        Decision::Tentative => 3.0,
        Decision::Rejected => 4.0,
    };
    [
        corner.pixel.x,
        corner.pixel.y,
        corner.pixel_covariance.m11,
        corner.pixel_covariance.m12,
        corner.pixel_covariance.m22,
        corner.range,
        corner.bearing,
        libm::sqrtf(corner.covariance.m11),
        corner.outcome.landmark.map_or(-1.0, |id| id as f32),
        decision,
        corner.outcome.nis.unwrap_or(f32::NAN),
    ]
}

fn landmark_row(filter: &PipelineFilter, landmark: &Landmark<f32>) -> Option<[f32; 8]> {
    let (position, c) = (filter.position(landmark)?, filter.position_covariance(landmark)?);
    let confirmed = f32::from(u8::from(landmark.status == Status::Confirmed));
    Some([landmark.id as f32, position.x, position.y, c.m11, c.m12, c.m22, landmark.seen as f32, confirmed])
}

pub(crate) fn map_row(filter: &PipelineFilter, landmark: &Landmark<f32>) -> Option<[f64; 9]> {
    let [id, x, y, xx, xy, yy, seen, _] = landmark_row(filter, landmark)?.map(f64::from);
    Some([id, x, y, xx, xy, yy, seen, landmark.first_time, landmark.last_time])
}

/// The ends of every line, rows of [`LINE_COLUMNS`].
pub(crate) fn lines(extraction: &Extraction) -> Vec<f32> {
    let both = extraction.vertical_lines.iter().chain(&extraction.floor_lines);
    both.flat_map(|line| {
        let [a, b] = line.ends;
        [a.x, a.y, b.x, b.y]
    })
    .collect()
}

/// Edge points as rows u, v: they are kept where a camera without lens distortion would see them.
pub(crate) fn edges(camera: &Camera<f32>, points: &[EdgePoint]) -> Vec<f32> {
    let pixel = |point: &EdgePoint| camera.pixel_from_ray(camera.ray_from_ideal(point.ideal()));
    points.iter().filter_map(pixel).flat_map(<[f32; 2]>::from).collect()
}

const PREDICTED_COLUMNS: usize = 7;

/// Where the filter expects its landmarks in the picture, rows of [`PREDICTED_COLUMNS`] without a corner yet.
///
/// With d = R(θ)ᵀ(l − t) the landmark in the robot's frame and u(d) its pixel, the covariance is H P Hᵀ with
/// H = ∂u/∂d [ −Rᵀ   (d_y, −d_x)ᵀ   Rᵀ ] over the states x, y, θ, l.
pub(crate) fn predictions(filter: &PipelineFilter, finder: &RangeFinder<f32>) -> Vec<f32> {
    let points = filter.landmarks().iter().filter(|landmark| landmark.form == Form::Point);
    points
        .filter_map(|landmark| {
            let (pixel, c) = predict(filter, finder, landmark)?;
            Some([landmark.id as f32, pixel.x, pixel.y, c.m11, c.m12, c.m22, -1.0])
        })
        .flatten()
        .collect()
}

fn predict(
    filter: &PipelineFilter,
    finder: &RangeFinder<f32>,
    landmark: &Landmark<f32>,
) -> Option<(Vector2<f32>, Matrix2<f32>)> {
    let pose = filter.pose();
    let in_robot = pose.inverse_transform(filter.position(landmark)?);
    let pixel = finder.pixel_from_floor(in_robot).ok()?;
    let sighting = finder.sight(pixel).ok()?;
    let polar_by_floor = range_bearing_by_floor(sighting.point_in_robot, sighting.range);
    let pixel_by_floor = sighting.by_pixel.try_inverse()? * polar_by_floor;
    let robot_from_world = pose.rotation().transpose();
    let mut by_state = SMatrix::<f32, 2, 5>::zeros();
    by_state.fixed_columns_mut::<2>(0).copy_from(&-robot_from_world);
    by_state.column_mut(2).copy_from(&Vector2::new(in_robot.y, -in_robot.x));
    by_state.fixed_columns_mut::<2>(3).copy_from(&robot_from_world);
    let states = [0, 1, 2, landmark.offset, landmark.offset + 1];
    let joint = SMatrix::<f32, 5, 5>::from_fn(|row, column| match (states.get(row), states.get(column)) {
        (Some(row), Some(column)) => filter.covariance_at(*row, *column),
        _ => 0.0,
    });
    let by_state = pixel_by_floor * by_state;
    Some((pixel, by_state * joint * by_state.transpose()))
}

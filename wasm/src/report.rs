//! What one picture brought, as rows of numbers.
use monorange_core::geometry::{Camera, RangeFinder, range_bearing_by_floor};
use monorange_core::lines::{EdgePoint, Extraction};
use monorange_core::pipeline::{self, Carrier, CornerReport, MovedBy};
use monorange_core::slam::{Decision, Form, Landmark, Status};
use monorange_wasm_drive::OnHeapFilter;
use monorange_wasm_record::{Corner, Line, Predicted, rows};
use nalgebra::{Matrix2, SMatrix, Vector2};
use wasm_bindgen::prelude::*;

/// Pose, map and what became of each corner.
#[wasm_bindgen]
pub struct Report {
    pub(crate) pose: [f32; 3],
    pub(crate) covariance: [f32; 6],
    pub(crate) corners: Vec<f32>,
    pub(crate) predicted: Vec<f32>,
    pub(crate) lines: Vec<f32>,
    pub(crate) landmarks: Vec<f32>,
    pub(crate) nis: f32,
    pub(crate) nis_degrees: u32,
    pub(crate) without_range: u32,
    pub(crate) no_room: u32,
    pub(crate) held: bool,
    pub(crate) knocked: bool,
    pub(crate) carried_by: Carrier,
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

    /// Rows with the columns of `CornerColumn`.
    #[wasm_bindgen(getter)]
    pub fn corners(&self) -> Vec<f32> {
        self.corners.clone()
    }

    /// Where the map expected its landmarks: rows with the columns of `PredictedColumn`.
    #[wasm_bindgen(getter)]
    pub fn predicted(&self) -> Vec<f32> {
        self.predicted.clone()
    }

    /// The lines found: rows with the columns of `LineColumn`.
    #[wasm_bindgen(getter)]
    pub fn lines(&self) -> Vec<f32> {
        self.lines.clone()
    }

    /// The map: rows with the columns of `LandmarkColumn`.
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

    /// Whether the camera seems to have been knocked since the last picture.
    #[wasm_bindgen(getter)]
    pub fn knocked(&self) -> bool {
        self.knocked
    }

    /// What carried the corners into this picture: 0 the floor's homography, 1 the free one, 2 the map.
    #[wasm_bindgen(getter, js_name = carriedBy)]
    pub fn carried_by(&self) -> usize {
        match self.carried_by {
            Carrier::Floor => 0,
            Carrier::Free => 1,
            Carrier::Map => 2,
        }
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
        filter: &OnHeapFilter,
        finder: &RangeFinder<f32>,
        mount_std: &[f32; 6],
        predicted: Vec<Predicted>,
        lines: Vec<f32>,
    ) -> Self {
        let (pose, c) = (seen.pose, seen.pose_covariance);
        let updates = seen.corners.iter().filter(|corner| is_match(corner));
        let (nis, nis_degrees) = updates.clone().fold((0.0, 0), |(sum, degrees), corner| {
            (sum + corner.outcome.nis.unwrap_or(0.0), degrees + corner.outcome.dof as u32)
        });
        let mut report = Self {
            nis,
            nis_degrees,
            lines,
            without_range: seen.without_range,
            no_room: seen.map.no_room,
            held: seen.moved_by == MovedBy::Held,
            knocked: seen.map.knocked,
            carried_by: seen.carried_by,
            pose: [pose.x, pose.y, pose.heading],
            covariance: [c.m11, c.m12, c.m13, c.m22, c.m23, c.m33],
            corners: Vec::new(),
            predicted: Vec::new(),
            landmarks: Vec::new(),
        };
        for corner in &seen.corners {
            Corner::from_report(corner, range_std(finder, mount_std, corner)).push(&mut report.corners);
        }
        for expected in predicted {
            let is_its = |seen: &CornerReport| {
                is_match(seen) && seen.outcome.landmark.is_some_and(|id| id as f32 == expected.landmark)
            };
            let found = seen.corners.iter().position(is_its);
            let corner = found.map_or(-1.0, |index| index as f32);
            Predicted { corner, ..expected }.push(&mut report.predicted);
        }
        for known in filter.landmarks() {
            if let Some(row) = landmark_row(filter, known) {
                row.push(&mut report.landmarks);
            }
        }
        report
    }
}

fn is_match(corner: &CornerReport) -> bool {
    matches!(corner.outcome.decision, Decision::Update | Decision::Tentative) && corner.outcome.nis.is_some()
}

/// As everywhere on the page, ± is the pixel's noise and the mount's uncertainty together.
fn range_std(finder: &RangeFinder<f32>, mount_std: &[f32; 6], corner: &CornerReport) -> f32 {
    let systematic = finder.sight(corner.pixel).map_or(0.0, |seen| seen.systematic(mount_std).m11);
    libm::sqrtf(corner.covariance.m11 + systematic)
}

fn landmark_row(filter: &OnHeapFilter, landmark: &Landmark<f32>) -> Option<rows::Landmark> {
    let (position, c) = (filter.position(landmark)?, filter.position_covariance(landmark)?);
    Some(rows::Landmark {
        id: landmark.id as f32,
        x: position.x,
        y: position.y,
        var_x: c.m11,
        cov_xy: c.m12,
        var_y: c.m22,
        seen: landmark.seen as f32,
        confirmed: f32::from(u8::from(landmark.status == Status::Confirmed)),
    })
}

pub(crate) fn confirmed_row(filter: &OnHeapFilter, landmark: &Landmark<f32>) -> Option<[f64; 9]> {
    let (position, c) = (filter.position(landmark)?, filter.position_covariance(landmark)?);
    let [x, y, var_x, cov_xy, var_y] = [position.x, position.y, c.m11, c.m12, c.m22].map(f64::from);
    let (id, seen) = (f64::from(landmark.id), f64::from(landmark.seen));
    Some([id, x, y, var_x, cov_xy, var_y, seen, landmark.first_time, landmark.last_time])
}

/// The ends of every line.
pub(crate) fn lines(extraction: &Extraction) -> Vec<f32> {
    let mut rows = Vec::new();
    for line in extraction.vertical_lines.iter().chain(&extraction.floor_lines) {
        let [a, b] = line.ends;
        Line { u0: a.x, v0: a.y, u1: b.x, v1: b.y }.push(&mut rows);
    }
    rows
}

/// Edge points as rows u, v: they are kept where a camera without lens distortion would see them.
pub(crate) fn edges(camera: &Camera<f32>, points: &[EdgePoint]) -> Vec<f32> {
    let pixel = |point: &EdgePoint| camera.pixel_from_ray(camera.ray_from_ideal(point.ideal()));
    points.iter().filter_map(pixel).flat_map(<[f32; 2]>::from).collect()
}

/// Where the filter expects its landmarks in the picture, without a corner yet.
///
/// With d = R(θ)ᵀ(l − t) the landmark in the robot's frame and u(d) its pixel, the covariance is H P Hᵀ with
/// H = ∂u/∂d [ −Rᵀ   (d_y, −d_x)ᵀ   Rᵀ ] over the states x, y, θ, l.
pub(crate) fn predictions(filter: &OnHeapFilter, finder: &RangeFinder<f32>) -> Vec<Predicted> {
    let points = filter.landmarks().iter().filter(|landmark| landmark.form == Form::Point);
    let row = |landmark: &Landmark<f32>| {
        let (pixel, c) = predict(filter, finder, landmark)?;
        let (landmark, u, v) = (landmark.id as f32, pixel.x, pixel.y);
        Some(Predicted { landmark, u, v, var_u: c.m11, cov_uv: c.m12, var_v: c.m22, corner: -1.0 })
    };
    points.filter_map(row).collect()
}

fn predict(
    filter: &OnHeapFilter,
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

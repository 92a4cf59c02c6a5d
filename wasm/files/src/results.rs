//! What a run gave, written by the command line's own writers: the same bytes.
use monorange::files::{MapPoint, Stamped, write_map, write_ply, write_trajectory, write_tum};
use monorange_core::geometry::Pose;
use nalgebra::{Matrix2, Matrix3, Vector2};
use std::io;
use wasm_bindgen::prelude::*;

/// Poses and map of a run.
#[wasm_bindgen]
#[derive(Default)]
pub struct Results {
    trajectory: Vec<Stamped>,
    map: Vec<MapPoint>,
}

#[wasm_bindgen]
impl Results {
    /// Nothing yet.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a pose: x, y, heading, and var_x, cov_xy, cov_xh, var_y, cov_yh, var_h.
    #[wasm_bindgen(js_name = addPose)]
    pub fn add_pose(&mut self, time: f64, pose: &[f32], covariance: &[f32]) {
        let [x, y, heading] = *pose else { return };
        let covariance = match *covariance {
            [xx, xy, xh, yy, yh, hh] => Some(Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh).map(f64::from)),
            _ => None,
        };
        // As it is: wrapping again could change the last bit.
        let pose = Pose { x: x.into(), y: y.into(), heading: heading.into() };
        self.trajectory.push(Stamped { time, pose, covariance });
    }

    /// Sets the map from rows id, x, y, var_x, cov_xy, var_y, seen, first time, last time.
    #[wasm_bindgen(js_name = setMap)]
    pub fn set_map(&mut self, rows: &[f64]) {
        self.map = rows.chunks_exact(9).filter_map(map_point).collect();
    }

    /// `trajectory.tum`.
    pub fn tum(&self) -> String {
        written(|out| write_tum(out, &self.trajectory))
    }

    /// `trajectory.csv`.
    pub fn csv(&self) -> String {
        written(|out| write_trajectory(out, &self.trajectory))
    }

    /// `map.csv`.
    pub fn map(&self) -> String {
        written(|out| write_map(out, &self.map))
    }

    /// `map.ply`.
    pub fn ply(&self) -> String {
        written(|out| write_ply(out, &self.map))
    }
}

fn map_point(row: &[f64]) -> Option<MapPoint> {
    let [id, x, y, xx, xy, yy, seen, first, last] = *row else { return None };
    Some(MapPoint {
        id: id as u64,
        position: Vector2::new(x, y),
        covariance: Some(Matrix2::new(xx, xy, xy, yy)),
        seen: seen as u64,
        first_and_last: Some([first, last]),
    })
}

/// What the writer writes; writing to memory cannot fail.
fn written(write: impl FnOnce(&mut dyn io::Write) -> io::Result<()>) -> String {
    let mut text = Vec::new();
    let _ = write(&mut text);
    String::from_utf8_lossy(&text).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_written_with_all_its_bits() {
        let mut results = Results::new();
        results.add_pose(0.5, &[0.1, -2.0, 0.0], &[1.0, 0.0, 0.0, 1.0, 0.0, 1.0]);
        assert_eq!(results.tum(), format!("0.5 {} -2 0 0 0 0 1\n", f64::from(0.1_f32)));
        assert_eq!(results.csv().lines().count(), 2);
    }

    #[test]
    fn a_map_has_a_line_a_landmark() {
        let mut results = Results::new();
        results.set_map(&[7.0, 1.0, 2.0, 0.1, 0.0, 0.2, 3.0, 0.5, 1.5]);
        assert_eq!(results.map().lines().nth(1), Some("7,1,2,0.1,0,0.2,3,0.5,1.5"));
        assert!(results.ply().starts_with("ply\n"));
    }
}

use crate::errors::value;
use monorange_core::geometry::Pose;
use monorange_formats::{
    evaluation::{Align, Truth, trajectory_errors},
    files::{Stamped, read_trajectory},
};
use nalgebra::Matrix3;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::path::PathBuf;

/// A trajectory: a file's name, or times (N,), poses (N, 3) and perhaps covariances (N, 3, 3).
#[derive(FromPyObject)]
pub(crate) enum Trajectory<'py> {
    Arrays(PyReadonlyArray1<'py, f64>, PyReadonlyArray2<'py, f64>, Option<PyReadonlyArray3<'py, f64>>),
    File(PathBuf),
}

impl Trajectory<'_> {
    fn poses(&self) -> PyResult<Vec<Stamped>> {
        let (times, poses, covariances) = match self {
            Self::File(path) => return read_trajectory(path).map_err(value),
            Self::Arrays(times, poses, covariances) => (times.as_array(), poses, covariances),
        };
        let (count, shape) = (times.len(), poses.shape());
        if shape != [count, 3] {
            return Err(value(format!(
                "poses must have the shape ({count}, 3) of x, y, heading, have {shape:?}"
            )));
        }
        if let Some(covariances) = covariances
            && covariances.shape() != [count, 3, 3]
        {
            return Err(value(format!("covariances must have the shape ({count}, 3, 3)")));
        }
        let (poses, covariances) = (poses.as_array(), covariances.as_ref().map(|some| some.as_array()));
        let stamped = |index: usize| Stamped {
            time: times[index],
            pose: Pose::new(poses[[index, 0]], poses[[index, 1]], poses[[index, 2]]),
            covariance: covariances
                .as_ref()
                .map(|some| Matrix3::from_fn(|row, column| some[[index, row, column]])),
        };
        Ok((0..count).map(stamped).collect())
    }
}

/// The errors of a trajectory as JSON.
#[pyfunction]
#[pyo3(name = "_evaluate", signature = (truth, estimate, align, delta, max_gap))]
pub(crate) fn evaluate(
    truth: Trajectory<'_>,
    estimate: Trajectory<'_>,
    align: &str,
    delta: f64,
    max_gap: f64,
) -> PyResult<String> {
    let align = match align {
        "none" => Align::None,
        "se2" => Align::Se2,
        "sim2" => Align::Sim2,
        other => return Err(value(format!("align is `{other}`, must be none, se2 or sim2"))),
    };
    if delta <= 0.0 || max_gap <= 0.0 {
        return Err(value("delta (m) and max_gap (s) must be above 0"));
    }
    let (truth, estimate) = (truth.poses()?, estimate.poses()?);
    let pairs = Truth::new(&truth, max_gap).pairs(&estimate);
    if pairs.is_empty() {
        return Err(value("truth and estimate have no time in common: give both on the same clock"));
    }
    serde_json::to_string(&trajectory_errors(&pairs, align, delta)).map_err(value)
}

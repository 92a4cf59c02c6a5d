//! The filter alone, on the log of any sensor that measures ranges and bearings.
mod dataset;
mod read;
mod run;

pub use dataset::{Dataset, Recording};
pub use read::read_sightings;
pub use run::{Association, LogResult, ObservationRow, Settings, run};

use crate::files::Odometry;

/// A measurement of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogSighting {
    /// Seconds.
    pub time: f64,
    /// The landmark's name, where the log gives one.
    pub id: Option<u32>,
    /// Metres.
    pub range: Option<f64>,
    /// Radians.
    pub bearing: Option<f64>,
    /// Variances of range and bearing, where the log gives them.
    pub variances: [Option<f64>; 2],
    /// Covariance of range and bearing.
    pub covariance: f64,
}

impl LogSighting {
    /// A range and a bearing of which nothing else is known.
    pub fn range_bearing(time: f64, range: f64, bearing: f64) -> Self {
        let (range, bearing) = (Some(range), Some(bearing));
        Self { time, id: None, range, bearing, variances: [None; 2], covariance: 0.0 }
    }
}

/// Odometry and what was seen, sorted by time.
#[derive(Clone, Debug)]
pub struct SensorLog {
    /// What the wheels say.
    pub odometry: Odometry,
    /// What the sensor says.
    pub sightings: Vec<LogSighting>,
}

//! Public logs in their own formats, with the noise that was measured on them.
use super::{SensorLog, Settings, read};
use crate::Result;
use crate::files::{MapPoint, Stamped};
use std::path::Path;

/// A public log that can be read as it is published.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
pub enum Dataset {
    /// UTIAS MRCLAM: a folder of `RobotN_….dat`; N is the number of the robot.
    Mrclam,
    /// Victoria Park as factor-graph text (`ODOMETRY …`, `LANDMARK …`).
    VictoriaPark,
    /// The CMU range-only logs: a folder of `PlazaN_….csv`; N is the number of the log.
    Plaza,
}

/// A log with its truth, where it has one.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Odometry and measurements.
    pub log: SensorLog,
    /// Empty without truth.
    pub truth: Vec<Stamped>,
    /// True landmarks under the log's names; empty without.
    pub true_map: Vec<MapPoint>,
}

impl Dataset {
    /// The log `number` of the dataset at `path`; Victoria Park has only one.
    ///
    /// # Errors
    /// When a file is missing or malformed.
    pub fn read(self, path: &Path, number: u32) -> Result<Recording> {
        match self {
            Self::Mrclam => read::mrclam(path, number),
            Self::VictoriaPark => read::victoria_park(path),
            Self::Plaza => read::plaza(path, number),
        }
    }

    /// Settings that fit: the sensor's noise as measured against the truth, the odometry's such that the
    /// innovations have the size the filter expects.
    pub fn settings(self) -> Settings {
        match self {
            Self::Mrclam => Settings {
                range_std: [0.1, 0.0],
                bearing_std: 0.015,
                speed_std: 0.05,
                turn_std: 0.05,
                ..Settings::default()
            },
            Self::VictoriaPark => {
                Settings { speed_std: 0.01, slip_std: 0.002, turn_std: 0.002, ..Settings::default() }
            }
            Self::Plaza => {
                Settings { range_std: [0.5, 0.0], speed_std: 0.02, turn_std: 0.005, ..Settings::default() }
            }
        }
    }
}

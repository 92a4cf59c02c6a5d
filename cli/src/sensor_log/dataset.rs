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

    /// Settings that fit.
    ///
    /// MRCLAM: bearings as measured against the truth (0.32–1.05°), ranges with 0.2 m for their 0.07–0.18 m, because
    /// their errors last over several sightings, and a turn rate that the wheels hardly know. Victoria Park: the
    /// file's own noise. Plaza: the beacons' ranges are 2.8 m too long (median against the truth, both logs), with a
    /// spread of 1.2–1.8 m.
    pub fn settings(self) -> Settings {
        let base = Settings::default();
        match self {
            Self::Mrclam => Settings {
                range_std: [0.2, 0.0],
                bearing_std: 0.01,
                speed_std: 0.02,
                slip_std: 0.005,
                turn_std: 0.15,
                ..base
            },
            Self::VictoriaPark => Settings { speed_std: 0.01, slip_std: 0.002, turn_std: 0.002, ..base },
            Self::Plaza => Settings {
                range_offset: 2.8,
                range_std: [1.8, 0.0],
                speed_std: 0.05,
                slip_std: 0.02,
                turn_std: 0.01,
                ..base
            },
        }
    }
}

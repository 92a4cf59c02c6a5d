//! Public logs in their own formats, with the noise that was measured on them.
use super::{SensorLog, Settings, read};
use crate::Result;
use crate::files::{MapPoint, Stamped};
use monorange_core::slam::{MapConfig, View};
use std::path::Path;

/// A public log that can be read as it is published.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
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
    /// their errors last over several sightings. Turns err by 0.10–0.12 rad for the square root of a radian, with all five
    /// robots alike, and by less than the 0.05 rad/√s allowed when there is none. Its landmarks stand in groups 0.18 m
    /// apart, so nothing near is merged; without names a landmark that stays unseen goes.
    ///
    /// Victoria Park: the file's own variance of sightings, and for the odometry five times the file's heading noise,
    /// with which its loops do not fit (a hard gate locks itself out, and without names no loop closes). Without names
    /// a tree seen once is a landmark, as it is in the file, where 28 of 151 are.
    ///
    /// Plaza: the beacons' ranges are 2.8 m too long (median against the truth, both logs), with a spread of 1.2–1.8 m.
    pub fn settings(self) -> Settings {
        let base = Settings::default();
        match self {
            Self::Mrclam => Settings {
                range_std: [0.2, 0.0],
                bearing_std: 0.01,
                speed_std: 0.02,
                slip_std: 0.005,
                turn_std: 0.05,
                growth: [0.0, 0.1],
                map: MapConfig {
                    view: View { near: 0.0, far: 5.0, half_angle: 0.5 },
                    merge_distance: 0.0,
                    delete_after: 60,
                    ambiguity: 4.0,
                    ..base.map
                },
                ..base
            },
            Self::VictoriaPark => Settings {
                speed_std: 0.03,
                slip_std: 0.01,
                turn_std: 0.01,
                map: MapConfig {
                    view: View { near: 0.0, far: 18.0, half_angle: 1.2 },
                    density: 0.004, // 150 trees beside some 4 km of way
                    birth_nis: 16.0,
                    confirm: 1,
                    merge_distance: 2.0,
                    ..base.map
                },
                ..base
            },
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

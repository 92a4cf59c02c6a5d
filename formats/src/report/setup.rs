use crate::files::{MOUNT_KEYS, Rig, in_words};
use monorange_core::pipeline::{self, Config};

/// What a run was made with.
#[derive(Clone, Debug, Default)]
pub struct Setup {
    /// A sentence about what does not fit into a table.
    pub words: String,
    /// The settings in their order.
    pub settings: Vec<SettingLine>,
}

/// A setting and its value in this run.
#[derive(Clone, Debug)]
pub struct SettingLine {
    /// As it is given: `filter.gate`, or a flag.
    pub name: String,
    /// In this run.
    pub value: String,
    /// Its unit, or what it counts.
    pub unit: &'static str,
    /// What it means, in a sentence.
    pub help: &'static str,
    /// Where its default comes from.
    pub origin: &'static str,
    /// Whether it differs from the default.
    pub changed: bool,
}

impl Setup {
    /// That of a rig file.
    pub fn of_rig(rig: &Rig) -> Self {
        let defaults = Config::new(rig.settings.finder);
        let [height, tilt, roll, yaw, forward, left] = rig.finder.mount().parameters();
        let camera = rig.finder.camera();
        let mut words = format!(
            "Camera {}×{} px, focal length {:.1} px, {height:.3} m above the floor, tilt {:.2}°, roll {:.2}°, yaw {:.2}°, \
             lever arm {forward:.3}, {left:.3} m.",
            camera.width(),
            camera.height(),
            camera.focal().x,
            tilt.to_degrees(),
            roll.to_degrees(),
            yaw.to_degrees(),
        );
        let assumed: Vec<_> = MOUNT_KEYS
            .iter()
            .zip(rig.assumed_std)
            .take(rig.settings.mount_std.len())
            .filter(|(_, assumed)| *assumed)
            .map(|(key, _)| key.1)
            .collect();
        if !assumed.is_empty() {
            words += &format!(
                " The mount counts as measured by hand, with standard deviations of 1 cm and 1°, where the rig gives none: {}.",
                assumed.join(", ")
            );
        }
        let settings = pipeline::settings().map(|(setting, reference)| {
            let value = rig.settings.get(setting);
            SettingLine {
                name: setting.name.to_owned(),
                changed: value != defaults.get(setting),
                value: in_words(value),
                unit: setting.unit,
                help: reference.help,
                origin: reference.origin,
            }
        });
        Self { words, settings: settings.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const CAMERA: &str = "[camera]\nwidth = 320\nheight = 240\nfocal = [365, 365]\nprincipal = [160, 120]\n";

    fn rig(rest: &str) -> Rig {
        Rig::parse(Path::new("rig.toml"), &format!("{CAMERA}{rest}")).unwrap()
    }

    #[test]
    fn a_mount_without_deviations_was_measured_by_hand_and_the_report_says_so() {
        let rig = rig("[mount]\nheight = 0.4\ntilt_deg = 12\ntilt_std_deg = 0.5\n");
        let degree = 1_f32.to_radians();
        assert_eq!(rig.settings.mount_std, [0.01, 0.5 * degree, degree, degree]);
        assert!(rig.settings.validated().unwrap().filter.mount_std.unwrap().iter().all(|std| *std > 5e-3));
        let words = Setup::of_rig(&rig).words;
        assert!(words.ends_with("height_std, roll_std_deg, yaw_std_deg."), "{words}");
    }

    #[test]
    fn a_calibration_worse_than_the_floor_of_a_corners_deviation_raises_it() {
        let with =
            |line: &str, rest: &str| rig(&format!("{line}[mount]\nheight = 0.4\ntilt_deg = 12\n{rest}"));
        let floor = |rig: Rig| rig.settings.corner_std_floor_px;
        assert_eq!(floor(with("pixel_std = [0.1, 0.11]\n", "")), 0.3);
        assert_eq!(floor(with("pixel_std = [0.4, 0.7]\n", "")), 0.7);
        assert_eq!(
            floor(with("pixel_std = [0.4, 0.7]\n", "[association]\ncorner_std_floor_px = 0.2\n")),
            0.2
        );
    }
}

use crate::files::{Rig, SETTINGS};
use monorange_core::pipeline::Config;

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
    /// Whether it differs from the default.
    pub changed: bool,
}

impl Setup {
    /// That of a rig file.
    pub fn of_rig(rig: &Rig) -> Self {
        let defaults = Config::new(rig.settings.finder);
        let [height, tilt, roll, yaw, forward, left] = rig.finder.mount().parameters();
        let camera = rig.finder.camera();
        let words = format!(
            "Camera {}×{} px, focal length {:.1} px, {height:.3} m above the floor, tilt {:.2}°, roll {:.2}°, yaw {:.2}°, \
             lever arm {forward:.3}, {left:.3} m.",
            camera.width(),
            camera.height(),
            camera.focal().x,
            tilt.to_degrees(),
            roll.to_degrees(),
            yaw.to_degrees(),
        );
        let line = |setting: &crate::files::Setting| {
            let value = setting.value(&rig.settings);
            SettingLine {
                name: format!("{}.{}", setting.section, setting.key),
                changed: value != setting.value(&defaults),
                value,
                unit: setting.unit,
                help: setting.help,
            }
        };
        Self { words, settings: SETTINGS.iter().map(line).collect() }
    }
}

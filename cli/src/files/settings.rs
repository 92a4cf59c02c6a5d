//! The settings of a rig file's `[extract]`, `[filter]` and `[association]`, one to one those of the core.
use super::rig_section::Section;
use crate::Result;
use monorange_core::lines::ExtractConfig;

/// Every setting of the pipeline.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settings {
    /// What counts as an edge, a line and a floor corner.
    pub extract: ExtractConfig,
}

/// One setting: where it stands in the rig file, and what it means.
#[derive(Clone, Copy)]
pub struct Setting {
    /// `extract`, `filter` or `association`.
    pub section: &'static str,
    /// Its key there, as in the core.
    pub key: &'static str,
    /// Its unit, or what it counts.
    pub unit: &'static str,
    /// What it means, in a sentence.
    pub help: &'static str,
    access: Access,
}

type Get<T> = fn(&Settings) -> T;
type Put<T> = fn(&mut Settings, T);

#[derive(Clone, Copy)]
enum Access {
    Number(Get<f32>, Put<f32>),
    Count(Get<usize>, Put<usize>),
}

macro_rules! setting {
    ($section:ident . $key:ident : $kind:ident, $unit:literal, $help:literal) => {
        setting!($section.$key = $section.$key : $kind, $unit, $help)
    };
    ($section:ident . $key:ident = $($field:ident).+ : $kind:ident, $unit:literal, $help:literal) => {
        Setting {
            section: stringify!($section),
            key: stringify!($key),
            unit: $unit,
            help: $help,
            access: Access::$kind(|settings| settings.$($field).+, |settings, value| settings.$($field).+ = value),
        }
    };
}

/// All settings, in the order of the pipeline.
pub const SETTINGS: &[Setting] = &[
    setting!(extract.edge_threshold: Number, "grey levels/px", "Least gradient of an edge point along its dominant axis."),
    setting!(extract.opening: Count, "px", "Pixels in a row that an edge must fill to survive the opening, 1 to 9."),
    setting!(extract.floor_top: Number, "of the height", "Top of the region in which floor edges are looked for."),
    setting!(extract.floor_spread: Number, "rad", "Largest angle of a floor edge from the horizontal."),
    setting!(extract.vertical_spread: Number, "rad", "Largest angle of a vertical edge from the vertical."),
    setting!(extract.gravity_tolerance: Number, "rad", "Largest angle of a vertical line from gravity as the mount has it."),
    setting!(extract.direction_tolerance: Number, "rad", "Largest angle between an edge point's gradient and its line's normal."),
    setting!(extract.min_vertical_length: Number, "of the height", "Shortest vertical line."),
    setting!(extract.min_floor_length: Number, "of the height", "Shortest floor line."),
    setting!(extract.max_gap_px: Number, "px", "Longest gap within a line."),
    setting!(extract.reach_px: Number, "px", "Farthest that the end of either line may lie from their corner."),
    setting!(extract.overshoot_px: Number, "px", "Farthest that the vertical line may run on below the floor line."),
    setting!(extract.min_crossing: Number, "rad", "Least angle between the two lines of a corner."),
];

/// The sections that hold settings.
pub(super) const SECTIONS: [&str; 1] = ["extract"];

impl Setting {
    /// Its value, as one would write it.
    pub fn value(&self, settings: &Settings) -> String {
        match self.access {
            Access::Number(get, _) => get(settings).to_string(),
            Access::Count(get, _) => get(settings).to_string(),
        }
    }
}

/// The settings of a rig file over their defaults.
///
/// # Errors
/// Names the line of an unknown key (with the nearest known one), and of a value that cannot be used.
pub(super) fn read(root: &Section<'_>) -> Result<Settings> {
    let mut settings = Settings::default();
    for name in SECTIONS {
        let of_section = || SETTINGS.iter().filter(|setting| setting.section == name);
        let known: Vec<_> = of_section().map(|setting| setting.key).collect();
        let Some(section) = root.section(name, &known)? else { continue };
        for setting in of_section() {
            let Some(number) = section.number(setting.key)? else { continue };
            match setting.access {
                Access::Number(_, put) => put(&mut settings, number as f32),
                Access::Count(_, put) if number >= 0.0 && number.fract() == 0.0 => {
                    put(&mut settings, number as usize)
                }
                Access::Count(..) => {
                    return Err(section
                        .out_of_range(setting.key, number, "a whole number")
                        .help(setting.help));
                }
            }
        }
        check(&settings).map_err(|error| refused(&section, error))?;
    }
    Ok(settings)
}

fn check(settings: &Settings) -> monorange_core::Result<()> {
    settings.extract.validated().map(drop)
}

/// The core's refusal with the line of the key that it names.
fn refused(section: &Section<'_>, error: monorange_core::Error) -> crate::Error {
    match error {
        monorange_core::Error::OutOfRange { name, value, expected } => {
            let key = name.rsplit('.').next().unwrap_or(name);
            let help = SETTINGS.iter().find(|setting| setting.key == key).map_or("", |setting| setting.help);
            section.out_of_range(key, value, expected).help(help)
        }
        error => section.error("", error.to_string()),
    }
}

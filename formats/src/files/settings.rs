//! The settings of a rig file's `[extract]`, `[filter]` and `[association]`, one to one those of the core.
use super::rig_section::Section;
use crate::{Error, Result, nearest};
use monorange_core::{
    association::Gate,
    pipeline::{Carrier, Config, Model, MountError},
    slam::{Covariance, Pairing, Variant},
};

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

type Get<T> = fn(&Config) -> T;
type Put<T> = fn(&mut Config, T);

#[derive(Clone, Copy)]
enum Access {
    Number(Get<f32>, Put<f32>),
    Pair(Get<[f32; 2]>, Put<[f32; 2]>),
    Count(Get<usize>, Put<usize>),
    Few(Get<u32>, Put<u32>),
    /// One of some words, by its place among them.
    Choice(&'static [&'static str], Get<usize>, Put<usize>),
}

macro_rules! setting {
    ($section:ident . $key:ident = $($field:ident).+ : $kind:ident, $unit:literal, $help:literal) => {
        Setting {
            section: stringify!($section),
            key: stringify!($key),
            unit: $unit,
            help: $help,
            access: Access::$kind(|config| config.$($field).+, |config, value| config.$($field).+ = value),
        }
    };
    ($section:ident . $key:ident = $($field:ident).+ : $($word:literal => $value:path)|+, $help:literal) => {
        Setting {
            section: stringify!($section),
            key: stringify!($key),
            unit: "",
            help: $help,
            access: Access::Choice(
                &[$($word),+],
                |config| [$($value),+].iter().position(|value| *value == config.$($field).+).unwrap_or(0),
                |config, place| config.$($field).+ = [$($value),+].get(place).copied().unwrap_or_default(),
            ),
        }
    };
}

/// All settings, in the order of the pipeline.
#[rustfmt::skip]
pub const SETTINGS: &[Setting] = &[
    setting!(extract.edge_threshold = extract.edge_threshold: Number, "grey/px", "Least gradient of an edge point along its dominant axis."),
    setting!(extract.opening = extract.opening: Count, "px", "Pixels in a row that an edge must fill to survive the opening, 1 to 6."),
    setting!(extract.floor_top = extract.floor_top: Number, "of height", "Top of the region in which floor edges are looked for."),
    setting!(extract.floor_spread = extract.floor_spread: Number, "rad", "Largest angle of a floor edge from the horizontal."),
    setting!(extract.vertical_spread = extract.vertical_spread: Number, "rad", "Largest angle of a vertical edge from the vertical."),
    setting!(extract.gravity_tolerance = extract.gravity_tolerance: Number, "rad", "Largest angle of a vertical line from gravity as the mount has it."),
    setting!(extract.direction_tolerance = extract.direction_tolerance: Number, "rad", "Largest angle between an edge point's gradient and its line's normal."),
    setting!(extract.min_vertical_length = extract.min_vertical_length: Number, "of height", "Shortest vertical line."),
    setting!(extract.min_floor_length = extract.min_floor_length: Number, "of height", "Shortest floor line."),
    setting!(extract.max_width_px = extract.max_width_px: Number, "px", "Widest profile of a floor edge, as a Gaussian's deviation; 1.3 px of it the smoothing makes."),
    setting!(extract.max_gap_px = extract.max_gap_px: Number, "px", "Longest gap within a line."),
    setting!(extract.reach_px = extract.reach_px: Number, "px", "Farthest that the end of either line may lie from their corner."),
    setting!(extract.floor_reach_px = extract.floor_reach_px: Number, "px", "Farthest that the end of a floor line may lie from its corner."),
    setting!(extract.overshoot_px = extract.overshoot_px: Number, "px", "Farthest that the vertical line may run on below the floor line."),
    setting!(extract.skirting_height = extract.skirting_height: Number, "m", "Highest skirting board."),
    setting!(extract.min_bound_length = extract.min_bound_length: Number, "of height", "Shortest floor line that bounds the floor: below it nothing stands."),
    setting!(extract.min_crossing = extract.min_crossing: Number, "rad", "Least angle between the two lines of a corner."),

    setting!(filter.variant = filter.variant: "invariant" => Variant::Invariant | "textbook" => Variant::Textbook | "fej" => Variant::FirstEstimates, "Which filter: invariant is consistent on long loops, textbook is the paper's, fej takes Jacobians at first estimates."),
    setting!(filter.covariance = filter.covariance: "packed" => Covariance::Packed | "factored" => Covariance::Factored, "How the covariance is kept: packed is the fastest, factored stays positive for months."),
    setting!(filter.gate = filter.gate: "soft" => Gate::Soft | "hard" => Gate::Hard | "none" => Gate::Open, "What is done with a measurement beyond its gate: soft inflates its noise, hard drops it."),
    setting!(filter.gate_nis = filter.gate_nis: Pair, "", "The gate: largest normalised innovation squared for 1 and 2 degrees of freedom."),
    setting!(filter.model = model: "pixel" => Model::Pixel | "range_bearing" => Model::RangeBearing, "What the filter is told of a corner: its pixel, or range and bearing as in the paper."),
    setting!(filter.mount = mount_error: "estimated" => MountError::Estimated | "exact" => MountError::Exact, "What is done about the mount's own error: estimated along with the map, or taken as none."),
    setting!(filter.speed_by_speed = motion.speed_by_speed: Number, "", "Standard deviation of the odometry's speed, for each m/s."),
    setting!(filter.turn_by_turn = motion.turn_by_turn: Number, "", "Standard deviation of the odometry's turn rate, for each rad/s."),
    setting!(filter.turn_by_speed = motion.turn_by_speed: Number, "rad/m", "Standard deviation of the odometry's turn rate, for each m/s."),
    setting!(filter.slip_by_speed = motion.slip_by_speed: Number, "", "Standard deviation across the robot, for each metre driven (increments only)."),
    setting!(filter.speed_floor = motion.speed_floor: Number, "m/s", "Standard deviation of the odometry's speed at rest."),
    setting!(filter.turn_floor = motion.turn_floor: Number, "rad/s", "Standard deviation of the odometry's turn rate at rest."),

    setting!(association.corner_std_floor_px = corner_std_floor_px: Number, "px", "Least standard deviation of a corner: what calibration and undistortion leave."),
    setting!(association.min_depression = min_depression: Number, "rad", "Least angle below the horizon at which a corner is measured."),
    setting!(association.carrier = carrier: "floor" => Carrier::Floor | "free" => Carrier::Free | "map" => Carrier::Map, "What carries corners to the next picture: the floor's homography, the free one of eight parameters as in the paper, or none: the map alone."),
    setting!(association.pairing = map.pairing: "joint" => Pairing::Joint | "nearest" => Pairing::Nearest, "How corners and landmarks are paired: jointly compatible, or each with its nearest."),
    setting!(association.match_nis = map.match_nis: Pair, "", "Largest normalised innovation squared of a pair, for 1 and 2 degrees of freedom."),
    setting!(association.birth_nis = map.birth_nis: Number, "", "A new landmark's normalised innovation squared is above this to every other."),
    setting!(association.confirm = map.confirm: Few, "sightings", "Sightings that make a tentative landmark part of the map."),
    setting!(association.within = map.within: Few, "sightings", "Expected sightings within which that must happen."),
    setting!(association.forget = map.forget: Few, "frames", "Frames after which an unseen tentative landmark is deleted."),
    setting!(association.delete_after = map.delete_after: Few, "sightings", "Expected sightings in a row without one that delete a landmark; 0 is never."),
    setting!(association.merge_distance = map.merge_distance: Number, "m", "Landmarks closer than this may be one; 0 merges nothing."),
    setting!(association.merge_missed = map.merge_missed: Few, "sightings", "Expected sightings in a row that such a duplicate has missed."),
    setting!(association.joint_nodes = map.joint_nodes: Count, "nodes", "Nodes of the joint search."),
];

/// The sections that hold settings.
pub(super) const SECTIONS: [&str; 3] = ["extract", "filter", "association"];

impl Setting {
    /// Its value, as one would write it.
    pub fn value(&self, config: &Config) -> String {
        match self.access {
            Access::Number(get, _) => get(config).to_string(),
            Access::Pair(get, _) => format!("{:?}", get(config)),
            Access::Count(get, _) => get(config).to_string(),
            Access::Few(get, _) => get(config).to_string(),
            Access::Choice(words, get, _) => words.get(get(config)).unwrap_or(&"").to_string(),
        }
    }

    /// Its value as a rig file has it.
    pub fn toml(&self, config: &Config) -> String {
        match self.access {
            Access::Number(get, _) => format!("{:?}", get(config)),
            Access::Choice(..) => format!("\"{}\"", self.value(config)),
            _ => self.value(config),
        }
    }

    /// Takes the value of a section that has its key.
    fn read(&self, section: &Section<'_>, config: &mut Config) -> Result<()> {
        let whole = |most: f64| {
            let number = section.number(self.key)?.unwrap_or_default();
            let sound = number >= 0.0 && number.fract() == 0.0 && number <= most;
            sound
                .then_some(number)
                .ok_or_else(|| section.out_of_range(self.key, number, "a whole number").help(self.help))
        };
        match self.access {
            Access::Number(_, put) => put(config, section.number(self.key)?.unwrap_or_default() as f32),
            Access::Pair(_, put) => {
                let pair = section.pair(self.key)?.unwrap_or_default();
                put(config, pair.map(|number| number as f32));
            }
            Access::Count(_, put) => put(config, whole(1e9)? as usize),
            Access::Few(_, put) => put(config, whole(1e9)? as u32),
            Access::Choice(words, _, put) => {
                let word = section.string(self.key)?.unwrap_or_default();
                let place = words.iter().position(|known| *known == word).ok_or_else(|| {
                    let cause = format!(
                        "`{}.{}` is \"{word}\", must be one of {}",
                        self.section,
                        self.key,
                        words.join(", ")
                    );
                    let closest = nearest(word, words.iter().copied()).unwrap_or_default();
                    section.error(self.key, cause).help(format!("the nearest one is \"{closest}\""))
                })?;
                put(config, place);
            }
        }
        Ok(())
    }
}

/// The settings of a rig file over their defaults.
///
/// # Errors
/// Names the line of an unknown key (with the nearest known one), and of a value that cannot be used.
pub(super) fn read(root: &Section<'_>, defaults: Config) -> Result<Config> {
    let mut config = defaults;
    for name in SECTIONS {
        let of_section = || SETTINGS.iter().filter(|setting| setting.section == name);
        let known: Vec<_> = of_section().map(|setting| setting.key).collect();
        let Some(section) = root.section(name, &known)? else { continue };
        for setting in of_section().filter(|setting| section.has(setting.key)) {
            setting.read(&section, &mut config)?;
        }
        config.validated().map(drop).map_err(|error| refused(&section, error))?;
    }
    Ok(config)
}

/// The core's refusal with the line of the key that it names.
fn refused(section: &Section<'_>, error: monorange_core::Error) -> Error {
    match error {
        monorange_core::Error::OutOfRange { name, value, expected } => {
            let key = name.rsplit('.').next().unwrap_or(name);
            let help = SETTINGS.iter().find(|setting| setting.key == key).map_or("", |setting| setting.help);
            section.out_of_range(key, value, expected).help(help)
        }
        error => section.error("", error.to_string()),
    }
}

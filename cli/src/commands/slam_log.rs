//! `slam-log`: the filter alone, on the log of any sensor of ranges and bearings.
use super::results;
use crate::outputs::Outputs;
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use monorange_core::association::Gate;
use monorange_core::geometry::Pose;
use monorange_core::pipeline;
use monorange_core::setting::{Choice, Reference, Setting, Value};
use monorange_core::slam::Variant;
use monorange_formats::{
    Error, Result,
    evaluation::{Align, Alignment, MAX_TRUTH_GAP, MapPairing, Truth, map_errors, trajectory_errors},
    files::{self, MapPoint, Odometry, in_words},
    plausibility,
    report::{OUTPUTS, Observation, Run, SettingLine, Setup, Subject},
    sensor_log::{self, Association, Dataset, LogResult, ObservationRow, Recording, SensorLog, Settings},
};
use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
};

/// Trajectory and map from a log of odometry and of ranges and bearings to landmarks.
///
/// Measurements are CSV: `t,range,bearing`, with or without `id,var_range,var_bearing`; an empty range is a bearing
/// alone, an empty bearing a range alone (which needs names). Predictions run to each measurement's own time. The
/// world is the robot's first pose, to which truth is moved. The files are those of `slam`.
///
/// Public logs are read as they are published with --dataset and --from, each with the noise that was measured on
/// it: mrclam (a folder and the robot's --number), victoria-park (its factor-graph text), plaza (a folder and the
/// log's --number).
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange simulate --scene corridor --frames 30 --out corridor-30
  monorange slam --rig corridor-30/rig.toml --frames corridor-30/frames \\
    --odometry corridor-30/odometry.csv --out corridor-30/slam
  # The camera as a range finder: what it measured, given to the filter as any sensor's.
  monorange slam-log --odometry corridor-30/odometry.csv --measurements corridor-30/slam/observations.csv \\
    --truth corridor-30/truth.tum --out corridor-30/slam-log")]
pub struct Arguments {
    /// Odometry (CSV `t,v,omega` or `t,dx,dy,dtheta`, or poses as TUM or `t,x,y,heading`).
    #[arg(long, value_name = "FILE", required_unless_present = "dataset")]
    odometry: Option<PathBuf>,
    /// Measurements (CSV `t,range,bearing[,id][,var_range,var_bearing]`).
    #[arg(long, value_name = "FILE", required_unless_present = "dataset")]
    measurements: Option<PathBuf>,
    /// A public log's format, instead of the two files above.
    #[arg(long, value_enum, value_name = "NAME", requires = "from", conflicts_with_all = ["odometry", "measurements"])]
    dataset: Option<Dataset>,
    /// Where the dataset is.
    #[arg(long, value_name = "PATH", requires = "dataset")]
    from: Option<PathBuf>,
    /// Which robot or log of the dataset.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "dataset")]
    number: u32,
    /// True trajectory (TUM or CSV), for the report.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// True landmarks (CSV `id,x,y`), for the report.
    #[arg(long, value_name = "FILE", requires = "truth")]
    true_map: Option<PathBuf>,
    /// Whether the names of the column `id` are used; they are where there are any.
    #[arg(long, value_enum)]
    association: Option<Association>,
    #[arg(long, value_name = "NAME", default_value = "invariant", help = help("filter.variant"), value_parser = choice_parser::<Variant>())]
    filter: Variant,
    #[arg(long, value_name = "NAME", default_value = "soft", help = help("filter.gate"), value_parser = choice_parser::<Gate>())]
    gate: Gate,
    /// What the sensor reads too much, m: it is taken off every range.
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = finite)]
    range_offset: Option<f64>,
    /// Of a range, m, where the log gives no variance.
    #[arg(long, value_name = "METRES", value_parser = at_least_zero)]
    range_std: Option<f64>,
    /// Of a range, as a share of it; added to --range-std as independent noise.
    #[arg(long, value_name = "SHARE", value_parser = at_least_zero)]
    range_share: Option<f64>,
    /// Of a bearing, rad, where the log gives no variance.
    #[arg(long, value_name = "RADIANS", value_parser = at_least_zero)]
    bearing_std: Option<f64>,
    /// Of the way ahead after a second, m; it grows with the root of time.
    #[arg(long, value_name = "METRES", value_parser = at_least_zero)]
    speed_std: Option<f64>,
    /// Of the way sideways after a second, m.
    #[arg(long, value_name = "METRES", value_parser = at_least_zero)]
    slip_std: Option<f64>,
    /// Of the heading after a second, rad.
    #[arg(long, value_name = "RADIANS", value_parser = at_least_zero)]
    turn_std: Option<f64>,
    /// What a metre driven adds to the way ahead, m; it grows with the root of the way.
    #[arg(long, value_name = "METRES", value_parser = at_least_zero)]
    speed_growth: Option<f64>,
    /// What a radian turned adds to the heading, rad; it grows with the root of the turn.
    #[arg(long, value_name = "RADIANS", value_parser = at_least_zero)]
    turn_growth: Option<f64>,
    /// Share by which the odometry reads every way too long or too short, which the filter estimates; with this and the next two 0
    /// it is taken to be right on average.
    #[arg(long, value_name = "SHARE", value_parser = at_least_zero)]
    speed_scale: Option<f64>,
    /// Share by which it reads every turn too large or too small.
    #[arg(long, value_name = "SHARE", value_parser = at_least_zero)]
    turn_scale: Option<f64>,
    /// Turn that it leaves out for each metre driven, rad/m.
    #[arg(long, value_name = "RADIANS", value_parser = at_least_zero)]
    turn_bias: Option<f64>,
    /// Without names: a landmark nearer than this is expected to be seen, m.
    #[arg(long, value_name = "METRES", value_parser = at_least_zero)]
    view_range: Option<f64>,
    /// Without names: and within this bearing to either side, rad.
    #[arg(long, value_name = "RADIANS", value_parser = at_least_zero)]
    view_angle: Option<f64>,
    #[arg(long, value_name = "METRES", help = help("association.merge_distance"), value_parser = in_range("association.merge_distance"))]
    merge_distance: Option<f64>,
    #[arg(long, value_name = "NUMBER", help = help("association.confirm"), value_parser = whole_in_range("association.confirm"))]
    confirm: Option<u32>,
    #[arg(long, value_name = "FRAMES", help = help("association.delete_after"), value_parser = whole_in_range("association.delete_after"))]
    delete_after: Option<u32>,
    #[arg(long, value_name = "NUMBER", help = help("association.density"), value_parser = in_range("association.density"))]
    density: Option<f64>,
    #[arg(long, value_name = "NUMBER", help = help("association.ambiguity"), value_parser = in_range("association.ambiguity"))]
    ambiguity: Option<f64>,
    #[arg(long, value_name = "NIS", help = help("association.birth_nis"), value_parser = in_range("association.birth_nis"))]
    birth_nis: Option<f64>,
    /// Landmarks that there is room for.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    max_landmarks: Option<u16>,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = "monorange-slam-log")]
    out: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Landmarks without names are the same as true ones at most this far away, m: `evaluate`'s default.
const MAP_GATE: f64 = 0.5;

/// The row of the core's table.
fn row(name: &str) -> (&'static Setting, &'static Reference) {
    let found = pipeline::settings().find(|(setting, _)| setting.name == name);
    found.unwrap_or_else(|| unreachable!("{name} is a row of the table, as `--help` in a test shows"))
}

fn help(name: &str) -> String {
    let (setting, reference) = row(name);
    let without_names = if setting.section() == "association" { "Without names: " } else { "" };
    match setting.most > setting.least {
        true => format!("{without_names}{} [{}]", reference.help, setting.expected),
        false => reference.help.to_owned(),
    }
}

fn in_range(name: &'static str) -> impl Fn(&str) -> std::result::Result<f64, String> + Clone {
    let (setting, _) = row(name);
    move |text| {
        let number = text.parse::<f64>().ok();
        let sound = number.filter(|number| setting.check(Value::Number(*number as f32)).is_ok());
        sound.ok_or_else(|| format!("must be a number {}", setting.expected))
    }
}

fn whole_in_range(name: &'static str) -> impl Fn(&str) -> std::result::Result<u32, String> + Clone {
    let (setting, _) = row(name);
    move |text| {
        let number = text.parse::<u32>().ok();
        let sound = number.filter(|number| setting.check(Value::Whole(*number)).is_ok());
        sound.ok_or_else(|| format!("must be a whole number {}", setting.expected))
    }
}

/// Takes one of the words that a rig file has for this choice.
fn choice_parser<C: Choice + Copy + Default + Send + Sync + 'static>() -> impl TypedValueParser<Value = C> {
    let words = C::default().words();
    PossibleValuesParser::new(words).map(move |word| {
        let mut choice = C::default();
        let place = words.iter().position(|known| *known == word).unwrap_or_default();
        choice.set(place as u8);
        choice
    })
}

fn word(choice: &dyn Choice) -> String {
    in_words(Value::Choice(choice.place(), choice.words()))
}

fn finite(text: &str) -> std::result::Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| "must be a finite number".to_owned())
}

fn at_least_zero(text: &str) -> std::result::Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite() && *number >= 0.0);
    number.ok_or_else(|| "must be a number of at least 0".to_owned())
}

/// Runs the command.
///
/// # Errors
/// When a file is missing, malformed or does not fit the others, or nothing can be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut recording = arguments.recording()?;
    let settings = arguments.settings(&recording.log)?;
    let left_out = arguments.leave_out_unnamed(&mut recording.log, &settings);
    crate::warnings::say();
    let mut outputs = Outputs::of_a_run(&arguments.out, &OUTPUTS, "report.json")?;
    let result = sensor_log::run(&recording.log, &settings)?;
    let mut run = arguments.report(&recording, &settings, result)?;
    run.left_out.extend(left_out);
    results::write(&mut outputs, &mut run)?;
    outputs.commit()?;
    results::print(&run, &arguments.out, arguments.json)
}

impl Arguments {
    fn recording(&self) -> Result<Recording> {
        let mut recording = match (self.dataset, &self.from, &self.odometry, &self.measurements) {
            (Some(dataset), Some(path), ..) => dataset.read(path, self.number)?,
            (_, _, Some(odometry_path), Some(path)) => {
                let odometry = Odometry::read(odometry_path)?;
                let sightings = sensor_log::read_sightings(path)?;
                let times: Vec<_> = sightings.iter().map(|sighting| sighting.time).collect();
                odometry.check_cover(odometry_path, &times)?;
                plausibility::check_ranges_by_way(path, &sightings, |from, to| odometry.way(from, to));
                plausibility::check_bearings_by_turns(path, &sightings, |from, to| odometry.step(from, to));
                let log = SensorLog { odometry, sightings };
                Recording { log, truth: Vec::new(), true_map: Vec::new() }
            }
            _ => return Err(Error::new("neither a log nor a dataset is named").help("see --help")),
        };
        if let Some(path) = &self.truth {
            recording.truth = files::read_trajectory(path)?;
        }
        if let Some(path) = &self.true_map {
            recording.true_map = files::read_map(path)?;
        }
        Ok(recording)
    }

    /// With names, a measurement without one cannot be used.
    fn leave_out_unnamed(&self, log: &mut SensorLog, settings: &Settings) -> Option<String> {
        let all = log.sightings.len();
        let named = log.sightings.iter().filter(|sighting| sighting.id.is_some()).count();
        if settings.association == Association::Unknown || named == 0 || named == all {
            return None;
        }
        log.sightings.retain(|sighting| sighting.id.is_some());
        let words = format!("{} of {all} measurements have no `id`", all - named);
        let path = self.measurements.as_deref().unwrap_or(Path::new("the log"));
        Error::new(&words)
            .at(path)
            .help("they are left out; use all of them with --association unknown")
            .warn();
        Some(words)
    }

    fn settings(&self, log: &SensorLog) -> Result<Settings> {
        let mut settings = self.dataset.map_or_else(Settings::default, Dataset::settings);
        let named = log.sightings.iter().any(|sighting| sighting.id.is_some());
        settings.association =
            self.association.unwrap_or(if named { Association::Known } else { Association::Unknown });
        (settings.filter.variant, settings.filter.gate) = (self.filter, self.gate);
        let set = |value: &mut f64, given: Option<f64>| *value = given.unwrap_or(*value);
        set(&mut settings.range_offset, self.range_offset);
        set(&mut settings.range_std[0], self.range_std);
        set(&mut settings.range_std[1], self.range_share);
        set(&mut settings.bearing_std, self.bearing_std);
        set(&mut settings.speed_std, self.speed_std);
        set(&mut settings.slip_std, self.slip_std);
        set(&mut settings.turn_std, self.turn_std);
        set(&mut settings.growth[0], self.speed_growth);
        set(&mut settings.growth[1], self.turn_growth);
        set(&mut settings.scale_std[0], self.speed_scale);
        set(&mut settings.scale_std[1], self.turn_scale);
        set(&mut settings.scale_std[2], self.turn_bias);
        set(&mut settings.map.view.far, self.view_range);
        set(&mut settings.map.view.half_angle, self.view_angle);
        set(&mut settings.map.merge_distance, self.merge_distance);
        set(&mut settings.map.birth_nis, self.birth_nis);
        set(&mut settings.map.density, self.density);
        settings.map.confirm = self.confirm.unwrap_or(settings.map.confirm);
        settings.map.delete_after = self.delete_after.unwrap_or(settings.map.delete_after);
        set(&mut settings.map.ambiguity, self.ambiguity);
        settings.landmarks = self.max_landmarks.map_or(settings.landmarks, usize::from);
        let unknown =
            |index: usize| log.sightings.iter().any(|sighting| sighting.variances.get(index) == Some(&None));
        if settings.range_std == [0.0; 2] && unknown(0) {
            return Err(Error::new("--range-std 0 says that ranges are exact")
                .help("give their standard deviation in metres; the default is 0.1"));
        }
        if settings.bearing_std == 0.0 && unknown(1) {
            return Err(Error::new("--bearing-std 0 says that bearings are exact")
                .help("give their standard deviation in radians; the default is 0.02"));
        }
        Ok(settings)
    }

    fn report(&self, recording: &Recording, settings: &Settings, result: LogResult) -> Result<Run> {
        let LogResult { trajectory, map, observations, verdict, reason, health, no_room, beyond } = result;
        let start = trajectory.first().map_or(0.0, |stamped| stamped.time);
        let truth = Truth::new(&recording.truth, MAX_TRUTH_GAP);
        let map_from_world = match recording.truth.as_slice() {
            [] => Pose::default(),
            _ => truth.map_from_world(start, &trajectory).ok_or_else(|| {
                self.truth.iter().fold(results::no_common_pose(start), |error, path| error.at(path))
            })?,
        };
        let mut pairs = truth.pairs(&trajectory);
        for pair in &mut pairs {
            pair.truth = map_from_world.compose(&pair.truth);
        }
        let moved =
            |point: &MapPoint| MapPoint { position: map_from_world.transform(point.position), ..*point };
        let true_map: Vec<_> = recording.true_map.iter().map(moved).collect();
        let pairing = match settings.association {
            Association::Known => MapPairing::Names,
            Association::Unknown => MapPairing::Closest(MAP_GATE),
        };
        let times = recording.log.sightings.chunk_by(|a, b| a.time == b.time).count();
        let frames_used = observations.chunk_by(|a, b| a.frame == b.frame).count();
        Ok(Run {
            title: self.title(),
            command: std::env::args().collect::<Vec<_>>().join(" "),
            subject: Subject::Measurements,
            setup: Setup { words: String::new(), settings: setting_lines(settings) },
            frames: times,
            frames_used,
            left_out: (beyond > 0)
                .then(|| format!("{beyond} measurements lie beyond the ends of the odometry"))
                .into_iter()
                .collect(),
            errors: (!pairs.is_empty()).then(|| trajectory_errors(&pairs, Align::None, 1.0)),
            map_errors: (!true_map.is_empty())
                .then(|| map_errors(&map, &true_map, &Alignment::NONE, pairing)),
            pairs,
            trajectory,
            map,
            true_map: true_map.iter().map(|point| point.position).collect(),
            laser: Vec::new(),
            observations: observations.iter().map(observation).collect(),
            without_range: 0,
            no_room,
            warnings: Vec::new(),
            knocked: Vec::new(),
            unmeasured: None,
            carried: None,
            in_map: None,
            verdict,
            reason,
            mean_nis: health.mean_nis() as f32,
            stages: Vec::new(),
            shots: Vec::new(),
        })
    }

    fn title(&self) -> String {
        let name = |path: &Path| path.file_name().unwrap_or(OsStr::new("log")).to_string_lossy().into_owned();
        match (self.dataset, &self.from, &self.measurements) {
            (Some(Dataset::VictoriaPark), Some(path), _) | (None, _, Some(path)) => name(path),
            (_, Some(path), _) => format!("{} {}", name(path), self.number),
            _ => String::new(),
        }
    }
}

fn observation(row: &ObservationRow) -> Observation {
    let ObservationRow { sighting, frame, outcome } = row;
    Observation {
        time: sighting.time,
        frame: *frame as usize,
        pixel: None,
        pixel_covariance: None,
        range: sighting.range.map(|range| range as f32),
        bearing: sighting.bearing.map(|bearing| bearing as f32),
        landmark: outcome.landmark,
        decision: outcome.decision,
        nis: outcome.nis.map(|nis| nis as f32),
    }
}

/// The settings under the names of their flags.
fn setting_lines(settings: &Settings) -> Vec<SettingLine> {
    let defaults = Settings::default();
    let association = |settings: &Settings| match settings.association {
        Association::Known => "known",
        Association::Unknown => "unknown",
    };
    type Text<'a> = &'a dyn Fn(&Settings) -> String;
    let own: [(&str, Text<'_>, &'static str, &'static str); 16] = [
        ("association", &|s| association(s).to_owned(), "", "whether the names of the log are used"),
        ("range-offset", &|s| s.range_offset.to_string(), "m", "what the sensor reads too much"),
        ("range-std", &|s| s.range_std[0].to_string(), "m", "of a range, where the log gives no variance"),
        ("range-share", &|s| s.range_std[1].to_string(), "", "of a range, as a share of it"),
        (
            "bearing-std",
            &|s| s.bearing_std.to_string(),
            "rad",
            "of a bearing, where the log gives no variance",
        ),
        ("speed-std", &|s| s.speed_std.to_string(), "m/√s", "of the way ahead after a second"),
        ("slip-std", &|s| s.slip_std.to_string(), "m/√s", "of the way sideways after a second"),
        ("turn-std", &|s| s.turn_std.to_string(), "rad/√s", "of the heading after a second"),
        ("speed-growth", &|s| s.growth[0].to_string(), "m/√m", "what a metre adds to the way ahead"),
        ("turn-growth", &|s| s.growth[1].to_string(), "rad/√rad", "what a radian adds to the heading"),
        ("speed-scale", &|s| s.scale_std[0].to_string(), "", "by which ways are read too long or too short"),
        ("turn-scale", &|s| s.scale_std[1].to_string(), "", "by which turns are read too large or too small"),
        ("turn-bias", &|s| s.scale_std[2].to_string(), "rad/m", "what a metre leaves out of the turn"),
        ("view-range", &|s| s.map.view.far.to_string(), "m", "landmarks nearer than this are expected"),
        ("view-angle", &|s| s.map.view.half_angle.to_string(), "rad", "and within this bearing"),
        ("max-landmarks", &|s| s.landmarks.to_string(), "", "landmarks that there is room for"),
    ];
    let of_table: [(&str, Text<'_>, &str); 8] = [
        ("filter", &|s| word(&s.filter.variant), "filter.variant"),
        ("gate", &|s| word(&s.filter.gate), "filter.gate"),
        ("merge-distance", &|s| s.map.merge_distance.to_string(), "association.merge_distance"),
        ("confirm", &|s| s.map.confirm.to_string(), "association.confirm"),
        ("delete-after", &|s| s.map.delete_after.to_string(), "association.delete_after"),
        ("density", &|s| s.map.density.to_string(), "association.density"),
        ("ambiguity", &|s| s.map.ambiguity.to_string(), "association.ambiguity"),
        ("birth-nis", &|s| s.map.birth_nis.to_string(), "association.birth_nis"),
    ];
    let line = |name: &str, text: Text<'_>, unit, help| SettingLine {
        name: name.to_owned(),
        value: text(settings),
        changed: text(settings) != text(&defaults),
        unit,
        help,
        origin: "",
    };
    let own = own.into_iter().map(|(name, text, unit, help)| line(name, text, unit, help));
    let of_table =
        of_table.into_iter().map(|(name, text, of)| line(name, text, row(of).0.unit, row(of).1.help));
    own.chain(of_table).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_stands_once_in_the_report() {
        let lines = setting_lines(&Settings::default());
        let names: std::collections::BTreeSet<_> = lines.iter().map(|line| line.name.as_str()).collect();
        assert_eq!(names.len(), lines.len(), "{names:?}");
        assert!(lines.iter().all(|line| !line.help.is_empty() && !line.changed));
    }
}

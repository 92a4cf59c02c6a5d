use super::{
    camera::{Intrinsics, read_camera_of},
    rig_section::{Section, Source},
    settings,
};
use crate::{Error, Result, plausibility};
use monorange_core::geometry::{Camera, Lens, MOUNT_STD_BY_HAND, Mount, RangeFinder};
use monorange_core::pipeline::{Config, MotionNoise};
#[cfg(feature = "proposals")]
use monorange_core::pipeline::{CornersFrom, MotionFrom};
use nalgebra::Matrix2;
use std::{
    io::{self, Write},
    path::Path,
};
use toml::de::DeTable;

/// A rig file: the camera, how it sits on the robot, and how well both are known.
///
/// ```toml
/// [camera]                     # or: camera_info = "camera.yaml"  (ROS camera_info, OpenCV YAML/XML, Kalibr camchain)
/// width = 320
/// height = 240
/// focal = [365.12674, 365.02905]
/// principal = [145.79917, 114.50956]
///
/// [mount]
/// height = 0.40
/// tilt_deg = 12.0
/// ```
///
/// Where a standard deviation of the mount is not given, the mount counts as measured by hand ([`MOUNT_STD_BY_HAND`]).
#[derive(Clone, Debug)]
pub struct Rig {
    /// Camera and mount.
    pub finder: RangeFinder<f64>,
    /// Standard deviation of (u, v), px.
    pub pixel_std: [f64; 2],
    /// Standard deviations of the mount, in the order of
    /// [`MOUNT_PARAMETERS`](monorange_core::geometry::MOUNT_PARAMETERS): m and rad.
    pub mount_std: [f64; 6],
    /// Which of them the rig file does not give: they are [`MOUNT_STD_BY_HAND`].
    pub assumed_std: [bool; 6],
    /// Whether the rig file leaves open what finds corners: a host may then take the best it has.
    pub assumed_corners: bool,
    /// Whether the rig file says nothing of what the wheels read wrongly all the time.
    pub assumed_wheels: bool,
    /// Settings of the pipeline.
    pub settings: Config,
}

/// Keys of the outermost table besides the settings' sections.
const ROOT: [&str; 3] = ["camera_info", "camera", "mount"];
const CAMERA: &[&str] =
    &["camera_info", "width", "height", "focal", "principal", "skew", "lens", "distortion", "pixel_std"];
/// The mount's keys in the order of its parameters: value, standard deviation, and the factor to SI units.
pub const MOUNT_KEYS: [(&str, &str, f64); 6] = [
    ("height", "height_std", 1.0),
    ("tilt_deg", "tilt_std_deg", DEGREE),
    ("roll_deg", "roll_std_deg", DEGREE),
    ("yaw_deg", "yaw_std_deg", DEGREE),
    ("forward", "forward_std", 1.0),
    ("left", "left_std", 1.0),
];
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Pixel noise where the rig does not say: what a sub-pixel corner has in an average picture.
const PIXEL_STD: f64 = 0.3;

impl Rig {
    /// A rig with the default settings. A calibration that leaves more than the default floor of a corner's standard deviation
    /// raises it.
    ///
    /// # Errors
    /// When a number does not fit into 32 bits.
    pub fn new(finder: RangeFinder<f64>, pixel_std: [f64; 2], mount_std: [f64; 6]) -> Result<Self> {
        let [height, tilt, roll, yaw, ..] = mount_std.map(|std| std as f32);
        let single = finder.cast().map_err(Error::new)?;
        let mut settings = Config { mount_std: [height, tilt, roll, yaw], ..Config::new(single) };
        for std in pixel_std {
            settings.corner_std_floor_px = settings.corner_std_floor_px.max(std as f32);
        }
        Ok(Self {
            finder,
            pixel_std,
            mount_std,
            assumed_std: [false; 6],
            assumed_corners: true,
            assumed_wheels: true,
            settings,
        })
    }

    /// What a host does with a drive: corners from the best that it has, and the wheels' errors estimated, unless the rig file says
    /// otherwise; motion from the pictures where there are no `wheels`.
    #[cfg(feature = "proposals")]
    pub fn on_a_host(&self, wheels: bool) -> Config {
        let motion_from = if wheels { self.settings.motion_from } else { MotionFrom::Pictures };
        let corners_from =
            if self.assumed_corners { CornersFrom::Proposals } else { self.settings.corners_from };
        // Without wheels nothing tells of their errors.
        let motion = if wheels { self.motion_on_a_host() } else { self.settings.motion.without_scales() };
        Config { motion_from, motion, corners_from, ..self.settings }
    }

    /// What a co-processor is told: [`on_a_host`](Self::on_a_host) but for the corners, which it finds as it can.
    pub fn on_a_device(&self) -> Config {
        Config { motion: self.motion_on_a_host(), ..self.settings }
    }

    fn motion_on_a_host(&self) -> MotionNoise {
        if self.assumed_wheels { self.settings.motion.with_scales() } else { self.settings.motion }
    }

    /// The rig in a TOML file; a camera file that it names is looked for beside it.
    ///
    /// # Errors
    /// Names the file, the line and the key: unknown (with the nearest known one), missing, of the wrong kind,
    /// not finite, or out of its range.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_of(path, None)
    }

    /// As [`read`](Self::read), with camera `number` (from 0) of those in the camera file that the rig names.
    ///
    /// # Errors
    /// As [`read`](Self::read), and when there is no such camera.
    pub fn read_of(path: &Path, number: Option<usize>) -> Result<Self> {
        Self::parse_of(path, &super::read_text(path)?, number)
    }

    /// The rig in `text`, which came from `path`.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        Self::parse_of(path, text, None)
    }

    fn parse_of(path: &Path, text: &str, number: Option<usize>) -> Result<Self> {
        let source = Source { path, text };
        let document = DeTable::parse(text).map_err(|error| not_toml(&source, &error))?;
        let known: Vec<_> = ROOT.into_iter().chain(settings::sections()).collect();
        let root = Section::root(&source, document.get_ref(), &known)?;
        let (camera, pixel_std) = camera(&root, path, number)?;
        let (mount, given_std) = mount(&root)?;
        let mut mount_std = MOUNT_STD_BY_HAND;
        for (std, given) in mount_std.iter_mut().zip(given_std) {
            *std = given.unwrap_or(*std);
        }
        let rig = Self::new(RangeFinder::new(camera, mount), pixel_std, mount_std)?;
        plausibility::check_mount(path, &rig.finder, &rig.mount_std);
        let assumed_std = given_std.map(|given| given.is_none());
        let assumed_corners = !root.has_in("extract", "corners");
        let of_wheels = ["speed_scale", "turn_scale", "turn_bias"];
        let assumed_wheels = !of_wheels.iter().any(|key| root.has_in("filter", key));
        Ok(Self {
            settings: settings::read(&root, rig.settings)?,
            assumed_std,
            assumed_corners,
            assumed_wheels,
            ..rig
        })
    }

    /// Writes camera and mount as a rig file.
    ///
    /// # Errors
    /// When writing fails.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let camera = self.finder.camera();
        writeln!(out, "[camera]\nwidth = {}\nheight = {}", camera.width(), camera.height())?;
        writeln!(out, "focal = [{:?}, {:?}]", camera.focal().x, camera.focal().y)?;
        writeln!(out, "principal = [{:?}, {:?}]", camera.principal().x, camera.principal().y)?;
        writeln!(out, "skew = {:?}", camera.skew())?;
        if let Lens::Equidistant(_) = camera.lens() {
            writeln!(out, "lens = \"equidistant\"")?;
        }
        writeln!(out, "distortion = {:?}", camera.lens().coefficients())?;
        writeln!(out, "pixel_std = {:?}\n\n[mount]", self.pixel_std)?;
        let values = self.finder.mount().parameters().into_iter().zip(self.mount_std);
        for ((key, std_key, unit), (value, std)) in MOUNT_KEYS.into_iter().zip(values) {
            // Degrees of a number that was written in degrees: the nearest short one.
            let [value, std] = [value, std].map(|number| ((number / unit) * 1e9).round() / 1e9);
            writeln!(out, "{key} = {value:?}\n{std_key} = {std:?}")?;
        }
        Ok(())
    }

    /// The covariance of a pixel, px².
    pub fn pixel_covariance(&self) -> Matrix2<f64> {
        Matrix2::from_diagonal(&self.pixel_std.map(|std| std * std).into())
    }
}

/// The text of a rig file with another mount and its standard deviations (0: unchanged), every other line as it is;
/// `out` is where it will stand, so that a camera file that it names is still found.
///
/// # Errors
/// When the text is not a rig file's.
pub fn with_mount(path: &Path, text: &str, out: &Path, mount: &Mount<f64>, std: [f64; 6]) -> Result<String> {
    let mut document: toml_edit::DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| Error::new(error.message()).at(path))?;
    let section = document.entry("mount").or_insert(toml_edit::table());
    for ((key, std_key, unit), (value, std)) in
        MOUNT_KEYS.into_iter().zip(mount.parameters().into_iter().zip(std))
    {
        if std > 0.0 {
            for (key, number) in [(key, value), (std_key, std)] {
                section[key] = toml_edit::value(((number / unit) * 1e6).round() / 1e6);
            }
        }
    }
    let folder = |path: &Path| std::path::absolute(path.parent().unwrap_or(Path::new(""))).ok();
    if folder(path) != folder(out) {
        for holder in ["camera", ""] {
            let item = if holder.is_empty() {
                document.get_mut("camera_info")
            } else {
                document.get_mut(holder).and_then(|camera| camera.get_mut("camera_info"))
            };
            let Some(item) = item else { continue };
            let file = item.as_str().and_then(|file| Some(folder(path)?.join(file)));
            if let Some(file) = file {
                *item = toml_edit::value(file.display().to_string());
            }
        }
    }
    Ok(document.to_string())
}

/// What a file that is no TOML looks like.
fn not_toml(source: &Source<'_>, error: &toml::de::Error) -> Error {
    let Source { path, text } = *source;
    let words = [
        "camera_matrix",
        "image_width",
        "intrinsics",
        "%YAML",
        "opencv_storage",
        "distortion_model",
        "Camera.fx",
    ];
    if words.iter().any(|word| text.contains(word)) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        return Error::new("is a camera file; a rig (TOML) is wanted here").at(path).help(format!(
            "write a rig file with the lines: camera_info = \"{name}\", [mount], height = 0.4, tilt_deg = 12.0"
        ));
    }
    let start = error.span().map_or(0, |span| span.start);
    let line = source.line(start);
    let content = text.lines().nth((line - 1) as usize).unwrap_or_default();
    Error::new(error.message()).at_line(path, line).help(match content.contains('\\') {
        true => {
            "a backslash begins an escape in double quotes: put the path in single quotes, or write slashes"
        }
        false => "a rig file is TOML: `key = value` under [camera] and [mount]",
    })
}

fn camera(root: &Section<'_>, path: &Path, number: Option<usize>) -> Result<(Camera<f64>, [f64; 2])> {
    let section = root.section("camera", CAMERA)?;
    let given = match &section {
        Some(section) => section,
        None if root.has("camera_info") => root,
        None => {
            return Err(root.missing("camera", "add a section [camera], or camera_info = \"camera.yaml\""));
        }
    };
    let pixel_std = given.pair("pixel_std")?.unwrap_or([PIXEL_STD; 2]);
    if let Some(std) = pixel_std.into_iter().find(|std| *std <= 0.0) {
        return Err(given.out_of_range("pixel_std", std, "above 0 (pixels)"));
    }
    let file = match root.string("camera_info")? {
        Some(file) => Some(file),
        None => given.string("camera_info")?,
    };
    let intrinsics = match file {
        Some(file) => {
            // A file that does not say the picture's size leaves it to the rig.
            let size = match &section {
                Some(section) if section.has("width") && section.has("height") => {
                    Some([size_of(section, "width")?, size_of(section, "height")?])
                }
                _ => None,
            };
            let both = if size.is_some() { &CAMERA[3..8] } else { &CAMERA[1..8] };
            if let Some(key) = both.iter().find(|key| section.as_ref().is_some_and(|s| s.has(key))) {
                let error = given.error(key, format!("`camera.{key}` is given here and by camera_info"));
                return Err(error.help("keep one of them"));
            }
            read_camera_of(&path.parent().unwrap_or(Path::new("")).join(file), number, size)?
        }
        None if number.is_some_and(|number| number > 0) => {
            let error = given.error("", "the rig holds its one camera itself".to_owned());
            return Err(
                error.help("--camera N chooses among those of a camera file: name it with camera_info")
            );
        }
        None => intrinsics(given)?,
    };
    let own = file.is_none().then(|| intrinsics.clone());
    let Intrinsics { width, height, focal, principal, skew, lens } = intrinsics;
    let camera = Camera::with_lens(width, height, focal, principal, skew, lens).map_err(|error| {
        match (file, error) {
            (None, monorange_core::Error::OutOfRange { name, value, expected }) => {
                given.out_of_range(name.rsplit('.').next().unwrap_or(name), value, expected)
            }
            (None, error) => Error::new(error).at(path),
            (Some(file), error) => {
                Error::new(error).at(path.with_file_name(file)).help("correct the camera file")
            }
        }
    })?;
    if let Some(intrinsics) = own {
        plausibility::check_camera(&intrinsics).map_err(|error| {
            let key = ["focal", "principal"].into_iter().find(|key| error.says(key)).unwrap_or("focal");
            error.at_line(path, given.line_of(key))
        })?;
    }
    Ok((camera, pixel_std))
}

fn size_of(section: &Section<'_>, key: &'static str) -> Result<usize> {
    let value = section.required_number(key, "give the picture's size in pixels")?;
    let whole = value >= 1.0 && value.fract() == 0.0 && value <= 65_536.0;
    if whole {
        Ok(value as usize)
    } else {
        Err(section.out_of_range(key, value, "a whole number from 1 to 65536"))
    }
}

fn intrinsics(section: &Section<'_>) -> Result<Intrinsics> {
    let size = |key: &'static str| size_of(section, key);
    let pair = |key: &'static str, help| section.pair(key)?.ok_or_else(|| section.missing(key, help));
    let lens = match section.string("lens")? {
        None | Some("plumb_bob" | "rational_polynomial") => {
            let coefficients = section.numbers("distortion", &[4, 5, 8])?;
            if coefficients.is_none() {
                section
                    .error("", "`camera.distortion` is missing: the lens is taken to bend nothing".to_owned())
                    .help("write distortion = [0, 0, 0, 0, 0] if the pictures are undistorted")
                    .warn();
            }
            coefficients.and_then(|k| Lens::from_polynomial(&k)).unwrap_or_default()
        }
        Some("equidistant") => {
            let four = section.numbers("distortion", &[4])?.and_then(|k| <[f64; 4]>::try_from(k).ok());
            let help = "give k1 k2 k3 k4 of the fisheye calibration";
            Lens::Equidistant(four.ok_or_else(|| section.missing("distortion", help))?)
        }
        Some(other) => {
            let cause = format!(
                "`camera.lens` is \"{other}\", must be \"plumb_bob\", \"rational_polynomial\" or \"equidistant\""
            );
            return Err(section
                .error("lens", cause)
                .help("name the model that the calibration was made with"));
        }
    };
    Ok(Intrinsics {
        width: size("width")?,
        height: size("height")?,
        focal: pair("focal", "give [fu, fv] in pixels, from the camera's calibration")?,
        principal: pair("principal", "give [u0, v0] in pixels, from the camera's calibration")?,
        skew: section.number("skew")?.unwrap_or(0.0),
        lens,
    })
}

fn mount(root: &Section<'_>) -> Result<(Mount<f64>, [Option<f64>; 6])> {
    let known: Vec<_> =
        MOUNT_KEYS.iter().map(|(key, ..)| *key).chain(MOUNT_KEYS.iter().map(|(_, std, _)| *std)).collect();
    let help = "say how the camera sits: [mount] with height (m) and tilt_deg (downwards)";
    let section = root.section("mount", &known)?.ok_or_else(|| root.missing("mount", help))?;
    let (mut parameters, mut deviations) = ([0.0; 6], [None; 6]);
    for ((parameter, deviation), (key, std_key, unit)) in
        parameters.iter_mut().zip(&mut deviations).zip(MOUNT_KEYS)
    {
        let value = match key {
            "height" => {
                section.required_number(key, "give the lens centre's height above the floor in metres")?
            }
            "tilt_deg" => {
                section.required_number(key, "give the camera's tilt in degrees, positive downwards")?
            }
            _ => section.number(key)?.unwrap_or(0.0),
        };
        let (expected, sound) = match key {
            "height" => ("above 0 (metres)", value > 0.0),
            "tilt_deg" => ("between -90 and 90 (degrees, positive downwards)", value.abs() < 90.0),
            "roll_deg" | "yaw_deg" => ("from -180 to 180 (degrees)", value.abs() <= 180.0),
            _ => ("a finite number (metres)", true),
        };
        if !sound {
            return Err(section.out_of_range(key, value, expected).help("correct the value"));
        }
        let std = section.number(std_key)?;
        if let Some(std) = std.filter(|std| *std < 0.0) {
            return Err(section.out_of_range(std_key, std, "0 or above").help("give a standard deviation"));
        }
        (*parameter, *deviation) = (value * unit, std.map(|std| std * unit));
    }
    let mount = Mount::new(parameters).map_err(|error| section.error("height", error.to_string()))?;
    Ok((mount, deviations))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: &str = "[camera]\nwidth = 320\nheight = 240\nfocal = [365.0, 365.0]\nprincipal = [160.0, 120.0]\n\n\
                       [mount]\nheight = 0.4\ntilt_deg = 12.0\n\n[filter]\n";

    #[test]
    fn a_host_estimates_the_wheels_errors_unless_the_rig_says_otherwise() {
        let told = |lines: &str| {
            let rig = Rig::parse(Path::new("rig.toml"), &format!("{RIG}{lines}")).unwrap();
            let MotionNoise { speed_scale, turn_scale, turn_bias, .. } = rig.on_a_device().motion;
            (rig.settings.motion.speed_scale, [speed_scale, turn_scale, turn_bias])
        };
        assert_eq!(told("speed_by_speed = 0.02"), (0.0, [0.03, 0.01, 0.001]));
        assert_eq!(told("speed_scale = 0.0"), (0.0, [0.0; 3]));
        assert_eq!(told("turn_bias = 0.01"), (0.0, [0.0, 0.0, 0.01]));
    }
}

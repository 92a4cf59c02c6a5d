use super::tree::Tree;
use crate::{Error, Result};
use serde_json::Value;
use std::{cell::RefCell, collections::BTreeSet};

/// Named values of which each one is accounted for: read, known to say nothing of lens and picture, or refused.
pub(super) struct Entries<'a> {
    tree: &'a Tree,
    /// What names begin with: `Camera.` in ORB-SLAM's settings.
    prefix: &'a str,
    asked: RefCell<BTreeSet<&'static str>>,
}

/// Entries that say nothing of the lens or of what the pictures show; of one that ends in a star, any with this beginning.
const HARMLESS: &[&str] = &[
    "header",
    "frameid",
    "cameraname",
    "cameraid",
    "serial*",
    "comment",
    "description",
    "name",
    "date*",
    "time*",
    "stamp",
    "r",
    "p",
    "rectification*",
    "projection",
    "projectionmatrix",
    "calibration*",
    "calibtime",
    "nrofframes",
    "numframes",
    "numberofframes",
    "nframes",
    "board*",
    "square*",
    "marker*",
    "pattern*",
    "chessboard*",
    "checkerboard*",
    "aspectratio",
    "flags",
    "flagvalue",
    "avgreprojectionerror",
    "reprojectionerror*",
    "meanreprojectionerror",
    "rms*",
    "rperr*",
    "perview*",
    "extrinsic*",
    "imagepoints",
    "gridpoints",
    "gridsize",
    "objectpoints",
    "newobjectpoints",
    "releaseobject",
    "tbs",
    "tcnml",
    "tcncnm1",
    "tcamimu",
    "tcimu",
    "timucam",
    "timuc",
    "camoverlaps",
    "overlaps",
    "rostopic",
    "topic",
    "timeshift*",
    "sensortype",
    "ratehz",
    "rate",
    "fps",
    "rgb",
    "bf",
    "thdepth",
    "depth*",
    "viewer*",
    "orbextractor*",
    "imu*",
    "stereo*",
    "system*",
    "loopclosing*",
    "filev*",
    "cameraextrinsicmat",
    "cornerdist",
    "calibtime",
    "units",
    "tr*",
    "format",
    "version",
    "dorectify",
    "fixk3",
    "zerotangentdist",
    "covariance*",
    "stddeviations*",
    "std*",
    "camerafps",
    "camerabf",
    "camerargb",
    "exposure*",
    "gain",
    "vendor",
    "sensor",
    "make",
    "firmware*",
    "resampling",
    "r0*",
    "numcameras",
    "numberofcameras",
    "cameracalibrationmethod",
    "error",
    "isglobalshutter",
    "newwidth",
    "newheight",
    "colororder",
    "setup",
    "frames",
    "plyfilepath",
    "cameraangle*",
    "aabbscale",
    "linedelayns",
];

/// What an entry that must not be passed over has in its name.
const TELLING: &[&str] = &[
    "dist",
    "lens",
    "fish",
    "omni",
    "roi",
    "crop",
    "bin",
    "skew",
    "mirror",
    "poly",
    "undist",
    "rectified",
    "offset",
    "scale",
    "model",
    "intrinsic",
    "focal",
    "principal",
    "resolution",
    "width",
    "height",
    "matrix",
    "coef",
    "rolling",
    "radial",
    "tangential",
    "prism",
];

impl<'a> Entries<'a> {
    pub(super) fn new(tree: &'a Tree, prefix: &'a str) -> Self {
        Self { tree, prefix, asked: RefCell::default() }
    }

    /// An entry by any of its names; case, underscores and hyphens do not count, since programs differ in them.
    pub(super) fn get(&self, names: &[&'static str]) -> Option<&'a Value> {
        self.asked.borrow_mut().extend(names);
        let find = |wanted: &&str| {
            self.tree.iter().find(|(name, _)| self.plain(name) == plain(wanted)).map(|(_, value)| value)
        };
        names.iter().find_map(find)
    }

    pub(super) fn has(&self, names: &[&'static str]) -> bool {
        names.iter().any(|wanted| self.tree.keys().any(|name| self.plain(name) == plain(wanted)))
    }

    /// Finite numbers: a list, nested or not, a matrix with `data`, a text of numbers between blanks, or a single one.
    pub(super) fn numbers(&self, names: &[&'static str]) -> Result<Option<Vec<f64>>> {
        let Some(value) = self.get(names) else { return Ok(None) };
        let name = self.spelt(names);
        let mut numbers = Vec::new();
        let list = value.as_object().and_then(|matrix| matrix.get("data")).unwrap_or(value);
        if !collect(list, &mut numbers) {
            let cause = format!("`{name}` does not hold finite numbers");
            return Err(Error::new(cause).help("correct the camera file"));
        }
        let dimension = |key: &str| value.get(key).and_then(Value::as_f64);
        if let (Some(rows), Some(columns)) = (dimension("rows"), dimension("cols"))
            && rows * columns != numbers.len() as f64
        {
            let cause =
                format!("`{name}` has {} numbers, its rows and cols say {rows} × {columns}", numbers.len());
            return Err(Error::new(cause).help("is the file cut short? Correct the camera file"));
        }
        Ok(Some(numbers))
    }

    pub(super) fn number(&self, names: &[&'static str]) -> Result<Option<f64>> {
        match self.numbers(names)?.as_deref() {
            None => Ok(None),
            Some([number]) => Ok(Some(*number)),
            Some(numbers) => {
                let cause = format!("`{}` holds {} numbers, must be one", self.spelt(names), numbers.len());
                Err(Error::new(cause).help("correct the camera file"))
            }
        }
    }

    /// The words of all the entries of these names.
    pub(super) fn words(&self, names: &[&'static str]) -> Vec<(&'static str, String)> {
        let word = |name: &&'static str| match self.get(&[name])? {
            Value::String(word) => Some((*name, word.clone())),
            Value::Null => Some((*name, String::new())),
            other => Some((*name, other.to_string())),
        };
        names.iter().filter_map(word).collect()
    }

    /// The error that an entry is missing, with those that are there.
    pub(super) fn missing(&self, name: &'static str) -> Error {
        let there: Vec<_> = self.tree.keys().map(|key| format!("`{key}`")).take(12).collect();
        let name = if self.prefix.is_empty() { name } else { name.trim_start_matches("image_") };
        Error::new(format!("`{}{name}` is missing (there are: {})", self.prefix, there.join(", ")))
            .help(super::tree::FORMS)
    }

    /// Fails at an entry that was not asked for and may bear on lens or picture; warns about other unknown ones.
    pub(super) fn finish(&self) -> Result<()> {
        let asked = self.asked.borrow();
        let mut unknown = Vec::new();
        for (key, value) in self.tree.iter().filter(|(key, _)| !self.is_a_siblings(key)) {
            let name = self.plain(key);
            let known = asked.iter().any(|asked| plain(asked) == name);
            let harmless = HARMLESS.iter().any(|harmless| match harmless.strip_suffix('*') {
                Some(beginning) => name.starts_with(beginning),
                None => name == *harmless,
            });
            if known || harmless || value.is_null() {
                continue;
            }
            let likeness = |asked: &&&str| strsim::jaro_winkler(&plain(asked), &name);
            let nearest = asked.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
            let alike = nearest.as_ref().is_some_and(|nearest| name.len() > 3 && likeness(nearest) > 0.9);
            if alike || TELLING.iter().any(|telling| name.contains(telling)) {
                let nearest = nearest.copied().unwrap_or_default();
                let help = format!(
                    "the nearest known entry is `{nearest}`: correct the name, or remove the entry if it says nothing of lens and picture"
                );
                return Err(Error::new(format!("`{key}` is not a known entry")).help(help));
            }
            unknown.push(format!("`{key}`"));
        }
        if !unknown.is_empty() {
            let cause = format!(
                "{} not known and not used",
                unknown.join(", ") + if unknown.len() == 1 { " is" } else { " are" }
            );
            Error::new(cause).help("remove what says nothing of lens and picture").warn();
        }
        Ok(())
    }

    fn spelt(&self, names: &[&'static str]) -> String {
        let wanted: Vec<_> = names.iter().map(|name| plain(name)).collect();
        let key = self.tree.keys().find(|key| wanted.contains(&self.plain(key)));
        key.map_or_else(|| names.first().copied().unwrap_or_default().to_owned(), String::clone)
    }

    /// Of two cameras `Camera1.` and `Camera2.` what they share is called `Camera.`.
    fn plain(&self, name: &str) -> String {
        let shared = self.prefix.trim_end_matches(|c: char| c == '.' || c.is_ascii_digit());
        let of_both = || name.strip_prefix(shared).and_then(|rest| rest.strip_prefix('.'));
        plain(name.strip_prefix(self.prefix).or_else(of_both).unwrap_or(name))
    }

    /// Whether an entry is of the other one of two cameras.
    fn is_a_siblings(&self, name: &str) -> bool {
        let own = ["Camera1.", "Camera2."].contains(&self.prefix);
        own && !name.starts_with(self.prefix)
            && (name.starts_with("Camera1.") || name.starts_with("Camera2."))
    }
}

/// A name without case, underscores, hyphens, dots and blanks.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase()
}

fn collect(value: &Value, numbers: &mut Vec<f64>) -> bool {
    match value {
        Value::Array(items) => items.iter().all(|item| collect(item, numbers)),
        Value::Number(number) => {
            numbers.extend(number.as_f64());
            number.as_f64().is_some_and(f64::is_finite)
        }
        Value::String(text) => text.split([' ', ',', '\t']).filter(|word| !word.is_empty()).all(|word| {
            let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
            numbers.extend(number);
            number.is_some()
        }),
        _ => false,
    }
}

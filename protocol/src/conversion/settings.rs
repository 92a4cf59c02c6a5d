//! Settings on the line, read and written by the core's table.
use crate::message::{Answers, BY_NUMBER, FIELD, Settings};
use monorange_core::pipeline::{self, Config};
use monorange_core::setting::{Setting, Value};
use monorange_core::{Error, Result};

/// The settings of firmware 0.1.0, all of which every host sent, in the order of their numbers from 1.
const IN_ORDER: u8 = 43;
/// What a removed setting took on the line: all of those were one `f32`.
const RETIRED_BYTES: usize = 4;

/// The settings that differ from their defaults, each with its number.
pub fn settings_from_config(config: &Config) -> Settings {
    let defaults = Config::new(config.finder);
    let mut line = Settings::default();
    for (setting, _) in pipeline::settings() {
        let value = config.get(setting);
        if value == defaults.get(setting) {
            continue;
        }
        if line.0.is_empty() {
            // There is room for all of them, as a test shows.
            let _ = line.0.push(BY_NUMBER);
        }
        let _ = line.0.push(setting.number);
        write(value, &mut line);
    }
    line
}

fn write(value: Value, line: &mut Settings) {
    let mut add = |bytes: &[u8]| line.0.extend_from_slice(bytes).unwrap_or_default();
    match value {
        Value::Number(number) => add(&number.to_le_bytes()),
        Value::Pair([first, second]) => {
            add(&first.to_le_bytes());
            add(&second.to_le_bytes());
        }
        Value::Whole(mut number) => {
            while number > 0x7f {
                add(&[number as u8 | 0x80]);
                number >>= 7;
            }
            add(&[number as u8]);
        }
        Value::Choice(place, _) => add(&[place]),
        Value::Switch(on) => add(&[u8::from(on)]),
    }
}

/// Gives a configuration the settings of a message.
///
/// # Errors
/// [`Error::OutOfRange`] with the setting's name for a value outside its range, and with `settings.<number>` for a number that
/// this target does not know; [`Error::Size`] where the last value is cut off.
pub fn take_settings(bytes: &[u8], config: &mut Config) -> Result<()> {
    let mut line = Line { rest: bytes };
    match bytes.split_first() {
        None => Ok(()),
        Some((&BY_NUMBER, rest)) => {
            line.rest = rest;
            while let Some((number, rest)) = line.rest.split_first() {
                line.rest = rest;
                let Some((setting, before)) = config.numbered(*number) else {
                    let (value, expected) =
                        (f64::from(*number), "the number of a setting that this device has");
                    return Err(Error::OutOfRange { name: "settings.number", value, expected });
                };
                line.take(setting, before, config)?;
            }
            Ok(())
        }
        Some((0 | 1, _)) => {
            for number in 1..=IN_ORDER {
                match config.numbered(number) {
                    Some((setting, before)) => line.take(setting, before, config)?,
                    None => line.skip(RETIRED_BYTES)?,
                }
            }
            Ok(())
        }
        Some((form, _)) => {
            Err(Error::OutOfRange { name: "settings.form", value: f64::from(*form), expected: "0, 1 or 2" })
        }
    }
}

/// The fields of `Configure` that are no settings, in their order; `SPEC.md` numbers them from 1.
const FIELDS: [&str; 18] = [
    "camera.width",
    "camera.height",
    "camera.focal",
    "camera.principal",
    "camera.skew",
    "camera.distortion",
    "mount.height",
    "mount.tilt",
    "mount.roll",
    "mount.yaw",
    "mount.forward",
    "mount.left",
    "mount.height_std",
    "mount.tilt_std_deg",
    "mount.roll_std_deg",
    "mount.yaw_std_deg",
    "binning",
    "settings",
];

/// What a refused configuration's fault tells: the setting's number, known or not; the field's with [`FIELD`] added; 0 for what is
/// neither.
pub fn number_of_refused(error: &Error) -> u32 {
    let name = match error {
        Error::OutOfRange { name: "settings.number", value, .. } => return *value as u32,
        Error::OutOfRange { name: "settings.form", .. } => "settings",
        Error::OutOfRange { name, .. } | Error::Unsupported { name, .. } | Error::Size { name, .. } => name,
        _ => return 0,
    };
    let field = || FIELDS.iter().position(|field| *field == name).map(|place| FIELD + 1 + place as u32);
    pipeline::setting_number(name).map(u32::from).or_else(field).unwrap_or(0)
}

/// Numbers of settings that only hosts have: pictures are matched there.
const OF_HOSTS: core::ops::RangeInclusive<u8> = 50..=59;

/// CRC-32 of everything that a state depends on: camera, mount, and each setting as it is in effect.
pub fn fingerprint(config: &Config) -> u32 {
    let answers = Answers { observations: false, map_every: 0, statistics_every: 0 };
    let mut told = super::message_from_config(config, answers);
    told.settings = Settings::default();
    for number in (0..=u8::MAX).filter(|number| !OF_HOSTS.contains(number)) {
        if let Some((_, value)) = config.numbered(number) {
            let _ = told.settings.0.push(number);
            write(value, &mut told.settings);
        }
    }
    let mut bytes = [0; 512];
    // There is room, as a test shows.
    postcard::to_slice(&told, &mut bytes).map_or(0, |bytes| crate::frame::checksum(bytes))
}

struct Line<'a> {
    rest: &'a [u8],
}

impl Line<'_> {
    /// Reads a value of the kind that the setting has.
    fn take(&mut self, setting: &Setting, before: Value, config: &mut Config) -> Result<()> {
        let value = match before {
            Value::Number(_) => Value::Number(self.number()?),
            Value::Pair(_) => Value::Pair([self.number()?, self.number()?]),
            Value::Whole(_) => Value::Whole(self.whole()?),
            Value::Choice(_, words) => {
                let [place] = self.bytes()?;
                Value::Choice(place, words)
            }
            Value::Switch(_) => Value::Switch(self.bytes()? != [0]),
        };
        config.set(setting, value)
    }

    fn number(&mut self) -> Result<f32> {
        self.bytes().map(f32::from_le_bytes)
    }

    fn whole(&mut self) -> Result<u32> {
        let (mut number, mut shift) = (0_u32, 0);
        loop {
            let [byte] = self.bytes()?;
            number |= u32::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
            shift += 7;
            if byte < 0x80 || shift > 28 {
                return Ok(number);
            }
        }
    }

    fn skip(&mut self, count: usize) -> Result<()> {
        let cut = Error::Size { name: "settings", got: self.rest.len(), expected: count };
        self.rest = self.rest.get(count..).ok_or(cut)?;
        Ok(())
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N]> {
        let first = self.rest.first_chunk::<N>().copied();
        self.skip(N)?;
        first.ok_or(Error::Size { name: "settings", got: 0, expected: N })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorange_core::geometry::{Camera, Mount, RangeFinder};

    fn config() -> Config {
        let camera = Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default()).unwrap();
        Config::new(RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap()))
    }

    #[test]
    fn a_fingerprint_tells_every_setting_and_field_from_its_default() {
        let known = fingerprint(&config());
        assert_ne!(known, 0, "there is room for everything");
        let mut seen = std::vec![known];
        let mut differs = |name: &str, other: Config| {
            let other = fingerprint(&other);
            assert!(other != 0 && !seen.contains(&other), "{name}");
            seen.push(other);
        };
        for (setting, _) in pipeline::settings() {
            let mut one = config();
            one.set(setting, other(&one, setting)).unwrap();
            differs(setting.name, one);
        }
        let camera = *config().finder.camera();
        let higher = Mount::new([0.8, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap();
        differs("mount.height", Config { finder: RangeFinder::new(camera, higher), ..config() });
        let lens = Default::default();
        let camera = Camera::new(320, 240, [300.0; 2], [160.0, 120.0], 0.0, lens).unwrap();
        let mount = *config().finder.mount();
        differs("camera.focal", Config { finder: RangeFinder::new(camera, mount), ..config() });
        let mut looser = config();
        looser.mount_std[1] *= 2.0;
        differs("mount.tilt_std_deg", looser);
    }

    #[test]
    fn fields_that_are_no_settings_are_numbered_in_their_order() {
        let focal =
            Camera::new(320, 240, [-1.0_f32; 2], [160.0, 120.0], 0.0, Default::default()).unwrap_err();
        assert_eq!(number_of_refused(&focal), FIELD + 3);
        assert_eq!(number_of_refused(&Mount::new([0.0_f32; 6]).unwrap_err()), FIELD + 7);
        assert_eq!(number_of_refused(&take_settings(&[9], &mut config()).unwrap_err()), FIELD + 18);
        let mut wrong = config();
        wrong.mount_std[3] = -1.0;
        assert_eq!(number_of_refused(&wrong.validated().unwrap_err()), FIELD + 16);
    }

    /// Another value than the default's, as long as it gets on the line.
    fn other(config: &Config, setting: &Setting) -> Value {
        match config.get(setting) {
            Value::Number(_) => Value::Number(0.75 * setting.least + 0.25 * setting.most),
            Value::Pair(_) => Value::Pair([setting.least, setting.most]),
            Value::Whole(_) => Value::Whole(setting.most as u32),
            Value::Choice(place, words) => Value::Choice((place + 1) % words.len() as u8, words),
            Value::Switch(on) => Value::Switch(!on),
        }
    }

    #[test]
    fn nothing_is_the_defaults_and_the_defaults_are_nothing() {
        let mut told = config();
        take_settings(&[], &mut told).unwrap();
        assert_eq!(told, config());
        assert!(settings_from_config(&config()).0.is_empty());
    }

    #[test]
    fn every_setting_comes_back_alone_and_all_together() {
        let mut all = config();
        for (setting, _) in pipeline::settings() {
            let mut one = config();
            one.set(setting, other(&one, setting)).unwrap();
            all.set(setting, other(&all, setting)).unwrap();
            let mut told = config();
            take_settings(&settings_from_config(&one).0, &mut told).unwrap();
            assert_eq!(told, one, "{}", setting.name);
        }
        let mut told = config();
        take_settings(&settings_from_config(&all).0, &mut told).unwrap();
        assert_eq!(told, all);
    }

    #[test]
    fn what_a_device_does_not_know_or_cannot_use_is_named_by_its_number() {
        let refused = |bytes: &[u8]| take_settings(bytes, &mut config()).unwrap_err();
        assert_eq!(number_of_refused(&refused(&[BY_NUMBER, 255, 0])), 255);
        let nan = f32::NAN.to_le_bytes();
        let caution = refused(&[BY_NUMBER, 46, nan[0], nan[1], nan[2], nan[3]]);
        assert_eq!(number_of_refused(&caution), 46);
        assert!(matches!(caution, Error::OutOfRange { name: "association.caution", .. }), "{caution}");
        assert_eq!(number_of_refused(&refused(&[BY_NUMBER, 7, 9])), 7, "a gate that there is not");
        assert!(matches!(refused(&[BY_NUMBER, 46, 0, 0]), Error::Size { .. }), "cut off");
        assert!(matches!(refused(&[9]), Error::OutOfRange { name: "settings.form", .. }));
    }

    #[test]
    fn the_settings_that_a_host_of_firmware_0_1_0_sends_are_understood() {
        // Of that version's test vector: every setting of it, in order.
        let line = "01 01 9a 99 99 3e 29 5c 0f 3d 02 00 01 00 00 d4 40 00 00 14 41 00 00 80 40 00 00 40 40 cd cc cc \
         3d 01 00 00 d0 40 00 00 10 41 00 00 c8 41 03 06 32 00 00 00 80 3e 04 80 02 cd cc 4c 3d 00 00 80 \
         3d 29 5c 8f 3d 0a d7 23 3c 6f 12 83 3a 6f 12 03 3b 00 00 80 40 05 cd cc 4c 3e 00 00 80 3f 00 00 \
         e0 3e 29 5c 8f 3d 0a d7 23 3e 0a d7 a3 3d 8f c2 75 3d 00 00 c0 40 00 00 e0 40 00 00 00 41 00 00 \
         40 40 00 00 00 3e cd cc 4c 3d 00 00 90 40 33 33 b3 3e";
        let line: std::vec::Vec<_> =
            line.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
        let mut config = config();
        take_settings(&line, &mut config).unwrap();
        let told = |name: &str| {
            config.get(pipeline::settings().find(|(setting, _)| setting.name == name).unwrap().0)
        };
        assert_eq!(told("association.corner_std_floor_px"), Value::Number(0.3));
        assert_eq!(told("filter.gate_nis"), Value::Pair([6.625, 9.25]));
        assert_eq!(told("association.joint_nodes"), Value::Whole(256));
        assert_eq!(told("association.merge_missed"), Value::Whole(4));
        assert_eq!(told("filter.turn_floor"), Value::Number(0.002));
        for (name, place) in
            [("filter.variant", 2), ("filter.gate", 1), ("association.pairing", 1), ("filter.model", 1)]
        {
            assert!(matches!(told(name), Value::Choice(at, _) if at == place), "{name}");
        }
        assert!(matches!(take_settings(&line[..140], &mut config), Err(Error::Size { .. })), "cut off");
    }
}

//! All settings of a pipeline in one list, and how to read and write any of them by name or by number.
//!
//! ```
//! # use monorange_core::{geometry::{Camera, Mount, RangeFinder}, pipeline::{self, Config}, setting::Value};
//! # let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default())?;
//! # let mut config = Config::new(RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0])?));
//! let (caution, about) = pipeline::settings().find(|(setting, _)| setting.name == "association.caution").unwrap();
//! assert_eq!(config.get(caution), Value::Number(6.0));
//! assert!(about.origin.contains("four closed on the wrong door"));
//! let error = config.set(caution, Value::Number(f32::NAN)).unwrap_err();
//! assert_eq!(error.to_string(), "association.caution is NaN, must be from 0 to 1e6");
//! # Ok::<(), monorange_core::Error>(())
//! ```
use super::Config;
use super::config::{
    EXTRACTED, EXTRACTED_REFERENCES, FILTERED, FILTERED_REFERENCES, MEASURED, MEASURED_REFERENCES, SHUTTER,
    SHUTTER_REFERENCES,
};
use super::motion_noise::{MOTION_NOISE, MOTION_NOISE_REFERENCES};
use crate::Result;
use crate::lines::{EXTRACT, EXTRACT_REFERENCES};
use crate::setting::{Reference, Row, Setting, Slot, Value};
use crate::slam::{FILTER, FILTER_REFERENCES, MAP, MAP_REFERENCES};

/// Every setting with its sentences, section by section.
pub fn settings() -> impl Iterator<Item = (&'static Setting, &'static Reference)> {
    described(&EXTRACTED, &EXTRACTED_REFERENCES)
        .chain(described(&EXTRACT, &EXTRACT_REFERENCES))
        .chain(described(&FILTER, &FILTER_REFERENCES))
        .chain(described(&FILTERED, &FILTERED_REFERENCES))
        .chain(described(&MOTION_NOISE, &MOTION_NOISE_REFERENCES))
        .chain(described(&MEASURED, &MEASURED_REFERENCES))
        .chain(described(&MAP, &MAP_REFERENCES))
        .chain(described(&SHUTTER, &SHUTTER_REFERENCES))
}

fn described<C>(
    rows: &'static [Row<C>],
    references: &'static [Reference],
) -> impl Iterator<Item = (&'static Setting, &'static Reference)> {
    rows.iter().map(|row| &row.setting).zip(references)
}

/// The number of the setting with this name.
pub fn setting_number(name: &str) -> Option<u8> {
    fn number<C>(rows: &'static [Row<C>], name: &str) -> Option<u8> {
        rows.iter().find(|row| row.setting.name == name).map(|row| row.setting.number)
    }
    number(&EXTRACTED, name)
        .or_else(|| number(&EXTRACT, name))
        .or_else(|| number(&FILTER, name))
        .or_else(|| number(&FILTERED, name))
        .or_else(|| number(&MOTION_NOISE, name))
        .or_else(|| number(&MEASURED, name))
        .or_else(|| number(&MAP, name))
        .or_else(|| number(&SHUTTER, name))
}

impl Config {
    /// The value of a setting.
    pub fn get(&self, setting: &Setting) -> Value {
        let mut value = Value::Switch(false);
        let mut copy = *self;
        copy.at(setting.number, &mut |_, slot| value = slot.get());
        value
    }

    /// Gives a setting another value.
    ///
    /// # Errors
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) with the setting's name, for a value of another kind too. What only
    /// [`validated`](Self::validated) sees, such as two settings that do not go together, is accepted here.
    pub fn set(&mut self, setting: &Setting, value: Value) -> Result<()> {
        let mut done = Ok(());
        self.at(setting.number, &mut |setting, mut slot| done = slot.put(setting, value));
        done
    }

    /// The setting of this number with its value; `None` where there is no such setting on this target.
    pub fn numbered(&self, number: u8) -> Option<(&'static Setting, Value)> {
        let mut found = None;
        let mut copy = *self;
        copy.at(number, &mut |setting, slot| found = Some((setting, slot.get())));
        found
    }

    /// Shows the setting of this number with the field that holds it.
    fn at(&mut self, number: u8, show: &mut dyn FnMut(&'static Setting, Slot<'_>)) {
        at(&EXTRACTED, self, number, show);
        at(&EXTRACT, &mut self.extract, number, show);
        at(&FILTER, &mut self.filter, number, show);
        at(&FILTERED, self, number, show);
        at(&MOTION_NOISE, &mut self.motion, number, show);
        at(&MEASURED, self, number, show);
        at(&MAP, &mut self.map, number, show);
        at(&SHUTTER, self, number, show);
    }
}

fn at<C>(
    rows: &'static [Row<C>],
    config: &mut C,
    number: u8,
    show: &mut dyn FnMut(&'static Setting, Slot<'_>),
) {
    if let Some(row) = rows.iter().find(|row| row.setting.number == number) {
        show(&row.setting, (row.slot)(config));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::geometry::{Camera, Mount, RangeFinder};
    use std::collections::BTreeSet;

    fn config() -> Config {
        let camera = Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default()).unwrap();
        Config::new(RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap()))
    }

    #[test]
    fn numbers_and_names_are_unique_and_every_default_says_where_it_comes_from() {
        let numbers: BTreeSet<_> = settings().map(|(setting, _)| setting.number).collect();
        let names: BTreeSet<_> = settings().map(|(setting, _)| setting.name).collect();
        let count = settings().count();
        assert_eq!((numbers.len(), names.len()), (count, count));
        for (setting, reference) in settings() {
            assert!(reference.help.ends_with('.') && reference.origin.ends_with('.'), "{}", setting.name);
        }
    }

    #[test]
    fn every_setting_keeps_what_it_is_given_and_nothing_else_changes() {
        for (setting, _) in settings() {
            let mut config = config();
            let value = match config.get(setting) {
                Value::Number(_) => Value::Number(0.5 * (setting.least + setting.most)),
                Value::Pair(_) => Value::Pair([setting.least, setting.most]),
                Value::Whole(_) => Value::Whole(setting.most as u32),
                Value::Choice(place, words) => Value::Choice((place + 1) % words.len() as u8, words),
                Value::Switch(on) => Value::Switch(!on),
            };
            config.set(setting, value).unwrap();
            assert_eq!(config.get(setting), value, "{}", setting.name);
            for (other, _) in settings().filter(|(other, _)| other.number != setting.number) {
                assert_eq!(
                    config.get(other),
                    self::config().get(other),
                    "{} by {}",
                    other.name,
                    setting.name
                );
            }
        }
    }

    #[test]
    fn nothing_but_a_number_in_its_range_is_taken_and_the_refusal_names_it() {
        let mut refusals = 0;
        for (setting, _) in settings() {
            for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2.0 * setting.most + 1.0, -1.0] {
                let value = match config().get(setting) {
                    Value::Number(_) => Value::Number(number),
                    Value::Pair([first, _]) => Value::Pair([first, number]),
                    _ => continue,
                };
                let refusal = config().set(setting, value);
                let named = matches!(refusal, Err(Error::OutOfRange { name, .. }) if name == setting.name);
                assert!(named, "{} took {number}: {refusal:?}", setting.name);
                refusals += 1;
            }
        }
        assert!(refusals > 150, "{refusals}");
    }

    #[test]
    fn what_set_takes_for_one_setting_alone_validated_takes_too() {
        // Ends of ranges that another setting forbids.
        let together =
            ["extract.floor_spread", "extract.vertical_spread", "association.confirm", "association.within"];
        let nis = ["association.match_nis", "association.birth_nis"];
        for (setting, _) in
            settings().filter(|(one, _)| !together.contains(&one.name) && !nis.contains(&one.name))
        {
            for end in [setting.least, setting.most] {
                let mut config = config();
                let value = match config.get(setting) {
                    Value::Number(_) => Value::Number(end),
                    Value::Pair(_) => Value::Pair([end; 2]),
                    Value::Whole(_) => Value::Whole(end as u32),
                    other => other,
                };
                config.set(setting, value).unwrap();
                config.validated().unwrap_or_else(|error| panic!("{} = {end}: {error}", setting.name));
            }
        }
    }
}

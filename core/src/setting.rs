//! One row for each setting: its name in files, its number on a serial line, its range, and where its default comes from.
//!
//! A setting is three lines in one file: a field of a configuration, its default, and its row, which the macro `settings!`
//! takes. Rig files, reports, the reference page, the protocol's table and every check of a range are made from the rows;
//! [`pipeline::settings`](crate::pipeline::settings) lists all of them.
//!
//! The rows hold names, ranges and accessors. Sentences stand in an array of their own, so that a firmware, which shows none,
//! does not carry them.
use crate::{Error, Result};

/// A setting as programs see it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Setting {
    /// Its number in the protocol's `Configure` message. A removed setting's number is not used again.
    pub number: u8,
    /// Section and key of a rig file, for instance `extract.opening`.
    pub name: &'static str,
    /// Its unit, or what it counts; empty for a ratio or a choice.
    pub unit: &'static str,
    /// The least value that is accepted.
    pub least: f32,
    /// The largest value that is accepted.
    pub most: f32,
    /// The range in words.
    pub expected: &'static str,
}

/// A setting as people see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Reference {
    /// What it means, in a sentence.
    pub help: &'static str,
    /// Where its default comes from: an equation, a test, a data set, or plain judgement.
    pub origin: &'static str,
}

/// The value of a setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f32),
    /// Two numbers.
    Pair([f32; 2]),
    /// A whole number.
    Whole(u32),
    /// The place of one of [`Choice::words`].
    Choice(u8, &'static [&'static str]),
    /// On or off.
    Switch(bool),
}

/// An enum whose variants have words in files, and whose places among the words are their numbers on a serial line.
pub trait Choice {
    /// One word a variant.
    fn words(&self) -> &'static [&'static str];
    /// The variant's place among the words.
    fn place(&self) -> u8;
    /// Becomes the variant at `place`; `false`, and no change, where there is none.
    fn set(&mut self, place: u8) -> bool;
}

/// Implements [`Choice`] for an enum.
macro_rules! choices {
    ($name:ident { $($word:literal => $variant:ident),+ $(,)? }) => {
        impl $crate::setting::Choice for $name {
            fn words(&self) -> &'static [&'static str] {
                &[$($word),+]
            }
            fn place(&self) -> u8 {
                const ALL: &[$name] = &[$($name::$variant),+];
                ALL.iter().position(|variant| variant == self).map_or(0, |place| place as u8)
            }
            fn set(&mut self, place: u8) -> bool {
                let found = [$($name::$variant),+].get(usize::from(place)).copied();
                *self = found.unwrap_or(*self);
                found.is_some()
            }
        }
    };
}

/// The field that a setting is kept in.
pub(crate) enum Slot<'a> {
    Number(&'a mut f32),
    Pair([&'a mut f32; 2]),
    Whole(&'a mut u32),
    Size(&'a mut usize),
    Choice(&'a mut dyn Choice),
    Switch(&'a mut bool),
}

impl Slot<'_> {
    pub(crate) fn get(&self) -> Value {
        match self {
            Self::Number(field) => Value::Number(**field),
            Self::Pair([first, second]) => Value::Pair([**first, **second]),
            Self::Whole(field) => Value::Whole(**field),
            Self::Size(field) => Value::Whole(u32::try_from(**field).unwrap_or(u32::MAX)),
            Self::Choice(field) => Value::Choice(field.place(), field.words()),
            Self::Switch(field) => Value::Switch(**field),
        }
    }

    /// Takes a value that lies in the setting's range.
    pub(crate) fn put(&mut self, setting: &Setting, value: Value) -> Result<()> {
        setting.check(value)?;
        let fits = match (self, value) {
            (Self::Number(field), Value::Number(number)) => {
                **field = number;
                true
            }
            (Self::Pair([first, second]), Value::Pair([a, b])) => {
                (**first, **second) = (a, b);
                true
            }
            (Self::Whole(field), Value::Whole(number)) => {
                **field = number;
                true
            }
            (Self::Size(field), Value::Whole(number)) => {
                **field = number as usize;
                true
            }
            (Self::Choice(field), Value::Choice(place, _)) => field.set(place),
            (Self::Switch(field), Value::Switch(on)) => {
                **field = on;
                true
            }
            _ => false,
        };
        if fits { Ok(()) } else { Err(setting.refused(f32::NAN)) }
    }
}

impl Setting {
    /// The section of a rig file that it stands in.
    pub fn section(&self) -> &'static str {
        self.name.split_once('.').map_or("", |(section, _)| section)
    }

    /// Its key in that section.
    pub fn key(&self) -> &'static str {
        self.name.split_once('.').map_or(self.name, |(_, key)| key)
    }

    /// Whether a value lies in the setting's range; NaN does not.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the setting's name.
    pub fn check(&self, value: Value) -> Result<()> {
        let numbers = match value {
            Value::Number(number) => [number; 2],
            Value::Pair(numbers) => numbers,
            Value::Whole(number) => [number as f32; 2],
            Value::Choice(..) | Value::Switch(_) => return Ok(()),
        };
        match numbers.into_iter().find(|number| !(self.least..=self.most).contains(number)) {
            Some(number) => Err(self.refused(number)),
            None => Ok(()),
        }
    }

    fn refused(&self, number: f32) -> Error {
        Error::OutOfRange { name: self.name, value: number.into(), expected: self.expected }
    }
}

/// A setting and the field that it is kept in.
pub(crate) struct Row<C: 'static> {
    pub(crate) setting: Setting,
    pub(crate) slot: fn(&mut C) -> Slot<'_>,
}

/// Whether every setting of a configuration lies in its range.
pub(crate) fn check<C>(rows: &'static [Row<C>], config: &mut C) -> Result<()> {
    rows.iter().try_for_each(|row| row.setting.check((row.slot)(config).get()))
}

/// Rows and references of a configuration:
/// `number key: kind [field] (least, most, "unit"), "what it means", "where the default comes from";`. Unit, or range
/// and unit, are left out where there are none.
macro_rules! settings {
    ($name:ident, $references:ident, $config:ty, $section:literal {
        $($number:literal $key:ident : $kind:ident [$($field:tt)+] $(($least:literal, $most:literal $(, $unit:literal)?),)? $help:literal, $origin:literal;)+
    }) => {
        /// Names, ranges and fields of this configuration's settings.
        #[allow(clippy::unnecessary_cast, reason = "ends of ranges may be written as whole numbers")]
        pub(crate) static $name: [$crate::setting::Row<$config>; [$($number),+].len()] = [$(
            $crate::setting::Row {
                setting: $crate::setting::Setting {
                    number: $number,
                    name: concat!($section, ".", stringify!($key)),
                    unit: concat!($($($unit)?)?),
                    least: $crate::setting::settings!(@least $($least)?),
                    most: $crate::setting::settings!(@most $($most)?),
                    expected: $crate::setting::settings!(@expected $($least $most $($unit)?)?),
                },
                slot: $crate::setting::settings!(@slot $kind [$($field)+]),
            },
        )+];

        /// Their sentences, in the same order.
        pub(crate) static $references: [$crate::setting::Reference; [$($number),+].len()] =
            [$($crate::setting::Reference { help: $help, origin: $origin }),+];
    };
    (@least) => { 0.0 };
    (@least $least:literal) => { $least as f32 };
    (@most) => { 0.0 };
    (@most $most:literal) => { $most as f32 };
    (@expected) => { "one of its words" };
    (@expected $least:literal $most:literal) => { concat!("from ", $least, " to ", $most) };
    (@expected $least:literal $most:literal $unit:literal) => { concat!("from ", $least, " to ", $most, " ", $unit) };
    (@slot Pair [$($field:tt)+]) => { |config| { let [a, b] = &mut config.$($field)+; $crate::setting::Slot::Pair([a, b]) } };
    (@slot Couple [$($field:tt)+]) => { |config| { let (a, b) = &mut config.$($field)+; $crate::setting::Slot::Pair([a, b]) } };
    (@slot $kind:ident [$($field:tt)+]) => { |config| $crate::setting::Slot::$kind(&mut config.$($field)+) };
}

pub(crate) use {choices, settings};

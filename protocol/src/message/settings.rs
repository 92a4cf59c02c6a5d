//! The settings of a `Configure` message: as many as the host wants to change, each with its number.
use heapless::Vec;
use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeTuple, Serializer};

/// Bytes of settings, at most.
pub const MAX_SETTINGS: usize = 384;

/// The first byte of settings that stand in pairs of number and value.
pub const BY_NUMBER: u8 = 2;

/// Settings as they stand on the line; `SPEC.md` lists their numbers, units, ranges and defaults.
///
/// ```text
/// nothing                              every setting has its default
/// 2, (number u8, value)*               those settings have these values, the others their defaults
/// 0 or 1, …                            as firmware 0.1.0 was told: the settings 1 to 43 without their numbers
/// ```
///
/// They are the last field of their message and end with it. A value is an `f32`, two of them, a whole number as a varint, or one
/// byte for a choice or a switch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Settings(pub Vec<u8, MAX_SETTINGS>);

impl Serialize for Settings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut bytes = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| bytes.serialize_element(byte))?;
        bytes.end()
    }
}

impl<'de> Deserialize<'de> for Settings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Rest;
        impl<'de> Visitor<'de> for Rest {
            type Value = Settings;
            fn expecting(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                formatter.write_str("bytes up to the message's end")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut bytes: A) -> Result<Settings, A::Error> {
                let mut settings = Settings::default();
                // The end of the message is no error: it is where the settings end.
                while let Ok(Some(byte)) = bytes.next_element() {
                    if settings.0.push(byte).is_err() {
                        return Err(serde::de::Error::custom("more settings than there are"));
                    }
                }
                Ok(settings)
            }
        }
        deserializer.deserialize_tuple(MAX_SETTINGS + 1, Rest)
    }
}

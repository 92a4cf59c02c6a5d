//! Fields that a message got after its first release.
use serde::{Deserialize, Deserializer, Serialize};

/// The last field of a message, which older senders leave out: it is then its type's default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Later<T>(pub T);

impl<'de, T: Deserialize<'de> + Default> Deserialize<'de> for Later<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self(T::deserialize(deserializer).unwrap_or_default()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_an_older_sender_left_out_is_the_default() {
        let read = |bytes| postcard::take_from_bytes::<(u8, Later<[u8; 3]>)>(bytes).map(|(read, _)| read);
        assert_eq!(read(&[7, 1, 2, 3, 9]), Ok((7, Later([1, 2, 3]))));
        assert_eq!(read(&[7]), Ok((7, Later([0; 3]))));
        assert!(read(&[]).is_err(), "what was always there is needed");
    }
}

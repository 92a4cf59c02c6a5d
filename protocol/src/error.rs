use core::fmt;

/// Why a message could not be written or understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The message does not fit a frame's payload, or the buffer is below [`MAX_ENCODED`](crate::frame::MAX_ENCODED).
    TooLong,
    /// No message has this number; newer peers may send such, and they are to be ignored.
    UnknownKind(u8),
    /// The payload is not an encoding of a message of this number.
    Payload {
        /// The message's number.
        kind: u8,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong => write!(f, "the message does not fit a frame of 1024 bytes of payload"),
            Self::UnknownKind(kind) => write!(f, "no message has the number {kind:#04x}"),
            Self::Payload { kind } => write!(f, "the payload is no message {kind:#04x}"),
        }
    }
}

impl core::error::Error for Error {}

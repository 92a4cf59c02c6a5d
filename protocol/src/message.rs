//! Messages: what the payload of a frame says.
//!
//! Payloads are in postcard's encoding, in the order of the fields: `u8` and `f32` (IEEE 754, little-endian) as they
//! are, wider integers as LEB128 varints, an option as 0 or 1 and then the value, a list or a string as its length
//! and then its elements. A receiver ignores bytes after the fields that it knows, so that fields can be added
//! at the end without a new version; and it ignores kinds that it does not know.
//!
//! Units are SI and radians, times are microseconds of the host's clock, pixels are those of the full picture with (0, 0)
//! at the centre of the top-left one, positions are (x, y) in the world's frame, x forward and y left of where the robot
//! started. Covariances are the distinct elements of the symmetric matrix, row by row.
mod device;
mod host;
mod later;
mod settings;

pub use device::*;
pub use host::*;
pub use later::Later;
pub use settings::*;

use crate::{
    Error,
    frame::{self, Frame},
};

/// The messages of one direction: an enum over payloads with their numbers.
macro_rules! messages {
    ($(#[$doc:meta])* $name:ident { $($(#[$what:meta])* $variant:ident($payload:ty) = $kind:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq)]
        #[allow(clippy::large_enum_variant, reason = "without a heap the largest one needs its place anyway")]
        pub enum $name<'a> {
            $($(#[$what])* $variant($payload),)*
        }

        impl<'a> $name<'a> {
            /// The number that stands in the frame.
            pub fn kind(&self) -> u8 {
                match self {
                    $(Self::$variant(_) => $kind,)*
                }
            }

            /// Writes the message as one frame to `line` and returns the bytes written.
            ///
            /// # Errors
            /// [`Error::TooLong`].
            pub fn encode<'l>(&self, sequence: u16, line: &'l mut [u8]) -> Result<&'l mut [u8], Error> {
                match self {
                    $(Self::$variant(payload) => frame::encode($kind, sequence, payload, line),)*
                }
            }

            /// The message in a frame.
            ///
            /// # Errors
            /// [`Error::UnknownKind`], [`Error::Payload`].
            pub fn decode(frame: &Frame<'a>) -> Result<Self, Error> {
                let damaged = |_| Error::Payload { kind: frame.kind };
                match frame.kind {
                    $($kind => {
                        let (payload, _later_fields) =
                            postcard::take_from_bytes::<$payload>(frame.payload).map_err(damaged)?;
                        Ok(Self::$variant(payload))
                    })*
                    unknown => Err(Error::UnknownKind(unknown)),
                }
            }
        }
    };
}

messages! {
    /// What a host says.
    HostMessage {
        /// Who is there? Answered by [`Info`] and [`Credit`]; also after any silence.
        Hello(Hello) = 0x01,
        /// Camera, mount and settings; forgets pose and map. Answered by [`Info`], or [`Fault`] if refused.
        Configure(Configure) = 0x02,
        /// How the robot moved up to the next frame.
        Odometry(Odometry) = 0x03,
        /// A picture begins.
        FrameBegin(FrameBegin) = 0x04,
        /// Rows of the picture, in order.
        Rows(Rows<'a>) = 0x05,
        /// The picture is complete. Answered by [`Observations`] and [`Pose`].
        FrameEnd(FrameEnd) = 0x06,
        /// Instead of a picture: its floor corners, found elsewhere. Answered as a frame.
        Corners(Corners) = 0x07,
        /// Forget pose and map, or restart.
        Reset(Reset) = 0x08,
        /// Send the filter's state. Answered by [`State`] chunks.
        SaveState(SaveState) = 0x09,
        /// A chunk of a state saved before.
        RestoreState(State<'a>) = 0x0a,
        /// What time is it? Answered by [`Time`].
        TimeSync(TimeSync) = 0x0b,
        /// Send this now. Answered by [`Map`] or [`Statistics`].
        Ask(Ask) = 0x0c,
        /// How far is this? Answered by [`Ranges`]; pose and map stay as they are.
        Range(Range) = 0x0d,
        /// Answer in lines of text, or in frames again. Answered by [`Info`].
        Text(Text) = 0x0e,
        /// How the robot leans when the next picture is taken.
        Attitude(Attitude) = 0x0f,
    }
}

messages! {
    /// What the device says.
    DeviceMessage {
        /// Who it is and what it can hold.
        Info(Info<'a>) = 0x81,
        /// Corners of a frame: what was seen, and what became of it.
        Observations(Observations) = 0x82,
        /// Where the robot is.
        Pose(Pose) = 0x83,
        /// Landmarks.
        Map(Map) = 0x84,
        /// Counts and costs.
        Statistics(Statistics) = 0x85,
        /// How much may be sent.
        Credit(Credit) = 0x86,
        /// Something was refused, and why.
        Fault(Fault) = 0x87,
        /// Sent once after a restart that a panic or a fault caused.
        LastPanic(LastPanic<'a>) = 0x88,
        /// A chunk of the filter's state.
        State(State<'a>) = 0x89,
        /// The device's clock.
        Time(Time) = 0x8a,
        /// Ranges that were asked for.
        Ranges(Ranges) = 0x8b,
    }
}

//! What a host and the monorange co-processor say to each other over a serial line.
//!
//! | layer | module | promises |
//! |---|---|---|
//! | bytes → frames | [`frame`] | a frame that comes out is one that went in: COBS between zeros, CRC-32, sequence number |
//! | frames → messages | [`message`] | every payload decodes to a message or is counted; nothing panics, nothing is read beyond it |
//! | how much to send | [`window`] | a sender that stays inside never overruns the receiver, and a lost frame cannot stall it |
//! | a host's end of the line | `client` (feature `std`) | all of this over any byte stream |
//! | messages ↔ the core's types | `conversion` (feature `core`) | what a host sets is what a device runs, bit by bit |
//!
//! The wire format, byte by byte, with test vectors from which it can be implemented in C, is in `SPEC.md` beside
//! this crate; a test keeps the vectors there equal to what this code sends.
//!
//! Nothing here allocates: the largest object is a [`frame::Deframer`] of about 1 KiB.
//!
//! ```
//! use monorange_protocol::{frame::{self, Deframer}, message::{HostMessage, Hello}};
//! let mut line = [0; frame::MAX_ENCODED];
//! let hello = HostMessage::Hello(Hello { nonce: 7 });
//! let sent = hello.encode(0, &mut line)?;
//! assert_eq!(sent.len(), 12);
//!
//! let mut deframer = Deframer::default();
//! let mut heard = None;
//! for byte in sent.iter() {
//!     if let Some(Ok(frame)) = deframer.push(*byte) {
//!         heard = Some(HostMessage::decode(&frame) == Ok(HostMessage::Hello(Hello { nonce: 7 })));
//!     }
//! }
//! assert_eq!(heard, Some(true));
//! # Ok::<(), monorange_protocol::Error>(())
//! ```
#![no_std]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

#[cfg(feature = "std")]
extern crate std;

#[cfg(feature = "std")]
pub mod client;
#[cfg(feature = "core")]
pub mod conversion;
pub mod frame;
pub mod message;
pub mod window;

mod error;

pub use error::Error;

/// The version of frames and messages that this crate speaks; a frame of another is refused.
pub const VERSION: u8 = 1;

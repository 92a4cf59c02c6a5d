//! The co-processor's firmware, as a library.
//!
//! ```text
//! serial interrupt ─► Ring ─► Device ─► Link ─► messages ─► Engine (the pipeline) ─► answers ─► serial line
//!    bytes only       4 KiB            frames                rows as they arrive
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`ring`] | the receive buffer between interrupt and main loop |
//! | [`link`] | frames in and out: sequence numbers, counts, credit |
//! | [`engine`] | what the device runs, as the device sees it: a trait, so that tests can put a fake in its place |
//! | [`device`] | the state machine: what each message does, when a picture is given up, what is answered |
//! | [`mapper`] | the pipeline as engine, in static memory |
//! | [`meter`] | the cost of a frame by stages |
//! | [`patience`] | how long the line is waited for |
//! | [`restart`] | what a run leaves behind for the one after it |
//!
//! Nothing here allocates, blocks or knows a register. A board, in `boards/`, gives a line ([`embedded_io::Write`]), a [`Board`]
//! and a main loop; a host test gives a vector. A picture is never held: each row goes through the pipeline as it
//! arrives, and when one is missing the picture is given up and the filter predicts.
#![no_std]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

#[cfg(test)]
extern crate std;

pub mod device;
pub mod engine;
pub mod link;
pub mod mapper;
pub mod meter;
pub mod patience;
pub mod restart;
pub mod ring;
pub mod text;

#[cfg(feature = "crash")]
mod crash;

pub use device::{Device, Wish};
pub use engine::Engine;
pub use mapper::{Arrays, Mapper};
pub use ring::Ring;

use monorange_protocol::message::CostUnit;

/// Bytes that a host may have on the line: the size of a board's [`Ring`].
pub const WINDOW: usize = 4096;

/// What a board can say about itself.
pub trait Board {
    /// Its name.
    const NAME: &'static str;
    /// What costs are told in.
    const COST_UNIT: CostUnit;
    /// Ticks of the cost counter that the main loop took so far, wrapping.
    fn cost(&self) -> u32;
    /// Ticks of the cost counter that interrupts took so far, wrapping; not part of [`cost`](Self::cost).
    fn interrupt_cost(&self) -> u32;
    /// A difference of ticks in [`COST_UNIT`](Self::COST_UNIT).
    fn units_from_ticks(ticks: u32) -> u32;
    /// Time since the start.
    fn uptime_us(&self) -> u64;
    /// The deepest the stack has been, in bytes.
    fn stack_used(&self) -> u32;
    /// Bytes that the stack can take.
    fn stack_size(&self) -> u32;
    /// Bytes of the line that were lost because the ring was full.
    fn overrun(&self) -> u32;
    /// Starts the watchdog's time anew: called for every whole frame, since the answers to some may each wait for the line.
    fn alive(&self);
}

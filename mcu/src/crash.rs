//! Crashes on demand, for the tests of what happens then.
#![allow(clippy::panic, reason = "that is what it is for")]
use monorange_protocol::frame::Frame;

/// The number of the message: none of the protocol's.
const KIND: u8 = 0x7f;

pub(crate) fn on_demand(frame: &Frame<'_>) {
    match (frame.kind, frame.payload) {
        (KIND, [0]) => panic!("asked to panic"),
        (KIND, [1]) => drop(core::hint::black_box(overflow(1))),
        (KIND, [2]) => loop {
            // Not `spin_loop`: an emulator leaves its fast path at each of them, and two emulated seconds take half a minute.
            core::hint::black_box(());
        },
        _ => {}
    }
}

/// Fills the stack.
#[allow(unconditional_recursion, reason = "the stack is to overflow")]
fn overflow(depth: u32) -> u32 {
    let ballast = core::hint::black_box([depth; 64]);
    overflow(depth.wrapping_add(1)).wrapping_add(ballast.iter().sum())
}

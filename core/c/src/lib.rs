//! monorange for C: the range of a pixel, floor corners of a picture, pose and map of a drive.
//!
//! A static library without a heap: every object lives in memory that the caller gives, and ends with it. `include/monorange_core.h` is made from
//! this crate; `README.md` has the ten lines to begin with.
//!
//! Units are metres, radians, seconds and pixels; the robot's frame is x forward, y left; pixel (0, 0) is the centre of the top-left
//! pixel. A null pointer for an object is an error in words, never a crash. An object must not be used by two threads at once.
#![cfg_attr(not(feature = "std"), no_std)]

mod drive;
mod error;
mod extractor;
mod range_finder;
mod rig;
mod room;

pub use drive::*;
pub use error::*;
pub use extractor::*;
pub use range_finder::*;
pub use rig::*;

/// Bytes of memory for a range finder.
pub const MONORANGE_RANGE_FINDER_BYTES: usize = 512;
/// Bytes of memory for an extractor of 320 × 240 pictures.
pub const MONORANGE_EXTRACTOR_BYTES_320X240: usize = 60 * 1024;
/// Bytes of memory for a drive with 320 × 240 pictures and 32 landmarks.
pub const MONORANGE_DRIVE_BYTES_320X240: usize = 88 * 1024;

const _: () = assert!(range_finder::BYTES <= MONORANGE_RANGE_FINDER_BYTES);
const _: () = assert!(extractor::bytes(320, 240) <= MONORANGE_EXTRACTOR_BYTES_320X240);
const _: () = assert!(drive::bytes(320, 240, 32) <= MONORANGE_DRIVE_BYTES_320X240);

#[cfg(all(not(feature = "std"), not(test), target_os = "none"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn abort() -> !;
    }
    // SAFETY: C's `abort` takes nothing and does not return.
    unsafe { abort() }
}

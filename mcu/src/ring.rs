//! The receive buffer between the serial interrupt and the main loop.
use core::sync::atomic::{AtomicU8, AtomicU32, AtomicUsize, Ordering};

/// A ring of `N` bytes with one writer, the interrupt, and one reader, the main loop.
///
/// Both indices count bytes since the start and wrap; their difference is what waits. `N` is a power of two, so
/// that the wrap is none for the place in the buffer. Each index is stored by one side only, after the bytes that
/// it speaks of.
#[derive(Debug)]
pub struct Ring<const N: usize> {
    bytes: [AtomicU8; N],
    written: AtomicUsize,
    read: AtomicUsize,
    overrun: AtomicU32,
}

impl<const N: usize> Default for Ring<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Ring<N> {
    /// An empty ring.
    pub const fn new() -> Self {
        const { assert!(N.is_power_of_two() && N <= 1 << 15) };
        Self {
            bytes: [const { AtomicU8::new(0) }; N],
            written: AtomicUsize::new(0),
            read: AtomicUsize::new(0),
            overrun: AtomicU32::new(0),
        }
    }

    /// Takes a byte from the line; when the ring is full the byte is lost and counted. For the interrupt.
    #[inline]
    pub fn push(&self, byte: u8) {
        let written = self.written.load(Ordering::Relaxed);
        if written.wrapping_sub(self.read.load(Ordering::Acquire)) >= N {
            // Only the interrupt writes this count: no need for a read-modify-write.
            let overrun = self.overrun.load(Ordering::Relaxed);
            self.overrun.store(overrun.saturating_add(1), Ordering::Relaxed);
            return;
        }
        if let Some(place) = self.bytes.get(written % N) {
            place.store(byte, Ordering::Relaxed);
        }
        self.written.store(written.wrapping_add(1), Ordering::Release);
    }

    /// Moves waiting bytes to `out` and returns how many. For the main loop.
    #[inline]
    pub fn read(&self, out: &mut [u8]) -> usize {
        let read = self.read.load(Ordering::Relaxed);
        let count = self.written.load(Ordering::Acquire).wrapping_sub(read).min(out.len());
        for (offset, byte) in out.iter_mut().take(count).enumerate() {
            *byte = self
                .bytes
                .get(read.wrapping_add(offset) % N)
                .map_or(0, |place| place.load(Ordering::Relaxed));
        }
        self.read.store(read.wrapping_add(count), Ordering::Release);
        count
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.written.load(Ordering::Acquire) == self.read.load(Ordering::Relaxed)
    }

    /// Bytes lost because the ring was full.
    pub fn overrun(&self) -> u32 {
        self.overrun.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_comes_out_in_order_and_the_rest_is_counted() {
        let ring = Ring::<8>::new();
        let mut out = [0; 16];
        for round in 0..100_u8 {
            (0..11).for_each(|step| ring.push(round.wrapping_mul(11).wrapping_add(step)));
            let first = round.wrapping_mul(11);
            assert_eq!(ring.read(&mut out[..3]), 3);
            assert_eq!(ring.read(&mut out[3..]), 5);
            assert!(out.iter().zip(0..8).all(|(byte, step)| *byte == first.wrapping_add(step)));
        }
        assert!(ring.is_empty());
        assert_eq!(ring.overrun(), 300);
    }
}

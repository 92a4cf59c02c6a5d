//! The receive buffer between the serial interrupt and the main loop.
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, AtomicUsize, Ordering};

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
    ready: AtomicBool,
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
            ready: AtomicBool::new(false),
        }
    }

    /// Takes what `next` gives, the bytes that the line has; when the ring is full they are lost and counted. For the interrupt.
    #[inline]
    pub fn fill(&self, mut next: impl FnMut() -> Option<u8>) {
        let mut written = self.written.load(Ordering::Relaxed);
        let read = self.read.load(Ordering::Acquire);
        let end = read.wrapping_add(N);
        let (mut lost, mut ended) = (0, false);
        while let Some(byte) = next() {
            if byte == 0 {
                ended = true;
            }
            if written == end {
                lost += 1;
            } else if let Some(place) = self.bytes.get(written % N) {
                place.store(byte, Ordering::Relaxed);
                written = written.wrapping_add(1);
            }
        }
        if lost > 0 {
            // Only the interrupt writes this count: no need for a read-modify-write.
            self.overrun.store(self.overrun().saturating_add(lost), Ordering::Relaxed);
        }
        self.written.store(written, Ordering::Release);
        if ended || written.wrapping_sub(read) >= N / 4 {
            self.ready.store(true, Ordering::Release);
        }
    }

    /// Moves waiting bytes to `out` and returns how many. For the main loop.
    #[inline]
    pub fn read(&self, out: &mut [u8]) -> usize {
        let read = self.read.load(Ordering::Relaxed);
        let waiting = self.written.load(Ordering::Acquire).wrapping_sub(read);
        // Up to the end of the memory; the rest comes with the next call.
        let waiting = self.bytes.get(read % N..).unwrap_or_default().iter().take(waiting);
        let mut count = 0;
        for (byte, place) in out.iter_mut().zip(waiting) {
            *byte = place.load(Ordering::Relaxed);
            count += 1;
        }
        self.read.store(read.wrapping_add(count), Ordering::Release);
        count
    }

    /// Whether a frame may have ended, or much has come, since this was asked last: before, there is nothing to do for the main
    /// loop. A line may fall silent within a frame, so that one should look now and then without.
    pub fn take_ready(&self) -> bool {
        // Loads and stores suffice: a frame that ends in between sets the flag again, or its bytes are there to be read.
        let ready = self.ready.load(Ordering::Acquire);
        if ready {
            self.ready.store(false, Ordering::Release);
        }
        ready
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
        for round in 0..100_u8 {
            let first = round.wrapping_mul(11);
            let mut bytes = (0..11).map(|step| first.wrapping_add(step));
            ring.fill(|| bytes.next());
            let (mut out, mut count) = ([0; 16], 0);
            loop {
                let some = ring.read(&mut out[count..][..3]);
                count += some;
                if some == 0 {
                    break;
                }
            }
            assert_eq!(count, 8);
            assert!(out.iter().zip(0..8).all(|(byte, step)| *byte == first.wrapping_add(step)));
        }
        assert_eq!(ring.overrun(), 300);
    }

    #[test]
    fn it_is_ready_when_a_frame_may_have_ended_or_much_has_come() {
        let ring = Ring::<64>::new();
        let fill = |bytes: &[u8]| {
            let mut bytes = bytes.iter().copied();
            ring.fill(|| bytes.next());
            ring.take_ready()
        };
        assert!(!fill(&[1, 2, 3]));
        assert!(fill(&[4, 0]) && !ring.take_ready());
        assert!(fill(&[5; 11]));
    }
}

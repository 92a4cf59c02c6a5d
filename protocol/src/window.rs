//! Flow control: how much a host may send.
//!
//! The device tells in every [`Credit`](crate::message::Credit) the sequence number of the last frame that it took
//! off the line, and how many bytes it can hold beyond that. A host sends only while the frames after that number,
//! as it remembers them, fit with the next one. The numbers acknowledge cumulatively: a frame or a credit that is lost is
//! covered by the next one. Were everything in flight lost, no credit would come: a host that has waited a while
//! ([`Window::forget`]) counts the line as empty and says hello again, which is always answered with a credit.

/// Frames in flight that a host remembers, at most.
const FRAMES: usize = 64;

/// The sending end's account of bytes in flight.
#[derive(Clone, Debug)]
pub struct Window {
    granted: usize,
    in_flight: heapless::Deque<(u16, u16), FRAMES>,
    bytes: usize,
}

impl Default for Window {
    fn default() -> Self {
        Self::new()
    }
}

impl Window {
    /// What may be sent before the first credit: one [`Hello`](crate::message::Hello).
    const BEFORE_CREDIT: usize = 32;

    /// A window before the device's first credit: room for a hello.
    pub const fn new() -> Self {
        Self { granted: Self::BEFORE_CREDIT, in_flight: heapless::Deque::new(), bytes: 0 }
    }

    /// Whether a frame of `bytes` on the line may be sent now.
    pub fn has_room(&self, bytes: usize) -> bool {
        !self.in_flight.is_full() && self.bytes + bytes <= self.granted
    }

    /// Notes that the frame `sequence` of `bytes` was sent.
    pub fn sent(&mut self, sequence: u16, bytes: usize) {
        if self.in_flight.is_full() {
            self.drop_oldest();
        }
        let length = u16::try_from(bytes).unwrap_or(u16::MAX);
        if self.in_flight.push_back((sequence, length)).is_ok() {
            self.bytes += usize::from(length);
        }
    }

    /// Takes a credit: `sequence` and all before it are off the line, and `granted` bytes may follow it.
    pub fn credit(&mut self, sequence: u16, granted: u16) {
        self.granted = usize::from(granted);
        let heard = |sent: u16| sequence.wrapping_sub(sent) < 0x8000;
        while self.in_flight.front().is_some_and(|(sent, _)| heard(*sent)) {
            self.drop_oldest();
        }
    }

    /// Counts everything in flight as lost: after a silence, or when the device restarted.
    pub fn forget(&mut self) {
        self.in_flight.clear();
        self.bytes = 0;
        self.granted = self.granted.max(Self::BEFORE_CREDIT);
    }

    /// Bytes sent and not acknowledged.
    pub fn in_flight(&self) -> usize {
        self.bytes
    }

    fn drop_oldest(&mut self) {
        if let Some((_, length)) = self.in_flight.pop_front() {
            self.bytes -= usize::from(length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_credit_acknowledges_every_frame_before_it() {
        let mut window = Window::new();
        window.credit(9, 100);
        for sequence in 10..14 {
            assert!(window.has_room(25));
            window.sent(sequence, 25);
        }
        assert!(!window.has_room(1));
        window.credit(12, 100); // those of 10 and 11 were lost
        assert_eq!(window.in_flight(), 25);
        assert!(window.has_room(75) && !window.has_room(76));
    }

    #[test]
    fn numbers_wrap() {
        let mut window = Window::new();
        window.credit(0xfffe, 100);
        window.sent(0xffff, 40);
        window.sent(0, 40);
        window.credit(0, 100);
        assert_eq!(window.in_flight(), 0);
    }

    #[test]
    fn before_the_first_credit_only_a_hello_fits() {
        let window = Window::new();
        assert!(window.has_room(16) && !window.has_room(crate::frame::MAX_ENCODED));
    }
}

//! What a run leaves behind for the one after it.
//!
//! A board keeps one [`LastRun`] in memory that its start-up code does not clear. A panic or a fault writes why and where,
//! and restarts; the new run finds the record and tells the host. After power came back the memory holds anything:
//! the record is believed only if its checksum holds.
use core::fmt::{self, Write};
use monorange_protocol::message::{LastPanic, RestartCause};

const TEXT: usize = 192;
const MAGIC: u32 = 0x6d6f_6e6f;

/// Counts restarts and keeps why the last run ended. Any bit pattern is one, as memory after power-up requires.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct LastRun {
    restarts: u32,
    /// 0: nothing happened. Otherwise one more than the place in [`CAUSES`].
    cause: u32,
    length: u32,
    text: [u8; TEXT],
    checksum: u32,
}

const CAUSES: [RestartCause; 3] = [RestartCause::Panic, RestartCause::HardFault, RestartCause::Watchdog];

impl Default for LastRun {
    fn default() -> Self {
        let mut new = Self { restarts: 0, cause: 0, length: 0, text: [0; TEXT], checksum: 0 };
        new.seal();
        new
    }
}

impl LastRun {
    /// Notes why this run ends.
    pub fn record(&mut self, cause: RestartCause, text: impl fmt::Display) {
        let mut words = Words { text: &mut self.text, length: 0 };
        // A text that is too long is cut, which is the only error.
        let _ = write!(words, "{text}");
        self.length = words.length as u32;
        self.cause = match cause {
            RestartCause::Panic => 1,
            RestartCause::HardFault => 2,
            RestartCause::Watchdog => 3,
        };
        self.seal();
    }

    /// Begins a new run: returns what the last one left, with the new run's number.
    pub fn begin(&mut self) -> Self {
        if self.checksum != self.sum() {
            *self = Self::default();
        }
        self.restarts = self.restarts.wrapping_add(1);
        let left = *self;
        self.cause = 0;
        self.seal();
        left
    }

    /// What ended the run, if that was not loss of power or a wish.
    pub fn cause(&self) -> Option<LastPanic<'_>> {
        let cause = *CAUSES.get((self.cause as usize).checked_sub(1)?)?;
        let text = self.text.get(..self.length as usize).unwrap_or_default();
        Some(LastPanic { cause, text: core::str::from_utf8(text).unwrap_or("(not text)") })
    }

    /// Runs since power came, wrapping: the first is 1.
    pub fn count(&self) -> u8 {
        self.restarts as u8
    }

    fn seal(&mut self) {
        self.checksum = self.sum();
    }

    /// Fletcher's sum: this runs in a fault handler, so it is short and touches nothing else.
    fn sum(&self) -> u32 {
        let words = [self.restarts, self.cause, self.length];
        let text = self.text.iter().map(|byte| u32::from(*byte));
        let (low, high) = words.into_iter().chain(text).fold((MAGIC, MAGIC), |(low, high), word| {
            let low = low.wrapping_add(word);
            (low, high.rotate_left(1).wrapping_add(low))
        });
        low ^ high
    }
}

/// Writes text into bytes, whole characters only, until they are full.
struct Words<'a> {
    text: &'a mut [u8; TEXT],
    length: usize,
}

impl Write for Words<'_> {
    fn write_str(&mut self, piece: &str) -> fmt::Result {
        for character in piece.chars() {
            let mut bytes = [0; 4];
            let bytes = character.encode_utf8(&mut bytes).as_bytes();
            let end = self.length + bytes.len();
            self.text.get_mut(self.length..end).ok_or(fmt::Error)?.copy_from_slice(bytes);
            self.length = end;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_learns_once_why_the_last_one_ended() {
        let mut memory = LastRun::default();
        assert_eq!(memory.begin().cause(), None);
        memory.record(RestartCause::Panic, format_args!("line {}", 7));
        let left = memory.begin();
        assert_eq!(left.cause(), Some(LastPanic { cause: RestartCause::Panic, text: "line 7" }));
        assert_eq!(memory.begin().cause(), None);
        assert_eq!(memory.count(), 3);
    }

    #[test]
    fn memory_after_power_up_is_no_record() {
        let mut memory =
            LastRun { restarts: 77, cause: 1, length: 9_999, text: [0xff; TEXT], checksum: 0xffff_ffff };
        let left = memory.begin();
        assert_eq!((left.cause(), left.count()), (None, 1));
    }

    #[test]
    fn a_long_text_is_cut_between_characters() {
        let mut memory = LastRun::default();
        memory.record(RestartCause::HardFault, "é".repeat(200));
        assert_eq!(memory.begin().cause().unwrap().text, "é".repeat(TEXT / 2));
    }
}

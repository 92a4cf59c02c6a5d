//! How long the line is waited for.
//!
//! A host that does not read costs the device one wait, and no more until the line moves again: answers are given up, the
//! filter and the watchdog go on.

/// The line did not take a byte in time: its other end does not listen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stuck;

impl core::fmt::Display for Stuck {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the line did not take a byte in time")
    }
}
impl core::error::Error for Stuck {}
impl embedded_io::Error for Stuck {
    fn kind(&self) -> embedded_io::ErrorKind {
        embedded_io::ErrorKind::TimedOut
    }
}

/// Whether the line is waited for.
#[derive(Debug, Default)]
pub struct Patience {
    lost: bool,
}

impl Patience {
    /// With a line that moves.
    pub const fn new() -> Self {
        Self { lost: false }
    }

    /// The line has taken something.
    #[inline]
    pub fn moved(&mut self) {
        self.lost = false;
    }

    /// Waits until the line is `ready` for a byte, or until it is `late`.
    ///
    /// # Errors
    /// It is late, or was before and has not moved since.
    pub fn wait(&mut self, ready: impl Fn() -> bool, late: impl Fn() -> bool) -> Result<(), Stuck> {
        while !ready() {
            if self.lost || late() {
                self.lost = true;
                return Err(Stuck);
            }
        }
        self.moved();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    #[test]
    fn a_line_that_does_not_move_is_waited_for_once() {
        let (waits, moves) = (Cell::new(0), Cell::new(false));
        let late = || {
            waits.set(waits.get() + 1);
            waits.get() % 100 == 0
        };
        let mut patience = Patience::new();
        for _ in 0..1_000 {
            assert_eq!(patience.wait(|| moves.get(), late), Err(Stuck));
        }
        assert_eq!(waits.get(), 100, "one wait for a thousand bytes");
        moves.set(true);
        assert_eq!(patience.wait(|| moves.get(), late), Ok(()));
        moves.set(false);
        assert_eq!(patience.wait(|| moves.get(), late), Err(Stuck));
        assert_eq!(waits.get(), 200, "and one more after it moved");
    }
}

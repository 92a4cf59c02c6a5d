//! What lines do to frames.
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

/// Every kind of damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    FlippedBits,
    LostBytes,
    DoubledBytes,
    SwappedBytes,
    TruncatedFrame,
    LostFrame,
    FrameTwice,
    /// The other end talks at another rate for a while: bytes of long and short runs of equal bits.
    BaudRateGarbage,
    /// More was sent than the receiver had room for: a run of up to 3 KiB is gone.
    Overrun,
    /// Zeros, as a line that is held low gives.
    Break,
}

pub(crate) const FAULTS: [Fault; 10] = [
    Fault::FlippedBits,
    Fault::LostBytes,
    Fault::DoubledBytes,
    Fault::SwappedBytes,
    Fault::TruncatedFrame,
    Fault::LostFrame,
    Fault::FrameTwice,
    Fault::BaudRateGarbage,
    Fault::Overrun,
    Fault::Break,
];

/// A source of damage that is the same on every run.
pub(crate) struct Damager(ChaCha8Rng);

impl Damager {
    pub(crate) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// A number below `end`.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        self.0.next_u32() as usize % end.max(1)
    }

    /// The bytes on the line when `frames` are sent and `fault` happens somewhere.
    pub(crate) fn damage(&mut self, mut frames: Vec<Vec<u8>>, fault: Fault) -> Vec<u8> {
        let at = self.below(frames.len());
        let length = frames[at].len();
        let byte = self.below(length);
        match fault {
            Fault::FlippedBits => {
                for _ in 0..=self.below(3) {
                    let byte = self.below(length);
                    frames[at][byte] ^= 1 << self.below(8);
                }
            }
            Fault::LostBytes => {
                let end = length.min(byte + 1 + self.below(20));
                frames[at].drain(byte..end);
            }
            Fault::DoubledBytes => {
                let end = length.min(byte + 1 + self.below(4));
                let doubled = frames[at][byte..end].to_vec();
                frames[at].splice(byte..byte, doubled);
            }
            Fault::SwappedBytes => {
                let other = self.below(length);
                frames[at].swap(byte, other);
            }
            Fault::TruncatedFrame => frames[at].truncate(byte),
            Fault::LostFrame => drop(frames.remove(at)),
            Fault::FrameTwice => frames.insert(at, frames[at].clone()),
            Fault::BaudRateGarbage => {
                let garbage = (0..10 + self.below(300)).map(|_| {
                    let run = self.below(9);
                    (0xff00_u32 >> run) as u8 ^ if self.below(2) == 0 { 0 } else { 0xff }
                });
                let garbage: Vec<_> = garbage.collect();
                frames[at].splice(byte..byte, garbage);
            }
            Fault::Overrun => {
                let mut line = frames.concat();
                let from = self.below(line.len());
                let end = line.len().min(from + 1 + self.below(3_000));
                line.drain(from..end);
                return line;
            }
            Fault::Break => {
                let zeros = vec![0; 1 + self.below(50)];
                frames[at].splice(byte..byte, zeros);
            }
        }
        frames.concat()
    }
}

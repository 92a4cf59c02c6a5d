//! Two 16-bit values side by side in a 32-bit word: a processor without vector instructions adds both at once, and where there
//! are vector instructions the compiler makes them of the same code.
//!
//! Nothing may carry from the lower value into the upper one: values are unsigned, sums stay below 2¹⁶, and what can be
//! negative is stored with an offset.

/// Two neighbours as one word, the first one low.
#[inline(always)]
pub(super) fn join([first, second]: [u16; 2]) -> u32 {
    u32::from(first) | u32::from(second) << 16
}

/// The two neighbours of a word.
#[inline(always)]
pub(super) fn split(word: u32) -> [u16; 2] {
    [word as u16, (word >> 16) as u16]
}

/// The same value twice.
pub(super) const fn both(value: u16) -> u32 {
    value as u32 * 0x1_0001
}

/// The whole pairs from value `start` on.
#[inline(always)]
pub(super) fn pairs(row: &[u16], start: usize) -> &[[u16; 2]] {
    row.get(start..).unwrap_or_default().as_chunks().0
}

//! Kernels over rows of 16-bit values, as many at once as the processor can: without vector instructions two values side by side
//! in a 32-bit word, and with them one by one in a loop of which the compiler makes vectors. The same kernel serves both.
//!
//! Nothing may carry from one value into the next: values are unsigned, sums stay below 2¹⁶, and what can be negative is stored
//! with an offset.
#![allow(clippy::indexing_slicing, reason = "kernel: slices are cut to the length of the loop")]
use core::ops::{Add, Sub};

/// Whether the processor has vector instructions.
pub(super) const VECTORS: bool =
    cfg!(any(target_feature = "simd128", target_feature = "sse2", target_feature = "neon"));

/// What kernels are made of.
#[cfg(any(target_feature = "simd128", target_feature = "sse2", target_feature = "neon"))]
pub(super) type Word = Single;
#[cfg(not(any(target_feature = "simd128", target_feature = "sse2", target_feature = "neon")))]
pub(super) type Word = Pair;

/// Neighbouring values of a row that are treated alike.
pub(super) trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> {
    /// As they lie in memory.
    type Values: AsRef<[u16]> + AsMut<[u16]>;

    /// The same value in every place.
    fn splat(value: u16) -> Self;
    /// Every value times 2ⁿ.
    fn up<const N: u32>(self) -> Self;
    /// Every value over 2ⁿ, rounded down.
    fn down<const N: u32>(self) -> Self;
    fn load(values: &Self::Values) -> Self;
    fn store(self) -> Self::Values;
    /// A row as whole groups, and the rest.
    fn groups(row: &[u16]) -> (&[Self::Values], &[u16]);
    fn groups_mut(row: &mut [u16]) -> (&mut [Self::Values], &mut [u16]);
}

/// One value.
#[derive(Clone, Copy)]
#[allow(dead_code, reason = "one of the two is in use, and both are tested")]
pub(super) struct Single(u16);

/// Two values, the first one low.
#[derive(Clone, Copy)]
#[allow(dead_code, reason = "one of the two is in use, and both are tested")]
pub(super) struct Pair(u32);

macro_rules! lanes {
    ($lanes:ident, $count:literal, $splat:expr, $load:expr, $store:expr) => {
        impl Add for $lanes {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self(self.0.wrapping_add(other.0))
            }
        }

        impl Sub for $lanes {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self(self.0.wrapping_sub(other.0))
            }
        }

        impl Lanes for $lanes {
            type Values = [u16; $count];

            #[inline(always)]
            fn splat(value: u16) -> Self {
                Self($splat(value))
            }
            #[inline(always)]
            fn up<const N: u32>(self) -> Self {
                Self(self.0 << N)
            }
            #[inline(always)]
            fn down<const N: u32>(self) -> Self {
                Self(self.0 >> N & $splat(u16::MAX >> N))
            }
            #[inline(always)]
            fn load(values: &[u16; $count]) -> Self {
                Self($load(*values))
            }
            #[inline(always)]
            fn store(self) -> [u16; $count] {
                $store(self.0)
            }
            #[inline(always)]
            fn groups(row: &[u16]) -> (&[[u16; $count]], &[u16]) {
                row.as_chunks()
            }
            #[inline(always)]
            fn groups_mut(row: &mut [u16]) -> (&mut [[u16; $count]], &mut [u16]) {
                row.as_chunks_mut()
            }
        }
    };
}

lanes!(Single, 1, |value| value, |[value]: [u16; 1]| value, |value| [value]);
lanes!(Pair, 2, both, join, |pair| [pair as u16, (pair >> 16) as u16]);

/// The same value twice.
#[inline(always)]
pub(super) const fn both(value: u16) -> u32 {
    value as u32 * 0x1_0001
}

/// Two neighbours as one word.
#[inline(always)]
pub(super) fn join([first, second]: [u16; 2]) -> u32 {
    u32::from(first) | u32::from(second) << 16
}

/// Writes what `kernel` makes of the values at the same place of every input row, as far as all rows reach.
#[inline(always)]
pub(super) fn each<W: Lanes, const INPUTS: usize, const OUTPUTS: usize>(
    inputs: [&[u16]; INPUTS],
    outputs: [&mut [u16]; OUTPUTS],
    kernel: impl Fn([W; INPUTS]) -> [W; OUTPUTS],
) {
    let lengths = inputs.iter().map(|row| row.len()).chain(outputs.iter().map(|row| row.len()));
    let length = lengths.min().unwrap_or(0);
    let inputs = inputs.map(|row| W::groups(&row[..length]));
    let mut outputs = outputs.map(|row| W::groups_mut(&mut row[..length]));
    let count = outputs.first().map_or(0, |(groups, _)| groups.len());
    let whole = inputs.map(|(groups, _)| &groups[..count]);
    let mut out = outputs.each_mut().map(|(groups, _)| &mut groups[..count]);
    for k in 0..count {
        for (out, done) in out.iter_mut().zip(kernel(whole.map(|groups| W::load(&groups[k])))) {
            out[k] = done.store();
        }
    }
    let rest = inputs.map(|(_, rest)| {
        let mut padded = W::splat(0).store();
        padded.as_mut().iter_mut().zip(rest).for_each(|(value, rest)| *value = *rest);
        W::load(&padded)
    });
    for ((_, out), done) in outputs.iter_mut().zip(kernel(rest)) {
        out.iter_mut().zip(done.store().as_ref()).for_each(|(out, done)| *out = *done);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    fn written<W: Lanes>(first: &[u16], second: &[u16]) -> [Vec<u16>; 2] {
        let mut out = [vec![0; first.len()], vec![0; first.len()]];
        let [sum, difference] = &mut out;
        each([first, second], [sum, difference], |[a, b]: [W; 2]| {
            [(a.up::<2>() + b).down::<3>(), W::splat(4080) + a - b]
        });
        out
    }

    proptest! {
        #[test]
        fn one_value_and_two_at_a_time_give_the_same(rows in prop::collection::vec((0..=4080_u16, 0..=4080_u16), 0..70)) {
            let (first, second): (Vec<_>, Vec<_>) = rows.iter().copied().unzip();
            let expected = [
                rows.iter().map(|(a, b)| (4 * a + b) / 8).collect::<Vec<_>>(),
                rows.iter().map(|(a, b)| 4080 + a - b).collect(),
            ];
            prop_assert_eq!(&written::<Single>(&first, &second), &expected);
            prop_assert_eq!(&written::<Pair>(&first, &second), &expected);
        }
    }
}

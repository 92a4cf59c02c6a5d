//! P ← P − Σ w wᵀ + a bᵀ + b aᵀ: the one pass over the covariance in which a frame's corrections are made.
//!
//! Entries are taken in bands of rows, and all of a frame's vectors are added to a band before the next is begun: it stays in
//! the processor's nearest memory. Where vectors are wide a band is cut into tiles of [`BAND`] columns, or of twice as many:
//! what is read of a vector serves the whole tile, and no loop has a remainder. Bands and tiles are counted from the last row
//! and column, so that every tile is whole but those on the diagonal, and what is left over is the first band's height.
//!
//! ```text
//!   0 ┌────┬────┬────┬────┐
//!     └┐ D │    │    │    │     n mod 16 rows
//!   m  └───┼────┼────┼────┤
//!          └┐ D │    │    │     16 rows
//!           └───┼────┼────┤
//!               └┐ D │    │     D: what is below the diagonal belongs to other rows, and is
//!                └───┼────┤        left as it is, as is what lies beyond the first band's m
//!                    └┐ D │
//!   n                 └───┘
//! ```
//!
//! Elsewhere, and in matrices narrower than a tile, rows are taken two by two: what is read of a vector serves both.
//!
//! Every entry gets the same sum in the same order in either way and at any width, to the bit.
#![allow(clippy::indexing_slicing, reason = "kernel: all vectors are sliced to the triangle's size first")]
use crate::Real;
use crate::slam::covariance::triangle::Triangle;
use crate::vectors::{in_powers, widest_of_three};
use core::array::from_fn;
use core::ops::Range;

/// Rows of a band, and columns of its tile on the diagonal: one AVX-512 vector of `f32`, and two of AVX2.
const BAND: usize = 16;

/// P ← P − Σ w wᵀ (+ a bᵀ + b aᵀ).
#[inline(never)]
pub(in crate::slam) fn downdate<T: Real>(
    p: &mut Triangle<'_, T>,
    pairs: &[[&[T]; 2]],
    reset: Option<[&[T]; 2]>,
) {
    widest_of_three(
        (p, pairs, reset),
        #[inline(always)]
        |all| pass::<T, { 2 * BAND }>(all),
        #[inline(always)]
        |all| pass::<T, BAND>(all),
        #[inline(always)]
        |all| pass::<T, 0>(all),
    );
}

type Downdate<'a, 'p, T> = (&'a mut Triangle<'p, T>, &'a [[&'a [T]; 2]], Option<[&'a [T]; 2]>);

/// The pass, in tiles of at most `WIDTH` columns, or by rows where that is 0: one for each kind of processor. What is not
/// inlined in it has to be its own, not shared with the others, and therefore has `WIDTH` among its parameters too.
#[inline(always)]
fn pass<T: Real, const WIDTH: usize>((p, pairs, reset): Downdate<'_, '_, T>) {
    let mut band = 0..if in_tiles(WIDTH, p) { p.size % BAND } else { 0 };
    while band.start < p.size {
        let mut rest = pairs;
        if let Some([a, b]) = reset {
            if let [[u, v], tail @ ..] = rest {
                add::<T, 4, true, WIDTH>(p, &band, [u, v, a, b]);
                rest = tail;
            } else {
                add::<T, 2, true, WIDTH>(p, &band, [a, b]);
            }
        }
        while let [[u, v], [s, t], tail @ ..] = rest {
            add::<T, 4, false, WIDTH>(p, &band, [u, v, s, t]);
            rest = tail;
        }
        if let [[u, v]] = rest {
            add::<T, 2, false, WIDTH>(p, &band, [u, v]);
        }
        band = band.end..p.size.min(band.end + BAND);
    }
}

/// Whether a triangle is taken in tiles of at most `width` columns.
fn in_tiles<T>(width: usize, p: &Triangle<'_, T>) -> bool {
    width > 0 && p.size >= BAND
}

/// P ← P − Σ v vᵀ in the rows of a band; with `TURN` the last two vectors, s and t, come as + s tᵀ + t sᵀ.
#[inline(always)]
fn add<T: Real, const N: usize, const TURN: bool, const WIDTH: usize>(
    p: &mut Triangle<'_, T>,
    band: &Range<usize>,
    vectors: [&[T]; N],
) {
    if in_tiles(WIDTH, p) {
        let size = p.size;
        let vectors: [&[T]; N] = from_fn(|k| &vectors[k][..size]);
        let (below, length) = p.below_mut(band.start);
        tile::<T, N, TURN, true, BAND>((below, length), band, band.start, vectors);
        let mut column = band.end;
        while WIDTH > BAND && column + WIDTH <= size {
            tile::<T, N, TURN, false, WIDTH>((below, length), band, column, vectors);
            column += WIDTH;
        }
        while column < size {
            tile::<T, N, TURN, false, BAND>((below, length), band, column, vectors);
            column += BAND;
        }
    } else if N == 2 {
        rows_of_two::<T, TURN, WIDTH>(p, band, [vectors[0], vectors[1]]);
    } else {
        rows_of_four::<T, TURN, WIDTH>(p, band, [vectors[0], vectors[1], vectors[2], vectors[3]]);
    }
}

/// The tile of a band that begins at `column`; of the one on the `DIAGONAL`, what is on it and above.
///
/// The band comes as all that is kept from its first row on, and that row's length.
#[inline(always)]
fn tile<T: Real, const N: usize, const TURN: bool, const DIAGONAL: bool, const WIDTH: usize>(
    (below, mut length): (&mut [T], usize),
    band: &Range<usize>,
    column: usize,
    vectors: [&[T]; N],
) {
    let along: [[T; WIDTH]; N] = from_fn(|k| from_fn(|lane| vectors[k][column..][..WIDTH][lane]));
    let mut below = &mut below[column - band.start..];
    for row in band.clone() {
        // Entries before factors: a factor that is read where it is used costs nothing.
        let Some(entries) = below.first_chunk_mut::<WIDTH>() else { return };
        let factors = from_fn(|k| vectors[partner::<N, TURN>(k)][row]);
        let left = (band.end - row) as u32;
        for lane in 0..WIDTH {
            let step = step::<T, N, TURN>(factors, from_fn(|k| along[k][lane]));
            // Columns below the diagonal, and those beyond the first band's height, are other rows' or another tile's. Adding
            // −0 and taking away +0 leave every number as it is, zeros of either sign among them.
            let nothing = if TURN { -T::zero() } else { T::zero() };
            let step = if DIAGONAL && (lane as u32).wrapping_sub((row - band.start) as u32) >= left {
                nothing
            } else {
                step
            };
            entries[lane] = changed::<T, TURN>(entries[lane], step);
        }
        // The same column in the next row, which begins a column later.
        length -= 1;
        below = &mut below[length..];
    }
}

/// Σ factor · number, of two or of four.
#[inline(always)]
fn step<T: Real, const N: usize, const TURN: bool>(f: [T; N], v: [T; N]) -> T {
    if N == 2 {
        two([f[0], f[1]], [v[0], v[1]])
    } else {
        four::<T, TURN>([f[0], f[1], f[2], f[3]], [v[0], v[1], v[2], v[3]])
    }
}

#[inline(always)]
pub(in crate::slam) fn two<T: Real>([f, g]: [T; 2], [u, v]: [T; 2]) -> T {
    f * u + g * v
}

/// With `TURN` the last two count against the first.
#[inline(always)]
fn four<T: Real, const TURN: bool>([f, g, h, k]: [T; 4], [u, v, s, t]: [T; 4]) -> T {
    let (first, last) = (two([f, g], [u, v]), two([h, k], [s, t]));
    if TURN { last - first } else { first + last }
}

/// A step is taken from an entry, and added to it with `TURN`.
#[inline(always)]
fn changed<T: Real, const TURN: bool>(entry: T, step: T) -> T {
    if TURN { entry + step } else { entry - step }
}

/// Which vector multiplies vector `k`: itself, or with `TURN` the other one of the last two.
const fn partner<const N: usize, const TURN: bool>(k: usize) -> usize {
    if TURN && k + 2 >= N { k ^ 1 } else { k }
}

/// The rows of a band two by two, of so many vectors; `turned` has the last two of them change places.
///
/// Written out for either number: what is optimised for size makes loops of what is written for any.
macro_rules! rows_of {
    ($rows:ident, $pair:ident, $count:literal, $step:expr, $($vector:ident)+, turned $($partner:ident)+) => {
        #[inline(always)]
        fn $rows<T: Real, const TURN: bool, const COPY: usize>(
            p: &mut Triangle<'_, T>,
            band: &Range<usize>,
            [$($vector),+]: [&[T]; $count],
        ) {
            let size = p.size;
            $(let $vector = &$vector[..size];)+
            let factors = |at: usize| if TURN { [$($partner[at]),+] } else { [$($vector[at]),+] };
            let mut at = band.start;
            while at < band.end {
                let [upper, lower] = p.two_rows_mut(at);
                let (next, above) = (at + 1, factors(at));
                upper[0] = changed::<T, TURN>(upper[0], $step(above, [$($vector[at]),+]));
                // Bands begin at even rows: only the matrix's last row is ever alone, and ends on the diagonal.
                if next < band.end {
                    let factors = [above, factors(next)];
                    $pair::<T, TURN, COPY>(&mut upper[1..], lower, factors, [$(&$vector[next..]),+]);
                }
                at += 2;
            }
        }

        /// Two rows' steps: Σ factor · vector is taken from both, or added with `TURN`.
        ///
        /// The rows are separate `&mut` arguments, so that LLVM may assume that they do not overlap and the loop need not check
        /// at run time. LLVM learns this from the function on its own, before it inlines it: hence no `#[inline(always)]`. It
        /// inlines a function that has one caller: `TURN` and `COPY` make a function for each caller. Where no wider vectors are
        /// chosen the function is not inlined, to save flash.
        #[cfg_attr(target_arch = "x86_64", inline)]
        #[cfg_attr(not(target_arch = "x86_64"), inline(never))]
        pub(in crate::slam) fn $pair<T: Real, const TURN: bool, const COPY: usize>(
            upper: &mut [T],
            lower: &mut [T],
            [above, below]: [[T; $count]; 2],
            [$($vector),+]: [&[T]; $count],
        ) {
            let count = lower.len();
            let upper = &mut upper[..count];
            $(let $vector = &$vector[..count];)+
            in_powers(
                count,
                #[inline(always)]
                |columns| {
                    for at in columns {
                        let numbers = [$($vector[at]),+];
                        upper[at] = changed::<T, TURN>(upper[at], $step(above, numbers));
                        lower[at] = changed::<T, TURN>(lower[at], $step(below, numbers));
                    }
                },
            );
        }
    };
}
rows_of!(rows_of_two, two_rows_of_two, 2, two, u v, turned v u);
rows_of!(rows_of_four, two_rows_of_four, 4, four::<T, TURN>, u v s t, turned u v t s);

#[cfg(test)]
pub(in crate::slam) mod tests {
    use super::*;
    use std::vec::Vec;

    /// Numbers of both signs and of several magnitudes, and some zeros of either sign.
    pub(in crate::slam) fn numbers(count: usize, seed: u32) -> Vec<f32> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        (0..count).map(|at| next() * [1.0, 1e-3, 30.0, 0.0][at % 7 % 4]).collect()
    }

    pub(in crate::slam) fn bits(numbers: &[f32]) -> Vec<u32> {
        numbers.iter().map(|number| number.to_bits()).collect()
    }

    /// The definition, entry by entry.
    fn entry_by_entry(p: &mut Triangle<'_, f32>, pairs: &[[&[f32]; 2]], reset: Option<[&[f32]; 2]>) {
        let size = p.size;
        for (i, j) in (0..size).flat_map(|i| (i..size).map(move |j| (i, j))) {
            let mut steps = pairs.iter().map(|[u, v]| u[i] * u[j] + v[i] * v[j]);
            let turn = reset.map(|[a, b]| b[i] * a[j] + a[i] * b[j]);
            let mut entry = p.at(i, j);
            if let Some(turn) = turn {
                entry += steps.next().map_or(turn, |step| turn - step);
            }
            while let Some(step) = steps.next() {
                entry -= steps.next().map_or(step, |next| step + next);
            }
            p.set(i, j, entry);
        }
    }

    fn with_avx2(call: impl FnOnce()) {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = fearless_simd::Level::new().as_avx2() {
            return fearless_simd::Simd::vectorize(avx2, call);
        }
        call();
    }

    #[test]
    fn every_copy_of_the_pass_gives_the_definitions_bits() {
        for size in 3..70 {
            let capacity = size + size % 3;
            let start = numbers(capacity * (capacity + 1) / 2, 1);
            let vectors: Vec<Vec<f32>> = (2..12).map(|seed| numbers(size, seed)).collect();
            for (waiting, turning) in (0..=4).flat_map(|waiting| [(waiting, false), (waiting, true)]) {
                let pairs: Vec<_> =
                    vectors.chunks(2).map(|pair| [&*pair[0], &*pair[1]]).take(waiting).collect();
                let reset = turning.then_some([&*vectors[8], &*vectors[9]]);
                let after = |pass: &dyn Fn(&mut Triangle<'_, f32>)| {
                    let mut entries = start.clone();
                    pass(&mut Triangle::new(&mut entries, capacity, size));
                    bits(&entries)
                };
                let expected = after(&|p| entry_by_entry(p, &pairs, reset));
                let what = std::format!("size {size}, {waiting} waiting, reset {turning}");
                assert!(expected == after(&|p| downdate(p, &pairs, reset)), "widest vectors, {what}");
                assert!(expected == after(&|p| pass::<f32, 0>((p, &pairs, reset))), "narrowest, {what}");
                // Where a processor has AVX-512 this is the only one that runs with AVX2.
                let wide = |p: &mut Triangle<'_, f32>| {
                    with_avx2(
                        #[inline(always)]
                        || pass::<f32, BAND>((p, &pairs, reset)),
                    )
                };
                assert!(expected == after(&wide), "between, {what}");
            }
        }
    }
}

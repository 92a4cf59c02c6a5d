//! Operations on the covariance itself, kept as a packed symmetric matrix.
//!
//! | operation | cost | touches |
//! |---|---|---|
//! | predict | 4n flops | the robot's rows |
//! | P Hᵀ of one landmark | 20n flops | five rows |
//! | downdate by k landmarks, reset | (4k + 4)·n²/2 flops | every entry once |
//! | rounding's cover | 4 flops a sighting | the landmark's two variances |
//!
//! A frame's landmarks are downdated together, P ← P − Σ w wᵀ with w = P Hᵀ L⁻ᵀ, S = L Lᵀ: one pass over the
//! memory for up to [`BATCH`](super::filter::BATCH) of them, and the invariant filter's reset rides on the same
//! pass. Every sum is elementwise, so vector instructions of any width do not change a bit, and a host takes the widest
//! that its processor has ([`widest`]).
#![allow(clippy::indexing_slicing, reason = "kernel: all vectors are sliced to the triangle's size first")]
use super::model::Row;
use super::triangle::{Triangle, TriangleRef};
use crate::Real;
use crate::vectors::{VECTORS, widest};
use core::ops::Range;
use nalgebra::{Matrix2, Matrix3, Matrix3x4, Matrix4};

/// P ← F P Fᵀ + Q, F = I + (shift) e_θᵀ: the prediction (12), of the robot's rows alone.
pub(super) fn predict<T: Real>(p: &mut Triangle<'_, T>, shift: [T; 2], noise: &Matrix3<T>) {
    widest((p.robot_rows_mut(), shift), shift_rows, shift_rows);
    let (p02, p12, p22) = (p.at(0, 2), p.at(1, 2), p.at(2, 2));
    let two = T::lit(2.0);
    p.set(0, 0, p.at(0, 0) + shift[0] * (two * p02 + shift[0] * p22) + noise.m11);
    p.set(0, 1, p.at(0, 1) + shift[0] * (p12 + shift[1] * p22) + shift[1] * p02 + noise.m12);
    p.set(1, 1, p.at(1, 1) + shift[1] * (two * p12 + shift[1] * p22) + noise.m22);
    p.set(0, 2, p02 + shift[0] * p22 + noise.m13);
    p.set(1, 2, p12 + shift[1] * p22 + noise.m23);
    p.set(2, 2, p22 + noise.m33);
}

#[inline(always)]
fn shift_rows<T: Real>(([along_x, along_y, along_heading], shift): ([&mut [T]; 3], [T; 2])) {
    for ((x, y), heading) in along_x.iter_mut().zip(along_y).zip(along_heading) {
        *x += shift[0] * *heading;
        *y += shift[1] * *heading;
    }
}

/// P ← F P Fᵀ, F = I + G in the robot's rows and the columns of the mount, which begin at `mount`.
pub(super) fn predict_mount<T: Real>(p: &mut Triangle<'_, T>, mount: usize, by_mount: &Matrix3x4<T>) {
    let at = |p: &Triangle<'_, T>, i: usize, j: usize| p.at(i.min(j), i.max(j));
    let shared = Matrix3x4::from_fn(|i, j| p.at(i, mount + j));
    let own = Matrix4::from_fn(|i, j| at(p, mount + i, mount + j));
    let crossed = by_mount * shared.transpose();
    let gained = crossed + crossed.transpose() + by_mount * own * by_mount.transpose();
    for i in 0..3 {
        for j in i..3 {
            p.set(i, j, p.at(i, j) + gained[(i, j)]);
        }
        for column in mount..p.size {
            let gained = (0..4).fold(T::zero(), |sum, j| sum + by_mount[(i, j)] * at(p, mount + j, column));
            p.set(i, column, p.at(i, column) + gained);
        }
    }
}

/// The two columns of P Hᵀ.
#[inline(never)]
pub(super) fn times<T: Real>(p: TriangleRef<'_, T>, rows: &[Row<T>], out: [&mut [T]; 2]) {
    widest((p, rows, out), add_columns::<T, 2>, add_columns::<T, 3>);
}

#[inline(always)]
fn add_columns<T: Real, const COPY: usize>(
    (p, rows, [first, second]): (TriangleRef<'_, T>, &[Row<T>], [&mut [T]; 2]),
) {
    let (first, second) = (&mut first[..p.size], &mut second[..p.size]);
    first.fill(T::zero());
    second.fill(T::zero());
    for pair in rows {
        // A pair of neighbouring columns c, c + 1 of H: above the diagonal they lie side by side.
        let (c, [above, below]) = (pair.column, pair.coefficients);
        for ((x, y), entries) in first[..c].iter_mut().zip(&mut second[..c]).zip(p.columns_above(c)) {
            *x += sum_two(above, entries);
            *y += sum_two(below, entries);
        }
        let (upper, lower) = (p.row(c), p.row(c + 1));
        first[c] += sum_two(above, [upper[0], upper[1]]);
        second[c] += sum_two(below, [upper[0], upper[1]]);
        rows_two::<T, false, COPY>(
            &mut first[c + 1..],
            &mut second[c + 1..],
            pair.coefficients,
            [&upper[1..], lower],
        );
    }
}

/// A row of P Hᵀ, given the row's entries in two columns side by side.
pub(super) fn times_row<T: Real>(side_by_side: impl Fn(usize) -> [T; 2], h: &[Row<T>]) -> [T; 2] {
    h.iter().fold([T::zero(); 2], |[first, second], pair| {
        let ([left, right], [[a0, a1], [b0, b1]]) = (side_by_side(pair.column), pair.coefficients);
        [first + (a0 * left + a1 * right), second + (b0 * left + b1 * right)]
    })
}

/// H P Gᵀ of two sparse pairs of rows, what joint compatibility and a gate need, given the rows of P Gᵀ.
pub(super) fn cross<T: Real>(h: &[Row<T>], times_row: impl Fn(usize) -> [T; 2]) -> Matrix2<T> {
    h.iter().fold(Matrix2::zeros(), |sum, pair| {
        let [left, right] = [times_row(pair.column), times_row(pair.column + 1)];
        sum + pair.matrix() * Matrix2::new(left[0], left[1], right[0], right[1])
    })
}

/// P ← P − Σ w wᵀ (+ a bᵀ + b aᵀ), one pass over the memory, two rows at a time: what is read of a vector serves both.
#[inline(never)]
pub(super) fn downdate<T: Real>(p: &mut Triangle<'_, T>, pairs: &[[&[T]; 2]], reset: Option<[&[T]; 2]>) {
    widest((p, pairs, reset), downdate_rows::<T, 0>, downdate_rows::<T, 1>);
}

/// Rows that everything is added to before the next are begun: they stay in the processor's nearest memory.
const NEAR: usize = 16;

#[inline(always)]
fn downdate_rows<T: Real, const COPY: usize>((p, pairs, reset): Downdate<'_, '_, T>) {
    for start in (0..p.size).step_by(NEAR) {
        let mut rest = pairs;
        if let Some(turn) = reset {
            if let [pair, tail @ ..] = rest {
                add_four::<T, true, COPY>(p, start, [*pair, turn]);
                rest = tail;
            } else {
                add_two::<T, true, COPY>(p, start, turn);
            }
        }
        while let [first, second, tail @ ..] = rest {
            add_four::<T, false, COPY>(p, start, [*first, *second]);
            rest = tail;
        }
        if let [pair] = rest {
            add_two::<T, false, COPY>(p, start, *pair);
        }
    }
}

type Downdate<'a, 'p, T> = (&'a mut Triangle<'p, T>, &'a [[&'a [T]; 2]], Option<[&'a [T]; 2]>);

/// P ← P − u uᵀ − v vᵀ − s sᵀ − t tᵀ, or + s tᵀ + t sᵀ at the end with `TURN`, in rows from `start` on.
#[inline(always)]
fn add_four<T: Real, const TURN: bool, const COPY: usize>(
    p: &mut Triangle<'_, T>,
    start: usize,
    [[u, v], [s, t]]: [[&[T]; 2]; 2],
) {
    let size = p.size;
    let (u, v, s, t) = (&u[..size], &v[..size], &s[..size], &t[..size]);
    let factors = |at: usize| {
        let [h, k] = if TURN { [t[at], s[at]] } else { [-s[at], -t[at]] };
        [-u[at], -v[at], h, k]
    };
    let mut at = start;
    while at < size.min(start + NEAR) {
        let [upper, lower] = p.two_rows_mut(at);
        let above = factors(at);
        upper[0] += sum_four(above, [u[at], v[at], s[at], t[at]]);
        let next = at + 1;
        if next < size {
            let vectors = [&u[next..], &v[next..], &s[next..], &t[next..]];
            rows_four::<T, TURN, COPY>(&mut upper[1..], lower, [above, factors(next)], vectors);
        }
        at += 2;
    }
}

/// P ← P − u uᵀ − v vᵀ, or P + u vᵀ + v uᵀ with `TURN`, in rows from `start` on.
#[inline(always)]
fn add_two<T: Real, const TURN: bool, const COPY: usize>(
    p: &mut Triangle<'_, T>,
    start: usize,
    [u, v]: [&[T]; 2],
) {
    let size = p.size;
    let (u, v) = (&u[..size], &v[..size]);
    let factors = |at: usize| if TURN { [v[at], u[at]] } else { [-u[at], -v[at]] };
    let mut at = start;
    while at < size.min(start + NEAR) {
        let [upper, lower] = p.two_rows_mut(at);
        let above = factors(at);
        upper[0] += sum_two(above, [u[at], v[at]]);
        let next = at + 1;
        if next < size {
            rows_two::<T, TURN, COPY>(
                &mut upper[1..],
                lower,
                [above, factors(next)],
                [&u[next..], &v[next..]],
            );
        }
        at += 2;
    }
}

#[inline(always)]
fn sum_two<T: Real>([f, g]: [T; 2], [u, v]: [T; 2]) -> T {
    f * u + g * v
}

#[inline(always)]
fn sum_four<T: Real>([f, g, h, k]: [T; 4], [u, v, s, t]: [T; 4]) -> T {
    (f * u + g * v) + (h * s + k * t)
}

/// entry += Σ factor · vector in both rows.
///
/// Only as a function's arguments are rows known not to overlap, which spares the loop to ask; the compiler must see it by
/// itself before it becomes part of its caller, which is why it is not `#[inline(always)]`; and it becomes part of one that
/// calls it once, which is what `TURN` and `COPY` are for. Where no wider vectors are chosen it stays apart, for its size.
#[cfg_attr(target_arch = "x86_64", inline)]
#[cfg_attr(not(target_arch = "x86_64"), inline(never))]
fn rows_four<T: Real, const TURN: bool, const COPY: usize>(
    upper: &mut [T],
    lower: &mut [T],
    [above, below]: [[T; 4]; 2],
    [u, v, s, t]: [&[T]; 4],
) {
    let count = lower.len();
    let upper = &mut upper[..count];
    let (u, v, s, t) = (&u[..count], &v[..count], &s[..count], &t[..count]);
    by_halves(
        count,
        #[inline(always)]
        |part| {
            let rows = upper[part.clone()].iter_mut().zip(&mut lower[part.clone()]);
            for (((((x, y), u), v), s), t) in
                rows.zip(&u[part.clone()]).zip(&v[part.clone()]).zip(&s[part.clone()]).zip(&t[part.clone()])
            {
                *x += sum_four(above, [*u, *v, *s, *t]);
                *y += sum_four(below, [*u, *v, *s, *t]);
            }
        },
    );
}

/// As [`rows_four`], of two vectors.
#[cfg_attr(target_arch = "x86_64", inline)]
#[cfg_attr(not(target_arch = "x86_64"), inline(never))]
fn rows_two<T: Real, const TURN: bool, const COPY: usize>(
    upper: &mut [T],
    lower: &mut [T],
    [above, below]: [[T; 2]; 2],
    [u, v]: [&[T]; 2],
) {
    let count = lower.len();
    let upper = &mut upper[..count];
    let (u, v) = (&u[..count], &v[..count]);
    by_halves(
        count,
        #[inline(always)]
        |part| {
            let rows = upper[part.clone()].iter_mut().zip(&mut lower[part.clone()]);
            for (((x, y), u), v) in rows.zip(&u[part.clone()]).zip(&v[part.clone()]) {
                *x += sum_two(above, [*u, *v]);
                *y += sum_two(below, [*u, *v]);
            }
        },
    );
}

/// Calls `part` with the columns that fill vectors of eight, then with four, two and one of those that are left.
#[inline(always)]
fn by_halves(count: usize, mut part: impl FnMut(Range<usize>)) {
    if !VECTORS {
        return part(0..count);
    }
    let mut rest = count & !7;
    part(0..rest);
    if count & 4 != 0 {
        part(rest..rest + 4);
        rest += 4;
    }
    if count & 2 != 0 {
        part(rest..rest + 2);
        rest += 2;
    }
    if count & 1 != 0 {
        part(rest..rest + 1);
    }
}

/// P_ii ← P_ii (1 + ε n/64): what rounding may have taken from a landmark, given back when it is seen.
///
/// Every pass rounds every entry of P to half an ε of itself, and a step below that is lost altogether. A landmark that
/// is seen for ever is known ever better with respect to the others, while its variance in the world, where the entries are,
/// stays: in `f32` the difference drowns after 100,000 updates, and P is indefinite before 200,000 where landmarks are seen
/// to a millimetre. The errors grow with the matrix: over 50,000 frames that see every landmark, half an ε a sighting kept P
/// positive with 20 landmarks, and with 60 it took two. It is a process noise, of 8e-8 m² a sighting for a landmark known to
/// 1 m in a map of 20; of `f64` nothing is seen. `cargo test -p monorange-tests --release --test slam_limits` is the check.
pub(super) fn cover_rounding<T: Real>(p: &mut Triangle<'_, T>, offset: usize, count: usize) {
    let share = T::default_epsilon() * T::lit(p.size as f64 / 64.0);
    for at in offset..offset + count {
        let variance = p.at(at, at);
        p.set(at, at, variance + share * variance);
    }
}

/// Appends two states y = G x + noise, given the columns of P Gᵀ.
pub(super) fn append<T: Real>(p: &mut Triangle<'_, T>, pgt: [&[T]; 2], own: &Matrix2<T>) {
    let size = p.size;
    p.size += 2;
    for (row, (first, second)) in pgt[0].iter().zip(pgt[1]).enumerate() {
        p.set(row, size, *first);
        p.set(row, size + 1, *second);
    }
    p.set(size, size, own.m11);
    p.set(size, size + 1, own.m12);
    p.set(size + 1, size + 1, own.m22);
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::fmt::Debug;
    use std::vec::Vec;

    /// Numbers of both signs and of several magnitudes.
    fn numbers<T: Real>(count: usize, seed: u32) -> Vec<T> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 23) - 1.0
        };
        (0..count).map(|at| T::lit(next() * [1.0, 1e-3, 30.0][at % 3])).collect()
    }

    /// Every size up to 40, every number of landmarks in a frame: `downdate` and `times` as they are called, and compiled for
    /// the narrowest processor.
    fn same_bits<T: Real + Debug>(bits: impl Fn(&T) -> u64) {
        let same = |one: &[T], other: &[T]| one.iter().map(&bits).eq(other.iter().map(&bits));
        for size in 3..40 {
            let capacity = size + size % 3;
            let start: Vec<T> = numbers(capacity * (capacity + 1) / 2, 1);
            let vectors: Vec<Vec<T>> = (2..12).map(|seed| numbers(size, seed)).collect();
            for (waiting, turning) in (0..=4).flat_map(|waiting| [(waiting, false), (waiting, true)]) {
                let pairs: Vec<_> =
                    vectors.chunks(2).map(|pair| [&*pair[0], &*pair[1]]).take(waiting).collect();
                let reset = turning.then_some([&*vectors[8], &*vectors[9]]);
                let (mut one, mut other) = (start.clone(), start.clone());
                downdate(&mut Triangle::new(&mut one, capacity, size), &pairs, reset);
                downdate_rows::<T, 1>((&mut Triangle::new(&mut other, capacity, size), &pairs, reset));
                assert!(same(&one, &other), "size {size}, {waiting} waiting, reset {turning}");
            }
            let rows = [0, size / 2, size - 2].map(|at| Row::new(at, Matrix2::from_fn(|i, j| vectors[i][j])));
            let (mut one, mut other) = ([vec(size), vec(size)], [vec(size), vec(size)]);
            let p = TriangleRef::new(&start, capacity, size);
            times(p, &rows, one.each_mut().map(|vector| &mut **vector));
            add_columns::<T, 3>((p, &rows, other.each_mut().map(|vector| &mut **vector)));
            assert!(same(&one[0], &other[0]) && same(&one[1], &other[1]), "P Hᵀ of size {size}");
        }
    }

    fn vec<T: Real>(size: usize) -> Vec<T> {
        std::vec![T::one(); size]
    }

    #[test]
    fn the_processors_own_vectors_give_the_same_bits() {
        same_bits::<f32>(|value| u64::from(value.to_bits()));
        same_bits::<f64>(|value| value.to_bits());
    }
}

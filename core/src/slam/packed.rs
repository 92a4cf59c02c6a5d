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
//! pass. Every sum is elementwise, so vector instructions do not change a bit.
#![allow(clippy::indexing_slicing, reason = "kernel: all vectors are sliced to the triangle's size first")]
use super::filter::BATCH;
use super::model::Row;
use super::triangle::{Triangle, TriangleRef};
use crate::Real;
use crate::vectors::{Kernel, widest};
use nalgebra::{Matrix2, Matrix3, Matrix3x4, Matrix4};

/// P ← F P Fᵀ + Q, F = I + (shift) e_θᵀ: the prediction (12), of the robot's rows alone.
pub(super) fn predict<T: Real>(p: &mut Triangle<'_, T>, shift: [T; 2], noise: &Matrix3<T>) {
    let [along_x, along_y, along_heading] = p.robot_rows_mut();
    for ((x, y), heading) in along_x.iter_mut().zip(along_y).zip(along_heading) {
        *x += shift[0] * *heading;
        *y += shift[1] * *heading;
    }
    let (p02, p12, p22) = (p.at(0, 2), p.at(1, 2), p.at(2, 2));
    let two = T::lit(2.0);
    p.set(0, 0, p.at(0, 0) + shift[0] * (two * p02 + shift[0] * p22) + noise.m11);
    p.set(0, 1, p.at(0, 1) + shift[0] * (p12 + shift[1] * p22) + shift[1] * p02 + noise.m12);
    p.set(1, 1, p.at(1, 1) + shift[1] * (two * p12 + shift[1] * p22) + noise.m22);
    p.set(0, 2, p02 + shift[0] * p22 + noise.m13);
    p.set(1, 2, p12 + shift[1] * p22 + noise.m23);
    p.set(2, 2, p22 + noise.m33);
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
pub(super) fn times<T: Real>(p: TriangleRef<'_, T>, rows: &[Row<T>], out: [&mut [T]; 2]) {
    let size = p.size;
    let [first, second] = out.map(|vector| &mut vector[..size]);
    first.fill(T::zero());
    second.fill(T::zero());
    for pair in rows {
        // A pair of neighbouring columns c, c + 1 of H: above the diagonal they lie side by side.
        let (c, [[a0, a1], [b0, b1]]) = (pair.column, pair.coefficients);
        p.for_columns_above(c, |row, left, right| {
            first[row] += a0 * left + a1 * right;
            second[row] += b0 * left + b1 * right;
        });
        let (upper, lower) = (p.row(c), p.row(c + 1));
        first[c] += a0 * upper[0] + a1 * upper[1];
        second[c] += b0 * upper[0] + b1 * upper[1];
        let tail = first[c + 1..].iter_mut().zip(&mut second[c + 1..]);
        for ((x, y), (left, right)) in tail.zip(upper[1..].iter().zip(lower)) {
            *x += a0 * *left + a1 * *right;
            *y += b0 * *left + b1 * *right;
        }
    }
}

/// H P Gᵀ of two sparse pairs of rows: what joint compatibility and a gate need.
pub(super) fn cross<T: Real>(at: impl Fn(usize, usize) -> T, h: &[Row<T>], g: &[Row<T>]) -> Matrix2<T> {
    let mut sum = Matrix2::zeros();
    for left in h {
        for right in g {
            let (i, j) = (left.column, right.column);
            let block = Matrix2::new(at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1));
            sum += left.matrix() * block * right.matrix().transpose();
        }
    }
    sum
}

/// P ← P − Σ w wᵀ (+ a bᵀ + b aᵀ), one pass over the memory, two rows at a time: what is read of a vector serves both.
pub(super) fn downdate<T: Real>(p: &mut Triangle<'_, T>, pairs: &[[&[T]; 2]], reset: Option<[&[T]; 2]>) {
    let size = p.size;
    let minus = |vector| Term { sign: -T::one(), factor: vector, along: vector };
    let plus = |factor, along| Term { sign: T::one(), factor, along };
    let mut terms = heapless::Vec::<Term<'_, T>, { 2 * BATCH + 2 }>::new();
    let mut pairs = pairs.iter();
    let mut next = |terms: &mut heapless::Vec<_, _>| 
        if let Some([u, v]) = pairs.next() {
            let _ = terms.extend([minus(&u[..size]), minus(&v[..size])]);
            true
        } else { false };
    next(&mut terms);
    if let Some([a, b]) = reset {
        let (a, b) = (&a[..size], &b[..size]);
        terms.extend([plus(b, a), plus(a, b)]);
    }
    while next(&mut terms) {}
    widest(Downdate { p, terms: &terms });
}

#[derive(Clone, Copy)]
struct Term<'a, T> {
    sign: T,
    factor: &'a [T],
    along: &'a [T],
}

struct Downdate<'a, 'b, T> {
    p: &'a mut Triangle<'b, T>,
    terms: &'a [Term<'a, T>],
}

const BLOCK: usize = 16;

impl<T: Real> Kernel for Downdate<'_, '_, T> {
    #[inline(always)]
    fn run<const COPY: usize>(self) {
        let size = self.p.size;
        let (fours, rest) = self.terms.as_chunks::<4>();
        for start in (0..size).step_by(BLOCK) {
            for four in fours {
                self.p.pairs4::<COPY>(start, *four);
            }
            if let [a, b] = rest {
                self.p.pairs2::<COPY>(start, [*a, *b]);
            }
        }
    }
}

impl<T: Real> Triangle<'_, T> {
    #[inline(always)]
    fn pairs4<const COPY: usize>(&mut self, start: usize, [a, b, c, d]: [Term<'_, T>; 4]) {
        let size = self.size;
        let (fa, fb, fc, fd) = (&a.factor[..size], &b.factor[..size], &c.factor[..size], &d.factor[..size]);
        let (va, vb, vc, vd) = (&a.along[..size], &b.along[..size], &c.along[..size], &d.along[..size]);
        let end = (start + BLOCK).min(size);
        let mut i = start;
        while i < end {
            let [upper, lower] = self.two_rows_mut(i);
            let above = [a.sign * fa[i], b.sign * fb[i], c.sign * fc[i], d.sign * fd[i]];
            upper[0] += sum4(above, va[i], vb[i], vc[i], vd[i]);
            let next = i + 1;
            if next < size {
                let below = [a.sign * fa[next], b.sign * fb[next], c.sign * fc[next], d.sign * fd[next]];
                add4::<T, COPY>(&mut upper[1..], lower, above, below, &va[next..], &vb[next..], &vc[next..], &vd[next..]);
            }
            i += 2;
        }
    }

    #[inline(always)]
    fn pairs2<const COPY: usize>(&mut self, start: usize, [a, b]: [Term<'_, T>; 2]) {
        let size = self.size;
        let (fa, fb) = (&a.factor[..size], &b.factor[..size]);
        let (va, vb) = (&a.along[..size], &b.along[..size]);
        let end = (start + BLOCK).min(size);
        let mut i = start;
        while i < end {
            let [upper, lower] = self.two_rows_mut(i);
            let above = [a.sign * fa[i], b.sign * fb[i]];
            upper[0] += sum2(above, va[i], vb[i]);
            let next = i + 1;
            if next < size {
                let below = [a.sign * fa[next], b.sign * fb[next]];
                add2::<T, COPY>(&mut upper[1..], lower, above, below, &va[next..], &vb[next..]);
            }
            i += 2;
        }
    }
}

#[inline(always)]
fn sum2<T: Real>([f, g]: [T; 2], u: T, v: T) -> T {
    f * u + g * v
}

#[inline(always)]
fn sum4<T: Real>([f, g, h, k]: [T; 4], u: T, v: T, s: T, t: T) -> T {
    (f * u + g * v) + (h * s + k * t)
}

#[inline]
fn add2<T: Real, const COPY: usize>(upper: &mut [T], lower: &mut [T], above: [T; 2], below: [T; 2], u: &[T], v: &[T]) {
    let count = lower.len();
    let upper = &mut upper[..count];
    let (u, v) = (&u[..count], &v[..count]);
    let whole = count & !7;
    run2(upper, lower, above, below, u, v, 0, whole);
    if count & 4 != 0 {
        run2(upper, lower, above, below, u, v, whole, 4);
    }
    if count & 2 != 0 {
        run2(upper, lower, above, below, u, v, count & !3, 2);
    }
    if count & 1 != 0 {
        run2(upper, lower, above, below, u, v, count & !1, 1);
    }
}
#[inline(always)]
fn run2<T: Real>(upper: &mut [T], lower: &mut [T], above: [T; 2], below: [T; 2], u: &[T], v: &[T], start: usize, count: usize) {
    let range = start..start + count;
    let (upper, lower) = (&mut upper[range.clone()], &mut lower[range.clone()]);
    for (((x, y), u), v) in upper.iter_mut().zip(lower).zip(&u[range.clone()]).zip(&v[range.clone()]) {
        *x += sum2(above, *u, *v);
        *y += sum2(below, *u, *v);
    }
}

#[inline]
fn add4<T: Real, const COPY: usize>(upper: &mut [T], lower: &mut [T], above: [T; 4], below: [T; 4], u: &[T], v: &[T], s: &[T], t: &[T]) {
    let count = lower.len();
    let upper = &mut upper[..count];
    let (u, v, s, t) = (&u[..count], &v[..count], &s[..count], &t[..count]);
    let whole = count & !7;
    run4(upper, lower, above, below, u, v, s, t, 0, whole);
    if count & 4 != 0 {
        run4(upper, lower, above, below, u, v, s, t, whole, 4);
    }
    if count & 2 != 0 {
        run4(upper, lower, above, below, u, v, s, t, count & !3, 2);
    }
    if count & 1 != 0 {
        run4(upper, lower, above, below, u, v, s, t, count & !1, 1);
    }
}
#[inline(always)]
fn run4<T: Real>(upper: &mut [T], lower: &mut [T], above: [T; 4], below: [T; 4], u: &[T], v: &[T], s: &[T], t: &[T], start: usize, count: usize) {
    let range = start..start + count;
    let (upper, lower) = (&mut upper[range.clone()], &mut lower[range.clone()]);
    for (((((x, y), u), v), s), t) in upper.iter_mut().zip(lower).zip(&u[range.clone()]).zip(&v[range.clone()]).zip(&s[range.clone()]).zip(&t[range.clone()]) {
        *x += sum4(above, *u, *v, *s, *t);
        *y += sum4(below, *u, *v, *s, *t);
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

//! The covariance in factors, P = U D Uᵀ: positive by construction.
//!
//! U is unit upper triangular; it and D (on the diagonal) take the place of P in the packed triangle. The robot's
//! rows come first, so a prediction re-factors a 3 × 3 block and touches the robot's rows alone.
//!
//! | operation | how | cost |
//! |---|---|---|
//! | predict | rows F U, then U D Uᵀ of the leading block + Q | 4n |
//! | update | Bierman, two scalars after decorrelating R | 4n² |
//! | reset | P − c cᵀ/p + (c + p a)(c + p a)ᵀ/p: the heading is measured exactly, then put back | 4n² |
//! | birth | the newborn is *measured* by the robot: its gain is the new column, its S the new D | 2n² a state |
//! | removal | the column's share goes to the leading block (Agee and Turner) | 2n² a state |
//!
//! Source: G. J. Bierman, "Factorization Methods for Discrete Sequential Estimation", 1977, chapters III and V.
//! The recursions run along rows, which are contiguous, and not along columns as they are printed.
#![allow(clippy::indexing_slicing, reason = "kernel: all vectors are sliced to the triangle's size first")]
use crate::Real;
use crate::slam::covariance::Row;
use crate::slam::covariance::triangle::{Triangle, TriangleRef};
use nalgebra::{Matrix2, Matrix3, Matrix3x4, Vector2};

/// P → U, D in place.
pub(in crate::slam) fn factorise<T: Real>(p: &mut Triangle<'_, T>) {
    for pivot in (0..p.size).rev() {
        let d = p.at(pivot, pivot);
        for row in 0..pivot {
            let unit = if d > T::zero() { p.at(row, pivot) / d } else { T::zero() };
            p.set(row, pivot, unit);
        }
        for row in 0..pivot {
            let scaled = p.at(row, pivot) * d;
            for other in row..pivot {
                p.set(row, other, p.at(row, other) - scaled * p.at(other, pivot));
            }
        }
    }
}

/// One entry of U D Uᵀ.
pub(in crate::slam) fn covariance_at<T: Real>(u: TriangleRef<'_, T>, row: usize, column: usize) -> T {
    let unit = |i: usize, k: usize| if i == k { T::one() } else { u.at(i, k) };
    let mut sum = T::zero();
    for k in row.max(column)..u.size {
        sum += unit(row, k) * u.at(k, k) * unit(column, k);
    }
    sum
}

/// (12) on the factors.
pub(in crate::slam) fn predict<T: Real>(u: &mut Triangle<'_, T>, shift: [T; 2], noise: &Matrix3<T>) {
    let [along_x, along_y, along_heading] = u.robot_rows_mut();
    for ((x, y), heading) in along_x.iter_mut().zip(along_y).zip(along_heading) {
        *x += shift[0] * *heading;
        *y += shift[1] * *heading;
    }
    let (zero, one) = (T::zero(), T::one());
    let unit = Matrix3::new(one, u.at(0, 1), u.at(0, 2), zero, one, u.at(1, 2), zero, zero, one);
    let moved = Matrix3::new(one, zero, shift[0], zero, one, shift[1], zero, zero, one) * unit;
    let diagonal = Matrix3::from_diagonal(&nalgebra::Vector3::new(u.at(0, 0), u.at(1, 1), u.at(2, 2)));
    let block = moved * diagonal * moved.transpose() + noise;
    for row in 0..3 {
        for column in row..3 {
            u.set(row, column, block[(row, column)]);
        }
    }
    let size = core::mem::replace(&mut u.size, 3);
    factorise(u);
    u.size = size;
}

/// P ← F P Fᵀ on the factors, as [`packed::predict_shared`](crate::slam::covariance::packed::predict_shared): rows F U.
#[inline(never)]
pub(in crate::slam) fn predict_shared<T: Real>(
    u: &mut Triangle<'_, T>,
    shared: usize,
    by_shared: &Matrix3x4<T>,
) {
    for i in 0..3 {
        for column in shared..u.size {
            let mut gained = T::zero();
            for j in 0..4.min(column - shared + 1) {
                let unit = if shared + j == column { T::one() } else { u.at(shared + j, column) };
                gained += by_shared[(i, j)] * unit;
            }
            u.set(i, column, u.at(i, column) + gained);
        }
    }
}

/// P_ii ← P_ii + variance. `work` is spoilt.
pub(in crate::slam) fn add_variance<T: Real>(
    u: &mut Triangle<'_, T>,
    at: usize,
    variance: T,
    work: &mut [T],
) {
    let (x, v) = work.split_at_mut(at + 1);
    x.fill(T::zero());
    x[at] = T::one();
    // Rows below do not depend on it, and keep their share of those above.
    add(u, at + 1, x, &mut v[..=at], variance);
}

/// f = Uᵀ hᵀ of one row of H.
fn project<T: Real>(u: TriangleRef<'_, T>, entries: impl Iterator<Item = (usize, T)>, f: &mut [T]) {
    f.fill(T::zero());
    for (column, entry) in entries {
        f[column] += entry;
        for (value, unit) in f[column + 1..].iter_mut().zip(&u.row(column)[1..]) {
            *value += entry * *unit;
        }
    }
}

fn entries<T: Real>(rows: &[Row<T>], which: usize) -> impl Iterator<Item = (usize, T)> + '_ {
    rows.iter().flat_map(move |row| {
        let [left, right] = row.coefficients[which];
        [(row.column, left), (row.column + 1, right)]
    })
}

/// f = Uᵀ hᵀ for the two rows of H, and H P Hᵀ.
pub(in crate::slam) fn innovation<T: Real>(
    u: TriangleRef<'_, T>,
    rows: &[Row<T>],
    out: [&mut [T]; 2],
) -> Matrix2<T> {
    let [first, second] = out;
    project(u, entries(rows, 0), first);
    project(u, entries(rows, 1), second);
    let (mut xx, mut xy, mut yy) = (T::zero(), T::zero(), T::zero());
    for (k, (x, y)) in first.iter().zip(&*second).enumerate() {
        let d = u.at(k, k);
        xx += d * *x * *x;
        xy += d * *x * *y;
        yy += d * *y * *y;
    }
    Matrix2::new(xx, xy, xy, yy)
}

/// Bierman's scalar update for f = Uᵀ hᵀ and the noise r, in place. `v` comes back as P hᵀ, `f` spoilt; the result
/// is the innovation's variance.
fn scalar<T: Real>(u: &mut Triangle<'_, T>, f: &mut [T], v: &mut [T], noise: T) -> T {
    let mut alpha = noise;
    for (k, (f, v)) in f.iter_mut().zip(v.iter_mut()).enumerate() {
        let d = u.at(k, k);
        *v = d * *f;
        let next = alpha + *f * *v;
        // Without variance up to here there is no gain to take back.
        let lambda = if alpha > T::zero() { -*f / alpha } else { T::zero() };
        if next > T::zero() {
            u.set(k, k, d * (alpha / next));
        }
        *f = lambda;
        alpha = next;
    }
    for i in 0..v.len() {
        let mut gain = v[i];
        let row = &mut u.row_mut(i)[1..];
        for ((unit, lambda), v) in row.iter_mut().zip(&f[i + 1..]).zip(&v[i + 1..]) {
            let old = *unit;
            *unit += *lambda * gain;
            gain += old * *v;
        }
        v[i] = gain;
    }
    alpha
}

/// R = [1 0; c 1] diag(r₁, r₂) [1 c; 0 1]: (c, r₁, r₂).
fn decorrelate<T: Real>(noise: &Matrix2<T>) -> (T, T, T) {
    let ratio = if noise.m11 > T::zero() { noise.m21 / noise.m11 } else { T::zero() };
    (ratio, noise.m11, (noise.m22 - ratio * noise.m12).max(T::zero()))
}

/// (13) on the factors; δ is carried on.
pub(in crate::slam) fn update<T: Real>(
    u: &mut Triangle<'_, T>,
    rows: &[Row<T>],
    noise: &Matrix2<T>,
    innovation: &Vector2<T>,
    work: [&mut [T]; 2],
    delta: &mut [T],
) {
    let [f, v] = work;
    let (ratio, first_noise, second_noise) = decorrelate(noise);
    project(u.view(), entries(rows, 0), f);
    let alpha = scalar(u, f, v, first_noise);
    let weight = innovation.x / alpha;
    let mut moved = T::zero();
    let second = || {
        let below = entries(rows, 0).map(move |(column, entry)| (column, -ratio * entry));
        entries(rows, 1).chain(below).filter(|(_, entry)| *entry != T::zero())
    };
    for (column, entry) in second() {
        moved += entry * v[column] * weight;
    }
    for (delta, v) in delta.iter_mut().zip(&*v) {
        *delta += weight * *v;
    }
    if second().next().is_none() {
        return; // a measurement of one degree of freedom
    }
    project(u.view(), second(), f);
    let alpha = scalar(u, f, v, second_noise);
    let weight = (innovation.y - ratio * innovation.x - moved) / alpha;
    for (delta, v) in delta.iter_mut().zip(&*v) {
        *delta += weight * *v;
    }
}

/// P ← P + weight·x xᵀ on the leading `size` rows and columns (Agee and Turner). `x` and `v` are spoilt.
fn add<T: Real>(u: &mut Triangle<'_, T>, size: usize, x: &mut [T], v: &mut [T], weight: T) {
    let mut weight = weight;
    for i in (0..size).rev() {
        let mut own = x[i];
        let row = &mut u.row_mut(i)[1..size - i];
        for ((unit, x), v) in row.iter_mut().zip(&x[i + 1..size]).zip(&v[i + 1..size]).rev() {
            own -= *x * *unit;
            *unit += *v * own;
        }
        x[i] = own;
        let d = u.at(i, i);
        let next = d + weight * own * own;
        v[i] = if next > T::zero() { weight * own / next } else { T::zero() };
        if next > T::zero() {
            weight *= d / next;
        }
        u.set(i, i, next);
    }
}

/// The invariant filter's reset, P ← A P Aᵀ with A = I + a eᵀ, e the state `of`. `lever` is a; all vectors are spoilt.
pub(in crate::slam) fn reset<T: Real>(
    u: &mut Triangle<'_, T>,
    of: usize,
    lever: &mut [T],
    f: &mut [T],
    v: &mut [T],
) {
    project(u.view(), core::iter::once((of, T::one())), f);
    let variance = scalar(u, f, v, T::zero());
    if variance > T::zero() {
        for (a, column) in lever.iter_mut().zip(&*v) {
            *a = *column + variance * *a;
        }
        let size = u.size;
        add(u, size, lever, v, T::one() / variance);
    }
}

/// Appends two states y = G x + noise.
pub(in crate::slam) fn append<T: Real>(
    u: &mut Triangle<'_, T>,
    rows: &[Row<T>],
    noise: &Matrix2<T>,
    work: [&mut [T]; 2],
) {
    let [f, v] = work;
    let size = u.size;
    let (ratio, first_noise, second_noise) = decorrelate(noise);
    project(u.view(), entries(rows, 0), &mut f[..size]);
    append_one(u, &mut f[..size], &mut v[..size], first_noise);
    let below = entries(rows, 0).map(|(column, entry)| (column, -ratio * entry));
    let own = core::iter::once((size, ratio));
    project(u.view(), entries(rows, 1).chain(below).chain(own), &mut f[..size + 1]);
    append_one(u, &mut f[..size + 1], &mut v[..size + 1], second_noise);
}

fn append_one<T: Real>(u: &mut Triangle<'_, T>, f: &mut [T], v: &mut [T], noise: T) {
    let alpha = scalar(u, f, v, noise);
    let at = u.size;
    u.size += 1;
    for (row, v) in v.iter().enumerate() {
        u.set(row, at, if alpha > T::zero() { *v / alpha } else { T::zero() });
    }
    u.set(at, at, alpha);
}

/// Takes `length` states from `from` out.
pub(in crate::slam) fn remove<T: Real>(
    u: &mut Triangle<'_, T>,
    from: usize,
    length: usize,
    work: [&mut [T]; 2],
) {
    let [x, v] = work;
    // Those after them do not depend on them; those before carry their share.
    for k in (from..from + length).rev() {
        for (row, x) in x.iter_mut().enumerate().take(k) {
            *x = u.at(row, k);
        }
        let d = u.at(k, k);
        add(u, k, x, v, d);
    }
    u.remove(from, length);
}

//! Operations on the covariance itself, kept as a packed symmetric matrix.
//!
//! | operation | cost | touches |
//! |---|---|---|
//! | predict | 4n flops | the robot's rows |
//! | P Hᵀ of one landmark | 20n flops | five rows |
//! | [downdate](crate::slam::covariance::downdate) by k landmarks, reset | (4k + 4)·n²/2 flops | every entry once |
//! | rounding's cover | 4 flops a sighting | the landmark's two variances |
//!
//! A frame's landmarks are downdated together, P ← P − Σ w wᵀ with w = P Hᵀ L⁻ᵀ, S = L Lᵀ: one pass over the
//! memory for up to [`BATCH`](crate::slam::filter::BATCH) of them, and the invariant filter's reset rides on the same
//! pass. Every sum is elementwise, so vector instructions of any width do not change a bit, and a host takes the widest
//! that its processor has ([`widest`]).
#![allow(clippy::indexing_slicing, reason = "kernel: all vectors are sliced to the triangle's size first")]
use crate::Real;
use crate::slam::covariance::Row;
use crate::slam::covariance::downdate::{two, two_rows_of_two};
use crate::slam::covariance::triangle::{Triangle, TriangleRef};
use crate::vectors::{widest, widest_of_three};
use nalgebra::{Matrix2, Matrix3, Matrix3x4, Matrix4};

/// P ← F P Fᵀ + Q, F = I + (shift) e_θᵀ: the prediction (12), of the robot's rows alone.
pub(in crate::slam) fn predict<T: Real>(p: &mut Triangle<'_, T>, shift: [T; 2], noise: &Matrix3<T>) {
    widest!((p.robot_rows_mut(), shift), shift_rows);
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

/// P ← F P Fᵀ, F = I + G in the robot's rows and four columns, which begin at `shared`: the mount's, or the wheels' and the one before.
#[inline(never)]
pub(in crate::slam) fn predict_shared<T: Real>(
    p: &mut Triangle<'_, T>,
    shared: usize,
    by_shared: &Matrix3x4<T>,
) {
    let at = |p: &Triangle<'_, T>, i: usize, j: usize| p.at(i.min(j), i.max(j));
    let robots = Matrix3x4::from_fn(|i, j| at(p, i, shared + j));
    let own = Matrix4::from_fn(|i, j| at(p, shared + i, shared + j));
    let crossed = by_shared * robots.transpose();
    let gained = crossed + crossed.transpose() + by_shared * own * by_shared.transpose();
    for i in 0..3 {
        for j in i..3 {
            p.set(i, j, p.at(i, j) + gained[(i, j)]);
        }
        for column in 3..p.size {
            let gained = (0..4).fold(T::zero(), |sum, j| sum + by_shared[(i, j)] * at(p, shared + j, column));
            p.set(i, column, p.at(i, column) + gained);
        }
    }
}

/// The two columns of P Hᵀ.
#[inline(never)]
pub(in crate::slam) fn times<T: Real>(p: TriangleRef<'_, T>, rows: &[Row<T>], out: [&mut [T]; 2]) {
    widest_of_three(
        (p, rows, out),
        #[inline(always)]
        |all| add_columns::<T, 3>(all),
        #[inline(always)]
        |all| add_columns::<T, 4>(all),
        #[inline(always)]
        |all| add_columns::<T, 5>(all),
    );
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
            *x += two(above, entries);
            *y += two(below, entries);
        }
        let (upper, lower) = (p.row(c), p.row(c + 1));
        first[c] += two(above, [upper[0], upper[1]]);
        second[c] += two(below, [upper[0], upper[1]]);
        two_rows_of_two::<T, true, COPY>(
            &mut first[c + 1..],
            &mut second[c + 1..],
            pair.coefficients,
            [&upper[1..], lower],
        );
    }
}

/// A row of P Hᵀ, given the row's entries in two columns side by side.
pub(in crate::slam) fn times_row<T: Real>(side_by_side: impl Fn(usize) -> [T; 2], h: &[Row<T>]) -> [T; 2] {
    h.iter().fold([T::zero(); 2], |[first, second], pair| {
        let ([left, right], [[a0, a1], [b0, b1]]) = (side_by_side(pair.column), pair.coefficients);
        [first + (a0 * left + a1 * right), second + (b0 * left + b1 * right)]
    })
}

/// H P Gᵀ of two sparse pairs of rows, what joint compatibility and a gate need, given the rows of P Gᵀ.
pub(in crate::slam) fn cross<T: Real>(h: &[Row<T>], times_row: impl Fn(usize) -> [T; 2]) -> Matrix2<T> {
    h.iter().fold(Matrix2::zeros(), |sum, pair| {
        let [left, right] = [times_row(pair.column), times_row(pair.column + 1)];
        sum + pair.matrix() * Matrix2::new(left[0], left[1], right[0], right[1])
    })
}

/// P_ii ← P_ii (1 + ε n/64): what rounding may have taken from a landmark, given back when it is seen.
///
/// Every pass rounds every entry of P to half an ε of itself, and a step below that is lost altogether. A landmark that
/// is seen for ever is known ever better with respect to the others, while its variance in the world, where the entries are,
/// stays: in `f32` the difference drowns after 100,000 updates, and P is indefinite before 200,000 where landmarks are seen
/// to a millimetre. The errors grow with the matrix: over 50,000 frames that see every landmark, half an ε a sighting kept P
/// positive with 20 landmarks, and with 60 it took two. It is a process noise, of 8e-8 m² a sighting for a landmark known to
/// 1 m in a map of 20; of `f64` nothing is seen. `cargo test -p monorange-tests --release slam_limits::` is the check.
pub(in crate::slam) fn cover_rounding<T: Real>(p: &mut Triangle<'_, T>, offset: usize, count: usize) {
    let share = T::default_epsilon() * T::lit(p.size as f64 / 64.0);
    for at in offset..offset + count {
        let variance = p.at(at, at);
        p.set(at, at, variance + share * variance);
    }
}

/// Appends two states y = G x + noise, given the columns of P Gᵀ.
pub(in crate::slam) fn append<T: Real>(p: &mut Triangle<'_, T>, pgt: [&[T]; 2], own: &Matrix2<T>) {
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

/// P ← P − w wᵀ in the leading `rows` rows and columns alone, what stands beside them included: what the gain of the others is 0 for
/// stays as it is (Schmidt's filter, which considers errors and does not correct them).
pub(in crate::slam) fn downdate_leading<T: Real>(p: &mut Triangle<'_, T>, rows: usize, pair: [&[T]; 2]) {
    for vector in pair {
        for row in 0..rows {
            let by = vector[row];
            for (entry, value) in p.row_mut(row).iter_mut().zip(&vector[row..]) {
                *entry -= by * *value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slam::covariance::downdate::tests::{bits, numbers};
    use std::vec;

    #[test]
    fn columns_of_p_have_the_same_bits_in_the_processors_own_vectors() {
        for size in 3..40 {
            let capacity = size + size % 3;
            let start = numbers(capacity * (capacity + 1) / 2, 1);
            let rows =
                [0, size / 2, size - 2].map(|at| Row::new(at, Matrix2::from_fn(|i, j| start[i + 2 * j])));
            let (mut one, mut other) =
                ([vec![1.0; size], vec![1.0; size]], [vec![1.0; size], vec![1.0; size]]);
            let p = TriangleRef::new(&start, capacity, size);
            times(p, &rows, one.each_mut().map(|vector| &mut **vector));
            add_columns::<f32, 5>((p, &rows, other.each_mut().map(|vector| &mut **vector)));
            assert_eq!(one.map(|v| bits(&v)), other.map(|v| bits(&v)), "P Hᵀ of size {size}");
        }
    }
}

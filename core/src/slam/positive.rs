//! Whether the numbers of a state can be a covariance.
//!
//! Two landmarks whose correlation is within ±1 can still make a matrix with a negative eigenvalue together with a third state, and
//! an update by such a matrix gives a negative variance. Cholesky's factorisation of the correlations tells:
//!
//! ```text
//! C + ε I = Uᵀ U,    C_ij = P_ij / √(P_ii P_jj)
//! ```
//!
//! | symbol | in code | |
//! |---|---|---|
//! | P | `number` | the covariance, its upper triangle row by row |
//! | ε | `ROUNDING` | what rounding may have done to a covariance that was positive |
//!
//! It exists if and only if the matrix on the left is positive definite (Golub and Van Loan, "Matrix Computations", 4th edition, section 4.2).
//! States that are known exactly have neither variance nor covariance, and count as independent.
#![allow(clippy::indexing_slicing, reason = "kernel: the work is sliced to the triangle's size first")]
use crate::slam::covariance::packed_len;

const ROUNDING: f32 = 1e-3;

/// Whether `n` rows of an upper triangle are a covariance; `work` takes [`packed_len`] numbers. `None` when either is too short.
pub(super) fn is_positive(n: usize, number: impl Fn(usize) -> Option<f32>, work: &mut [f32]) -> Option<bool> {
    let work = work.get_mut(..packed_len(n))?;
    let start = |row: usize| row * n - row * row.saturating_sub(1) / 2;
    for row in 0..n {
        let own = number(start(row))?;
        for column in row + 1..n {
            let (entry, other) = (number(start(row) + column - row)?, number(start(column))?);
            let scale = libm::sqrtf(own) * libm::sqrtf(other);
            if scale == 0.0 && entry != 0.0 {
                return Some(false);
            }
            work[start(row) + column - row] = if entry == 0.0 { 0.0 } else { entry / scale };
        }
        work[start(row)] = 1.0 + ROUNDING;
    }
    for pivot in 0..n {
        let (above, below) = work.split_at_mut(start(pivot) + n - pivot);
        let row = &mut above[start(pivot)..];
        if row[0].is_nan() || row[0] <= 0.0 {
            return Some(false);
        }
        let scale = 1.0 / libm::sqrtf(row[0]);
        row.iter_mut().for_each(|entry| *entry *= scale);
        let mut rest = below;
        for other in 1..row.len() {
            let (next, later) = rest.split_at_mut(row.len() - other);
            let factor = row[other];
            for (entry, shared) in next.iter_mut().zip(&row[other..]) {
                *entry -= factor * shared;
            }
            rest = later;
        }
    }
    Some(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn positive(triangle: &[f32], n: usize) -> Option<bool> {
        is_positive(n, |place| triangle.get(place).copied(), &mut [0.0; 16])
    }

    #[test]
    fn pairs_within_bounds_are_not_enough() {
        // Correlations of 0.9, 0.9 and −0.9: the smallest eigenvalue is 1 − 2 · 0.9.
        assert_eq!(positive(&[4.0, 1.8, 1.8, 1.0, -0.9, 1.0], 3), Some(false));
        assert_eq!(positive(&[4.0, 1.8, 1.8, 1.0, 0.9, 1.0], 3), Some(true));
        assert_eq!(positive(&[1.0, 1.0, 1.0], 2), Some(true), "one and the same number twice");
        assert_eq!(positive(&[1.0, 1.1, 1.0], 2), Some(false));
        assert_eq!(positive(&[0.0, 0.0, 1.0], 2), Some(true), "known exactly");
        assert_eq!(positive(&[0.0, 0.1, 1.0], 2), Some(false));
        assert_eq!(positive(&[1.0, 0.0], 2), None, "cut off");
    }
}

//! Gates: how far from its prediction a measurement may lie.
//!
//! With the innovation ν and its covariance S = C + R (C from the state, R the measurement's own), the normalised
//! innovation squared νᵀS⁻¹ν is χ² with as many degrees of freedom as the measurement has. A *hard* gate drops what
//! lies beyond γ, and after one bad spell drops everything for good. The *soft* gate solves
//!
//! ```text
//! νᵀ (C + f R)⁻¹ ν = γ        for f ≥ 1
//! ```
//!
//! and lets the measurement in with the noise f R: it pulls as hard as a measurement at the gate would, no harder.
//! In coordinates where R is the identity and C = diag(λ), the left side is Σ yᵢ²/(λᵢ + f), and its reciprocal is
//! nearly linear in f: Newton's method on the reciprocal takes two to four steps from f = 1 and never overshoots.
use crate::Real;
use crate::setting::choices;
use nalgebra::{Matrix2, Vector2};

/// What is done with a measurement beyond its gate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gate {
    /// Its noise is inflated until it lies on the gate.
    #[default]
    Soft,
    /// It is dropped.
    Hard,
    /// It is used as it is.
    Open,
}

choices!(Gate { "soft" => Soft, "hard" => Hard, "none" => Open });

/// χ² at 0.99 for 1 and 2 degrees of freedom.
pub const CHI2_99: [f64; 2] = [6.634_897, 9.210_340];

/// νᵀ S⁻¹ ν, or `None` when S is not positive definite or a number is not finite.
///
/// ```
/// use nalgebra::{Matrix2, Vector2};
/// let nis = monorange_core::association::normalised_square(&Vector2::new(2.0, 0.0), &Matrix2::new(4.0, 0.0, 0.0, 1.0));
/// assert_eq!(nis, Some(1.0));
/// ```
pub fn normalised_square<T: Real>(innovation: &Vector2<T>, covariance: &Matrix2<T>) -> Option<T> {
    let root = cholesky(covariance)?;
    let whitened = forward(&root, innovation);
    let sum = whitened.norm_squared();
    sum.is_finite().then_some(sum)
}

/// The factor f ≥ 1 of the module page: 1 inside the gate.
pub fn inflation<T: Real>(
    innovation: &Vector2<T>,
    from_state: &Matrix2<T>,
    noise: &Matrix2<T>,
    gate: T,
) -> Option<T> {
    let root = cholesky(noise)?;
    let whitened = forward(&root, innovation);
    // L⁻¹ C L⁻ᵀ, one column at a time.
    let left = Matrix2::from_columns(&[
        forward(&root, &from_state.column(0).into_owned()),
        forward(&root, &from_state.column(1).into_owned()),
    ])
    .transpose();
    let normal = Matrix2::from_columns(&[
        forward(&root, &left.column(0).into_owned()),
        forward(&root, &left.column(1).into_owned()),
    ]);
    let half = T::lit(0.5);
    let (mean, difference) = ((normal.m11 + normal.m22) * half, (normal.m11 - normal.m22) * half);
    let coupling = (normal.m12 + normal.m21) * half;
    let spread = (difference * difference + coupling * coupling).sqrt();
    // The eigenvalue λ₁ = mean + spread has the direction (coupling, spread − difference).
    let axis = if spread <= T::zero() {
        Vector2::new(T::one(), T::zero())
    } else if difference <= T::zero() {
        Vector2::new(coupling, spread - difference).normalize()
    } else {
        Vector2::new(spread + difference, coupling).normalize()
    };
    let along = axis.dot(&whitened);
    let across = axis.x * whitened.y - axis.y * whitened.x;
    let terms =
        [(along * along, (mean + spread).max(T::zero())), (across * across, (mean - spread).max(T::zero()))];
    let mut factor = T::one();
    for _ in 0..12 {
        let (mut value, mut slope) = (T::zero(), T::zero());
        for (square, eigenvalue) in terms {
            let term = square / (eigenvalue + factor);
            value += term;
            slope += term / (eigenvalue + factor);
        }
        if value <= gate * (T::one() + T::lit(1e-6)) {
            break;
        }
        // Newton on 1/value − 1/gate; d(1/value)/df = slope/value².
        factor += (value / gate - T::one()) * value / slope;
    }
    factor.is_finite().then_some(factor)
}

/// Lower L with S = L Lᵀ as (l₁₁, l₂₁, l₂₂), or `None` when S is not positive definite.
pub(crate) fn cholesky<T: Real>(s: &Matrix2<T>) -> Option<[T; 3]> {
    if !(s.m11 > T::zero() && s.m11.is_finite()) {
        return None;
    }
    let l11 = s.m11.sqrt();
    let l21 = s.m21 / l11;
    let rest = s.m22 - l21 * l21;
    if rest > T::zero() && rest.is_finite() { Some([l11, l21, rest.sqrt()]) } else { None }
}

/// L⁻¹ v.
pub(crate) fn forward<T: Real>(root: &[T; 3], v: &Vector2<T>) -> Vector2<T> {
    let [l11, l21, l22] = *root;
    let first = v.x / l11;
    Vector2::new(first, (v.y - l21 * first) / l22)
}

#[cfg(test)]
mod tests {
    use super::*;

    use proptest::prelude::*;

    fn spd() -> impl Strategy<Value = Matrix2<f64>> {
        (0.01..3.0_f64, 0.01..3.0_f64, -0.95..0.95_f64)
            .prop_map(|(a, b, c)| Matrix2::new(a * a, a * b * c, a * b * c, b * b))
    }

    proptest! {
        #[test]
        fn inflated_noise_puts_the_measurement_on_the_gate(
            from_state in spd(), noise in spd(), x in -50.0..50.0_f64, y in -50.0..50.0_f64,
        ) {
            let (innovation, gate) = (Vector2::new(x, y), CHI2_99[1]);
            let before = normalised_square(&innovation, &(from_state + noise)).unwrap();
            let factor = inflation(&innovation, &from_state, &noise, gate).unwrap();
            let after = normalised_square(&innovation, &(from_state + noise * factor)).unwrap();
            if before <= gate {
                prop_assert_eq!(factor, 1.0);
            } else {
                prop_assert!((after / gate - 1.0).abs() < 1e-5, "NIS {} after factor {}", after, factor);
            }
        }
    }
}

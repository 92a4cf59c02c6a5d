//! Elementary functions for rows of samples: polynomials without branches, which the compiler turns into
//! vector code, and whose multiplications and additions give the same bits at every vector width.
//!
//! | function | on | largest error |
//! |---|---|---|
//! | [`turn_and_magnitude`] | any vector | 5·10⁻⁶ turns, 1.2·10⁻⁵ relative |
//! | [`exp_of_minus`] | 0 … 4.8 | 1.6·10⁻⁵ relative |
//! | [`floor_small`] | 0 … 2²² | at an integer it may return the one below |
//!
//! The coefficients are least-squares fits on Chebyshev nodes.

/// atan(√t)/(2π√t) for t in 0 … 1.
const TURN: [f32; 5] = [0.159_150_06, -0.052_788_17, 0.029_460_05, -0.014_602_22, 0.003_783_925];
/// √(1 + t) for t in 0 … 1.
const HYPOTENUSE: [f32; 5] = [1.000_011_2, 0.499_404_7, -0.119_723_83, 0.044_864_78, -0.010_351_83];
/// exp(−t) for t in 0 … 0.6.
const EXP: [f32; 5] = [0.999_999, -0.999_918_7, 0.498_897_2, -0.161_373_7, 0.031_006_59];

#[inline(always)]
fn polynomial(c: &[f32; 5], t: f32) -> f32 {
    c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * c[4])))
}

/// The direction of (x, y), in turns of 0 … 1 from +x towards +y, and its length. Zero has direction zero.
#[inline(always)]
pub(super) fn turn_and_magnitude(x: f32, y: f32) -> (f32, f32) {
    let (width, height) = (x.abs(), y.abs());
    let (small, large) = if width < height { (width, height) } else { (height, width) };
    let slope = small / (large + 1e-20);
    let squared = slope * slope;
    let mut turn = slope * polynomial(&TURN, squared);
    turn = if width < height { 0.25 - turn } else { turn };
    turn = if x < 0.0 { 0.5 - turn } else { turn };
    turn = if y < 0.0 { 1.0 - turn } else { turn };
    (turn, large * polynomial(&HYPOTENUSE, squared))
}

/// exp(−t).
#[inline(always)]
pub(super) fn exp_of_minus(t: f32) -> f32 {
    let root = polynomial(&EXP, t * 0.125);
    let square = root * root;
    let fourth = square * square;
    fourth * fourth
}

/// The whole part of a number of 0 … 2²², and what is left.
#[inline(always)]
pub(super) fn floor_small(value: f32) -> (u32, f32) {
    // Beside 3·2²² a float has no room for a fraction: the addition rounds, and the integer can be read off.
    const SHIFT: f32 = 12_582_912.0;
    let shifted = (value - 0.5) + SHIFT;
    (shifted.to_bits() & 0x003f_ffff, value - (shifted - SHIFT))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn direction_and_length_are_those_of_the_library(x in -3e4_f32..3e4, y in -3e4_f32..3e4) {
            let (turn, magnitude) = turn_and_magnitude(x, y);
            let length = f64::from(x).hypot(f64::from(y));
            prop_assert!((f64::from(magnitude) - length).abs() <= 1.3e-5 * length);
            let exact = f64::from(y).atan2(f64::from(x)) / core::f64::consts::TAU;
            let difference = (f64::from(turn) - exact).rem_euclid(1.0);
            prop_assert!(difference.min(1.0 - difference) < 6e-6, "{turn} is not {exact}");
        }

        #[test]
        fn exponential_is_the_library_s(t in 0.0_f32..4.8) {
            let exact = libm::exp(-f64::from(t));
            prop_assert!((f64::from(exp_of_minus(t)) - exact).abs() < 1.6e-5 * exact);
        }

        #[test]
        fn whole_part_and_rest_make_the_number(value in prop_oneof![0.0_f32..300.0, 0.0_f32..0.6]) {
            let (whole, rest) = floor_small(value);
            prop_assert_eq!(whole as f32 + rest, value);
            prop_assert!((0.0..=1.0).contains(&rest));
        }
    }

    #[test]
    fn no_gradient_has_no_length() {
        assert_eq!(turn_and_magnitude(0.0, 0.0), (0.0, 0.0));
    }
}

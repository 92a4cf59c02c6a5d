use super::lanes::{Lanes, Word, each};

/// Gradient values to a grey level per pixel: 16 of the smoothing times 8 of Sobel's kernel.
pub const GRADIENT_SCALE: f32 = 128.0;

/// A gradient of zero as it is stored: gradients lie within ±16 320, so that with this added they are positive and leave the
/// highest bit free.
pub const GRADIENT_ZERO: u16 = 1 << 14;
/// What is added to the difference of two smoothed values, of which [`gradient_row`] adds four.
const DIFFERENCE_ZERO: u16 = GRADIENT_ZERO / 4;

/// Variance of G(x + 1) − G(x − 1) + 2δ (2 G(x) − G(x − 1) − G(x + 1)), taken across an edge, for white noise of
/// variance 1 in the picture and averaged over sub-pixel offsets δ of ±½: what shifts a maximum. The squared norms
/// of the kernels, 924 along the edge and 198 + 90/3 across it, over the square of the smoothing's division.
pub const NOISE_GAIN: f32 = 924.0 * (198.0 + 90.0 / 3.0) / 256.0;

/// How many neighbouring edge points along an edge are worth one independent one, when every `stride`th pixel
/// of the edge is taken: Σ over lags of the autocorrelation of [1 6 15 20 15 6 1].
pub fn correlation_length(stride: usize) -> f32 {
    // The autocorrelation of the binomial of order 6 is the binomial of order 12.
    const AUTOCORRELATION: [f32; 6] = [792.0, 495.0, 220.0, 66.0, 12.0, 1.0];
    let lags = AUTOCORRELATION.iter().skip(stride - 1).step_by(stride);
    1.0 + 2.0 * lags.sum::<f32>() / 924.0
}

/// Writes Sobel's [1 2 1]ᵀ and [−1 0 1]ᵀ over three smoothed rows, the second with a quarter of [`GRADIENT_ZERO`] added.
pub fn column_sums(rows: [&[u16]; 3], sum: &mut [u16], difference: &mut [u16]) {
    each(rows, [sum, difference], |[above, at, below]: [Word; 3]| {
        [above + at.up::<1>() + below, below + Word::splat(DIFFERENCE_ZERO) - above]
    });
}

/// Writes the gradient (G_u, G_v), each with [`GRADIENT_ZERO`] added; both are two shorter than the column sums.
pub fn gradient_row(sum: &[u16], difference: &[u16], along_u: &mut [u16], along_v: &mut [u16]) {
    each([sum, from(sum, 2)], [along_u], |[left, right]: [Word; 2]| {
        [right + Word::splat(GRADIENT_ZERO) - left]
    });
    each(
        [difference, from(difference, 1), from(difference, 2)],
        [along_v],
        |[left, at, right]: [Word; 3]| [left + at.up::<1>() + right],
    );
}

fn from(row: &[u16], start: usize) -> &[u16] {
    row.get(start..).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::super::{smooth_column, smooth_row};
    use super::*;
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    fn gradient_at_centre(pixel: impl Fn(i32, i32) -> u8) -> (i16, i16) {
        let smoothed: Vec<Vec<u16>> = (-3..=3)
            .map(|v| {
                let mut out = vec![0; 3];
                smooth_row(&(-3..=3).map(|u| pixel(u, v)).collect::<Vec<_>>(), &mut out);
                out
            })
            .collect();
        let rows: Vec<Vec<u16>> = (0..3)
            .map(|first| {
                let mut out = vec![0; 3];
                smooth_column(std::array::from_fn(|k| smoothed[first + k].as_slice()), &mut out);
                out
            })
            .collect();
        let (mut sum, mut difference) = ([0; 3], [0; 3]);
        column_sums(std::array::from_fn(|k| rows[k].as_slice()), &mut sum, &mut difference);
        let (mut along_u, mut along_v) = ([0], [0]);
        gradient_row(&sum, &difference, &mut along_u, &mut along_v);
        ([along_u[0], along_v[0]].map(|g: u16| g as i16 - GRADIENT_ZERO as i16)).into()
    }

    #[test]
    fn a_ramp_has_the_gradient_of_its_slope() {
        let ramp = |u: i32, v: i32| (100 + 5 * u - 3 * v) as u8;
        assert_eq!(gradient_at_centre(ramp), (5 * GRADIENT_SCALE as i16, -3 * GRADIENT_SCALE as i16));
    }

    #[test]
    fn the_steepest_step_does_not_overflow() {
        let (along_u, along_v) = gradient_at_centre(|u, _| if u > 0 { 255 } else { 0 });
        assert!(along_u > 10_000 && along_v == 0);
        assert_eq!(gradient_at_centre(|u, _| if u > 0 { 0 } else { 255 }), (-along_u, 0));
    }

    proptest! {
        #[test]
        fn rows_of_any_length_agree_with_sobels_kernel(
            rows in (3_usize..70).prop_flat_map(|n| prop::array::uniform3(prop::collection::vec(0..=4080_u16, n))),
        ) {
            let length = rows[0].len();
            let (mut sum, mut difference) = (vec![0; length], vec![0; length]);
            column_sums([&rows[0], &rows[1], &rows[2]], &mut sum, &mut difference);
            let (mut along_u, mut along_v) = (vec![0; length - 2], vec![0; length - 2]);
            gradient_row(&sum, &difference, &mut along_u, &mut along_v);
            for k in 0..length - 2 {
                let at = |row: usize, column: usize| i32::from(rows[row][k + column]);
                let u = at(0, 2) + 2 * at(1, 2) + at(2, 2) - at(0, 0) - 2 * at(1, 0) - at(2, 0);
                let v = at(2, 0) + 2 * at(2, 1) + at(2, 2) - at(0, 0) - 2 * at(0, 1) - at(0, 2);
                let zero = i32::from(GRADIENT_ZERO);
                prop_assert_eq!((i32::from(along_u[k]), i32::from(along_v[k])), (u + zero, v + zero));
            }
        }
    }

    #[test]
    fn correlation_is_the_squared_sum_over_the_sum_of_squares() {
        assert!((correlation_length(1) - 64.0 * 64.0 / 924.0).abs() < 1e-5);
        assert_eq!(correlation_length(8), 1.0);
    }

    #[test]
    fn noise_gain_is_the_norm_of_the_impulse_response() {
        // The response to a single bright pixel is, by linearity, the kernel itself.
        let (mut odd, mut even) = (0.0, 0.0);
        for v0 in -3..=3 {
            for u0 in -4..=4 {
                let at = |shift: i32| {
                    let impulse = move |u: i32, v: i32| if (u + shift, v) == (u0, v0) { 160 } else { 0 };
                    f64::from(gradient_at_centre(impulse).0) / 160.0
                };
                odd += (at(1) - at(-1)).powi(2);
                even += (2.0 * at(0) - at(1) - at(-1)).powi(2);
            }
        }
        let squared = odd + even * 4.0 / 12.0; // δ² is 1/12 on average
        assert!((squared / f64::from(NOISE_GAIN) - 1.0).abs() < 1e-2, "{squared}");
    }
}

/// Writes [1 4 6 4 1] ∗ `row`, which is four values shorter than `row`, into the start of `out`; value 0
/// belongs to pixel 2.
///
/// ```
/// let mut out = [0; 3];
/// monorange_core::image::smooth_row(&[10, 10, 10, 10, 10, 26, 10], &mut out);
/// assert_eq!(out, [160, 176, 224]);
/// ```
pub fn smooth_row(row: &[u8], out: &mut [u16]) {
    for (out, window) in out.iter_mut().zip(row.windows(5)) {
        if let &[a, b, c, d, e] = window {
            let [a, b, c, d, e] = [a, b, c, d, e].map(u16::from);
            *out = a + e + 4 * (b + d) + 6 * c;
        }
    }
}

/// Writes [1 4 6 4 1]ᵀ ∗ `rows` / 16, rounded, for rows made by [`smooth_row`], from the topmost on.
pub fn smooth_column(rows: [&[u16]; 5], out: &mut [u16]) {
    let [a, b, c, d, e] = rows;
    for (((((out, a), b), c), d), e) in out.iter_mut().zip(a).zip(b).zip(c).zip(d).zip(e) {
        *out = (a + e + 4 * (b + d) + 6 * c + 8) >> 4; // at most 16 · 4080 + 8 < 2¹⁶
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_stays_white_without_overflow() {
        let mut row = [0; 4];
        smooth_row(&[255; 8], &mut row);
        assert_eq!(row, [4080; 4]);
        let mut out = [0; 4];
        smooth_column([&row; 5], &mut out);
        assert_eq!(out, [4080; 4]);
    }

    #[test]
    fn a_row_shorter_than_the_kernel_gives_nothing() {
        let mut out = [7; 2];
        smooth_row(&[1, 2, 3, 4], &mut out);
        assert_eq!(out, [7; 2]);
    }
}

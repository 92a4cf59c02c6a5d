//! Oriented BRIEF: 256 comparisons of brightness round a corner, turned with it.
//!
//! The direction of a corner is that of the intensity centroid of a disc of radius 15 round it,
//!
//! ```text
//! (m₁₀, m₀₁) = Σ (x, y) · I(x, y)        (c, s) = (m₁₀, m₀₁)/‖(m₁₀, m₀₁)‖
//! ```
//!
//! so that the rotation (c, s) of the comparisons needs a square root and no angle. Bit n is set where
//! I(R aₙ) < I(R bₙ), on the picture smoothed by the binomial of order 8 (σ = √2) in both directions.
//!
//! The points (aₙ, bₙ) are drawn by a program, [`pattern`], not learned: normal with a standard deviation of
//! 31/5 px (the best of the distributions that BRIEF's authors tried), rounded, within a disc of radius 13, and
//! a pair is drawn again when it is shorter than 4 px or when both its ends lie within 2 px of an earlier
//! pair's, whose bit it would repeat.
//!
//! Sources: M. Calonder et al., "BRIEF: Binary robust independent elementary features", ECCV 2010, section 3.2;
//! P. L. Rosin, "Measuring corner properties", CVIU 73(2), 1999 for the centroid.
#![allow(
    clippy::indexing_slicing,
    reason = "rows reach as far as the patch: the caller keeps corners from the rim"
)]

/// 256 bits, one for each comparison.
pub type BriefDescriptor = [u32; 8];

/// Radius of the disc whose centroid gives the direction: how far a corner must be from the rim.
pub(super) const RADIUS: usize = 15;
/// Rows of smoothed picture that a descriptor depends on.
pub(super) const ROWS: usize = 2 * RADIUS + 1;
/// Radius of the disc of comparisons, so that a rounded rotation stays within [`RADIUS`].
const REACH: i32 = 13;
/// Comparisons.
const PAIRS: usize = 256;

/// Half the width of the disc in each of its rows, from the middle row down: ⌊√(15² − y²)⌋.
const HALF_WIDTHS: [usize; RADIUS + 1] = [15, 14, 14, 14, 14, 14, 13, 13, 12, 12, 11, 10, 9, 7, 5, 0];

/// Two points (x, y) that a bit compares.
type Pair = [[i8; 2]; 2];

static PATTERN: [Pair; PAIRS] = pattern();

/// The comparisons, computed when the program is compiled.
const fn pattern() -> [Pair; PAIRS] {
    let mut pairs = [[[0; 2]; 2]; PAIRS];
    let mut state = 0x6d6f_6e6f_7261_6e67; // "monorang"
    let mut count = 0;
    while count < PAIRS {
        let (a, after) = draw(state);
        let (b, after) = draw(after);
        state = after;
        if is_new(&pairs, count, a, b) {
            pairs[count] = [[a[0] as i8, a[1] as i8], [b[0] as i8, b[1] as i8]];
            count += 1;
        }
    }
    pairs
}

/// A point within the disc, normal with a standard deviation of 6.2, and the generator's next state.
const fn draw(mut state: u64) -> ([i32; 2], u64) {
    loop {
        let mut point = [0; 2];
        let mut axis = 0;
        while axis < 2 {
            // Twelve uniform numbers of 0 … 1023 sum to a normal one with the standard deviation 1023.5.
            let (mut sum, mut n) = (0, 0);
            while n < 12 {
                // Knuth's linear congruential generator; its high bits are the good ones.
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                sum += (state >> 54) as i32;
                n += 1;
            }
            point[axis] = ((sum - 6138) * 62 + 5120 * if sum < 6138 { -1 } else { 1 }) / 10_240;
            axis += 1;
        }
        if point[0] * point[0] + point[1] * point[1] <= REACH * REACH {
            return (point, state);
        }
    }
}

const fn distance2(a: [i32; 2], b: [i32; 2]) -> i32 {
    (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])
}

/// Whether a pair says something that the first `count` do not.
const fn is_new(pairs: &[Pair; PAIRS], count: usize, a: [i32; 2], b: [i32; 2]) -> bool {
    if distance2(a, b) < 16 {
        return false;
    }
    let mut n = 0;
    while n < count {
        let [p, q] = pairs[n];
        let (p, q) = ([p[0] as i32, p[1] as i32], [q[0] as i32, q[1] as i32]);
        let same = distance2(a, p) <= 4 && distance2(b, q) <= 4;
        let swapped = distance2(a, q) <= 4 && distance2(b, p) <= 4;
        if same || swapped {
            return false;
        }
        n += 1;
    }
    true
}

/// The direction (c, s) at column `x` of the middle of the rows, or (1, 0) where the disc has none.
pub(super) fn direction(rows: &[&[u8]; ROWS], x: usize) -> [f32; 2] {
    let (mut across, mut down) = (0_i32, 0_i32);
    for (index, row) in rows.iter().enumerate() {
        let y = index as i32 - RADIUS as i32;
        let half = HALF_WIDTHS[index.abs_diff(RADIUS)];
        let mut sum = 0;
        for (dx, &pixel) in (-(half as i32)..).zip(&row[x - half..=x + half]) {
            across += dx * i32::from(pixel);
            sum += i32::from(pixel);
        }
        down += y * sum;
    }
    if across == 0 && down == 0 {
        return [1.0, 0.0];
    }
    let (across, down) = (across as f32, down as f32);
    let length = libm::sqrtf(across * across + down * down);
    [across / length, down / length]
}

/// The descriptor at column `x` of the middle of the smoothed rows.
pub(super) fn describe(rows: &[&[u8]; ROWS], x: usize, [c, s]: [f32; 2]) -> BriefDescriptor {
    const ONE: f32 = 16384.0;
    let (c, s) = (libm::roundf(c * ONE) as i32, libm::roundf(s * ONE) as i32);
    // Halves away from zero, so that a quarter turn of the picture is one of the pattern exactly.
    let rounded = |value: i32| (value + 8192 - i32::from(value < 0)) >> 14;
    let pixel = |[px, py]: [i8; 2]| {
        let (px, py) = (i32::from(px), i32::from(py));
        let (across, down) = (rounded(c * px - s * py), rounded(s * px + c * py));
        rows[(RADIUS as i32 + down) as usize][(x as i32 + across) as usize]
    };
    let mut bits = [0; 8];
    for (word, pairs) in bits.iter_mut().zip(PATTERN.chunks_exact(32)) {
        for (bit, &[a, b]) in pairs.iter().enumerate() {
            *word |= u32::from(pixel(a) < pixel(b)) << bit;
        }
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Patch = [[u8; ROWS]; ROWS];

    fn rows(patch: &Patch) -> [&[u8]; ROWS] {
        core::array::from_fn(|y| &patch[y][..])
    }

    /// The patch turned by 90° from +x towards +y.
    fn turned(patch: &Patch) -> Patch {
        core::array::from_fn(|y| core::array::from_fn(|x| patch[ROWS - 1 - x][y]))
    }

    proptest! {
        #[test]
        fn a_quarter_turn_turns_the_direction_and_keeps_the_descriptor(
            seed in proptest::collection::vec(any::<u8>(), ROWS * ROWS),
        ) {
            let patch: Patch = core::array::from_fn(|y| core::array::from_fn(|x| seed[y * ROWS + x]));
            let other = turned(&patch);
            let [c, s] = direction(&rows(&patch), RADIUS);
            prop_assert_eq!(direction(&rows(&other), RADIUS), [-s, c]);
            let (a, b) = (describe(&rows(&patch), RADIUS, [c, s]), describe(&rows(&other), RADIUS, [-s, c]));
            prop_assert_eq!(a, b);
        }
    }

    #[test]
    fn a_rising_ramp_points_up_its_slope() {
        let patch: Patch = core::array::from_fn(|y| core::array::from_fn(|x| (4 * x + 3 * y) as u8));
        let [c, s] = direction(&rows(&patch), RADIUS);
        assert!((c - 0.8).abs() < 1e-6 && (s - 0.6).abs() < 1e-6, "{c} {s}");
        assert_eq!(direction(&rows(&[[9; ROWS]; ROWS]), RADIUS), [1.0, 0.0]);
    }

    #[test]
    fn the_pattern_is_centred_spread_and_within_its_disc() {
        let points = || PATTERN.iter().flatten().map(|p| p.map(i32::from));
        assert!(points().all(|[x, y]| x * x + y * y <= REACH * REACH));
        for axis in 0..2 {
            let sum: i32 = points().map(|p| p[axis]).sum();
            let squares: i32 = points().map(|p| p[axis] * p[axis]).sum();
            assert!(sum.abs() < 512, "mean {sum}/512");
            // A normal of 6.2 px cut at 13 px has 5.3 px.
            assert!((20..36).contains(&(squares / 512)), "variance {squares}/512");
        }
    }
}

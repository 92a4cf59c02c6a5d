//! Which descriptor of one picture is which of another.
//!
//! A pair (i, j) is a match when each is the other's nearest, and the distance passes the ratio test
//! d(i, j) < ρ · d(i, second nearest), with distances not squared: an ambiguous texture has a second that is
//! nearly as near. Where a prediction exists only descriptors inside its ellipse are compared,
//!
//! ```text
//! (p − p̂)ᵀ S⁻¹ (p − p̂) ≤ γ
//! ```
//!
//! with p̂ the predicted pixel, S its 2 × 2 covariance and γ a χ² quantile of two degrees (9.21 for 99 %).
//!
//! | descriptor | distance | cost |
//! |---|---|---|
//! | [`SiftDescriptor`](super::SiftDescriptor), 128 bytes | squared Euclidean, an integer | 16 multiply-and-add instructions on 8 numbers |
//! | [`BriefDescriptor`](super::BriefDescriptor), 256 bits | Hamming | 8 exclusive-ors and bit counts |
//!
//! Both directions come from one pass over all pairs; of equal distances the lower index wins.
//!
//! Source: Lowe 2004, section 7.1.
use crate::vectors::widest;
use crate::{Error, Result};
use nalgebra::{Matrix2, Vector2};

/// Something that can be compared with another of its kind.
pub trait Descriptor {
    /// How different two are; 0 for equal ones.
    fn distance(&self, other: &Self) -> u32;
    /// What the ratio of two distances is raised to in [`Descriptor::distance`]: 2 where it is squared.
    const POWER: u8;
}

impl Descriptor for [u8; 128] {
    #[inline(always)] // into the loop over all pairs, whose vectors it takes
    fn distance(&self, other: &Self) -> u32 {
        // At most 128 · 255²: wrapping, so that checks for overflow do not stop vectorisation.
        let mut sum = 0_i32;
        for (a, b) in self.iter().zip(other) {
            let difference = i16::from(*a).wrapping_sub(i16::from(*b));
            sum = sum.wrapping_add(i32::from(difference).wrapping_mul(i32::from(difference)));
        }
        sum.unsigned_abs()
    }
    const POWER: u8 = 2;
}

impl Descriptor for [u32; 8] {
    #[inline(always)]
    fn distance(&self, other: &Self) -> u32 {
        self.iter().zip(other).map(|(a, b)| (a ^ b).count_ones()).sum()
    }
    const POWER: u8 = 1;
}

/// The settings of [`match_descriptors`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchConfig {
    /// ρ: the nearest must be nearer than this part of the second; 1 switches the test off.
    pub ratio: f32,
    /// The largest [`Descriptor::distance`] of a match.
    pub max_distance: u32,
}

impl Default for MatchConfig {
    fn default() -> Self {
        Self { ratio: 0.8, max_distance: u32::MAX }
    }
}

/// Two descriptors that belong together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Match {
    /// Index in the first picture.
    pub first: usize,
    /// Index in the second picture.
    pub second: usize,
    /// [`Descriptor::distance`] of the two.
    pub distance: u32,
}

/// What was matched, and how many matches had no room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MatchReport {
    /// Matches written.
    pub matches: usize,
    /// Matches without room in the output.
    pub truncated: usize,
}

/// The nearest so far; memory that callers lend.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Nearest {
    distance: u32,
    second_distance: u32,
    index: usize,
}

const NONE: Nearest = Nearest { distance: u32::MAX, second_distance: u32::MAX, index: usize::MAX };

/// Where a descriptor's point should be in the second picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    pixel: Vector2<f32>,
    information: Matrix2<f32>,
    gate: f32,
}

impl Prediction {
    /// A prediction with the covariance `covariance` (px²), in whose ellipse `(p − p̂)ᵀ S⁻¹ (p − p̂) ≤ gate`
    /// the point is looked for.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when the covariance is not positive definite or a number is not finite.
    pub fn new(pixel: Vector2<f32>, covariance: Matrix2<f32>, gate: f32) -> Result<Self> {
        let [a, b, c] = [covariance.m11, 0.5 * (covariance.m12 + covariance.m21), covariance.m22];
        let determinant = a * c - b * b;
        let check = |ok: bool, name, value: f32, expected| {
            if ok { Ok(()) } else { Err(Error::OutOfRange { name, value: value.into(), expected }) }
        };
        check(pixel.x.is_finite() && pixel.y.is_finite(), "prediction.pixel", pixel.x, "finite")?;
        let definite = a > 0.0 && determinant > 0.0 && determinant.is_finite();
        check(
            definite,
            "prediction.covariance",
            determinant,
            "positive definite (its determinant is given)",
        )?;
        check(gate >= 0.0, "prediction.gate", gate, "at least 0")?;
        Ok(Self { pixel, information: Matrix2::new(c, -b, -b, a) / determinant, gate })
    }

    /// Whether a point may be the predicted one.
    pub fn contains(&self, pixel: Vector2<f32>) -> bool {
        let error = pixel - self.pixel;
        error.dot(&(self.information * error)) <= self.gate
    }
}

/// Writes the matches between two lists of descriptors, in the order of the first, to the front of `matches`.
///
/// `work` holds one [`Nearest`] for each descriptor of either picture.
///
/// # Errors
/// As [`match_where`].
///
/// ```
/// use monorange_core::features::{Match, MatchConfig, Nearest, match_descriptors};
/// let (seen, now) = ([[0_u32; 8], [!0; 8]], [[!0_u32; 8], [7, 0, 0, 0, 0, 0, 0, 0]]);
/// let (mut work, mut matches) = ([Nearest::default(); 4], [Match::default(); 2]);
/// let report = match_descriptors(&seen, &now, &MatchConfig::default(), &mut work, &mut matches)?;
/// assert_eq!(report.matches, 2);
/// assert_eq!(matches[0], Match { first: 0, second: 1, distance: 3 });
/// # Ok::<(), monorange_core::Error>(())
/// ```
pub fn match_descriptors<D: Descriptor>(
    first: &[D],
    second: &[D],
    config: &MatchConfig,
    work: &mut [Nearest],
    matches: &mut [Match],
) -> Result<MatchReport> {
    match_where(first, second, |_, _| true, config, work, matches)
}

/// As [`match_descriptors`] among the pairs of indices that `allowed` accepts, such as those inside a
/// [`Prediction`]. The ratio test, too, looks at allowed pairs only.
///
/// # Errors
/// [`Error::OutOfRange`] when the ratio is not within 0 … 1, [`Error::Size`] when `work` is too short.
pub fn match_where<D: Descriptor>(
    first: &[D],
    second: &[D],
    allowed: impl Fn(usize, usize) -> bool,
    config: &MatchConfig,
    work: &mut [Nearest],
    matches: &mut [Match],
) -> Result<MatchReport> {
    if !(config.ratio > 0.0 && config.ratio <= 1.0) {
        let value = config.ratio.into();
        return Err(Error::OutOfRange { name: "match.ratio", value, expected: "above 0 and at most 1" });
    }
    let expected = first.len() + second.len();
    let Some(work) = work.get_mut(..expected) else {
        return Err(Error::Size { name: "match work", got: work.len(), expected });
    };
    work.fill(NONE);
    let (of_first, of_second) = work.split_at_mut(first.len());
    let pairs = (first, &mut *of_first, second, &mut *of_second, &allowed);
    widest!(pairs, compare);
    let mut report = MatchReport::default();
    let mut places = matches.iter_mut();
    for (i, nearest) in of_first.iter().enumerate() {
        let mutual = of_second.get(nearest.index).is_some_and(|other| other.index == i);
        if mutual && nearest.distance <= config.max_distance && nearest.is_distinct::<D>(config.ratio) {
            match places.next() {
                Some(place) => {
                    *place = Match { first: i, second: nearest.index, distance: nearest.distance };
                    report.matches += 1;
                }
                None => report.truncated += 1,
            }
        }
    }
    Ok(report)
}

/// Descriptors that a processor's nearest memory holds: 64 of 128 bytes are 8 KiB.
const AT_HAND: usize = 64;

/// Offers all allowed pairs to both sides.
#[inline(always)]
fn compare<D: Descriptor>(
    (first, of_first, second, of_second, allowed): (
        &[D],
        &mut [Nearest],
        &[D],
        &mut [Nearest],
        &impl Fn(usize, usize) -> bool,
    ),
) {
    // A few of the second at a time, which stay at hand for all of the first.
    let mut begin = 0;
    for (some, of_some) in second.chunks(AT_HAND).zip(of_second.chunks_mut(AT_HAND)) {
        for (i, (descriptor, nearest)) in first.iter().zip(&mut *of_first).enumerate() {
            for (j, (other, nearest_to_other)) in (begin..).zip(some.iter().zip(&mut *of_some)) {
                if allowed(i, j) {
                    let distance = descriptor.distance(other);
                    nearest.offer(distance, j);
                    nearest_to_other.offer(distance, i);
                }
            }
        }
        begin += AT_HAND;
    }
}

impl Nearest {
    #[inline(always)]
    fn offer(&mut self, distance: u32, index: usize) {
        if distance < self.distance {
            *self = Self { distance, second_distance: self.distance, index };
        } else if distance < self.second_distance {
            self.second_distance = distance;
        }
    }

    fn is_distinct<D: Descriptor>(&self, ratio: f32) -> bool {
        if ratio >= 1.0 || self.second_distance == u32::MAX {
            return true;
        }
        let limit = if D::POWER == 2 { ratio * ratio } else { ratio };
        (self.distance as f32) < limit * self.second_distance as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    extern crate std;
    use std::vec::Vec;

    fn words() -> impl Strategy<Value = Vec<[u32; 8]>> {
        // Few set bits make ties likely.
        let word = (0_u32..16, 0_u32..4).prop_map(|(a, b)| [a, b, 0, 0, 0, 0, 0, 0]);
        proptest::collection::vec(word, 0..20)
    }

    fn found(first: &[[u32; 8]], second: &[[u32; 8]], ratio: f32) -> Vec<Match> {
        let mut work = std::vec![Nearest::default(); first.len() + second.len()];
        let mut matches = std::vec![Match::default(); first.len()];
        let config = MatchConfig { ratio, ..Default::default() };
        let report = match_descriptors(first, second, &config, &mut work, &mut matches).expect("a ratio");
        matches.truncate(report.matches);
        matches
    }

    proptest! {
        #[test]
        fn matches_are_mutual_nearest_and_pass_the_ratio(first in words(), second in words()) {
            let nearest = |from: &[u32; 8], to: &[[u32; 8]]| {
                let mut order: Vec<_> = to.iter().map(|d| from.distance(d)).enumerate().map(|(i, d)| (d, i)).collect();
                order.sort();
                order
            };
            let mut expected = Vec::new();
            for (i, descriptor) in first.iter().enumerate() {
                let order = nearest(descriptor, &second);
                let Some(&(distance, j)) = order.first() else { continue };
                let mutual = nearest(&second[j], &first)[0].1 == i;
                if mutual && order.get(1).is_none_or(|next| (distance as f32) < 0.75 * next.0 as f32) {
                    expected.push(Match { first: i, second: j, distance });
                }
            }
            prop_assert_eq!(found(&first, &second, 0.75), expected);
        }

        #[test]
        fn without_a_ratio_the_order_of_pictures_does_not_matter(first in words(), second in words()) {
            // Ties are broken by index, alike from both sides.
            let mut turned: Vec<_> = found(&second, &first, 1.0).iter()
                .map(|m| Match { first: m.second, second: m.first, distance: m.distance }).collect();
            turned.sort_by_key(|m| m.first);
            prop_assert_eq!(found(&first, &second, 1.0), turned);
        }
    }

    #[test]
    fn a_prediction_leaves_out_the_twin_elsewhere() {
        let seen = [[5_u32; 8]];
        let now = [[5_u32; 8], [5; 8]];
        let places = [Vector2::new(100.0, 40.0), Vector2::new(31.0, 20.0)];
        let predicted = Prediction::new(Vector2::new(30.0, 20.0), Matrix2::new(1.0, 0.2, 0.2, 2.0), 9.21)
            .expect("positive definite");
        let (mut work, mut matches) = ([Nearest::default(); 3], [Match::default(); 1]);
        let config = MatchConfig::default();
        let everywhere = match_descriptors(&seen, &now, &config, &mut work, &mut matches).expect("a ratio");
        assert_eq!(everywhere.matches, 0, "the ratio test rejects a twin");
        let inside = |_, j: usize| predicted.contains(places[j]);
        let near = match_where(&seen, &now, inside, &config, &mut work, &mut matches).expect("a ratio");
        assert_eq!((near.matches, matches[0].second), (1, 1));
    }

    #[test]
    fn squared_distances_use_the_squared_ratio() {
        let mut now = [[0_u8; 128]; 2];
        (now[0][0], now[1][0]) = (7, 10);
        let (mut work, mut matches) = ([Nearest::default(); 3], [Match::default(); 1]);
        let mut count = |ratio| {
            let config = MatchConfig { ratio, ..Default::default() };
            match_descriptors(&[[0; 128]], &now, &config, &mut work, &mut matches).expect("a ratio").matches
        };
        assert_eq!((count(0.69), count(0.71)), (0, 1));
    }

    #[test]
    fn bad_settings_are_named() {
        let singular = Prediction::new(Vector2::zeros(), Matrix2::new(1.0, 1.0, 1.0, 1.0), 1.0);
        assert!(matches!(singular, Err(Error::OutOfRange { name: "prediction.covariance", .. })));
        let config = MatchConfig { ratio: 0.0, ..Default::default() };
        let report = match_descriptors::<[u32; 8]>(&[], &[], &config, &mut [], &mut []);
        assert!(matches!(report, Err(Error::OutOfRange { name: "match.ratio", .. })));
        let report = match_descriptors(&[[0_u32; 8]], &[], &MatchConfig::default(), &mut [], &mut []);
        assert_eq!(report, Err(Error::Size { name: "match work", got: 0, expected: 1 }));
    }
}

//! Whether a homography could be by chance, or of places that only look alike.
//!
//! ```text
//! (n − 4) C(n, k) C(k, 4) p^(k−4) < ε        expected false alarms; a match agrees by chance with probability p
//! p = max(π g²/area, (1 + hits)/(1 + r (n − 1)))      g: radius of a match's gate, by the noise that was found
//! ```
//!
//! 1. As for the estimate, with the noise that was found instead of the one that was promised, ε = 1.
//! 2. Between pictures of different places, too, some keypoints are nearest to each other: in simulated corridors, the ones
//!    that were used to choose, 3 to 12 % of them. More matches than that, by two standard deviations, come from a place seen
//!    twice: where there are few keypoints, chance alone gives more than 12 % now and then. Otherwise
//!    the test is stricter, since what chance leaves is not scattered evenly: corridors have their skirting boards in the
//!    same places, and any four ends of them have a homography that carries more.
//!    * p is measured on the pair: how often one of the r matches within the gate is carried into the gate of
//!      *another* match (`hits`).
//!    * k counts those matches alone whose keypoints, too, have the direction and the size that M gives them:
//!      A = ∂π(M p)/∂p turns one direction into the other within 20°, and √det A is the ratio of the sizes
//!      within a factor of 1.6. M was not fitted to either.
//!    * ε = 1/20.
//!
//! Keypoints of one spot are one piece of evidence: of matches that begin or end within three sizes of one another the first
//! counts alone, in the number of matches as in k.
//!
//! Of 588 pairs of different corridors that were not used to choose, none (SIFT) and 1 (BRIEF) are accepted, of 588 pairs of corridors that are next
//! to plain 4 and 10, and of 1,509 pairs of different real and rendered places none (`tests/examples/homography_chance.rs`, first seed
//! 801). Of pictures 0.12 m apart all are accepted in corridors with texture, and 84 and 69 of 84 in plain ones. The price: of pictures 1.2 m apart,
//! where BRIEF's corners match no more often than by chance, a third to a half of the right homographies is refused.
//!
//! Source: Moisan & Stival 2004 for the count of false alarms.
use super::normal_equations::Transfer;
use super::robust::{Problem, ln_false_alarms};
use super::{HomographyEstimate, Match};
use crate::Real;
use crate::features::Keypoint;
use nalgebra::{Matrix2, Vector2};

/// Share of the keypoints, of the picture that has fewer, that are matched with another place's at most.
const MATCHED_BY_CHANCE: f64 = 0.12;
/// Standard deviations of their number, as binomial, that chance is granted beyond that: of thirty keypoints chance may match
/// seven.
const SCATTER: f64 = 4.0;
/// Sizes of a keypoint by which two are apart that are no one spot's.
const APART: f32 = 3.0;
/// Cosine of 20°, by which a keypoint's direction is off at most.
const LEAST_COSINE: f64 = 0.939_692_62;
/// Factor by which a keypoint's size is off at most.
const MOST_SIZE: f64 = 1.6;
/// Expected false alarms of look-alikes at most.
const FALSE_ALARMS: f64 = 0.05;

impl<T: Real> HomographyEstimate<T> {
    /// Whether neither chance nor a place that only looks alike would give so many right ones among `matches`, those
    /// of the estimate. `ends` are the keypoints of each match, in the same order, and `keypoints` is the number of all in
    /// the picture that has fewer. Four matches confirm nothing: some homography always carries them.
    ///
    /// ```
    /// use monorange_core::features::Keypoint;
    /// use monorange_core::homography::{HomographyConfig, Match, estimate_homography};
    /// let place = |i: usize, shift: f32| Keypoint {
    ///     pixel: [(37 * i % 100) as f32 + shift, (61 * i % 100) as f32].into(),
    ///     var_px2: 0.1,
    ///     scale: 1.0,
    ///     ..Keypoint::default()
    /// };
    /// let ends: Vec<_> = (0..9).map(|i| [place(i, 0.0), place(i, 5.0)]).collect();
    /// let matches: Vec<Match<f64>> = ends.iter().map(|[a, b]| Match::of_keypoints(a, b)).collect();
    /// let found = estimate_homography(&HomographyConfig::default(), &matches, &mut [0.0; 9])?;
    /// assert!(found.is_confirmed_by(&matches, &ends, 500));
    /// assert!(!found.is_confirmed_by(&matches[..4], &ends[..4], 500));
    /// # Ok::<(), monorange_core::homography::NoHomography>(())
    /// ```
    pub fn is_confirmed_by(&self, matches: &[Match<T>], ends: &[[Keypoint; 2]], keypoints: usize) -> bool {
        let Ok(problem) = Problem::new(matches, matches.len()) else { return false };
        let factor = self.variance_factor.max(T::one());
        if matches.len() <= 4 || !problem.meaningful(self.inliers, factor) {
            return false;
        }
        let places = (0..ends.len()).filter(|index| is_a_place_of_its_own(*index, ends)).count();
        let by_chance = T::lit(keypoints as f64) * T::lit(MATCHED_BY_CHANCE);
        let scatter = (by_chance * T::lit(1.0 - MATCHED_BY_CHANCE)).sqrt();
        let many = T::lit(places as f64) > by_chance + scatter * T::lit(SCATTER);
        many || self.is_no_look_alike(&problem, ends, places, factor)
    }

    fn is_no_look_alike(
        &self,
        problem: &Problem<'_, T>,
        ends: &[[Keypoint; 2]],
        places: usize,
        factor: T,
    ) -> bool {
        let matches = problem.matches;
        let gate2 = problem.gate2(factor);
        let (mut within, mut agreeing, mut hits) = (0, 0, 0);
        for (index, (pair, [from, to])) in matches.iter().zip(ends).enumerate() {
            let Some(seen) = Transfer::at(self.homography.matrix(), pair.from) else { continue };
            let near = |point: Vector2<T>| (seen.point - point).norm_squared() < gate2;
            if !near(pair.to) {
                continue;
            }
            within += 1;
            agreeing += usize::from(
                is_a_place_of_its_own(index, ends) && keeps_direction_and_size(&seen.by_from, from, to),
            );
            let others = matches.iter().enumerate().filter(|(other, _)| *other != index);
            hits += others.filter(|(_, other)| near(other.to)).count();
        }
        if agreeing <= 4 {
            return false;
        }
        let tried = within * (matches.len() - 1);
        let measured = T::lit((hits + 1) as f64 / (tried + 1) as f64);
        let share = measured.max(problem.gate_share(factor));
        ln_false_alarms(places, agreeing, 4, share) < T::lit(FALSE_ALARMS).ln()
    }
}

/// Whether no match before this one begins or ends where it does: the keypoints of one corner or spot are one piece of evidence.
fn is_a_place_of_its_own(index: usize, ends: &[[Keypoint; 2]]) -> bool {
    let near = |a: &Keypoint, b: &Keypoint| {
        let apart = APART * a.scale.max(b.scale);
        (a.pixel - b.pixel).norm_squared() < apart * apart
    };
    let mut before = ends.iter().take(index);
    ends.get(index).is_some_and(|[from, to]| !before.any(|[f, t]| near(f, from) || near(t, to)))
}

/// Whether one keypoint has the direction and the size that the other's would have where M carries it, by A = `by_from`.
fn keeps_direction_and_size<T: Real>(by_from: &Matrix2<T>, from: &Keypoint, to: &Keypoint) -> bool {
    let wide = |value: f32| T::lit(f64::from(value));
    let direction = |point: &Keypoint| Vector2::new(wide(point.angle).cos(), wide(point.angle).sin());
    let carried = by_from * direction(from);
    let turned = carried.dot(&direction(to)) >= carried.norm() * T::lit(LEAST_COSINE);
    let magnified = by_from.determinant().sqrt() * wide(from.scale);
    let most = T::lit(MOST_SIZE);
    turned && magnified <= wide(to.scale) * most && wide(to.scale) <= magnified * most
}

//! Where on a map is the robot? A handful of landmarks that it has mapped itself, laid over all those of the map.
//!
//! ```text
//! m_b = p + R(θ) d_a                         landmark a, seen by the robot at d_a, is landmark b of the map
//! ln e(T) = ½ ln L(pairs) + Σ_pairs ln (w/ρ) + Σ_alone ln (1 − w) + ln ( √(2π) σ_p ρ / 2N )
//! ```
//!
//! e is the evidence for a place T = (p, θ) against none, where the robot stands beside the map; L is the density of all pairs' differences
//! together ([`joint`]). Rooms have straight walls: once T is aligned with them, a corner that falls on another one by chance does so
//! along the wall, not in the plane. So half of L counts, one coordinate a corner, ρ is a number a metre, and the
//! places that there are to choose from are the walls' lengths, N/ρ, in two directions. The robot is there if it is there [`SURE`]
//! times more likely than at any other place that was found, or at none ([`BESIDE`]). Corners of a corridor repeat; what is ambiguous waits for more of them.
//!
//! Candidates for T come from two landmarks each that are as far apart as two of the map, and look like them.
//!
//! | symbol | name in code | unit |
//! |---|---|---|
//! | T | [`Registration::pose`] | m, rad |
//! | d_a | [`Place::position`] of `own` | m, robot |
//! | m_b | [`Place::position`] of `map` | m, map |
//! | w, ρ | [`KEPT`], [`DENSITY`] | share, 1/m |
//! | N, σ_p | landmarks of the map, standard deviation of p | –, m |
//!
//! *Limits.* Distances must hold: wheels that read 10 % long fit nowhere. n own landmarks and N of the map take 3 n N² comparisons.
mod joint;

use crate::geometry::Pose;
use crate::sort::sort_by_key;
use alloc::vec::Vec;
use core::f32::consts::PI;
use joint::{Joint, joint, kept};
use libm::{atan2f, expf, logf, sqrtf};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// Share of the own landmarks that the map has too (judgement: doors open, and a picture finds half of the corners).
const KEPT: f32 = 0.7;
/// Landmarks a metre of wall (judgement: doors, pillars and cupboards have two corners each).
const DENSITY: f32 = 1.0;
/// How much more likely a place must be than all others.
const SURE: f32 = 1000.0;
/// How likely it is beforehand that the robot stands beside the map (judgement: it was given this map).
const BESIDE: f32 = 0.1;
/// What two sessions make of one corner beside their covariances, m (judgement: skirting and frames are seen from other sides).
const SESSION: f32 = 0.03;
/// Landmarks that a place is told by at least, beside the two that it comes from.
const LEAST: usize = 5;
/// Distance of two landmarks that tell a heading, m.
const APART: f32 = 0.5;
/// Partners of each own landmark that candidates come from.
const PARTNERS: usize = 3;
/// Landmarks that are farther from each other than this are not the same, whatever their covariance, m.
const NEAR: f32 = 1.0;
/// χ²(2) at 0.99.
const GATE: f32 = 9.21;
/// Candidates that are worked out in full.
const MOST: usize = 16;

/// A landmark as it is laid over another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Metres.
    pub position: Vector2<f32>,
    /// What it looks like; without looks it may be any.
    pub looks: Option<u32>,
}

/// A place that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration {
    /// The robot in the map.
    pub pose: Pose<f32>,
    /// Covariance of (x, y, heading), from the pairs alone.
    pub covariance: Matrix3<f32>,
    /// Indices of own landmarks and of the map's.
    pub pairs: Vec<(usize, usize)>,
    evidence: f32,
}

/// Both maps, and covariances between two landmarks of one, m².
struct Maps<'a, O, M> {
    own: &'a [Place],
    map: &'a [Place],
    own_covariance: O,
    map_covariance: M,
}

/// Variance of where one landmark is from another, along an axis.
fn spread(covariance: impl Fn(usize, usize) -> Matrix2<f32>, one: usize, other: usize) -> f32 {
    let trace = |one, other| covariance(one, other).trace();
    0.5 * (trace(one, one) + trace(other, other)) - trace(one, other)
}

/// Lays `own` landmarks (robot's frame) over a `map`'s. The covariances are those between the positions of two landmarks of one
/// map. `None` where no place is far more likely than all others.
pub fn register(
    own: &[Place],
    own_covariance: impl Fn(usize, usize) -> Matrix2<f32>,
    map: &[Place],
    map_covariance: impl Fn(usize, usize) -> Matrix2<f32>,
) -> Option<Registration> {
    if own.len() < LEAST || map.len() < LEAST {
        return None;
    }
    let maps = Maps { own, map, own_covariance, map_covariance };
    let mut candidates: Vec<(f32, Pose<f32>, [usize; 2])> = Vec::new();
    for [i, j] in maps.bases() {
        maps.candidates(i, j, &mut candidates);
    }
    let mut found: Vec<Registration> = Vec::new();
    for (_, pose, first) in candidates {
        let Some(place) = maps.refine(&pose, first) else { continue };
        let same = found.iter_mut().find(|other| other.is_as(&place));
        match same {
            Some(other) if other.evidence >= place.evidence => {}
            Some(other) => *other = place,
            None => found.push(place),
        }
    }
    let best =
        found.iter().reduce(|best, other| if other.evidence > best.evidence { other } else { best })?;
    let others = found.iter().filter(|other| !core::ptr::eq(*other, best));
    let rest = others.fold(0.0, |sum, other| sum + expf(other.evidence - best.evidence));
    let rest = rest + BESIDE * expf(-best.evidence);
    (best.pairs.len() >= LEAST && rest * SURE < 1.0).then(|| best.clone())
}

/// What a pair tells, this far from each other squared.
fn told(variance: f32, square: f32) -> f32 {
    logf(KEPT / (sqrtf(2.0 * PI * variance) * DENSITY)) - 0.5 * square / variance
}

fn alike(one: &Place, other: &Place) -> bool {
    one.looks.zip(other.looks).is_none_or(|(one, other)| one == other)
}

impl<O: Fn(usize, usize) -> Matrix2<f32>, M: Fn(usize, usize) -> Matrix2<f32>> Maps<'_, O, M> {
    /// Pairs of own landmarks that tell a heading best: of each landmark a few.
    fn bases(&self) -> Vec<[usize; 2]> {
        let mut bases = Vec::new();
        for (i, one) in self.own.iter().enumerate() {
            let partner = |(j, other): (usize, &Place)| {
                let square = (other.position - one.position).norm_squared();
                (j != i && square > APART * APART)
                    .then(|| ((spread(&self.own_covariance, i, j) + SESSION * SESSION) / square, j))
            };
            let mut partners: Vec<_> = self.own.iter().enumerate().filter_map(partner).collect();
            sort_by_key(&mut partners, |partner| partner.0);
            for (_, j) in partners.into_iter().take(PARTNERS) {
                if !bases.contains(&[j, i]) {
                    bases.push([i, j]);
                }
            }
        }
        bases
    }

    /// Adds the places where two own landmarks fit two of the map, the best of all in order.
    fn candidates(&self, i: usize, j: usize, best: &mut Vec<(f32, Pose<f32>, [usize; 2])>) {
        let (Some(first), Some(second)) = (self.own.get(i), self.own.get(j)) else { return };
        let side = second.position - first.position;
        let distance = side.norm();
        let own = spread(&self.own_covariance, i, j);
        for (a, one) in self.map.iter().enumerate().filter(|(_, one)| alike(first, one)) {
            for (b, other) in self.map.iter().enumerate() {
                let across = other.position - one.position;
                let off = across.norm() - distance;
                // Before anything that takes longer.
                if b == a || off.abs() > NEAR || !alike(second, other) {
                    continue;
                }
                let spread = own + spread(&self.map_covariance, a, b) + SESSION * SESSION;
                if off * off > GATE * spread {
                    continue;
                }
                let heading = atan2f(across.y, across.x) - atan2f(side.y, side.x);
                let turn = Pose::new(0.0, 0.0, heading);
                let middle =
                    (one.position + other.position - turn.transform(first.position + second.position)) * 0.5;
                let pose = Pose::new(middle.x, middle.y, heading);
                let turned = spread / (distance * distance);
                let (likelihood, _) = self.fit(&pose, [i, a], turned);
                if best.last().is_none_or(|(least, ..)| likelihood > *least) || best.len() < MOST {
                    let near = |known: &Pose<f32>| {
                        let between = known.inverse().compose(&pose);
                        between.position().norm() < 0.2 && between.heading.abs() < 0.05
                    };
                    match best.iter().position(|(_, known, _)| near(known)) {
                        Some(at) if best.get(at).is_some_and(|known| known.0 >= likelihood) => continue,
                        Some(at) => drop(best.remove(at)),
                        None => {}
                    }
                    let at = best.partition_point(|known| known.0 >= likelihood);
                    best.insert(at, (likelihood, pose, [i, a]));
                    best.truncate(MOST);
                }
            }
        }
    }

    /// ln L, and who is whose neighbour, where own landmark `first[0]` is the map's `first[1]` and the heading's variance is `turned`.
    fn fit(&self, pose: &Pose<f32>, first: [usize; 2], turned: f32) -> (f32, Vec<(usize, usize)>) {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        let mut likelihood = 0.0;
        let origin = self.own.get(first[0]).map_or_else(Vector2::zeros, |place| place.position);
        for (k, place) in self.own.iter().enumerate() {
            let at = pose.transform(place.position);
            let lever = (place.position - origin).norm_squared() * turned;
            let own = spread(&self.own_covariance, first[0], k) + SESSION * SESSION + lever;
            // By distance first: nearly all are too far, and whatever else is asked takes longer.
            let near = |(m, known): (usize, &Place)| {
                let square = (known.position - at).norm_squared();
                let free = || !pairs.iter().any(|(_, taken)| *taken == m);
                (square < NEAR * NEAR && alike(place, known) && free()).then_some((square, m))
            };
            let nearest = self.map.iter().enumerate().filter_map(near);
            let within = nearest.min_by(|one, other| one.0.total_cmp(&other.0)).and_then(|(square, m)| {
                let variance = own + spread(&self.map_covariance, first[1], m);
                (square <= GATE * variance).then_some((m, square, variance))
            });
            likelihood += match within {
                Some((m, square, variance)) => {
                    pairs.push((k, m));
                    // Never less than alone: a poor fit is none.
                    told(variance, square).max(logf(1.0 - KEPT))
                }
                None => logf(1.0 - KEPT),
            };
        }
        (likelihood, pairs)
    }

    /// The pose that fits the pairs best, with its evidence.
    fn refine(&self, pose: &Pose<f32>, first: [usize; 2]) -> Option<Registration> {
        const ROUNDS: usize = 3;
        let (mut pose, mut turned) = (*pose, 0.05 * 0.05);
        let mut fit = None;
        for _ in 0..ROUNDS {
            let (_, pairs) = self.fit(&pose, first, turned);
            let found = joint((self.own, self.map), &self.own_covariance, &self.map_covariance, pose, pairs)?;
            (pose, turned) = (found.pose, found.covariance.m33);
            fit = Some(found);
        }
        let Joint { pose, covariance, likelihood, pairs } = fit?;
        let place = sqrtf(PI * (covariance.m11 + covariance.m22).max(0.0));
        let told = 0.5 * likelihood - logf(DENSITY) * pairs.len() as f32 + kept(pairs.len(), self.own.len());
        let evidence = told + logf(place * DENSITY / (2.0 * self.map.len() as f32));
        Some(Registration { pose, covariance, pairs, evidence })
    }
}

impl Registration {
    /// Whether both are one place: they agree on most of who is who.
    fn is_as(&self, other: &Self) -> bool {
        let common = self.pairs.iter().filter(|pair| other.pairs.contains(pair)).count();
        2 * common > self.pairs.len().min(other.pairs.len())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// Corners of a corridor of 40 m: by chance along both walls, two to a door.
    fn corridor(seed: u32) -> Vec<Place> {
        let mut state = seed;
        let mut chance = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut places = Vec::new();
        for wall in [0, 1] {
            let mut x = chance();
            while x < 40.0 {
                for (jamb, looks) in [(0.0, 2 * wall), (0.9, 2 * wall + 1)] {
                    let position = Vector2::new(x + jamb, 2.0 * wall as f32);
                    places.push(Place { position, looks: Some(looks) });
                }
                x += 2.0 + 3.0 * chance();
            }
        }
        places
    }

    /// What of a map is seen from a place, each a little off.
    fn seen(map: &[Place], pose: &Pose<f32>, far: f32) -> Vec<Place> {
        let near = |place: &&Place| (place.position - pose.position()).norm() < far;
        let off = |k: usize| Vector2::new((k % 3) as f32 - 1.0, (k % 5) as f32 * 0.5 - 1.0) * 0.02;
        let seen = map.iter().filter(near).enumerate();
        seen.map(|(k, place)| Place { position: pose.inverse_transform(place.position) + off(k), ..*place })
            .collect()
    }

    const SPREAD: fn(usize, usize) -> Matrix2<f32> =
        |one, other| Matrix2::identity() * if one == other { 4e-4 } else { 0.0 };

    #[test]
    fn a_robot_finds_its_place_in_its_own_corridor_and_none_in_another() {
        let mut found = 0;
        for seed in 1..=20 {
            let map = corridor(seed);
            let pose = Pose::new(10.0 + seed as f32, 1.1, 0.4 * seed as f32);
            let own = seen(&map, &pose, 7.0);
            if let Some(place) = register(&own, SPREAD, &map, SPREAD) {
                let off = place.pose.inverse().compose(&pose);
                assert!(off.position().norm() < 0.05 && off.heading.abs() < 0.02, "{seed}: {off:?}");
                let sigma = place.covariance.diagonal().map(libm::sqrtf);
                assert!(sigma.max() < 0.05 && sigma.min() > 0.001, "{seed}: {sigma}");
                found += 1;
            }
            assert_eq!(register(&own, SPREAD, &corridor(seed + 100), SPREAD), None, "{seed}");
        }
        assert!(found >= 18, "{found} of 20");
    }

    #[test]
    fn doors_at_equal_distances_are_no_place() {
        let places = |count: u32| -> Vec<Place> {
            let jambs = (0..count).flat_map(|door| [0.0, 0.9].map(|jamb| 3.0 * door as f32 + jamb));
            jambs
                .flat_map(|x| [0.0, 2.0].map(|y| Place { position: Vector2::new(x, y), looks: None }))
                .collect()
        };
        let map = places(10);
        let own = seen(&map, &Pose::new(12.0, 1.0, 0.3), 5.0);
        assert!(own.len() >= 10);
        assert_eq!(register(&own, SPREAD, &map, SPREAD), None);
    }
}

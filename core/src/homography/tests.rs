extern crate std;

use super::*;
use crate::features::Keypoint;
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};
use proptest::prelude::*;
use std::vec;
use std::vec::Vec;

fn truth() -> Matrix3<f64> {
    Matrix3::new(0.95, -0.12, 40.0, 0.09, 1.02, -15.0, 2e-4, -1e-4, 1.0)
}

fn carry(m: &Matrix3<f64>, p: Vector2<f64>) -> Vector2<f64> {
    let q = m * p.push(1.0);
    q.xy() / q.z
}

/// `count` exact matches scattered over 640×480.
fn exact(count: usize) -> Vec<Match<f64>> {
    let place = |i: usize| Vector2::new((i * 197 % 640) as f64, (i * 331 % 480) as f64);
    (1..=count).map(|i| Match::new(place(i), carry(&truth(), place(i)), 0.1, 0.1)).collect()
}

fn outcome(matches: &[Match<f64>]) -> Result<HomographyEstimate<f64>, NoHomography> {
    let mut posteriors = vec![f64::NAN; matches.len()];
    let found = estimate_homography(&HomographyConfig::default(), matches, &mut posteriors);
    assert!(posteriors.iter().all(|p| (0.0..=1.0).contains(p)), "{posteriors:?}");
    if found.is_err() {
        assert!(posteriors.iter().all(|p| *p == 0.0));
    }
    found
}

#[test]
fn too_few_matches_say_so() {
    for count in 0..4 {
        assert_eq!(outcome(&exact(count)).unwrap_err(), NoHomography::TooFewMatches);
        assert_eq!(direct_linear_transform(&exact(count)).unwrap_err(), NoHomography::TooFewMatches);
    }
}

#[test]
fn too_little_room_for_posteriors_says_so() {
    let found = estimate_homography(&HomographyConfig::default(), &exact(9), &mut [0.0; 8]);
    assert_eq!(found.unwrap_err(), NoHomography::TooFewPosteriors);
}

#[test]
fn points_on_a_line_are_degenerate() {
    for slope in [0.0, 0.7, -3.0] {
        let line = |i: usize| Vector2::new(i as f64, slope * i as f64);
        let matches: Vec<_> = (0..50).map(|i| Match::new(line(7 * i), line(7 * i + 3), 0.1, 0.1)).collect();
        assert_eq!(outcome(&matches).unwrap_err(), NoHomography::Degenerate);
        assert_eq!(direct_linear_transform(&matches).unwrap_err(), NoHomography::Degenerate);
    }
}

#[test]
fn identical_points_are_degenerate() {
    let matches = [Match::new(Vector2::new(3.0, 4.0), Vector2::new(5.0, 6.0), 0.1, 0.1); 20];
    assert_eq!(outcome(&matches).unwrap_err(), NoHomography::Degenerate);
    let two: Vec<_> = (0..20).map(|i| exact(2)[i % 2]).collect();
    assert_eq!(outcome(&two).unwrap_err(), NoHomography::Degenerate);
}

#[test]
fn identical_pictures_give_the_identity() {
    let still: Vec<_> = exact(60).iter().map(|m| Match::new(m.from, m.from, 0.1, 0.1)).collect();
    let found = outcome(&still).unwrap();
    let identity = Matrix3::identity() / 3.0_f64.sqrt();
    assert!((found.homography.matrix() - identity).norm() < 1e-9);
}

#[test]
fn matches_that_agree_on_nothing_find_no_consensus() {
    let mut scattered = exact(100);
    for (i, pair) in scattered.iter_mut().enumerate() {
        pair.to = Vector2::new((i * i * 331 % 640) as f64, (i * i * i * 197 % 480) as f64);
    }
    assert_eq!(outcome(&scattered).unwrap_err(), NoHomography::NoConsensus);
}

#[test]
fn numbers_that_are_not_finite_say_so() {
    for bad in [f64::NAN, f64::INFINITY] {
        let mut matches = exact(20);
        matches[7].to.x = bad;
        assert_eq!(outcome(&matches).unwrap_err(), NoHomography::NotFinite);
    }
    let mut matches = exact(20);
    matches[3].to_cov = Matrix2::zeros();
    assert_eq!(outcome(&matches).unwrap_err(), NoHomography::NotFinite);
}

#[test]
fn same_seed_gives_the_same_bits() {
    let matches = exact(40);
    assert_eq!(outcome(&matches).unwrap(), outcome(&matches).unwrap());
}

#[test]
fn covariance_has_rank_8_and_no_part_along_m() {
    let found = outcome(&exact(40)).unwrap().homography;
    let along = found.covariance() * super::estimate::elements(found.matrix());
    assert!(along.norm() < 1e-12 * found.covariance().norm());
    assert!((found.covariance() - found.covariance().transpose()).norm() < 1e-15);
}

#[test]
fn point_behind_the_horizon_has_no_prediction() {
    let found = Homography::new(truth(), SMatrix::zeros()).unwrap();
    assert!(found.predict(Vector2::new(-6000.0, 0.0), &Matrix2::identity()).is_none());
}

#[test]
fn where_few_keypoints_match_they_must_agree_in_direction_and_size() {
    let matches = exact(9);
    let found = outcome(&matches).unwrap();
    let ends = |turn: f32, size: f32| {
        let keypoint = |pixel: Vector2<f64>, angle, scale| Keypoint {
            pixel: pixel.cast(),
            var_px2: 0.1,
            angle,
            scale,
            ..Keypoint::default()
        };
        let pair =
            |pair: &Match<f64>| [keypoint(pair.from, 0.3, 2.0), keypoint(pair.to, 0.3 + turn, 2.0 * size)];
        matches.iter().map(pair).collect::<Vec<_>>()
    };
    let confirmed = |turn, size, keypoints| found.is_confirmed_by(&matches, &ends(turn, size), keypoints);
    assert!(confirmed(0.0, 1.0, 500));
    assert!(!confirmed(1.6, 1.0, 500) && !confirmed(0.0, 2.5, 500) && !confirmed(0.0, 0.4, 500));
    assert!(confirmed(1.6, 1.0, 20), "nine of twenty are more than chance finds");
    let four = &matches[..4];
    assert!(!found.is_confirmed_by(four, &ends(0.0, 1.0)[..4], 4));
}

proptest! {
    #[test]
    fn four_exact_matches_are_met_exactly(shifts in prop::array::uniform8(-60.0..60.0_f64)) {
        let corners = [[0.0, 0.0], [640.0, 0.0], [640.0, 480.0], [0.0, 480.0]].map(Vector2::from);
        let mut matches = corners.map(|corner| Match::new(corner, corner, 0.1, 0.1));
        for (pair, shift) in matches.iter_mut().zip(shifts.chunks_exact(2)) {
            pair.to += Vector2::new(shift[0], shift[1]);
        }
        let robust = *outcome(&matches).unwrap().homography.matrix();
        let direct = direct_linear_transform(&matches).unwrap();
        for pair in &matches {
            prop_assert!((carry(&robust, pair.from) - pair.to).norm() < 1e-7);
            prop_assert!((carry(&direct, pair.from) - pair.to).norm() < 1e-7);
        }
    }

    #[test]
    fn jacobians_agree_with_central_differences(x in 0.0..640.0_f64, y in 0.0..480.0_f64) {
        let found = Homography::new(truth(), SMatrix::zeros()).unwrap();
        let (m, point, step) = (*found.matrix(), Vector2::new(x, y), 1e-6);
        let by_point = found.by_point(point).unwrap();
        for axis in 0..2 {
            let offset = Vector2::ith(axis, 1e-3);
            let slope = (carry(&m, point + offset) - carry(&m, point - offset)) / 2e-3;
            prop_assert!((by_point.column(axis) - slope).norm() < 1e-6);
        }
        let by_matrix = found.by_matrix(point).unwrap();
        for element in 0..9 {
            let mut offset = Matrix3::zeros();
            offset[(element / 3, element % 3)] = step * m.norm() * 1e-3;
            let slope = (carry(&(m + offset), point) - carry(&(m - offset), point)) / (2e-3 * step);
            let error = (by_matrix.column(element) - slope).norm();
            prop_assert!(error < 1e-4 * (1.0 + slope.norm()), "{element}: {error} of {}", slope.norm());
        }
    }

    #[test]
    fn nothing_panics_whatever_the_matches(numbers in prop::collection::vec(prop::num::f64::ANY, 0..80)) {
        let matches: Vec<_> = numbers
            .chunks_exact(4)
            .map(|n| Match::new(Vector2::new(n[0], n[1]), Vector2::new(n[2], n[3]), 0.1, 0.1))
            .collect();
        if let Ok(found) = outcome(&matches) {
            prop_assert!(found.homography.covariance().iter().all(|value| value.is_finite()));
        }
    }
}

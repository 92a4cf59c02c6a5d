use super::{Align, Alignment, Spread};
use crate::{Error, files::MapPoint, plausibility};
use nalgebra::Vector2;
use serde::Serialize;

/// Errors of a map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MapErrors {
    /// True landmarks.
    pub truth: usize,
    /// Landmarks of the estimated map.
    pub estimated: usize,
    /// Pairs of the two.
    pub matched: usize,
    /// Largest distance of a pair, m, where pairs were formed by distance.
    pub gate: Option<f64>,
    /// Estimated landmarks without a true one.
    pub spurious: usize,
    /// Distances of the pairs, m.
    pub position: Spread,
    /// Distances after the map's own best rotation and translation, m.
    pub aligned_position: Spread,
    /// Mean NEES of the pairs over 2 degrees of freedom, where the map has covariances and nothing was aligned.
    pub nees_per_dof: Option<f64>,
}

/// Which landmarks of two maps are the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MapPairing {
    /// The closest first, each landmark once, at most this far apart (m): the maps' numbers mean nothing to each
    /// other.
    Closest(f64),
    /// Those of the same number.
    Names,
}

/// The errors of an estimated map, moved by the alignment of its trajectory. A warning says where nothing was compared.
pub fn map_errors(
    estimate: &[MapPoint],
    truth: &[MapPoint],
    alignment: &Alignment,
    pairing: MapPairing,
) -> MapErrors {
    let moved: Vec<_> = estimate.iter().map(|point| alignment.point(point.position)).collect();
    let (pairs, gate) = match pairing {
        MapPairing::Closest(gate) => (closest_pairs(&moved, truth, gate), Some(gate)),
        MapPairing::Names => (pairs_by_name(estimate, truth), None),
    };
    let points: Vec<(Vector2<f64>, Vector2<f64>)> =
        pairs.iter().map(|&(i, j)| (moved[i], truth[j].position)).collect();
    let own = Alignment::fit(Align::Se2, &points);
    if pairs.is_empty() && !estimate.is_empty() && !truth.is_empty() {
        let (all, others) = (estimate.len(), truth.len());
        let cause = format!(
            "none of the map's {all} landmarks is one of the {others} true ones: its errors say nothing"
        );
        Error::new(cause)
            .help(match pairing {
                MapPairing::Names => "give the true landmarks under the names of the measurements",
                MapPairing::Closest(_) => "check that both are in metres and in one frame",
            })
            .warn();
    } else if alignment.scale == 1.0 {
        plausibility::check_scale("map", &points);
    }
    let nees = pairs.iter().filter_map(|&(i, j)| {
        let covariance = alignment.covariance(&estimate[i].covariance?);
        let error = moved[i] - truth[j].position;
        Some(error.dot(&covariance.cholesky()?.solve(&error)))
    });
    let nees: Vec<f64> = if *alignment == Alignment::NONE { nees.collect() } else { Vec::new() };
    MapErrors {
        truth: truth.len(),
        estimated: estimate.len(),
        matched: pairs.len(),
        gate,
        spurious: estimate.len() - pairs.len(),
        position: Spread::of(points.iter().map(|(p, q)| (p - q).norm())),
        aligned_position: Spread::of(points.iter().map(|(p, q)| (own.point(*p) - q).norm())),
        nees_per_dof: (!nees.is_empty()).then(|| nees.iter().sum::<f64>() / (2 * nees.len()) as f64),
    }
}

fn pairs_by_name(estimate: &[MapPoint], truth: &[MapPoint]) -> Vec<(usize, usize)> {
    let place = |id| truth.iter().position(|point| point.id == id);
    estimate.iter().enumerate().filter_map(|(i, point)| Some((i, place(point.id)?))).collect()
}

fn closest_pairs(estimate: &[Vector2<f64>], truth: &[MapPoint], gate: f64) -> Vec<(usize, usize)> {
    let mut candidates = Vec::new();
    for (i, point) in estimate.iter().enumerate() {
        for (j, other) in truth.iter().enumerate() {
            let distance = (point - other.position).norm();
            if distance <= gate {
                candidates.push((distance, i, j));
            }
        }
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut taken, mut taken_truth) = (vec![false; estimate.len()], vec![false; truth.len()]);
    candidates.retain(|&(_, i, j)| {
        let free = !taken[i] && !taken_truth[j];
        if free {
            (taken[i], taken_truth[j]) = (true, true);
        }
        free
    });
    candidates.into_iter().map(|(_, i, j)| (i, j)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    fn point(x: f64, y: f64) -> MapPoint {
        let covariance = Some(Matrix2::identity() * 0.01);
        MapPoint { id: 0, position: Vector2::new(x, y), covariance, seen: 1, first_and_last: None }
    }

    #[test]
    fn every_landmark_is_paired_once_with_its_nearest() {
        let truth = [point(0.0, 0.0), point(1.0, 0.0), point(9.0, 9.0)];
        let estimate = [point(0.1, 0.0), point(0.3, 0.0), point(1.1, 0.0), point(5.0, 5.0)];
        let errors = map_errors(&estimate, &truth, &Alignment::NONE, MapPairing::Closest(0.5));
        assert_eq!((errors.matched, errors.spurious, errors.estimated, errors.truth), (2, 2, 4, 3));
        assert!((errors.position.rms - 0.1).abs() < 1e-12 && errors.aligned_position.max < 1e-12);
        assert!((errors.nees_per_dof.unwrap() - 0.5).abs() < 1e-12);
    }
}

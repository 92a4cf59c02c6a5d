use monorange_core::geometry::Pose;
use nalgebra::{Matrix2, Rotation2, Vector2};
use serde::Serialize;

/// What may be fitted before errors are measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Align {
    /// Nothing: both are in the same frame.
    #[default]
    None,
    /// A rotation and a translation.
    Se2,
    /// A rotation, a translation and a scale.
    Sim2,
}

/// The transform `truth_from_estimate`: q = scale · R(rotation) p + translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Alignment {
    /// Factor, 1 unless it was fitted.
    pub scale: f64,
    /// Radians.
    pub rotation: f64,
    /// Metres.
    pub translation: Vector2<f64>,
}

impl Alignment {
    /// The transform that changes nothing.
    pub const NONE: Self = Self { scale: 1.0, rotation: 0.0, translation: Vector2::new(0.0, 0.0) };

    /// The least-squares fit of (estimate, truth) points (S. Umeyama, 1991, in the plane): with centred points
    /// p̃, q̃ the rotation is atan2(Σ p̃ × q̃, Σ p̃ · q̃), the scale Σ q̃ · R p̃ / Σ p̃ · p̃. Points that all coincide
    /// fix neither, and leave them at 0 and 1.
    pub fn fit(kind: Align, points: &[(Vector2<f64>, Vector2<f64>)]) -> Self {
        if kind == Align::None || points.is_empty() {
            return Self::NONE;
        }
        let count = points.len() as f64;
        let (sum_p, sum_q) =
            points.iter().fold((Vector2::zeros(), Vector2::zeros()), |(a, b), (p, q)| (a + p, b + q));
        let (mean_p, mean_q): (Vector2<f64>, Vector2<f64>) = (sum_p / count, sum_q / count);
        let (mut along, mut across, mut spread) = (0.0, 0.0, 0.0);
        for (p, q) in points {
            let (p, q) = (p - mean_p, q - mean_q);
            along += p.dot(&q);
            across += p.perp(&q);
            spread += p.norm_squared();
        }
        let rotation = libm::atan2(across, along);
        let scale =
            if kind == Align::Sim2 && spread > 0.0 { libm::hypot(along, across) / spread } else { 1.0 };
        let translation = mean_q - Rotation2::new(rotation) * mean_p * scale;
        Self { scale, rotation, translation }
    }

    /// The point in the truth's frame.
    pub fn point(&self, point: Vector2<f64>) -> Vector2<f64> {
        Rotation2::new(self.rotation) * point * self.scale + self.translation
    }

    /// The pose in the truth's frame.
    pub fn pose(&self, pose: &Pose<f64>) -> Pose<f64> {
        let position = self.point(pose.position());
        Pose::new(position.x, position.y, pose.heading + self.rotation)
    }

    /// The covariance of a point in the truth's frame.
    pub fn covariance(&self, covariance: &Matrix2<f64>) -> Matrix2<f64> {
        let rotation = Rotation2::new(self.rotation);
        rotation.matrix() * covariance * rotation.matrix().transpose() * (self.scale * self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_similarity_is_recovered(scale in 0.1..10.0, rotation in -3.1..3.1, x in -50.0..50.0, y in -50.0..50.0) {
            let truth = Alignment { scale, rotation, translation: Vector2::new(x, y) };
            let points = [(0.0, 0.0), (3.0, 1.0), (-2.0, 5.0), (4.0, -4.0)].map(|(x, y)| Vector2::new(x, y));
            let pairs = points.map(|p| (p, truth.point(p)));
            let fitted = Alignment::fit(Align::Sim2, &pairs);
            prop_assert!((fitted.scale - scale).abs() < 1e-9 && (fitted.rotation - rotation).abs() < 1e-9);
            prop_assert!((fitted.translation - truth.translation).norm() < 1e-8);
            prop_assert_eq!(Alignment::fit(Align::Se2, &pairs).scale, 1.0);
        }
    }
}

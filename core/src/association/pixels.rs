//! Association in pixels: the paper's (10) and (11), corrected.
//!
//! ```text
//! p̂ = M p_m                                    a stored corner carried into the new picture            (10)
//! S = J_M Σ_M J_Mᵀ + M' Σ_m M'ᵀ + Σ_f          both corners' covariances and the homography's
//! d_m = (p_f − p̂)ᵀ S⁻¹ (p_f − p̂) ~ χ²(2)       paired within the gate, each corner at most once         (11)
//! ```
//!
//! | symbol | in code | shape, unit |
//! |---|---|---|
//! | p_m, Σ_m | [`Remembered::pixel`], [`Remembered::covariance`] | px, px², in the keyframe |
//! | M, Σ_M | a [`Homography`] of **rays**, keyframe → picture | 3×3, 9×9 |
//! | p_f, Σ_f | [`Corner`] | px, px² |
//! | d_m | [`PixelPairing::distance2`] | – |
//!
//! The homography carries rays, not pixels, so that a lens with distortion is honoured: pixels are undistorted
//! before and distorted after, with their Jacobians. Which homography: corners lie on the floor, and in a corridor
//! the dominant plane may be a wall, so the floor-induced one comes first, then the free one; with neither, the map
//! associates ([`choose_carrier`]).
//!
//! Cost: one pass over landmarks × corners, at most [`MAX_CANDIDATES`] pairs; a report says how many more there were.
use super::{Candidate, MAX_CANDIDATES, exclusive_nearest, normalised_square};
use crate::Real;
use crate::geometry::Camera;
use crate::homography::{GroundMotion, Homography, HomographyEstimate, PredictedPoint};
use nalgebra::{Matrix2, Vector2};

/// What carries a landmark's corner from one picture to the next: as a setting, and as what was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Carrier {
    /// No homography: corners are associated in the map, on every target alike.
    #[default]
    Map,
    /// The homography that the floor induces, from the robot's step; as a setting, the free one where that fails.
    Floor,
    /// The free homography of eight parameters, the paper's.
    Free,
}

crate::setting::choices!(Carrier { "map" => Map, "floor" => Floor, "free" => Free });

/// A corner detected in the new picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner<T> {
    /// p_f.
    pub pixel: Vector2<T>,
    /// Σ_f.
    pub covariance: Matrix2<T>,
}

/// A landmark's corner as the keyframe sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remembered<T> {
    /// The landmark's id in the map.
    pub landmark: u32,
    /// p_m.
    pub pixel: Vector2<T>,
    /// Σ_m.
    pub covariance: Matrix2<T>,
}

/// A landmark and the corner that is its.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelPairing<T> {
    /// The landmark's id.
    pub landmark: u32,
    /// Index of the corner.
    pub corner: usize,
    /// d_m.
    pub distance2: T,
    /// p̂, and its covariance before Σ_f is added: the ellipse to draw.
    pub predicted: PredictedPoint<T>,
}

/// How an association in pixels went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelReport {
    /// Landmarks that were carried into the picture.
    pub predicted: usize,
    /// Pairs beyond the capacity, which were not considered.
    pub dropped: usize,
}

/// The homography to carry corners with, if any is good enough: the floor's where at least `least` matches lie on
/// it, else the free one where at least `least` agree with it.
pub fn choose_carrier<'a, T: Real>(
    floor: Option<&'a GroundMotion<T>>,
    free: Option<&'a HomographyEstimate<T>>,
    least: T,
) -> (Carrier, Option<&'a Homography<T>>) {
    if let Some(motion) = floor.filter(|motion| motion.floor >= least) {
        return (Carrier::Floor, Some(&motion.floor_homography));
    }
    if let Some(estimate) = free.filter(|estimate| estimate.inliers >= least) {
        return (Carrier::Free, Some(&estimate.homography));
    }
    (Carrier::Map, None)
}

/// The pixel that a homography of rays carries a pixel to, with its covariance; `None` outside the lens model or
/// behind the plane's horizon.
pub fn carry_pixel<T: Real>(
    camera: &Camera<T>,
    homography: &Homography<T>,
    pixel: Vector2<T>,
    covariance: &Matrix2<T>,
) -> Option<PredictedPoint<T>> {
    let ray = camera.ray_from_pixel(pixel)?;
    let by_pixel = camera.ray_by_pixel(ray)?;
    let carried = homography.predict(ray, &(by_pixel * covariance * by_pixel.transpose()))?;
    let by_ray = camera.pixel_by_ray(carried.point);
    let point = camera.pixel_from_ray(carried.point)?;
    Some(PredictedPoint { point, covariance: by_ray * carried.covariance * by_ray.transpose() })
}

/// What the keyframe remembers of at most `N` landmarks.
#[derive(Clone, Debug, Default)]
pub struct PixelMemory<T, const N: usize> {
    remembered: heapless::Vec<Remembered<T>, N>,
}

impl<T: Real, const N: usize> PixelMemory<T, N> {
    /// A memory of nothing.
    pub const fn new() -> Self {
        Self { remembered: heapless::Vec::new() }
    }

    /// What is remembered.
    pub fn remembered(&self) -> &[Remembered<T>] {
        &self.remembered
    }

    /// Takes a landmark's corner in the keyframe; whether there was room.
    pub fn remember(&mut self, corner: Remembered<T>) -> bool {
        let known = self.remembered.iter_mut().find(|known| known.landmark == corner.landmark);
        match known {
            Some(known) => {
                *known = corner;
                true
            }
            None => self.remembered.push(corner).is_ok(),
        }
    }

    /// Calls every landmark by what `name` says, and drops it where that is nothing.
    pub fn rename(&mut self, name: impl Fn(u32) -> Option<u32>) {
        self.remembered.retain_mut(|corner| match name(corner.landmark) {
            Some(name) => {
                corner.landmark = name;
                true
            }
            None => false,
        });
    }

    /// Drops every landmark that `keep` does not name.
    pub fn retain(&mut self, mut keep: impl FnMut(u32) -> bool) {
        self.remembered.retain(|corner| keep(corner.landmark));
    }

    /// Makes the new picture the keyframe: every corner is carried there, with the covariance that this costs, so
    /// that a landmark last seen some keyframes ago is still predicted. One that leaves the picture by more than
    /// half its width is forgotten.
    pub fn carry(&mut self, camera: &Camera<T>, homography: &Homography<T>) {
        let width = T::lit(camera.width() as f64);
        let centre = Vector2::new(width, T::lit(camera.height() as f64)) * T::lit(0.5);
        self.remembered.retain_mut(|corner| {
            let carried = carry_pixel(camera, homography, corner.pixel, &corner.covariance);
            let near = carried.filter(|carried| (carried.point - centre).amax() < width);
            if let Some(PredictedPoint { point, covariance }) = near {
                (corner.pixel, corner.covariance) = (point, covariance);
            }
            near.is_some()
        });
    }

    /// The pairs of landmark and corner within the `gate` (of χ²(2): 9.21 keeps 99 %), each landmark and corner at
    /// most once, the likeliest first.
    pub fn associate(
        &self,
        camera: &Camera<T>,
        homography: &Homography<T>,
        corners: &[Corner<T>],
        gate: T,
        pairings: &mut heapless::Vec<PixelPairing<T>, MAX_CANDIDATES>,
    ) -> PixelReport {
        pairings.clear();
        let mut report = PixelReport::default();
        let mut candidates = heapless::Vec::<Candidate<T>, MAX_CANDIDATES>::new();
        for (landmark, known) in self.remembered.iter().enumerate() {
            let Some(predicted) = carry_pixel(camera, homography, known.pixel, &known.covariance) else {
                continue;
            };
            report.predicted += 1;
            for (observation, corner) in corners.iter().enumerate() {
                let spread = predicted.covariance + corner.covariance;
                let innovation = corner.pixel - predicted.point;
                let Some(distance2) = normalised_square(&innovation, &spread) else { continue };
                if distance2 > gate {
                    continue;
                }
                let cost = distance2 + spread.determinant().ln();
                let candidate = Candidate { observation, landmark, cost, nis: distance2, dof: 2 };
                report.dropped += usize::from(candidates.push(candidate).is_err());
            }
        }
        exclusive_nearest(&mut candidates);
        for candidate in &candidates {
            let (known, corner) =
                (self.remembered.get(candidate.landmark), corners.get(candidate.observation));
            let (Some(known), Some(corner)) = (known, corner) else { continue };
            let carried = carry_pixel(camera, homography, known.pixel, &known.covariance);
            let Some(predicted) = carried else { continue };
            let spread = predicted.covariance + corner.covariance;
            let distance2 = normalised_square(&(corner.pixel - predicted.point), &spread);
            let Some(distance2) = distance2 else { continue };
            let pairing = PixelPairing {
                landmark: known.landmark,
                corner: candidate.observation,
                distance2,
                predicted,
            };
            report.dropped += usize::from(pairings.push(pairing).is_err());
        }
        report
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, SMatrix};

    fn camera() -> Camera<f64> {
        let lens = crate::geometry::Distortion { k1: -0.2, ..Default::default() };
        Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, lens).unwrap()
    }

    /// Rays shift by 0.1: some 36 pixels.
    fn shift(variance: f64) -> Homography<f64> {
        let matrix = Matrix3::new(1.0, 0.0, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        Homography::new(matrix, SMatrix::identity() * variance).unwrap()
    }

    fn memory() -> PixelMemory<f64, 4> {
        let mut memory = PixelMemory::new();
        for (landmark, u) in [(7, 60.0), (9, 100.0)] {
            let pixel = Vector2::new(u, 200.0);
            assert!(memory.remember(Remembered { landmark, pixel, covariance: Matrix2::identity() * 0.04 }));
        }
        memory
    }

    fn corners(offset: f64) -> [Corner<f64>; 3] {
        let seen = |u: f64| {
            let carried = carry_pixel(&camera(), &shift(0.0), Vector2::new(u, 200.0), &Matrix2::zeros());
            Corner {
                pixel: carried.unwrap().point + Vector2::new(offset, 0.0),
                covariance: Matrix2::identity() * 0.04,
            }
        };
        [seen(100.0), seen(250.0), seen(60.0)]
    }

    #[test]
    fn carried_corners_find_their_own() {
        let mut pairings = heapless::Vec::new();
        let report = memory().associate(&camera(), &shift(1e-8), &corners(0.2), 9.21, &mut pairings);
        assert_eq!(report, PixelReport { predicted: 2, dropped: 0 });
        let mut pairs = [(0, 0); 2];
        for (pair, pairing) in pairs.iter_mut().zip(&pairings) {
            *pair = (pairing.landmark, pairing.corner);
            assert!(pairing.distance2 < 1.0);
        }
        pairs.sort_unstable();
        assert_eq!(pairs, [(7, 2), (9, 0)]);
    }

    #[test]
    fn corners_beyond_the_gate_stay_alone() {
        let mut pairings = heapless::Vec::new();
        memory().associate(&camera(), &shift(1e-8), &corners(3.0), 9.21, &mut pairings);
        assert!(pairings.is_empty());
    }

    #[test]
    fn uncertainty_of_the_homography_widens_the_gate() {
        let mut pairings = heapless::Vec::new();
        memory().associate(&camera(), &shift(1e-4), &corners(3.0), 9.21, &mut pairings);
        assert_eq!(pairings.len(), 2);
    }

    #[test]
    fn memory_carried_to_a_new_keyframe_predicts_from_there() {
        let (mut memory, camera) = (memory(), camera());
        let before = memory.remembered()[0];
        memory.carry(&camera, &shift(1e-8));
        let there = carry_pixel(&camera, &shift(1e-8), before.pixel, &before.covariance).unwrap();
        assert_eq!(memory.remembered()[0].pixel, there.point);
        assert!(memory.remembered()[0].covariance.trace() > 0.9 * before.covariance.trace());
        for _ in 0..30 {
            memory.carry(&camera, &shift(1e-8));
        }
        assert!(memory.remembered().is_empty());
    }

    #[test]
    fn full_memory_says_so() {
        let mut memory = PixelMemory::<f64, 1>::new();
        let corner =
            |landmark| Remembered { landmark, pixel: Vector2::zeros(), covariance: Matrix2::identity() };
        assert!(memory.remember(corner(1)) && memory.remember(corner(1)) && !memory.remember(corner(2)));
    }

    #[test]
    fn without_a_homography_the_map_associates() {
        assert_eq!(choose_carrier::<f64>(None, None, 10.0), (Carrier::Map, None));
    }
}

//! The step over the floor under which the textures of two pictures agree best.
use super::FloorTexture;
use super::contrast::Contrast;
use crate::geometry::{Camera, RangeFinder};
use crate::homography::planar::{PlanarRig, PlanarStep};
use crate::sort::sort_by_key;
use alloc::vec::Vec;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Steps that are tried, in heights of the camera: what a robot drives between two pictures at most, backwards and forwards.
const REACH: [f32; 2] = [-0.4, 1.3];
/// Between two steps that are tried, in heights of the camera and rad: about a pixel of the coarse picture.
const APART: [f32; 2] = [0.02, 0.3 * core::f32::consts::PI / 180.0];
/// Turns are tried as far to each side at least, and at most, rad.
const TURNS: [f32; 2] = [0.016, 0.35];
/// Beyond this range, in heights of the camera, a pixel covers too much of the floor.
const FAR: f32 = 6.5;
/// Standard deviations by which the textures agree better than by chance at least, and by how much more likely a step is than any
/// elsewhere, in natural logarithms.
const BEYOND_CHANCE: f32 = 8.0;
const BEYOND_OTHERS: f32 = 50.0;
/// Elsewhere: as many steps apart.
const ELSEWHERE: f32 = 4.0;
/// Steps of the coarse picture that the fine one decides between.
const TOPS: usize = 6;
/// Those of them that are followed to the top.
const FINALISTS: usize = 3;
/// Quarters of a step that are scanned to each side.
const SCANNED: i32 = 6;
/// Points at most that a step is tried on: in the coarse picture, in the fine one, and to decide.
const POINTS: [usize; 3] = [800, 1000, 6000];

/// A point of the floor in the first picture.
struct Sample {
    ray: Vector3<f32>,
    contrast: f32,
}

/// What a step is tried on.
struct Trial<'a> {
    rig: &'a PlanarRig<f32>,
    samples: Vec<Sample>,
    /// The second picture's contrast along a ray.
    second: &'a dyn Fn(Vector2<f32>) -> Option<f32>,
}

impl Trial<'_> {
    /// By how many standard deviations the textures agree better than by chance, when the robot went along this arc.
    fn agreement(&self, arc: Vector2<f32>) -> f32 {
        let homography = floor_homography(self.rig, arc);
        let (mut product, mut first, mut second, mut count) = (0.0, 0.0, 0.0, 0.0);
        for Sample { ray, contrast } in &self.samples {
            let seen = homography * ray;
            let near = 1.0 / seen.z;
            let Some(other) =
                (self.second)(Vector2::new(seen.x * near, seen.y * near)).filter(|_| near > 0.0)
            else {
                continue;
            };
            product += contrast * other;
            first += contrast * contrast;
            second += other * other;
            count += 1.0;
        }
        let enough = count * 4.0 > self.samples.len() as f32 && first * second > 0.0;
        if enough { product / libm::sqrtf(first * second) * libm::sqrtf(count) } else { 0.0 }
    }

    /// The best of the steps round this one, ever nearer.
    fn climb(&self, mut best: Vector2<f32>, mut apart: Vector2<f32>, rounds: usize) -> (Vector2<f32>, f32) {
        let mut highest = self.agreement(best);
        for _ in 0..rounds {
            let centre = best;
            for (path, turn) in [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)] {
                let tried = centre + Vector2::new(path as f32, turn as f32).component_mul(&apart);
                let agreement = self.agreement(tried);
                if agreement > highest {
                    (highest, best) = (agreement, tried);
                }
            }
            apart *= 0.5;
        }
        (best, highest)
    }
}

/// H of rays on the floor, for a step along an arc.
pub(super) fn floor_homography(rig: &PlanarRig<f32>, arc: Vector2<f32>) -> Matrix3<f32> {
    rig.view(&PlanarStep::new(arc.x, 0.0, arc.y)).homography()
}

/// Whether a ray meets the floor near enough.
pub(super) fn near_floor(rig: &PlanarRig<f32>, ray: Vector2<f32>) -> bool {
    rig.floor_from_ray(ray).is_some_and(|point| point.norm() < FAR * rig.height)
}

/// Path and turn from the first picture to the second, where their textures say so: turns are tried round `turn` as far as `spread`.
pub(super) fn search(
    finder: &RangeFinder<f32>,
    rig: &PlanarRig<f32>,
    [from, to]: [&FloorTexture; 2],
    turn: f32,
    spread: f32,
) -> Option<Vector2<f32>> {
    let coarse = Trial {
        rig,
        samples: from.coarse_samples(rig, POINTS[0]),
        second: &|ray| to.coarse.nearest(to.cell(ray)),
    };
    let apart = Vector2::new(APART[0] * rig.height, APART[1]);
    let widest = spread.clamp(TURNS[0], TURNS[1]);
    // Far turns in steps twice as large: the climb finds what is between.
    let apart = if widest > 4.0 * TURNS[0] { apart * 2.0 } else { apart };
    let [back, ahead] = REACH.map(|reach| (reach * rig.height / apart.x) as i32);
    let side = (widest / apart.y) as i32;
    let tried = |path: i32, side: i32| Vector2::new(path as f32 * apart.x, turn + side as f32 * apart.y);
    let steps = (-side..=side).flat_map(|side| (back..=ahead).map(move |path| (path, side)));
    let scored: Vec<_> =
        steps.map(|(path, side)| tried(path, side)).map(|arc| (arc, coarse.agreement(arc))).collect();
    let elsewhere = |a: &Vector2<f32>, b: &Vector2<f32>| (a - b).component_div(&apart).amax() > ELSEWHERE;
    let mut tops: Vec<Vector2<f32>> = Vec::new();
    while tops.len() < TOPS {
        let others = scored.iter().filter(|(arc, _)| tops.iter().all(|top| elsewhere(top, arc)));
        let Some((arc, _)) = best_of(others.copied()) else { break };
        tops.push(arc);
    }
    let camera = finder.camera();
    let second = &|ray: Vector2<f32>| camera.pixel_from_ray(ray).and_then(|pixel| to.fine.between(pixel));
    let fine = Trial { rig, samples: from.fine_samples(camera, rig, POINTS[1]), second };
    let whole = Trial { rig, samples: from.fine_samples(camera, rig, POINTS[2]), second };
    let mut scanned: Vec<_> = tops
        .iter()
        .map(|top| {
            let (start, _) = coarse.climb(*top, apart * 0.5, 1);
            // Along a floor of boards many steps look much alike.
            let along =
                (-SCANNED..=SCANNED).map(|side| start + Vector2::new(side as f32 * apart.x * 0.25, 0.0));
            best_of(along.map(|arc| (arc, fine.agreement(arc)))).unwrap_or((start, 0.0))
        })
        .collect();
    sort_by_key(&mut scanned, |(_, agreement)| -agreement);
    let nearest = Vector2::new(apart.x * 0.125, apart.y * 0.5);
    let climbed = scanned.iter().take(FINALISTS).map(|(start, _)| fine.climb(*start, nearest, 3).0);
    let climbed: Vec<_> = climbed.map(|arc| (arc, whole.agreement(arc))).collect();
    let (best, highest) = best_of(climbed.iter().copied())?;
    let other = climbed
        .iter()
        .filter(|(arc, _)| elsewhere(arc, &best))
        .fold(0.0, |most: f32, (_, score)| most.max(*score));
    let stands_out = highest > BEYOND_CHANCE && (highest * highest - other * other) * 0.5 > BEYOND_OTHERS;
    stands_out.then_some(best)
}

/// The step whose textures agree best.
fn best_of(steps: impl Iterator<Item = (Vector2<f32>, f32)>) -> Option<(Vector2<f32>, f32)> {
    steps.reduce(|best, tried| if tried.1 > best.1 { tried } else { best })
}

impl FloorTexture {
    fn cell(&self, ray: Vector2<f32>) -> Vector2<f32> {
        (ray - self.first) * super::COARSE_FOCAL
    }

    fn coarse_samples(&self, rig: &PlanarRig<f32>, most: usize) -> Vec<Sample> {
        samples(&self.coarse, most, |cell| {
            let ray = self.first + cell / super::COARSE_FOCAL;
            near_floor(rig, ray).then_some(ray)
        })
    }

    fn fine_samples(&self, camera: &Camera<f32>, rig: &PlanarRig<f32>, most: usize) -> Vec<Sample> {
        samples(&self.fine, most, |pixel| camera.ray_from_pixel(pixel).filter(|ray| near_floor(rig, *ray)))
    }
}

/// Pixels on a grid that have a ray: so far apart that there are no more than `most` of them in a picture half full of floor.
fn samples(
    contrast: &Contrast,
    most: usize,
    ray: impl Fn(Vector2<f32>) -> Option<Vector2<f32>>,
) -> Vec<Sample> {
    let pixels = contrast.width() * contrast.height();
    let stride = libm::ceilf(libm::sqrtf(pixels as f32 / (2 * most) as f32)) as usize;
    let rows = (0..contrast.height()).step_by(stride);
    let pixels = rows
        .flat_map(|v| (0..contrast.width()).step_by(stride).map(move |u| Vector2::new(u as f32, v as f32)));
    let sample = |pixel| Some(Sample { ray: ray(pixel)?.push(1.0), contrast: contrast.nearest(pixel)? });
    pixels.filter_map(sample).collect()
}

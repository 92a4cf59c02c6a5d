//! The step over the floor under which the textures of two pictures agree best.
use super::FloorTexture;
use super::coarse::Points;
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
#[derive(Clone, Copy)]
struct Sample {
    ray: Vector3<f32>,
    contrast: f32,
}

/// By how many standard deviations the two contrasts of points agree better than by chance, where a quarter of so many is seen twice.
fn agreement(points: usize, contrasts: impl Iterator<Item = [f32; 2]>) -> f32 {
    let (mut product, mut first, mut second, mut count) = (0.0, 0.0, 0.0, 0.0);
    for [contrast, other] in contrasts {
        product += contrast * other;
        first += contrast * contrast;
        second += other * other;
        count += 1.0;
    }
    let enough = count * 4.0 > points as f32 && first * second > 0.0;
    if enough { product / libm::sqrtf(first * second) * libm::sqrtf(count) } else { 0.0 }
}

/// As [`agreement`], of the textures when the robot went along this arc.
fn of_step(
    rig: &PlanarRig<f32>,
    arc: Vector2<f32>,
    samples: &[Sample],
    second: impl Fn(Vector2<f32>) -> Option<f32>,
) -> f32 {
    let homography = floor_homography(rig, arc);
    let contrasts = samples.iter().filter_map(|Sample { ray, contrast }| {
        let seen = homography * ray;
        let near = 1.0 / seen.z;
        let other = second(Vector2::new(seen.x * near, seen.y * near)).filter(|_| near > 0.0)?;
        Some([*contrast, other])
    });
    agreement(samples.len(), contrasts)
}

/// The best of the steps round this one, ever nearer.
fn climb(
    agreement: &mut dyn FnMut(Vector2<f32>) -> f32,
    mut best: Vector2<f32>,
    mut apart: Vector2<f32>,
    rounds: usize,
) -> Vector2<f32> {
    let mut highest = agreement(best);
    for _ in 0..rounds {
        let centre = best;
        for (path, turn) in [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)] {
            let tried = centre + Vector2::new(path as f32, turn as f32).component_mul(&apart);
            let agreement = agreement(tried);
            if agreement > highest {
                (highest, best) = (agreement, tried);
            }
        }
        apart *= 0.5;
    }
    best
}

/// Where the second picture has the points after steps about one: there, and by how much a reach of path and of turn changes that, the path's
/// to the second order.
struct Nearby {
    centre: Vector2<f32>,
    reach: Vector2<f32>,
    points: Vec<([Vector2<f32>; 4], f32)>,
}

impl Nearby {
    #[inline(never)]
    fn of(
        rig: &PlanarRig<f32>,
        centre: Vector2<f32>,
        reach: Vector2<f32>,
        samples: &[Sample],
        cell: impl Fn(Vector2<f32>) -> Option<Vector2<f32>>,
    ) -> Self {
        let at = |path: f32, turn: f32| {
            floor_homography(rig, centre + Vector2::new(path, turn).component_mul(&reach))
        };
        let tried = [at(0.0, 0.0), at(1.0, 0.0), at(-1.0, 0.0), at(0.0, 1.0)];
        let points = samples.iter().filter_map(|Sample { ray, contrast }| {
            let seen = |homography: &Matrix3<f32>| {
                let seen = homography * ray;
                (seen.z > 0.0).then(|| cell(seen.xy() / seen.z))?
            };
            let [middle, ahead, back, turned] = tried.each_ref().map(seen);
            let (middle, ahead, back) = (middle?, ahead?, back?);
            let bend = (ahead + back) * 0.5 - middle;
            Some(([middle, (ahead - back) * 0.5, bend, turned? - middle], *contrast))
        });
        Self { centre, reach, points: points.collect() }
    }

    #[inline(never)]
    fn agreement(&self, arc: Vector2<f32>, points: usize, second: &Contrast) -> f32 {
        let by = (arc - self.centre).component_div(&self.reach);
        let contrasts = self.points.iter().filter_map(|([middle, path, bend, turn], contrast)| {
            let seen = middle + path * by.x + bend * (by.x * by.x) + turn * by.y;
            Some([*contrast, second.between(seen)?])
        });
        agreement(points, contrasts)
    }
}

/// H of rays on the floor, for a step along an arc.
#[inline(never)]
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
    let mut coarse = from.coarse_points(rig, POINTS[0]);
    let mut coarsely = |arc| coarse.agreement(&(to.cell_from_ray() * floor_homography(rig, arc)), &to.coarse);
    let apart = Vector2::new(APART[0] * rig.height, APART[1]);
    let widest = spread.clamp(TURNS[0], TURNS[1]);
    // Far turns in steps twice as large: the climb finds what is between.
    let apart = if widest > 4.0 * TURNS[0] { apart * 2.0 } else { apart };
    let [back, ahead] = REACH.map(|reach| (reach * rig.height / apart.x) as i32);
    let side = (widest / apart.y) as i32;
    let tried = |path: i32, side: i32| Vector2::new(path as f32 * apart.x, turn + side as f32 * apart.y);
    let steps = (-side..=side).flat_map(|side| (back..=ahead).map(move |path| (path, side)));
    let scored: Vec<_> =
        steps.map(|(path, side)| tried(path, side)).map(|arc| (arc, coarsely(arc))).collect();
    let elsewhere = |a: &Vector2<f32>, b: &Vector2<f32>| (a - b).component_div(&apart).amax() > ELSEWHERE;
    let mut tops: Vec<Vector2<f32>> = Vec::new();
    while tops.len() < TOPS {
        let others = scored.iter().filter(|(arc, _)| tops.iter().all(|top| elsewhere(top, arc)));
        let Some((arc, _)) = best_of(others.copied()) else { break };
        tops.push(arc);
    }
    let camera = finder.camera();
    let cell = |ray| camera.pixel_from_ray(ray).map(|pixel| to.fine_cell(pixel));
    let [few, many] = [POINTS[1], POINTS[2]].map(|most| from.fine_samples(camera, rig, most));
    let quarter = apart.x * 0.25;
    let mut scanned: Vec<_> = tops
        .iter()
        .map(|top| {
            let start = climb(&mut coarsely, *top, apart * 0.5, 1);
            // Along a floor of boards many steps look much alike.
            let reach = Vector2::new(SCANNED as f32 * quarter, apart.y);
            let nearby = Nearby::of(rig, start, reach, &few, cell);
            let along = (-SCANNED..=SCANNED).map(|side| start + Vector2::new(side as f32 * quarter, 0.0));
            best_of(along.map(|arc| (arc, nearby.agreement(arc, few.len(), &to.fine))))
                .unwrap_or((start, 0.0))
        })
        .collect();
    sort_by_key(&mut scanned, |(_, agreement)| -agreement);
    let nearest = Vector2::new(apart.x * 0.125, apart.y * 0.5);
    let climbed = scanned.iter().take(FINALISTS).map(|(start, _)| {
        let nearby = Nearby::of(rig, *start, nearest, &few, cell);
        climb(&mut |arc| nearby.agreement(arc, few.len(), &to.fine), *start, nearest, 3)
    });
    let wholly = |arc| of_step(rig, arc, &many, |ray| to.fine.between(cell(ray)?));
    let climbed: Vec<_> = climbed.map(|arc| (arc, wholly(arc))).collect();
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
    /// Cells of the coarse picture from rays.
    fn cell_from_ray(&self) -> Matrix3<f32> {
        let (scale, shift) = (super::COARSE_FOCAL, self.first * -super::COARSE_FOCAL);
        Matrix3::new(scale, 0.0, shift.x, 0.0, scale, shift.y, 0.0, 0.0, 1.0)
    }

    fn coarse_points(&self, rig: &PlanarRig<f32>, most: usize) -> Points {
        Points::new(grid(&self.coarse, most).filter_map(|cell| {
            let ray = self.first + cell / super::COARSE_FOCAL;
            Some((ray, self.coarse.nearest(cell)? as i8)).filter(|_| near_floor(rig, ray))
        }))
    }

    fn fine_samples(&self, camera: &Camera<f32>, rig: &PlanarRig<f32>, most: usize) -> Vec<Sample> {
        let sample = |cell| {
            let ray = camera.ray_from_pixel(self.pixel(cell)).filter(|ray| near_floor(rig, *ray))?;
            Some(Sample { ray: ray.push(1.0), contrast: self.fine.nearest(cell)? })
        };
        grid(&self.fine, most).filter_map(sample).collect()
    }
}

/// Cells so far apart that there are no more than `most` of them in a picture half full of floor.
fn grid(contrast: &Contrast, most: usize) -> impl Iterator<Item = Vector2<f32>> {
    let (width, height) = (contrast.width(), contrast.height());
    let stride = libm::ceilf(libm::sqrtf((width * height) as f32 / (2 * most) as f32)) as usize;
    let rows = (0..height).step_by(stride);
    rows.flat_map(move |v| (0..width).step_by(stride).map(move |u| Vector2::new(u as f32, v as f32)))
}

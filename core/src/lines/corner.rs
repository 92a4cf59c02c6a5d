use super::config::ExtractConfig;
use super::edge::{EdgePoint, NEAR_CORNER};
use super::extraction::{Corner, Extraction, Line, MAX_LINES};
use super::fit::{Sampling, fit};
use crate::geometry::Camera;
use heapless::Vec;
use nalgebra::{Matrix2, Vector2};

/// Owner numbers of the two kinds of lines start here.
pub(super) const VERTICAL_OWNER: u8 = 0;
pub(super) const FLOOR_OWNER: u8 = MAX_LINES as u8;
/// Points closer to a corner than this see both of its edges; lines are fitted without them. Half the width of
/// the smoothing, and the picture's own blur.
const SMEARED_PX: f32 = 5.0;
/// Points that one side of a floor line must have to be a line of its own.
const LEAST_SIDE: u16 = 8;
/// Squared deviations by which two sides of a floor line may differ and still be one line.
const DISAGREEMENT: f32 = 4.0;
/// Corners closer than this are one.
const SAME_PX: f32 = 3.0;

/// Where two lines meet: the cross product of their homogeneous vectors, and its covariance by first order.
///
/// ```text
/// l = (n_u, n_v, −n·c)        x ~ l_floor × l_vertical                            (7)
/// N = (n_floor, n_vertical)ᵀ   Σ = N⁻¹ diag(σ²(t_floor), σ²(t_vertical)) N⁻ᵀ
/// ```
///
/// σ²(t) is a line's variance across it at the corner, t away from its centroid. `None` for parallel lines.
pub(super) fn meet(floor: &Line, vertical: &Line) -> Option<(Vector2<f32>, Matrix2<f32>)> {
    // Seen from the vertical line's centroid: products of whole pixel coordinates would lose digits.
    let homogeneous = |line: &Line| line.normal.push(line.distance(vertical.centroid));
    let crossing = homogeneous(floor).cross(&homogeneous(vertical));
    let sine = crossing.z;
    if sine.abs() < 1e-3 {
        return None;
    }
    let ideal = vertical.centroid + crossing.xy() / sine;
    // Column k of N⁻¹ is the move along the other line that leaves it by one pixel.
    let by_floor = vertical.along() / -sine;
    let by_vertical = floor.along() / sine;
    let var_floor = floor.var_at(floor.position(ideal));
    let var_vertical = vertical.var_at(vertical.position(ideal));
    let covariance =
        by_floor * by_floor.transpose() * var_floor + by_vertical * by_vertical.transpose() * var_vertical;
    Some((ideal, covariance))
}

/// Whether both edges have support next to a crossing: the vertical one comes from above and ends there, the floor
/// edge passes or ends there.
fn supported(config: &ExtractConfig, floor: &Line, vertical: &Line, ideal: Vector2<f32>) -> bool {
    let crossing = floor.normal.perp(&vertical.normal).abs();
    if crossing < libm::sinf(config.min_crossing) {
        return false;
    }
    // A vertical line's own direction may point up or down.
    let downwards = if vertical.along().y >= 0.0 { 1.0 } else { -1.0 };
    let at = vertical.position(ideal) * downwards;
    let bottom = if downwards > 0.0 { vertical.extent[1] } else { -vertical.extent[0] };
    let ends_there = bottom - at <= config.overshoot_px && at - bottom <= config.reach_px;
    let at = floor.position(ideal);
    let passes = at >= floor.extent[0] - config.reach_px && at <= floor.extent[1] + config.reach_px;
    ends_there && passes
}

/// Finds the corners of the lines found, refits the lines without the points that a corner smears, and fills
/// `extraction.corners`.
pub(super) fn find_corners(
    config: &ExtractConfig,
    camera: &Camera<f32>,
    top: f32,
    sampling: Sampling,
    points: &mut [EdgePoint],
    extraction: &mut Extraction,
) {
    for (i, vertical) in (0_u8..).zip(&extraction.vertical_lines) {
        for (j, floor) in (0_u8..).zip(&extraction.floor_lines) {
            let Some((ideal, _)) = meet(floor, vertical) else { continue };
            if !supported(config, floor, vertical, ideal) {
                continue;
            }
            for point in points.iter_mut() {
                // The other edge is as near as its line is, not as the corner is.
                let other = match point.owner {
                    owner if owner == VERTICAL_OWNER + i => floor,
                    owner if owner == FLOOR_OWNER + j => vertical,
                    _ => continue,
                };
                let near = (point.position - ideal).amax() < 3.0 * SMEARED_PX;
                if near && other.distance(point.position).abs() < SMEARED_PX {
                    point.owner |= NEAR_CORNER;
                }
            }
        }
    }
    refit(points, VERTICAL_OWNER, &mut extraction.vertical_lines, sampling);
    refit(points, FLOOR_OWNER, &mut extraction.floor_lines, sampling);

    let mut candidates = Vec::<Corner, 64>::new();
    for (i, vertical) in (0_u8..).zip(&extraction.vertical_lines) {
        for (j, floor) in (0_u8..).zip(&extraction.floor_lines) {
            let Some((ideal, _)) = meet(floor, vertical) else { continue };
            if !supported(config, floor, vertical, ideal) {
                continue;
            }
            let straight = straight_at(points, FLOOR_OWNER + j, floor, floor.position(ideal), sampling);
            let Some((ideal, covariance)) = meet(&straight, vertical) else { continue };
            let Some((pixel, covariance)) = seen(camera, ideal, covariance) else { continue };
            if pixel.y < top {
                continue;
            }
            let corner = Corner {
                pixel,
                covariance,
                vertical: i,
                floor: j,
                brighter_right: vertical.normal.x > 0.0,
                brighter_below: floor.normal.y > 0.0,
            };
            extraction.truncations.corners += keep_best(&mut candidates, corner);
        }
    }
    candidates.sort_unstable_by(|a, b| a.covariance.trace().total_cmp(&b.covariance.trace()));
    for corner in &candidates {
        extraction.truncations.corners += u32::from(extraction.corners.push(*corner).is_err());
    }
}

/// Adds a corner, unless a more certain one of the same place is there; gives how many were lost to the capacity.
fn keep_best(corners: &mut Vec<Corner, 64>, corner: Corner) -> u32 {
    let same =
        corners.iter_mut().find(|other| (other.pixel - corner.pixel).norm_squared() < SAME_PX * SAME_PX);
    if let Some(other) = same {
        if corner.covariance.trace() < other.covariance.trace() {
            *other = corner;
        }
        return 0;
    }
    if corners.push(corner).is_ok() {
        return 0;
    }
    let worst = corners.iter_mut().max_by(|a, b| a.covariance.trace().total_cmp(&b.covariance.trace()));
    if let Some(worst) = worst.filter(|worst| corner.covariance.trace() < worst.covariance.trace()) {
        *worst = corner;
    }
    1
}

/// Fits every line again without the points marked as near a corner, where enough remain.
fn refit(points: &[EdgePoint], first_owner: u8, lines: &mut [Line], sampling: Sampling) {
    for (owner, line) in (first_owner..).zip(lines) {
        let clear = points.iter().filter(|point| point.owner == owner);
        let left = clear.clone().count();
        if left < 6 || left == usize::from(line.points) {
            continue;
        }
        if let Some(mut fitted) = fit(clear, line.normal, sampling) {
            // The edge is as long as it was; only its ends do not count.
            let shift = fitted.position(line.centroid);
            fitted.extent = line.extent.map(|end| end + shift);
            *line = fitted;
        }
    }
}

/// The floor line next to a corner at position `at` along it: all of it, or one side where the two sides disagree.
///
/// Two walls that meet at a small angle, or a door set back a little, bend the floor's edge by less than what
/// separates two lines in the first place.
fn straight_at(points: &[EdgePoint], owner: u8, floor: &Line, at: f32, sampling: Sampling) -> Line {
    let side = |sign: f32| {
        let beyond = move |point: &&EdgePoint| (floor.position(point.position) - at) * sign > 0.0;
        fit(points.iter().filter(|point| point.owner == owner).filter(beyond), floor.normal, sampling)
            .filter(|line| line.points >= LEAST_SIDE)
    };
    // A few points beyond the corner cannot show that they belong to the same line.
    let (before, after) = match (side(-1.0), side(1.0)) {
        (Some(before), Some(after)) => (before, after),
        (one, other) => return one.or(other).unwrap_or(*floor),
    };
    let corner = floor.centroid + floor.along() * at;
    let step = before.distance(corner) - after.distance(corner);
    let turn = before.normal.perp(&after.normal);
    let [var_before, var_after] = [&before, &after].map(|line| line.var_at(line.position(corner)));
    let same = step * step <= DISAGREEMENT * (var_before + var_after)
        && turn * turn <= DISAGREEMENT * (before.var_angle + after.var_angle);
    match (same, var_before <= var_after) {
        (true, _) => *floor,
        (false, true) => before,
        (false, false) => after,
    }
}

/// An ideal pixel and its covariance as seen through the lens.
fn seen(
    camera: &Camera<f32>,
    ideal: Vector2<f32>,
    covariance: Matrix2<f32>,
) -> Option<(Vector2<f32>, Matrix2<f32>)> {
    let ray = camera.ray_from_ideal(ideal);
    let pixel = camera.pixel_from_ray(ray).filter(|pixel| camera.contains(*pixel))?;
    let (focal, skew) = (camera.focal(), camera.skew());
    // ∂(x, y)/∂(ideal): the inverse of the upper triangle of intrinsic parameters.
    let ray_by_ideal = Matrix2::new(1.0 / focal.x, -skew / focal.y, 0.0, 1.0 / focal.y);
    let by_ideal = camera.pixel_by_ray(ray) * ray_by_ideal;
    Some((pixel, by_ideal * covariance * by_ideal.transpose()))
}

use super::config::ExtractConfig;
use super::edge::{EdgePoint, NEAR_CORNER};
use super::extraction::{Corner, Extraction, Line, MAX_CORNERS, MAX_LINES};
use super::fit::{Sampling, fit};
use super::members::{Members, at, gather};
use crate::geometry::{Camera, RangeFinder};
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
/// Length of the strip below a foot in which another edge is looked for, px.
const BELOW_PX: f32 = 10.0;
/// Half of that strip's width, from the vertical line, px.
const BESIDE_PX: f32 = 2.0;
/// Least tangent of the angle of a foot below the horizon.
const LEAST_FALL: f32 = 0.01;
/// A floor line that ends so far from a crossing leaves it open whether it belongs there, px.
const AMBIGUOUS_PX: f32 = 14.0;
/// Half of the width of the strip under a foot in which an edge of a skirting board is looked for, px.
const UNDER_PX: f32 = 4.0;
/// Points that make an edge there.
const SKIRTING_POINTS: usize = 3;
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

/// A place where the extension of a vertical line crosses an edge of the floor.
struct Crossing {
    floor: u8,
    ideal: Vector2<f32>,
    /// How far below the vertical line's lower end, px.
    below: f32,
    /// How far beyond the floor line's nearer end, px; 0 within it.
    gap: f32,
}

/// What the search for corners goes by.
pub(super) struct CornerSearch<'a> {
    pub(super) config: &'a ExtractConfig,
    pub(super) finder: &'a RangeFinder<f32>,
    /// First row of the region of interest.
    pub(super) top: f32,
    pub(super) sampling: Sampling,
}

impl CornerSearch<'_> {
    /// Finds the corners of the lines found, refits the lines without the points that a corner smears, and fills
    /// `extraction.corners`. The memory is for two lists of the points.
    pub(super) fn run(&self, points: &mut [EdgePoint], memory: &mut [u16], extraction: &mut Extraction) {
        let (members, side) = memory.split_at_mut(memory.len() / 2);
        let mut members = Members::new(points, members);
        let mut pairs = Vec::<(u8, u8), MAX_LINES>::new();
        for (i, vertical) in (0_u8..).zip(&extraction.vertical_lines) {
            let crossings = self.crossings(vertical, &extraction.floor_lines);
            let Some(foot) = self.foot(&crossings, &extraction.floor_lines) else { continue };
            let Some(floor) = extraction.floor_lines.get(usize::from(foot.floor)) else { continue };
            let on_floor = self.is_lowest(foot, &extraction.floor_lines)
                && !self.is_cut_off(foot, i, extraction)
                && !self.continues_below(points, vertical, foot.ideal)
                && !self.on_skirting(points, foot, floor);
            if !on_floor {
                continue;
            }
            // One vertical line has one foot, so the pairs are no more than the lines.
            let _ = pairs.push((i, foot.floor));
            for crossing in &crossings {
                if let Some(floor) = extraction.floor_lines.get(usize::from(crossing.floor)) {
                    let ideal = crossing.ideal;
                    mark_smeared(points, members.of(VERTICAL_OWNER + i), floor, ideal);
                    mark_smeared(points, members.of(FLOOR_OWNER + crossing.floor), vertical, ideal);
                }
            }
        }
        refit(points, &mut members, VERTICAL_OWNER, &mut extraction.vertical_lines, self.sampling);
        refit(points, &mut members, FLOOR_OWNER, &mut extraction.floor_lines, self.sampling);

        let mut corners = Vec::<Corner, MAX_LINES>::new();
        for (i, j) in pairs {
            let lines =
                (extraction.vertical_lines.get(usize::from(i)), extraction.floor_lines.get(usize::from(j)));
            let (Some(vertical), Some(floor)) = lines else { continue };
            let Some((ideal, _)) = meet(floor, vertical) else { continue };
            let clear = members.of(FLOOR_OWNER + j);
            let straight = straight_at(points, (clear, side), floor, floor.position(ideal), self.sampling);
            let Some((ideal, covariance)) = meet(&straight, vertical) else { continue };
            let Some((pixel, covariance)) = seen(self.finder.camera(), ideal, covariance) else { continue };
            if pixel.y < self.top {
                continue;
            }
            keep_best(
                &mut corners,
                Corner {
                    pixel,
                    covariance,
                    vertical: i,
                    floor: j,
                    brighter_right: vertical.normal.x > 0.0,
                    brighter_below: floor.normal.y > 0.0,
                },
            );
        }
        let kept = &mut extraction.corners;
        for corner in &corners {
            let better = |other: &Corner| other.covariance.trace() <= corner.covariance.trace();
            let rank = kept.iter().take_while(|other| better(other)).count();
            if kept.is_full() {
                extraction.truncations.corners += 1;
                kept.truncate(MAX_CORNERS - 1);
            }
            let _ = kept.insert(rank.min(kept.len()), *corner); // there is room
        }
    }

    /// Where the downward extension of a vertical line, or its lower end, meets floor edges that pass or end there.
    fn crossings(&self, vertical: &Line, floor_lines: &[Line]) -> Vec<Crossing, MAX_LINES> {
        let least_sine = libm::sinf(self.config.min_crossing);
        let found = (0_u8..).zip(floor_lines).filter_map(|(j, floor)| {
            let (ideal, _) = meet(floor, vertical)?;
            let at = floor.position(ideal);
            let gap = (floor.extent[0] - at).max(at - floor.extent[1]).max(0.0);
            let crosses = floor.normal.perp(&vertical.normal).abs() >= least_sine;
            let below = vertical.beyond_lower_end(ideal);
            let near = gap <= AMBIGUOUS_PX && below >= -self.config.overshoot_px;
            (crosses && near).then_some(Crossing { floor: j, ideal, below, gap })
        });
        found.collect()
    }

    /// The lowest crossing on which the vertical edge can stand. The edge comes from above and ends at an edge of the
    /// floor; that is the foot, or the top of a skirting board in front of which its own edge cannot be seen. Then the
    /// foot is the lowest floor edge that leaves the end of the vertical one no higher above the floor than a
    /// skirting board.
    fn foot<'c>(&self, crossings: &'c [Crossing], floor_lines: &[Line]) -> Option<&'c Crossing> {
        let supported = |crossing: &&Crossing| crossing.gap <= self.config.floor_reach_px;
        let ends_there = |crossing: &&Crossing| crossing.below <= self.config.reach_px;
        let highest = crossings
            .iter()
            .filter(supported)
            .filter(ends_there)
            .min_by(|a, b| a.below.total_cmp(&b.below))?;
        let lowest = crossings.iter().filter(|crossing| {
            crossing.floor == highest.floor || self.is_skirting(highest, crossing, floor_lines)
        });
        lowest.max_by(|a, b| a.below.total_cmp(&b.below)).filter(supported)
    }

    /// Whether two floor lines can be the upper and the lower edge of one skirting board: low enough at the crossings,
    /// and as high wherever both are seen.
    fn is_skirting(&self, upper: &Crossing, lower: &Crossing, floor_lines: &[Line]) -> bool {
        let line = |crossing: &Crossing| floor_lines.get(usize::from(crossing.floor));
        let (Some(top), Some(bottom)) = (line(upper), line(lower)) else { return false };
        let Some(height) = self.height_of(upper.ideal, lower.ideal) else { return false };
        let slack = 0.3 * height + 0.01;
        let as_high = top.extent.iter().all(|end| {
            let above = top.centroid + top.along() * *end;
            let below = bottom.at_column(above.x);
            let beside =
                bottom.position(below) < bottom.extent[0] || bottom.position(below) > bottom.extent[1];
            beside || self.height_of(above, below).is_some_and(|other| (other - height).abs() <= slack)
        });
        as_high && height <= self.config.skirting_height
    }

    /// Whether another vertical edge stands between a foot and the end of its floor line: then the line ends there.
    fn is_cut_off(&self, foot: &Crossing, vertical: u8, extraction: &Extraction) -> bool {
        let Some(floor) = extraction.floor_lines.get(usize::from(foot.floor)) else { return true };
        let at = floor.position(foot.ideal);
        foot.gap > 0.0
            && (0_u8..).zip(&extraction.vertical_lines).filter(|(k, _)| *k != vertical).any(|(_, other)| {
                let Some((ideal, _)) = meet(floor, other) else { return false };
                let beyond = (at - floor.position(ideal)) * if at > floor.extent[1] { 1.0 } else { -1.0 };
                let below = other.beyond_lower_end(ideal);
                beyond > 1.0
                    && beyond < foot.gap + self.config.floor_reach_px
                    && below.abs() <= self.config.reach_px
            })
    }

    /// How high above the floor a point of a vertical edge is whose foot is seen at the ideal pixel `foot`, m:
    /// both are equally far, so h (1 − tan δ/tan δ_foot) with their angles δ below the horizon. `None` when the foot
    /// is not below the horizon.
    fn height_of(&self, point: Vector2<f32>, foot: Vector2<f32>) -> Option<f32> {
        let [fall, fall_of_foot] = [point, foot].map(|ideal| {
            let ray = self.finder.camera().ray_from_ideal(ideal);
            let direction = self.finder.robot_from_cam() * ray.push(1.0);
            -direction.z / libm::sqrtf(direction.xy().norm_squared())
        });
        (fall_of_foot > LEAST_FALL).then(|| self.finder.mount().height() * (1.0 - fall / fall_of_foot))
    }

    /// Whether no long edge of the floor runs below a foot: what stands on the floor has nothing but floor below it,
    /// the lower edge of a poster has the foot of its wall.
    fn is_lowest(&self, foot: &Crossing, floor_lines: &[Line]) -> bool {
        let least = self.config.min_bound_length * self.finder.camera().height() as f32;
        floor_lines.iter().all(|line| {
            let below = line.at_column(foot.ideal.x);
            let position = line.position(below);
            let beside = position < line.extent[0] || position > line.extent[1];
            line.length() < least || beside || below.y < foot.ideal.y + SMEARED_PX
        })
    }

    /// Whether a foot is the upper end of a dark skirting board too short for its lower edge to be a line: its own edge
    /// is darker below, and straight under it there are points of an edge that is brighter below.
    fn on_skirting(&self, points: &[EdgePoint], foot: &Crossing, floor: &Line) -> bool {
        let under = points.iter().filter(|point| {
            let offset = point.position - foot.ideal;
            let brighter_below = (32..96).contains(&point.direction);
            let close = offset.x.abs() <= UNDER_PX && offset.y > 2.0;
            brighter_below
                && close
                && self
                    .height_of(foot.ideal, point.position)
                    .is_some_and(|h| h <= self.config.skirting_height)
        });
        floor.normal.y < 0.0 && under.count() * self.sampling.stride >= SKIRTING_POINTS
    }

    /// Whether an edge goes on along a vertical line below its foot: then something stands before the floor's edge.
    fn continues_below(&self, points: &[EdgePoint], vertical: &Line, foot: Vector2<f32>) -> bool {
        let (start, direction) = (vertical.beyond_lower_end(foot), vertical.direction());
        let below = points.iter().filter(|point| {
            if vertical.distance(point.position).abs() > BESIDE_PX {
                return false; // as most
            }
            let beyond = vertical.beyond_lower_end(point.position) - start;
            let turned = (point.direction.wrapping_sub(direction) as i8).unsigned_abs();
            turned.abs_diff(64) > 48 && beyond > SMEARED_PX && beyond <= SMEARED_PX + BELOW_PX
        });
        (below.count() * self.sampling.steep_stride()) as f32 >= 0.4 * BELOW_PX
    }
}

/// Marks the points of one line of a corner that are near its other line too.
fn mark_smeared(points: &mut [EdgePoint], members: &[u16], other: &Line, ideal: Vector2<f32>) {
    for index in members {
        let Some(point) = points.get_mut(usize::from(*index)) else { continue };
        // The other edge is as near as its line is, not as the corner is.
        let near = (point.position - ideal).amax() < 3.0 * SMEARED_PX;
        if near && other.distance(point.position).abs() < SMEARED_PX {
            point.owner |= NEAR_CORNER;
        }
    }
}

/// Adds a corner, unless a more certain one of the same place is there.
fn keep_best(corners: &mut Vec<Corner, MAX_LINES>, corner: Corner) {
    let same =
        corners.iter_mut().find(|other| (other.pixel - corner.pixel).norm_squared() < SAME_PX * SAME_PX);
    match same {
        Some(other) if corner.covariance.trace() < other.covariance.trace() => *other = corner,
        Some(_) => {}
        None => {
            let _ = corners.push(corner); // at most one a vertical line
        }
    }
}

/// Fits every line again without the points marked as near a corner, where enough remain; these are then its members.
fn refit(
    points: &[EdgePoint],
    members: &mut Members<'_>,
    first_owner: u8,
    lines: &mut [Line],
    sampling: Sampling,
) {
    for (owner, line) in (first_owner..).zip(lines) {
        let clear = members.keep(points, owner);
        if clear.len() < 6 || clear.len() == usize::from(line.points) {
            continue;
        }
        if let Some(mut fitted) = fit(at(points, clear), line.normal, sampling) {
            // The edge is as long as it was; only its ends do not count.
            let shift = fitted.position(line.centroid);
            fitted.extent = line.extent.map(|end| end + shift);
            *line = fitted;
        }
    }
}

/// The floor line next to a corner at position `place` along it: all of it, or one side where the two sides disagree.
///
/// Two walls that meet at a small angle, or a door set back a little, bend the floor's edge by less than what
/// separates two lines in the first place.
fn straight_at(
    points: &[EdgePoint],
    (members, side): (&[u16], &mut [u16]),
    floor: &Line,
    place: f32,
    sampling: Sampling,
) -> Line {
    let mut side = |sign: f32| {
        let beyond = |point: &EdgePoint| (floor.position(point.position) - place) * sign > 0.0;
        let count = gather(points, members, side, beyond);
        fit(at(points, side.get(..count)?), floor.normal, sampling).filter(|line| line.points >= LEAST_SIDE)
    };
    // A few points beyond the corner cannot show that they belong to the same line.
    let (before, after) = match (side(-1.0), side(1.0)) {
        (Some(before), Some(after)) => (before, after),
        (one, other) => return one.or(other).unwrap_or(*floor),
    };
    let corner = floor.centroid + floor.along() * place;
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

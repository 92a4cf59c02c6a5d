//! Where a vertical edge's foot is, and how well that is known.
use super::edge::{EdgePoint, VERTICAL};
use super::floor_line::{Local, Side};
use super::foot::{Feet, Foot, Rows};
use super::vertical::{self, Vertical};
use super::view::View;
use crate::lines::Line;
use crate::lines::edge::unit;
use crate::lines::fit::{Sampling, fit};
use heapless::Vec;
use nalgebra::{Matrix2, Vector2};

/// Points closer to a corner than this see both of its edges, px: half the width of the smoothing, and the picture's blur.
const SMEARED_PX: f32 = 4.5;
/// Points that a line without the smeared ones must have.
const LEAST_CLEAR: usize = 4;
/// What smeared points may shift a line by, as a variance, px².
const SMEAR_VAR: f32 = 0.09;
/// Distances within which a line's points are, px.
const VERTICAL_GATE_PX: f32 = 1.0;
const FLOOR_GATE_PX: f32 = 0.8;
/// Squared deviations by which left and right may differ and still agree.
const DISAGREEMENT: f32 = 4.0;

/// A place that may be a corner of the floor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Proposal {
    /// In the picture, as seen through the lens; the centre of the top-left pixel is (0, 0).
    pub pixel: Vector2<f32>,
    /// Where an ideal camera would see it, px.
    pub ideal: Vector2<f32>,
    /// Covariance of the pixel, px².
    pub covariance: Matrix2<f32>,
    /// The probability that it is a corner of the floor.
    pub probability: f32,
    /// Range on the floor, m, for the mount as it is configured.
    pub range: f32,
    /// Whether the vertical edge is brighter on its right.
    pub brighter_right: bool,
    /// Whether the floor's edge is brighter below.
    pub brighter_below: bool,
    /// The far ends of its floor lines to the left and right, in the picture; not a number where there is none.
    pub ends: [Vector2<f32>; 2],
}

/// Points of a vertical edge that its line is fitted to, at most.
const MAX_MEMBERS: usize = 256;

/// The points of a vertical edge, from its top down, and how far down it each is, px from its middle.
pub(super) struct Members<'p> {
    points: Vec<(f32, &'p EdgePoint), MAX_MEMBERS>,
}

impl<'p> Members<'p> {
    pub(super) fn new(vertical: &Vertical, points: &'p [EdgePoint], rows: &Rows) -> Self {
        let (down, right, middle) = (vertical.along, vertical.right(), vertical.middle());
        let position = |place: Vector2<f32>| down.dot(&(place - middle));
        let (top, bottom) = (position(vertical.top) - 0.5, position(vertical.bottom) + 0.5);
        let mut members = Vec::new();
        let ends = [vertical.top.y.min(vertical.bottom.y) - 1.0, vertical.top.y.max(vertical.bottom.y) + 1.0];
        rows.each(points, ends[0], ends[1], |index, point| {
            let moved = point.place() - middle;
            if right.dot(&moved).abs() > VERTICAL_GATE_PX || !point.is(VERTICAL) {
                return; // as most
            }
            let along = down.dot(&moved);
            let alike = point.direction.wrapping_sub(vertical.direction).wrapping_add(24) <= 48;
            if alike
                && (top..=bottom).contains(&along)
                && let Some(point) = points.get(usize::from(index))
            {
                let _ = members.push((along, point)); // a very long edge is as well known by its upper part
            }
        });
        Self { points: members }
    }

    /// The edge's line; above `foot` as far as enough points are clear of it.
    pub(super) fn line(
        &self,
        vertical: &Vertical,
        foot: Option<Vector2<f32>>,
        sampling: Sampling,
    ) -> Option<Line> {
        let seed = vertical::normal(vertical);
        let line = |bottom: f32| {
            let above =
                self.points.iter().filter(move |(along, _)| *along <= bottom).map(|(_, point)| *point);
            (above.clone().count() >= LEAST_CLEAR).then(|| fit(above, seed, sampling)).flatten()
        };
        let clear = |foot: Vector2<f32>| vertical.along.dot(&(foot - vertical.middle())) - SMEARED_PX;
        foot.and_then(|foot| line(clear(foot))).or_else(|| line(f32::MAX))
    }
}

/// A floor line through its points, without those that the vertical edge smears, as far as enough are left.
fn floor_line(
    side: &Side,
    local: &[Local],
    points: &[EdgePoint],
    normal: Vector2<f32>,
    sampling: Sampling,
) -> Option<Line> {
    let line = |begin: f32| {
        let members = local
            .iter()
            .filter(move |one| {
                let moved = one.place - Vector2::new(0.0, side.crossing);
                (begin..=side.end).contains(&one.place.x)
                    && side.along.perp(&moved).abs() <= FLOOR_GATE_PX
                    && one.direction.wrapping_sub(side.direction).wrapping_add(24) <= 48
            })
            .filter_map(|one| points.get(usize::from(one.index)));
        (members.clone().count() >= LEAST_CLEAR).then(|| fit(members, normal, sampling)).flatten()
    };
    if let Some(clear) = line(side.begin.max(SMEARED_PX)) {
        return Some(clear);
    }
    let members = |gate: f32| {
        local
            .iter()
            .filter(move |one| {
                let moved = one.place - Vector2::new(0.0, side.crossing);
                (side.begin..=side.end).contains(&one.place.x) && side.along.perp(&moved).abs() <= gate
            })
            .filter_map(|one| points.get(usize::from(one.index)))
    };
    let mut smeared = fit(members(FLOOR_GATE_PX), normal, sampling)?;
    smeared.var_position_px2 += SMEAR_VAR;
    Some(smeared)
}

/// Where a foot is, and the covariance: places of the picture searched.
pub(super) fn locate(
    vertical: &Vertical,
    feet: &Feet,
    foot: &Foot,
    points: &[EdgePoint],
    members: &Members<'_>,
    sampling: Sampling,
) -> Option<(Vector2<f32>, Matrix2<f32>, bool)> {
    let place = feet.origin + vertical.along * foot.below;
    let upright =
        if vertical.points() > 0.0 { Some(members.line(vertical, Some(place), sampling)?) } else { None };
    let outwards = [-vertical.right(), vertical.right()];
    let sides = feet.sides_of(foot);
    let mut crossings = [None, None];
    let mut lines = [None, None];
    let mut below = 0.0;
    let places = crossings.iter_mut().zip(&mut lines);
    for (((side, local), outwards), (crossing, kept)) in
        sides.iter().zip(&feet.local).zip(outwards).zip(places)
    {
        let Some(side) = side else { continue };
        let along = outwards * side.along.x + vertical.along * side.along.y;
        let normal = Vector2::new(-along.y, along.x);
        let normal = if unit(side.direction).dot(&normal) >= 0.0 { normal } else { -normal };
        below += normal.y * f32::from(side.points);
        let Some(line) = floor_line(side, local, points, normal, sampling) else { continue };
        *crossing = upright.as_ref().and_then(|upright| meet(&line, upright));
        *kept = Some(line);
    }
    if upright.is_none() {
        // A bend: where the floor lines meet each other.
        let [Some(left), Some(right)] = &lines else { return None };
        let bend = meet(left, right)?;
        let along = right.along();
        let covariance = along * along.transpose() * bend.variance
            + bend.by_vertical * bend.by_vertical.transpose() * bend.var_vertical;
        return Some((bend.place, covariance, below > 0.0));
    }
    let joined = match crossings {
        [Some(left), Some(right)] => Some(join(left, right)),
        [one, other] => one.or(other),
    };
    let crossing = joined?;
    let across = crossing.by_vertical;
    let covariance = vertical.along * vertical.along.transpose() * crossing.variance
        + across * across.transpose() * crossing.var_vertical;
    Some((crossing.place, covariance, below > 0.0))
}

/// Where a floor line meets a vertical edge.
#[derive(Clone, Copy)]
struct Crossing {
    place: Vector2<f32>,
    /// Along the vertical edge, for the floor line's part, px².
    variance: f32,
    /// What a pixel across the vertical edge moves, and its variance there.
    by_vertical: Vector2<f32>,
    var_vertical: f32,
}

/// Where two lines meet: the cross product of their homogeneous vectors, and its covariance by first order.
///
/// ```text
/// l = (n_u, n_v, −n·c)        x ~ l_floor × l_vertical                            (7)
/// N = (n_floor, n_vertical)ᵀ   Σ = N⁻¹ diag(σ²(t_floor), σ²(t_vertical)) N⁻ᵀ
/// ```
///
/// σ²(t) is a line's variance across it at the corner, t away from its centroid. `None` for parallel lines.
fn meet(floor: &Line, vertical: &Line) -> Option<Crossing> {
    let sine = floor.normal.perp(&vertical.normal);
    if sine.abs() < 0.05 {
        return None;
    }
    // From the vertical line's centroid along it until the floor line is reached; column k of N⁻¹ is the move along the
    // other line that leaves it by one pixel.
    let by_floor = vertical.along() / -sine;
    let by_vertical = floor.along() / sine;
    let place = vertical.centroid - by_floor * floor.distance(vertical.centroid);
    let var_floor = floor.var_at(floor.position(place));
    Some(Crossing {
        place,
        variance: var_floor / (sine * sine),
        by_vertical,
        var_vertical: vertical.var_at(vertical.position(place)),
    })
}

/// The weighted mean of what both sides say; where they disagree, less certain by as much.
fn join(left: Crossing, right: Crossing) -> Crossing {
    let (a, b) = (1.0 / left.variance.max(1e-6), 1.0 / right.variance.max(1e-6));
    let share = b / (a + b);
    let apart = (right.place - left.place).norm_squared();
    let mut variance = 1.0 / (a + b);
    if apart > DISAGREEMENT * (left.variance + right.variance) {
        variance += 0.25 * apart;
    }
    Crossing {
        place: left.place + (right.place - left.place) * share,
        variance,
        by_vertical: left.by_vertical + (right.by_vertical - left.by_vertical) * share,
        var_vertical: left.var_vertical,
    }
}

/// A place and its covariance as seen through the lens, in pixels of the picture searched.
pub(super) fn seen(
    view: &View,
    place: Vector2<f32>,
    covariance: Matrix2<f32>,
) -> Option<(Vector2<f32>, Matrix2<f32>)> {
    let camera = view.camera();
    let ray = view.ray(place);
    let pixel = camera.pixel_from_ray(ray).filter(|pixel| camera.contains(*pixel))?;
    let (focal, skew) = (camera.focal(), camera.skew());
    // ∂(x, y)/∂(ideal): the inverse of the upper triangle of intrinsic parameters.
    let ray_by_ideal = Matrix2::new(1.0 / focal.x, -skew / focal.y, 0.0, 1.0 / focal.y);
    let by_ideal = camera.pixel_by_ray(ray) * ray_by_ideal;
    Some((pixel, by_ideal * covariance * by_ideal.transpose()))
}

//! The features of every foot of a vertical edge.
use super::edge::{EdgePoint, FLOOR, STEEP_STRIDE, VERTICAL};
use super::features::{CONTEXT_SIDE, Features, PATCH_SIDE, Place};
use super::floor_line::Side;
use super::foot::{Feet, Foot, Rows};
use super::proposal::Proposal;
use super::vertical::Vertical;
use super::view::View;
use crate::image::GreyMemory;
use crate::lines::edge::unit;
use heapless::Vec;
use nalgebra::Vector2;

/// Units below and above a foot in which a vertical edge is looked for, and beside the line.
const BESIDE_FOOT: [f32; 2] = [2.5, 12.0];
const BESIDE_LINE: f32 = 2.0;
/// Half the width of the ray straight below, units, and where it begins.
const RAY: f32 = 1.5;
const RAY_BEGIN: f32 = 4.0;
/// Points that a floor line must have to count below a foot, and how far below it begins to, units.
const LINE_POINTS: u16 = 5;
const LINE_BELOW: f32 = 2.0;

/// A proposal with all that it was judged by.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The proposal.
    pub proposal: Proposal,
    /// What was measured.
    pub features: Features,
    /// Grey levels round it, row by row, upright along gravity: every 5 cm at its range, the foot between columns 7 and 8 on row 10.
    pub patch: [u8; PATCH_SIDE * PATCH_SIDE],
    /// The same every six units, the foot in the middle.
    pub context: [u8; CONTEXT_SIDE * CONTEXT_SIDE],
}

/// What the features of a picture's candidates are measured with.
pub(super) struct Measure<'a> {
    pub(super) view: &'a View,
    pub(super) points: &'a [EdgePoint],
    pub(super) rows: &'a Rows,
    pub(super) grey: &'a GreyMemory<'a>,
    pub(super) gradient_noise: f32,
    pub(super) size: Vector2<f32>,
}

/// Points kept of those along a vertical edge's line.
const MAX_STRIP: usize = 256;

/// The points along a vertical edge's line, also below it: how far below its lower end and beside it they are, px.
pub(super) struct Strip<'p> {
    points: Vec<(f32, f32, &'p EdgePoint), MAX_STRIP>,
}

impl<'p> Measure<'p> {
    /// The points along a vertical edge's line, from where its feet may be down to the picture's border.
    pub(super) fn strip(&self, vertical: &Vertical, feet: &Feet) -> Strip<'p> {
        let mut strip = Strip { points: Vec::new() };
        let highest = feet.found.first().map_or(0.0, |foot| foot.below);
        let (one, (down, right)) = (self.view.unit, (vertical.along, vertical.right()));
        let top = feet.origin.y + highest - (BESIDE_FOOT[1] + 1.0) * one;
        let points = self.points;
        self.rows.each(points, top, f32::MAX, |index, point| {
            let moved = point.place() - feet.origin;
            let beside = right.dot(&moved).abs();
            if beside <= BESIDE_LINE * one.max(0.7)
                && let Some(point) = points.get(usize::from(index))
            {
                let _ = strip.points.push((down.dot(&moved), beside, point)); // those far below count for little
            }
        });
        strip
    }

    /// The features of a foot and its place's frame; `None` when it cannot be seen.
    pub(super) fn features(
        &self,
        vertical: &Vertical,
        feet: &Feet,
        strip: &Strip<'_>,
        foot: &Foot,
    ) -> Option<(Features, Vector2<f32>, Place<'_>)> {
        let view = self.view;
        let place = feet.origin + vertical.along * foot.below;
        let frame = Place::new(view, self.grey, place)?;
        let one = view.unit;
        // Smaller than the smoothing's a difference of grey is as good as the noise.
        let noise = (2.0 * self.gradient_noise).max(1.0);
        let gradient = self.gradient_noise.max(0.25);
        let fall = view.fall(place);
        let mut f = Features {
            vertical_length: vertical.length() / one,
            vertical_density: vertical.points() * STEEP_STRIDE as f32 / vertical.length().max(1.0),
            vertical_gradient: vertical.gradient() / gradient,
            vertical_width: vertical.width(),
            vertical_turn: vertical.turn.to_degrees(),
            vertical_residual: vertical.residual,
            vertical_brighter_right: if vertical.points() > 0.0 {
                sign(unit(vertical.direction).dot(&vertical.right()))
            } else {
                0.0
            },
            vertical_height: view.height(vertical.top, place),
            below_end: foot.below / one,
            depression: libm::atanf(fall),
            range: view.finder.mount().height() / fall.max(1e-3),
            noise,
            ..Features::default()
        };
        let [left, right] = feet.sides_of(foot);
        self.sides(&mut f, vertical, place, [left, right]);
        self.neighbours(&mut f, feet, foot, place, vertical);
        self.points_near(&mut f, vertical, (strip, foot.below), [left, right]);
        self.greys(&mut f, &frame, [left, right], noise);
        let (below, beside) = frame.borders(self.size.x, self.size.y);
        (f.border_below, f.border) = (below, beside);
        Some((f, place, frame))
    }

    fn sides(
        &self,
        f: &mut Features,
        vertical: &Vertical,
        place: Vector2<f32>,
        [left, right]: [Option<&Side>; 2],
    ) {
        let one = self.view.unit;
        let gradient = self.gradient_noise.max(0.25);
        let fill = |side: &Side| {
            [
                f32::from(side.points),
                side.length / one,
                side.begin / one,
                side.gradient / gradient,
                side.width,
                side.residual,
                libm::atan2f(side.along.y, side.along.x),
                sign(unit(side.direction).dot(&vertical.along)),
            ]
        };
        if let Some(side) = left {
            [
                f.left_points,
                f.left_length,
                f.left_begin,
                f.left_gradient,
                f.left_width,
                f.left_residual,
                f.left_fall,
                f.left_brighter_below,
            ] = fill(side);
        }
        if let Some(side) = right {
            [
                f.right_points,
                f.right_length,
                f.right_begin,
                f.right_gradient,
                f.right_width,
                f.right_residual,
                f.right_fall,
                f.right_brighter_below,
            ] = fill(side);
        }
        // Directions on the floor, away from the foot.
        let on_floor = |side: &Side, outwards: Vector2<f32>| {
            let step = outwards * side.along.x + vertical.along * side.along.y;
            let (here, there) = (self.view.floor(place)?, self.view.floor(place + step * 3.0)?);
            let moved = there - here;
            let length = libm::sqrtf(moved.norm_squared());
            (length > 0.0).then(|| (moved / length, here))
        };
        let directions = [
            left.and_then(|side| on_floor(side, -vertical.right())),
            right.and_then(|side| on_floor(side, vertical.right())),
        ];
        let sight = |direction: Option<(Vector2<f32>, Vector2<f32>)>| {
            direction.map_or(0.0, |(along, here)| libm::atan2f(here.perp(&along), here.dot(&along)))
        };
        (f.left_sight, f.right_sight) = (sight(directions[0]), sight(directions[1]));
        if let [Some((a, _)), Some((b, _))] = directions {
            f.floor_turn = libm::atan2f(-a.perp(&b), -a.dot(&b));
        }
        if let (Some(left), Some(right)) = (left, right) {
            f.both = 1.0;
            f.disagreement = (left.crossing - right.crossing).abs() / one;
        }
    }

    /// The other feet of the same edge.
    fn neighbours(
        &self,
        f: &mut Features,
        feet: &Feet,
        foot: &Foot,
        place: Vector2<f32>,
        vertical: &Vertical,
    ) {
        let view = self.view;
        let at = |other: &Foot| feet.origin + vertical.along * other.below;
        let weight = |foot: &Foot| {
            let [left, right] = feet.sides_of(foot);
            let sides = || [left, right].into_iter().flatten();
            let points: f32 = sides().map(|side| f32::from(side.points)).sum();
            let gradient = sides().map(|side| side.gradient).fold(0.0, f32::max);
            (points, gradient)
        };
        (f.next_above, f.next_below) = (1.0, 1.0);
        let apart = LINE_BELOW * view.unit;
        let above = feet.found.iter().rev().find(|other| other.below < foot.below - apart);
        if let Some(above) = above {
            f.next_above = view.height(at(above), place).clamp(0.0, 1.0);
        }
        let below = feet.found.iter().find(|other| other.below > foot.below + apart);
        if let Some(below) = below {
            f.next_below = view.height(place, at(below)).clamp(0.0, 1.0);
            let ((points, gradient), (own, own_gradient)) = (weight(below), weight(foot));
            f.next_below_points = points / own.max(1.0);
            f.next_below_gradient = gradient / own_gradient.max(0.1);
        }
        let lower = feet
            .sides
            .iter()
            .flatten()
            .filter(|side| side.points >= LINE_POINTS && side.crossing > foot.below + apart);
        f.lines_below = lower.count() as f32;
    }

    /// Edge points above, below and straight down to the border.
    fn points_near(
        &self,
        f: &mut Features,
        vertical: &Vertical,
        (strip, foot): (&Strip<'_>, f32),
        sides: [Option<&Side>; 2],
    ) {
        let one = self.view.unit;
        let down = vertical.along;
        let steep = STEEP_STRIDE as f32;
        let (mut below, mut above, mut strongest, mut near) = (0.0, 0.0, 0.0_f32, 0.0_f32);
        for &(depth, beside, point) in &strip.points {
            let depth = (depth - foot) / one;
            if point.is(VERTICAL) && (BESIDE_FOOT[0]..=BESIDE_FOOT[1]).contains(&depth.abs()) {
                if depth > 0.0 { below += steep } else { above += steep }
            }
            if point.is(FLOOR) && beside <= RAY * one.max(0.7) && depth >= RAY_BEGIN {
                // At least 20° off gravity.
                let across = unit(point.direction).dot(&down).abs();
                if across > 0.34 {
                    strongest = strongest.max(point.gradient());
                    if depth <= 12.0 {
                        near = near.max(point.gradient());
                    }
                }
            }
        }
        let span = (BESIDE_FOOT[1] - BESIDE_FOOT[0]) * one;
        f.vertical_below = (below / span).min(1.5);
        f.vertical_above = (above / span).min(1.5);
        let own = sides.into_iter().flatten().map(|side| side.gradient).fold(0.1, f32::max);
        f.edge_below = (strongest / own).min(8.0);
        f.edge_near_below = (near / own).min(8.0);
    }

    /// The grey boxes round the foot.
    fn greys(&self, f: &mut Features, frame: &Place<'_>, [left, right]: [Option<&Side>; 2], noise: f32) {
        // Five units beside the foot a floor line has fallen by so much.
        let fall = |side: Option<&Side>| {
            side.map_or(0.0, |side| (5.0 * side.along.y / side.along.x.max(0.2)).clamp(0.0, 15.0))
        };
        let (fall_left, fall_right) = (fall(left), fall(right));
        let above_left = frame.grey([-8.0, -2.0], [-9.0, -3.0]);
        let above_right = frame.grey([2.0, 8.0], [-9.0, -3.0]);
        let below_left = frame.grey([-8.0, -2.0], [3.0 + fall_left, 9.0 + fall_left]);
        let below_right = frame.grey([2.0, 8.0], [3.0 + fall_right, 9.0 + fall_right]);
        let straight = frame.grey([-4.0, 4.0], [4.0, 12.0]);
        let far = frame.grey([-6.0, 6.0], [12.0, 30.0]);
        let (to_border, _) = frame.borders(self.size.x, self.size.y);
        let floor = frame.grey([-6.0, 6.0], [(to_border - 14.0).max(3.0), to_border.max(10.0) - 1.0]);
        let base = floor.or(far).or(straight).or(below_left).map_or(128.0, |grey| grey.mean);
        f.floor_grey = base / 255.0;
        let over = |grey: Option<super::features::Grey>| grey.map_or(0.0, |grey| (grey.mean - base) / noise);
        (f.above_left, f.above_right) = (over(above_left), over(above_right));
        (f.below_left, f.below_right) = (over(below_left), over(below_right));
        (f.straight_below, f.far_below) = (over(straight), over(far));
        let apart = |a: Option<super::features::Grey>, b: Option<super::features::Grey>| match (a, b) {
            (Some(a), Some(b)) => (a.mean - b.mean).abs() / noise,
            _ => 0.0,
        };
        f.contrast_above = apart(above_left, above_right);
        f.contrast_below = apart(below_left, below_right);
        let on = |side: Option<&Side>, contrast: f32| if side.is_some() { contrast } else { 0.0 };
        f.contrast_floor =
            on(left, apart(above_left, below_left)).max(on(right, apart(above_right, below_right)));
        let mut unlike = 0.0;
        let mut boxes = 0.0;
        for below in [below_left, below_right].into_iter().flatten() {
            unlike += (below.mean - base).abs() / noise;
            boxes += 1.0;
        }
        f.unlike_floor = unlike / f32::max(boxes, 1.0) / (f.contrast_floor + 1.0);
        let std = |grey: Option<super::features::Grey>| grey.map_or(0.0, |grey| grey.std / noise);
        f.texture_below = std(far);
        f.texture_sides = 0.5 * (std(below_left) + std(below_right));
        f.texture_above = 0.5 * (std(above_left) + std(above_right));
    }
}

fn sign(value: f32) -> f32 {
    if value >= 0.0 { 1.0 } else { -1.0 }
}

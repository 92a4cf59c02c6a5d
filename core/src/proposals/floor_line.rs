//! Short edges of the floor beside a vertical edge, on one side of it.
#![allow(
    clippy::indexing_slicing,
    reason = "kernel: places in the list of local points are below its length"
)]
use super::edge::EdgePoint;
use super::view::View;
use crate::lines::edge::unit;
use heapless::Vec;
use nalgebra::Vector2;

/// Points looked at on one side of a vertical edge.
pub(super) const MAX_LOCAL: usize = 192;
/// Floor lines kept on one side: those with the most points.
pub(super) const MAX_SIDE: usize = 12;
/// Seeds are nearer to the vertical edge than this, units.
const SEED_UNITS: f32 = 12.0;
/// Distance within which a seed's line takes points, px, and for each pixel along it; then that of the fitted line.
const SEED_GATE_PX: f32 = 0.35;
const SEED_GATE_SLOPE: f32 = 0.06;
const GATE_PX: f32 = 0.7;
/// Largest differences between directions, in 256ths of a turn: 20° and 23°.
const SEED_TURN: u8 = 14;
const TURN: u8 = 16;
/// Largest gap beside the vertical, units.
const GAP_UNITS: f32 = 4.0;
/// Least points and length, units, of a line; the farthest that it begins from its crossing.
const LEAST_POINTS: usize = 3;
const LEAST_UNITS: f32 = 2.8;
const BEGIN_UNITS: f32 = 9.0;
/// Least sine of the angle to the vertical edge: 8°.
const LEAST_SINE: f32 = 0.139;

/// A point beside a vertical edge: how far beside it, outwards, and how far below its lower end, px.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Local {
    pub(super) place: Vector2<f32>,
    pub(super) index: u16,
    pub(super) direction: u8,
    pub(super) used: bool,
}

/// A floor line that ends or passes beside a vertical edge.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Side {
    /// Where it crosses the vertical edge, px below its lower end.
    pub(super) crossing: f32,
    /// Unit vector outwards along it, (outwards, down).
    pub(super) along: Vector2<f32>,
    pub(super) points: u16,
    /// Beside the vertical edge, px: its nearest and its farthest point.
    pub(super) begin: f32,
    pub(super) end: f32,
    pub(super) length: f32,
    pub(super) gradient: f32,
    pub(super) width: f32,
    pub(super) residual: f32,
    /// Of its gradient, as points have it.
    pub(super) direction: u8,
}

/// The floor lines among the local points of one side; `local` is sorted from the vertical edge outwards.
pub(super) fn sides(
    local: &mut [Local],
    points: &[EdgePoint],
    view: &View,
    outwards: Vector2<f32>,
    down: Vector2<f32>,
) -> Vec<Side, MAX_SIDE> {
    let mut found = Vec::<Side, MAX_SIDE>::new();
    let mut members = Vec::<u16, MAX_LOCAL>::new();
    let alike = |a: u8, b: u8, turn: u8| a.wrapping_sub(b).wrapping_add(turn) <= 2 * turn;
    for seed in 0..local.len() {
        let from = local[seed];
        if from.place.x > SEED_UNITS * view.unit {
            break;
        }
        if from.used {
            continue;
        }
        let gradient = unit(from.direction);
        // Turned a quarter: along the edge, in the local frame.
        let (across, fall) = (gradient.dot(&outwards), gradient.dot(&down));
        let mut along = Vector2::new(fall, -across);
        if along.x < 0.0 {
            along = -along;
        }
        if along.x < LEAST_SINE {
            continue;
        }
        let near = |other: &Local| {
            let moved = other.place - from.place;
            let gate = SEED_GATE_PX + SEED_GATE_SLOPE * along.dot(&moved).abs();
            along.perp(&moved).abs() <= gate && alike(other.direction, from.direction, SEED_TURN)
        };
        let gap = GAP_UNITS * view.unit;
        joined(local, seed, gap, &mut members, near);
        if members.len() < LEAST_POINTS {
            continue;
        }
        let Some(first) = fit_members(local, &members) else { continue };
        let near = |other: &Local| {
            let off = first.1.perp(&(other.place - first.0)).abs();
            off <= GATE_PX && alike(other.direction, from.direction, TURN)
        };
        joined(local, seed, gap, &mut members, near);
        let line = (members.len() >= LEAST_POINTS).then(|| fit_members(local, &members)).flatten();
        let Some((mean, along, residual)) = line else { continue };
        let (begin, end) =
            (local[usize::from(members[0])].place, local[usize::from(members[members.len() - 1])].place);
        let length = along.dot(&(end - begin));
        if length < LEAST_UNITS * view.unit || along.x < LEAST_SINE {
            continue;
        }
        let crossing = mean.y - mean.x * along.y / along.x;
        let crossing_gap = libm::sqrtf(begin.x * begin.x + (begin.y - crossing) * (begin.y - crossing));
        if crossing_gap > BEGIN_UNITS * view.unit * 1.5 || begin.x > BEGIN_UNITS * view.unit {
            continue;
        }
        let (mut strength, mut curvature) = (0.0, 0.0);
        for k in &members {
            let member = &mut local[usize::from(*k)];
            member.used = true;
            if let Some(point) = points.get(usize::from(member.index)) {
                strength += point.gradient();
                curvature += f32::from(point.curvature);
            }
        }
        let count = members.len() as f32;
        let side = Side {
            crossing,
            along,
            points: members.len() as u16,
            begin: begin.x,
            end: end.x,
            length,
            gradient: strength / count,
            width: libm::sqrtf(256.0 * count / f32::max(curvature, 1.0)),
            residual,
            direction: from.direction,
        };
        let twin = found.iter().position(|other| {
            (other.crossing - crossing).abs() < 0.7 * view.unit.max(1.0)
                && other.along.perp(&along).abs() < 0.1
                && alike(other.direction, side.direction, TURN)
        });
        let rival = match twin {
            Some(twin) => found.get_mut(twin),
            None if found.is_full() => found.iter_mut().min_by_key(|other| other.points),
            None => None,
        };
        match rival {
            Some(other) if other.points < side.points => *other = side,
            Some(_) => {}
            None => {
                let _ = found.push(side); // there is room
            }
        }
    }
    found
}

/// Mean, direction outwards and root mean square distance of the members' line.
fn fit_members(local: &[Local], members: &[u16]) -> Option<(Vector2<f32>, Vector2<f32>, f32)> {
    let count = members.len() as f32;
    let mut mean = Vector2::zeros();
    for k in members {
        mean += local[usize::from(*k)].place;
    }
    mean /= count;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for k in members {
        let moved = local[usize::from(*k)].place - mean;
        xx += moved.x * moved.x;
        xy += moved.x * moved.y;
        yy += moved.y * moved.y;
    }
    let root = libm::sqrtf((xx - yy) * (xx - yy) + 4.0 * xy * xy);
    let largest = 0.5 * (xx + yy + root);
    // An eigenvector, from the row of the matrix that is not small.
    let along = if xx >= yy { Vector2::new(largest - yy, xy) } else { Vector2::new(xy, largest - xx) };
    let length = libm::sqrtf(along.norm_squared());
    if length < 1e-6 {
        return None;
    }
    let along = if along.x >= 0.0 { along / length } else { along / -length };
    let across = 0.5 * (xx + yy - root);
    Some((mean, along, libm::sqrtf(f32::max(across, 0.0) / count)))
}

/// Lists the points near a line, outwards, that no gap separates from the seed.
#[inline]
fn joined(
    local: &[Local],
    seed: usize,
    gap: f32,
    members: &mut Vec<u16, MAX_LOCAL>,
    near: impl Fn(&Local) -> bool,
) {
    members.clear();
    let mut last = local[seed].place.x;
    for k in (0..seed).rev() {
        if last - local[k].place.x > gap {
            break;
        }
        if near(&local[k]) {
            last = local[k].place.x;
            let _ = members.push(k as u16); // as many as there are
        }
    }
    members.reverse();
    last = local[seed].place.x;
    for (k, other) in local.iter().enumerate().skip(seed) {
        if other.place.x - last > gap {
            break;
        }
        if near(other) {
            last = other.place.x;
            let _ = members.push(k as u16);
        }
    }
}

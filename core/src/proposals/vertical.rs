//! Vertical edges: chains of points that gravity links, row by row.
use super::edge::{EdgePoint, STEEP_STRIDE, VERTICAL};
use super::view::View;
use crate::lines::edge::unit;
use heapless::Vec;
use nalgebra::Vector2;

/// Vertical edges that are kept: the longest.
pub(super) const MAX_VERTICALS: usize = 64;
/// Chains that are being added to.
const MAX_CHAINS: usize = 48;
/// Farthest that a chain's next point lies below its last, units; and across, px, with so much for each pixel below.
const STEP_UNITS: f32 = 5.0;
const ACROSS_PX: f32 = 0.6;
const ACROSS_SLOPE: f32 = 0.06;
/// Least points of a chain whose own direction its next point is held against, and how far off that may lie, px.
const STRAIGHT_POINTS: f32 = 6.0;
const STRAIGHT_PX: f32 = 1.2;
/// Points come by rows; through the lens a later one may lie higher by no more than this, px.
const OUT_OF_ORDER_PX: f32 = 16.0;
/// Shortest edge, units, and its least points.
const LEAST_UNITS: f32 = 7.0;
const LEAST_POINTS: f32 = 3.0;
/// Largest angle to gravity of a long edge, beside the mount's tolerance, in units of its length.
const TURN_UNITS: f32 = 0.7;
/// Largest gap within one edge, units; and in its length. Farthest offset across the gap, px, and for each pixel of it.
const GAP_UNITS: f32 = 14.0;
const GAP_LENGTHS: f32 = 0.6;
const GAP_ACROSS_PX: f32 = 1.0;
const GAP_SLOPE: f32 = 0.04;

/// Sums over a set of points: number, mean, and the scatter round it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) count: f32,
    pub(super) mean: Vector2<f32>,
    xx: f32,
    xy: f32,
    yy: f32,
    gradient: f32,
    curvature: f32,
}

impl Sums {
    pub(super) fn add(&mut self, place: Vector2<f32>, point: &EdgePoint) {
        self.merge(&Sums {
            count: 1.0,
            mean: place,
            gradient: point.gradient(),
            curvature: f32::from(point.curvature),
            ..Self::default()
        });
    }

    fn merge(&mut self, other: &Self) {
        let total = self.count + other.count;
        let (offset, share) = (other.mean - self.mean, other.count / total);
        let joint = self.count * share;
        self.mean += offset * share;
        self.xx += other.xx + joint * offset.x * offset.x;
        self.xy += other.xy + joint * offset.x * offset.y;
        self.yy += other.yy + joint * offset.y * offset.y;
        self.gradient += other.gradient;
        self.curvature += other.curvature;
        self.count = total;
    }

    /// The direction of the largest scatter near `seed`, and the root mean square across it.
    pub(super) fn direction(&self, seed: Vector2<f32>) -> (Vector2<f32>, f32) {
        let normal = Vector2::new(-seed.y, seed.x);
        let of = |a: Vector2<f32>, b: Vector2<f32>| {
            a.x * b.x * self.xx + (a.x * b.y + a.y * b.x) * self.xy + a.y * b.y * self.yy
        };
        let (tt, tn, nn) = (of(seed, seed), of(seed, normal), of(normal, normal));
        // The angle is small: tan φ ≈ S_tn/(S_tt − S_nn).
        let turn = tn / (tt - nn).max(1e-3);
        let along = (seed + normal * turn) / libm::sqrtf(1.0 + turn * turn);
        let across = (nn - turn * tn).max(0.0);
        (along, libm::sqrtf(across / self.count.max(1.0)))
    }
}

/// A vertical edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertical {
    sums: Sums,
    /// The unit vector downwards along it.
    pub(super) along: Vector2<f32>,
    pub(super) top: Vector2<f32>,
    pub(super) bottom: Vector2<f32>,
    /// Of its gradient, as points have it.
    pub(super) direction: u8,
    /// Angle to gravity, rad.
    pub(super) turn: f32,
    /// Root mean square distance of the points, px.
    pub(super) residual: f32,
}

impl Vertical {
    /// An edge of no length, and without points, at a bend of the floor's edge.
    pub(super) fn at_bend(place: Vector2<f32>, gravity: Vector2<f32>) -> Self {
        let sums = Sums { mean: place, ..Sums::default() };
        Self { sums, along: gravity, top: place, bottom: place, direction: 0, turn: 0.0, residual: 0.0 }
    }

    /// The unit vector across it, to the right when it points down.
    pub(super) fn right(&self) -> Vector2<f32> {
        Vector2::new(self.along.y, -self.along.x)
    }

    pub(super) fn middle(&self) -> Vector2<f32> {
        self.sums.mean
    }

    /// Its lower end, on the line.
    pub(super) fn foot(&self) -> Vector2<f32> {
        self.at(self.along.dot(&(self.bottom - self.sums.mean)))
    }

    fn at(&self, position: f32) -> Vector2<f32> {
        self.sums.mean + self.along * position
    }

    pub(super) fn length(&self) -> f32 {
        self.along.dot(&(self.bottom - self.top))
    }

    pub(super) fn points(&self) -> f32 {
        self.sums.count
    }

    /// Mean gradient, grey levels per pixel.
    pub(super) fn gradient(&self) -> f32 {
        self.sums.gradient / self.sums.count.max(1.0)
    }

    /// Width of the profile as a Gaussian's deviation, px.
    pub(super) fn width(&self) -> f32 {
        if self.sums.count == 0.0 {
            return 0.0;
        }
        libm::sqrtf(256.0 * self.sums.count / self.sums.curvature.max(1.0))
    }

    /// Its direction, angle and residual, from its sums.
    fn settle(&mut self, view: &View) {
        let gravity = view.gravity(self.sums.mean);
        (self.along, self.residual) = self.sums.direction(gravity);
        self.turn = libm::asinf(self.along.perp(&gravity).abs().min(1.0));
    }
}

/// A vertical edge that may go on.
#[derive(Clone, Copy, Debug)]
struct Chain {
    sums: Sums,
    first: Vector2<f32>,
    last: Vector2<f32>,
    direction: u8,
}

impl Chain {
    /// How far across the chain a point lies that may be its next, px.
    fn reach(&self, point: &EdgePoint, place: Vector2<f32>, gravity: Vector2<f32>, step: f32) -> Option<f32> {
        if point.direction.wrapping_sub(self.direction).wrapping_add(64) >= 128 {
            return None;
        }
        let moved = place - self.last;
        let along = gravity.dot(&moved);
        let across = gravity.perp(&moved).abs();
        let near = along > 0.0 && along <= step && across <= ACROSS_PX + ACROSS_SLOPE * along;
        if !near {
            return None;
        }
        if self.sums.count >= STRAIGHT_POINTS {
            let (direction, _) = self.sums.direction(gravity);
            if direction.perp(&(place - self.sums.mean)).abs() > STRAIGHT_PX {
                return None;
            }
        }
        Some(across)
    }
}

/// The vertical edges of a picture's points, in the order of rows.
pub(super) struct Verticals {
    pub(super) found: Vec<Vertical, MAX_VERTICALS>,
    /// Given up for longer ones.
    pub(super) lost: u32,
}

/// Links the points to vertical edges within `tolerance` of gravity.
pub(super) fn verticals(points: &[EdgePoint], view: &View, tolerance: f32) -> Verticals {
    let mut all = Verticals { found: Vec::new(), lost: 0 };
    let mut chains = Vec::<Chain, MAX_CHAINS>::new();
    let step = (STEP_UNITS * view.unit).max(2.5 * STEEP_STRIDE as f32);
    for point in points.iter().filter(|point| point.is(VERTICAL)) {
        let place = point.place();
        let mut k = 0;
        while let Some(chain) = chains.get(k) {
            if chain.last.y + step + OUT_OF_ORDER_PX < place.y {
                let done = chains.swap_remove(k);
                all.close(&done, view, tolerance);
            } else {
                k += 1;
            }
        }
        let gravity = view.gravity(place);
        let next = chains
            .iter_mut()
            .filter_map(|chain| Some((chain.reach(point, place, gravity, step)?, chain)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, chain)) = next {
            chain.sums.add(place, point);
            chain.last = place;
            continue;
        }
        if chains.is_full() {
            let oldest = chains.iter().enumerate().min_by(|a, b| a.1.last.y.total_cmp(&b.1.last.y));
            if let Some((k, _)) = oldest {
                let done = chains.swap_remove(k);
                all.lost += 1;
                all.close(&done, view, tolerance);
            }
        }
        let mut chain =
            Chain { sums: Sums::default(), first: place, last: place, direction: point.direction };
        chain.sums.add(place, point);
        let _ = chains.push(chain); // there is room
    }
    for chain in &chains {
        all.close(chain, view, tolerance);
    }
    all.bridge(view);
    let least = LEAST_UNITS * view.unit;
    all.found.retain(|vertical| {
        let length = vertical.length();
        length >= least && vertical.turn <= tolerance + TURN_UNITS * view.unit / length
    });
    all
}

impl Verticals {
    fn close(&mut self, chain: &Chain, view: &View, tolerance: f32) {
        if chain.sums.count < LEAST_POINTS {
            return;
        }
        let mut vertical = Vertical {
            sums: chain.sums,
            along: Vector2::y(),
            top: chain.first,
            bottom: chain.last,
            direction: chain.direction,
            turn: 0.0,
            residual: 0.0,
        };
        vertical.settle(view);
        let length = vertical.length();
        // Pieces may be shorter, and turned by more, than what they are bridged to.
        if length < 0.5 * LEAST_UNITS * view.unit
            || vertical.turn > tolerance + 2.0 * TURN_UNITS * view.unit / length
        {
            return;
        }
        if self.found.push(vertical).is_err() {
            self.lost += 1;
            let shortest = self.found.iter_mut().min_by(|a, b| a.length().total_cmp(&b.length()));
            if let Some(shortest) = shortest.filter(|shortest| shortest.length() < length) {
                *shortest = vertical;
            }
        }
    }

    /// Joins pieces of one edge.
    fn bridge(&mut self, view: &View) {
        let mut k = 0;
        while let Some(upper) = self.found.get(k).copied() {
            let joined = self.found.iter().enumerate().filter(|(other, _)| *other != k).find(|(_, lower)| {
                let moved = lower.top - upper.bottom;
                let gap = upper.along.dot(&moved);
                let longest = (GAP_UNITS * view.unit).min(GAP_LENGTHS * (upper.length() + lower.length()));
                let same = lower.direction.wrapping_sub(upper.direction).wrapping_add(64) < 128;
                let slack = GAP_ACROSS_PX + GAP_SLOPE * gap.max(0.0);
                let off = upper.along.perp(&(lower.sums.mean - upper.sums.mean)).abs();
                same && (-2.0..=longest).contains(&gap)
                    && upper.along.perp(&moved).abs() <= slack
                    && off <= 2.0 * slack
            });
            let Some((other, lower)) = joined.map(|(other, lower)| (other, *lower)) else {
                k += 1;
                continue;
            };
            if let Some(upper) = self.found.get_mut(k) {
                upper.sums.merge(&lower.sums);
                upper.bottom = lower.bottom;
                upper.settle(view);
            }
            self.found.swap_remove(other);
            k = 0;
        }
    }
}

/// The normal of a vertical edge, towards the brighter side.
pub(super) fn normal(vertical: &Vertical) -> Vector2<f32> {
    let right = vertical.right();
    if unit(vertical.direction).dot(&right) >= 0.0 { right } else { -right }
}

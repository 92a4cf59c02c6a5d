//! Bends of the floor's edge: feet of vertical edges too faint to be seen, white on white.
use super::edge::{EdgePoint, FLOOR};
use super::vertical::{Sums, Vertical};
use super::view::View;
use crate::lines::edge::unit;
use heapless::Vec;
use nalgebra::Vector2;

/// Bends that are kept: those between the longest pieces.
pub(super) const MAX_KINKS: usize = 24;
/// Pieces that are being added to.
const MAX_CHAINS: usize = 48;
/// Columns that points are sorted by.
const COLUMNS: usize = 1024;
/// Farthest that a piece's next point lies beside its last, px; and across its own direction, px, with so much for each beside.
const STEP_PX: f32 = 4.5;
const ACROSS_PX: f32 = 0.8;
const ACROSS_SLOPE: f32 = 0.35;
/// Largest turn between a piece and its next point, in 256ths of a turn: 34°.
const TURN: u8 = 24;
/// Least points of a piece, and the farthest that its next may lie off its line, px.
const LEAST_POINTS: f32 = 5.0;
const STRAIGHT_PX: f32 = 0.7;
/// Least length of a piece, units, and the farthest that a bend lies from where they part.
const LEAST_UNITS: f32 = 4.5;
const APART_UNITS: f32 = 6.0;
/// Least sine of the bend in the picture: 5°.
const LEAST_SINE: f32 = 0.087;

/// A straight piece of an edge of the floor.
#[derive(Clone, Copy, Debug)]
struct Piece {
    sums: Sums,
    first: Vector2<f32>,
    last: Vector2<f32>,
    direction: u8,
}

impl Piece {
    fn new(point: &EdgePoint, place: Vector2<f32>) -> Self {
        let mut sums = Sums::default();
        sums.add(place, point);
        Self { sums, first: place, last: place, direction: point.direction }
    }

    fn along(&self) -> Vector2<f32> {
        self.sums.direction((self.last - self.first).try_normalize(1e-3).unwrap_or(Vector2::x())).0
    }

    fn is_long(&self, view: &View) -> bool {
        let least = LEAST_UNITS * view.unit.max(0.7);
        self.sums.count >= LEAST_POINTS && (self.last - self.first).norm_squared() >= least * least
    }
}

/// An edge that may go on, with the straight piece before the last bend.
#[derive(Clone, Copy, Debug)]
struct Chain {
    piece: Piece,
    before: Option<Piece>,
}

/// A bend as an upright edge of no length, and the points that speak for it.
type Kink = (f32, Vertical);

/// The bends among the floor's points; `memory` is for the points' order: two words each, and a word for each column.
pub(super) fn kinks(points: &[EdgePoint], memory: &mut [u16], view: &View) -> Vec<Kink, MAX_KINKS> {
    let mut kinks = Vec::new();
    let mut chains = Vec::<Chain, MAX_CHAINS>::new();
    for index in by_columns(points, memory) {
        let Some(point) = points.get(usize::from(*index)) else { continue };
        let place = point.place();
        let mut k = 0;
        while let Some(chain) = chains.get(k) {
            if chain.piece.last.x + STEP_PX < place.x {
                let done = chains.swap_remove(k);
                bend(&done, view, &mut kinks);
            } else {
                k += 1;
            }
        }
        let gradient = unit(point.direction);
        let next = chains
            .iter_mut()
            .filter_map(|chain| {
                let moved = place - chain.piece.last;
                let across = gradient.dot(&moved).abs();
                let turn = point.direction.wrapping_sub(chain.piece.direction).wrapping_add(TURN);
                let near = moved.x > 0.2
                    && moved.y.abs() <= 2.0 * STEP_PX
                    && turn <= 2 * TURN
                    && across <= ACROSS_PX + ACROSS_SLOPE * moved.x;
                near.then_some((across, chain))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, chain)) = next else {
            if chains.is_full() {
                let oldest =
                    chains.iter().enumerate().min_by(|a, b| a.1.piece.last.x.total_cmp(&b.1.piece.last.x));
                if let Some((k, _)) = oldest {
                    let done = chains.swap_remove(k);
                    bend(&done, view, &mut kinks);
                }
            }
            let _ = chains.push(Chain { piece: Piece::new(point, place), before: None }); // there is room
            continue;
        };
        let off = chain.piece.along().perp(&(place - chain.piece.sums.mean)).abs();
        if chain.piece.sums.count >= LEAST_POINTS && off > STRAIGHT_PX {
            let done = *chain;
            if done.piece.is_long(view) {
                chain.before = Some(done.piece);
            }
            chain.piece = Piece::new(point, place);
            bend(&done, view, &mut kinks);
        } else {
            chain.piece.sums.add(place, point);
            chain.piece.last = place;
            chain.piece.direction = point.direction;
        }
    }
    for chain in &chains {
        bend(chain, view, &mut kinks);
    }
    kinks
}

/// Adds the bend between a chain's two straight pieces, if it is one.
fn bend(chain: &Chain, view: &View, kinks: &mut Vec<Kink, MAX_KINKS>) {
    let Some(before) = chain.before.as_ref().filter(|_| chain.piece.is_long(view)) else { return };
    let (first, second) = (before.along(), chain.piece.along());
    let sine = first.perp(&second);
    if sine.abs() < LEAST_SINE {
        return;
    }
    let moved = chain.piece.sums.mean - before.sums.mean;
    let place = before.sums.mean + first * (moved.perp(&second) / sine);
    let apart = APART_UNITS * view.unit.max(0.7);
    let near = |end: Vector2<f32>| (end - place).norm_squared() <= apart * apart;
    if !near(before.last) || !near(chain.piece.first) {
        return;
    }
    let weight = before.sums.count.min(chain.piece.sums.count);
    let kink = (weight, Vertical::at_bend(place, view.gravity(place)));
    if kinks.is_full() {
        let least = kinks.iter_mut().min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(least) = least.filter(|least| least.0 < weight) {
            *least = kink;
        }
        return;
    }
    let _ = kinks.push(kink);
}

/// The indices of the points on flat edges of the floor, from the left to the right.
fn by_columns<'m>(points: &[EdgePoint], memory: &'m mut [u16]) -> &'m [u16] {
    let Some((starts, order)) = memory.split_at_mut_checked(COLUMNS) else { return &[] };
    starts.fill(0);
    let column = |point: &EdgePoint| {
        let gradient = unit(point.direction);
        let flat = point.is(FLOOR) && gradient.y.abs() >= 0.5;
        flat.then(|| ((point.place().x + 0.5 * COLUMNS as f32).max(0.0) as usize).min(COLUMNS - 1))
    };
    let mut count = 0;
    for column in points.iter().filter_map(column) {
        if let Some(start) = starts.get_mut(column) {
            *start += 1;
            count += 1;
        }
    }
    let mut next = 0;
    for start in &mut *starts {
        (*start, next) = (next, next + *start);
    }
    for (index, point) in (0..).zip(points) {
        if let Some(start) = column(point).and_then(|column| starts.get_mut(column)) {
            if let Some(slot) = order.get_mut(usize::from(*start)) {
                *slot = index;
            }
            *start += 1;
        }
    }
    let count = count.min(order.len());
    order.get(..count).unwrap_or_default()
}

//! Feet: where a vertical edge crosses edges of the floor to its left and right.
use super::config::ProposalConfig;
use super::edge::{EdgePoint, FLOOR};
use super::floor_line::{Local, MAX_LOCAL, MAX_SIDE, Side, sides};
use super::vertical::Vertical;
use super::view::View;
use crate::sort::sort_by_key;
use heapless::Vec;
use nalgebra::Vector2;

/// Floor points are taken so far beside a vertical edge, units.
const BESIDE_UNITS: [f32; 2] = [1.5, 22.0];
/// Lengths of the vertical edge above its end, and below it units and at most so many more for a skirting board.
const ABOVE_LENGTHS: f32 = 0.6;
const ABOVE_UNITS: f32 = 5.0;
const BELOW_UNITS: f32 = 9.0;
const MOST_SKIRTING_UNITS: f32 = 45.0;
/// Crossings so near are one foot, units.
const SAME_UNITS: f32 = 2.2;

/// A foot: its floor lines' places among those of the left and of the right.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// Below the vertical edge's lower end, px.
    pub(super) below: f32,
    pub(super) left: Option<u8>,
    pub(super) right: Option<u8>,
}

/// The floor lines beside a vertical edge and the feet that they make.
pub(super) struct Feet {
    pub(super) origin: Vector2<f32>,
    pub(super) local: [Vec<Local, MAX_LOCAL>; 2],
    pub(super) sides: [Vec<Side, MAX_SIDE>; 2],
    pub(super) found: Vec<Foot, { 2 * MAX_SIDE }>,
}

/// The points of a picture by rows: where those of a range of rows are.
pub(super) struct Rows {
    /// Least and largest coordinate downwards of each block of points.
    blocks: Vec<[i16; 2], 512>,
    size: usize,
}

impl Rows {
    pub(super) fn new(points: &[EdgePoint]) -> Self {
        let size = points.len().div_ceil(512).max(32);
        let mut blocks = Vec::new();
        for block in points.chunks(size) {
            let mut range = [i16::MAX, i16::MIN];
            for point in block {
                let down = point.down() as i16;
                range = [range[0].min(down - 1), range[1].max(down + 1)];
            }
            let _ = blocks.push(range); // there are no more than it holds
        }
        Self { blocks, size }
    }

    /// Shows the points between two coordinates downwards, and some more, with their places.
    #[inline]
    pub(super) fn each(
        &self,
        points: &[EdgePoint],
        top: f32,
        bottom: f32,
        mut show: impl FnMut(u16, &EdgePoint),
    ) {
        for (k, (range, block)) in self.blocks.iter().zip(points.chunks(self.size)).enumerate() {
            if f32::from(range[0]) > bottom || f32::from(range[1]) < top {
                continue;
            }
            for (index, point) in (k * self.size..).zip(block) {
                show(index as u16, point);
            }
        }
    }
}

impl Feet {
    /// The feet of a vertical edge.
    pub(super) fn new(
        vertical: &Vertical,
        points: &[EdgePoint],
        rows: &Rows,
        view: &View,
        config: &ProposalConfig,
    ) -> Self {
        let (origin, down, right) = (vertical.foot(), vertical.along, vertical.right());
        let unit = view.unit;
        let above = (ABOVE_LENGTHS * vertical.length()).max(ABOVE_UNITS * unit + 0.05 * vertical.length());
        let fall = view.fall(origin).max(0.02);
        // The board's height over the range, foreshortened: h tan δ/H over 1 + tan² δ.
        let skirting = config.skirting_height * fall / (view.finder.mount().height() * (1.0 + fall * fall))
            * super::view::UNIT_FOCAL;
        let below = unit * (BELOW_UNITS + skirting.min(MOST_SKIRTING_UNITS));
        let [nearest, farthest] = BESIDE_UNITS.map(|beside| beside * unit);
        let mut local = [Vec::new(), Vec::new()];
        let slack = farthest + 2.0;
        rows.each(points, origin.y - above - slack, origin.y + below + slack, |index, point| {
            let moved = point.place() - origin;
            let beside = right.dot(&moved);
            if beside.abs() < nearest || beside.abs() > farthest || !point.is(FLOOR) {
                return; // as most
            }
            let depth = down.dot(&moved);
            if depth < -above - 0.5 * beside.abs() || depth > below + 0.5 * beside.abs() {
                return;
            }
            let [left, right] = &mut local;
            let side = if beside < 0.0 { left } else { right };
            let place = Vector2::new(beside.abs(), depth);
            let _ = side.push(Local { place, index, direction: point.direction, ..Default::default() });
        });
        let mut found = [Vec::new(), Vec::new()];
        for ((local, found), outwards) in local.iter_mut().zip(&mut found).zip([-right, right]) {
            sort_by_key(local, |point| point.place.x);
            *found = sides(local, points, view, outwards, down);
            found.retain(|side| (-above..=below).contains(&side.crossing));
        }
        let feet = pair(&found, unit);
        Self { origin, local, sides: found, found: feet }
    }

    /// The floor lines of a foot: left, right.
    pub(super) fn sides_of(&self, foot: &Foot) -> [Option<&Side>; 2] {
        let [left, right] = &self.sides;
        let of = |sides: &'_ Vec<Side, MAX_SIDE>, place: Option<u8>| {
            place.map(usize::from).filter(|k| *k < sides.len())
        };
        [of(left, foot.left).and_then(|k| left.get(k)), of(right, foot.right).and_then(|k| right.get(k))]
    }
}

/// The feet of the floor lines on both sides: crossings near to one another are one.
fn pair([left, right]: &[Vec<Side, MAX_SIDE>; 2], unit: f32) -> Vec<Foot, { 2 * MAX_SIDE }> {
    let mut feet = Vec::new();
    let mut taken = [false; MAX_SIDE];
    let weight = |side: &Side| f32::from(side.points) / (1.0 + side.begin / unit);
    for (k, one) in (0_u8..).zip(left) {
        let partner = (0_u8..)
            .zip(right)
            .filter(|(j, other)| {
                let free = taken.get(usize::from(*j)).is_some_and(|taken| !taken);
                // The wider apart, the less the crossing says.
                free && (other.crossing - one.crossing).abs() <= SAME_UNITS * unit.max(0.7)
            })
            .min_by(|a, b| {
                (a.1.crossing - one.crossing).abs().total_cmp(&(b.1.crossing - one.crossing).abs())
            });
        let foot = match partner {
            Some((j, other)) => {
                if let Some(taken) = taken.get_mut(usize::from(j)) {
                    *taken = true;
                }
                let (a, b) = (weight(one), weight(other));
                let below = (one.crossing * a + other.crossing * b) / (a + b);
                Foot { below, left: Some(k), right: Some(j) }
            }
            None => Foot { below: one.crossing, left: Some(k), right: None },
        };
        let _ = feet.push(foot);
    }
    for (j, other) in (0_u8..).zip(right) {
        if taken.get(usize::from(j)).is_some_and(|taken| !taken) {
            let _ = feet.push(Foot { below: other.crossing, left: None, right: Some(j) });
        }
    }
    sort_by_key(&mut feet, |foot: &Foot| foot.below);
    feet
}

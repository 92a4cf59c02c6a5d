//! Lists of edge points: their indices, in lent memory.
use super::edge::EdgePoint;
use super::extraction::MAX_LINES;

/// Owner numbers, of both kinds of lines.
const OWNERS: usize = 2 * MAX_LINES;

/// The points of every line, in the points' order.
pub(super) struct Members<'a> {
    /// One line's after the other's.
    indices: &'a mut [u16],
    ranges: [(u16, u16); OWNERS],
}

impl<'a> Members<'a> {
    pub(super) fn new(points: &[EdgePoint], indices: &'a mut [u16]) -> Self {
        let mut ranges = [(0, 0); OWNERS];
        for point in points {
            if let Some((_, count)) = ranges.get_mut(usize::from(point.owner)) {
                *count += 1;
            }
        }
        let mut next = 0;
        for (start, end) in &mut ranges {
            (*start, next) = (next, next + *end);
            *end = *start;
        }
        for (index, point) in (0..).zip(points) {
            if let Some((_, end)) = ranges.get_mut(usize::from(point.owner))
                && let Some(slot) = indices.get_mut(usize::from(*end))
            {
                *slot = index;
                *end += 1;
            }
        }
        Self { indices, ranges }
    }

    /// The indices of a line's points.
    pub(super) fn of(&self, owner: u8) -> &[u16] {
        let (start, end) = self.ranges.get(usize::from(owner)).copied().unwrap_or_default();
        self.indices.get(usize::from(start)..usize::from(end)).unwrap_or_default()
    }

    /// Those of them that still are the line's; the others are forgotten.
    pub(super) fn keep(&mut self, points: &[EdgePoint], owner: u8) -> &[u16] {
        if let Some((start, end)) = self.ranges.get_mut(usize::from(owner))
            && let Some(indices) = self.indices.get_mut(usize::from(*start)..usize::from(*end))
        {
            *end = *start + keep(points, indices, |point| point.owner == owner) as u16;
        }
        self.of(owner)
    }
}

/// Keeps the indices of the points to keep, in order; returns how many those are.
pub(super) fn keep(points: &[EdgePoint], indices: &mut [u16], wanted: impl Fn(&EdgePoint) -> bool) -> usize {
    let mut left = 0;
    for from in 0..indices.len() {
        let Some(index) = indices.get(from).copied() else { break };
        let Some(slot) = indices.get_mut(left) else { break };
        *slot = index; // counted or overwritten: no branch that cannot be foreseen
        left += usize::from(points.get(usize::from(index)).is_some_and(&wanted));
    }
    left
}

/// Lists the points to keep among `all` in `members`, which has room for all; returns how many those are.
pub(super) fn gather(
    points: &[EdgePoint],
    all: &[u16],
    members: &mut [u16],
    wanted: impl Fn(&EdgePoint) -> bool,
) -> usize {
    let mut count = 0;
    for index in all {
        let Some(slot) = members.get_mut(count) else { break };
        *slot = *index;
        count += usize::from(points.get(usize::from(*index)).is_some_and(&wanted));
    }
    count
}

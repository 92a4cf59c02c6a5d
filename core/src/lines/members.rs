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

/// The points with these indices.
pub(super) fn at<'p>(
    points: &'p [EdgePoint],
    indices: &'p [u16],
) -> impl Iterator<Item = &'p EdgePoint> + Clone {
    indices.iter().filter_map(|index| points.get(usize::from(*index)))
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

/// The points that lines of a pass are made of, with their directions: most looks at a point are only at its direction.
pub(super) struct Candidates<'a> {
    entries: &'a mut [[u16; 2]],
    len: usize,
}

impl<'a> Candidates<'a> {
    /// Lists the points to keep, as far as there is room in `words`, of which each takes two.
    pub(super) fn new(
        points: &[EdgePoint],
        words: &'a mut [u16],
        wanted: impl Fn(&EdgePoint) -> bool,
    ) -> Self {
        let (entries, _) = words.as_chunks_mut::<2>();
        let mut len = 0;
        for (point, index) in points.iter().zip(0..) {
            let Some(slot) = entries.get_mut(len) else { break };
            *slot = [index, point.direction.into()]; // counted or overwritten, as everywhere here
            len += usize::from(wanted(point));
        }
        Self { entries, len }
    }

    /// Lists those within `tolerance` of a direction in `members`, which has room for all; returns how many those are.
    pub(super) fn alike(&self, direction: u8, tolerance: u8, members: &mut [u16]) -> usize {
        let first = direction.wrapping_sub(tolerance);
        let mut count = 0;
        for [index, direction] in self.entries.get(..self.len).unwrap_or_default() {
            let Some(slot) = members.get_mut(count) else { break };
            *slot = *index;
            count += usize::from((*direction as u8).wrapping_sub(first) <= 2 * tolerance);
        }
        count
    }

    /// Forgets the points that are not to be kept.
    pub(super) fn keep(&mut self, points: &[EdgePoint], wanted: impl Fn(&EdgePoint) -> bool) {
        let mut left = 0;
        for from in 0..self.len {
            let Some(entry) = self.entries.get(from).copied() else { break };
            let Some(slot) = self.entries.get_mut(left) else { break };
            *slot = entry;
            let [index, _] = entry;
            left += usize::from(points.get(usize::from(index)).is_some_and(&wanted));
        }
        self.len = left;
    }
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

use super::config::ExtractConfig;
use super::edge::{EdgePoint, NO_OWNER, unit};
use super::extraction::{Line, MAX_LINES};
use super::fit::{Sampling, fit};
use super::hough::{Accumulator, Pass, Peak, VOTE};
use super::members::{Candidates, at, keep};
use crate::sort::sort_by_key;
use heapless::Vec;
use nalgebra::Vector2;

/// Distances from the current line within which points are taken, px: the first for the Hough maximum (to which
/// a cell of the accumulator is added), then for each fit.
const GATES_PX: [f32; 3] = [1.5, 2.0, 1.0];
/// For the first of these gates a line's points are collected anew from the whole pass; later gates only leave points out.
const WIDE_GATES: usize = 2;
/// Least share of the pixels along a line that have a point.
const LEAST_DENSITY: f32 = 0.6;

/// Words of memory that the search needs for a point: its index and direction among those of the pass, and its index among
/// those of a line.
pub(super) const WORDS_BY_POINT: usize = 3;

/// The search for the lines of one kind: vertical or of the floor.
pub(super) struct Search<'a> {
    pub(super) config: &'a ExtractConfig,
    pub(super) sampling: Sampling,
    /// Origin of the Hough transform and largest distance from it, ideal pixels.
    pub(super) origin: Vector2<f32>,
    pub(super) radius: f32,
    /// Shortest line, px.
    pub(super) min_length: f32,
    /// Owner number of line 0 of the kind.
    pub(super) first_owner: u8,
}

/// What did not fit during a search.
#[derive(Default)]
pub(super) struct Skipped {
    pub(super) peaks: u32,
    pub(super) lines: u32,
}

impl Search<'_> {
    /// Adds the lines of one polarity that `accept` approves, and marks their points as theirs.
    pub(super) fn run(
        &self,
        pass: &Pass,
        points: &mut [EdgePoint],
        memory: &mut [u16],
        lines: &mut Vec<Line, MAX_LINES>,
        accept: &dyn Fn(&Line) -> bool,
    ) -> Skipped {
        let mut accumulator = Accumulator::new(memory, pass, self.radius);
        accumulator.vote(points, pass, self.origin);
        let least = (self.least_points() * f32::from(VOTE) * 0.5) as u16;
        let (peaks, truncated) = accumulator.peaks(pass, least.max(VOTE));
        let cell = 1.0 / accumulator.bins_by_pixel().max(0.1);
        let mut skipped = Skipped { peaks: truncated, lines: 0 };

        // The accumulator has done its work: its memory now lists the points of the pass and those of a line.
        let (all, members) = memory.split_at_mut(memory.len() / WORDS_BY_POINT * 2);
        let is_free = |point: &EdgePoint| point.owner == NO_OWNER;
        let mut all =
            Candidates::new(points, all, |point| is_free(point) & pass.bin(point.direction).is_some());
        for peak in &peaks {
            // Several stretches of one line share a maximum.
            while let Some((line, run)) = self.line_at(peak, cell, points, &all, members) {
                let owner = match self.place(line, accept(&line), lines, points, &mut skipped) {
                    Some(slot) => self.first_owner + slot,
                    None => REFUSED,
                };
                for index in run {
                    if let Some(point) = points.get_mut(usize::from(*index)) {
                        point.owner = owner;
                    }
                }
                all.keep(points, is_free);
            }
        }
        for point in points.iter_mut().filter(|point| point.owner == REFUSED) {
            point.owner = NO_OWNER;
        }
        skipped
    }

    fn least_points(&self) -> f32 {
        (self.min_length * LEAST_DENSITY * 0.7 / self.sampling.stride as f32).max(8.0)
    }

    /// The longest stretch of a line near a maximum and the indices of its points.
    fn line_at<'m>(
        &self,
        peak: &Peak,
        cell: f32,
        points: &[EdgePoint],
        all: &Candidates<'_>,
        members: &'m mut [u16],
    ) -> Option<(Line, &'m [u16])> {
        let normal = unit(peak.direction);
        let mut line = Line { normal, centroid: self.origin + normal * peak.rho, ..Default::default() };
        let tolerance = (self.config.direction_tolerance * (128.0 / core::f32::consts::PI)) as u8 + 1;
        let mut run = 0..0;
        let mut count = 0;
        for (number, gate) in GATES_PX.into_iter().enumerate() {
            let direction = line.direction();
            let (width, level) =
                (if number == 0 { gate + cell } else { gate }, line.normal.dot(&line.centroid));
            let alike = |point: &EdgePoint| {
                (point.direction.wrapping_sub(direction) as i8).unsigned_abs() <= tolerance
            };
            let near = |point: &EdgePoint| (line.normal.dot(&point.position) - level).abs() <= width;
            let position =
                |index: &u16| points.get(usize::from(*index)).map_or(0.0, |p| line.position(p.position));
            if number < WIDE_GATES {
                count = all.alike(direction, tolerance, members);
                count = keep(points, members.get_mut(..count)?, near);
                if (count as f32) < self.least_points() {
                    return None;
                }
                sort(members.get_mut(..count)?, position);
            } else {
                // The line has hardly moved: its points are among those gathered last, and in order.
                count = keep(points, members.get_mut(..count)?, |point| alike(point) & near(point));
            }
            let max_gap = self.config.max_gap_px.max(2.0 * self.sampling.stride(line.normal) as f32);
            run = longest_run(members.get(..count)?, position, max_gap);
            if (run.len() as f32) < self.least_points() {
                return None;
            }
            line = fit(at(points, members.get(run.clone())?), line.normal, self.sampling)?;
        }
        let density = f32::from(line.points) * self.sampling.stride(line.normal) as f32
            / (line.length() * line.normal.amax());
        let fits = line.length() >= self.min_length && density >= LEAST_DENSITY;
        fits.then(|| (line, members.get(run).unwrap_or_default()))
    }

    /// The slot that the line gets; the shortest one goes when there is none left.
    fn place(
        &self,
        line: Line,
        accepted: bool,
        lines: &mut Vec<Line, MAX_LINES>,
        points: &mut [EdgePoint],
        skipped: &mut Skipped,
    ) -> Option<u8> {
        if !accepted {
            return None;
        }
        if lines.push(line).is_ok() {
            return Some(lines.len() as u8 - 1);
        }
        skipped.lines += 1;
        let shortest = (0_u8..).zip(lines.iter_mut()).min_by(|a, b| a.1.length().total_cmp(&b.1.length()));
        let (slot, shortest) = shortest?;
        if shortest.length() >= line.length() {
            return None;
        }
        *shortest = line;
        for point in points.iter_mut().filter(|point| point.owner == self.first_owner + slot) {
            point.owner = REFUSED;
        }
        Some(slot)
    }
}

/// The point was on a line that did not stay: no later maximum of the pass may have it.
const REFUSED: u8 = 253;

/// Sorts by position. Points come row by row, and along a line rows and columns rise or fall together: nearly sorted,
/// perhaps backwards.
fn sort(indices: &mut [u16], position: impl Fn(&u16) -> f32) {
    if let (Some(first), Some(last)) = (indices.first(), indices.last())
        && position(first) > position(last)
    {
        indices.reverse();
    }
    sort_by_key(indices, position);
}

/// The run of sorted points without a gap above `max_gap` that has the most points.
fn longest_run(sorted: &[u16], position: impl Fn(&u16) -> f32, max_gap: f32) -> core::ops::Range<usize> {
    let mut best = 0..0;
    let mut start = 0;
    let mut last = f32::MIN;
    for (k, index) in sorted.iter().enumerate() {
        let here = position(index);
        if here - last > max_gap {
            start = k;
        }
        if k + 1 - start > best.len() {
            best = start..k + 1;
        }
        last = here;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn any_list_is_sorted(positions in prop::collection::vec(-50_i8..50, 0..400)) {
            let mut indices: Vec<u16> = (0..positions.len() as u16).collect();
            sort(&mut indices, |index| f32::from(positions[usize::from(*index)]));
            let mut expected = positions.clone();
            expected.sort_unstable();
            let sorted: Vec<_> = indices.iter().map(|index| positions[usize::from(*index)]).collect();
            prop_assert_eq!(sorted, expected);
        }
    }
}

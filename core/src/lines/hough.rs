use super::edge::{EdgePoint, unit};
use heapless::Vec;
use nalgebra::Vector2;

/// Maxima that are followed up, of one kind and polarity.
const MAX_PEAKS: usize = 16;
/// Angles of a pass, at most: half a turn in bins of two steps.
const MAX_ANGLES: usize = 65;
/// Cells that are looked at together for one that has enough votes.
const BLOCK: usize = 32;
/// What a point adds to one angle: shared between the two nearest distances.
pub(super) const VOTE: u16 = 4;

/// The angles of one pass of the transform: normals within `spread` steps of `centre`, in bins of two steps.
///
/// A line { x : x cos θ + y sin θ = ρ } gets the votes of the edge points on it whose own gradient points along θ
/// within a few bins, so a point adds to a handful of cells instead of a whole sinusoid: that is where the usual
/// transform spends its time and finds its false lines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pass {
    /// Middle of the normals' directions, in 256ths of a turn.
    pub(super) centre: u8,
    /// Largest deviation from it, in the same unit.
    pub(super) spread: u8,
    /// Bins on either side of a gradient's own that it votes for.
    pub(super) reach: u8,
}

impl Pass {
    pub(super) fn angles(&self) -> usize {
        usize::from(self.spread) + 1
    }

    /// The bin of a direction, or `None` outside the pass.
    pub(super) fn bin(&self, direction: u8) -> Option<usize> {
        let deviation = i32::from(direction.wrapping_sub(self.centre) as i8) + i32::from(self.spread);
        (0..=2 * i32::from(self.spread)).contains(&deviation).then_some((deviation / 2) as usize)
    }

    fn direction(&self, bin: usize) -> u8 {
        self.centre.wrapping_sub(self.spread).wrapping_add((2 * bin) as u8)
    }
}

/// A maximum of the accumulator.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peak {
    votes: u16,
    pub(super) direction: u8,
    /// Distance from the origin of the transform along the direction, px.
    pub(super) rho: f32,
}

/// The plane of (θ, ρ) laid over lent memory: its length decides how fine ρ is.
pub(super) struct Accumulator<'a> {
    votes: &'a mut [u16],
    distances: usize,
    /// Half of the range of ρ, px.
    radius: f32,
    bins_by_pixel: f32,
}

impl<'a> Accumulator<'a> {
    /// An empty plane for the angles of `pass` and distances up to `radius`.
    pub(super) fn new(memory: &'a mut [u16], pass: &Pass, radius: f32) -> Self {
        // Finer than a pixel only scatters the votes.
        let distances = (memory.len() / pass.angles()).min((2.0 * radius) as usize + 2);
        let votes = memory.get_mut(..distances * pass.angles()).unwrap_or_default();
        votes.fill(0);
        let bins_by_pixel = distances.saturating_sub(2) as f32 / (2.0 * radius);
        Self { votes, distances, radius, bins_by_pixel }
    }

    /// Bins to a pixel of distance.
    pub(super) fn bins_by_pixel(&self) -> f32 {
        self.bins_by_pixel
    }

    /// The votes of the points within the pass, seen from `origin`.
    pub(super) fn vote(&mut self, points: &[EdgePoint], pass: &Pass, origin: Vector2<f32>) {
        let reach = usize::from(pass.reach);
        // In votes, of which a cell has a power of two: the same digits.
        let by_pixel = self.bins_by_pixel * f32::from(VOTE);
        let middle = self.radius * by_pixel;
        let mut normals = [Vector2::zeros(); MAX_ANGLES];
        for (bin, normal) in normals.iter_mut().enumerate() {
            *normal = unit(pass.direction(bin)) * by_pixel;
        }
        for point in points {
            let Some(bin) = pass.bin(point.direction) else { continue };
            let offset = point.position - origin;
            let first = bin.saturating_sub(reach);
            let last = (bin + reach).min(pass.angles() - 1);
            let Some(angles) = self.votes.get_mut(first * self.distances..(last + 1) * self.distances) else {
                continue;
            };
            let normals = normals.get(first..=last).unwrap_or_default();
            for (normal, distances) in normals.iter().zip(angles.chunks_exact_mut(self.distances.max(1))) {
                let quarters = (normal.dot(&offset) + middle) as u32; // below 0 saturates
                let share = (quarters % u32::from(VOTE)) as u16;
                if let Some([near, far]) = distances
                    .get_mut((quarters / u32::from(VOTE)) as usize..)
                    .and_then(|d| d.first_chunk_mut())
                {
                    *near = near.saturating_add(VOTE - share);
                    *far = far.saturating_add(share);
                }
            }
        }
    }

    /// The highest local maxima with at least `least` votes, from the highest down, and how many did not fit.
    pub(super) fn peaks(&self, pass: &Pass, least: u16) -> (Vec<Peak, MAX_PEAKS>, u32) {
        let mut peaks = Vec::<Peak, MAX_PEAKS>::new();
        let mut truncated = 0;
        let row =
            |bin: usize| self.votes.get(bin * self.distances..(bin + 1) * self.distances).unwrap_or_default();
        // Few cells have enough: blocks of them are passed over at once.
        let blocks = (0..).step_by(BLOCK).zip(self.votes.chunks(BLOCK));
        let blocks =
            blocks.filter(|(_, block)| block.iter().fold(0, |most, votes| most.max(*votes)) >= least);
        let cells = blocks.flat_map(|(first, block)| (first..).zip(block));
        for (place, &votes) in cells.filter(|(_, votes)| **votes >= least) {
            let (bin, cell) = (place / self.distances, place % self.distances);
            let before = if bin > 0 { row(bin - 1) } else { &[] };
            let after = row(bin + 1);
            let around = cell.saturating_sub(1)..cell + 2;
            let most = |row: &[u16]| {
                let end = around.end.min(row.len());
                row.get(around.start..end).unwrap_or_default().iter().copied().max().unwrap_or(0)
            };
            let at = row(bin);
            let left = cell.checked_sub(1).and_then(|k| at.get(k)).copied().unwrap_or(0);
            let right = at.get(cell + 1).copied().unwrap_or(0);
            // Ties go to the first of equals.
            if votes <= left || votes < right || votes <= most(before) || votes < most(after) {
                continue;
            }
            // The centre of mass of three cells: finer than a cell.
            let mass = f32::from(left) + f32::from(votes) + f32::from(right);
            let fraction = (f32::from(right) - f32::from(left)) / mass;
            let rho = (cell as f32 + fraction) / self.bins_by_pixel - self.radius;
            let rank = peaks.iter().position(|peak| peak.votes < votes).unwrap_or(peaks.len());
            if peaks.is_full() {
                truncated += 1;
                if rank == peaks.len() {
                    continue;
                }
                peaks.truncate(MAX_PEAKS - 1);
            }
            let _ = peaks.insert(rank, Peak { votes, direction: pass.direction(bin), rho });
        }
        (peaks, truncated)
    }
}

use super::edge::{EdgePoint, SPARE, VERTICAL};
use super::view::View;

/// Cells of the map of vertical edges, and units to a cell.
const COLUMNS: usize = 48;
const ROWS: usize = 32;
const CELL_UNITS: [f32; 2] = [12.0, 16.0];
/// Points of vertical edges that a cell of one has.
const LEAST: u8 = 3;
/// A floor point serves a vertical edge beside it that is seen so many cells above, or below.
const ABOVE: usize = 4;
const BELOW: usize = 3;
/// The share of a full list that must be free again: an eighth.
const FREE: usize = 8;

/// The bookkeeping of a bounded list of edge points.
///
/// When it is full, points of the floor's edges go that have no vertical edge near: tiles and carpets fill a list, and no corner
/// is there. If those are few, every second point of flat edges goes, then the weakest points, wherever they are, and no such
/// points are taken any more.
#[derive(Clone, Debug)]
pub(super) struct EdgeList {
    /// Points in the list.
    pub(super) len: usize,
    /// Points that were found.
    pub(super) found: u32,
    /// Points given up because they were weak.
    pub(super) lost: u32,
    /// Whether flat edges have a point in every second column only.
    thinned: bool,
    /// Least code of a gradient.
    least: u8,
    /// How many points of vertical edges were found in a cell.
    upright: [[u8; COLUMNS]; ROWS],
}

impl Default for EdgeList {
    fn default() -> Self {
        Self { len: 0, found: 0, lost: 0, thinned: false, least: 0, upright: [[0; COLUMNS]; ROWS] }
    }
}

impl EdgeList {
    /// Adds a point; points come by rows.
    pub(super) fn push(&mut self, points: &mut [EdgePoint], point: EdgePoint, view: &View) {
        self.found += 1;
        let [column, row] = cell(&point, view);
        if point.is(VERTICAL)
            && let Some(count) = self.upright.get_mut(row).and_then(|row| row.get_mut(column))
        {
            *count = count.saturating_add(1);
        }
        if self.len >= points.len() {
            self.make_room(points, row, view);
        }
        if self.thinned && point.is(SPARE) {
            return;
        }
        if point.strength() >= self.least
            && let Some(slot) = points.get_mut(self.len)
        {
            *slot = point;
            self.len += 1;
        } else {
            self.lost += 1;
        }
    }

    /// Drops what cannot serve a corner, and if that is little the weakest; the newest point is in the map's row `now`.
    fn make_room(&mut self, points: &mut [EdgePoint], now: usize, view: &View) {
        let upright = self.upright;
        self.retain(points, |point| {
            let [column, row] = cell(point, view);
            if row + BELOW >= now {
                return true; // a vertical edge may still come
            }
            let columns = column.saturating_sub(2)..(column + 3).min(COLUMNS);
            let rows =
                upright.get(row.saturating_sub(ABOVE)..(row + BELOW + 1).min(ROWS)).unwrap_or_default();
            rows.iter()
                .flat_map(|row| row.get(columns.clone()).unwrap_or_default())
                .any(|count| *count >= LEAST)
        });
        let most = points.len() - points.len() / FREE;
        if self.len <= most {
            return;
        }
        if !self.thinned {
            self.thinned = true;
            self.retain(points, |point| !point.is(SPARE));
        }
        if self.len <= most {
            return;
        }
        let mut counts = [0_u16; 256];
        for point in points.iter().take(self.len) {
            if let Some(count) = counts.get_mut(usize::from(point.strength())) {
                *count += 1;
            }
        }
        let (mut left, mut least) = (self.len, self.least);
        for (code, count) in (0_u8..).zip(&counts) {
            if left <= most {
                break;
            }
            left -= usize::from(*count);
            least = code.saturating_add(1);
        }
        self.least = least;
        let before = self.len;
        self.retain(points, |point| point.strength() >= least);
        self.lost += (before - self.len) as u32;
    }

    /// Drops the points that are not to be kept.
    pub(super) fn retain(&mut self, points: &mut [EdgePoint], keep: impl Fn(&EdgePoint) -> bool) {
        let mut kept = 0;
        for index in 0..self.len {
            let Some(point) = points.get(index).copied() else { break };
            let Some(slot) = points.get_mut(kept) else { break };
            *slot = point; // counted or overwritten
            kept += usize::from(keep(&point));
        }
        self.len = kept;
    }
}

/// The cell of a point, the nearest one beyond the map: column and row.
fn cell(point: &EdgePoint, view: &View) -> [usize; 2] {
    let place = point.place();
    [(place.x, CELL_UNITS[0], COLUMNS), (place.y, CELL_UNITS[1], ROWS)].map(|(at, cell, count)| {
        let from_middle = at / (cell * view.unit) + 0.5 * count as f32;
        (from_middle.max(0.0) as usize).min(count - 1)
    })
}

#[cfg(test)]
mod tests {
    use super::super::edge::FLOOR;
    use super::*;
    use crate::geometry::{Camera, Mount, RangeFinder};
    use nalgebra::Vector2;

    fn view() -> View {
        let camera = Camera::new(320, 240, [370.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        View::new(RangeFinder::new(camera, Mount::new([0.4, 0.1, 0.0, 0.0, 0.0, 0.0]).unwrap()))
    }

    fn point(x: f32, y: f32, gradient: f32, kinds: u8) -> EdgePoint {
        EdgePoint::new(Vector2::new(x, y), 64, gradient, 0.5, kinds).unwrap()
    }

    #[test]
    fn floor_far_from_a_vertical_edge_makes_room() {
        let (view, mut list) = (view(), EdgeList::default());
        let mut points = [EdgePoint::default(); 512];
        for row in -60..60 {
            list.push(&mut points, point(-100.0, row as f32, 5.0, VERTICAL), &view);
            for column in [-90.0, 0.0, 50.0, 100.0] {
                list.push(&mut points, point(column, row as f32, 9.0, FLOOR), &view);
            }
        }
        assert_eq!((list.found, list.lost), (600, 0));
        let kept = &points[..list.len];
        assert_eq!(kept.iter().filter(|point| point.is(VERTICAL)).count(), 120);
        assert_eq!(kept.iter().filter(|point| point.place().x == -90.0).count(), 120);
    }

    #[test]
    fn weak_points_go_when_all_could_serve() {
        let (view, mut list) = (view(), EdgeList::default());
        let mut points = [EdgePoint::default(); 64];
        for row in 0..100 {
            list.push(&mut points, point(0.0, row as f32 / 2.0, 1.0 + (row % 10) as f32, VERTICAL), &view);
        }
        assert!(list.lost > 30 && list.len >= 56 - 8, "{} kept, {} lost", list.len, list.lost);
        let weakest = points[..list.len].iter().map(EdgePoint::gradient).fold(99.0, f32::min);
        assert!(weakest >= 4.0, "{weakest}");
    }
}

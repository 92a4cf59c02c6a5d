//! An occupancy grid of virtual scans along a path, as the map servers of ROS and Nav2 read it.
//!
//! ```text
//! l(cell) = Σ over scans of ln p/(1 − p),   clamped:   free below `free`, occupied within σ of `range`, nothing beyond either
//! ```
//!
//! A scan counts once for a cell, however many of its beams go through it. What no beam says anything about stays unknown.
//!
//! Source: Moravec & Elfes, "High resolution maps from wide angle sonar", 1985, in log-odds.
use monorange_core::{geometry::Pose, scan::Reading};
use nalgebra::Vector2;
use std::{
    collections::HashMap,
    io::{self, Write},
};

/// Side of a cell, m; twice, four times … that where the drive is larger than [`MOST_CELLS`].
const RESOLUTION: f32 = 0.05;
/// Cells along a side at most.
const MOST_CELLS: f32 = 8192.0;
/// What is left around the outermost point that a beam reaches, m.
const MARGIN: f32 = 0.5;
/// Log-odds of a cell that a beam goes through, and of one that it ends in (judgement: an end is told twice as surely as a passage).
const FREE: f32 = -0.4;
const OCCUPIED: f32 = 0.85;
/// Standard deviation of an end that is marked at all, in cells: what is less sure would make thick walls of many scans.
const SURE: f32 = 4.0;
/// Log-odds beyond which evidence does not add up, so that who walked through is forgotten.
const CLAMP: f32 = 3.5;
/// Occupied and free above and below these probabilities; the values that map servers know them by.
const OCCUPIED_THRESHOLD: f32 = 0.65;
const FREE_THRESHOLD: f32 = 0.196;
const BLACK: u8 = 0;
const WHITE: u8 = 254;
const GREY: u8 = 205;

/// Scans of a drive, each with the place that it was taken at: the point of the floor under the lens, with the robot's heading.
#[derive(Clone, Debug, Default)]
pub struct Scans(Vec<(Pose<f32>, Vec<Reading>)>);

impl Scans {
    /// Takes the scan at a pose, `world_from_robot`, of a lens that sits at this lever arm of the robot, m.
    pub fn add(&mut self, pose: Pose<f32>, lever_arm: Vector2<f32>, readings: &[Reading]) {
        self.0.push((under_the_lens(&pose, lever_arm), readings.to_vec()));
    }

    /// Puts the robot of the last of them to these poses.
    pub fn put_last(&mut self, poses: &[Pose<f32>], lever_arm: Vector2<f32>) {
        for ((place, _), pose) in self.0.iter_mut().rev().zip(poses.iter().rev()) {
            *place = under_the_lens(pose, lever_arm);
        }
    }

    /// Puts them into another world, in which theirs is `moved`.
    pub fn put(&mut self, moved: &Pose<f32>) {
        self.0.iter_mut().for_each(|(pose, _)| *pose = moved.compose(pose));
    }

    /// The last one.
    pub fn last(&self) -> &[Reading] {
        self.0.last().map_or(&[], |(_, readings)| readings)
    }

    /// The grid that they make.
    pub fn grid(&self) -> Grid {
        let mut grid = Grid::around(self);
        let mut odds = vec![0.0_f32; grid.cells.len()];
        for (pose, readings) in &self.0 {
            for (cell, evidence) in grid.evidence(pose, readings) {
                if let Some(odds) = odds.get_mut(cell) {
                    *odds = (*odds + evidence).clamp(-CLAMP, CLAMP);
                }
            }
        }
        let threshold = |probability: f32| libm::logf(probability / (1.0 - probability));
        let (occupied, free) = (threshold(OCCUPIED_THRESHOLD), threshold(FREE_THRESHOLD));
        for (cell, odds) in grid.cells.iter_mut().zip(odds) {
            *cell = match odds {
                odds if odds > occupied => BLACK,
                odds if odds < free => WHITE,
                _ => GREY,
            };
        }
        grid
    }
}

fn under_the_lens(robot: &Pose<f32>, lever_arm: Vector2<f32>) -> Pose<f32> {
    robot.compose(&Pose::new(lever_arm.x, lever_arm.y, 0.0))
}

/// What is free, occupied and unknown, from above: x to the right, y up.
#[derive(Clone, Debug)]
pub struct Grid {
    width: usize,
    height: usize,
    resolution: f32,
    /// The lower left corner of the lower left cell in the world, m.
    origin: [f32; 2],
    /// Grey values row by row, the lowest first.
    cells: Vec<u8>,
}

impl Grid {
    fn around(scans: &Scans) -> Self {
        let reached = scans.0.iter().flat_map(|(pose, readings)| {
            let far = |reading: &Reading| reading.range.unwrap_or(0.0).max(reading.free);
            let ends = readings.iter().map(move |reading| end(pose, reading.bearing, far(reading)));
            std::iter::once([pose.x, pose.y]).chain(ends)
        });
        let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
        for place in reached {
            for axis in 0..2 {
                low[axis] = low[axis].min(place[axis] - MARGIN);
                high[axis] = high[axis].max(place[axis] + MARGIN);
            }
        }
        if low[0] > high[0] {
            (low, high) = ([-MARGIN; 2], [MARGIN; 2]);
        }
        let span = (high[0] - low[0]).max(high[1] - low[1]);
        let mut resolution = RESOLUTION;
        while span / resolution > MOST_CELLS {
            resolution *= 2.0;
        }
        // On whole cells, so that grids of two drives in one world fit each other.
        let origin = low.map(|side| (side / resolution).floor() * resolution);
        let [width, height] = [0, 1].map(|axis| ((high[axis] - origin[axis]) / resolution).ceil() as usize);
        Self { width, height, resolution, origin, cells: vec![GREY; width * height] }
    }

    /// What a scan says of the cells that it says anything of.
    fn evidence(&self, pose: &Pose<f32>, readings: &[Reading]) -> HashMap<usize, f32> {
        let mut said = HashMap::new();
        let bearing = |place: usize| readings.get(place).map(|reading| reading.bearing);
        for (place, reading) in readings.iter().enumerate() {
            let next = bearing(place + 1).or(place.checked_sub(1).and_then(bearing));
            let width = next.map_or(0.0, |next| (next - reading.bearing).abs());
            let std = reading.var_range.sqrt().max(0.5 * self.resolution);
            let sure = reading.range.filter(|_| std <= SURE * self.resolution);
            let far = sure.map_or(reading.free, |range| range + std);
            // Rays so dense that no cell lies between two.
            let rays = (far * width / (0.7 * self.resolution)).ceil().clamp(1.0, 64.0) as usize;
            for ray in 0..rays {
                let turn = width * ((ray as f32 + 0.5) / rays as f32 - 0.5);
                let along = |distance: f32| self.cell(end(pose, reading.bearing + turn, distance));
                for step in 0..(far / (0.5 * self.resolution)) as usize + 1 {
                    let distance = 0.5 * self.resolution * step as f32;
                    let evidence = match sure {
                        // The less sure, the more cells share what is known of the end.
                        Some(range) if (distance - range).abs() <= std => {
                            OCCUPIED * 0.5 * self.resolution / std
                        }
                        _ if distance < reading.free - 0.5 * self.resolution => FREE,
                        _ => continue,
                    };
                    if let Some(cell) = along(distance) {
                        said.entry(cell)
                            .and_modify(|known: &mut f32| *known = known.max(evidence))
                            .or_insert(evidence);
                    }
                }
            }
        }
        said
    }

    fn cell(&self, place: [f32; 2]) -> Option<usize> {
        let [column, row] = [0, 1].map(|axis| ((place[axis] - self.origin[axis]) / self.resolution).floor());
        let inside =
            column >= 0.0 && row >= 0.0 && (column as usize) < self.width && (row as usize) < self.height;
        inside.then(|| row as usize * self.width + column as usize)
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Side of a cell, m.
    pub fn resolution(&self) -> f32 {
        self.resolution
    }

    /// Writes `map.pgm`: the highest row first.
    ///
    /// # Errors
    /// When writing fails.
    pub fn write_pgm(&self, out: &mut dyn Write) -> io::Result<()> {
        write!(out, "P5\n{} {}\n255\n", self.width, self.height)?;
        self.cells.chunks(self.width.max(1)).rev().try_for_each(|row| out.write_all(row))
    }

    /// Writes `map.yaml`, which names `map.pgm`. `free_thresh` is such that map servers read its grey as unknown.
    ///
    /// # Errors
    /// When writing fails.
    pub fn write_yaml(&self, out: &mut dyn Write) -> io::Result<()> {
        let [x, y] = self.origin;
        writeln!(
            out,
            "image: map.pgm\nmode: trinary\nresolution: {}\norigin: [{x}, {y}, 0]",
            self.resolution
        )?;
        writeln!(out, "negate: 0\noccupied_thresh: {OCCUPIED_THRESHOLD}\nfree_thresh: {FREE_THRESHOLD}")
    }
}

/// The point in the world so far along a bearing of the robot.
fn end(pose: &Pose<f32>, bearing: f32, distance: f32) -> [f32; 2] {
    let (sin, cos) = libm::sincosf(pose.heading + bearing);
    [pose.x + distance * cos, pose.y + distance * sin]
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorange_core::scan::Kind;

    /// Scans from the middle of a square room of 4 m, all round, with a door of 0.8 m ahead through which 3 m of floor are seen.
    fn room() -> Grid {
        let mut scans = Scans::default();
        for turn in 0..8 {
            let heading = turn as f32 * std::f32::consts::FRAC_PI_4;
            let reading = |beam: i32| {
                let bearing = beam as f32 * 0.0175;
                let (sin, cos) = libm::sincosf(heading + bearing);
                let wall = 2.0 / sin.abs().max(cos.abs());
                let through = cos > 0.0 && (wall * sin).abs() < 0.4;
                let (free, range) = if through { (3.0, None) } else { (wall - 0.1, Some(wall)) };
                let kind = if through { Kind::Unknown } else { Kind::Boundary };
                Reading { bearing, free, range, var_range: 0.0004, kind }
            };
            let readings: Vec<_> = (-23..=23).map(reading).collect();
            for _ in 0..6 {
                // The lens, not the robot's origin, is in the middle.
                let (sin, cos) = libm::sincosf(heading);
                scans.add(Pose::new(-0.3 * cos, -0.3 * sin, heading), Vector2::new(0.3, 0.0), &readings);
            }
        }
        scans.grid()
    }

    /// Occupied, free or unknown as Nav2's map server reads a picture of mode trinary.
    fn read(grid: &Grid, x: f32, y: f32) -> &'static str {
        let (mut picture, mut text) = (Vec::new(), Vec::new());
        grid.write_pgm(&mut picture).expect("memory");
        grid.write_yaml(&mut text).expect("memory");
        let yaml: serde_json::Value =
            serde_saphyr::from_str(&String::from_utf8(text).expect("text")).expect("YAML");
        let number = |value: &serde_json::Value| value.as_f64().expect("a number");
        let [width, height] = grid.size();
        let pixels = &picture[picture.len() - width * height..];
        assert_eq!(
            &picture[..picture.len() - pixels.len()],
            format!("P5\n{width} {height}\n255\n").as_bytes()
        );
        let place = |at: f32, axis: usize| {
            ((f64::from(at) - number(&yaml["origin"][axis])) / number(&yaml["resolution"])).floor() as usize
        };
        let grey = pixels[(height - 1 - place(y, 1)) * width + place(x, 0)];
        let occupancy = f64::from(255 - grey) / 255.0;
        if occupancy > number(&yaml["occupied_thresh"]) {
            "occupied"
        } else if occupancy < number(&yaml["free_thresh"]) {
            "free"
        } else {
            "unknown"
        }
    }

    #[test]
    fn a_room_has_walls_floor_and_an_outside_that_is_not_known() {
        let grid = room();
        for k in -18..=18 {
            let side = 0.1 * k as f32 + 0.01;
            assert_eq!(read(&grid, -2.0, side), "occupied", "{side}");
            assert_eq!(read(&grid, side, 2.0), "occupied", "{side}");
            assert_eq!(read(&grid, side.clamp(-1.7, 1.7), 0.3), "free", "{side}");
            assert_eq!(read(&grid, -2.4, side), "unknown", "{side}");
        }
        // Through the door: the floor that is seen, and no further.
        assert_eq!(["free", "unknown"], [read(&grid, 2.7, 0.0), read(&grid, 3.3, 0.0)]);
        assert_eq!(read(&grid, 2.4, 1.5), "unknown");
    }

    #[test]
    fn who_walked_through_is_forgotten_and_no_scan_is_no_map() {
        let mut scans = Scans::default();
        let reading = |range: Option<f32>| Reading {
            bearing: 0.0,
            free: range.map_or(3.0, |range| range - 0.1),
            range,
            var_range: 0.0004,
            kind: Kind::Obstacle,
        };
        (0..20).for_each(|_| scans.add(Pose::default(), Vector2::zeros(), &[reading(Some(1.5))]));
        assert_eq!(read(&scans.grid(), 1.5, 0.01), "occupied");
        (0..20).for_each(|_| scans.add(Pose::default(), Vector2::zeros(), &[reading(None)]));
        assert_eq!(read(&scans.grid(), 1.5, 0.01), "free");
        let [width, height] = Scans::default().grid().size();
        assert!(width > 0 && height > 0);
    }
}

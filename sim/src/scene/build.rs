//! Walls drawn like a turtle draws: forward, turn, forward.
use super::{Decal, Landmark, Paint, Scene, SceneConfig, Wall};
use nalgebra::Vector2;

/// A closed outline under construction; the free side is on its left.
pub(super) struct Outline {
    start: usize,
    position: Vector2<f64>,
    heading: Vector2<f64>,
    top: f64,
}

/// Walls and corners gathered so far.
#[derive(Default)]
pub(super) struct Plan {
    pub(super) walls: Vec<Wall>,
    pub(super) landmarks: Vec<Landmark>,
}

/// Least difference in grey levels on both sides of an edge that counts as visible.
const CONTRAST: f64 = 12.0;

impl Outline {
    pub(super) fn new(plan: &Plan, position: [f64; 2], heading: [f64; 2], top: f64) -> Self {
        let (position, heading) = (Vector2::from(position), Vector2::from(heading));
        Self { start: plan.walls.len(), position, heading, top }
    }

    /// A wall straight ahead; its index.
    pub(super) fn forward(&mut self, plan: &mut Plan, length: f64, paint: Paint) -> usize {
        let from = self.position;
        self.position += self.heading * length;
        plan.walls.push(Wall { from, to: self.position, top: self.top, paint, decals: Vec::new() });
        plan.walls.len() - 1
    }

    pub(super) fn left(&mut self) {
        self.heading = Vector2::new(-self.heading.y, self.heading.x);
    }

    pub(super) fn right(&mut self) {
        self.heading = Vector2::new(self.heading.y, -self.heading.x);
    }

    /// A part of `width` set back by `depth` (forward into the room where negative), with its own sides; the
    /// index of its face.
    pub(super) fn step(
        &mut self,
        plan: &mut Plan,
        depth: f64,
        width: f64,
        side: Paint,
        face: Paint,
    ) -> usize {
        if depth >= 0.0 {
            self.right()
        } else {
            self.left()
        }
        self.forward(plan, depth.abs(), side);
        if depth >= 0.0 {
            self.left()
        } else {
            self.right()
        }
        let index = self.forward(plan, width, face);
        if depth >= 0.0 {
            self.left()
        } else {
            self.right()
        }
        self.forward(plan, depth.abs(), side);
        if depth >= 0.0 {
            self.right()
        } else {
            self.left()
        }
        index
    }

    /// Ends where it began: snaps the last end onto the first, and makes every visible vertex a landmark.
    pub(super) fn close(self, plan: &mut Plan, floor_grey: f32) {
        let first = plan.walls[self.start].from;
        if let Some(last) = plan.walls.last_mut() {
            last.to = first;
        }
        let range = self.start..plan.walls.len();
        for index in range.clone() {
            let before = if index == range.start { range.end - 1 } else { index - 1 };
            let (one, other) = (&plan.walls[before], &plan.walls[index]);
            if visible_edge(one, other, floor_grey) {
                let (id, position) = (plan.landmarks.len() as u32, other.from);
                plan.landmarks.push(Landmark { id, position, walls: [before, index] });
            }
        }
    }
}

/// Whether the two walls differ enough from each other, and both from the floor.
fn visible_edge(one: &Wall, other: &Wall, floor_grey: f32) -> bool {
    let level = |wall: &Wall, grey: f32| f64::from(grey) * wall.orientation_shade();
    let foot = |wall: &Wall| level(wall, wall.paint.skirting.unwrap_or(wall.paint.grey));
    let between = (level(one, one.paint.grey) - level(other, other.paint.grey)).abs();
    let floor = f64::from(floor_grey);
    between >= CONTRAST && [one, other].iter().all(|wall| (foot(wall) - floor).abs() >= CONTRAST)
}

impl Plan {
    pub(super) fn decal(&mut self, wall: usize, along: [f64; 2], height: [f64; 2], print: super::Print) {
        let decal = Decal { along: along.map(|x| x as f32), height: height.map(|z| z as f32), print };
        self.walls[wall].decals.push(decal);
    }
}

/// Lamps over a closed way, `spacing` apart, of strength 1 ± `spread`.
pub(super) fn lamps_along(
    way: &[Vector2<f64>],
    spacing: f64,
    spread: f64,
    random: &mut crate::random::Random,
) -> Vec<(Vector2<f64>, f64)> {
    let mut lamps = Vec::new();
    for (from, to) in way.iter().zip(way.iter().cycle().skip(1)) {
        let along = to - from;
        let count = (libm::sqrt(along.norm_squared()) / spacing).max(1.0) as usize;
        for lamp in 0..count {
            let place = from + along * ((lamp as f64 + 0.5) / count as f64);
            lamps.push((place, random.within(1.0 - spread, 1.0 + spread)));
        }
    }
    lamps
}

impl Scene {
    pub(super) fn paint(config: &SceneConfig, grey: f32) -> Paint {
        Paint { grey, skirting: (config.skirting > 0.0).then_some(48.0) }
    }
}

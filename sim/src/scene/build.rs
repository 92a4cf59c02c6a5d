//! Walls drawn like a turtle draws: forward, turn, forward.
use super::{Decal, Landmark, Lid, Paint, Print, SceneConfig, Wall};
use crate::random::Random;
use nalgebra::Vector2;

pub(super) const FLOOR_GREY: f32 = 126.0;
pub(super) const WALL_GREY: f32 = 202.0;
// Greys are chosen so that neighbours differ by CONTRAST whichever way they face: no corner is half visible.
/// Grey levels of door leaves; none is near the floor's.
const LEAVES: [f32; 5] = [58.0, 72.0, 86.0, 166.0, 180.0];

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
    pub(super) lids: Vec<Lid>,
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

    /// A straight side of `length` in several plain parts, doors, niches and pillars, plain for `margin` at both
    /// ends.
    pub(super) fn furnished(
        &mut self,
        plan: &mut Plan,
        length: f64,
        margin: f64,
        config: &SceneConfig,
        random: &mut Random,
    ) {
        let wall = Paint::skirted(config, WALL_GREY);
        let mut done = 0.0;
        let mut gap = margin + random.within(0.3, 1.2);
        loop {
            let kind = random.unit();
            let [least, most] = match kind {
                ..0.55 => [0.85, 1.0],
                ..0.75 => [0.7, 1.4],
                _ => [0.35, 0.6],
            };
            let width = random.within(least, most);
            if done + gap + width + margin > length {
                break;
            }
            self.plain(plan, gap, wall, config, random);
            match kind {
                ..0.55 => self.door(plan, width, config, random),
                ..0.75 => {
                    let (depth, back) = (random.within(0.22, 0.38), [110.0, 214.0][random.index(2)]);
                    let paints = [156.0, back].map(|grey| Paint::skirted(config, grey));
                    self.step(plan, depth, width, paints[0], paints[1]);
                }
                _ => {
                    let pillar = Paint::skirted(config, 156.0);
                    self.step(plan, -random.within(0.14, 0.2), width, pillar, pillar);
                }
            }
            done += gap + width;
            gap = random.within(0.9, 2.2);
        }
        self.plain(plan, length - done, wall, config, random);
    }

    /// A door leaf set back in a frame.
    fn door(&mut self, plan: &mut Plan, width: f64, config: &SceneConfig, random: &mut Random) {
        let leaf = Paint { grey: LEAVES[random.index(LEAVES.len())], skirting: None };
        let frame = Paint { grey: if leaf.grey > 120.0 { 76.0 } else { 30.0 }, skirting: None };
        let face = self.step(plan, random.within(0.11, 0.16), width, frame, leaf);
        if config.posters {
            let handle = if random.chance(0.5) { [0.06, 0.18] } else { [width - 0.18, width - 0.06] };
            plan.decal(face, handle, [1.0, 1.04], Print::Plain(205.0));
            if random.chance(0.35) {
                let grille = [width * 0.2, width * 0.8];
                plan.decal(face, grille, [0.22, 0.4], Print::Plain(leaf.grey * 0.7));
            }
        }
    }

    /// A stretch of wall, perhaps with posters, which keep clear of the floor and of the stretch's ends.
    pub(super) fn plain(
        &mut self,
        plan: &mut Plan,
        length: f64,
        paint: Paint,
        config: &SceneConfig,
        random: &mut Random,
    ) {
        let wall = self.forward(plan, length, paint);
        let mut from = random.within(0.25, 0.8);
        while config.posters && from + 0.8 < length {
            let (width, bottom) = (random.within(0.35, 0.6), random.within(0.28, 0.6));
            let height = width * random.within(1.2, 1.5);
            plan.decal(wall, [from, from + width], [bottom, bottom + height], Print::Poster(random.word()));
            from += width + random.within(0.5, 1.8);
        }
    }

    /// Ends where it began: snaps the last end onto the first, and makes every visible vertex a landmark.
    pub(super) fn close(self, plan: &mut Plan) {
        let first = plan.walls[self.start].from;
        if let Some(last) = plan.walls.last_mut() {
            last.to = first;
        }
        let range = self.start..plan.walls.len();
        for index in range.clone() {
            let before = if index == range.start { range.end - 1 } else { index - 1 };
            let (one, other) = (&plan.walls[before], &plan.walls[index]);
            if visible_edge(one, other) {
                let (id, position) = (plan.landmarks.len() as u32, other.from);
                plan.landmarks.push(Landmark { id, position, walls: [before, index] });
            }
        }
    }
}

/// Whether the two walls differ enough from each other, and both from the floor.
fn visible_edge(one: &Wall, other: &Wall) -> bool {
    let level = |wall: &Wall, grey: f32| f64::from(grey) * wall.orientation_shade();
    let foot = |wall: &Wall| level(wall, wall.paint.skirting.unwrap_or(wall.paint.grey));
    let between = (level(one, one.paint.grey) - level(other, other.paint.grey)).abs();
    let floor = f64::from(FLOOR_GREY);
    between >= CONTRAST && [one, other].iter().all(|wall| (foot(wall) - floor).abs() >= CONTRAST)
}

impl Plan {
    /// A block of furniture: `corner` and the direction of its first side, its sides (the second to the right of
    /// the first), its height, and the paints of its sides in turn.
    pub(super) fn block(
        &mut self,
        corner: Vector2<f64>,
        direction: Vector2<f64>,
        sides: [f64; 2],
        height: f64,
        greys: [f32; 2],
    ) {
        let start = self.walls.len();
        let mut outline = Outline { start, position: corner, heading: direction, top: height };
        for side in [0, 1, 0, 1] {
            outline.forward(self, sides[side], Paint { grey: greys[side], skirting: None });
            outline.right();
        }
        outline.close(self);
        let mut corners = [corner; 4];
        // The outline runs with the clock, a lid against it.
        for (lid, wall) in corners.iter_mut().zip(self.walls[start..].iter().rev()) {
            *lid = wall.from;
        }
        self.lids.push(Lid { corners, height, grey: 0.5 * (greys[0] + greys[1]) });
    }

    pub(super) fn decal(&mut self, wall: usize, along: [f64; 2], height: [f64; 2], print: Print) {
        let decal = Decal { along: along.map(|x| x as f32), height: height.map(|z| z as f32), print };
        self.walls[wall].decals.push(decal);
    }
}

/// Lamps over a closed way, `spacing` apart, of strength 1 ± `spread`.
pub(super) fn lamps_along(
    way: &[Vector2<f64>],
    spacing: f64,
    spread: f64,
    random: &mut Random,
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

impl Paint {
    /// A wall's paint over a dark skirting board, where the settings have one.
    pub(super) fn skirted(config: &SceneConfig, grey: f32) -> Self {
        Self { grey, skirting: (config.skirting > 0.0).then_some(48.0) }
    }
}

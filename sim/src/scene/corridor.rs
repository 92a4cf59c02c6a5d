//! A closed loop of corridor, 66 m round.
use super::build::{Outline, Plan, lamps_along};
use super::{LightMap, Paint, Print, Scene, SceneConfig};
use crate::random::{Random, Stream};
use nalgebra::Vector2;

/// Sides of the rectangle that the corridor's middle runs along, m.
const SIDES: [f64; 2] = [21.0, 12.0];
const HALF_WIDTH: f64 = 1.0;
const CEILING: f64 = 2.6;
const FLOOR_GREY: f32 = 122.0;
const WALL_GREY: f32 = 196.0;
/// Grey levels of door leaves; none is near the floor's.
const LEAVES: [f32; 5] = [58.0, 72.0, 86.0, 164.0, 178.0];

impl Scene {
    /// A rectangular loop of corridor, 66 m along its middle and 2 m wide, with doors, niches, pillars and
    /// posters; the robot starts at the origin, heading along x, and turns left.
    ///
    /// ```
    /// use monorange_sim::{Scene, SceneConfig};
    /// let scene = Scene::corridor(&SceneConfig::default());
    /// assert!(scene.landmarks().len() > 100);
    /// ```
    pub fn corridor(config: &SceneConfig) -> Self {
        let mut random = Random::new(config.seed, Stream::Scene);
        let mut plan = Plan::default();
        let start = Vector2::new(-SIDES[0] * 0.4, 0.0);
        // The outer walls run with the robot, the inner ones against it: free space on the left of both.
        let outer_start = start - Vector2::repeat(HALF_WIDTH);
        let mut outer = Outline::new(&plan, outer_start.into(), [1.0, 0.0], CEILING);
        for side in [SIDES[0], SIDES[1], SIDES[0], SIDES[1]] {
            furnish(&mut outer, &mut plan, side + 2.0 * HALF_WIDTH, 1.0, config, &mut random);
            outer.left();
        }
        outer.close(&mut plan, FLOOR_GREY);
        let inner_start = start + Vector2::repeat(HALF_WIDTH);
        let mut inner = Outline::new(&plan, inner_start.into(), [0.0, 1.0], CEILING);
        for side in [SIDES[1], SIDES[0], SIDES[1], SIDES[0]] {
            furnish(&mut inner, &mut plan, side - 2.0 * HALF_WIDTH, 0.45, config, &mut random);
            inner.right();
        }
        inner.close(&mut plan, FLOOR_GREY);

        let far = start + Vector2::from(SIDES);
        let way = vec![
            Vector2::zeros(),
            Vector2::new(far.x, 0.0),
            far,
            Vector2::new(start.x, far.y),
            Vector2::new(start.x, 0.0),
        ];
        let lamps = lamps_along(&way, 3.4, 0.22, &mut random);
        let light = LightMap::new(&plan.walls, &lamps, CEILING, config, &mut random);
        Self {
            name: "corridor",
            walls: plan.walls,
            landmarks: plan.landmarks,
            lids: Vec::new(),
            way,
            stands: Vec::new(),
            walkway: 0.6,
            ceiling: CEILING,
            floor_grey: FLOOR_GREY,
            light,
            config: *config,
        }
    }
}

/// One straight side of `length`, plain for `margin` at both ends.
fn furnish(
    outline: &mut Outline,
    plan: &mut Plan,
    length: f64,
    margin: f64,
    config: &SceneConfig,
    random: &mut Random,
) {
    let wall = Scene::paint(config, WALL_GREY);
    let mut done = 0.0;
    let mut gap = margin + random.within(0.3, 1.2);
    loop {
        let kind = random.unit();
        let width = if kind < 0.55 {
            random.within(0.85, 1.0)
        } else if kind < 0.75 {
            random.within(0.7, 1.4)
        } else {
            random.within(0.35, 0.6)
        };
        if done + gap + width + margin > length {
            break;
        }
        plain(outline, plan, gap, wall, config, random);
        if kind < 0.55 {
            door(outline, plan, width, config, random);
        } else if kind < 0.75 {
            let side = Scene::paint(config, 176.0);
            let depth = random.within(0.22, 0.38);
            outline.step(plan, depth, width, side, Scene::paint(config, [142.0, 158.0][random.index(2)]));
        } else {
            let pillar = Scene::paint(config, 166.0);
            outline.step(plan, -random.within(0.14, 0.2), width, pillar, pillar);
        }
        done += gap + width;
        gap = random.within(1.1, 2.8);
    }
    plain(outline, plan, length - done, wall, config, random);
}

/// A door leaf set back in a frame.
fn door(outline: &mut Outline, plan: &mut Plan, width: f64, config: &SceneConfig, random: &mut Random) {
    let leaf = Paint { grey: LEAVES[random.index(LEAVES.len())], skirting: None };
    let frame = Paint { grey: if leaf.grey > 120.0 { 76.0 } else { 224.0 }, skirting: None };
    let face = outline.step(plan, random.within(0.11, 0.16), width, frame, leaf);
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
fn plain(
    outline: &mut Outline,
    plan: &mut Plan,
    length: f64,
    paint: Paint,
    config: &SceneConfig,
    random: &mut Random,
) {
    let wall = outline.forward(plan, length, paint);
    let mut from = random.within(0.25, 0.8);
    while config.posters && from + 0.8 < length {
        let (width, bottom) = (random.within(0.35, 0.6), random.within(0.28, 0.6));
        let height = width * random.within(1.2, 1.5);
        plan.decal(wall, [from, from + width], [bottom, bottom + height], Print::Poster(random.word()));
        from += width + random.within(0.5, 1.8);
    }
}

//! What there is to see: walls with their paint, corners of the floor, lamps and the robot's way.
mod build;
mod corridor;
mod light;
mod office;
mod table2;

use crate::random::Random;
use monorange_core::geometry::Pose;
use nalgebra::Vector2;

pub(crate) use light::LightMap;
pub use table2::TABLE2_POINTS;

/// A vertical face that stands on the floor; the free side is on the left of `from → to`.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// One end, m.
    pub from: Vector2<f64>,
    /// The other end, m.
    pub to: Vector2<f64>,
    /// Height of its upper edge; the room's height for a wall proper, less for furniture.
    pub top: f64,
    pub(crate) paint: Paint,
    pub(crate) decals: Vec<Decal>,
}

/// How a wall looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Paint {
    /// Grey level under light 1.
    pub(crate) grey: f32,
    /// Grey level of a skirting board.
    pub(crate) skirting: Option<f32>,
}

/// A rectangle on a wall: poster, sign, handle, kick plate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Decal {
    /// First and last along the wall from `from`, m.
    pub(crate) along: [f32; 2],
    /// Lowest and highest, m.
    pub(crate) height: [f32; 2],
    pub(crate) print: Print,
}

/// What is printed on a decal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Print {
    Plain(f32),
    /// Blocks and lines of text that the number chooses.
    Poster(u32),
}

/// The flat top of a piece of furniture; its corners run against the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lid {
    pub(crate) corners: [Vector2<f64>; 4],
    pub(crate) height: f64,
    pub(crate) grey: f32,
}

/// A true floor corner: where a vertical edge that can be seen meets the edge of the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landmark {
    /// Its number, from 0.
    pub id: u32,
    /// Where it is on the floor, m.
    pub position: Vector2<f64>,
    /// The walls on both sides: indices into [`Scene::walls`].
    pub walls: [usize; 2],
}

/// A place to drive through.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(crate) name: &'static str,
    pub(crate) walls: Vec<Wall>,
    pub(crate) landmarks: Vec<Landmark>,
    pub(crate) lids: Vec<Lid>,
    pub(crate) purpose: Use,
    pub(crate) ceiling: f64,
    pub(crate) floor_grey: f32,
    pub(crate) light: LightMap,
    pub(crate) config: SceneConfig,
}

/// What the robot does in a scene.
#[derive(Clone, Debug)]
pub(crate) enum Use {
    /// It drives round the closed polygon; people keep within `walkway` metres of it.
    Loop { way: Vec<Vector2<f64>>, walkway: f64 },
    /// It stands here, a frame each, again and again.
    Stands(Vec<Pose<f64>>),
}

/// Size and looks of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneConfig {
    /// Chooses doors, colours, posters and textures.
    pub seed: u64,
    /// Contrast of the textures: 1 as built, 0 for plain floors and walls.
    pub texture: f64,
    /// Contrast of lamps, shades in corners and stains: 1 as built, 0 for even light.
    pub shading: f64,
    /// Height of skirting boards in metres, 0 for none.
    pub skirting: f64,
    /// Whether posters hang on the walls.
    pub posters: bool,
}

impl Default for SceneConfig {
    fn default() -> Self {
        Self { seed: 1, texture: 1.0, shading: 1.0, skirting: 0.07, posters: true }
    }
}

impl Scene {
    fn built(
        name: &'static str,
        plan: build::Plan,
        purpose: Use,
        ceiling: f64,
        lamps: &[(Vector2<f64>, f64)],
        config: &SceneConfig,
        random: &mut Random,
    ) -> Self {
        let light = LightMap::new(&plan.walls, lamps, ceiling, config, random);
        let build::Plan { walls, landmarks, lids } = plan;
        let floor_grey = build::FLOOR_GREY;
        Self { name, walls, landmarks, lids, purpose, ceiling, floor_grey, light, config: *config }
    }

    /// `corridor`, `office` or `table2`.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Every vertical face, for drawing the map and for ray casting.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// The true floor corners, by id.
    pub fn landmarks(&self) -> &[Landmark] {
        &self.landmarks
    }

    /// Height of the ceiling, m.
    pub fn ceiling(&self) -> f64 {
        self.ceiling
    }

    /// The smallest distance at which the segment from `origin` along `direction` (any length) meets a wall, in
    /// units of `direction`, and the wall.
    pub fn cast(&self, origin: Vector2<f64>, direction: Vector2<f64>) -> Option<(f64, usize)> {
        let hits = self.walls.iter().enumerate().filter_map(|(index, wall)| {
            let along = wall.to - wall.from;
            let offset = wall.from - origin;
            let determinant = direction.perp(&along);
            let distance = offset.perp(&along) / determinant;
            let fraction = offset.perp(&direction) / determinant;
            let hit = determinant != 0.0 && distance > 0.0 && (0.0..=1.0).contains(&fraction);
            hit.then_some((distance, index))
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

impl Wall {
    /// The unit normal that points into the room.
    pub fn normal(&self) -> Vector2<f64> {
        let along = self.to - self.from;
        Vector2::new(-along.y, along.x) / self.length()
    }

    /// Its length, m.
    pub fn length(&self) -> f64 {
        let along = self.to - self.from;
        libm::sqrt(along.norm_squared())
    }

    /// Brightness by orientation: no two of the four main directions look alike, so that corners can be seen.
    pub(crate) fn orientation_shade(&self) -> f64 {
        let light = Vector2::new(0.94, 0.34);
        1.0 + 0.13 * self.normal().dot(&light)
    }
}

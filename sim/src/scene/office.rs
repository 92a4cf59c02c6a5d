//! Two rooms with furniture, joined by two wide doorways.
use super::build::{Outline, Plan, WALL_GREY, lamps_along};
use super::{Paint, Scene, SceneConfig, Use};
use crate::random::{Random, Stream};
use nalgebra::Vector2;

const CEILING: f64 = 2.7;
/// Left, right, back and front walls of both rooms, m.
const ROOMS: [[f64; 2]; 2] = [[-3.6, 11.4], [-2.3, 5.3]];
/// Both sides of the wall between the rooms, m.
const PARTITION: [f64; 2] = [4.2, 4.4];
/// Where the doorways begin and end along y, m.
const DOORWAYS: [[f64; 2]; 2] = [[-0.75, 0.75], [2.25, 3.75]];

impl Scene {
    /// Two rooms of 7 m with desks, cupboards and crates, which the robot goes round through both doorways, 27 m
    /// a lap.
    ///
    /// ```
    /// use monorange_sim::{Scene, SceneConfig};
    /// let scene = Scene::office(&SceneConfig::default());
    /// assert!(scene.landmarks().len() > 60);
    /// ```
    pub fn office(config: &SceneConfig) -> Self {
        let mut random = Random::new(config.seed, Stream::Scene);
        let mut plan = Plan::default();
        let wall = Paint::skirted(config, WALL_GREY);
        let frame = Paint { grey: 84.0, skirting: None };
        let [[west, east], [south, north]] = ROOMS;
        let [near, far] = PARTITION;
        let thick = far - near;

        let mut rooms = Outline::new(&plan, [west, south], [1.0, 0.0], CEILING);
        rooms.furnished(&mut plan, near - west, 0.9, config, &mut random);
        // Into the first doorway and out again on the other side of the partition.
        rooms.left();
        rooms.plain(&mut plan, DOORWAYS[0][0] - south, wall, config, &mut random);
        rooms.right();
        rooms.forward(&mut plan, thick, frame);
        rooms.right();
        rooms.plain(&mut plan, DOORWAYS[0][0] - south, wall, config, &mut random);
        rooms.left();
        rooms.furnished(&mut plan, east - far, 0.9, config, &mut random);
        rooms.left();
        rooms.furnished(&mut plan, north - south, 0.9, config, &mut random);
        rooms.left();
        rooms.furnished(&mut plan, east - far, 0.9, config, &mut random);
        rooms.left();
        rooms.plain(&mut plan, north - DOORWAYS[1][1], wall, config, &mut random);
        rooms.right();
        rooms.forward(&mut plan, thick, frame);
        rooms.right();
        rooms.plain(&mut plan, north - DOORWAYS[1][1], wall, config, &mut random);
        rooms.left();
        rooms.furnished(&mut plan, near - west, 0.9, config, &mut random);
        rooms.left();
        rooms.furnished(&mut plan, north - south, 0.9, config, &mut random);
        rooms.close(&mut plan);

        // The piece of wall between the doorways stands free.
        let mut pier = Outline::new(&plan, [near, DOORWAYS[0][1]], [0.0, 1.0], CEILING);
        let length = DOORWAYS[1][0] - DOORWAYS[0][1];
        for _ in 0..2 {
            pier.plain(&mut plan, length, wall, config, &mut random);
            pier.right();
            pier.forward(&mut plan, thick, frame);
            pier.right();
        }
        pier.close(&mut plan);

        furniture(&mut plan, &mut random);
        let way = [[0.0, 0.0], [9.4, 0.0], [9.4, 3.0], [-1.7, 3.0], [-1.7, 0.0]].map(Vector2::from).to_vec();
        let lamps = lamps_along(&way, 3.0, 0.2, &mut random);
        let purpose = Use::Loop { way, walkway: 0.5 };
        Self::built("office", plan, purpose, CEILING, &lamps, config, &mut random)
    }
}

/// Blocks beside the way, never nearer to it than people walk.
fn furniture(plan: &mut Plan, random: &mut Random) {
    /// Middle, sides.
    const PLACES: [([f64; 2], [f64; 2]); 12] = [
        ([0.9, 1.5], [1.3, 0.6]),
        ([2.9, 1.45], [0.5, 0.5]),
        ([6.0, 1.5], [1.4, 0.65]),
        ([7.9, 1.5], [0.45, 0.6]),
        ([1.9, -1.25], [0.9, 0.5]),
        ([3.3, -1.4], [0.5, 0.6]),
        ([6.3, -1.35], [1.2, 0.6]),
        ([8.4, -1.3], [0.5, 0.5]),
        ([0.2, 4.3], [1.2, 0.6]),
        ([2.6, 4.25], [0.5, 0.5]),
        ([6.6, 4.3], [1.3, 0.6]),
        ([8.4, 4.35], [0.5, 0.6]),
    ];
    /// Fronts and sides: light and dark wood, metal, cardboard.
    const GREYS: [[f32; 2]; 4] = [[214.0, 160.0], [48.0, 92.0], [92.0, 48.0], [66.0, 204.0]];
    for (middle, sides) in PLACES {
        let angle = random.within(-0.12, 0.12);
        let along = Vector2::new(libm::cos(angle), libm::sin(angle));
        let right = Vector2::new(along.y, -along.x);
        let corner = Vector2::from(middle) - along * (0.5 * sides[0]) - right * (0.5 * sides[1]);
        let height = random.within(0.32, 0.95);
        plan.block(corner, along, sides, height, GREYS[random.index(GREYS.len())]);
    }
}

//! A closed loop of corridor, 66 m round.
use super::build::{Outline, Plan, lamps_along};
use super::{Scene, SceneConfig, Use};
use crate::random::{Random, Stream};
use nalgebra::Vector2;

/// Sides of the rectangle that the corridor's middle runs along, m.
const SIDES: [f64; 2] = [21.0, 12.0];
const HALF_WIDTH: f64 = 1.0;
const CEILING: f64 = 2.6;

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
            outer.furnished(&mut plan, side + 2.0 * HALF_WIDTH, 1.0, config, &mut random);
            outer.left();
        }
        outer.close(&mut plan);
        let inner_start = start + Vector2::repeat(HALF_WIDTH);
        let mut inner = Outline::new(&plan, inner_start.into(), [0.0, 1.0], CEILING);
        for side in [SIDES[1], SIDES[0], SIDES[1], SIDES[0]] {
            inner.furnished(&mut plan, side - 2.0 * HALF_WIDTH, 0.45, config, &mut random);
            inner.right();
        }
        inner.close(&mut plan);

        let far = start + Vector2::from(SIDES);
        let way = vec![
            Vector2::zeros(),
            Vector2::new(far.x, 0.0),
            far,
            Vector2::new(start.x, far.y),
            Vector2::new(start.x, 0.0),
        ];
        let lamps = lamps_along(&way, 3.4, 0.22, &mut random);
        let purpose = Use::Loop { way, walkway: 0.6 };
        Self::built("corridor", plan, purpose, CEILING, &lamps, config, &mut random)
    }
}

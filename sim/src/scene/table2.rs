//! The paper's first experiment: five floor points at known range and bearing.
use super::build::{Outline, Plan, WALL_GREY};
use super::{Paint, Scene, SceneConfig, Use};
use crate::random::{Random, Stream};
use monorange_core::geometry::Pose;
use nalgebra::Vector2;

/// Range (m) and bearing (rad) of the five points, as Table 2 has them measured by hand.
pub const TABLE2_POINTS: [[f64; 2]; 5] =
    [[1.29, 0.330], [1.91, 0.261], [2.13, 0.266], [1.20, 0.0], [1.52, -0.305]];

const CEILING: f64 = 3.0;
/// From one crate to the next, m.
const SPACING: f64 = 2.6;

impl Scene {
    /// A lab with five crates. In frame k the robot stands so that the near foot of crate k mod 5 is exactly at
    /// the range and bearing of the table's row: the table's points 2 and 3 lie behind each other, so one stand
    /// could not see both feet. The marked foot is landmark k mod 5.
    ///
    /// ```
    /// use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, TABLE2_POINTS, default_rig};
    /// let scene = Scene::table2(&SceneConfig::default());
    /// let lab = Simulation::new(scene, default_rig()?, SimConfig { frames: 5, ..SimConfig::default() })?;
    /// let foot = lab.visible_corners(3).into_iter().find(|corner| corner.id == 3).expect("in view");
    /// assert!((foot.range - TABLE2_POINTS[3][0]).abs() < 1e-12);
    /// # Ok::<(), monorange_core::Error>(())
    /// ```
    pub fn table2(config: &SceneConfig) -> Self {
        let mut random = Random::new(config.seed, Stream::Scene);
        let mut plan = Plan::default();
        let mut stands = Vec::new();
        let mut lamps = Vec::new();
        for (row, [range, bearing]) in TABLE2_POINTS.into_iter().enumerate() {
            let foot = Vector2::new(3.0, (row as f64 - 2.0) * SPACING);
            // The crate's corner points at the robot, a little turned.
            let angle = core::f64::consts::FRAC_PI_4 + bearing + random.within(-0.15, 0.15);
            let direction = Vector2::new(libm::cos(angle), libm::sin(angle));
            let sides = [random.within(0.4, 0.55), random.within(0.4, 0.55)];
            plan.block(foot, direction, sides, random.within(0.6, 0.8), [66.0, 204.0]);
            let offset = Vector2::new(libm::cos(bearing), libm::sin(bearing)) * range;
            stands.push(Pose::new(foot.x - offset.x, foot.y - offset.y, 0.0));
            lamps.push((foot - Vector2::new(1.0, 0.3), random.within(0.8, 1.2)));
        }
        // Each block made four landmarks, its marked foot first: those five come first.
        plan.landmarks.sort_by_key(|landmark| (landmark.id % 4 != 0, landmark.id));
        for (id, landmark) in plan.landmarks.iter_mut().enumerate() {
            landmark.id = id as u32;
        }
        let mut room = Outline::new(&plan, [-1.0, -8.0], [1.0, 0.0], CEILING);
        let wall = Paint::skirted(config, WALL_GREY);
        for side in [6.4, 16.0, 6.4, 16.0] {
            room.plain(&mut plan, side, wall, config, &mut random);
            room.left();
        }
        room.close(&mut plan);
        Self::built("table2", plan, Use::Stands(stands), CEILING, &lamps, config, &mut random)
    }
}

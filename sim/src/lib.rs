//! Synthetic floors, walls, doors and walkers with exact truth.
mod laser;
mod odometry;
mod path;
mod random;
mod render;
mod rig;
mod scene;
mod simulation;
mod texture;
mod truth;
mod walker;

pub use laser::{Beam, LaserConfig};
pub use odometry::OdometryNoise;
pub use path::Twist;
pub use rig::{MOUNT_STD, PIXEL_STD, default_rig, hand_mounted};
pub use scene::{Landmark, Scene, SceneConfig, TABLE2_POINTS, Wall};
pub use simulation::{SimConfig, Simulation};
pub use truth::{HiddenBy, TrueCorner};
pub use walker::{MAX_WALKING_SPEED, Walker};

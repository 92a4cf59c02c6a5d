//! Synthetic corridors and offices: pictures through a real lens, odometry that slips, a laser, people who walk
//! about, and the exact truth about all of them.
//!
//! | part | gives |
//! |---|---|
//! | [`Scene`] | walls with paint, posters and lamps; the true floor corners ([`Landmark`]) |
//! | [`Simulation::render`] | the picture of a frame, 8-bit grey |
//! | [`Simulation::odometry`] | speed and turn rate to the next frame, with errors as [`OdometryNoise`] states |
//! | [`Simulation::laser`] | a scan of ranges, people included |
//! | [`Simulation::true_pose`], [`Simulation::corners`] | where the robot is; where each corner is in the picture, and what hides it |
//!
//! **Motion.** The robot aims at a point ahead of it on its way and holds speed and turn rate for a frame, so
//! that the true motion between frames is an exact arc: with d = v Δt, a = ω Δt,
//!
//! ```text
//! x⁺ = x + d sinc(a/2) cos(θ + a/2),   y⁺ = y + d sinc(a/2) sin(θ + a/2),   θ⁺ = θ + a
//! ```
//!
//! and odometry's only errors are those of v and ω.
//!
//! **Pictures.** Each pixel's ray is exact through the lens (Brown–Conrady, undone by Newton's method once a rig),
//! surfaces are intersected in closed form, and pixels at edges are averaged over 16 rays: edges of clean pictures
//! lie within 0.1 px of the projected truth for 98 % of the rows and columns they cross, 0.02 px in the median,
//! without bias (`cargo test -p monorange-sim --test truth -- --nocapture`). Textures are averaged over each
//! pixel's footprint. Light comes from lamps along the way, with soft shades where walls meet the floor.
//!
//! **Corners.** A landmark is a vertex of the walls' outline where both walls differ from each other and from the
//! floor by 12 grey levels or more. Posters, handles and people never make one.
//!
//! **The same bits everywhere.** Random numbers are ChaCha8 streams of the seed, one for each purpose and, for
//! pixels and laser, for each frame: a frame depends on its number, never on what was drawn before. Elementary
//! functions are `libm`'s. There is no file system, thread or clock in this crate.
//!
//! **Limits.** No reflections, no motion blur, no rolling shutter, no cast shadows but a soft one under each foot;
//! floors are flat and walls vertical; a robot at 0.2 m/s does not shake.
//!
//! `cargo run --release -p monorange-sim --example speed` prints the speed, `--example preview` writes pictures.
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

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
pub use random::{Random, Stream};
pub use rig::{MOUNT_STD, PIXEL_STD, default_rig, hand_mounted};
pub use scene::{Landmark, Scene, SceneConfig, TABLE2_POINTS, Wall};
pub use simulation::{SimConfig, Simulation};
pub use truth::{HiddenBy, TrueCorner};
pub use walker::{MAX_WALKING_SPEED, Walker};

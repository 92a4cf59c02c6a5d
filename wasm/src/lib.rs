//! monorange in the browser: a thin, typed door to the core, which computes the same bits here as on a robot.
//!
//! Files, typed arrays and small typed objects go in, the same come out; nothing here knows of a page. Numbers of
//! one kind that come by the dozen (corners, landmarks, a grid's vertices) are rows of a `Float32Array`, whose
//! columns are named once, in `monorange-wasm-record`.
//!
//! | module | in JavaScript |
//! |---|---|
//! | [`pipeline`], [`report`] | `Pipeline`: pictures and odometry in; corners, pose and map out, step by step |
//! | [`range_finder`] | `RangeFinder`: range, bearing and ±σ of a pixel, tape measure, horizon, floor grid |
//! | `monorange-wasm-rig` | `Rig`: camera and mount as an object with named entries |
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

pub mod outline;
pub mod pipeline;
pub mod range_finder;
pub mod report;
pub mod tape;

pub use pipeline::Pipeline;
pub use range_finder::RangeFinder;
pub use report::Report;

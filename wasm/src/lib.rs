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

/// An error in its own words, its numbers written by the browser.
fn sentence(error: monorange_core::Error) -> wasm_bindgen::JsError {
    let mut words = String::new();
    let number = |words: &mut dyn core::fmt::Write, number: f64| {
        let written =
            js_sys::Number::from(number).to_string_with_radix(10).ok().and_then(|text| text.as_string());
        words.write_str(&written.unwrap_or_default())
    };
    // Writing to a string cannot fail.
    let _ = error.write(&mut words, &number);
    wasm_bindgen::JsError::new(&words)
}

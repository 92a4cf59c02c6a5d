//! What numbers look like that cannot be meant, a file a subject.
//!
//! | file | what is looked at |
//! |---|---|
//! | `camera` | focal length, principal point and picture against each other |
//! | `mount` | height, tilt, lever arm: centimetres, radians, a camera that sees no floor |
//! | `time` | clocks in nanoseconds, steps, gaps |
//! | `motion` | turns of more than half a circle, degrees, speeds, three dimensions, a camera that stands still |
//! | `measurement` | names, pixels, ranges, bearings, variances |
//! | `scale` | an estimate and its truth in different units |
//!
//! A rule gives an error where the result would be worthless, and a [warning](crate::warnings) where a person may mean
//! it: what it looks like, and how to say otherwise. The bounds are wide. Where a bound has a reason it stands beside
//! it; none was chosen on data.
mod camera;
mod measurement;
mod motion;
mod mount;
mod scale;
mod time;

pub use camera::{check_camera, check_picture};
pub use measurement::{
    check_bearings_by_turns, check_known_bearings, check_known_ranges, check_pixels, check_ranges_by_way,
    check_sightings, landmark_name,
};
pub use motion::{
    Attitude, FrozenCamera, check_attitudes, check_headings, check_jumps, check_motion, check_reading,
    wrapped_turn,
};
pub use mount::check_mount;
pub use scale::check_scale;
pub use time::{check_steps, gaps, seconds_of_clock};

/// The median of some numbers; `None` without any.
fn median(numbers: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(numbers, 0.5)
}

/// The number that a share of some numbers lies below; `None` without any.
fn quantile(numbers: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut sorted: Vec<_> = numbers.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get((sorted.len() as f64 * share) as usize).copied()
}

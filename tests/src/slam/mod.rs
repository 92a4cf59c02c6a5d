//! What the filter's checks share: seeded noise, a world to drive in, real logs, a batch optimum.
pub mod batch;
pub mod ring_drive;

use monorange_core::geometry::Pose;
use monorange_core::slam::{Filter, FilterConfig, Landmark, WHEEL_STATES, states_for, storage_len};
use nalgebra::Matrix3;

/// A filter on the host.
pub type HostFilter<T> = Filter<T, Vec<T>, Vec<Landmark<T>>>;

/// A filter with room for so many points, or half as many inverse-distance landmarks.
///
/// # Panics
/// When the configuration is not sound.
pub fn host_filter<T: monorange_core::Real>(
    landmarks: usize,
    pose: Pose<T>,
    covariance: Matrix3<T>,
    config: FilterConfig<T>,
) -> HostFilter<T> {
    let states =
        states_for(landmarks, config.mount_std.is_some()) + config.wheels_std.map_or(0, |_| WHEEL_STATES);
    let storage = vec![T::zero(); storage_len(states)];
    Filter::new(storage, vec![Landmark::default(); landmarks], pose, covariance, config)
        .expect("a sound configuration")
}

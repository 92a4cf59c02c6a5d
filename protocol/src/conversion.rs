//! Messages ↔ the core's own types (feature `core`): the one place where they meet, used at both ends of the line.
mod ranges;
mod settings;

pub use ranges::range_of_spot;
pub use settings::{fingerprint, number_of_refused, settings_from_config, take_settings};

use crate::message::{self, Camera, Configure, Mount};
use monorange_core::{
    Result, geometry,
    pipeline::{self, Config},
    slam,
};

/// Both ways between two enums of the same choices.
macro_rules! same_choices {
    ($($wire:path => $core:path { $($choice:ident),* };)*) => {$(
        impl From<$wire> for $core {
            fn from(choice: $wire) -> Self {
                match choice { $(<$wire>::$choice => Self::$choice,)* }
            }
        }
        impl From<$core> for $wire {
            fn from(choice: $core) -> Self {
                match choice { $(<$core>::$choice => Self::$choice,)* }
            }
        }
    )*};
}

same_choices! {
    message::Decision => slam::Decision { Update, Birth, Gated, Tentative, Rejected };
}

/// Pixels of a picture that is sent in pixels of the camera's: with 2 × 2 binning the centre of the first one lies
/// at (0.5, 0.5).
pub fn camera_from_sent(sent: f32, binning: u8) -> f32 {
    let factor = f32::from(binning);
    sent * factor + (factor - 1.0) * 0.5
}

/// The reverse of [`camera_from_sent`].
pub fn sent_from_camera(camera: f32, binning: u8) -> f32 {
    let factor = f32::from(binning);
    (camera - (factor - 1.0) * 0.5) / factor
}

/// The configuration of a pipeline for the pictures that are sent.
///
/// # Errors
/// The first value that is out of range, or that this target does not know.
pub fn config_from_message(configure: &Configure) -> Result<Config> {
    let Configure { camera, mount, settings, binning, .. } = configure;
    let factor = usize::from((*binning).clamp(1, 2));
    let Camera { width, height, focal, principal, skew, distortion } = *camera;
    let [k1, k2, p1, p2, k3] = distortion;
    let camera = geometry::Camera::new(
        usize::from(width) / factor,
        usize::from(height) / factor,
        focal.map(|length| length / factor as f32),
        principal.map(|at| if factor == 1 { at } else { sent_from_camera(at, *binning) }),
        skew,
        geometry::Distortion { k1, k2, p1, p2, k3 },
    )?;
    let finder = geometry::RangeFinder::new(camera, geometry::Mount::new(mount.parameters)?);
    let mut config = Config::new(finder);
    config.mount_std = mount.std;
    take_settings(&settings.0, &mut config)?;
    Ok(config)
}

/// The message that makes a device run a pipeline with this configuration, on whole pictures.
pub fn message_from_config(config: &Config, answers: message::Answers) -> Configure {
    let camera = config.finder.camera();
    let distortion = match *camera.lens() {
        geometry::Lens::BrownConrady(geometry::Distortion { k1, k2, p1, p2, k3 }) => [k1, k2, p1, p2, k3],
        // The message has no other lens, and a device refuses what is not finite.
        _ => [f32::NAN; 5],
    };
    let saturated = |number: usize| u16::try_from(number).unwrap_or(u16::MAX);
    Configure {
        camera: Camera {
            width: saturated(camera.width()),
            height: saturated(camera.height()),
            focal: camera.focal().into(),
            principal: camera.principal().into(),
            skew: camera.skew(),
            distortion,
        },
        mount: Mount { parameters: config.finder.mount().parameters(), std: config.mount_std },
        binning: 1,
        answers,
        settings: settings_from_config(config),
    }
}

/// Seconds of a time in microseconds: the nearest `f64`, as if the decimal number had been read.
pub fn seconds_from_us(time_us: u64) -> f64 {
    time_us as f64 / 1e6
}

/// Microseconds of a time in seconds, to the nearest; 0 before the epoch.
pub fn us_from_seconds(seconds: f64) -> u64 {
    (seconds * 1e6 + 0.5) as u64
}

/// A corner of a report, in pixels of the camera.
pub fn observation_from_corner(corner: &pipeline::CornerReport, binning: u8) -> message::Observation {
    let covariance = &corner.covariance;
    message::Observation {
        pixel: [corner.pixel.x, corner.pixel.y].map(|at| camera_from_sent(at, binning)),
        range: corner.range,
        bearing: corner.bearing,
        covariance: [covariance.m11, covariance.m12, covariance.m22],
        landmark: corner.outcome.landmark,
        decision: corner.outcome.decision.into(),
        nis: corner.outcome.nis,
    }
}

/// A landmark of a filter's map; its numbers are NaN while only its bearing is known.
pub fn landmark_from_filter<S, L>(
    filter: &slam::Filter<f32, S, L>,
    record: &slam::Landmark<f32>,
) -> message::Landmark
where
    S: AsRef<[f32]> + AsMut<[f32]>,
    L: AsRef<[slam::Landmark<f32>]> + AsMut<[slam::Landmark<f32>]>,
{
    let position = filter.position(record).map_or([f32::NAN; 2], Into::into);
    let covariance = filter.position_covariance(record).map_or([f32::NAN; 3], |p| [p.m11, p.m12, p.m22]);
    message::Landmark {
        id: record.id,
        position,
        covariance,
        seen: record.seen,
        confirmed: record.status == slam::Status::Confirmed,
        first_us: us_from_seconds(record.first_time),
        last_us: us_from_seconds(record.last_time),
    }
}

/// A pipeline's reading of a motion.
pub fn odometry_from_message(odometry: &message::Odometry) -> pipeline::Odometry {
    let seconds = odometry.duration;
    match odometry.motion {
        message::Motion::Velocity { speed, turn } => {
            pipeline::Odometry::Velocity { v: speed, omega: turn, seconds }
        }
        message::Motion::Increment { forward, left, turn } => {
            pipeline::Odometry::Increment { forward, left, turn, seconds }
        }
    }
}

/// The message of a reading that ends at `until_us`.
pub fn message_from_odometry(odometry: &pipeline::Odometry, until_us: u64) -> message::Odometry {
    let (duration, motion) = match *odometry {
        pipeline::Odometry::Velocity { v, omega, seconds } => {
            (seconds, message::Motion::Velocity { speed: v, turn: omega })
        }
        pipeline::Odometry::Increment { forward, left, turn, seconds } => {
            (seconds, message::Motion::Increment { forward, left, turn })
        }
    };
    message::Odometry { until_us, duration, motion }
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorange_core::geometry::{Distortion, RangeFinder};

    fn config() -> Config {
        let lens = Distortion { k1: -0.2, k2: 0.3, p1: -0.005, p2: -0.002, k3: 0.0 };
        let camera = geometry::Camera::new(320, 240, [365.0, 366.0], [145.5, 114.25], 0.001, lens).unwrap();
        let mount = geometry::Mount::new([0.4, 0.2, 0.01, -0.02, 0.05, 0.0]).unwrap();
        let mut config = Config::new(RangeFinder::new(camera, mount));
        config.filter.gate = monorange_core::association::Gate::Hard;
        config.map.joint_nodes = 100;
        config
    }

    #[test]
    fn a_configuration_comes_back_bit_by_bit() {
        let answers = message::Answers { observations: true, map_every: 0, statistics_every: 0 };
        let sent = message_from_config(&config(), answers);
        assert_eq!(config_from_message(&sent).unwrap(), config());
    }

    #[test]
    fn binning_keeps_rays_where_they_are() {
        let answers = message::Answers { observations: true, map_every: 0, statistics_every: 0 };
        let sent = Configure { binning: 2, ..message_from_config(&config(), answers) };
        let half = config_from_message(&sent).unwrap();
        let full_camera = *config().finder.camera();
        let half_camera = *half.finder.camera();
        for pixel in [[0.0_f32, 0.0], [100.0, 50.0], [159.0, 119.0]] {
            let full = pixel.map(|at| camera_from_sent(at, 2));
            let [a, b] = [half_camera.ray_from_pixel(pixel.into()), full_camera.ray_from_pixel(full.into())]
                .map(Option::unwrap);
            assert!((a - b).norm() < 1e-5, "{a} {b}");
        }
    }
}

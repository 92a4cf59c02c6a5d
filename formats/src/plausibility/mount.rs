use crate::Error;
use monorange_core::geometry::RangeFinder;
use nalgebra::Vector2;
use std::path::Path;

/// Warns about a mount that is hardly meant: `deviations` are those of height, tilt, roll, yaw (m, rad).
pub fn check_mount(path: &Path, finder: &RangeFinder<f64>, deviations: &[f64]) {
    let [height, tilt, roll, _, forward, left] = finder.mount().parameters();
    let warn = |cause: String, help: &str| Error::new(cause).at(path).help(help).warn();
    if height > 6.0 {
        let metres = if height > 200.0 { height / 1000.0 } else { height / 100.0 };
        let unit = if height > 200.0 { "millimetres" } else { "centimetres" };
        warn(
            format!("`mount.height` is {height}: a lens {height} m above the floor looks like {unit}"),
            &format!("lengths are metres: write height = {metres} if that is meant"),
        );
    } else if height < 0.02 {
        warn(
            format!("`mount.height` is {height}: a lens {:.1} cm above the floor", 100.0 * height),
            "lengths are metres",
        );
    }
    if forward.abs().max(left.abs()) > 5.0 {
        warn(
            format!("the lens is {forward} m ahead and {left} m to the left of the robot"),
            "lengths are metres: write `mount.forward` and `mount.left` so",
        );
    }
    if roll.abs() > 0.8 && roll.abs() < 2.3 {
        warn(
            format!("`mount.roll_deg` is {:.0}: the camera lies on its side", roll.to_degrees()),
            "angles are degrees",
        );
    }
    let camera = finder.camera();
    let (right, bottom) = (camera.width() as f64 - 1.0, camera.height() as f64 - 1.0);
    let places =
        [(0.0, 0.0), (right / 2.0, 0.0), (right, 0.0), (0.0, bottom), (right / 2.0, bottom), (right, bottom)];
    if places.into_iter().all(|(u, v)| finder.sight(Vector2::new(u, v)).is_err()) {
        warn(
            format!("no part of the picture sees the floor at a tilt of {:.1}°", tilt.to_degrees()),
            "`mount.tilt_deg` is in degrees, positive downwards",
        );
    }
    if let [height_std, angles @ ..] = deviations {
        if *height_std > height {
            warn(
                format!("`mount.height_std` is {height_std} m, more than the height itself"),
                "lengths are metres",
            );
        }
        if angles.iter().take(3).any(|std| *std > 0.7) {
            warn("a standard deviation of the mount's angles is beyond 40°".to_owned(), "angles are degrees");
        }
    }
}

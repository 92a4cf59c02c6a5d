//! How far away is a point of the floor that a pixel shows, and how sure is that?
//!
//! `cargo run -p monorange-core --example range` prints
//!
//! ```text
//! pixel (160, 200): 1.02 m, 2.4° to the right, ± 4 mm by the pixel and ± 20 mm by the mount
//! pixel (160, 100): 3.98 m, 2.2° to the right, ± 55 mm by the pixel and ± 206 mm by the mount
//! pixel (160, 10): no floor (the pixel looks at or above the horizon)
//! ```
use monorange_core::geometry::{Camera, Distortion, Mount, RangeFinder};
use nalgebra::{Matrix2, Vector2};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Size, focal lengths, principal point, skew (px), and the lens, as a calibration gives them.
    let lens = Distortion { k1: -0.228, k2: 0.364, ..Default::default() };
    let camera = Camera::<f64>::new(320, 240, [365.1, 365.0], [145.8, 114.5], 0.0, lens)?;
    // Height (m), tilt, roll and yaw (rad), and where the camera sits on the robot (m).
    let finder = RangeFinder::new(camera, Mount::new([0.40, 0.14, 0.0, 0.0, 0.0, 0.0])?);
    let pixel_covariance = Matrix2::identity() * (0.5 * 0.5);
    // What the mount is known to: 5 mm and 0.3°.
    let mount_std = [0.005, 0.005, 0.005, 0.005, 0.0, 0.0];
    for v in [200.0, 100.0, 10.0] {
        let pixel = Vector2::new(160.0, v);
        print!("pixel ({}, {}): ", pixel.x, pixel.y);
        match finder.sight(pixel) {
            Ok(seen) => {
                let millimetres = |covariance: Matrix2<f64>| 1e3 * covariance.m11.sqrt();
                let side = if seen.bearing > 0.0 { "left" } else { "right" };
                println!(
                    "{:.2} m, {:.1}° to the {side}, ± {:.0} mm by the pixel and ± {:.0} mm by the mount",
                    seen.range,
                    seen.bearing.to_degrees().abs(),
                    millimetres(seen.noise(&pixel_covariance)),
                    millimetres(seen.systematic(&mount_std)),
                );
            }
            Err(why) => println!("no floor ({why})"),
        }
    }
    Ok(())
}

//! Where will a corner be in the next picture? A homography from matches of which every fourth is wrong, and its
//! uncertainty, which is added to the corner's own.
//!
//! `cargo run -p monorange-core --example homography` prints
//!
//! ```text
//! 60 of 80 matches agree
//! (320, 300) goes to (313.7, 313.7) ± (0.13, 0.11) px, in truth (313.6, 313.7)
//! (20, 30) goes to (23.3, 23.4) ± (0.35, 0.31) px, in truth (23.3, 23.5)
//! ```
use monorange_core::homography::{HomographyConfig, Match, estimate_homography};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The picture turns by 3°, and grows by 5 % on its way.
    let (sin, cos) = 3_f64.to_radians().sin_cos();
    let truth = Matrix3::new(1.05 * cos, -1.05 * sin, 4.0, 1.05 * sin, 1.05 * cos, -9.0, 0.0, 1e-4, 1.0);
    let carried = |from: Vector2<f64>| {
        let to: Vector3<f64> = truth * from.push(1.0);
        to.xy() / to.z
    };
    // Half a pixel of noise in each picture, and wrong matches anywhere.
    let scattered = |k: usize, size: usize| (k * 7919 % 104_729 * 31 % size) as f64;
    let matches: Vec<_> = (1..=80)
        .map(|k| {
            let from = Vector2::new(scattered(k, 640), scattered(3 * k, 480));
            let wrong = Vector2::new(scattered(5 * k, 640), scattered(7 * k, 480));
            let noise = Vector2::new(scattered(11 * k, 100) - 49.5, scattered(13 * k, 100) - 49.5) / 58.0;
            let to = if k % 4 == 0 { wrong } else { carried(from) + noise };
            Match::new(from, to, 0.25, 0.25)
        })
        .collect();
    let mut posteriors = vec![0.0; matches.len()];
    let found = estimate_homography(&HomographyConfig::default(), &matches, &mut posteriors)?;
    println!("{:.0} of {} matches agree", found.inliers, matches.len());
    for corner in [Vector2::new(320.0, 300.0), Vector2::new(20.0, 30.0)] {
        let predicted = found.homography.predict(corner, &Matrix2::zeros()).ok_or("behind the plane")?;
        println!(
            "({:.0}, {:.0}) goes to ({:.1}, {:.1}) ± ({:.2}, {:.2}) px, in truth ({:.1}, {:.1})",
            corner.x,
            corner.y,
            predicted.point.x,
            predicted.point.y,
            predicted.covariance.m11.sqrt(),
            predicted.covariance.m22.sqrt(),
            carried(corner).x,
            carried(corner).y,
        );
    }
    Ok(())
}

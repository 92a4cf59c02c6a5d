//! A robot drives towards a wall with three edges: pictures and wheels in, pose and map out.
//!
//! `cargo run -p monorange-core --features alloc --example slam` prints
//!
//! ```text
//! 0.0 s: 3 corners, 0.000 ± 0.000 m driven, in truth 0.000 m
//! 0.5 s: 3 corners, 0.513 ± 0.011 m driven, in truth 0.500 m
//! 1.0 s: 2 corners, 1.024 ± 0.015 m driven, in truth 1.000 m
//! 1.5 s: 1 corners, 1.539 ± 0.019 m driven, in truth 1.500 m
//! landmark 0: (3.07, -0.61) m, seen 11 times
//! landmark 1: (3.07, 0.10) m, seen 16 times
//! landmark 2: (3.07, 0.71) m, seen 7 times
//! ```
use monorange_core::geometry::{Camera, Mount, RangeFinder};
use monorange_core::image::Grey;
use monorange_core::pipeline::{Config, Memory, Odometry, Pipeline};
use monorange_core::slam::Status;
use nalgebra::Vector2;

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
/// Where the wall stands in front of the start, and its edges beside the robot's way (m).
const WALL: f32 = 3.0;
const EDGES: [f32; 3] = [0.7, 0.1, -0.6];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let camera = Camera::new(WIDTH, HEIGHT, [320.0, 320.0], [160.0, 120.0], 0.0, Default::default())?;
    let finder = RangeFinder::new(camera, Mount::new([0.40, 0.15, 0.0, 0.0, 0.0, 0.0])?);
    let mut pipeline = Pipeline::new(Config::new(finder), Memory::on_heap(WIDTH, HEIGHT, 32))?;
    for frame in 0..=15 {
        let time = f64::from(frame) * 0.1;
        if frame > 0 {
            // The wheels say 3 % too much.
            let reading = Odometry::Velocity { v: 1.03, omega: 0.0, seconds: 0.1 };
            pipeline.odometry(time, &reading)?;
        }
        let pixels = picture(&finder, time as f32);
        let report = pipeline.step(time, Grey::new(&pixels, WIDTH, HEIGHT)?)?;
        if frame % 5 == 0 {
            let std = report.pose_covariance.m11.sqrt();
            println!(
                "{time:.1} s: {} corners, {:.3} ± {std:.3} m driven, in truth {time:.3} m",
                report.corners.len(),
                report.pose.x,
            );
        }
    }
    let filter = pipeline.filter();
    for landmark in filter.landmarks().iter().filter(|known| known.status == Status::Confirmed) {
        let at = filter.position(landmark).ok_or("a landmark without a place")?;
        println!("landmark {}: ({:.2}, {:.2}) m, seen {} times", landmark.id, at.x, at.y, landmark.seen);
    }
    Ok(())
}

/// The wall as the camera sees it after so many metres: four panels, and the floor below.
fn picture(finder: &RangeFinder<f32>, driven: f32) -> Vec<u8> {
    let foot = |left: f32| finder.pixel_from_floor_unbounded(Vector2::new(WALL - driven, left));
    let feet = EDGES.map(|left| foot(left).unwrap_or_default());
    let mut pixels = vec![70; WIDTH * HEIGHT];
    for (index, pixel) in pixels.iter_mut().enumerate() {
        let (u, v) = ((index % WIDTH) as f32, (index / WIDTH) as f32);
        // A pixel is as much wall as lies above the foot.
        let panel = |from: usize| [120.0, 190.0, 110.0, 180.0][from];
        let mut wall = panel(0);
        for (edge, foot) in feet.iter().enumerate() {
            wall += (panel(edge + 1) - panel(edge)) * (u + 0.5 - foot.x).clamp(0.0, 1.0);
        }
        let share = (feet[0].y + 0.5 - v).clamp(0.0, 1.0);
        *pixel = (wall * share + 70.0 * (1.0 - share)) as u8;
    }
    pixels
}

//! Lines and floor corners against exact pictures: how far off they are, and whether their covariance says so.
//! `MONORANGE_CORNERS` sets the number of corners of each kind.
use monorange_core::geometry::RangeFinder;
use monorange_core::image::Grey;
use monorange_core::lines::ExtractConfig;
use monorange_tests::{Exposure, Noise, host_extractor, narrow, plain_range_finder, table1_range_finder};
use nalgebra::Vector2;
use std::f64::consts::{FRAC_PI_2, PI};

/// Every direction of an edge is vertical or of the floor, anywhere in the picture.
fn all_edges() -> ExtractConfig {
    ExtractConfig {
        floor_top: 0.0,
        floor_spread: 60_f32.to_radians(),
        vertical_spread: 30_f32.to_radians(),
        gravity_tolerance: 1.5,
        ..ExtractConfig::default()
    }
}

#[test]
fn lines_are_exact_to_a_few_hundredths_of_a_pixel_and_know_it() {
    let mut random = Noise::new(7);
    let mut extractor = host_extractor(all_edges(), plain_range_finder(128, 128));
    let exposure = Exposure::new(plain_range_finder(128, 128).camera(), 0.84);
    let (mut offsets, mut angles, mut nees, mut found) = (0.0, 0.0, 0.0, 0);
    let edges = 200;
    for _ in 0..edges {
        let theta = random.uniform(-FRAC_PI_2, FRAC_PI_2);
        let normal = Vector2::new(theta.cos(), theta.sin());
        let centre = Vector2::new(63.5 + random.uniform(-8.0, 8.0), 63.5 + random.uniform(-8.0, 8.0));
        let rho = normal.dot(&centre);
        let grey = |p: Vector2<f64>| if normal.dot(&p) > rho { 180.0 } else { 60.0 };
        let pixels = exposure.expose(grey, 4.0, &mut random);
        let extraction = extractor.extract(Grey::new(&pixels, 128, 128).unwrap()).unwrap();
        let lines = extraction.vertical_lines.iter().chain(&extraction.floor_lines);
        let Some(line) = lines.max_by(|a, b| a.length().total_cmp(&b.length())) else { continue };
        found += 1;
        let middle = line.centroid.cast::<f64>();
        let offset = normal.dot(&middle) - rho;
        let angle = line.normal.cast::<f64>().perp(&normal).asin();
        offsets += offset * offset;
        angles += angle * angle;
        nees += (offset * offset / f64::from(line.var_position_px2)
            + angle * angle / f64::from(line.var_angle))
            / 2.0;
    }
    let mean = |sum: f64| sum / f64::from(found);
    let (offset, angle, nees) = (mean(offsets).sqrt(), mean(angles).sqrt() * 180.0 / PI, mean(nees));
    println!("{found} lines: offset {offset:.4} px, angle {angle:.4}° rms, NEES/2 {nees:.3}");
    assert_eq!(found, edges);
    assert!(offset <= 0.03 && angle <= 0.02, "{offset} px, {angle}°");
    assert!((0.9..=1.1).contains(&nees), "{nees}");
}

struct Tally {
    drawn: u32,
    found: u32,
    nees: f64,
    error2: f64,
    false_corners: u32,
}

/// Draws corners where two wall faces meet the floor, seen through `finder`'s camera, and finds them again.
fn corners(finder: RangeFinder<f64>, seed: u64, number: u32) -> Tally {
    let mut random = Noise::new(seed);
    let narrow = narrow(&finder);
    let camera = *finder.camera();
    let (width, height) = (camera.width(), camera.height());
    let config = ExtractConfig { floor_top: 0.0, ..ExtractConfig::default() };
    let mut extractor = host_extractor(config, narrow);
    let exposure = Exposure::new(&camera, 0.7);
    let mut tally = Tally { drawn: number, found: 0, nees: 0.0, error2: 0.0, false_corners: 0 };
    for _ in 0..number {
        let (w, h) = (width as f64, height as f64);
        let pixel = Vector2::new(random.uniform(0.25, 0.75) * w, random.uniform(0.45, 0.75) * h);
        let ideal =
            |p: Vector2<f64>| camera.ideal_from_ray(camera.ray_from_pixel(p).expect("inside the lens model"));
        let corner = ideal(pixel);
        let lean = random.uniform(-0.03, 0.03);
        let slope = random.uniform(-0.8, 0.8);
        let bend = if random.uniform(0.0, 1.0) < 0.5 { 0.0 } else { random.uniform(-0.5, 0.5) };
        let first = random.uniform(40.0, 200.0);
        let mut other = || loop {
            let grey = random.uniform(30.0, 220.0);
            if (grey - first).abs() > 30.0 {
                return grey;
            }
        };
        let (left, floor) = (first, other());
        let right = loop {
            let grey = other();
            if (grey - floor).abs() > 30.0 {
                break grey;
            }
        };
        let grey = |p: Vector2<f64>| {
            let offset = p - corner;
            let on_right = offset.x > lean * offset.y;
            let edge = if on_right { (slope + bend) * offset.x } else { slope * offset.x };
            match (offset.y > edge, on_right) {
                (true, _) => floor,
                (false, true) => right,
                (false, false) => left,
            }
        };
        let noise = random.uniform(1.0, 5.0);
        let pixels = exposure.expose(grey, noise, &mut random);
        let extraction = extractor.extract(Grey::new(&pixels, width, height).unwrap()).unwrap();
        let mut near = None;
        for found in &extraction.corners {
            let error = found.pixel.cast::<f64>() - pixel;
            if error.norm() < 3.0 {
                near = Some((error, found.covariance.cast::<f64>()));
            } else {
                tally.false_corners += 1;
            }
        }
        if let Some((error, covariance)) = near {
            tally.found += 1;
            tally.error2 += error.norm_squared();
            let nees = error.dot(&(covariance.try_inverse().expect("a covariance") * error)) / 2.0;
            tally.nees += nees;
        }
    }
    tally
}

fn number() -> u32 {
    std::env::var("MONORANGE_CORNERS").ok().and_then(|n| n.parse().ok()).unwrap_or(1100)
}

fn check(tally: &Tally) {
    let mean = |sum: f64| sum / f64::from(tally.found);
    let (nees, rms) = (mean(tally.nees), mean(tally.error2).sqrt());
    println!(
        "{} of {} corners, {} false: error {rms:.3} px rms, NEES/2 {nees:.3}",
        tally.found, tally.drawn, tally.false_corners
    );
    assert!((0.8..=1.3).contains(&nees), "{nees}");
    assert!(f64::from(tally.found) >= 0.9 * f64::from(tally.drawn));
    assert!(tally.false_corners <= tally.drawn / 50);
}

#[test]
fn corners_know_how_far_off_they_are() {
    check(&corners(plain_range_finder(128, 96), 1, number()));
}

#[test]
fn corners_seen_through_the_lens_know_how_far_off_they_are() {
    check(&corners(table1_range_finder(0.4, 0.0), 2, number() / 4));
}

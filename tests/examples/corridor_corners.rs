//! Floor corners found in the simulated corridor, against its truth: `corridor_corners [seeds [frames [folder]]]`.
//! With a folder, pictures with lines and corners drawn in go there (PPM).
//!
//! *Listed* corners are the simulator's landmarks. *Precision* counts a corner as right when it is within 3 px of any
//! vertex of the walls' outline that nothing hides: where one wall hides the other, its edge stands out against what
//! is behind it, listed or not.
use monorange_core::geometry::Pose;
use monorange_core::image::Grey;
use monorange_core::lines::{ExtractConfig, Extraction};
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::{host_extractor, narrow};
use nalgebra::Vector2;
use std::path::PathBuf;

const NEAR_PX: f64 = 3.0;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: usize| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(default);
    let (seeds, frames) = (number(5), number(60));
    let folder = arguments.next().map(PathBuf::from);
    let verbose = std::env::var_os("MONORANGE_VERBOSE").is_some();
    println!("seed reported right precision of-listed visible recall error-px range-error-median-3m");
    let (mut all, mut all_right) = (0, 0);
    for seed in 1..=seeds as u64 {
        let scene = Scene::corridor(&SceneConfig { seed, ..SceneConfig::default() });
        let config = SimConfig { seed, frames: 550, ..SimConfig::default() };
        let simulation = Simulation::new(scene, default_rig().expect("valid"), config).expect("valid");
        let finder = *simulation.rig();
        let (width, height) = (finder.camera().width(), finder.camera().height());
        let mut extractor = host_extractor(settings(), narrow(&finder));
        let mut pixels = vec![0; width * height];
        let (mut reported, mut right, mut listed, mut visible, mut found) = (0, 0, 0, 0, 0);
        let (mut squared, mut ranges) = (0.0, Vec::new());
        for frame in (0..550).step_by(550 / frames.clamp(1, 550)) {
            simulation.render(frame, &mut pixels).expect("the camera's size");
            let extraction =
                extractor.extract(Grey::new(&pixels, width, height).expect("size")).expect("size");
            let vertices = vertices(&simulation, &simulation.true_pose(frame));
            let landmarks: Vec<Vector2<f64>> =
                simulation.visible_corners(frame).iter().map(|c| c.pixel).collect();
            let nearest = |pixel: Vector2<f64>, places: &[Vector2<f64>]| {
                places.iter().copied().min_by(|a, b| (a - pixel).norm().total_cmp(&(b - pixel).norm()))
            };
            for corner in &extraction.corners {
                reported += 1;
                let pixel = corner.pixel.cast::<f64>();
                let near =
                    |places: &[Vector2<f64>]| nearest(pixel, places).filter(|p| (p - pixel).norm() < NEAR_PX);
                listed += usize::from(near(&landmarks).is_some());
                if verbose {
                    let (v, f) =
                        (extraction.vertical_of(corner).unwrap(), extraction.floor_of(corner).unwrap());
                    let error = nearest(pixel, &vertices).map_or(99.0, |p| (p - pixel).norm());
                    println!(
                        "C {seed} {frame} {:.0} {:.0} err {error:.1} vlen {:.0} flen {:.0} floor bright {} sd {:.3} range {:.1} tilt {:.2} width {:.2}",
                        pixel.x,
                        pixel.y,
                        v.length(),
                        f.length(),
                        corner.brighter_below,
                        corner.covariance.trace().sqrt(),
                        finder.sight(pixel).map_or(-1.0, |s| s.range),
                        f.normal.x.abs(),
                        f.width_px
                    );
                }
                let Some(place) = near(&vertices) else { continue };
                right += 1;
                squared += (place - pixel).norm_squared();
                let sighted = (finder.sight(pixel), finder.sight(place));
                if let (Ok(seen), Ok(truth)) = sighted
                    && truth.range < 3.0
                {
                    ranges.push((seen.range / truth.range - 1.0).abs());
                }
            }
            visible += landmarks.len();
            let is_found = |t: &&Vector2<f64>| {
                extraction.corners.iter().any(|c| (c.pixel.cast::<f64>() - **t).norm() < NEAR_PX)
            };
            found += landmarks.iter().filter(is_found).count();
            if let Some(folder) = &folder {
                let name = folder.join(format!("corridor_{seed}_{frame:03}.ppm"));
                std::fs::write(name, overlay(&pixels, width, height, extraction, &vertices))
                    .expect("a writable folder");
            }
        }
        ranges.sort_by(f64::total_cmp);
        let ratio = |a: usize, b: usize| a as f64 / b.max(1) as f64;
        println!(
            "{seed:4} {reported:8} {right:5} {:9.3} {:9.3} {visible:7} {:6.3} {:8.3} {:.4}",
            ratio(right, reported),
            ratio(listed, reported),
            ratio(found, visible),
            (squared / right.max(1) as f64).sqrt(),
            ranges.get(ranges.len() / 2).copied().unwrap_or(f64::NAN),
        );
        all += reported;
        all_right += right;
    }
    println!("precision {:.3} of {all}", all_right as f64 / all.max(1) as f64);
}

/// The defaults, changed by `MONORANGE_SET="name=value …"`.
fn settings() -> ExtractConfig {
    let mut config = ExtractConfig::default();
    for setting in std::env::var("MONORANGE_SET").unwrap_or_default().split_whitespace() {
        let (name, value) = setting.split_once('=').expect("name=value");
        let value: f32 = value.parse().expect("a number");
        *match name {
            "edge_threshold" => &mut config.edge_threshold,
            "gravity_tolerance" => &mut config.gravity_tolerance,
            "min_vertical_length" => &mut config.min_vertical_length,
            "min_floor_length" => &mut config.min_floor_length,
            "max_width_px" => &mut config.max_width_px,
            "reach_px" => &mut config.reach_px,
            "floor_reach_px" => &mut config.floor_reach_px,
            "overshoot_px" => &mut config.overshoot_px,
            "skirting_height" => &mut config.skirting_height,
            "min_bound_length" => &mut config.min_bound_length,
            _ => panic!("no setting {name}"),
        } = value;
    }
    config
}

/// Vertices of the walls' outline that the robot sees, in pixels.
fn vertices(simulation: &Simulation, pose: &Pose<f64>) -> Vec<Vector2<f64>> {
    let eye = pose.transform(simulation.rig().mount().lever_arm());
    let seen = |vertex: Vector2<f64>| {
        let sight = vertex - eye;
        let distance = sight.norm();
        simulation.scene().cast(eye, sight / distance).is_none_or(|(wall, _)| wall > distance - 0.02)
    };
    let walls = simulation.scene().walls().iter().map(|wall| wall.from);
    walls
        .filter(|vertex| seen(*vertex))
        .filter_map(|vertex| simulation.rig().pixel_from_floor(pose.inverse_transform(vertex)).ok())
        .collect()
}

/// The picture three times as large, with vertical lines blue, floor lines green, corners red, true ones white.
fn overlay(
    pixels: &[u8],
    width: usize,
    height: usize,
    found: &Extraction,
    truth: &[Vector2<f64>],
) -> Vec<u8> {
    const ZOOM: usize = 3;
    let (w, h) = (width * ZOOM, height * ZOOM);
    let mut rgb: Vec<[u8; 3]> =
        (0..w * h).map(|k| [pixels[k / w / ZOOM * width + k % w / ZOOM] / 2; 3]).collect();
    let mut dot = |place: Vector2<f64>, colour: [u8; 3]| {
        let at = (place.add_scalar(0.5) * ZOOM as f64).map(|x| x.round() as isize);
        if (0..w as isize).contains(&at.x) && (0..h as isize).contains(&at.y) {
            rgb[at.y as usize * w + at.x as usize] = colour;
        }
    };
    let lines = found.vertical_lines.iter().map(|line| (line, [80, 160, 255]));
    for (line, colour) in lines.chain(found.floor_lines.iter().map(|line| (line, [60, 220, 90]))) {
        let [from, to] = line.ends.map(|end| end.cast::<f64>());
        (0..=900).for_each(|k| dot(from + (to - from) * f64::from(k) / 900.0, colour));
    }
    let places = truth.iter().map(|place| (*place, [255; 3], 2.5));
    let corners = found.corners.iter().map(|corner| (corner.pixel.cast::<f64>(), [255, 60, 40], 1.2));
    for (centre, colour, radius) in places.chain(corners) {
        for k in 0..64 {
            let angle = f64::from(k) / 64.0 * std::f64::consts::TAU;
            dot(centre + Vector2::new(angle.cos(), angle.sin()) * radius, colour);
        }
    }
    let mut file = format!("P6 {w} {h} 255\n").into_bytes();
    file.extend(rgb.iter().flatten());
    file
}

//! What the pictures show is what the truth says.
use monorange_core::geometry::{Mount, RangeFinder};
use monorange_sim::{HiddenBy, Scene, SceneConfig, SimConfig, Simulation, default_rig, hand_mounted};
use nalgebra::Vector2;

/// Even light, no texture, no noise, no people: only geometry is left.
fn clean(frames: usize) -> (SceneConfig, SimConfig) {
    let scene =
        SceneConfig { texture: 0.0, shading: 0.0, skirting: 0.0, posters: false, ..SceneConfig::default() };
    let drive = SimConfig {
        frames,
        walkers: 0,
        pixel_noise: 0.0,
        blur_px: 0.0,
        vignette: 0.0,
        ..SimConfig::default()
    };
    (scene, drive)
}

fn picture(simulation: &Simulation, frame: usize) -> Vec<u8> {
    let camera = simulation.rig().camera();
    let mut pixels = vec![0; camera.width() * camera.height()];
    simulation.render(frame, &mut pixels).expect("the buffer fits");
    pixels
}

/// Where a step along a line of grey levels lies: the area under it says so exactly. `None` unless it is one
/// step: flat on both sides of at most two neighbouring pixels in between.
fn step_position(levels: &[f64]) -> Option<f64> {
    let (first, last) = (levels[0], levels[levels.len() - 1]);
    let between = |level: &f64| (level - first).abs() > 1.0 && (level - last).abs() > 1.0;
    let before = levels.iter().take_while(|level| (*level - first).abs() <= 1.0).count();
    let after = levels.iter().rev().take_while(|level| (*level - last).abs() <= 1.0).count();
    let width = levels.iter().filter(|level| between(level)).count();
    if (first - last).abs() < 20.0
        || before < 2
        || after < 2
        || before + width + after != levels.len()
        || width > 2
    {
        return None;
    }
    let area: f64 = levels.iter().map(|level| (level - last) / (first - last)).sum();
    Some(area - 0.5)
}

/// Every vertical edge above a visible corner crosses picture rows where the truth projects it, and every
/// floor edge beside one crosses columns likewise, to 0.1 px; means over all say that there is no bias.
#[test]
fn rendered_edges_lie_where_the_truth_projects_them() {
    let (scene, drive) = clean(500);
    let nominal = default_rig().expect("valid");
    for rig in [nominal, hand_mounted(&nominal).expect("valid")] {
        let simulation = Simulation::new(Scene::corridor(&scene), rig, drive).expect("valid");
        let (mut vertical, mut floor) = (Vec::new(), Vec::new());
        for frame in (0..500).step_by(9) {
            let pixels = picture(&simulation, frame);
            let level = |u: usize, v: usize| f64::from(pixels[v * 320 + u]);
            for corner in simulation.visible_corners(frame).iter().filter(|corner| corner.range < 5.0) {
                let landmark = simulation.landmarks()[corner.id as usize];
                let pose = simulation.true_pose(frame);
                // The vertical edge, row by row: its true column at each row by projecting heights.
                let trace: Vec<Vector2<f64>> = (0..400)
                    .filter_map(|step| {
                        project(&rig, pose.inverse_transform(landmark.position), 0.002 * f64::from(step))
                    })
                    .collect();
                for pair in trace.windows(2) {
                    let row = pair[0].y.floor();
                    if pair[1].y > row || !(3.0..237.0).contains(&row) {
                        continue;
                    }
                    let fraction = (pair[0].y - row) / (pair[0].y - pair[1].y);
                    let true_u = pair[0].x + (pair[1].x - pair[0].x) * fraction;
                    let middle = true_u.round() as usize;
                    if !(6..314).contains(&middle) {
                        continue;
                    }
                    let window: Vec<f64> =
                        (middle - 4..=middle + 4).map(|u| level(u, row as usize)).collect();
                    if let Some(position) = step_position(&window) {
                        vertical.push(position + middle as f64 - 4.0 - true_u);
                    }
                }
                // The floor edge along both walls, column by column.
                for wall in landmark.walls.map(|wall| &simulation.scene().walls()[wall]) {
                    let trace: Vec<Vector2<f64>> = (0..=400)
                        .filter_map(|step| {
                            let place = wall.from + (wall.to - wall.from) * (f64::from(step) / 400.0);
                            rig.pixel_from_floor_unbounded(pose.inverse_transform(place)).ok()
                        })
                        .collect();
                    if trace.len() < 401 {
                        continue;
                    }
                    for (index, pair) in trace.windows(2).enumerate() {
                        let column = pair[0].x.max(pair[1].x).floor();
                        let inside = column >= pair[0].x.min(pair[1].x) && (3.0..317.0).contains(&column);
                        let run = pair[1].x - pair[0].x;
                        let slope = (pair[1].y - pair[0].y) / run;
                        let true_v = pair[0].y + slope * (column - pair[0].x);
                        let middle = true_v.round();
                        if !inside || slope.abs() > 0.7 || !(6.0..234.0).contains(&middle) {
                            continue;
                        }
                        let middle = middle as usize;
                        let window: Vec<f64> =
                            (middle - 4..=middle + 4).map(|v| level(column as usize, v)).collect();
                        // The foot itself must be seen there, not something before it.
                        let fraction = f64::from(index as u32) / 400.0;
                        let sight = wall.from + (wall.to - wall.from) * fraction - pose.position();
                        let seen = simulation.scene().cast(pose.position(), sight * 0.9999);
                        if seen.is_some_and(|(distance, _)| distance < 1.0) {
                            continue;
                        }
                        if let Some(position) = step_position(&window) {
                            floor.push(position + middle as f64 - 4.0 - true_v);
                        }
                    }
                }
            }
        }
        for (name, mut errors) in [("vertical", vertical), ("floor", floor)] {
            assert!(errors.len() > 1000, "{name}: only {} rows or columns", errors.len());
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            errors.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
            let [median, most] = [50, 98].map(|percent| errors[errors.len() * percent / 100].abs());
            println!("{name}: {} samples, mean {mean:.4}, median {median:.4}, 98 % {most:.4}", errors.len());
            assert!(mean.abs() < 0.01, "{name}: bias {mean}");
            assert!(median < 0.05, "{name}: median {median}");
            assert!(most < 0.1, "{name}: 98 % within {most}");
        }
    }
}

/// The pixel of a point of the robot's plan at a height above the floor.
fn project(rig: &RangeFinder<f64>, place: Vector2<f64>, height: f64) -> Option<Vector2<f64>> {
    // A point at height z is a floor point for a lens that is z lower.
    let [lens, tilt, roll, yaw, forward, left] = rig.mount().parameters();
    let mount = Mount::new([lens - height, tilt, roll, yaw, forward, left]).ok()?;
    RangeFinder::new(*rig.camera(), mount).pixel_from_floor(place).ok()
}

/// A corner that the truth calls hidden by a wall shows no step, one that it calls visible does: checked by
/// casting rays to the point itself.
#[test]
fn hidden_corners_have_something_before_them() {
    let simulation = Simulation::new(
        Scene::corridor(&SceneConfig::default()),
        default_rig().expect("valid"),
        SimConfig::default(),
    )
    .expect("valid");
    let mut counts = [0; 3];
    for frame in (0..600).step_by(7) {
        let pose = simulation.true_pose(frame);
        for corner in simulation.corners(frame) {
            let sight = simulation.landmarks()[corner.id as usize].position - pose.position();
            // Just beside the corner on either side, so that its own walls do not decide.
            let reach = [-1e-7, 1e-7].map(|turn| {
                let direction = Vector2::new(sight.x - turn * sight.y, sight.y + turn * sight.x);
                simulation.scene().cast(pose.position(), direction).map_or(f64::MAX, |(distance, _)| distance)
            });
            let open = reach.iter().any(|distance| *distance > 0.9999);
            match corner.hidden {
                None => assert!(open, "frame {frame}, corner {}: {reach:?}", corner.id),
                Some(HiddenBy::Wall) => assert!(!open, "frame {frame}, corner {}: {reach:?}", corner.id),
                _ => assert!(open),
            }
            counts[match corner.hidden {
                None => 0,
                Some(HiddenBy::Wall) => 1,
                _ => 2,
            }] += 1;
        }
    }
    assert!(counts.iter().all(|count| *count > 50), "visible, behind walls, behind people: {counts:?}");
}

/// No corner is half visible: an extractor that finds one is never right where the truth says nothing.
#[test]
fn every_vertex_of_the_plan_is_a_landmark() {
    for seed in 0..20 {
        let settings = SceneConfig { seed, ..SceneConfig::default() };
        for scene in [Scene::corridor(&settings), Scene::office(&settings), Scene::table2(&settings)] {
            let (walls, landmarks) = (scene.walls().len(), scene.landmarks().len());
            assert_eq!(landmarks, walls, "{} {seed}", scene.name());
        }
    }
}

/// The way leads past enough corners to be worth driving.
#[test]
fn most_pictures_show_several_corners_within_five_metres() {
    for (scene, least_one, least_two) in [
        (Scene::corridor(&SceneConfig::default()), 0.97, 0.90),
        (Scene::office(&SceneConfig::default()), 0.85, 0.75),
    ] {
        let name = scene.name();
        let simulation =
            Simulation::new(scene, default_rig().expect("valid"), SimConfig::default()).expect("valid");
        let near = |frame| simulation.visible_corners(frame).iter().filter(|seen| seen.range < 5.0).count();
        let counts: Vec<usize> = (0..simulation.len()).map(near).collect();
        let share =
            |least| counts.iter().filter(|count| **count >= least).count() as f64 / counts.len() as f64;
        println!("{name}: one corner in {:.3} of the pictures, two in {:.3}", share(1), share(2));
        assert!(share(1) > least_one && share(2) > least_two, "{name}: {} {}", share(1), share(2));
    }
}

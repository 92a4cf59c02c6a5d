//! A saved map and a robot somewhere in it: 20 starts on a second lap of a corridor, and a drive in another one.
use monorange_core::geometry::Pose;
use monorange_core::image::Grey;
use monorange_core::pipeline::{
    Config, CornersFrom, Located, Memory, Odometry, OnHeap, Pipeline, Recovery, Report, saved_map,
};
use monorange_core::slam::SavedMap;
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::corridor::config_for;
use std::fmt::Write;
use std::ops::Range;

/// Frames of a lap and of what is driven in search of a place: 6 m.
const LAP: usize = 600;
const SEARCH: usize = 50;

fn simulation(seed: u64, frames: usize) -> Simulation {
    let scene = Scene::corridor(&SceneConfig { seed, ..Default::default() });
    let config = SimConfig { seed, frames, walkers: 4, ..Default::default() };
    Simulation::new(scene, default_rig().unwrap(), config).unwrap()
}

fn pipeline(simulation: &Simulation) -> Pipeline<OnHeap> {
    let config = Config { corners_from: CornersFrom::Proposals, ..config_for(simulation).unwrap() };
    let camera = *config.finder.camera();
    Pipeline::new(config, Memory::on_heap(camera.width(), camera.height(), 512)).unwrap()
}

/// Drives along the frames until `each` says that it is enough.
fn drive(
    simulation: &Simulation,
    pipeline: &mut Pipeline<OnHeap>,
    frames: Range<usize>,
    mut each: impl FnMut(&mut Pipeline<OnHeap>, &Report, usize) -> bool,
) {
    let camera = *pipeline.config().finder.camera();
    let mut picture = vec![0; camera.width() * camera.height()];
    let start = simulation.time(frames.start);
    for frame in frames.clone() {
        let time = simulation.time(frame) - start;
        if frame > frames.start {
            let (twist, seconds) =
                (simulation.odometry(frame - 1), simulation.time(frame) - simulation.time(frame - 1));
            let (v, omega, seconds) = (twist.speed as f32, twist.turn as f32, seconds as f32);
            pipeline.odometry(time, &Odometry::Velocity { v, omega, seconds }).unwrap();
        }
        simulation.render(frame, &mut picture).unwrap();
        let grey = Grey::new(&picture, camera.width(), camera.height()).unwrap();
        let report = pipeline.step(time, grey).unwrap();
        if each(pipeline, &report, frame) {
            return;
        }
    }
}

/// Where the robot is found, and after which frame.
fn search(
    simulation: &Simulation,
    map: &SavedMap<'_>,
    frames: Range<usize>,
) -> Option<(usize, Pose<f32>, f32)> {
    let mut found = None;
    let mut own = pipeline(simulation);
    own.number_from(map.next_id());
    drive(simulation, &mut own, frames, |pipeline, report, frame| {
        let located: Option<Located> = pipeline.locate(map, 0.0, false, report).unwrap();
        if let Some(Located { names, .. }) = &located {
            assert!(names.len() >= 5, "{names:?}");
            let covariance = pipeline.filter().pose_covariance();
            found = Some((frame, pipeline.filter().pose(), (covariance.m11 + covariance.m22).sqrt()));
        }
        located.is_some()
    });
    found
}

#[test]
#[ignore = "golden run: cargo xtask test"]
fn a_robot_is_found_in_a_saved_map_where_it_is_and_nowhere_else() {
    let simulation = simulation(31, 2 * LAP + 30 + SEARCH);
    let mut first = pipeline(&simulation);
    drive(&simulation, &mut first, 0..LAP, |_, _, _| false);
    let mut state = vec![0; 4_000_000];
    let length = first.save(&mut state).unwrap();
    let map = saved_map(&state[..length]).unwrap();
    let map_from_truth = simulation.true_pose(0).inverse();
    let (mut found, mut table) = (0, String::new());
    for start in 0..20 {
        let from = LAP + 30 * start;
        let Some((frame, pose, std)) = search(&simulation, &map, from..from + SEARCH) else {
            writeln!(table, "{from:4}  not found").unwrap();
            continue;
        };
        let truth = map_from_truth.compose(&simulation.true_pose(frame));
        let [x, y] = [truth.x - f64::from(pose.x), truth.y - f64::from(pose.y)];
        let turn = (truth.heading - f64::from(pose.heading)).sin().asin().to_degrees();
        writeln!(
            table,
            "{from:4}  found after {:2} frames, {:.2} m and {turn:.1}° off, σ {std:.2} m",
            frame - from,
            x.hypot(y)
        )
        .unwrap();
        assert!(x.hypot(y) < 1.0 && turn.abs() < 5.0, "a wrong place\n{table}");
        assert!(x.hypot(y) < 3.5 * f64::from(std), "a place that is surer than it should be\n{table}");
        found += 1;
    }
    println!("{table}{found} of 20");
    assert!(found >= 16, "{table}");

    let other = self::simulation(32, 300);
    assert_eq!(search(&other, &map, 0..300), None, "another corridor");
}

/// Drives on from where both are, along frames of which those in `carried` are skipped: the robot does not know of them. Ends where the robot is
/// found somewhere else than it believes, with the distance that it has driven since it was put down.
fn drive_on(
    simulation: &Simulation,
    pipeline: &mut Pipeline<OnHeap>,
    recovery: &mut Recovery,
    frames: Range<usize>,
    carried: Range<usize>,
) -> Option<usize> {
    let camera = *pipeline.config().finder.camera();
    let mut picture = vec![0; camera.width() * camera.height()];
    let mut time = pipeline.filter().time();
    for frame in frames.filter(|frame| !carried.contains(frame)) {
        let (twist, seconds) =
            (simulation.odometry(frame - 1), simulation.time(frame) - simulation.time(frame - 1));
        if frame != carried.end {
            let reading = Odometry::Velocity {
                v: twist.speed as f32,
                omega: twist.turn as f32,
                seconds: seconds as f32,
            };
            pipeline.odometry(time + seconds, &reading).unwrap();
            recovery.odometry(time + seconds, &reading).unwrap();
        }
        time += seconds;
        simulation.render(frame, &mut picture).unwrap();
        let grey = Grey::new(&picture, camera.width(), camera.height()).unwrap();
        let report = pipeline.step(time, grey).unwrap();
        if recovery.look(pipeline, &report, grey, false).unwrap().is_some() {
            return Some(frame);
        }
    }
    None
}

#[test]
#[ignore = "golden run: cargo xtask test"]
fn a_robot_that_is_carried_away_is_found_again_and_one_that_is_not_stays() {
    // Not the corridor that the bounds were chosen on, 33.
    let seed = std::env::var("MONORANGE_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(35);
    let simulation = simulation(seed, 2 * LAP);
    let mut pipeline = pipeline(&simulation);
    let mut recovery = Recovery::new(pipeline.config(), 512);
    let map_from_truth = simulation.true_pose(0).inverse();
    let (mut frame, mut found, mut table) = (1, 0, String::new());
    for from in (0..10).map(|start| LAP + 45 * start) {
        let moved = drive_on(&simulation, &mut pipeline, &mut recovery, frame..from, 0..0);
        assert_eq!(moved, None, "a robot that nobody carried, before {from}");
        frame = from;
        // 3 m on along the way, and turned as the way is.
        let (mut carried, mut watched, put_down) = (pipeline.clone(), recovery.clone(), from + 25);
        let after = drive_on(&simulation, &mut carried, &mut watched, from..put_down + 60, from..put_down);
        let pose = carried.filter().pose();
        let truth = map_from_truth.compose(&simulation.true_pose(after.unwrap_or(put_down + 59)));
        let off = (truth.x - f64::from(pose.x)).hypot(truth.y - f64::from(pose.y));
        let when = match after {
            Some(frame) => format!("found after {:2} frames", frame - put_down),
            None if watched.is_looking() => "looked for".to_owned(),
            None => "not missed".to_owned(),
        };
        writeln!(table, "{from:4}  {when}, {off:.2} m off").unwrap();
        assert!(after.is_none() || off < 0.5, "a wrong place\n{table}");
        found += usize::from(after.is_some());
    }
    println!("{table}{found} of 10");
    assert!(found >= 6, "{table}");
}

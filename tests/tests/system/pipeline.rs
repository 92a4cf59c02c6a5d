//! The pipeline obeys its configuration: who carries corners and who moves the robot, however the picture comes.
use monorange_core::features::Detector;
use monorange_core::image::Grey;
use monorange_core::pipeline::{
    Carrier, Config, Coverage, Memory, MotionFrom, MovedBy, Odometry, OnHeap, Pipeline, Report, Stage,
};
use monorange_core::slam::Outcome;
use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
use monorange_tests::corridor::config_for;

const FRAMES: usize = 12;

/// The first pictures of a corridor, with the wheels' reading before each.
struct Recording {
    config: Config,
    frames: Vec<(f64, Option<Odometry>, Vec<u8>)>,
    size: (usize, usize),
}

fn recording() -> Recording {
    let scene = Scene::corridor(&SceneConfig { seed: 11, ..Default::default() });
    let drawn = SimConfig { seed: 11, frames: FRAMES, ..Default::default() };
    let simulation = Simulation::new(scene, default_rig().expect("a rig"), drawn).expect("a corridor");
    let config = config_for(&simulation).expect("settings");
    let size = (config.finder.camera().width(), config.finder.camera().height());
    let frames = (0..FRAMES).map(|frame| {
        let time = simulation.time(frame);
        let reading = frame.checked_sub(1).map(|before| {
            let (twist, seconds) = (simulation.odometry(before), time - simulation.time(before));
            Odometry::Velocity { v: twist.speed as f32, omega: twist.turn as f32, seconds: seconds as f32 }
        });
        let mut pixels = vec![0; size.0 * size.1];
        simulation.render(frame, &mut pixels).expect("a picture");
        (time, reading, pixels)
    });
    Recording { config, frames: frames.collect(), size }
}

impl Recording {
    fn pipeline(&self, carrier: Carrier, motion_from: MotionFrom) -> Pipeline<OnHeap> {
        let config = Config { carrier, motion_from, ..self.config };
        Pipeline::new(config, Memory::on_heap(self.size.0, self.size.1, 128)).expect("good settings")
    }

    /// Every report of a drive; `picture` gives the pipeline one.
    fn drive(
        &self,
        mut pipeline: Pipeline<OnHeap>,
        wheels: bool,
        mut picture: impl FnMut(&mut Pipeline<OnHeap>, f64, Grey<'_>) -> Report,
    ) -> Vec<Report> {
        let step = |(time, reading, pixels): &(f64, Option<Odometry>, Vec<u8>)| {
            if let Some(reading) = reading.filter(|_| wheels) {
                pipeline.odometry(*time, &reading).expect("a reading");
            }
            picture(&mut pipeline, *time, Grey::new(pixels, self.size.0, self.size.1).expect("its size"))
        };
        self.frames.iter().map(step).collect()
    }
}

fn whole(pipeline: &mut Pipeline<OnHeap>, time: f64, picture: Grey<'_>) -> Report {
    pipeline.step(time, picture).expect("a picture")
}

#[test]
fn the_carrier_and_the_motion_are_the_configurations() {
    let recording = recording();
    let cases = [
        (Carrier::Map, MotionFrom::ByCarrier, true, MovedBy::Odometry),
        (Carrier::Floor, MotionFrom::ByCarrier, true, MovedBy::Both),
        (Carrier::Free, MotionFrom::ByCarrier, true, MovedBy::Odometry),
        (Carrier::Floor, MotionFrom::Odometry, true, MovedBy::Odometry),
        (Carrier::Map, MotionFrom::Pictures, false, MovedBy::Pictures),
        (Carrier::Free, MotionFrom::Pictures, false, MovedBy::Pictures),
        (Carrier::Map, MotionFrom::Pictures, true, MovedBy::Both),
    ];
    for (carrier, motion_from, wheels, moved_by) in cases {
        let reports = recording.drive(recording.pipeline(carrier, motion_from), wheels, whole);
        let case = format!("{carrier:?}, {motion_from:?}, wheels {wheels}");
        assert_eq!((reports[0].moved_by, reports[0].carried_by), (MovedBy::Nothing, Carrier::Map), "{case}");
        for report in &reports[1..] {
            assert_eq!((report.moved_by, report.carried_by), (moved_by, carrier), "{case}");
            let readings = u32::from(wheels);
            assert_eq!(report.odometry, Coverage { readings, gap: 0.0, overlap: 0.0 }, "{case}");
        }
        assert!(reports[FRAMES - 1].pose.position().norm() > 0.2, "{case}: {:?}", reports[FRAMES - 1].pose);
    }
}

#[test]
fn a_picture_gives_the_same_bits_whole_by_rows_and_with_features_found_elsewhere() {
    let recording = recording();
    let floor = || recording.pipeline(Carrier::Floor, MotionFrom::ByCarrier);
    let expected = recording.drive(floor(), true, whole);
    let mut stages = Vec::new();
    let by_rows = recording.drive(floor(), true, |pipeline, time, picture| {
        pipeline.begin();
        picture.rows().for_each(|row| pipeline.push_row(row).expect("a row"));
        pipeline.finish_timed(time, |stage| stages.push(stage)).expect("a picture")
    });
    assert_eq!(by_rows, expected);
    assert_eq!(stages[..3], [Stage::Corners, Stage::Motion, Stage::Filter]);
    let mut detector = Detector::new(recording.config.visual.features).expect("a detector");
    let elsewhere = recording.drive(floor(), true, |pipeline, time, picture| {
        let features = detector.detect(picture).expect("features");
        pipeline.step_with_features(time, picture, &features, |_| ()).expect("a picture")
    });
    assert_eq!(elsewhere, expected);
}

/// Wheels beside the free homography are applied as they come: a picture that is due later has no part in them.
#[test]
fn beside_the_free_homography_every_reading_moves_the_robot_at_once() {
    let recording = recording();
    let mut free = recording.pipeline(Carrier::Free, MotionFrom::ByCarrier);
    let mut map = recording.pipeline(Carrier::Map, MotionFrom::ByCarrier);
    let mut floor = recording.pipeline(Carrier::Floor, MotionFrom::ByCarrier);
    let (mut readings, half) = (0, Odometry::Velocity { v: 0.4, omega: 0.3, seconds: 0.05 });
    for (time, _, pixels) in &recording.frames[..3] {
        let picture = Grey::new(pixels, recording.size.0, recording.size.1).expect("its size");
        for pipeline in [&mut free, &mut map, &mut floor] {
            let before = pipeline.filter().pose();
            for part in [0.05, 0.1].into_iter().filter(|_| *time > 0.0) {
                pipeline.odometry(time - 0.1 + part, &half).expect("a reading");
                readings += 1;
            }
            let waits = pipeline.config().carrier == Carrier::Floor || *time <= 0.0;
            assert_eq!(pipeline.filter().pose() == before, waits);
        }
        assert_eq!(free.filter().pose(), map.filter().pose());
        assert_eq!(free.filter().pose_covariance(), map.filter().pose_covariance());
        // The corners would tell them apart from here on.
        let _ = (free.step(*time, picture), floor.step(*time, picture));
        free = if *time > 0.0 { break } else { free };
    }
    assert!(readings > 0);
}

#[test]
fn a_picture_without_features_is_not_carried_by_the_one_before() {
    let recording = recording();
    let mut pipeline = recording.pipeline(Carrier::Floor, MotionFrom::ByCarrier);
    let (width, height) = recording.size;
    let mut last = 0.0;
    for (time, reading, pixels) in &recording.frames[..4] {
        if let Some(reading) = reading {
            pipeline.odometry(*time, reading).expect("a reading");
        }
        last = *time;
        pipeline.step(last, Grey::new(pixels, width, height).expect("its size")).expect("a picture");
    }
    let blank = vec![90; width * height];
    let standing = Odometry::Velocity { v: 0.0, omega: 0.0, seconds: 0.1 };
    pipeline.odometry(last + 0.1, &standing).expect("a reading");
    let report = pipeline.step(last + 0.1, Grey::new(&blank, width, height).expect("its size"));
    let report = report.expect("a picture");
    assert_eq!((report.carried_by, report.moved_by), (Carrier::Map, MovedBy::Held));
}

/// Another sensor's measurement between two pictures takes what waits for the second, which is not taken twice.
#[test]
fn a_measurement_between_pictures_moves_the_robot_once() {
    let recording = recording();
    let run = |measure: bool| {
        let mut pipeline = recording.pipeline(Carrier::Floor, MotionFrom::ByCarrier);
        for (time, reading, pixels) in &recording.frames {
            if let Some(reading) = reading {
                pipeline.odometry(*time, reading).expect("a reading");
            }
            if measure {
                let nothing: &mut [Outcome<f32>] = &mut [];
                pipeline.measure(*time, &[], nothing).expect("no feature");
            }
            let picture = Grey::new(pixels, recording.size.0, recording.size.1).expect("its size");
            pipeline.step(*time, picture).expect("a picture");
        }
        pipeline.filter().pose().position()
    };
    let (alone, with_sensor) = (run(false), run(true));
    assert!((alone - with_sensor).norm() < 0.05 * alone.norm(), "{alone:?} {with_sensor:?}");
}

#[test]
fn without_pictures_the_wheels_move_the_robot_as_far() {
    let recording = recording();
    let poses = [Carrier::Map, Carrier::Floor].map(|carrier| {
        let mut pipeline = recording.pipeline(carrier, MotionFrom::ByCarrier);
        for (time, reading, _) in &recording.frames {
            if let Some(reading) = reading {
                pipeline.odometry(*time, reading).expect("a reading");
            }
            pipeline.advance(*time).expect("a time");
        }
        (pipeline.filter().pose(), pipeline.filter().pose_covariance())
    });
    assert!(poses[0].0.position().norm() > 0.2);
    assert_eq!(poses[0], poses[1]);
}

#[test]
fn gaps_and_overlaps_of_the_odometry_are_in_the_report() {
    let recording = recording();
    let mut pipeline = recording.pipeline(Carrier::Map, MotionFrom::ByCarrier);
    let reading = |seconds| Odometry::Velocity { v: 0.1, omega: 0.0, seconds };
    let picture = Grey::new(&recording.frames[0].2, recording.size.0, recording.size.1).expect("its size");
    pipeline.odometry(0.1, &reading(0.1)).expect("a reading");
    pipeline.odometry(0.3, &reading(0.1)).expect("a reading"); // nothing from 0.1 to 0.2
    let first = pipeline.step(0.3, picture).expect("a picture").odometry;
    assert!(first.readings == 2 && (first.gap - 0.1).abs() < 1e-6 && first.overlap == 0.0, "{first:?}");
    pipeline.odometry(0.4, &reading(0.15)).expect("a reading"); // 0.25 to 0.3 again
    let second = pipeline.step(0.4, picture).expect("a picture").odometry;
    assert!(second.gap == 0.0 && (second.overlap - 0.05).abs() < 1e-6, "{second:?}");
}

//! Saved maps that were damaged: refused, or a run in them goes on.
//!
//! `MONORANGE_FUZZ_SECONDS=600 cargo test -p monorange-formats --test hostile maps` is the long run.

use crate::calls::pipeline;
use crate::files::survive;
use monorange_core::{
    lines::Corner,
    pipeline::{Odometry, OnHeap, Pipeline, Report},
};
use monorange_formats::files::MapFile;
use nalgebra::{Matrix2, Vector2};

/// A robot that stands before eight corners, with what it saw last.
fn mapped() -> (Pipeline<OnHeap>, Report) {
    const PIXELS: [[f32; 2]; 8] = [
        [6.0, 30.0],
        [14.0, 41.0],
        [22.0, 24.0],
        [29.0, 35.0],
        [37.0, 44.0],
        [44.0, 27.0],
        [51.0, 38.0],
        [58.0, 22.0],
    ];
    let corners = PIXELS.map(|pixel| Corner {
        pixel: Vector2::from(pixel),
        covariance: Matrix2::identity() * 0.05,
        vertical: 200,
        floor: 200,
        brighter_right: true,
        brighter_below: false,
    });
    let mut pipeline = pipeline();
    let mut report = None;
    for picture in 0..8 {
        let time = 0.1 * f64::from(picture);
        pipeline.odometry(time, &Odometry::Velocity { v: 0.0, omega: 0.0, seconds: 0.1 }).unwrap();
        report = Some(pipeline.observe(time, &corners).unwrap());
    }
    (pipeline, report.unwrap())
}

#[test]
fn saved_maps() {
    let mut sound = Vec::new();
    MapFile::of(&mut mapped().0, 12.5, None).unwrap().write(&mut sound).unwrap();
    let found = std::cell::Cell::new(0);
    survive("map.bin", &[sound], |path, _| {
        let Ok(file) = MapFile::read(path) else { return };
        let map = file.map().unwrap();
        for landmark in map.landmarks() {
            let spread = map.covariance(&landmark, &landmark);
            assert!(map.position(&landmark).iter().chain(&spread).all(|number| number.is_finite()));
            assert!(spread.diagonal().min() >= 0.0);
        }
        let (mut own, report) = mapped();
        own.number_from(map.next_id());
        let later = file.start - 12.5;
        let located = own.locate(&map, later, false, &report);
        found.set(found.get() + u64::from(located.is_ok_and(|place| place.is_some())));
        let _ = own.odometry(0.8, &Odometry::Velocity { v: 0.1, omega: 0.1, seconds: 0.1 });
        let _ = own.observe(0.8, &[]);
        let pose = own.filter().pose_covariance();
        assert!(pose.iter().all(|number| number.is_finite()) && pose.diagonal().min() >= 0.0);
    });
    // Or it would be only refusals that are tried.
    assert!(found.get() > 0);
}

//! Whatever is called in whatever order with whatever numbers: the pipeline answers with a report or an error, and a state that was
//! damaged is refused or goes on.
//!
//! `MONORANGE_FUZZ_SECONDS=600 cargo test -p monorange-formats --test hostile calls` is the long run.

use crate::chance::Chance;
use crate::work::Work;
use monorange_core::{
    geometry::{Camera, Distortion, Mount, RangeFinder},
    image::Grey,
    lines::Corner,
    pipeline::{Config, Memory, Odometry, OnHeap, Pipeline},
    slam::Increment,
};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::time::Duration;

const SIZE: [usize; 2] = [64, 48];

/// Mostly of the size given, now and then what no sensor gives.
fn number(chance: &mut Chance, size: f32) -> f32 {
    const ODD: [f32; 9] =
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, -1.0, 1e30, -1e30, 1e-30, f32::MAX];
    match chance.below(12) {
        0 => ODD[chance.below(9)],
        1 => f32::from_bits(chance.next() as u32),
        _ => size * (chance.below(2001) as f32 / 1000.0 - 1.0),
    }
}

pub(crate) fn pipeline() -> Pipeline<OnHeap> {
    let lens = Distortion { k1: -0.2, k2: 0.3, p1: 0.0, p2: 0.0, k3: 0.0 };
    let camera = Camera::new(SIZE[0], SIZE[1], [73.0, 73.0], [31.5, 23.5], 0.0, lens).unwrap();
    let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
    Pipeline::new(Config::new(finder), Memory::on_heap(SIZE[0], SIZE[1], 8)).unwrap()
}

fn call(pipeline: &mut Pipeline<OnHeap>, time: &mut f64, chance: &mut Chance, state: &mut Vec<u8>) {
    *time += match chance.below(20) {
        0 => -1.0,
        1 => f64::from(number(chance, 1e3)),
        _ => 0.1,
    };
    if !time.is_finite() || time.abs() > 1e9 {
        let _ = pipeline.advance(*time);
        *time = 0.0;
    }
    let pixels: Vec<u8> = (0..SIZE[0] * SIZE[1]).map(|_| chance.next() as u8).collect();
    match chance.below(9) {
        0 | 1 => {
            let (v, omega, seconds) = (number(chance, 1.0), number(chance, 0.5), number(chance, 0.1));
            let _ = pipeline.odometry(*time, &Odometry::Velocity { v, omega, seconds });
        }
        2 => {
            let [forward, left, turn, seconds] = [0.2, 0.01, 0.1, 0.1].map(|size| number(chance, size));
            let _ = pipeline.odometry(*time, &Odometry::Increment { forward, left, turn, seconds });
        }
        3 => {
            let delta = Vector3::from_fn(|_, _| number(chance, 0.2));
            let covariance = Matrix3::from_fn(|_, _| number(chance, 0.01));
            let _ = pipeline.motion(*time, &Increment { delta, covariance });
        }
        4 | 5 => {
            let corners: Vec<_> = (0..chance.below(40))
                .map(|_| Corner {
                    pixel: Vector2::new(32.0 + number(chance, 32.0), 24.0 + number(chance, 24.0)),
                    covariance: Matrix2::identity() * number(chance, 1.0).abs(),
                    vertical: chance.next() as u8,
                    floor: chance.next() as u8,
                    brighter_right: chance.below(2) == 0,
                    brighter_below: chance.below(2) == 0,
                })
                .collect();
            let _ = pipeline.observe(*time, &corners);
        }
        6 => {
            let _ = pipeline.step(*time, Grey::new(&pixels, SIZE[0], SIZE[1]).unwrap());
        }
        7 => {
            pipeline.begin();
            for row in pixels.chunks(SIZE[0]).take(chance.below(60)) {
                let _ = pipeline.push_row(row.get(..chance.below(80)).unwrap_or(row));
            }
            let _ = pipeline.finish(*time);
        }
        _ => {
            let mut bytes = vec![0; 1 << 15];
            if let Ok(length) = pipeline.save(&mut bytes) {
                bytes.truncate(length);
                std::mem::swap(state, &mut bytes);
            }
            for _ in 0..chance.below(4) {
                let place = chance.below(state.len());
                if let Some(byte) = state.get_mut(place) {
                    *byte = chance.next() as u8;
                }
            }
            if chance.below(4) == 0 {
                state.truncate(chance.below(state.len()));
            }
            let _ = pipeline.restore(state);
        }
    }
}

#[test]
fn any_calls_in_any_order_with_any_numbers() {
    let seconds = std::env::var("MONORANGE_FUZZ_SECONDS").ok().and_then(|text| text.parse().ok());
    let (begun, mut drives, mut calls) = (Work::begin(), 0_u64, 0_u64);
    // Always the same drives, or for as long as is asked for.
    let goes_on = |drives| seconds.map_or(drives < 60, |s| begun.done() < Duration::from_secs_f64(s));
    while goes_on(drives) {
        drives += 1;
        let mut chance = Chance(drives.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        let (mut pipeline, mut time, mut state) = (pipeline(), 0.0, Vec::new());
        for number in 0..100 {
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                call(&mut pipeline, &mut time, &mut chance, &mut state);
            }));
            assert!(outcome.is_ok(), "drive {drives}, call {number}");
            calls += 1;
        }
    }
    println!("{drives} drives of {calls} calls in {:.0} s of processor time", begun.done().as_secs_f64());
}

//! The firmware's library, compiled for this machine, against the pipeline; on a board, `in_qemu.rs`
//! does the same with fewer pictures.

use crate::bench::wire::Wire;
use crate::drive::*;
use monorange_mcu::{Arrays, Mapper};
use monorange_protocol::client::Client;
use std::time::Duration;

#[test]
fn two_hundred_pictures_are_answered_with_the_pipelines_bytes() {
    let simulation = corridor(200);
    let config = config_for(&simulation);
    let mapper = Mapper::new(Box::leak(Box::new(Arrays::new())));
    let mut client = Client::new(Wire::new(mapper, 0), 1, Duration::from_secs(10)).unwrap();
    let reset_count = configure(&mut client, &config);
    let mut pipeline = host(config);
    let mut most = 0;
    for frame in 0..simulation.len() {
        let step = step(&simulation, frame);
        let report = host_step(&mut pipeline, &step);
        let answer = device_step(&mut client, frame as u32, &step).unwrap();
        let wanted = host_bytes(&pipeline, &report, frame as u32, &step, reset_count);
        assert_eq!(answer.faults, [], "frame {frame}");
        assert!(device_bytes(&answer) == wanted, "frame {frame}: {answer:#?}\n{report:#?}");
        most = most.max(answer.landmarks.len());
    }
    assert!(most >= 20, "the map has only {most} landmarks");
}

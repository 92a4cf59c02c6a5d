//! States that a device is given: its own under its own configuration, under another one, and damaged ones whose checksum was
//! made right.

use crate::bench::wire::Wire;
use crate::drive::*;
use monorange_core::{
    geometry::{Mount, RangeFinder},
    pipeline::Config,
    slam::Covariance,
};
use monorange_mcu::{Arrays, Mapper};
use monorange_protocol::{
    client::{Answer, Client},
    conversion::range_of_spot,
    frame::checksum,
    message::{
        Cause, DeviceMessage, Fault, HostMessage, OTHER_CONFIGURATION, Range, SaveState, Sight, Spot, State,
    },
};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};
use std::time::Duration;

type Line = Client<Wire<Mapper>>;

fn device(config: &Config) -> Line {
    let mapper = Mapper::new(Box::leak(Box::new(Arrays::new())));
    let mut client = Client::new(Wire::new(mapper, 0), 1, Duration::from_secs(10)).unwrap();
    configure(&mut client, config);
    client
}

/// A device that has driven, with the state that it saved, and the step after that.
fn driven(config: &Config, frames: usize) -> (Line, Vec<u8>, Vec<Step>) {
    let simulation = corridor(frames + 2);
    let mut client = device(config);
    for frame in 0..frames {
        device_step(&mut client, frame as u32, &step(&simulation, frame)).unwrap();
    }
    let state = save(&mut client);
    (client, state, (frames..frames + 2).map(|frame| step(&simulation, frame)).collect())
}

fn save(client: &mut Line) -> Vec<u8> {
    client.send(&HostMessage::SaveState(SaveState {}), &mut |_| ()).unwrap();
    let mut state = vec![];
    let whole = &mut |message: &DeviceMessage<'_>| {
        let DeviceMessage::State(chunk) = message else { return false };
        state.extend(chunk.bytes);
        state.len() as u32 == chunk.total
    };
    client.wait_for(whole).unwrap();
    state
}

/// Gives a state; returns what is refused.
fn give(client: &mut Line, state: &[u8]) -> Option<Fault> {
    let (checksum, total) = (checksum(state), state.len() as u32);
    let mut answer = None;
    for (number, bytes) in state.chunks(960).enumerate() {
        let offset = 960 * number as u32;
        let chunk = HostMessage::RestoreState(State { frame: 0, offset, total, checksum, bytes });
        client.send(&chunk, &mut |_| ()).unwrap();
    }
    let taken_or_refused = &mut |message: &DeviceMessage<'_>| {
        match message {
            DeviceMessage::Info(_) => answer = Some(None),
            DeviceMessage::Fault(fault) => answer = Some(Some(*fault)),
            _ => {}
        }
        answer.is_some()
    };
    client.wait_for(taken_or_refused).unwrap();
    answer.flatten()
}

fn default_config() -> Config {
    config_for(&corridor(1))
}

#[test]
fn a_state_is_taken_under_its_own_configuration_and_no_other() {
    let config = default_config();
    let (_, state, _) = driven(&config, 4);
    assert_eq!(give(&mut device(&config), &state), None);
    let camera = *config.finder.camera();
    let with_mount = |parameters| {
        let finder = RangeFinder::new(camera, Mount::new(parameters).unwrap());
        Config { finder, ..config }
    };
    let mut higher = config.finder.mount().parameters();
    higher[0] *= 2.0;
    let mut other_gate = config;
    other_gate.filter.gate = monorange_core::association::Gate::Hard;
    let mut other_floor = config;
    other_floor.corner_std_floor_px = 0.5;
    let mut surer = config;
    surer.mount_std[0] *= 0.5;
    for other in [with_mount(higher), other_gate, other_floor, surer] {
        let refused = give(&mut device(&other), &state);
        assert_eq!(refused, Some(Fault { cause: Cause::State, detail: OTHER_CONFIGURATION }));
    }
}

/// Whether pose and map of an answer are numbers, with variances that are not negative.
fn sane(answer: &Answer) -> bool {
    let pose = answer.pose.unwrap();
    let [xx, xy, xh, yy, yh, hh] = pose.covariance;
    let numbers = [pose.position[0], pose.position[1], pose.heading, xy, xh, yh];
    let variance = |value: f32| value >= 0.0 && value.is_finite();
    numbers.into_iter().all(f32::is_finite)
        && [xx, yy, hh].into_iter().all(variance)
        && answer.landmarks.iter().all(|landmark| {
            let [xx, xy, yy] = landmark.covariance;
            // NaN is how a landmark is told of which only the bearing is known.
            xx.is_nan() && landmark.position[0].is_nan() || variance(xx) && variance(yy) && xy.is_finite()
        })
}

#[test]
fn a_damaged_state_is_refused_or_leaves_a_map_of_numbers() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for covariance in [Covariance::Packed, Covariance::Factored] {
        let mut config = default_config();
        config.filter.covariance = covariance;
        let (mut client, state, next) = driven(&config, 40);
        let header = 4 + 4 + 8 + 28;
        let (mut taken, mut refused) = (0, 0);
        for number in 0..280 {
            let mut damaged = state.clone();
            for _ in 0..1 + random.next_u32() % 3 {
                let place = random.next_u32() as usize % (damaged.len() - 4);
                match number % 4 {
                    0 => damaged[place] = random.next_u32() as u8,
                    1 => damaged[place] ^= 1 << (random.next_u32() % 8),
                    // A number, aligned as they are: any bits, and a plausible one of another size.
                    2 => {
                        let place = header + (place.saturating_sub(header) & !3);
                        damaged[place..place + 4].copy_from_slice(&random.next_u32().to_le_bytes());
                    }
                    _ => {
                        let place = header + (place.saturating_sub(header) & !3);
                        let number = f32::from_le_bytes(*damaged[place..].first_chunk().unwrap());
                        let factor = [-1.0, 0.0, 10.0, 1e3, -1e6, 1e-6][random.next_u32() as usize % 6];
                        damaged[place..place + 4].copy_from_slice(&(number * factor).to_le_bytes());
                    }
                }
            }
            if let Some(fault) = give(&mut client, &damaged) {
                assert_eq!(fault.cause, Cause::State);
                refused += 1;
                continue;
            }
            taken += 1;
            for (frame, step) in next.iter().enumerate() {
                let answer = device_step(&mut client, frame as u32, step).unwrap();
                assert!(sane(&answer), "{covariance:?}, state {number}, picture {frame}: {answer:#?}");
            }
        }
        println!("{covariance:?}: {taken} of 280 damaged states taken, {refused} refused");
        assert!(taken > 20 && refused > 20, "{taken} taken, {refused} refused");
        assert_eq!(give(&mut client, &state), None, "and its own state is still one");
    }
}

#[test]
fn a_device_tells_ranges_as_the_pipeline_does_and_its_map_stays_as_it_was() {
    let config = default_config();
    let (mut client, state, _) = driven(&config, 6);
    let spots = [
        Spot::Pixel([160.0, 200.0]),
        Spot::Pixel([40.5, 150.25]),
        Spot::Box([100.0, 60.0, 140.0, 190.0]),
        Spot::Pixel([160.0, 3.0]),
        Spot::Pixel([-900.0, 200.0]),
    ];
    for std_px in [0.0, 1.5] {
        let ranges =
            client.ranges(&Range { request: 8, std_px, spots: spots.into_iter().collect() }).unwrap();
        let pipeline = client.stream().device.engine().pipeline().unwrap();
        let wanted = spots.map(|spot| range_of_spot(pipeline, &spot, std_px, 1));
        assert_eq!(format!("{ranges:?}"), format!("{wanted:?}"));
        let sights = wanted.map(|ranged| ranged.sight);
        use Sight::{AboveHorizon, Floor, OutsideImage};
        assert_eq!(sights, [Floor, Floor, Floor, AboveHorizon, OutsideImage]);
        // Nearer, surer; and a pixel that is known worse is a range that is known worse.
        assert!(wanted[0].covariance[0] > 0.0 && wanted[0].covariance[0] < wanted[1].covariance[0]);
    }
    assert_eq!(save(&mut client), state);
}

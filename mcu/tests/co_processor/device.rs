//! What the device does with whole messages in any order; `hostile_line.rs` is about damaged ones.

use crate::bench::*;
use monorange_mcu::{WINDOW, Wish};
use monorange_protocol::message::*;

const ROWS: [[u8; 4]; 3] = [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12]];

#[test]
fn a_hello_is_answered_with_who_and_how_much() {
    let mut talk = Talk::new();
    let said = talk.say(&HostMessage::Hello(Hello { nonce: 5 }));
    let credit = Credit { sequence: 0, granted: WINDOW as u16 };
    let restarts = Restarts { runs: 1, ..Restarts::default() };
    assert_eq!(said, [Said::Restarts(restarts), Said::Info(0x10, false), Said::Credit(credit)]);
}

#[test]
fn a_whole_picture_reaches_the_engine_and_is_answered() {
    let mut talk = Talk::configured();
    let said = talk.picture(7, &ROWS);
    let wanted = monorange_protocol::frame::checksum(ROWS.as_flattened());
    assert_eq!(talk.device.engine().pictures, [(7, wanted)]);
    assert_eq!(poses(&said).len(), 1);
    let pose = poses(&said)[0];
    assert_eq!((pose.frame, pose.time_us, pose.position[0], pose.predicted_only), (7, 800_000, 0.1, false));
    let observations: Vec<_> = said.iter().filter(|said| matches!(said, Said::Observations(..))).collect();
    assert_eq!(observations, [&Said::Observations(0, 30, 24), &Said::Observations(24, 30, 6)]);
}

#[test]
fn a_missing_row_drops_the_picture_and_keeps_the_motion() {
    for lost in 0..ROWS.len() {
        let mut talk = Talk::configured();
        let mut said = vec![];
        for (number, message) in picture(3, &ROWS).iter().enumerate() {
            let line = talk.line(message);
            if number != lost + 2 {
                said.extend(talk.send(&line).0);
            }
        }
        assert_eq!(faults(&said), [(Cause::FrameDropped, 3)], "row {lost}");
        assert_eq!(poses(&said).len(), 1);
        assert!(poses(&said)[0].predicted_only && poses(&said)[0].position[0] > 0.09);
        assert!(talk.device.engine().pictures.is_empty());
        let said = talk.picture(4, &ROWS);
        assert_eq!((faults(&said), poses(&said)[0].predicted_only), (vec![], false));
    }
}

#[test]
fn any_other_message_of_a_picture_may_be_lost() {
    for lost in [0, 1, 5] {
        let mut talk = Talk::configured();
        let mut said = vec![];
        for (number, message) in picture(3, &ROWS).iter().enumerate() {
            let line = talk.line(message);
            if number != lost {
                said.extend(talk.send(&line).0);
            }
        }
        said.extend(talk.picture(4, &ROWS));
        let frames: Vec<_> = poses(&said).iter().map(|pose| (pose.frame, pose.predicted_only)).collect();
        assert_eq!(frames, [(3, lost != 0), (4, false)], "message {lost}");
    }
}

#[test]
fn motion_holds_through_a_lost_odometry_message() {
    let mut talk = Talk::configured();
    for tenths in [1, 2, 3, 6] {
        talk.say(&HostMessage::Odometry(motion(tenths * 100_000, 0.1, 1.0)));
    }
    assert!((talk.device.engine().moved - 0.6).abs() < 1e-6, "4 and 5 were lost");
    talk.say(&HostMessage::Odometry(motion(50_000_000, 0.1, 1.0)));
    assert!((talk.device.engine().moved - 1.7).abs() < 1e-6, "of 49 s the first holds");
}

#[test]
fn motion_that_is_no_number_is_refused() {
    let mut talk = Talk::configured();
    for (duration, speed) in [(f32::NAN, 1.0), (0.1, f32::INFINITY), (-1.0, 1.0)] {
        let said = talk.say(&HostMessage::Odometry(motion(100_000, duration, speed)));
        assert_eq!(faults(&said), [(Cause::Odometry, 0)]);
    }
    assert_eq!(talk.device.engine().moved, 0.0);
}

#[test]
fn how_the_robot_leans_reaches_the_engine_and_no_number_does() {
    let mut talk = Talk::configured();
    let lean = |pitch| HostMessage::Attitude(Attitude { pitch, roll: 0.0, std: 0.003 });
    assert_eq!(faults(&talk.say(&lean(0.02))), []);
    assert_eq!(faults(&talk.say(&lean(f32::NAN))), [(Cause::Odometry, 2)]);
    assert_eq!(talk.device.engine().leans, [0.02]);
}

#[test]
fn nothing_is_done_before_the_configuration() {
    let mut talk = Talk::new();
    let said = talk.picture(1, &ROWS);
    assert!(faults(&said).iter().all(|(cause, _)| *cause == Cause::NotConfigured), "{said:?}");
    assert_eq!((faults(&said).len(), poses(&said).len()), (3, 0));
}

#[test]
fn a_refused_configuration_leaves_the_one_before() {
    let mut talk = Talk::configured();
    talk.picture(1, &ROWS);
    let mut wrong = configuration();
    wrong.camera.width = 640;
    let said = talk.say(&HostMessage::Configure(wrong));
    assert_eq!(faults(&said), [(Cause::Configuration, FIELD + 1)]);
    assert!(talk.device.engine().moved > 0.0 && said.contains(&Said::Info(0x10, true)));
}

#[test]
fn a_frame_that_comes_twice_counts_once() {
    let mut talk = Talk::configured();
    let line = talk.line(&picture(1, &ROWS)[0]);
    talk.send(&line);
    talk.send(&line);
    assert_eq!(talk.device.engine().moved, 0.1);
}

#[test]
fn a_state_comes_back_after_a_reset() {
    let mut talk = Talk::configured();
    talk.picture(1, &ROWS);
    let said = talk.say(&HostMessage::SaveState(SaveState {}));
    let Some(Said::State(bytes)) = said.first() else { panic!("{said:?}") };
    let said = talk.say(&HostMessage::Reset(Reset::State));
    assert!(said.contains(&Said::Info(0x11, true)), "another reset count: {said:?}");
    assert_eq!(talk.device.engine().moved, 0.0);
    let checksum = monorange_protocol::frame::checksum(bytes);
    let whole = State { frame: 1, offset: 0, total: 4, checksum, bytes };
    for (chunk, cause) in [
        (State { checksum: 1, ..whole }, Some(Cause::State)),
        (State { offset: 4, ..whole }, Some(Cause::State)),
        (State { total: u32::MAX, ..whole }, Some(Cause::State)),
        (State { total: 16, ..whole }, None), // the rest never comes
        (State { offset: u32::MAX, ..whole }, Some(Cause::State)),
        (whole, None),
    ] {
        let said = talk.say(&HostMessage::RestoreState(chunk));
        assert_eq!(faults(&said).first().map(|(cause, _)| *cause), cause, "{chunk:?}");
    }
    assert_eq!(talk.device.engine().moved, 0.1);
}

#[test]
fn the_map_comes_in_pieces_and_statistics_when_asked() {
    let mut talk = Talk::configured();
    talk.picture(1, &ROWS);
    let said = talk.say(&HostMessage::Ask(Ask::Map));
    assert_eq!(said[..2], [Said::Map(0, 32, 18), Said::Map(18, 32, 14)]);
    let said = talk.say(&HostMessage::Ask(Ask::Statistics));
    let Some(Said::Statistics(statistics)) = said.first() else { panic!("{said:?}") };
    assert_eq!((statistics.frames_done, statistics.link.frames), (1, 10));
    assert!(statistics.stages.rows >= 3 && statistics.stages.corners > 0 && statistics.stages.answer > 0);
}

#[test]
fn only_a_device_reset_asks_for_a_restart() {
    let mut talk = Talk::configured();
    let line = talk.line(&HostMessage::Reset(Reset::Device));
    assert_eq!(talk.send(&line).1, Wish::Restart);
}

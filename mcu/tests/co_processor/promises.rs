//! What `SPEC.md` promises a host beyond its answers: restarts that show, refusals that say what is refused, pictures that are
//! given up aloud.

use crate::bench::*;
use monorange_protocol::{
    frame::{MAX_ENCODED, encode},
    message::*,
};
use std::collections::HashSet;

const ROWS: [[u8; 4]; 3] = [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12]];

/// Says hello; returns the reset count and what is told apart.
fn greeting(talk: &mut Talk) -> (u8, Restarts) {
    let said = talk.say(&HostMessage::Hello(Hello { nonce: 1 }));
    let count =
        said.iter().find_map(|said| if let Said::Info(count, _) = said { Some(*count) } else { None });
    let apart =
        said.iter().find_map(|said| if let Said::Restarts(apart) = said { Some(*apart) } else { None });
    (count.unwrap(), apart.unwrap())
}

#[test]
fn every_restart_and_reset_shows_in_the_count_and_no_configuration_does() {
    // The session that hid a restart before: one configuration in each run.
    let mut poses_said = vec![];
    for run in 1..=3 {
        let mut talk = Talk::of_run(run);
        talk.say(&HostMessage::Configure(configuration()));
        poses_said.push(poses(&talk.picture(1, &ROWS))[0].reset_count);
    }
    assert_eq!(poses_said.iter().collect::<HashSet<_>>().len(), 3, "{poses_said:?}");

    // No number of resets before a restart makes up for it.
    let mut counts = HashSet::new();
    for run in 1..=4 {
        let mut talk = Talk::of_run(run);
        for resets in 0..4 {
            for configurations in 1..3 {
                talk.say(&HostMessage::Configure(configuration()));
                let (count, apart) = greeting(&mut talk);
                let wanted = Restarts { runs: run, configurations: 2 * resets + configurations, resets };
                assert_eq!(apart, wanted);
                counts.insert(count);
            }
            talk.say(&HostMessage::Reset(Reset::State));
        }
    }
    assert_eq!(counts.len(), 4 * 4, "one number for each run and reset: {counts:?}");
}

#[test]
fn a_payload_that_is_no_message_is_answered_with_its_kind() {
    let mut talk = Talk::configured();
    // Configurations without their last field, with a width that is no u16, and with nothing at all.
    let good = postcard(&configuration());
    let wide = [&[0xc0, 0x84, 0x3d], &good[2..]].concat();
    let mut line = [0; MAX_ENCODED];
    for (sequence, payload) in (100..).zip([&good[..good.len() - 1], &wide, &[]]) {
        let sent = encode(2, sequence, &Raw(payload), &mut line).unwrap();
        let said = talk.send(sent).0;
        assert_eq!(faults(&said), [(Cause::NotUnderstood, 2)]);
        assert!(said.iter().any(|said| matches!(said, Said::Credit(_))), "and may go on: {said:?}");
    }
    // A kind from the future is none of the device's business.
    assert_eq!(talk.send(encode(0x70, 104, &Raw(&[1]), &mut line).unwrap()).0, []);
}

/// Bytes as they are.
struct Raw<'a>(&'a [u8]);

impl serde::Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeTuple;
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

fn postcard(configure: &Configure) -> Vec<u8> {
    let mut line = [0; MAX_ENCODED];
    let message = HostMessage::Configure(configure.clone());
    let mut deframer = monorange_protocol::frame::Deframer::new();
    let mut left = &*message.encode(0, &mut line).unwrap();
    deframer.take(&mut left).unwrap().unwrap().payload.to_vec()
}

#[test]
fn a_picture_that_is_given_up_is_told_whatever_ends_it() {
    let rows = HostMessage::Rows(Rows { frame: 5, row: 0, pixels: &ROWS[0] });
    let begin = |frame| FrameBegin { frame, time_us: 1, left: 0, top: 0, width: 4, height: 3 };
    let corners = Corners { frame: 6, time_us: 2, corners: Default::default() };
    for end in [
        HostMessage::Configure(configuration()),
        HostMessage::Reset(Reset::State),
        HostMessage::FrameBegin(begin(6)),
        HostMessage::Corners(corners),
        HostMessage::SaveState(SaveState {}),
    ] {
        let mut talk = Talk::configured();
        talk.say(&HostMessage::FrameBegin(begin(5)));
        talk.say(&rows);
        assert_eq!(faults(&talk.say(&end)), [(Cause::FrameDropped, 5)], "{end:?}");
        let said = talk.say(&HostMessage::FrameEnd(FrameEnd { frame: 5 }));
        assert!(poses(&said).iter().all(|pose| pose.predicted_only), "{end:?}: {said:?}");
    }
    // A configuration that is refused leaves the picture as it was.
    let mut talk = Talk::configured();
    talk.say(&HostMessage::FrameBegin(begin(5)));
    talk.say(&rows);
    let mut wrong = configuration();
    wrong.camera.width = 640;
    assert_eq!(faults(&talk.say(&HostMessage::Configure(wrong))), [(Cause::Configuration, FIELD + 1)]);
    let rest = [ROWS[1], ROWS[2]].concat();
    talk.say(&HostMessage::Rows(Rows { frame: 5, row: 1, pixels: &rest }));
    let said = talk.say(&HostMessage::FrameEnd(FrameEnd { frame: 5 }));
    assert_eq!((faults(&said), poses(&said)[0].predicted_only), (vec![], false));
}

#[test]
fn a_frame_is_answered_with_observations_though_there_are_none() {
    let mut talk = Talk::configured();
    let said = talk.say(&HostMessage::FrameEnd(FrameEnd { frame: 9 }));
    assert!(said.contains(&Said::Observations(0, 0, 0)), "{said:?}");
    assert!(poses(&said)[0].predicted_only);
}

#[test]
fn motion_says_why_it_is_refused() {
    let mut talk = Talk::configured();
    for (duration, speed) in [(f32::NAN, 1.0), (-1.0, 1.0), (0.1, f32::INFINITY)] {
        let said = talk.say(&HostMessage::Odometry(motion(100_000, duration, speed)));
        assert_eq!(faults(&said), [(Cause::Odometry, 0)]);
    }
}

#[test]
fn the_watchdog_is_fed_with_every_frame_however_many_come_at_once() {
    let mut talk = Talk::configured();
    let before = talk.board.fed.get();
    let line: Vec<u8> = (0..40).flat_map(|_| talk.line(&HostMessage::SaveState(SaveState {}))).collect();
    talk.flood(&line);
    assert_eq!(talk.board.fed.get() - before, 40);
}

#[test]
fn ranges_are_answered_in_order_and_leave_everything_as_it_was() {
    let spots = [Spot::Pixel([10.0, 20.0]), Spot::Box([4.0, 5.0, 8.0, 30.0])];
    let range = |request| Range { request, std_px: 0.5, spots: spots.into_iter().collect() };
    let mut talk = Talk::new();
    assert_eq!(faults(&talk.say(&HostMessage::Range(range(3)))), [(Cause::NotConfigured, 3)]);
    let mut talk = Talk::configured();
    talk.picture(1, &ROWS);
    // In the middle of a picture, too.
    talk.say(&HostMessage::FrameBegin(FrameBegin {
        frame: 2,
        time_us: 1,
        left: 0,
        top: 0,
        width: 4,
        height: 1,
    }));
    let said = talk.say(&HostMessage::Range(range(4)));
    let Some(Said::Ranges(4, ranges)) = said.first() else { panic!("{said:?}") };
    let feet: Vec<_> = ranges.iter().map(|ranged| (ranged.pixel, ranged.range)).collect();
    assert_eq!(feet, [([10.0, 20.0], 20.0), ([6.0, 30.0], 30.0)]);
    talk.say(&HostMessage::Rows(Rows { frame: 2, row: 0, pixels: &ROWS[0] }));
    let said = talk.say(&HostMessage::FrameEnd(FrameEnd { frame: 2 }));
    assert_eq!((faults(&said), poses(&said)[0].predicted_only), (vec![], false));
}

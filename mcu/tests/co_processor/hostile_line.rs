//! Ten thousand damaged pictures: none is taken for another, and the next whole one is answered.

use crate::bench::{faults::*, *};
use monorange_mcu::WINDOW;
use monorange_protocol::{
    frame::checksum,
    message::{Ask, Hello, HostMessage, SaveState, State},
};
use std::collections::HashSet;

const PICTURES: u32 = 10_000;

/// Rows that differ from picture to picture, so that a mixed-up one shows.
fn rows_of(frame: u32) -> Vec<[u8; 4]> {
    (0..6_u32).map(|row| checksum(&[frame.to_le_bytes(), row.to_le_bytes()].concat()).to_le_bytes()).collect()
}

fn statistics(talk: &mut Talk) -> monorange_protocol::message::Statistics {
    let said = talk.say(&HostMessage::Ask(Ask::Statistics));
    let found =
        said.iter().find_map(|said| if let Said::Statistics(found) = said { Some(*found) } else { None });
    found.expect("statistics are answered when asked for")
}

#[test]
fn ten_thousand_damaged_pictures_are_survived_and_told_from_whole_ones() {
    let mut talk = Talk::configured();
    let mut damager = Damager::new(1);
    let mut sent = HashSet::new();
    let mut frames_sent = 2_u32; // hello and configuration
    let mut incomplete = 0;
    for number in 0..PICTURES {
        let fault = FAULTS[number as usize % FAULTS.len()];
        let (damaged, whole) = (2 * number, 2 * number + 1);
        for frame in [damaged, whole] {
            sent.insert((frame, checksum(rows_of(frame).as_flattened())));
        }

        let rows = rows_of(damaged);
        let lines: Vec<_> = picture(damaged, &rows).iter().map(|message| talk.line(message)).collect();
        frames_sent += lines.len() as u32;
        let line = damager.damage(lines, fault);
        talk.send(&line);

        let said = talk.picture(whole, &rows_of(whole));
        frames_sent += 2 + rows.len() as u32 + 1;
        let answered = poses(&said).iter().any(|pose| pose.frame == whole && !pose.predicted_only);
        assert!(answered, "picture {whole} came whole after {fault:?} and was answered by {said:?}");
        // Looked at only now: the zero that was lost with the end of a frame is made up for by the next one's first.
        let taken = std::mem::take(&mut talk.device.engine().pictures);
        incomplete += 2 - taken.len() as u32;
        for picture in taken {
            assert!(
                sent.contains(&picture),
                "after {fault:?} picture {picture:x?} was taken, which was never sent"
            );
        }

        let counts = statistics(&mut talk).link;
        frames_sent += 1;
        let accounted = counts.frames - counts.repeated + counts.lost;
        assert_eq!(
            accounted, frames_sent,
            "each frame sent is accepted or counted as lost, after {fault:?}: {counts:?}"
        );
    }
    let told = statistics(&mut talk);
    assert_eq!(told.frames_done, 2 * PICTURES - incomplete);
    assert!(incomplete > PICTURES / 2, "most faults hit something: {incomplete}");
    assert!(told.link.corrupt() > PICTURES / 4, "{:?}", told.link);
    assert!(told.link.repeated >= PICTURES / FAULTS.len() as u32, "{:?}", told.link);
}

#[test]
fn a_host_that_floods_the_line_loses_what_did_not_fit_and_can_read_how_much() {
    let mut damager = Damager::new(4);
    let mut talk = Talk::configured();
    let (mut frames_sent, mut beyond, mut frame) = (2, 0, 0);
    for _ in 0..300 {
        let mut line = vec![];
        let mut sent = HashSet::new();
        for _ in 0..20 + damager.below(60) {
            let rows = rows_of(frame);
            sent.insert((frame, checksum(rows.as_flattened())));
            let messages = picture(frame, &rows);
            frames_sent += messages.len() as u32;
            line.extend(messages.iter().flat_map(|message| talk.line(message)));
            frame += 1;
        }
        beyond += line.len().saturating_sub(WINDOW) as u32;
        talk.flood(&line);

        let rows = rows_of(frame);
        sent.insert((frame, checksum(rows.as_flattened())));
        let said = talk.picture(frame, &rows);
        frames_sent += 2 + rows.len() as u32 + 1;
        assert!(poses(&said).iter().any(|pose| pose.frame == frame && !pose.predicted_only), "{said:?}");
        frame += 1;

        let taken = std::mem::take(&mut talk.device.engine().pictures);
        assert!(taken.iter().all(|picture| sent.contains(picture)), "{taken:x?}");
        let counts = statistics(&mut talk).link;
        frames_sent += 1;
        assert_eq!(counts.overrun, beyond);
        assert_eq!(counts.frames - counts.repeated + counts.lost, frames_sent, "{counts:?}");
    }
    assert!(beyond > 0);
}

#[test]
fn a_host_that_starts_again_in_the_middle_of_a_picture_is_welcome() {
    let mut damager = Damager::new(2);
    let mut talk = Talk::configured();
    for number in 0..500 {
        let rows = rows_of(number);
        let lines: Vec<_> = picture(number, &rows).iter().map(|message| talk.line(message)).collect();
        let line = lines.concat();
        let cut = damager.below(line.len());
        talk.send(&line[..cut]);
        talk.restart_host();
        let said = talk.say(&HostMessage::Hello(Hello { nonce: number }));
        assert!(said.iter().any(|said| matches!(said, Said::Info(_, true))), "{said:?}");
        let said = talk.picture(10_000 + number, &rows_of(number));
        assert!(poses(&said).iter().any(|pose| pose.frame == 10_000 + number && !pose.predicted_only));
    }
}

#[test]
fn a_device_that_is_reset_in_the_middle_of_a_picture_gets_its_state_back() {
    let mut damager = Damager::new(3);
    for number in 0..500 {
        let mut talk = Talk::configured();
        talk.picture(1, &rows_of(number));
        let moved = talk.device.engine().moved;
        let said = talk.say(&HostMessage::SaveState(SaveState {}));
        let Some(Said::State(bytes)) = said.first() else { panic!("{said:?}") };
        let rows = rows_of(number);
        let lines: Vec<_> = picture(2, &rows).iter().map(|message| talk.line(message)).collect();
        let line = lines.concat();
        talk.send(&line[..damager.below(line.len())]);

        // Another device takes the line over, in the middle of what the host still sends.
        let mut talk = Talk::new();
        talk.send(&line[damager.below(line.len())..]);
        assert!(talk.device.engine().pictures.is_empty(), "nothing is done before the configuration");
        talk.say(&HostMessage::Hello(Hello { nonce: number + 1 }));
        talk.say(&HostMessage::Configure(configuration()));
        let state =
            State { frame: 1, offset: 0, total: bytes.len() as u32, checksum: checksum(bytes), bytes };
        assert_eq!(faults(&talk.say(&HostMessage::RestoreState(state))), []);
        assert_eq!(talk.device.engine().moved, moved);
        let said = talk.picture(2, &rows);
        assert!(poses(&said).iter().any(|pose| pose.frame == 2 && !pose.predicted_only), "{said:?}");
    }
}

//! What a line can do to frames: nothing may panic, nothing damaged may be accepted, and the next whole frame counts.
//!
//! `MONORANGE_FUZZ_CASES=1000000 cargo test -p monorange-protocol --test hostile_line` is the long run.
use monorange_protocol::{
    frame::{self, Damage, Deframer, Frame, LinkCounts, MAX_ENCODED, MAX_PAYLOAD},
    message::{DeviceMessage, FrameBegin, HostMessage, Rows},
};
use proptest::{collection::vec, prelude::*, sample::Index};

fn cases() -> ProptestConfig {
    let cases =
        std::env::var("MONORANGE_FUZZ_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(2_000);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// A frame with any payload, as postcard encodes a tuple of bytes: without a length.
fn frame_of(kind: u8, sequence: u16, payload: &[u8]) -> Vec<u8> {
    struct Raw<'a>(&'a [u8]);
    impl serde::Serialize for Raw<'_> {
        fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            use serde::ser::SerializeTuple;
            let mut tuple = serializer.serialize_tuple(self.0.len())?;
            self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
            tuple.end()
        }
    }
    let mut line = [0; MAX_ENCODED];
    frame::encode(kind, sequence, &Raw(payload), &mut line).unwrap().to_vec()
}

/// Kind, sequence number, payload.
type Heard = (u8, u16, Vec<u8>);

fn heard(line: &[u8]) -> (Vec<Heard>, Vec<Damage>) {
    let (mut deframer, mut frames, mut damages) = (Deframer::new(), vec![], vec![]);
    for byte in line {
        match deframer.push(*byte) {
            Some(Ok(Frame { kind, sequence, payload })) => frames.push((kind, sequence, payload.to_vec())),
            Some(Err(damage)) => damages.push(damage),
            None => {}
        }
    }
    (frames, damages)
}

/// What COBS makes of the pieces between zeros, by the `cobs` crate; `None` for what it refuses.
fn decoded_by_the_library(line: &[u8]) -> Vec<Option<Vec<u8>>> {
    let pieces = line.split(|byte| *byte == 0).filter(|piece| !piece.is_empty());
    let decoded = |piece: &[u8]| {
        let mut out = vec![0; piece.len()];
        let length = cobs::decode(piece, &mut out).ok()?;
        out.truncate(length);
        Some(out)
    };
    pieces.map(decoded).collect()
}

/// Bytes in which zeros, ones and 0xff are frequent: those matter to COBS.
fn line_bytes(length: impl Into<proptest::collection::SizeRange>) -> impl Strategy<Value = Vec<u8>> {
    let frequent = |byte: u8| match byte {
        0..0x20 => 0,
        0x20..0x40 => 1,
        0xe0.. => 0xff,
        _ => byte,
    };
    // Chosen after the draw: a choice of strategies for every byte takes ten times as long.
    vec(any::<u8>(), length).prop_map(move |bytes| bytes.into_iter().map(frequent).collect())
}

#[derive(Clone, Debug)]
enum Fault {
    Flip(Index, u8),
    Lose(Index),
    Double(Index),
    Swap(Index),
    Cut(Index),
    Insert(Index, Vec<u8>),
}

fn fault() -> impl Strategy<Value = Fault> {
    let place = any::<Index>;
    prop_oneof![
        (place(), 0..8u8).prop_map(|(place, bit)| Fault::Flip(place, bit)),
        place().prop_map(Fault::Lose),
        place().prop_map(Fault::Double),
        place().prop_map(Fault::Swap),
        place().prop_map(Fault::Cut),
        (place(), line_bytes(1..40)).prop_map(|(place, bytes)| Fault::Insert(place, bytes)),
    ]
}

fn damage(line: &mut Vec<u8>, fault: &Fault) {
    let length = line.len();
    if length < 2 {
        return; // of which earlier faults left nothing
    }
    match fault {
        Fault::Flip(place, bit) => line[place.index(length)] ^= 1 << bit,
        Fault::Lose(place) => drop(line.remove(place.index(length))),
        Fault::Double(place) => line.insert(place.index(length), line[place.index(length)]),
        Fault::Swap(place) => {
            let at = place.index(length - 1);
            line.swap(at, at + 1);
        }
        Fault::Cut(place) => line.truncate(place.index(length).max(2)),
        Fault::Insert(place, bytes) => {
            let at = place.index(length);
            line.splice(at..at, bytes.iter().copied());
        }
    }
}

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn any_bytes_are_survived_and_the_next_frame_is_heard(noise in line_bytes(0..600), payload in line_bytes(0..80)) {
        let mut line = noise;
        line.extend(frame_of(9, 77, &payload));
        let (frames, _) = heard(&line);
        prop_assert_eq!(frames.last(), Some(&(9, 77, payload)));
    }

    #[test]
    fn pieces_are_taken_for_what_the_library_makes_of_them(mut line in line_bytes(0..600), cut: Index) {
        line.push(0);
        let mut deframer = Deframer::new();
        let mut refused = vec![];
        // In two goes, wherever they meet.
        let (mut first, mut second) = line.split_at(cut.index(line.len()));
        for part in [&mut first, &mut second] {
            while let Some(result) = deframer.take(part) {
                refused.push(result.err() == Some(Damage::Malformed));
            }
        }
        let expected: Vec<_> = decoded_by_the_library(&line).iter().map(Option::is_none).collect();
        prop_assert_eq!(refused, expected);
    }

    #[test]
    fn any_payload_of_any_kind_decodes_or_is_an_error(kind: u8, payload in line_bytes(0..200)) {
        let frame = Frame { kind, sequence: 0, payload: &payload };
        let mut counts = LinkCounts::default();
        for error in [HostMessage::decode(&frame).err(), DeviceMessage::decode(&frame).err()].into_iter().flatten() {
            counts.misunderstood(error);
        }
        prop_assert!(counts.unknown >= 1 && counts.unknown + counts.payload <= 2);
    }

    #[test]
    fn what_is_damaged_is_not_accepted(
        payloads in vec(line_bytes(0..60), 3),
        at in 0..3usize,
        faults in vec(fault(), 1..4),
    ) {
        let whole: Vec<_> = payloads.iter().zip(0..).map(|(payload, sequence)| frame_of(5, sequence, payload)).collect();
        let mut damaged = whole.clone();
        for fault in &faults {
            damage(&mut damaged[at], fault);
        }
        let (frames, _) = heard(&damaged.concat());
        let sent: Vec<_> = payloads.iter().zip(0..).map(|(payload, sequence)| (5, sequence, payload.clone())).collect();
        for frame in &frames {
            prop_assert!(sent.contains(frame), "accepted {frame:?}, which was never sent");
        }
        for intact in (0..3).filter(|index| *index != at) {
            prop_assert!(frames.contains(&sent[intact]), "frame {intact} was lost with the damage to {at}");
        }
    }

    #[test]
    fn a_payload_comes_out_as_it_went_in(kind: u8, sequence: u16, payload in line_bytes(0..=MAX_PAYLOAD)) {
        let line = frame_of(kind, sequence, &payload);
        prop_assert!(line.len() <= MAX_ENCODED);
        prop_assert!(line[1..line.len() - 1].iter().all(|byte| *byte != 0));
        prop_assert_eq!(heard(&line), (vec![(kind, sequence, payload)], vec![]));
    }
}

#[test]
fn the_longest_payload_fits_and_one_more_byte_does_not() {
    for byte in [0, 1, 0xff] {
        let mut line = [0; 2 * MAX_ENCODED];
        let pixels = [byte; MAX_PAYLOAD];
        let rows = |length: usize| HostMessage::Rows(Rows { frame: 1, row: 2, pixels: &pixels[..length] });
        assert!(rows(MAX_PAYLOAD - 4).encode(0, &mut line).is_ok());
        assert!(rows(MAX_PAYLOAD - 3).encode(0, &mut line).is_err(), "payload of {byte}s");
    }
}

#[test]
fn later_fields_are_ignored_and_missing_ones_are_not() {
    let begin = FrameBegin { frame: 3, time_us: 5, left: 0, top: 40, width: 320, height: 200 };
    let mut line = [0; MAX_ENCODED];
    let line = HostMessage::FrameBegin(begin).encode(0, &mut line).unwrap().to_vec();
    let (frames, _) = heard(&line);
    let mut payload = frames[0].2.clone();
    payload.extend([1, 2, 3]);
    let longer = Frame { kind: 4, sequence: 0, payload: &payload };
    assert_eq!(HostMessage::decode(&longer), Ok(HostMessage::FrameBegin(begin)));
    for length in 0..payload.len() - 3 {
        assert!(HostMessage::decode(&Frame { payload: &payload[..length], ..longer }).is_err());
    }
}

#[test]
fn sequence_numbers_tell_what_was_lost_and_what_came_twice() {
    let mut counts = LinkCounts::default();
    let mut last = None;
    for (sequence, new) in [(65_534, true), (65_535, true), (2, true), (2, false), (1, true)] {
        assert_eq!(counts.arrived(last, sequence), new, "{sequence}");
        last = Some(sequence);
    }
    assert_eq!((counts.frames, counts.lost, counts.repeated), (5, 2, 1));
}

//! Answers in lines of text: what a terminal shows, and what hosts that read frames make of it.

use crate::bench::*;
use monorange_mcu::text;
use monorange_protocol::{
    frame::{Deframer, LinkCounts},
    message::*,
};

const ROWS: [[u8; 4]; 3] = [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12]];

/// What the device sends back, as it stands on the line.
fn raw(talk: &mut Talk, message: &HostMessage<'_>) -> Vec<u8> {
    let (line, mut answer) = (talk.line(message), vec![]);
    talk.device.receive(&line, &talk.board, &mut answer);
    answer
}

fn lines(talk: &mut Talk, message: &HostMessage<'_>) -> Vec<String> {
    let text = String::from_utf8(raw(talk, message)).expect("text");
    assert!(!text.contains('\0') && text.lines().all(|line| !line.is_empty()), "{text:?}");
    assert!(text.is_empty() || text.ends_with("\r\n"));
    text.lines().map(str::to_owned).collect()
}

fn in_lines() -> Talk {
    let mut talk = Talk::configured();
    let greeting = lines(&mut talk, &HostMessage::Text(Text::Lines));
    assert_eq!(greeting, ["info board=bench firmware=0.1.0 reset_count=16 configured=1"]);
    talk
}

#[test]
fn a_picture_is_one_line() {
    let mut talk = in_lines();
    let said: Vec<_> = picture(7, &ROWS).iter().flat_map(|message| lines(&mut talk, message)).collect();
    let wanted = "pose frame=7 t=0.800000 x=0.100 y=0.000 heading_deg=0.00 std_x=0.000 std_y=0.000 std_heading_deg=0.00 \
                  landmarks=32 reset_count=16 corners=30 nearest=1.000 bearing_deg=0.00 std_nearest=0.000";
    assert_eq!(said, [wanted]);
}

#[test]
fn what_is_lost_or_asked_has_its_line_too() {
    let mut talk = in_lines();
    let mut said = vec![];
    for message in picture(8, &ROWS).iter().enumerate().filter_map(|(at, one)| (at != 3).then_some(one)) {
        said.extend(lines(&mut talk, message));
    }
    assert_eq!(said[0], "fault cause=4 detail=8 the picture was given up");
    assert!(said[1].starts_with("predicted frame=8 t=0.900000 x=0.100 ") && said[1].ends_with("corners=0"));
    assert_eq!(said.len(), 2);
    let spots = [Spot::Pixel([0.5, 20.0])].into_iter().collect();
    let range = Range { request: 3, std_px: 0.25, spots };
    let wanted = "range request=3 number=0 sight=floor range=20.000 bearing_deg=28.65 std_range=0.500 std_bearing_deg=28.65";
    assert_eq!(lines(&mut talk, &HostMessage::Range(range)), [wanted]);
    assert_eq!(lines(&mut talk, &HostMessage::Ask(Ask::Map)).len(), 32);
    assert_eq!(lines(&mut talk, &HostMessage::Ask(Ask::Statistics)).len(), 1);
}

#[test]
fn a_hello_brings_frames_back() {
    let mut talk = in_lines();
    let said = talk.say(&HostMessage::Hello(Hello { nonce: 9 }));
    assert!(matches!(said[..], [Said::Restarts(_), Said::Info(..), Said::Credit(_)]), "{said:?}");
    assert_eq!(poses(&talk.picture(1, &ROWS)).len(), 1);
}

#[test]
fn lines_between_frames_cost_a_reader_of_frames_nothing() {
    let (mut plain, mut both) = (Talk::configured(), Talk::configured());
    let mut bytes = raw(&mut both, &HostMessage::Text(Text::Both));
    bytes.extend(raw(&mut both, &HostMessage::Hello(Hello { nonce: 1 })));
    let mut wanted = vec![];
    for message in picture(7, &ROWS) {
        bytes.extend(raw(&mut both, &message));
        wanted.extend(plain.say(&message));
    }
    let (mut deframer, mut left, mut counts) = (Deframer::new(), &bytes[..], LinkCounts::ZERO);
    let (mut heard, mut frames) = (vec![], 0);
    while let Some(piece) = deframer.take(&mut left) {
        match piece {
            Err(damage) => counts.damage(damage),
            Ok(frame) => {
                frames += 1;
                if let Ok(DeviceMessage::Pose(pose)) = DeviceMessage::decode(&frame) {
                    heard.push(pose);
                }
            }
        }
    }
    let text = String::from_utf8_lossy(&bytes);
    assert_eq!(heard, poses(&wanted));
    assert_eq!(
        (counts.corrupt(), text.matches("\r\n").count(), text.matches("pose frame=7 ").count()),
        (3, 3, 1)
    );
    // Info twice, credit for each message but rows, the picture's observations and pose.
    assert_eq!(frames, wanted.len() + 4);
}

/// The messages of the specification's vectors as lines.
fn shown() -> String {
    let pose = Pose {
        frame: 300,
        time_us: 1_100_000,
        position: [0.05, 0.0],
        heading: -0.025,
        covariance: [1e-4, 0.0, 1e-6, 1e-4, 2e-6, 1e-5],
        reset_count: 0x13,
        predicted_only: false,
        landmarks: 12,
    };
    let corner = Observation {
        pixel: [100.5, 180.25],
        range: 2.5,
        bearing: -0.125,
        covariance: [0.01, 0.0, 0.001],
        landmark: Some(7),
        decision: Decision::Update,
        nis: Some(1.5),
    };
    let landmark = Landmark {
        id: 7,
        position: [3.5, -1.25],
        covariance: [0.01, 0.001, 0.02],
        seen: 12,
        confirmed: true,
        first_us: 1_000_000,
        last_us: 2_100_000,
    };
    let ranged = |sight| Ranged {
        pixel: [100.5, 180.25],
        sight,
        range: 2.5,
        bearing: 0.25,
        covariance: [0.01, 0.0, 0.001],
    };
    let ranges = [Sight::Floor, Sight::AboveHorizon].map(ranged).into_iter().collect();
    let info = Info {
        nonce: 0,
        firmware: [0, 1, 0],
        board: "mps2-an500",
        reset_count: 0x13,
        configured: true,
        max_width: 320,
        max_height: 240,
        max_landmarks: 32,
        max_corners: 32,
        window: 4096,
        state_bytes: 12_000,
        restarts: Later(Restarts::default()),
    };
    let statistics = Statistics {
        frame: 300,
        frames_done: 299,
        frames_dropped: 1,
        rows_refused: 120,
        unsent: 0,
        link: LinkCounts { malformed: 1, checksum: 2, lost: 3, ..LinkCounts::ZERO },
        unit: CostUnit::None,
        stages: Stages::default(),
        stack_used: 6_000,
        stack_size: 16_384,
        uptime_us: 30_000_000,
    };
    let mut text = "```text\n".to_owned();
    let mut write = |line: &[u8]| text.push_str(&String::from_utf8_lossy(line).replace("\r\n", "\n"));
    text::message(&DeviceMessage::Info(info), &mut write);
    text::picture(&pose, 2, Some(&corner), &mut write);
    text::picture(
        &Pose { frame: 301, time_us: 1_200_000, predicted_only: true, ..pose },
        0,
        None,
        &mut write,
    );
    for message in [
        DeviceMessage::Fault(Fault { cause: Cause::FrameDropped, detail: 301 }),
        DeviceMessage::Ranges(Ranges { request: 41, ranges }),
        DeviceMessage::Map(Map {
            frame: 300,
            first: 0,
            total: 1,
            landmarks: [landmark].into_iter().collect(),
        }),
        DeviceMessage::Statistics(statistics),
    ] {
        text::message(&message, &mut write);
    }
    text + "```\n"
}

#[test]
fn the_specification_shows_the_lines() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../protocol/SPEC.md");
    let (begin, end) = ("<!-- lines: begin -->\n", "<!-- lines: end -->");
    let file = std::fs::read_to_string(path).unwrap();
    let (before, rest) = file.split_once(begin).expect("SPEC.md has a marker where the lines begin");
    let (there, after) = rest.split_once(end).expect("and one where they end");
    if std::env::var_os("MONORANGE_BLESS").is_some() {
        return std::fs::write(path, format!("{before}{begin}{}{end}{after}", shown())).unwrap();
    }
    assert_eq!(
        there,
        shown(),
        "after a wanted change: MONORANGE_BLESS=1 cargo test -p monorange-mcu --test text"
    );
}

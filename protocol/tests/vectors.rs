//! The test vectors of `SPEC.md` are what this crate sends, and its table of settings is the core's. After a wanted change:
//! `MONORANGE_BLESS=1 cargo test -p monorange-protocol --test vectors`.
use heapless::Vec as Few;
use monorange_core::pipeline::{self, Config};
use monorange_core::setting::{Setting, Value};
use monorange_protocol::{
    frame::{Deframer, LinkCounts, MAX_ENCODED},
    message::*,
};
use std::fmt::Write;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/SPEC.md");

fn few<T: Clone + std::fmt::Debug, const N: usize>(items: &[T]) -> Few<T, N> {
    Few::from_slice(items).unwrap()
}

/// `association.caution` at 4.5, `association.confirm` at 200 and `filter.gate` at its second word.
fn settings() -> Settings {
    Settings(few(&[BY_NUMBER, 46, 0x00, 0x00, 0x90, 0x40, 14, 0xc8, 0x01, 7, 1]))
}

fn host_messages() -> Vec<HostMessage<'static>> {
    let camera = Camera {
        width: 320,
        height: 240,
        focal: [365.0, 365.5],
        principal: [145.75, 114.5],
        skew: 0.0,
        distortion: [-0.25, 0.375, -0.005, -0.002, 0.0],
    };
    let mount = Mount { parameters: [0.4, 0.2, 0.0, 0.0, 0.05, 0.0], std: [0.005, 0.0055, 0.006, 0.0065] };
    let answers = Answers { observations: true, map_every: 10, statistics_every: 300 };
    let corner = Corner { pixel: [100.5, 180.25], covariance: [0.25, -0.125, 0.5], brighter: [true, false] };
    vec![
        HostMessage::Hello(Hello { nonce: 0xdead_beef }),
        HostMessage::Configure(Configure { camera, mount, binning: 1, answers, settings: settings() }),
        HostMessage::Odometry(Odometry {
            until_us: 1_100_000,
            duration: 0.1,
            motion: Motion::Velocity { speed: 0.5, turn: -0.25 },
        }),
        HostMessage::FrameBegin(FrameBegin {
            frame: 300,
            time_us: 1_100_000,
            left: 0,
            top: 40,
            width: 320,
            height: 200,
        }),
        HostMessage::Rows(Rows { frame: 300, row: 6, pixels: &[0, 1, 0, 255, 17, 0, 0, 4] }),
        HostMessage::FrameEnd(FrameEnd { frame: 300 }),
        HostMessage::Corners(Corners { frame: 301, time_us: 1_200_000, corners: few(&[corner]) }),
        HostMessage::Reset(Reset::State),
        HostMessage::SaveState(SaveState {}),
        HostMessage::RestoreState(State {
            frame: 300,
            offset: 960,
            total: 963,
            checksum: 0x1234_5678,
            bytes: &[1, 0, 2],
        }),
        HostMessage::TimeSync(TimeSync { host_us: 1_700_000_000_000_000 }),
        HostMessage::Ask(Ask::Statistics),
        HostMessage::Range(Range {
            request: 41,
            std_px: 1.5,
            spots: few(&[Spot::Pixel([100.5, 180.25]), Spot::Box([20.0, 60.0, 40.0, 200.5])]),
        }),
        HostMessage::Text(Text::Lines),
        HostMessage::Attitude(Attitude { pitch: 0.03125, roll: -0.015625, std: 0.003 }),
    ]
}

fn device_messages() -> Vec<DeviceMessage<'static>> {
    let observation = Observation {
        pixel: [100.5, 180.25],
        range: 2.5,
        bearing: -0.125,
        covariance: [0.01, 0.0, 0.001],
        landmark: Some(7),
        decision: Decision::Update,
        nis: Some(1.5),
    };
    let tentative = Observation { landmark: None, decision: Decision::Tentative, nis: None, ..observation };
    let landmark = Landmark {
        id: 7,
        position: [3.5, -1.25],
        covariance: [0.01, 0.001, 0.02],
        seen: 12,
        confirmed: true,
        first_us: 1_000_000,
        last_us: 2_100_000,
    };
    let floor = Ranged {
        pixel: [100.5, 180.25],
        sight: Sight::Floor,
        range: 2.5,
        bearing: 0.25,
        covariance: [0.01, 0.0, 0.001],
    };
    // As a device sends it, but for the numbers: NaN is equal to nothing, and this is compared.
    let sky = Ranged {
        pixel: [30.0, 200.5],
        sight: Sight::AboveHorizon,
        range: 0.0,
        bearing: 0.0,
        covariance: [0.0; 3],
    };
    let link = LinkCounts { frames: 4_000, malformed: 1, checksum: 2, lost: 3, ..LinkCounts::default() };
    vec![
        DeviceMessage::Info(Info {
            nonce: 0xdead_beef,
            firmware: [0, 1, 0],
            board: "mps2-an500",
            reset_count: 0x13,
            configured: false,
            max_width: 320,
            max_height: 240,
            max_landmarks: 32,
            max_corners: 32,
            window: 4_096,
            state_bytes: 12_000,
            restarts: Later(Restarts { runs: 1, configurations: 2, resets: 3 }),
        }),
        DeviceMessage::Observations(Observations {
            frame: 300,
            first: 0,
            total: 2,
            observations: few(&[observation, tentative]),
        }),
        DeviceMessage::Pose(Pose {
            frame: 300,
            time_us: 1_100_000,
            position: [0.05, 0.0],
            heading: -0.025,
            covariance: [1e-4, 0.0, 1e-6, 1e-4, 2e-6, 1e-5],
            reset_count: 0x13,
            predicted_only: false,
            landmarks: 12,
        }),
        DeviceMessage::Map(Map { frame: 300, first: 0, total: 1, landmarks: few(&[landmark]) }),
        DeviceMessage::Statistics(Statistics {
            frame: 300,
            frames_done: 299,
            frames_dropped: 1,
            rows_refused: 120,
            unsent: 0,
            link,
            unit: CostUnit::Instructions,
            stages: Stages {
                interrupt: 2_300_000,
                receive: 1_900_000,
                rows: 4_000_000,
                corners: 900_000,
                filter: 300_000,
                answer: 20_000,
            },
            stack_used: 6_000,
            stack_size: 16_384,
            uptime_us: 30_000_000,
        }),
        DeviceMessage::Credit(Credit { sequence: 513, granted: 4_096 }),
        DeviceMessage::Fault(Fault { cause: Cause::FrameDropped, detail: 299 }),
        DeviceMessage::LastPanic(LastPanic { cause: RestartCause::Watchdog, text: "main loop" }),
        DeviceMessage::State(State {
            frame: 300,
            offset: 0,
            total: 963,
            checksum: 0x1234_5678,
            bytes: &[9, 0, 9],
        }),
        DeviceMessage::Time(Time { host_us: 1_700_000_000_000_000, device_us: 30_000_000 }),
        DeviceMessage::Ranges(Ranges { request: 41, ranges: few(&[floor, sky]) }),
    ]
}

fn hex(bytes: &[u8]) -> String {
    let lines: Vec<_> = bytes
        .chunks(32)
        .map(|chunk| chunk.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" "))
        .collect();
    lines.join("\n")
}

fn heard<T>(line: &[u8], decode: impl Fn(&monorange_protocol::frame::Frame<'_>) -> T) -> (Vec<u8>, T) {
    let mut deframer = Deframer::new();
    for byte in &line[..line.len() - 1] {
        assert!(deframer.push(*byte).is_none());
    }
    let frame = deframer.push(0).unwrap().unwrap();
    (frame.payload.to_vec(), decode(&frame))
}

fn chapter() -> String {
    let mut text = String::new();
    let mut buffer = [0; MAX_ENCODED];
    let mut entry = |number: u8, name: String, payload: Vec<u8>, line: &[u8]| {
        let payload = if payload.is_empty() { "(empty)".into() } else { hex(&payload) };
        let said = name.replace("Few", "");
        write!(
            text,
            "### {number:#04x}\n\n`{said}`\n\n```text\npayload\n{payload}\nline\n{}\n```\n\n",
            hex(line)
        )
        .unwrap();
    };
    for (message, sequence) in host_messages().into_iter().zip(254..) {
        let line = message.encode(sequence, &mut buffer).unwrap();
        let (payload, same) = heard(line, |frame| HostMessage::decode(frame).as_ref() == Ok(&message));
        assert!(same, "{message:?}");
        entry(message.kind(), format!("{message:?}, sequence {sequence}"), payload, line);
    }
    for (message, sequence) in device_messages().into_iter().zip(0..) {
        let line = message.encode(sequence, &mut buffer).unwrap();
        let (payload, same) = heard(line, |frame| DeviceMessage::decode(frame).as_ref() == Ok(&message));
        assert!(same, "{message:?}");
        entry(message.kind(), format!("{message:?}, sequence {sequence}"), payload, line);
    }
    text
}

/// The settings as rows of a table: the core's names, numbers, ranges and defaults.
fn settings_table() -> String {
    let camera =
        monorange_core::geometry::Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default());
    let mount = monorange_core::geometry::Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]);
    let finder = monorange_core::geometry::RangeFinder::new(camera.unwrap(), mount.unwrap());
    let defaults = Config::new(finder);
    let mut text = "| number | name in the rig file | value | default | range | what it is |\n|---|---|---|---|---|---|\n".to_owned();
    for (setting, reference) in pipeline::settings() {
        let listed = |words: &[&str]| {
            let words: Vec<_> =
                words.iter().enumerate().map(|(place, word)| format!("{place} {word}")).collect();
            words.join(", ")
        };
        let (kind, default, range) = match defaults.get(setting) {
            Value::Number(number) => ("`f32`", number.to_string(), setting.expected.to_owned()),
            Value::Pair(numbers) => ("`f32[2]`", format!("{numbers:?}"), setting.expected.to_owned()),
            Value::Whole(number) => ("`u32`", number.to_string(), setting.expected.to_owned()),
            Value::Choice(place, words) => ("`u8`", place.to_string(), listed(words)),
            Value::Switch(on) => ("`bool`", on.to_string(), String::new()),
        };
        let Setting { number, name, .. } = setting;
        writeln!(text, "| {number} | `{name}` | {kind} | {default} | {range} | {} |", reference.help)
            .unwrap();
    }
    text
}

#[test]
fn the_specification_shows_what_is_sent() {
    shown_in_the_specification("vectors", &chapter());
}

#[test]
fn the_specification_lists_the_settings_of_the_core() {
    shown_in_the_specification("settings", &settings_table());
}

/// One at a time, since each may write the file.
static FILE: std::sync::Mutex<()> = std::sync::Mutex::new(());

fn shown_in_the_specification(part: &str, wanted: &str) {
    let _alone = FILE.lock().unwrap();
    let (begin, end) = (format!("<!-- {part}: begin -->\n"), format!("<!-- {part}: end -->"));
    let file = std::fs::read_to_string(PATH).unwrap();
    let (before, rest) = file.split_once(&begin).expect("SPEC.md has a marker where the part begins");
    let (shown, after) = rest.split_once(&end).expect("and one where it ends");
    if std::env::var_os("MONORANGE_BLESS").is_some() {
        std::fs::write(PATH, format!("{before}{begin}{wanted}{end}{after}")).unwrap();
        return;
    }
    for (number, (line, want)) in shown.lines().zip(wanted.lines()).enumerate() {
        assert_eq!(line, want, "SPEC.md, line {} of the {part}", number + 1);
    }
    assert_eq!(shown.lines().count(), wanted.lines().count(), "lines of {part} in SPEC.md");
}

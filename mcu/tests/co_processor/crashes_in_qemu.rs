//! What an emulated board does when its program panics, overflows its stack or hangs: `cargo xtask firmware test`.
//!
//! The program with a message that crashes it comes in `MONORANGE_MPS2_AN500_CRASH`.

use crate::emulator::{Emulator, crashing_board};
use monorange_protocol::{
    frame::{self, Deframer, MAX_ENCODED},
    message::{DeviceMessage, Hello, HostMessage, RestartCause},
};
use std::{
    io::{ErrorKind, Read, Write},
    os::unix::net::UnixStream,
    time::{Duration, Instant},
};

const PATIENCE: Duration = Duration::from_secs(30);
/// The message that crashes, and what it may do.
const CRASH: u8 = 0x7f;
const PANIC: u8 = 0;
const OVERFLOW: u8 = 1;
const HANG: u8 = 2;

struct Line {
    stream: UnixStream,
    deframer: Deframer,
    sequence: u16,
}

impl Line {
    fn new(emulator: &Emulator) -> Self {
        Self { stream: emulator.connect(), deframer: Deframer::new(), sequence: 0 }
    }

    fn hello(&mut self, nonce: u32) {
        let mut line = [0; MAX_ENCODED];
        let line = HostMessage::Hello(Hello { nonce }).encode(self.sequence, &mut line).unwrap();
        self.stream.write_all(line).unwrap();
        self.sequence += 1;
    }

    fn crash(&mut self, how: u8) {
        let mut line = [0; MAX_ENCODED];
        self.stream.write_all(frame::encode(CRASH, self.sequence, &how, &mut line).unwrap()).unwrap();
        self.sequence += 1;
    }

    /// Listens for a while, until `take` has found what it waits for.
    fn listen_for<T>(
        &mut self,
        time: Duration,
        mut take: impl FnMut(&DeviceMessage<'_>) -> Option<T>,
    ) -> Option<T> {
        let start = Instant::now();
        while start.elapsed() < time {
            let mut bytes = [0; 512];
            let count = match self.stream.read(&mut bytes) {
                Ok(count) => count,
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => continue,
                Err(error) => panic!("{error}"),
            };
            for byte in &bytes[..count] {
                let Some(Ok(frame)) = self.deframer.push(*byte) else { continue };
                let found = DeviceMessage::decode(&frame).ok().and_then(|message| take(&message));
                if found.is_some() {
                    return found;
                }
            }
        }
        None
    }

    /// Says hello until it is answered; returns the number of the run, and the reset count.
    fn runs(&mut self, nonce: u32) -> (u8, u8) {
        let answer = (0..60).find_map(|_| {
            self.hello(nonce);
            self.listen_for(Duration::from_millis(500), |message| match message {
                DeviceMessage::Info(info) if info.nonce == nonce => {
                    Some((info.restarts.0.runs, info.reset_count))
                }
                _ => None,
            })
        });
        answer.expect("the board answers")
    }
}

#[test]
fn a_crash_is_told_after_the_restart_and_the_board_goes_on() {
    let Some(board) = crashing_board() else { return };
    let emulator = board.start("crash");
    let mut line = Line::new(&emulator);
    let (mut runs, mut count) = line.runs(1);
    let crashes = [
        (PANIC, RestartCause::Panic, "asked to panic"),
        (OVERFLOW, RestartCause::HardFault, "pc 0x"),
        (HANG, RestartCause::Watchdog, "did not come round"),
        (PANIC, RestartCause::Panic, "asked to panic"),
    ];
    for (nonce, (how, cause, words)) in (2..).zip(crashes) {
        line.crash(how);
        let (told, text) = line
            .listen_for(PATIENCE, |message| match message {
                DeviceMessage::LastPanic(last) => Some((last.cause, last.text.to_owned())),
                _ => None,
            })
            .expect("the board tells why it restarted");
        assert_eq!(told, cause, "{text}");
        assert!(text.contains(words), "{text}");
        println!("{}: {cause:?}: {text}", board.name);
        let before = (runs, count);
        (runs, count) = line.runs(nonce);
        assert_eq!(runs, before.0.wrapping_add(1));
        assert_ne!(count, before.1, "a restart shows in the count");
    }
}

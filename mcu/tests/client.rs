//! The host's end of the line against the device's, without a board between them.
mod bench;

use bench::{Bench, Fake, configuration};
use monorange_mcu::Device;
use monorange_protocol::{
    client::Client,
    message::{DeviceMessage, FrameBegin, HostMessage},
};
use std::{
    collections::VecDeque,
    io::{self, Read, Write},
    time::Duration,
};

/// A line to a device, which does not hear its first bytes.
struct Wire {
    device: Device<Fake>,
    board: Bench,
    deaf_for: usize,
    answers: VecDeque<u8>,
}

impl Wire {
    fn deaf_for(bytes: usize) -> Self {
        let (device, board) = (Device::new(Fake::default()), Bench::default());
        Self { device, board, deaf_for: bytes, answers: VecDeque::new() }
    }
}

impl Write for Wire {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let unheard = self.deaf_for.min(bytes.len());
        self.deaf_for -= unheard;
        let mut answer = vec![];
        self.device.receive(&bytes[unheard..], &self.board, &mut answer);
        self.answers.extend(answer);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Wire {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.answers.is_empty() {
            std::thread::sleep(Duration::from_millis(5));
            return Err(io::ErrorKind::TimedOut.into());
        }
        self.answers.read(out)
    }
}

#[test]
fn a_hello_that_the_device_did_not_hear_is_said_again() {
    let mut client = Client::new(Wire::deaf_for(20), 5, Duration::from_secs(10)).unwrap();
    let greeted =
        &mut |message: &DeviceMessage<'_>| matches!(message, DeviceMessage::Info(info) if info.nonce == 5);
    client.wait_for(greeted).unwrap();
}

#[test]
fn a_device_that_never_answers_is_given_up() {
    let patience = Duration::from_millis(700);
    let mut client = Client::new(Wire::deaf_for(usize::MAX), 5, patience).unwrap();
    let error = client.wait_for(&mut |_| true).unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::TimedOut);
}

#[test]
fn a_picture_larger_than_the_window_is_sent_as_the_device_takes_it() {
    let mut client = Client::new(Wire::deaf_for(0), 5, Duration::from_secs(10)).unwrap();
    client.send(&HostMessage::Configure(configuration()), &mut |_| ()).unwrap();
    let begin = FrameBegin { frame: 3, time_us: 7, left: 0, top: 0, width: 320, height: 240 };
    let pixels: Vec<u8> = (0..320 * 240).map(|at| (at % 251) as u8).collect();
    let answer = client.frame(&[], &begin, &pixels).unwrap();
    let pose = answer.pose.unwrap();
    assert_eq!((pose.frame, pose.predicted_only, answer.observations.len()), (3, false, 30));
    let wire = client.into_stream();
    let checksum = monorange_protocol::frame::checksum(&pixels);
    assert_eq!({ wire }.device.engine().pictures, [(3, checksum)]);
}

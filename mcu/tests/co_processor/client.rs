//! The host's end of the line against the device's, without a board between them.

use crate::bench::{Fake, configuration, wire::Wire};
use monorange_protocol::{
    client::Client,
    message::{DeviceMessage, FrameBegin, HostMessage},
};
use std::{io, time::Duration};

#[test]
fn a_hello_that_the_device_did_not_hear_is_said_again() {
    let mut client = Client::new(Wire::new(Fake::default(), 20), 5, Duration::from_secs(10)).unwrap();
    let greeted =
        &mut |message: &DeviceMessage<'_>| matches!(message, DeviceMessage::Info(info) if info.nonce == 5);
    client.wait_for(greeted).unwrap();
}

#[test]
fn a_device_that_never_answers_is_given_up() {
    let patience = Duration::from_millis(700);
    let mut client = Client::new(Wire::new(Fake::default(), usize::MAX), 5, patience).unwrap();
    let error = client.wait_for(&mut |_| true).unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::TimedOut);
}

#[test]
fn a_picture_larger_than_the_window_is_sent_as_the_device_takes_it() {
    let mut client = Client::new(Wire::new(Fake::default(), 0), 5, Duration::from_secs(10)).unwrap();
    client.send(&HostMessage::Configure(configuration()), &mut |_| ()).unwrap();
    let begin = FrameBegin { frame: 3, time_us: 7, left: 0, top: 0, width: 320, height: 240 };
    let pixels: Vec<u8> = (0..320 * 240).map(|at| (at % 251) as u8).collect();
    let answer = client.frame(&[], None, &begin, &pixels).unwrap();
    let pose = answer.pose.unwrap();
    assert_eq!((pose.frame, pose.predicted_only, answer.observations.len()), (3, false, 30));
    let checksum = monorange_protocol::frame::checksum(&pixels);
    assert_eq!(client.stream().device.engine().pictures, [(3, checksum)]);
}

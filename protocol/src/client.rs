//! The host's end of the line (feature `std`): sends within the credit, listens, and says hello after a silence.
//!
//! A [`Client`] works on any stream whose `read` gives up after a few milliseconds, as serial ports, TCP and Unix sockets do once
//! a read timeout is set. What the device says goes to a callback as it comes.
use crate::{
    frame::{Deframer, LinkCounts, MAX_ENCODED},
    message::*,
    window::Window,
};
use std::{
    io::{self, Read, Write},
    string::String,
    time::{Duration, Instant},
    vec::Vec,
};

/// Pixels in one message: what its other fields leave of the payload.
const MAX_ROWS: usize = crate::frame::MAX_PAYLOAD - 10;

/// After this long without a word the line counts as empty and hello is said.
const SILENCE: Duration = Duration::from_millis(500);

/// What the device said of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// Where the robot is; always there when [`Client::frame`] returns.
    pub pose: Option<Pose>,
    /// What became of the corners, where the configuration asks for it.
    pub observations: Vec<Observation>,
    /// The map, where it was due.
    pub landmarks: Vec<Landmark>,
    /// Counts and costs, where they were due.
    pub statistics: Option<Statistics>,
    /// What was refused.
    pub faults: Vec<Fault>,
    /// The device has restarted meanwhile, and why, as far as it knows.
    pub restarted: Option<String>,
}

impl Answer {
    /// Takes what the device says.
    pub fn absorb(&mut self, message: &DeviceMessage<'_>) {
        match message {
            DeviceMessage::Pose(pose) => self.pose = Some(*pose),
            DeviceMessage::Observations(some) => self.observations.extend(&some.observations),
            DeviceMessage::Map(some) => {
                if some.first == 0 {
                    self.landmarks.clear();
                }
                self.landmarks.extend(&some.landmarks);
            }
            DeviceMessage::Statistics(statistics) => self.statistics = Some(*statistics),
            DeviceMessage::Fault(fault) => self.faults.push(*fault),
            DeviceMessage::LastPanic(last) => {
                self.restarted = Some(std::format!("{:?}: {}", last.cause, last.text));
            }
            // A device that greets without having been greeted has just started.
            DeviceMessage::Info(info) if info.nonce == 0 => {
                self.restarted.get_or_insert_with(|| "it was reset".into());
            }
            _ => {}
        }
    }
}

/// The host's end of the line.
#[derive(Debug)]
pub struct Client<S> {
    stream: S,
    deframer: Deframer,
    window: Window,
    counts: LinkCounts,
    last_heard: Option<u16>,
    heard_at: Instant,
    sequence: u16,
    nonce: u32,
    patience: Duration,
}

impl<S: Read + Write> Client<S> {
    /// A client that has said hello; `nonce` is any number, another one for each client.
    ///
    /// # Errors
    /// What the stream says.
    pub fn new(stream: S, nonce: u32, patience: Duration) -> io::Result<Self> {
        let mut client = Self {
            stream,
            deframer: Deframer::new(),
            window: Window::new(),
            counts: LinkCounts::ZERO,
            last_heard: None,
            heard_at: Instant::now(),
            sequence: 0,
            nonce,
            patience,
        };
        client.hello()?;
        Ok(client)
    }

    /// Sends a message as soon as there is credit for it, and listens until then.
    ///
    /// # Errors
    /// What the stream says; [`io::ErrorKind::TimedOut`] when the device grants nothing for as long as the client's patience;
    /// [`io::ErrorKind::InvalidInput`] when the message does not fit a frame.
    pub fn send(
        &mut self,
        message: &HostMessage<'_>,
        heard: &mut dyn FnMut(&DeviceMessage<'_>),
    ) -> io::Result<()> {
        let mut line = [0; MAX_ENCODED];
        let sequence = self.sequence;
        let line = message
            .encode(sequence, &mut line)
            .map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
        self.listen_until(heard, |client| client.window.has_room(line.len()))?;
        // A hello that was said meanwhile took a number.
        let line = if self.sequence == sequence { line } else { return self.send(message, heard) };
        self.sequence = sequence.wrapping_add(1);
        self.window.sent(sequence, line.len());
        self.stream.write_all(line)
    }

    /// Sends a picture with the motion before it and how the robot leans, if that is known, and returns what the device says of it.
    ///
    /// # Errors
    /// As [`send`](Self::send), and [`io::ErrorKind::TimedOut`] when no pose comes; [`io::ErrorKind::ConnectionReset`] when
    /// the device has restarted.
    pub fn frame(
        &mut self,
        motion: &[Odometry],
        lean: Option<Attitude>,
        begin: &FrameBegin,
        pixels: &[u8],
    ) -> io::Result<Answer> {
        let mut answer = Answer::default();
        let mut absorb = |message: &DeviceMessage<'_>| answer.absorb(message);
        for odometry in motion {
            self.send(&HostMessage::Odometry(*odometry), &mut absorb)?;
        }
        if let Some(lean) = lean {
            self.send(&HostMessage::Attitude(lean), &mut absorb)?;
        }
        self.send(&HostMessage::FrameBegin(*begin), &mut absorb)?;
        let width = usize::from(begin.width).max(1);
        let rows_at_once = (MAX_ROWS / width).max(1);
        for (number, pixels) in pixels.chunks(rows_at_once * width).enumerate() {
            let row = (number * rows_at_once) as u16; // at most the height
            self.send(&HostMessage::Rows(Rows { frame: begin.frame, row, pixels }), &mut absorb)?;
        }
        self.finish(begin.frame, answer)
    }

    /// Sends corners with the motion before them, and returns what the device says of them.
    ///
    /// # Errors
    /// As [`frame`](Self::frame).
    pub fn corners(&mut self, motion: &[Odometry], corners: &Corners) -> io::Result<Answer> {
        let mut answer = Answer::default();
        let mut absorb = |message: &DeviceMessage<'_>| answer.absorb(message);
        for odometry in motion {
            self.send(&HostMessage::Odometry(*odometry), &mut absorb)?;
        }
        self.send(&HostMessage::Corners(corners.clone()), &mut absorb)?;
        self.pose(corners.frame, &mut answer)?;
        Ok(answer)
    }

    /// Asks how far things are, and returns that in their order; pose and map stay as they are.
    ///
    /// # Errors
    /// As [`send`](Self::send), and [`io::ErrorKind::TimedOut`] when no answer comes; [`io::ErrorKind::NotConnected`] when the
    /// device has no configuration.
    pub fn ranges(&mut self, range: &Range) -> io::Result<Vec<Ranged>> {
        let (mut ranges, mut refused) = (None, false);
        self.send(&HostMessage::Range(range.clone()), &mut |_| ())?;
        self.wait_for(&mut |message| {
            match message {
                DeviceMessage::Ranges(some) if some.request == range.request => {
                    ranges = Some(some.ranges.to_vec());
                }
                DeviceMessage::Fault(fault) => refused |= fault.cause == Cause::NotConfigured,
                _ => {}
            }
            refused || ranges.is_some()
        })?;
        ranges.ok_or_else(|| io::Error::new(io::ErrorKind::NotConnected, "the device is not configured"))
    }

    /// Asks for the whole map, and returns it: tentative landmarks too.
    ///
    /// # Errors
    /// As [`send`](Self::send), and [`io::ErrorKind::TimedOut`] when it does not come.
    pub fn map(&mut self) -> io::Result<Vec<Landmark>> {
        let mut answer = Answer::default();
        self.send(&HostMessage::Ask(Ask::Map), &mut |_| ())?;
        self.wait_for(&mut |message| {
            answer.absorb(message);
            matches!(message, DeviceMessage::Map(some) if answer.landmarks.len() == usize::from(some.total))
        })?;
        Ok(answer.landmarks)
    }

    /// Ends a picture until the device has answered it: an end that was lost on the way is said again.
    fn finish(&mut self, frame: u32, mut answer: Answer) -> io::Result<Answer> {
        let start = Instant::now();
        loop {
            self.send(&HostMessage::FrameEnd(FrameEnd { frame }), &mut |message| answer.absorb(message))?;
            match self.pose(frame, &mut answer) {
                Ok(()) => return Ok(answer),
                Err(error) if error.kind() != io::ErrorKind::TimedOut => return Err(error),
                Err(error) if start.elapsed() > self.patience => return Err(error),
                Err(_) => {}
            }
        }
    }

    /// Listens for the pose of a frame, for as long as a silence may last.
    fn pose(&mut self, frame: u32, answer: &mut Answer) -> io::Result<()> {
        let start = Instant::now();
        // What follows the pose is sent at once with it: the credit comes last.
        let mut complete = false;
        while !complete {
            self.listen(&mut |message| {
                answer.absorb(message);
                let posed = answer.pose.is_some_and(|pose| pose.frame == frame);
                complete |= posed && matches!(message, DeviceMessage::Credit(_));
            })?;
            if let Some(why) = &answer.restarted {
                return Err(io::Error::new(io::ErrorKind::ConnectionReset, why.clone()));
            }
            if start.elapsed() > 2 * SILENCE {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "the device does not answer"));
            }
        }
        Ok(())
    }

    /// Listens until the callback returns true, and says hello after each silence: the one before may have been lost, or the
    /// device may not have been listening yet.
    ///
    /// # Errors
    /// What the stream says; [`io::ErrorKind::TimedOut`] when that does not come to pass within the client's patience.
    pub fn wait_for(&mut self, heard: &mut dyn FnMut(&DeviceMessage<'_>) -> bool) -> io::Result<()> {
        let mut found = false;
        let start = Instant::now();
        while !found {
            if start.elapsed() > self.patience {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "the device does not answer"));
            }
            self.listen(&mut |message| found |= heard(message))?;
            self.break_silence()?;
        }
        Ok(())
    }

    /// Takes what has come, waiting no longer than the stream's read timeout.
    ///
    /// # Errors
    /// What the stream says, other than that nothing came.
    pub fn listen(&mut self, heard: &mut dyn FnMut(&DeviceMessage<'_>)) -> io::Result<()> {
        let mut bytes = [0; 4096];
        let count = match self.stream.read(&mut bytes) {
            Ok(0) => return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the line was closed")),
            Ok(count) => count,
            Err(error) => match error.kind() {
                io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted => 0,
                _ => return Err(error),
            },
        };
        let mut left = bytes.get(..count).unwrap_or_default();
        while let Some(result) = self.deframer.take(&mut left) {
            match result {
                Err(damage) => self.counts.damage(damage),
                Ok(frame) => {
                    let new = self.counts.arrived(self.last_heard, frame.sequence);
                    self.last_heard = Some(frame.sequence);
                    self.heard_at = Instant::now();
                    match DeviceMessage::decode(&frame) {
                        Err(error) => self.counts.misunderstood(error),
                        Ok(_) if !new => {}
                        Ok(message) => {
                            if let DeviceMessage::Credit(credit) = &message {
                                self.window.credit(credit.sequence, credit.granted);
                            }
                            heard(&message);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// What was heard, and what was damaged on the way.
    pub fn counts(&self) -> &LinkCounts {
        &self.counts
    }

    /// The line.
    pub fn stream(&mut self) -> &mut S {
        &mut self.stream
    }

    /// The line, without the client.
    pub fn into_stream(self) -> S {
        self.stream
    }

    fn listen_until(
        &mut self,
        heard: &mut dyn FnMut(&DeviceMessage<'_>),
        done: impl Fn(&Self) -> bool,
    ) -> io::Result<()> {
        let start = Instant::now();
        while !done(self) {
            self.listen(heard)?;
            self.break_silence()?;
            if start.elapsed() > self.patience {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "the device grants no credit"));
            }
        }
        Ok(())
    }

    /// Counts the line as empty and says hello when nothing was heard for a while.
    fn break_silence(&mut self) -> io::Result<()> {
        if self.heard_at.elapsed() > SILENCE {
            self.heard_at = Instant::now();
            self.window.forget();
            self.hello()?;
        }
        Ok(())
    }

    fn hello(&mut self) -> io::Result<()> {
        let mut line = [0; MAX_ENCODED];
        let hello = HostMessage::Hello(Hello { nonce: self.nonce });
        let line = hello
            .encode(self.sequence, &mut line)
            .map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
        self.window.sent(self.sequence, line.len());
        self.sequence = self.sequence.wrapping_add(1);
        self.stream.write_all(line)
    }
}

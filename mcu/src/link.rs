//! Frames in and out.
use crate::{WINDOW, text};
use embedded_io::Write;
use monorange_protocol::{
    frame::{Frame, LinkCounts, MAX_ENCODED},
    message::{Credit, DeviceMessage, Observation, Pose, Text},
};

/// Numbers what is sent, counts what comes, and grants credit.
#[derive(Debug)]
pub struct Link {
    line: [u8; MAX_ENCODED],
    sequence: u16,
    last_heard: Option<u16>,
    since_credit: usize,
    unsent: u32,
    /// Whether answers are frames, lines of text, or both.
    pub text: Text,
    /// What the line did.
    pub counts: LinkCounts,
}

impl Default for Link {
    fn default() -> Self {
        Self::new()
    }
}

impl Link {
    /// A line on which nothing was said yet.
    pub const fn new() -> Self {
        let counts = LinkCounts::ZERO;
        let (line, text) = ([0; MAX_ENCODED], Text::Frames);
        Self { line, sequence: 0, last_heard: None, since_credit: 0, unsent: 0, text, counts }
    }

    /// Sends a message; what the line does not take is counted and forgotten, for the filter must go on.
    pub fn send(&mut self, message: &DeviceMessage<'_>, port: &mut impl Write) {
        self.frame(message, port);
        if self.text != Text::Frames {
            text::message(message, &mut |line| self.write(line, port));
        }
    }

    /// Sends the answer to a picture, of whose corners a line of text tells the nearest.
    pub fn picture(
        &mut self,
        pose: &Pose,
        corners: impl ExactSizeIterator<Item = Observation>,
        port: &mut impl Write,
    ) {
        self.frame(&DeviceMessage::Pose(*pose), port);
        if self.text != Text::Frames {
            let count = corners.len();
            let nearest = text::nearest(corners);
            text::picture(pose, count, nearest.as_ref(), &mut |line| self.write(line, port));
        }
    }

    fn frame(&mut self, message: &DeviceMessage<'_>, port: &mut impl Write) {
        if self.text == Text::Lines {
            return;
        }
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        let sent = message.encode(sequence, &mut self.line).is_ok_and(|line| port.write_all(line).is_ok());
        self.unsent = self.unsent.saturating_add(u32::from(!sent));
    }

    fn write(&mut self, line: &[u8], port: &mut impl Write) {
        self.unsent = self.unsent.saturating_add(u32::from(port.write_all(line).is_err()));
    }

    /// Counts a whole frame; returns whether it is to be acted on. `restarted`: the sender begins to count anew.
    pub fn heard(&mut self, frame: &Frame<'_>, restarted: bool) -> bool {
        let last = self.last_heard.filter(|_| !restarted);
        self.last_heard = Some(frame.sequence);
        self.counts.arrived(last, frame.sequence)
    }

    /// Notes that bytes were taken off the line, and grants credit when a quarter of the window was used up.
    pub fn taken(&mut self, bytes: usize, port: &mut impl Write) {
        self.since_credit += bytes;
        if self.since_credit >= WINDOW / 4 {
            self.grant(port);
        }
    }

    /// Tells the host what may be sent.
    pub fn grant(&mut self, port: &mut impl Write) {
        if let Some(sequence) = self.last_heard {
            self.since_credit = 0;
            let granted = u16::try_from(WINDOW).unwrap_or(u16::MAX);
            self.send(&DeviceMessage::Credit(Credit { sequence, granted }), port);
        }
    }

    /// Messages that the line did not take.
    pub fn unsent(&self) -> u32 {
        self.unsent
    }
}

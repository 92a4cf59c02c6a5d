use super::line::{Line, Stream};
use monorange_core::pipeline;
use monorange_formats::{Error, files::Rig, pictures::Picture};
use monorange_protocol::{
    client::{Answer, Client},
    conversion,
    message::{
        Answers, Attitude, Cause, DeviceMessage, Fault, FrameBegin, HostMessage, Landmark, Odometry,
        SaveState, State,
    },
};
use std::{io, time::Duration};

/// What the device is to say of each frame.
pub(super) const ANSWERS: Answers = Answers { observations: true, map_every: 0, statistics_every: 0 };

/// Why a step with the device did not succeed.
pub(super) enum Failure {
    /// The line was lost, or the device restarted: connect again.
    Line(io::Error),
    /// Trying again would not help.
    Refused(Error),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Line(error)
    }
}

/// A device's state, as it came: chunks with their frame, offset, total and checksum.
pub(super) struct Saved(Vec<([u32; 4], Vec<u8>)>);

/// The conversation with a device, over as many connections as it takes.
pub(super) struct Session<'a> {
    line: &'a Line,
    rig: &'a Rig,
    patience: Duration,
    client: Option<Client<Box<dyn Stream>>>,
    connections: u32,
    reset_count: u8,
}

type Step<T> = Result<T, Failure>;

impl<'a> Session<'a> {
    pub(super) fn new(line: &'a Line, rig: &'a Rig, patience: Duration) -> Self {
        Self { line, rig, patience, client: None, connections: 0, reset_count: 0 }
    }

    pub(super) fn line(&self) -> &Line {
        self.line
    }

    /// Opens the line unless it is open, configures the device and gives it a state.
    pub(super) fn connect(&mut self, state: Option<&Saved>) -> Step<()> {
        if self.client.is_some() {
            return Ok(());
        }
        self.connections += 1;
        // A nonce of 0 would be taken for a greeting.
        let nonce = std::process::id().wrapping_add(self.connections << 22) | 1;
        let mut client = Client::new(self.line.open()?, nonce, self.patience)?;
        let camera = self.rig.finder.camera();
        let (width, height) = (camera.width(), camera.height());
        let mut limits = None;
        client.wait_for(&mut |message| {
            if let DeviceMessage::Info(info) = message
                && info.nonce == nonce
            {
                limits = Some([info.max_width, info.max_height].map(usize::from));
            }
            limits.is_some()
        })?;
        if let Some([most_wide, most_high]) = limits
            && (width > most_wide || height > most_high)
        {
            let cause = format!(
                "pictures of {width}×{height} px are more than the device takes, {most_wide}×{most_high}"
            );
            return Err(Failure::Refused(Error::new(cause).help("feed smaller pictures")));
        }
        let configure = conversion::message_from_config(&self.rig.on_a_device(), ANSWERS);
        client.send(&HostMessage::Configure(configure), &mut |_| ())?;
        let (mut refused, mut reset_count) = (None, 0);
        client.wait_for(&mut |message| {
            if let DeviceMessage::Fault(Fault { cause: Cause::Configuration, detail }) = message {
                refused = Some(*detail);
            }
            let DeviceMessage::Info(info) = message else { return refused.is_some() };
            reset_count = info.reset_count;
            info.configured
        })?;
        if let Some(number) = refused {
            let setting = pipeline::settings().find(|(setting, _)| u32::from(setting.number) == number);
            let which = setting.map_or("the settings", |(setting, _)| setting.name);
            let error = Error::new(format!("the device refuses {which}"));
            return Err(Failure::Refused(error.help("check the rig file with `monorange slam`")));
        }
        self.reset_count = reset_count;
        if let Some(state) = state {
            restore(&mut client, state)?;
        }
        self.client = Some(client);
        Ok(())
    }

    /// Does something with the open line, which is closed when that fails.
    fn with<T>(&mut self, step: impl FnOnce(&mut Client<Box<dyn Stream>>) -> io::Result<T>) -> Step<T> {
        let closed = || io::Error::new(io::ErrorKind::NotConnected, "the line is not open");
        let result = self.client.as_mut().ok_or_else(closed).and_then(step);
        if result.is_err() {
            self.client = None;
        }
        Ok(result?)
    }

    /// Plays a frame with the motion before it.
    pub(super) fn frame(
        &mut self,
        frame: u32,
        time_us: u64,
        (motion, lean): (&[Odometry], Option<Attitude>),
        picture: &Picture,
    ) -> Step<Answer> {
        let expected = self.reset_count;
        // The sizes were checked against the camera's, which a message has taken.
        let [width, height] =
            [picture.width, picture.height].map(|size| u16::try_from(size).unwrap_or(u16::MAX));
        let begin = FrameBegin { frame, time_us, left: 0, top: 0, width, height };
        self.with(|client| {
            let answer = client.frame(motion, lean, &begin, &picture.pixels)?;
            let lost_its_state = |fault: &Fault| matches!(fault.cause, Cause::NotConfigured | Cause::State);
            let forgotten = answer.faults.iter().any(lost_its_state);
            if forgotten || answer.pose.is_some_and(|pose| pose.reset_count != expected) {
                return Err(io::Error::new(io::ErrorKind::ConnectionReset, "the device was reset"));
            }
            Ok(answer)
        })
    }

    /// Asks for the map.
    pub(super) fn map(&mut self) -> Step<Vec<Landmark>> {
        self.with(Client::map)
    }

    /// Asks for the state.
    pub(super) fn save(&mut self) -> Step<Saved> {
        self.with(|client| {
            client.send(&HostMessage::SaveState(SaveState {}), &mut |_| ())?;
            let mut chunks = Vec::new();
            client.wait_for(&mut |message| {
                let DeviceMessage::State(State { frame, offset, total, checksum, bytes }) = message else {
                    return false;
                };
                chunks.push(([*frame, *offset, *total, *checksum], bytes.to_vec()));
                offset + bytes.len() as u32 == *total
            })?;
            Ok(Saved(chunks))
        })
    }
}

fn restore(client: &mut Client<Box<dyn Stream>>, state: &Saved) -> io::Result<()> {
    let mut refused = false;
    for ([frame, offset, total, checksum], bytes) in &state.0 {
        let (frame, offset, total, checksum) = (*frame, *offset, *total, *checksum);
        let chunk = HostMessage::RestoreState(State { frame, offset, total, checksum, bytes });
        client.send(&chunk, &mut |message| refused |= matches!(message, DeviceMessage::Fault(_)))?;
    }
    client.wait_for(&mut |message| {
        refused |= matches!(message, DeviceMessage::Fault(_));
        refused || matches!(message, DeviceMessage::Info(_))
    })?;
    if refused {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "the device does not take its state back"));
    }
    Ok(())
}

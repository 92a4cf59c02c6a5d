//! The state machine: what each message does, when a picture is given up, and what is answered.
//!
//! | comes | does | answers |
//! |---|---|---|
//! | bytes that are no frame | counted | – (a frame of another version: a fault) |
//! | the next rows of the picture | through the pipeline at once | – |
//! | rows of no picture, or again | counted | – |
//! | rows after a gap, or too many | the picture is given up | fault, and a predicted pose at its end |
//! | the end of a whole picture | corners, filter, map | observations, pose; map and statistics when due |
//! | the end of another one | motion only | fault, predicted pose |
//! | odometry after a gap in time | the last motion holds through the gap, for a second at most, then this one | – |
//! | a configuration or a reset within a picture | the picture is given up | fault |
//! | a whole frame that is no message | counted | fault |
//! | a wish for text | answers are lines from then on | who this is |
mod motion;
mod state;

use crate::{
    Board, Engine, WINDOW,
    link::Link,
    meter::{Meter, Stage},
};
use embedded_io::Write;
use monorange_protocol::{
    Error, VERSION, conversion,
    frame::{Damage, Deframer, Frame},
    message::*,
};
use state::Restored;

/// What the device wants of its board after a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Nothing.
    GoOn,
    /// To be restarted.
    Restart,
}

/// The picture that is arriving.
#[derive(Clone, Copy, Debug)]
struct Picture {
    begin: FrameBegin,
    next_row: u16,
}

#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    done: u32,
    dropped: u32,
    rows_refused: u32,
}

/// The co-processor: bytes in, answers out.
pub struct Device<E> {
    deframer: Deframer,
    dispatch: Dispatch<E>,
}

/// Everything but the deframer, in whose memory a message stands while it is dispatched.
struct Dispatch<E> {
    engine: E,
    link: Link,
    meter: Meter,
    picture: Option<Picture>,
    answers: Answers,
    counts: Counts,
    last_motion: Option<Odometry>,
    last_frame: u32,
    last_time_us: u64,
    restored: Restored,
    nonce: u32,
    restarts: Restarts,
}

impl<E: Engine> Device<E> {
    /// A device that was just started.
    pub const fn new(engine: E) -> Self {
        let answers = Answers { observations: false, map_every: 0, statistics_every: 0 };
        Self {
            deframer: Deframer::new(),
            dispatch: Dispatch {
                engine,
                link: Link::new(),
                meter: Meter::new(),
                picture: None,
                answers,
                counts: Counts { done: 0, dropped: 0, rows_refused: 0 },
                last_motion: None,
                last_frame: 0,
                last_time_us: 0,
                restored: Restored { next: 0, total: 0, checksum: 0 },
                nonce: 0,
                restarts: Restarts { runs: 0, configurations: 0, resets: 0 },
            },
        }
    }

    /// Says why the last run ended, and who this is. To be called once, first; `runs` is the number of this run.
    pub fn greet<B: Board>(
        &mut self,
        runs: u8,
        last_run: Option<LastPanic<'_>>,
        board: &B,
        port: &mut impl Write,
    ) {
        self.dispatch.restarts.runs = runs;
        if let Some(panic) = last_run {
            self.dispatch.link.send(&DeviceMessage::LastPanic(panic), port);
        }
        self.dispatch.introduce::<B>(port);
        self.dispatch.meter.start(board);
    }

    /// Takes bytes of the line, does what they say and answers to `port`.
    pub fn receive(&mut self, bytes: &[u8], board: &impl Board, port: &mut impl Write) -> Wish {
        self.dispatch.meter.start(board);
        let (mut wish, mut left) = (Wish::GoOn, bytes);
        while let Some(result) = self.deframer.take(&mut left) {
            match result {
                Ok(frame) if self.dispatch.frame(&frame, board, port) == Wish::Restart => {
                    wish = Wish::Restart
                }
                Ok(_) => {}
                Err(damage) => self.dispatch.damage(damage, port),
            }
        }
        self.dispatch.link.taken(bytes.len(), port);
        self.dispatch.meter.lap(Stage::Receive, board);
        wish
    }

    /// The engine, for tests and boards that feed it by other ways.
    pub fn engine(&mut self) -> &mut E {
        &mut self.dispatch.engine
    }
}

impl<E: Engine> Dispatch<E> {
    fn damage(&mut self, damage: Damage, port: &mut impl Write) {
        self.link.counts.damage(damage);
        if let Damage::Version(_) = damage {
            self.fault(Cause::Version, u32::from(VERSION), port);
        }
    }

    fn frame<B: Board>(&mut self, frame: &Frame<'_>, board: &B, port: &mut impl Write) -> Wish {
        board.alive();
        #[cfg(feature = "crash")]
        crate::crash::on_demand(frame);
        let message = HostMessage::decode(frame);
        let hello = matches!(message, Ok(HostMessage::Hello(_)));
        if !self.link.heard(frame, hello) {
            return Wish::GoOn;
        }
        match message {
            Ok(message) => {
                self.meter.lap(Stage::Receive, board);
                self.message(&message, board, port)
            }
            Err(error) => {
                self.link.counts.misunderstood(error);
                if let Error::Payload { kind } = error {
                    self.fault(Cause::NotUnderstood, kind.into(), port);
                    self.link.grant(port);
                }
                Wish::GoOn
            }
        }
    }

    /// What has much to remember is a function of its own, here and below: its locals leave the stack with it.
    fn message<B: Board>(&mut self, message: &HostMessage<'_>, board: &B, port: &mut impl Write) -> Wish {
        let stage = match message {
            HostMessage::Rows(_) => Stage::Rows,
            HostMessage::Odometry(_) => Stage::Filter,
            _ => Stage::Answer,
        };
        match message {
            HostMessage::Hello(hello) => {
                // It wants to hear frames, whoever was here before.
                if self.link.text == Text::Lines {
                    self.link.text = Text::Frames;
                }
                self.nonce = hello.nonce;
                self.introduce::<B>(port);
                self.link.grant(port);
            }
            HostMessage::Configure(configure) => self.configure::<B>(configure, port),
            HostMessage::Odometry(odometry) => self.odometry(odometry, port),
            HostMessage::FrameBegin(begin) => self.begin(begin, board, port),
            HostMessage::Rows(rows) => self.rows(rows, port),
            HostMessage::FrameEnd(end) => self.end(end.frame, board, port),
            HostMessage::Corners(corners) => self.corners(corners, board, port),
            HostMessage::Reset(Reset::Device) => return Wish::Restart,
            HostMessage::Reset(Reset::State) => {
                self.forget(port);
                self.engine.reset();
                self.restarts.resets = self.restarts.resets.wrapping_add(1);
                self.introduce::<B>(port);
            }
            HostMessage::SaveState(_) => self.save(port),
            HostMessage::RestoreState(chunk) => self.restore::<B>(chunk, port),
            HostMessage::TimeSync(TimeSync { host_us }) => {
                let device_us = board.uptime_us();
                self.link.send(&DeviceMessage::Time(Time { host_us: *host_us, device_us }), port);
            }
            HostMessage::Ask(Ask::Map) => self.map(port),
            HostMessage::Ask(Ask::Statistics) => self.statistics(board, port),
            HostMessage::Range(range) => self.ranges(range, port),
            HostMessage::Attitude(attitude) => self.attitude(attitude, port),
            HostMessage::Text(text) => {
                self.link.text = *text;
                self.introduce::<B>(port);
            }
        }
        match message {
            // What is asked for now and then is no part of what a frame costs.
            HostMessage::Configure(_) | HostMessage::SaveState(_) | HostMessage::RestoreState(_) => {
                self.meter.start(board);
            }
            _ => self.meter.lap(stage, board),
        }
        if !matches!(message, HostMessage::Rows(_) | HostMessage::Hello(_)) {
            self.link.grant(port);
        }
        Wish::GoOn
    }

    #[inline(never)]
    fn configure<B: Board>(&mut self, configure: &Configure, port: &mut impl Write) {
        match self.engine.configure(configure) {
            Ok(()) => {
                self.answers = configure.answers;
                self.forget(port);
                self.restarts.configurations = self.restarts.configurations.wrapping_add(1);
            }
            Err(error) => self.fault(Cause::Configuration, conversion::number_of_refused(&error), port),
        }
        self.introduce::<B>(port);
    }

    /// Pose and map are new: whatever was under way belongs to the old ones.
    fn forget(&mut self, port: &mut impl Write) {
        if let Some(unfinished) = self.picture.take() {
            self.drop_picture(unfinished.begin.frame, port);
        }
        self.last_motion = None;
        self.last_time_us = 0;
        self.restored = Restored::default();
    }

    /// Another number after every restart and every reset; the two cannot make up for each other.
    fn reset_count(&self) -> u8 {
        self.restarts.runs << 4 | self.restarts.resets & 0xf
    }

    fn begin(&mut self, begin: &FrameBegin, board: &impl Board, port: &mut impl Write) {
        if let Some(unfinished) = self.picture.take() {
            self.drop_picture(unfinished.begin.frame, port);
            self.answer(unfinished.begin.frame, unfinished.begin.time_us, true, board, port);
        }
        if !self.engine.is_configured() {
            return self.fault(Cause::NotConfigured, begin.frame, port);
        }
        match self.engine.begin(begin) {
            Ok(()) => self.picture = Some(Picture { begin: *begin, next_row: 0 }),
            Err(_) => self.fault(Cause::PictureSize, begin.frame, port),
        }
    }

    fn rows(&mut self, rows: &Rows<'_>, port: &mut impl Write) {
        let width = match &self.picture {
            Some(picture) if picture.begin.frame == rows.frame => usize::from(picture.begin.width),
            _ => return self.refuse_rows(),
        };
        let Some(picture) = &mut self.picture else { return };
        if rows.row < picture.next_row {
            return self.refuse_rows();
        }
        let whole = width > 0 && rows.pixels.len().is_multiple_of(width);
        let count = rows.pixels.len().checked_div(width).unwrap_or(0);
        let fits = usize::from(picture.next_row) + count <= usize::from(picture.begin.height);
        if rows.row != picture.next_row || !whole || !fits {
            self.picture = None;
            self.refuse_rows();
            return self.drop_picture(rows.frame, port);
        }
        picture.next_row += count as u16; // at most the height
        for row in rows.pixels.chunks_exact(width) {
            self.engine.row(row);
        }
    }

    fn refuse_rows(&mut self) {
        self.counts.rows_refused = self.counts.rows_refused.saturating_add(1);
    }

    #[inline(never)]
    fn end(&mut self, frame: u32, board: &impl Board, port: &mut impl Write) {
        if !self.engine.is_configured() {
            return self.fault(Cause::NotConfigured, frame, port);
        }
        match self.picture.take() {
            Some(Picture { begin, next_row }) if begin.frame == frame && next_row == begin.height => {
                let Self { engine, meter, .. } = self;
                engine.end(|stage| meter.lap(stage, board));
                meter.lap(Stage::Filter, board);
                self.counts.done = self.counts.done.saturating_add(1);
                self.answer(frame, begin.time_us, false, board, port);
            }
            Some(Picture { begin, .. }) => {
                self.drop_picture(begin.frame, port);
                self.answer(frame, begin.time_us, true, board, port);
            }
            // Its beginning was lost, or it was given up already and the host told.
            None => {
                self.engine.abandon();
                self.answer(frame, self.last_time_us, true, board, port);
            }
        }
    }

    #[inline(never)]
    fn corners(&mut self, corners: &Corners, board: &impl Board, port: &mut impl Write) {
        if !self.engine.is_configured() {
            return self.fault(Cause::NotConfigured, corners.frame, port);
        }
        if let Some(unfinished) = self.picture.take() {
            self.drop_picture(unfinished.begin.frame, port);
        }
        self.meter.lap(Stage::Receive, board);
        self.engine.corners(corners);
        self.meter.lap(Stage::Filter, board);
        self.counts.done = self.counts.done.saturating_add(1);
        self.answer(corners.frame, corners.time_us, false, board, port);
    }

    fn drop_picture(&mut self, frame: u32, port: &mut impl Write) {
        self.engine.abandon();
        self.counts.dropped = self.counts.dropped.saturating_add(1);
        self.fault(Cause::FrameDropped, frame, port);
    }

    fn fault(&mut self, cause: Cause, detail: u32, port: &mut impl Write) {
        self.link.send(&DeviceMessage::Fault(Fault { cause, detail }), port);
    }

    fn introduce<B: Board>(&mut self, port: &mut impl Write) {
        let limits = E::LIMITS;
        let info = Info {
            nonce: self.nonce,
            firmware: FIRMWARE,
            board: B::NAME,
            reset_count: self.reset_count(),
            configured: self.engine.is_configured(),
            max_width: limits.width,
            max_height: limits.height,
            max_landmarks: limits.landmarks,
            max_corners: limits.corners,
            window: u16::try_from(WINDOW).unwrap_or(u16::MAX),
            state_bytes: limits.state_bytes,
            restarts: Later(self.restarts),
        };
        self.link.send(&DeviceMessage::Info(info), port);
    }

    /// What follows every frame.
    fn answer(
        &mut self,
        frame: u32,
        time_us: u64,
        predicted_only: bool,
        board: &impl Board,
        port: &mut impl Write,
    ) {
        self.last_frame = frame;
        let observations = if predicted_only { 0 } else { self.engine.observations().len() };
        let mut first = 0;
        // Always at least one message, so that a host knows what to wait for.
        while self.answers.observations && (first == 0 || first < observations) {
            let some =
                self.engine.observations().take(observations).skip(first).take(MAX_OBSERVATIONS).collect();
            let [start, total] = [first, observations].map(|number| number as u16); // at most the limits'
            first += MAX_OBSERVATIONS;
            let message = Observations { frame, first: start, total, observations: some };
            self.link.send(&DeviceMessage::Observations(message), port);
        }
        let estimate = self.engine.estimate();
        let pose = Pose {
            frame,
            time_us,
            position: estimate.position,
            heading: estimate.heading,
            covariance: estimate.covariance,
            reset_count: self.reset_count(),
            predicted_only,
            landmarks: self.engine.landmarks().len() as u16, // at most the limits'
        };
        let Self { link, engine, .. } = self;
        link.picture(&pose, engine.observations().take(observations), port);
        let frames = self.counts.done.wrapping_add(self.counts.dropped);
        let due = |every: u16| every > 0 && frames.is_multiple_of(u32::from(every));
        if due(self.answers.map_every) {
            self.map(port);
        }
        self.meter.lap(Stage::Answer, board);
        self.meter.finish_frame(board);
        if due(self.answers.statistics_every) {
            self.statistics(board, port);
        }
    }

    fn map(&mut self, port: &mut impl Write) {
        let landmarks = self.engine.landmarks().len();
        let mut first = 0;
        loop {
            let some = self.engine.landmarks().skip(first).take(MAX_LANDMARKS).collect();
            let [start, total] = [first, landmarks].map(|number| number as u16); // at most the limits'
            let message = Map { frame: self.last_frame, first: start, total, landmarks: some };
            self.link.send(&DeviceMessage::Map(message), port);
            first += MAX_LANDMARKS;
            if first >= landmarks {
                break;
            }
        }
    }

    #[inline(never)]
    fn ranges(&mut self, range: &Range, port: &mut impl Write) {
        let Range { request, std_px, spots } = range;
        let ranges = spots.iter().map_while(|spot| self.engine.range(spot, *std_px)).collect();
        if !self.engine.is_configured() {
            return self.fault(Cause::NotConfigured, *request, port);
        }
        self.link.send(&DeviceMessage::Ranges(Ranges { request: *request, ranges }), port);
    }

    fn statistics(&mut self, board: &impl Board, port: &mut impl Write) {
        let mut link = self.link.counts;
        link.overrun = board.overrun();
        let statistics = Statistics {
            frame: self.last_frame,
            frames_done: self.counts.done,
            frames_dropped: self.counts.dropped,
            rows_refused: self.counts.rows_refused,
            unsent: self.link.unsent(),
            link,
            unit: board_unit(board),
            stages: self.meter.last_frame(),
            stack_used: board.stack_used(),
            stack_size: board.stack_size(),
            uptime_us: board.uptime_us(),
        };
        self.link.send(&DeviceMessage::Statistics(statistics), port);
    }
}

/// This crate's version.
const FIRMWARE: [u8; 3] = {
    const fn number(text: &str) -> u8 {
        match u8::from_str_radix(text, 10) {
            Ok(number) => number,
            Err(_) => 255,
        }
    }
    [
        number(env!("CARGO_PKG_VERSION_MAJOR")),
        number(env!("CARGO_PKG_VERSION_MINOR")),
        number(env!("CARGO_PKG_VERSION_PATCH")),
    ]
};

fn board_unit<B: Board>(_board: &B) -> CostUnit {
    B::COST_UNIT
}

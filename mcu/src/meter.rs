//! The cost of a frame by stages.
use crate::Board;
use monorange_protocol::message::Stages;

/// Where the main loop is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Bytes to frames to messages, and everything that has no name of its own.
    Receive,
    /// Rows to votes.
    Rows,
    /// Votes to corners.
    Corners,
    /// Motion, matching, filter and map.
    Filter,
    /// Answers to bytes.
    Answer,
}

/// Adds up what the stages of the present frame cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Meter {
    now: Stages,
    last: Stages,
    mark: u32,
    interrupt_mark: u32,
}

impl Meter {
    /// A meter before the first frame.
    pub const fn new() -> Self {
        const NOTHING: Stages =
            Stages { interrupt: 0, receive: 0, rows: 0, corners: 0, filter: 0, answer: 0 };
        Self { now: NOTHING, last: NOTHING, mark: 0, interrupt_mark: 0 }
    }

    /// Starts the watch: what came before belongs to nothing.
    pub fn start(&mut self, board: &impl Board) {
        self.mark = board.cost();
    }

    /// Gives what passed since the last call to a stage.
    pub fn lap<B: Board>(&mut self, stage: Stage, board: &B) {
        let now = board.cost();
        let passed = B::units_from_ticks(now.wrapping_sub(self.mark));
        self.mark = now;
        let total = match stage {
            Stage::Receive => &mut self.now.receive,
            Stage::Rows => &mut self.now.rows,
            Stage::Corners => &mut self.now.corners,
            Stage::Filter => &mut self.now.filter,
            Stage::Answer => &mut self.now.answer,
        };
        *total = total.saturating_add(passed);
    }

    /// Ends a frame: its costs are the last frame's from now on.
    pub fn finish_frame<B: Board>(&mut self, board: &B) {
        let interrupts = board.interrupt_cost();
        self.now.interrupt = B::units_from_ticks(interrupts.wrapping_sub(self.interrupt_mark));
        self.interrupt_mark = interrupts;
        self.last = core::mem::take(&mut self.now);
    }

    /// What the last frame cost.
    pub fn last_frame(&self) -> Stages {
        self.last
    }
}

//! The engine's state on its way out and in.
use super::Dispatch;
use crate::{Board, Engine, engine::NotTaken};
use embedded_io::Write;
use monorange_protocol::message::*;

/// Bytes of a state in one message.
const STATE_CHUNK: usize = 960;

/// How far a state to be restored has come.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Restored {
    pub(super) next: u32,
    pub(super) total: u32,
    pub(super) checksum: u32,
}

impl<E: Engine> Dispatch<E> {
    pub(super) fn save(&mut self, port: &mut impl Write) {
        if let Some(unfinished) = self.picture.take() {
            // The state is put together in memory that the rows of a picture use.
            self.drop_picture(unfinished.begin.frame, port);
        }
        let frame = self.last_frame;
        let Self { engine, link, .. } = self;
        let state = engine.save();
        let total = state.len() as u32; // a few KiB
        let checksum = monorange_protocol::frame::checksum(state);
        for (number, bytes) in state.chunks(STATE_CHUNK).enumerate() {
            let offset = (number * STATE_CHUNK) as u32;
            link.send(&DeviceMessage::State(State { frame, offset, total, checksum, bytes }), port);
        }
    }

    pub(super) fn restore<B: Board>(&mut self, chunk: &State<'_>, port: &mut impl Write) {
        if !self.engine.is_configured() {
            return self.fault(Cause::NotConfigured, 0, port);
        }
        if let Some(unfinished) = self.picture.take() {
            self.drop_picture(unfinished.begin.frame, port);
        }
        if chunk.offset == 0 {
            self.restored = Restored { next: 0, total: chunk.total, checksum: chunk.checksum };
        }
        let Restored { next, total, checksum } = self.restored;
        let end = chunk.offset.saturating_add(u32::try_from(chunk.bytes.len()).unwrap_or(u32::MAX));
        let whole = total <= E::LIMITS.state_bytes && end <= total;
        let expected = chunk.offset == next && chunk.total == total && chunk.checksum == checksum && whole;
        let place = self.engine.staging().get_mut(chunk.offset as usize..end as usize);
        let Some(place) = place.filter(|_| expected && !chunk.bytes.is_empty()) else {
            self.restored = Restored::default();
            return self.fault(Cause::State, chunk.offset, port);
        };
        place.copy_from_slice(chunk.bytes);
        self.restored.next = end;
        if end < total {
            return;
        }
        self.restored = Restored::default();
        let whole = self.engine.staging().get(..total as usize).unwrap_or_default();
        let same = monorange_protocol::frame::checksum(whole) == checksum;
        match if same { self.engine.restore(total as usize) } else { Err(NotTaken::NoState) } {
            Ok(()) => {
                self.last_motion = None;
                self.last_frame = chunk.frame;
                self.introduce::<B>(port);
            }
            Err(NotTaken::NoState) => self.fault(Cause::State, total, port),
            Err(NotTaken::OtherConfiguration) => self.fault(Cause::State, OTHER_CONFIGURATION, port),
        }
    }
}

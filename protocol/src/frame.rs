//! Frames: `0x00 | COBS(version, kind, sequence, payload, CRC-32) | 0x00`.
//!
//! A zero comes before **and** after each frame. Noise between frames then costs nothing: the leading zero ends
//! whatever the noise began. (With a trailing zero only, noise eats the frame that follows it.) A receiver is in
//! step again with the first whole frame after any damage.
//!
//! | field | bytes | |
//! |---|---|---|
//! | version | 1 | [`VERSION`] |
//! | kind | 1 | the message's number |
//! | sequence | 2 | little-endian, one more with every frame sent, wraps |
//! | payload | 0 … 1024 | the message, in postcard's encoding |
//! | CRC-32 | 4 | little-endian, ISO-HDLC (as in Ethernet and zip), of everything before it |
//!
//! CRC-32 and not 16: of random damage on 1 KiB frames, 16 bits let 1.5e-5 through, 32 bits 2.3e-10.
use crate::{Error, VERSION};
use crc::{CRC_32_ISO_HDLC, Crc};
use postcard::ser_flavors::{Cobs, Flavor, Slice, crc::CrcModifier};
use serde::{Deserialize, Serialize};

/// Bytes of a message in one frame, at most.
pub const MAX_PAYLOAD: usize = 1024;
const HEADER: usize = 4;
const CHECKSUM: usize = 4;
const MAX_DECODED: usize = HEADER + MAX_PAYLOAD + CHECKSUM;
/// Bytes between the zeros of a frame, at most: COBS adds one byte to every 254, and one.
const MAX_PIECE: usize = MAX_DECODED + MAX_DECODED.div_ceil(254);
/// Bytes of a frame on the line, at most.
pub const MAX_ENCODED: usize = MAX_PIECE + 2;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The checksum of frames and of saved states.
pub fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// A frame that arrived whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// The message's number.
    pub kind: u8,
    /// The sender's count of frames, wrapping.
    pub sequence: u16,
    /// The message.
    pub payload: &'a [u8],
}

/// Writes one frame with `message` as its payload to `line` and returns the bytes written.
///
/// # Errors
/// [`Error::TooLong`] when the message does not fit [`MAX_PAYLOAD`], or `line` is too short.
pub fn encode<'a>(
    kind: u8,
    sequence: u16,
    message: &impl Serialize,
    line: &'a mut [u8],
) -> Result<&'a mut [u8], Error> {
    let end = line.len().min(MAX_ENCODED);
    let (first, rest) = line.get_mut(..end).and_then(<[u8]>::split_first_mut).ok_or(Error::TooLong)?;
    *first = 0;
    let whole = (VERSION, kind, sequence.to_le_bytes(), message);
    let cobs = Cobs::try_new(Slice::new(rest)).map_err(|_| Error::TooLong)?;
    let content = Content { length: 0, line: CrcModifier::new(cobs, CRC.digest()) };
    let written = postcard::serialize_with_flavor(&whole, content);
    let length = written.map_err(|_| Error::TooLong)?.len() + 1;
    line.get_mut(..length).ok_or(Error::TooLong)
}

/// Counts what goes into a frame: COBS adds less than the worst case to a payload with zeros in it, so that one above the limit may
/// fit the line. Its two functions stand in the program once, not once in every place that writes a field: which took 2 kB more.
struct Content<F> {
    length: usize,
    line: F,
}

impl<F: Flavor> Flavor for Content<F> {
    type Output = F::Output;

    #[inline(never)]
    fn try_extend(&mut self, data: &[u8]) -> postcard::Result<()> {
        self.length += data.len();
        self.line.try_extend(data)
    }

    #[inline(never)]
    fn try_push(&mut self, data: u8) -> postcard::Result<()> {
        self.length += 1;
        self.line.try_push(data)
    }

    fn finalize(self) -> postcard::Result<Self::Output> {
        match self.length <= HEADER + MAX_PAYLOAD {
            true => self.line.finalize(),
            false => Err(postcard::Error::SerializeBufferFull),
        }
    }
}

/// Why the bytes between two zeros were no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// They are not COBS: a byte was lost, doubled or became zero.
    Malformed,
    /// Shorter than an empty frame, or longer than [`MAX_ENCODED`].
    Length,
    /// The checksum is another one.
    Checksum,
    /// The frame is whole, but of another version of this protocol.
    Version(u8),
}

/// Finds frames in a stream of bytes, in 1 KiB of its own.
#[derive(Debug)]
pub struct Deframer {
    /// What came since the last zero, as it stood on the line.
    piece: [u8; MAX_PIECE],
    length: usize,
}

impl Default for Deframer {
    fn default() -> Self {
        Self::new()
    }
}

impl Deframer {
    /// A deframer between frames.
    pub const fn new() -> Self {
        Self { piece: [0; MAX_PIECE], length: 0 }
    }

    /// Takes the next byte of the line; returns a frame when this byte completes it, or why what it ends is none.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame<'_>, Damage>> {
        self.take(&mut core::slice::from_ref(&byte))
    }

    /// Takes bytes off the front of `line` up to the end of the next frame, or all of them; returns the frame, or why what ended
    /// is none.
    pub fn take(&mut self, line: &mut &[u8]) -> Option<Result<Frame<'_>, Damage>> {
        loop {
            let (piece, rest) = line.split_at_checked(zero(line)).unwrap_or((line, &[]));
            let (zero, rest) = rest.split_first().map_or((None, rest), |(zero, rest)| (Some(zero), rest));
            *line = rest;
            // Beyond the longest frame bytes are counted only, and the next zero tells.
            let end = self.length.saturating_add(piece.len());
            if let Some(place) = self.piece.get_mut(self.length..end) {
                place.copy_from_slice(piece);
            }
            self.length = end;
            zero?;
            if self.length > 0 {
                return Some(self.finish());
            }
        }
    }

    fn finish(&mut self) -> Result<Frame<'_>, Damage> {
        let length = core::mem::take(&mut self.length);
        let piece = self.piece.get_mut(..length).ok_or(Damage::Length)?;
        let whole = decode_in_place(piece).ok_or(Damage::Malformed)?;
        let (content, checksum) = whole.split_last_chunk::<CHECKSUM>().ok_or(Damage::Length)?;
        let (&[version, kind, low, high], payload) =
            content.split_first_chunk::<HEADER>().ok_or(Damage::Length)?;
        if CRC.checksum(content) != u32::from_le_bytes(*checksum) {
            return Err(Damage::Checksum);
        }
        if version != VERSION {
            return Err(Damage::Version(version));
        }
        Ok(Frame { kind, sequence: u16::from_le_bytes([low, high]), payload })
    }
}

/// Where the first zero is, or the length without one. Four bytes at a time: a byte is zero if subtracting 1 from it borrows and
/// its highest bit was not set.
fn zero(bytes: &[u8]) -> usize {
    const ONES: u32 = 0x0101_0101;
    let (words, _) = bytes.as_chunks::<4>();
    let has_zero = |word: &[u8; 4]| {
        let word = u32::from_le_bytes(*word);
        word.wrapping_sub(ONES) & !word & (ONES << 7) != 0
    };
    let start = 4 * words.iter().position(has_zero).unwrap_or(words.len());
    let rest = bytes.get(start..).unwrap_or_default();
    start + rest.iter().position(|byte| *byte == 0).unwrap_or(rest.len())
}

/// The bytes that COBS encoded as `piece`, which has no zeros; `None` when it ends within a block. Block by block, where
/// `cobs::decode_in_place` goes byte by byte: it was a quarter of what a picture costs to receive.
fn decode_in_place(piece: &mut [u8]) -> Option<&[u8]> {
    let (mut from, mut to) = (0, 0);
    while let Some(code) = piece.get(from).map(|code| usize::from(*code)) {
        let block = from + 1..from + code;
        from += code;
        if from > piece.len() {
            return None;
        }
        let length = block.len();
        piece.copy_within(block, to);
        to += length;
        if code < 0xff && from < piece.len() {
            *piece.get_mut(to)? = 0;
            to += 1;
        }
    }
    piece.get(..to)
}

/// What one end of the line has heard, since it started or was asked to forget.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkCounts {
    /// Frames accepted.
    pub frames: u32,
    /// Pieces between zeros that were not COBS.
    pub malformed: u32,
    /// Pieces too short or too long for a frame.
    pub length: u32,
    /// Frames whose checksum was wrong.
    pub checksum: u32,
    /// Frames of another protocol version.
    pub version: u32,
    /// Frames missing by their sequence numbers.
    pub lost: u32,
    /// Frames whose sequence number was the last one's again; they are not acted on.
    pub repeated: u32,
    /// Frames with a number that no message has.
    pub unknown: u32,
    /// Frames whose payload was no message of their number.
    pub payload: u32,
    /// Bytes that the receive buffer had no room for.
    pub overrun: u32,
}

impl LinkCounts {
    /// Nothing was heard.
    pub const ZERO: Self = Self {
        frames: 0,
        malformed: 0,
        length: 0,
        checksum: 0,
        version: 0,
        lost: 0,
        repeated: 0,
        unknown: 0,
        payload: 0,
        overrun: 0,
    };

    /// Counts damage.
    pub fn damage(&mut self, damage: Damage) {
        let count = match damage {
            Damage::Malformed => &mut self.malformed,
            Damage::Length => &mut self.length,
            Damage::Checksum => &mut self.checksum,
            Damage::Version(_) => &mut self.version,
        };
        *count = count.saturating_add(1);
    }

    /// Counts a message that could not be understood.
    pub fn misunderstood(&mut self, error: Error) {
        let count = match error {
            Error::UnknownKind(_) => &mut self.unknown,
            Error::TooLong | Error::Payload { .. } => &mut self.payload,
        };
        *count = count.saturating_add(1);
    }

    /// Counts a whole frame after the one numbered `last`; returns whether it is a new one.
    pub fn arrived(&mut self, last: Option<u16>, sequence: u16) -> bool {
        self.frames = self.frames.saturating_add(1);
        let Some(last) = last else { return true };
        match sequence.wrapping_sub(last) {
            0 => {
                self.repeated = self.repeated.saturating_add(1);
                false
            }
            // Half the circle and more is a sender that went back, which a restart does: nothing is known lost.
            ahead @ 1..=0x7fff => {
                self.lost = self.lost.saturating_add(u32::from(ahead) - 1);
                true
            }
            _ => true,
        }
    }

    /// Pieces of the line that were refused as damaged.
    pub fn corrupt(&self) -> u32 {
        [self.malformed, self.length, self.checksum].into_iter().fold(0, u32::saturating_add)
    }
}

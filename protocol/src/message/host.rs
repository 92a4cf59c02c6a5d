//! Host → device.
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Corners in one message, at most.
pub const MAX_CORNERS: usize = 48;

/// The first message of a host, and after a silence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// Any number; a host that restarted takes another. Comes back in [`Info`](super::Info).
    pub nonce: u32,
}

/// Camera, mount and settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Configure {
    /// The camera.
    pub camera: Camera,
    /// How it sits on the robot.
    pub mount: Mount,
    /// What the device sends without being asked.
    pub answers: Answers,
}

/// A pinhole camera with Brown–Conrady distortion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Pixels in a row.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// f_u, f_v in pixels.
    pub focal: [f32; 2],
    /// u₀, v₀ in pixels.
    pub principal: [f32; 2],
    /// Skew, a factor.
    pub skew: f32,
    /// k1, k2, p1, p2, k3.
    pub distortion: [f32; 5],
    /// Standard deviation of a corner's pixel, across and down.
    pub pixel_std: [f32; 2],
}

/// How the camera sits on the robot: m and rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mount {
    /// Height, tilt (down positive), roll, yaw, forward, left.
    pub parameters: [f32; 6],
    /// Their standard deviations.
    pub std: [f32; 6],
}

/// What the device sends without being asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answers {
    /// [`Observations`](super::Observations) of each frame: 0 or 1.
    pub observations: bool,
    /// A [`Map`](super::Map) with every so many frames; 0 for never.
    pub map_every: u16,
    /// [`Statistics`](super::Statistics) with every so many frames; 0 for never.
    pub statistics_every: u16,
}

/// The robot's motion: from `time_us` on, for `duration`, it moves with `speed` and `turn`.
///
/// Where a message is lost, the device notices the gap between the end of the last and `time_us` of this one, and
/// lets the last one's speed and turn hold through it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// When the motion begins.
    pub time_us: u64,
    /// How long it lasts, s.
    pub duration: f32,
    /// Forward, m/s.
    pub speed: f32,
    /// To the left, rad/s.
    pub turn: f32,
}

/// A picture begins.
///
/// Only the region of interest is sent. With `binning` 2 each pixel that is sent is the mean of 2 × 2 of the
/// camera's, and `width` and `height` count what is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameBegin {
    /// The frame's number, which its rows, its end and all answers carry.
    pub frame: u32,
    /// When it was taken.
    pub time_us: u64,
    /// The first column that is sent, in the camera's pixels.
    pub left: u16,
    /// The first row that is sent, in the camera's pixels.
    pub top: u16,
    /// Pixels in a row that is sent.
    pub width: u16,
    /// Rows that are sent.
    pub height: u16,
    /// 1, or 2 for 2 × 2 pixels of the camera in one.
    pub binning: u8,
}

/// Whole rows of a picture, the next ones from the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rows<'a> {
    /// The frame's number.
    pub frame: u32,
    /// The first of these rows, counted within what is sent.
    pub row: u16,
    /// One byte a pixel, row by row; a multiple of the frame's width.
    pub pixels: &'a [u8],
}

/// The picture is complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameEnd {
    /// The frame's number.
    pub frame: u32,
}

/// A picture's floor corners, found by the host: a frame in one message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Corners {
    /// The frame's number.
    pub frame: u32,
    /// When it was taken.
    pub time_us: u64,
    /// The corners.
    pub corners: Vec<Corner, MAX_CORNERS>,
}

/// A floor corner in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Corner {
    /// u, v.
    pub pixel: [f32; 2],
    /// var_u, cov_uv, var_v in px².
    pub covariance: [f32; 3],
}

/// What to forget.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reset {
    /// Pose and map; the configuration stays.
    State,
    /// Everything: the device restarts.
    Device,
}

/// Asks for the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SaveState {}

/// A chunk of the filter's state: bytes that only the same firmware understands.
///
/// A host sends them back as they came, in order. The device takes the state with the last chunk, if every chunk
/// came and its checksum holds; otherwise it keeps its own and answers with a [`Fault`](super::Fault).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct State<'a> {
    /// The frame after which it was taken; the same in all chunks of one state.
    pub frame: u32,
    /// Where the chunk begins.
    pub offset: u32,
    /// Bytes of the whole state.
    pub total: u32,
    /// CRC-32 of the whole state.
    pub checksum: u32,
    /// The chunk.
    pub bytes: &'a [u8],
}

/// Asks for the device's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimeSync {
    /// The host's clock when it was sent.
    pub host_us: u64,
}

/// Asks for something that is not sent with every frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ask {
    /// The map.
    Map,
    /// Counts and costs.
    Statistics,
}

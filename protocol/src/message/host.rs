//! Host → device.
use super::Settings;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Corners in one message, at most.
pub const MAX_CORNERS: usize = 32;

/// The first message of a host, and after a silence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// Any number; a host that restarted takes another. Comes back in [`Info`](super::Info).
    pub nonce: u32,
}

/// Camera, mount and settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Configure {
    /// The camera.
    pub camera: Camera,
    /// How it sits on the robot.
    pub mount: Mount,
    /// 1, or 2 when each pixel that will be sent is the mean of 2 × 2 of the camera's.
    pub binning: u8,
    /// What the device sends without being asked.
    pub answers: Answers,
    /// Everything else, where it is not as by default.
    pub settings: Settings,
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
}

/// How the camera sits on the robot: m and rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mount {
    /// Height, tilt (down positive), roll, yaw, forward, left.
    pub parameters: [f32; 6],
    /// Standard deviations of height, tilt, roll, yaw.
    pub std: [f32; 4],
}

/// What the device sends without being asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answers {
    /// [`Observations`](super::Observations) of each frame: 0 or 1.
    pub observations: bool,
    /// Frames from one [`Map`](super::Map) to the next; 0 for never.
    pub map_every: u16,
    /// Frames from one [`Statistics`](super::Statistics) to the next; 0 for never.
    pub statistics_every: u16,
}

/// The robot's motion up to `until_us`, over `duration`.
///
/// Where a message is lost, the device notices the gap between the end of the last and the beginning of this one, and
/// lets the last one's velocity hold through it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// When the motion ends.
    pub until_us: u64,
    /// How long it lasts, s.
    pub duration: f32,
    /// The motion.
    pub motion: Motion,
}

/// How the robot leans when the next picture is taken, or its corners are seen, as an IMU tells it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attitude {
    /// About the robot's y axis, nose down is positive, rad.
    pub pitch: f32,
    /// About its x axis, left side up is positive, rad.
    pub roll: f32,
    /// Standard deviation of each, rad.
    pub std: f32,
}

/// A motion as odometry tells it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Motion {
    /// A velocity that held.
    Velocity {
        /// Forward, m/s.
        speed: f32,
        /// To the left, rad/s.
        turn: f32,
    },
    /// A displacement in the robot's frame at the beginning.
    Increment {
        /// m.
        forward: f32,
        /// m.
        left: f32,
        /// rad.
        turn: f32,
    },
}

/// A picture begins.
///
/// Only a region of interest needs to be sent: `left` … `height` count pixels as they are sent, after binning. The
/// rest of the picture is taken to be as its border, where there are no edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameBegin {
    /// The frame's number, which its rows, its end and all answers carry.
    pub frame: u32,
    /// When it was taken.
    pub time_us: u64,
    /// The first column that is sent.
    pub left: u16,
    /// The first row that is sent.
    pub top: u16,
    /// Pixels in a row that is sent.
    pub width: u16,
    /// Rows that are sent.
    pub height: u16,
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
    /// Whether the vertical edge is brighter on its right, and the floor edge below.
    pub brighter: [bool; 2],
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

/// How the device answers from now on, until the host says [`Hello`] or the device restarts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Text {
    /// In frames.
    #[default]
    Frames,
    /// In lines of text, and in nothing else.
    Lines,
    /// In frames, with the lines between them; a hello does not end this.
    Both,
}

/// Pixels and boxes in one message, at most.
pub const MAX_SPOTS: usize = 32;

/// Asks how far things are that stand on the floor, by the mount as estimated so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Any number; it comes back.
    pub request: u32,
    /// Standard deviation of the pixels, px; 0 for that of the setting `association.corner_std_floor_px`.
    pub std_px: f32,
    /// The things.
    pub spots: Vec<Spot, MAX_SPOTS>,
}

/// Where a thing meets the floor, in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Spot {
    /// u, v.
    Pixel([f32; 2]),
    /// left, top, right, bottom, as object detectors give them: the foot is the middle of the lower edge.
    Box([f32; 4]),
}

impl Spot {
    /// The pixel that meets the floor.
    pub fn foot(&self) -> [f32; 2] {
        match *self {
            Self::Pixel(pixel) => pixel,
            Self::Box([left, _, right, bottom]) => [0.5 * (left + right), bottom],
        }
    }
}

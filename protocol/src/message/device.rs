//! Device → host.
use super::{Later, MAX_SPOTS};
use crate::frame::LinkCounts;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Observations in one message, at most.
pub const MAX_OBSERVATIONS: usize = 24;
/// Landmarks in one message, at most.
pub const MAX_LANDMARKS: usize = 18;

/// Who the device is and what it can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Info<'a> {
    /// The nonce of the hello that this answers, or 0.
    pub nonce: u32,
    /// The firmware's version: major, minor, patch.
    pub firmware: [u8; 3],
    /// The board's name.
    pub board: &'a str,
    /// The run in its upper four bits, the resets of that run in its lower four, each wrapping: another number than before means
    /// that pose and map are new. A configuration, which a host knows of, does not change it.
    pub reset_count: u8,
    /// Whether it has been configured since it started.
    pub configured: bool,
    /// The largest picture.
    pub max_width: u16,
    /// The largest picture.
    pub max_height: u16,
    /// Landmarks that fit the filter.
    pub max_landmarks: u16,
    /// Corners of a picture that are followed.
    pub max_corners: u16,
    /// Bytes that may be in flight.
    pub window: u16,
    /// Bytes of a saved state.
    pub state_bytes: u32,
    /// What made pose and map new, each told apart.
    pub restarts: Later<Restarts>,
}

/// Counts of what makes pose and map new, wrapping.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restarts {
    /// Runs since power came, this one included.
    pub runs: u8,
    /// Configurations accepted in this run.
    pub configurations: u8,
    /// Resets of pose and map in this run.
    pub resets: u8,
}

/// What became of a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Decision {
    /// It corrected the map and the pose.
    Update,
    /// It became a landmark.
    Birth,
    /// It disagrees with the landmark that it was matched with.
    Gated,
    /// It is watched, and may become a landmark.
    Tentative,
    /// It is not on the floor, out of range, or nothing could be made of it.
    Rejected,
}

/// A floor corner and what became of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// u, v.
    pub pixel: [f32; 2],
    /// Range in m.
    pub range: f32,
    /// Bearing in rad, positive to the left.
    pub bearing: f32,
    /// var_range, cov_range_bearing, var_bearing.
    pub covariance: [f32; 3],
    /// The landmark that it belongs to.
    pub landmark: Option<u32>,
    /// What became of it.
    pub decision: Decision,
    /// Normalised innovation squared, where there was an innovation.
    pub nis: Option<f32>,
}

/// Some of a frame's observations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observations {
    /// The frame's number.
    pub frame: u32,
    /// The number of the first of these.
    pub first: u16,
    /// Observations of the frame in all its messages.
    pub total: u16,
    /// The observations.
    pub observations: Vec<Observation, MAX_OBSERVATIONS>,
}

/// Where the robot is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// The frame's number.
    pub frame: u32,
    /// When it was taken.
    pub time_us: u64,
    /// Position in m.
    pub position: [f32; 2],
    /// Heading in rad.
    pub heading: f32,
    /// var_x, cov_xy, cov_xh, var_y, cov_yh, var_h.
    pub covariance: [f32; 6],
    /// As in [`Info`]: another number than before means that pose and map are new.
    pub reset_count: u8,
    /// The picture was incomplete: the pose is predicted only.
    pub predicted_only: bool,
    /// Landmarks in the map.
    pub landmarks: u16,
}

/// A landmark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Landmark {
    /// Its number, never used again.
    pub id: u32,
    /// Position in m.
    pub position: [f32; 2],
    /// var_x, cov_xy, var_y.
    pub covariance: [f32; 3],
    /// Frames in which it was seen.
    pub seen: u32,
    /// Seen often enough to be believed.
    pub confirmed: bool,
    /// When it was first seen.
    pub first_us: u64,
    /// When it was last seen.
    pub last_us: u64,
}

/// Some of the map's landmarks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Map {
    /// The frame's number.
    pub frame: u32,
    /// The number of the first of these.
    pub first: u16,
    /// Landmarks of the map in all its messages.
    pub total: u16,
    /// The landmarks.
    pub landmarks: Vec<Landmark, MAX_LANDMARKS>,
}

/// What [`Stages`] counts in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CostUnit {
    /// Nothing is counted.
    None,
    /// Instructions (an emulator that executes a fixed number a tick).
    Instructions,
    /// Clock cycles.
    Cycles,
}

/// The cost of a frame, stage by stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stages {
    /// The serial interrupt: bytes of the line to the receive buffer.
    pub interrupt: u32,
    /// Bytes of the receive buffer to frames, and frames to messages.
    pub receive: u32,
    /// Rows to edges, and edges to votes.
    pub rows: u32,
    /// Votes to lines, and lines to corners.
    pub corners: u32,
    /// Motion, matching, filter and map upkeep.
    pub filter: u32,
    /// Answers to bytes of the line.
    pub answer: u32,
}

/// Counts and costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Statistics {
    /// The number of the last frame.
    pub frame: u32,
    /// Pictures that were processed.
    pub frames_done: u32,
    /// Pictures given up: rows were missing, or the next one began.
    pub frames_dropped: u32,
    /// Rows that belonged to no picture, or were not the next ones.
    pub rows_refused: u32,
    /// Answers that the line did not take in time.
    pub unsent: u32,
    /// What the line did.
    pub link: LinkCounts,
    /// What `stages` counts.
    pub unit: CostUnit,
    /// The last frame's cost.
    pub stages: Stages,
    /// The deepest the stack has been, in bytes; 0 where it is not measured.
    pub stack_used: u32,
    /// Bytes that the stack can take.
    pub stack_size: u32,
    /// Microseconds since the device started.
    pub uptime_us: u64,
}

/// How much may be sent: see [`Window`](crate::window::Window).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Credit {
    /// The sequence number of the last frame that was taken off the line.
    pub sequence: u16,
    /// Bytes that may be on their way after that frame.
    pub granted: u16,
}

/// Why something was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Cause {
    /// A frame of another protocol version came; `detail` is the version that this device speaks.
    Version,
    /// This needs a configuration first; `detail` is the frame's or the request's number, or 0.
    NotConfigured,
    /// The configuration is out of range; an [`Info`] with the one that stays follows. `detail` is the number of the setting, or of
    /// the field with [`FIELD`] added.
    Configuration,
    /// The picture is larger than the device or the camera; `detail` is the frame's number.
    PictureSize,
    /// The picture was incomplete and given up; `detail` is the frame's number.
    FrameDropped,
    /// The state is not taken. `detail` is the offset of a chunk that does not follow the one before, the total where the whole
    /// has another checksum or is no state, and [`OTHER_CONFIGURATION`] where it is one of another configuration.
    State,
    /// Odometry that is not used; `detail` is 0 for a number that is not finite or a negative duration, 1 where it ends before
    /// the time that the device has reached, 2 for an attitude beyond 0.8 rad.
    Odometry,
    /// A whole frame came whose payload is no message of its kind; `detail` is the kind.
    NotUnderstood,
}

/// Added to the number of a field of [`Configure`](super::Configure) that is refused: those of settings are below.
pub const FIELD: u32 = 0x100;
/// The detail of a [`Cause::State`] for a state that was saved under another configuration.
pub const OTHER_CONFIGURATION: u32 = u32::MAX;

/// Something was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// Why.
    pub cause: Cause,
    /// Depends on the cause.
    pub detail: u32,
}

/// Why the device restarted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RestartCause {
    /// The program found itself in an impossible state.
    Panic,
    /// The processor refused an instruction or an access; a stack overflow is one.
    HardFault,
    /// The main loop did not come round in time.
    Watchdog,
}

/// What ended the run before this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastPanic<'a> {
    /// Why it ended.
    pub cause: RestartCause,
    /// Where and what, in words, cut to fit.
    pub text: &'a str,
}

/// The device's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// The host's clock, from the message that this answers.
    pub host_us: u64,
    /// Microseconds since the device started.
    pub device_us: u64,
}

/// Whether a pixel sees the floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sight {
    /// It does.
    Floor,
    /// It looks at or above the horizon.
    AboveHorizon,
    /// It is not in the picture.
    OutsideImage,
    /// The lens model is not one to one there.
    OutsideLensModel,
}

/// The floor point that a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ranged {
    /// u, v; of a box its foot.
    pub pixel: [f32; 2],
    /// Whether the rest are numbers: they are NaN otherwise.
    pub sight: Sight,
    /// Range in m, from the robot's origin.
    pub range: f32,
    /// Bearing in rad, positive to the left.
    pub bearing: f32,
    /// var_range, cov_range_bearing, var_bearing: of the pixel and of the mount as far as it is known.
    pub covariance: [f32; 3],
}

/// Answers a [`Range`](super::Range), in its order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ranges {
    /// The request's number.
    pub request: u32,
    /// The floor points.
    pub ranges: Vec<Ranged, MAX_SPOTS>,
}

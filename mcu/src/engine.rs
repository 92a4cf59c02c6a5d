//! What the device runs, as the device sees it.
use crate::meter::Stage;
use monorange_protocol::message::{
    Attitude, Configure, Corners, FrameBegin, Landmark, Observation, Odometry, Ranged, Spot,
};

/// What fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Pixels in a row.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// Landmarks of the map.
    pub landmarks: u16,
    /// Corners of a picture.
    pub corners: u16,
    /// Bytes of a state.
    pub state_bytes: u32,
}

/// Where the robot is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Position in m.
    pub position: [f32; 2],
    /// Heading in rad.
    pub heading: f32,
    /// var_x, cov_xy, cov_xh, var_y, cov_yh, var_h.
    pub covariance: [f32; 6],
}

/// Something that takes motion and pictures, row by row, and knows where it is.
///
/// The device calls in this order: `configure`; then `odometry` any number of times and for each picture either `begin`,
/// `row` …, `end` or `abandon`, or `corners`. Rows are those announced by `begin`, all of them, from top to bottom,
/// unless the picture is abandoned.
pub trait Engine {
    /// What fits.
    const LIMITS: Limits;

    /// Takes a configuration and forgets pose and map.
    ///
    /// # Errors
    /// The value at fault; the configuration before stays.
    fn configure(&mut self, configuration: &Configure) -> Result<(), monorange_core::Error>;

    /// Whether it has a configuration.
    fn is_configured(&self) -> bool;

    /// Forgets pose and map.
    fn reset(&mut self);

    /// The robot moves.
    ///
    /// # Errors
    /// A number that is not finite, or time that runs backwards; nothing moves then.
    fn odometry(&mut self, odometry: &Odometry) -> Result<(), monorange_core::Error>;

    /// The robot leans so when the next picture is taken.
    ///
    /// # Errors
    /// An angle that is not finite, or one that no robot leans by; nothing changes then.
    fn attitude(&mut self, attitude: &Attitude) -> Result<(), monorange_core::Error>;

    /// A picture begins.
    ///
    /// # Errors
    /// It does not fit the camera.
    fn begin(&mut self, picture: &FrameBegin) -> Result<(), monorange_core::Error>;

    /// The next row.
    fn row(&mut self, pixels: &[u8]);

    /// The picture is complete: finds its corners and updates the map. `lap` is told which stage just ended.
    fn end(&mut self, lap: impl FnMut(Stage));

    /// The picture is given up, or never came; motion still counts.
    fn abandon(&mut self);

    /// A picture's corners, found elsewhere.
    fn corners(&mut self, corners: &Corners);

    /// Where the robot is.
    fn estimate(&self) -> Estimate;

    /// What became of the last frame's corners; none after a picture that was given up.
    fn observations(&self) -> impl ExactSizeIterator<Item = Observation>;

    /// The map.
    fn landmarks(&self) -> impl ExactSizeIterator<Item = Landmark>;

    /// The state as bytes. Never called within a picture.
    fn save(&mut self) -> &[u8];

    /// Memory in which a state to be restored is put together, before the next picture. Never called within one.
    fn staging(&mut self) -> &mut [u8];

    /// Takes the first `length` bytes of [`staging`](Self::staging) as the state.
    ///
    /// # Errors
    /// Why it is not taken; the state before stays.
    fn restore(&mut self, length: usize) -> Result<(), NotTaken>;

    /// How far what meets the floor there is; `std_px` as in [`Range`](monorange_protocol::message::Range). `None` before
    /// the configuration.
    fn range(&self, spot: &Spot, std_px: f32) -> Option<Ranged>;
}

/// Why a state was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotTaken {
    /// It is no state of this engine.
    NoState,
    /// It was saved under another configuration.
    OtherConfiguration,
}

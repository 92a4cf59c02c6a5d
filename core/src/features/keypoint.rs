use nalgebra::Vector2;

/// A point that can be found again in another picture of the same place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Keypoint {
    /// Where, with (0, 0) at the centre of the top-left pixel.
    pub pixel: Vector2<f32>,
    /// Variance of each coordinate of `pixel`, px², as found on pairs of pictures with a known homography.
    pub var_px2: f32,
    /// The standard deviation of the Gaussian it was found at, in pixels (1 for a FAST corner).
    pub scale: f32,
    /// Its direction in radians within (−π, π], from the picture's +u towards +v.
    pub angle: f32,
    /// How distinct it is: for SIFT the contrast of its blob in parts of the grey range, for FAST the
    /// largest threshold in grey levels that it passes.
    pub response: f32,
}

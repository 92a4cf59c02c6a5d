//! How far a pixel's floor point is.
use super::sent_from_camera;
use crate::message::{Ranged, Sight, Spot};
use monorange_core::geometry::NoFloor;
use monorange_core::pipeline::{Pipeline, Storage};
use nalgebra::Matrix2;

impl From<NoFloor> for Sight {
    fn from(reason: NoFloor) -> Self {
        match reason {
            NoFloor::AboveHorizon => Self::AboveHorizon,
            NoFloor::OutsideImage => Self::OutsideImage,
            NoFloor::OutsideLensModel => Self::OutsideLensModel,
        }
    }
}

/// Range and bearing of what meets the floor in a pixel of the camera, by the mount as a pipeline knows it so far:
///
/// ```text
/// Σ = J_p Σ_p J_pᵀ + J_m P_m J_mᵀ
/// ```
///
/// | symbol | |
/// |---|---|
/// | J_p, Σ_p | (range, bearing) by the pixel, and its covariance: `std_px`² in both directions, or the setting `association.corner_std_floor_px` where that is 0 |
/// | J_m, P_m | (range, bearing) by the mount's height, tilt, roll and yaw, and the filter's covariance of them; nothing where the mount is taken as exact |
pub fn range_of_spot<S: Storage>(pipeline: &Pipeline<S>, spot: &Spot, std_px: f32, binning: u8) -> Ranged {
    let pixel = spot.foot();
    let nothing = |sight| {
        let nan = f32::NAN;
        Ranged { pixel, sight, range: nan, bearing: nan, covariance: [nan; 3] }
    };
    let sent = pixel.map(|at| sent_from_camera(at, binning));
    let sighting = match pipeline.finder().sight(sent.into()) {
        Ok(sighting) => sighting,
        Err(reason) => return nothing(reason.into()),
    };
    let std = if std_px > 0.0 { std_px / f32::from(binning) } else { pipeline.config().corner_std_floor_px };
    let mut covariance = sighting.noise(&(Matrix2::identity() * (std * std)));
    if let Some(mount) = pipeline.filter().mount_error_covariance() {
        let by_mount = sighting.by_mount.fixed_columns::<4>(0);
        covariance += by_mount * mount * by_mount.transpose();
    }
    let covariance = [covariance.m11, covariance.m12, covariance.m22];
    Ranged { pixel, sight: Sight::Floor, range: sighting.range, bearing: sighting.bearing, covariance }
}

//! A camera on its mount, as JavaScript sees it.
use crate::{outline, sentence, tape};
use monorange_core::Result;
use monorange_core::geometry::{self, NoFloor};
use monorange_wasm_rig::{JsRig, Rig};
use nalgebra::{Matrix2, Vector2};
use wasm_bindgen::prelude::*;

/// Why a pixel has no range.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It has one.
    Ok = 0,
    /// The pixel looks at or above the horizon.
    AboveHorizon = 1,
    /// The pixel is not in the picture.
    OutsideImage = 2,
    /// The lens model has no inverse there.
    OutsideLensModel = 3,
}

/// What a pixel of the floor measures; all zero unless `status` is `Ok`.
#[wasm_bindgen]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Whether there is a measurement, and why not.
    pub status: Status,
    /// Range from the robot's origin in metres.
    pub range: f32,
    /// Bearing in radians, positive to the left.
    pub bearing: f32,
    /// Standard deviation of the range in metres: the pixel's noise and the mount's uncertainty together.
    pub range_std: f32,
    /// Standard deviation of the bearing in radians.
    pub bearing_std: f32,
    /// Ahead of the robot in metres.
    pub x: f32,
    /// To the left of the robot in metres.
    pub y: f32,
}

/// One calibrated camera on its mount as a range finder.
#[wasm_bindgen]
#[derive(Clone, Debug)]
pub struct RangeFinder {
    finder: geometry::RangeFinder<f32>,
    pixel_covariance: Matrix2<f32>,
    mount_std: [f32; 6],
}

#[wasm_bindgen]
impl RangeFinder {
    /// The range finder of a rig.
    ///
    /// # Errors
    /// A sentence that names the entry at fault.
    #[wasm_bindgen(constructor)]
    pub fn of_rig(rig: &JsRig) -> core::result::Result<RangeFinder, JsError> {
        Rig::read(rig).and_then(|rig| Self::new(&rig)).map_err(sentence)
    }

    /// What the pixel (u, v) measures; (0, 0) is the centre of the top-left pixel.
    pub fn sight(&self, u: f32, v: f32) -> Sighting {
        match self.finder.sight(Vector2::new(u, v)) {
            Ok(seen) => {
                let covariance = seen.noise(&self.pixel_covariance) + seen.systematic(&self.mount_std);
                Sighting {
                    status: Status::Ok,
                    range: seen.range,
                    bearing: seen.bearing,
                    range_std: libm::sqrtf(covariance.m11),
                    bearing_std: libm::sqrtf(covariance.m22),
                    x: seen.point_in_robot.x,
                    y: seen.point_in_robot.y,
                }
            }
            Err(reason) => Sighting { status: reason.into(), ..NOTHING },
        }
    }

    /// The distance on the floor between two pixels and its standard deviation in metres, or nothing where one
    /// of them does not see the floor.
    pub fn tape(&self, u0: f32, v0: f32, u1: f32, v1: f32) -> Option<Box<[f32]>> {
        let ends = [Vector2::new(u0, v0), Vector2::new(u1, v1)];
        let [from, to] = ends.map(|pixel| self.finder.sight(pixel).ok());
        let (distance, std) = tape::measure(&from?, &to?, &self.pixel_covariance, &self.mount_std);
        Some(Box::new([distance, std]))
    }

    /// The pixel (u, v) that sees the floor point (x ahead, y left), or nothing behind the camera or beyond the
    /// lens model; it may lie outside the picture.
    pub fn project(&self, x: f32, y: f32) -> Option<Box<[f32]>> {
        let pixel = self.finder.pixel_from_floor_unbounded(Vector2::new(x, y)).ok()?;
        Some(Box::new([pixel.x, pixel.y]))
    }

    /// The horizon as rows u, v of a polyline.
    pub fn horizon(&self) -> Box<[f32]> {
        outline::horizon(&self.finder).into()
    }

    /// The floor grid as rows u, v, range; each line ends with a row NaN, NaN, label: its distance ahead for a line
    /// across, NaN for a line along.
    pub fn grid(&self, spacing: f32, reach: f32) -> Box<[f32]> {
        outline::grid(&self.finder, spacing, reach).into()
    }

    /// The part of the floor that the picture shows, up to `reach` metres, as rows x, y in the robot's frame.
    pub fn footprint(&self, reach: f32) -> Box<[f32]> {
        outline::footprint(&self.finder, reach).into()
    }
}

const NOTHING: Sighting = Sighting {
    status: Status::Ok,
    range: 0.0,
    bearing: 0.0,
    range_std: 0.0,
    bearing_std: 0.0,
    x: 0.0,
    y: 0.0,
};

impl RangeFinder {
    /// As the constructor, for Rust.
    ///
    /// # Errors
    /// As [`geometry::RangeFinder::cast`].
    pub fn new(rig: &Rig) -> Result<Self> {
        let [std_u, std_v] = rig.pixel_std.map(|std| std as f32);
        Ok(Self {
            finder: rig.finder.cast()?,
            pixel_covariance: Matrix2::new(std_u * std_u, 0.0, 0.0, std_v * std_v),
            mount_std: rig.mount_std.map(|std| std as f32),
        })
    }
}

impl From<NoFloor> for Status {
    fn from(reason: NoFloor) -> Self {
        match reason {
            NoFloor::AboveHorizon => Self::AboveHorizon,
            NoFloor::OutsideImage => Self::OutsideImage,
            NoFloor::OutsideLensModel => Self::OutsideLensModel,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorange_core::geometry::{Camera, Mount};

    fn level_rig() -> RangeFinder {
        let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        let finder = geometry::RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
        let mount_std = [0.005, 0.005, 0.0, 0.0, 0.0, 0.0];
        RangeFinder::new(&Rig { finder, pixel_std: [0.1; 2], mount_std, settings: Vec::new() }).unwrap()
    }

    #[test]
    fn the_optical_axis_meets_the_floor_at_height_over_tan_tilt() {
        let seen = level_rig().sight(160.0, 120.0);
        assert!((seen.range - 0.4 / 0.2_f32.tan()).abs() < 1e-5, "{seen:?}");
        assert!(seen.range_std > 0.005 / 0.2_f32.tan(), "{seen:?}");
        assert_eq!(level_rig().sight(160.0, 0.0).status, Status::AboveHorizon);
    }

    #[test]
    fn the_horizon_separates_pixels_with_and_without_a_range() {
        let rig = level_rig();
        let line = rig.horizon();
        assert!(line.len() >= 4);
        for vertex in line.chunks_exact(2).filter(|vertex| (0.0..319.0).contains(&vertex[0])) {
            assert_eq!(rig.sight(vertex[0], vertex[1] + 0.5).status, Status::Ok);
            assert_eq!(rig.sight(vertex[0], vertex[1] - 0.5).status, Status::AboveHorizon);
        }
    }

    #[test]
    fn grid_vertices_lie_on_whole_metres() {
        let rig = level_rig();
        let vertices = rig.grid(1.0, 10.0);
        let mut inside = 0;
        for vertex in vertices.chunks_exact(3).filter(|vertex| !vertex[0].is_nan()) {
            let seen = rig.sight(vertex[0], vertex[1]);
            if seen.status != Status::Ok {
                continue;
            }
            inside += 1;
            assert!((seen.range - vertex[2]).abs() < 1e-3 * seen.range, "{seen:?} {vertex:?}");
            let off = |value: f32| (value - value.round()).abs();
            assert!(off(seen.x).min(off(seen.y)) < 2e-3 * seen.range, "{seen:?}");
        }
        assert!(inside > 50, "{inside}");
    }
}

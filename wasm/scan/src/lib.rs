//! The virtual scan in the page's worker: pictures in, beams out, by [`monorange_core::scan`].
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use monorange_core::geometry::Pose;
use monorange_core::image::Grey;
use monorange_core::scan::{Reading, ScanConfig, Scanner};
use monorange_core::{Error, Result};
use monorange_wasm_record::Beam;
use monorange_wasm_rig::{JsRig, Rig};
use nalgebra::Matrix2;
use wasm_bindgen::prelude::*;

/// The scan of a run's pictures, one after another.
#[wasm_bindgen]
pub struct Scan {
    scanner: Box<Scanner>,
    size: [usize; 2],
}

fn sentence(error: Error) -> JsError {
    JsError::new(&error.to_string())
}

#[wasm_bindgen]
impl Scan {
    /// For the pictures of a rig.
    ///
    /// # Errors
    /// A sentence, where the camera sees no floor, or its pictures are too wide.
    #[wasm_bindgen(constructor)]
    pub fn of_rig(rig: &JsRig) -> core::result::Result<Scan, JsError> {
        Rig::read(rig).and_then(|rig| Self::new(&rig)).map_err(sentence)
    }

    /// Scans a grey picture: rows with the columns of `BeamColumn`, from right to left. `moved` is the robot's motion since the picture
    /// before (forward, left, turn), nothing where it is not known.
    ///
    /// # Errors
    /// A sentence, where the picture has another size than the rig's.
    pub fn look(
        &mut self,
        pixels: &[u8],
        moved: Option<Vec<f32>>,
    ) -> core::result::Result<Vec<f32>, JsError> {
        let moved = moved.as_deref().and_then(pose_of);
        self.readings(pixels, moved.as_ref()).map(rows).map_err(sentence)
    }
}

impl Scan {
    /// As the constructor, for Rust; the same scanner as the command line's for the rig.
    ///
    /// # Errors
    /// As [`Scanner::new`].
    pub fn new(rig: &Rig) -> Result<Self> {
        let [std_u, std_v] = rig.pixel_std.map(|std| (std * std) as f32);
        let mount_std = rig.mount_std.map(|std| std as f32);
        let pixel_covariance = Matrix2::new(std_u, 0.0, 0.0, std_v);
        let finder = rig.finder.cast()?;
        let camera = rig.finder.camera();
        let size = [camera.width(), camera.height()];
        let scanner =
            Scanner::new(ScanConfig::default(), finder, mount_std, pixel_covariance).map(Box::new)?;
        Ok(Self { scanner, size })
    }

    fn readings(&mut self, pixels: &[u8], moved: Option<&Pose<f32>>) -> Result<&[Reading]> {
        let [width, height] = self.size;
        self.scanner.follow(moved);
        self.scanner.scan(Grey::new(pixels, width, height)?)
    }
}

fn pose_of(numbers: &[f32]) -> Option<Pose<f32>> {
    let [x, y, heading] = *numbers else { return None };
    Some(Pose { x, y, heading })
}

fn rows(readings: &[Reading]) -> Vec<f32> {
    let mut rows = Vec::with_capacity(readings.len() * Beam::WIDTH);
    readings.iter().for_each(|reading| Beam::from_reading(reading).push(&mut rows));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorange_core::geometry::{Camera, Mount, RangeFinder};
    use monorange_wasm_record::BeamKind;

    /// A wall ahead: dark floor below v = 150, a lighter wall above, with a little texture on the floor.
    fn picture() -> Vec<u8> {
        let grey = |k: usize| if k / 320 > 150 { 60 + (k * 7 % 5) as u8 } else { 170 };
        (0..320 * 240).map(grey).collect()
    }

    #[test]
    fn a_wall_ahead_is_a_boundary_at_its_foot() {
        let camera = Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
        let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
        let rig = Rig { finder, pixel_std: [0.1; 2], mount_std: [0.0; 6], settings: Vec::new() };
        let mut scan = Scan::new(&rig).unwrap();
        let foot = rig.finder.sight(nalgebra::Vector2::new(160.0, 150.5)).unwrap().range as f32;
        let rows = rows(scan.readings(&picture(), None).unwrap());
        let ahead = rows
            .chunks_exact(Beam::WIDTH)
            .filter_map(Beam::of)
            .min_by(|a, b| a.bearing.abs().total_cmp(&b.bearing.abs()));
        let ahead = ahead.unwrap();
        assert_eq!(ahead.kind, BeamKind::Boundary as u32 as f32);
        assert!(
            (ahead.range - foot).abs() < 0.1 * foot && ahead.free < foot && ahead.free > 0.5 * foot,
            "{ahead:?} {foot}"
        );
        assert!(ahead.range_std > 0.0 && ahead.range_std < 0.2 * foot, "{ahead:?}");
        assert!(scan.readings(&[0; 7], None).is_err());
        // Bearing and range begin under the lens, wherever on the robot that is.
        let ahead_of_the_axle = Mount::new([0.4, 0.2, 0.0, 0.0, 0.3, 0.1]).unwrap();
        let rig = Rig { finder: RangeFinder::new(camera, ahead_of_the_axle), ..rig };
        let moved = self::rows(Scan::new(&rig).unwrap().readings(&picture(), None).unwrap());
        assert!(moved == rows, "a lever arm changes no reading");
    }
}

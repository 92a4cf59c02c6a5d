//! Camera and mount as a JavaScript object with named entries.
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use monorange_core::geometry::{Camera, Lens, Mount, RangeFinder};
use monorange_core::{Error, Result};
use wasm_bindgen::prelude::*;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"
/** How a camera sits: metres and radians. */
export interface Mount {
  height: number;
  tilt: number;
  roll: number;
  yaw: number;
  forward: number;
  left: number;
}

/** Camera and mount, with the names of a rig file; angles in radians. */
export interface RigInput {
  width: number;
  height: number;
  focal: [number, number];
  principal: [number, number];
  skew: number;
  /** Equidistant: a fisheye's; polynomial: of Brown and Conrady, or the rational one. */
  lens: 'polynomial' | 'equidistant';
  /** The lens's coefficients: 4, 5 or 8 of them. */
  distortion: number[];
  /** Of a corner's pixel, in u and v. */
  pixelStd: [number, number];
  mount: Mount;
  mountStd: Mount;
  /** The pipeline's settings: a `Configure` message of the co-processor's protocol, or nothing for a host's default ones. */
  settings: ArrayLike<number>;
}

/** A rig, and where it came from. */
export interface Rig extends RigInput {
  /** The mount's deviations that the rig file leaves out: those of one that was measured by hand. */
  assumedStd: Partial<Mount>;
  /** Those of them that differ from the default ones, as sections of a rig file. */
  settingsToml: string;
  /** Nobody has calibrated this camera: focal length, centre and lens are supposed. */
  guessed: boolean;
  /** How wrong the focal length of a camera may be that nobody has calibrated: one standard deviation, as a share of it. */
  focalStd: number;
  /** Nobody has measured how the camera sits. */
  mountGuessed: boolean;
  /** The file it came from, for messages. */
  source: string;
}
"#;

#[wasm_bindgen]
extern "C" {
    /// A camera and how it sits, from JavaScript.
    #[wasm_bindgen(typescript_type = "RigInput")]
    #[derive(Clone, Debug)]
    pub type JsRig;
    #[wasm_bindgen(method, getter)]
    fn width(this: &JsRig) -> f64;
    #[wasm_bindgen(method, getter)]
    fn height(this: &JsRig) -> f64;
    #[wasm_bindgen(method, getter)]
    fn focal(this: &JsRig) -> Vec<f64>;
    #[wasm_bindgen(method, getter)]
    fn principal(this: &JsRig) -> Vec<f64>;
    #[wasm_bindgen(method, getter)]
    fn skew(this: &JsRig) -> f64;
    #[wasm_bindgen(method, getter)]
    fn lens(this: &JsRig) -> String;
    #[wasm_bindgen(method, getter)]
    fn distortion(this: &JsRig) -> Vec<f64>;
    #[wasm_bindgen(method, getter, js_name = pixelStd)]
    fn pixel_std(this: &JsRig) -> Vec<f64>;
    #[wasm_bindgen(method, getter)]
    fn mount(this: &JsRig) -> JsMount;
    #[wasm_bindgen(method, getter, js_name = mountStd)]
    fn mount_std(this: &JsRig) -> JsMount;
    #[wasm_bindgen(method, getter)]
    fn settings(this: &JsRig) -> Vec<u8>;

    /// A `Mount` of the page.
    #[wasm_bindgen(typescript_type = "Mount")]
    pub type JsMount;
    #[wasm_bindgen(method, getter, js_name = height)]
    fn mount_height(this: &JsMount) -> f64;
    #[wasm_bindgen(method, getter)]
    fn tilt(this: &JsMount) -> f64;
    #[wasm_bindgen(method, getter)]
    fn roll(this: &JsMount) -> f64;
    #[wasm_bindgen(method, getter)]
    fn yaw(this: &JsMount) -> f64;
    #[wasm_bindgen(method, getter)]
    fn forward(this: &JsMount) -> f64;
    #[wasm_bindgen(method, getter)]
    fn left(this: &JsMount) -> f64;
}

/// A rig in the core's terms.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Camera and mount.
    pub finder: RangeFinder<f64>,
    /// Standard deviations of a corner's pixel in u and v.
    pub pixel_std: [f64; 2],
    /// Standard deviations of the mount, in the order of [`Mount::parameters`].
    pub mount_std: [f64; 6],
    /// A `Configure` message, or nothing.
    pub settings: Vec<u8>,
}

fn array<const N: usize>(name: &'static str, values: &[f64]) -> Result<[f64; N]> {
    values.try_into().map_err(|_| Error::Size { name, got: values.len(), expected: N })
}

impl JsMount {
    fn parameters(&self) -> [f64; 6] {
        [self.mount_height(), self.tilt(), self.roll(), self.yaw(), self.forward(), self.left()]
    }
}

impl Rig {
    /// The rig in the page's object.
    ///
    /// # Errors
    /// [`Error`], every variant, with the name of the entry at fault.
    pub fn read(rig: &JsRig) -> Result<Self> {
        let coefficients = rig.distortion();
        let lens = match rig.lens().as_str() {
            "equidistant" => Lens::Equidistant(array("distortion", &coefficients)?),
            _ => Lens::from_polynomial(&coefficients).ok_or(Error::Size {
                name: "distortion",
                got: coefficients.len(),
                expected: 5,
            })?,
        };
        let camera = Camera::with_lens(
            rig.width() as usize,
            rig.height() as usize,
            array("focal", &rig.focal())?,
            array("principal", &rig.principal())?,
            rig.skew(),
            lens,
        )?;
        Ok(Self {
            finder: RangeFinder::new(camera, Mount::new(rig.mount().parameters())?),
            pixel_std: array("pixelStd", &rig.pixel_std())?,
            mount_std: rig.mount_std().parameters(),
            settings: rig.settings(),
        })
    }
}

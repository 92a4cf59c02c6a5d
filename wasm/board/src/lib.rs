//! A printed chessboard in the page's worker: pictures in, the camera and the mount out, by [`monorange_formats::board`].
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use monorange_core::image::Grey;
use monorange_formats::board::{Board, Calibrated, Outcome, Shot, calibrate};
use wasm_bindgen::prelude::*;

/// Pictures of a board, one after another, and what they tell.
#[wasm_bindgen]
pub struct BoardPictures {
    board: Board,
    shots: Vec<Shot>,
    calibrated: Option<Calibrated>,
}

#[wasm_bindgen]
impl BoardPictures {
    /// Of a board with this many inner corners and squares of `square` metres.
    ///
    /// # Errors
    /// A sentence, where such a board cannot be meant.
    #[wasm_bindgen(constructor)]
    pub fn new(columns: usize, rows: usize, square: f64) -> Result<BoardPictures, JsError> {
        let board = Board::new(columns, rows, square).map_err(sentence)?;
        Ok(Self { board, shots: Vec::new(), calibrated: None })
    }

    /// Looks for the board in a picture: red, green, blue, alpha, row by row. Gives rows u, v of its corners, none where it is not there.
    pub fn add(&mut self, name: &str, width: usize, height: usize, rgba: &[u8]) -> Vec<f64> {
        let pixels: Vec<u8> = rgba.chunks_exact(4).map(luma).collect();
        let shot = match Grey::new(&pixels, width, height) {
            Ok(grey) => Shot::of(&self.board, name, &grey),
            Err(_) => return self.refuse(name, "has no pixels"),
        };
        let corners = shot.corners.as_deref().unwrap_or_default();
        let rows = corners.iter().flat_map(|point| [point.pixel.x, point.pixel.y]).collect();
        self.shots.push(shot);
        rows
    }

    /// Puts down a picture that could not be read, and why, as the end of a sentence about it.
    pub fn refuse(&mut self, name: &str, reason: &str) -> Vec<f64> {
        self.shots.push(Shot { name: name.to_owned(), size: [0, 0], corners: Err(reason.to_owned()) });
        Vec::new()
    }

    /// Why picture `index` shows no board, as the end of a sentence about it; empty where it shows one.
    pub fn reason(&self, index: usize) -> String {
        self.shots.get(index).and_then(|shot| shot.corners.as_ref().err()).cloned().unwrap_or_default()
    }

    /// The camera that took the pictures.
    ///
    /// # Errors
    /// A sentence with what to do, where they do not tell it.
    pub fn calibrate(&mut self) -> Result<BoardCamera, JsError> {
        let calibrated = calibrate(&self.board, &self.shots).map_err(sentence)?;
        let camera = BoardCamera::of(&calibrated);
        self.calibrated = Some(calibrated);
        Ok(camera)
    }

    /// Height (m), tilt, roll, yaw (rad) and their standard deviations, from picture `index`, in which the board lies on the floor. The yaw
    /// is told where `along`: a side of the board points straight ahead of the robot; its deviation is 0 else.
    ///
    /// # Errors
    /// A sentence, where the picture tells no mount.
    pub fn mount(&self, index: usize, along: bool) -> Result<Vec<f64>, JsError> {
        let calibrated =
            self.calibrated.as_ref().ok_or_else(|| JsError::new("Calibrate the camera first."))?;
        let told = calibrated.mount(&self.shots, index, along).map_err(sentence)?;
        Ok(told.mount.parameters().into_iter().take(4).chain(told.std).collect())
    }
}

/// A camera that a board told.
#[wasm_bindgen(getter_with_clone)]
#[derive(Clone)]
pub struct BoardCamera {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Of u and v, px.
    pub focal: Vec<f64>,
    /// (u₀, v₀), px.
    pub principal: Vec<f64>,
    /// k₁ k₂ p₁ p₂ k₃.
    pub distortion: Vec<f64>,
    /// Of a corner in u and v, px.
    pub pixel_std: Vec<f64>,
    /// Standard deviations of the focal lengths and the centre, px.
    pub std: Vec<f64>,
    /// Root mean square distance of the corners from where the camera sees them, px.
    pub rms: f64,
    /// The same of each picture; 0 of those left out.
    pub picture_rms: Vec<f64>,
    /// Why each picture was left out, as the end of a sentence about it; empty where it was used.
    pub reasons: Vec<String>,
    /// What to be careful about.
    pub warnings: Vec<String>,
}

impl BoardCamera {
    fn of(calibrated: &Calibrated) -> Self {
        let fit = &calibrated.fit;
        let reason = |outcome: &Outcome| match outcome {
            Outcome::Used(_) => String::new(),
            Outcome::LeftOut(reason) => reason.clone(),
        };
        let rms = |outcome: &Outcome| match outcome {
            Outcome::Used(view) => view.rms,
            Outcome::LeftOut(_) => 0.0,
        };
        Self {
            width: fit.camera.width(),
            height: fit.camera.height(),
            focal: fit.camera.focal().as_slice().to_vec(),
            principal: fit.camera.principal().as_slice().to_vec(),
            distortion: fit.camera.lens().coefficients().to_vec(),
            pixel_std: fit.pixel_std.to_vec(),
            std: fit.std.iter().take(4).copied().collect(),
            rms: fit.rms,
            picture_rms: calibrated.outcomes.iter().map(rms).collect(),
            reasons: calibrated.outcomes.iter().map(reason).collect(),
            warnings: calibrated.warnings.clone(),
        }
    }
}

/// Rec. 709 luma in whole numbers, as the host reads coloured pictures.
fn luma(pixel: &[u8]) -> u8 {
    let [red, green, blue, ..] = *pixel else { return 0 };
    ((2126 * u32::from(red) + 7152 * u32::from(green) + 722 * u32::from(blue)) / 10_000) as u8
}

/// A sentence of its own, with what to do in another.
fn sentence(error: monorange_formats::Error) -> JsError {
    let text = error.to_string().replace("\n  help: ", ". To mend it, ");
    let mut letters = text.chars();
    let first = letters.next().map(char::to_uppercase);
    JsError::new(&(first.into_iter().flatten().collect::<String>() + letters.as_str() + "."))
}

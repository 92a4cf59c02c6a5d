//! A camera from what pictures of a board showed, and what became of each picture.
use super::Board;
use crate::{Error, Result};
use monorange_core::calibration::board::{
    BoardPoint, BoardView, CameraFit, FloorMount, fit_camera, mount_on_floor,
};
use monorange_core::image::Grey;
use nalgebra::Vector2;

/// What a picture showed.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Its file's name.
    pub name: String,
    /// Pixels in a row, rows.
    pub size: [usize; 2],
    /// The board's corners, or why there are none, as the end of a sentence about the picture.
    pub corners: std::result::Result<Vec<BoardPoint>, String>,
}

impl Shot {
    /// What the grey picture `name` shows of the board.
    pub fn of(board: &Board, name: &str, grey: &Grey<'_>) -> Self {
        Self { name: name.to_owned(), size: [grey.width(), grey.height()], corners: board.corners(grey) }
    }
}

/// What became of a picture.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// It was used.
    Used(Box<BoardView>),
    /// It was left out; why, as the end of a sentence about it.
    LeftOut(String),
}

/// A camera, with what became of each picture, in their order.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// The camera and how well it is known; its views are those of the pictures used.
    pub fit: CameraFit,
    /// A picture each.
    pub outcomes: Vec<Outcome>,
    /// What to be careful about, a sentence each.
    pub warnings: Vec<String>,
}

/// Boards that are needed: each tells two of the camera's four numbers, and one alone cannot be checked.
const LEAST: usize = 3;
/// A camera is refused when its focal length or centre is known worse than to this share of the focal length, and warned of
/// beyond a quarter of it (judgement: 2 % of the focal length are 2 % of every range).
const WORST: f64 = 0.02;
/// A picture is left out when its corners are off by more than this many times the middle picture's (judgement) …
const OFF: f64 = 4.0;
/// … and by more than this, px: what is good needs no second look.
const GOOD_PX: f64 = 0.3;

/// The camera that took the pictures.
///
/// # Errors
/// When fewer than three pictures can be used, or they do not determine a camera: a sentence with what to do.
pub fn calibrate(board: &Board, pictures: &[Shot]) -> Result<Calibrated> {
    let size = most_frequent(pictures);
    let mut left_out: Vec<Option<String>> = pictures
        .iter()
        .map(|picture| match (&picture.corners, size) {
            (Err(reason), _) => Some(reason.clone()),
            (Ok(_), Some([width, height])) if picture.size != [width, height] => {
                let [w, h] = picture.size;
                Some(format!("is {w}×{h}, and most are {width}×{height}"))
            }
            _ => None,
        })
        .collect();
    let [width, height] = size.ok_or_else(|| too_few(pictures, &left_out))?;
    loop {
        let views: Vec<_> = pictures
            .iter()
            .zip(&left_out)
            .filter_map(|(picture, left)| picture.corners.as_deref().ok().filter(|_| left.is_none()))
            .collect();
        if views.len() < LEAST {
            return Err(too_few(pictures, &left_out));
        }
        let fit = fit_camera(width, height, &views).map_err(|_| undetermined())?;
        check(&fit)?;
        let worst = worst(&fit);
        let mut used = fit.views.iter().enumerate();
        let mut outcomes = Vec::new();
        let mut dropped = false;
        for reason in &mut left_out {
            if reason.is_none()
                && let Some((index, view)) = used.next()
            {
                if worst == Some(index) && fit.views.len() > LEAST {
                    *reason = Some(format!(
                        "has corners that are off by {:.2} px, the others fit better",
                        view.rms
                    ));
                    dropped = true;
                } else {
                    outcomes.push(Outcome::Used(Box::new(*view)));
                    continue;
                }
            }
            outcomes.push(Outcome::LeftOut(reason.clone().unwrap_or_default()));
        }
        if !dropped {
            let warnings = warnings(board, &fit);
            return Ok(Calibrated { fit, outcomes, warnings });
        }
    }
}

impl Calibrated {
    /// The mount, from picture `index` in which the board lies on the floor; `along`: a side of it points straight ahead of the robot.
    ///
    /// # Errors
    /// When the picture was left out, or the board does not lie under the camera.
    pub fn mount(&self, pictures: &[Shot], index: usize, along: bool) -> Result<FloorMount> {
        let (Some(picture), Some(outcome)) = (pictures.get(index), self.outcomes.get(index)) else {
            return Err(Error::new("there is no such picture"));
        };
        let view = match outcome {
            Outcome::Used(view) => view,
            Outcome::LeftOut(reason) => {
                return Err(Error::new(format!("tells no mount: it {reason}"))
                    .at(&picture.name)
                    .help("take another picture of the board on the floor"));
            }
        };
        let points = picture.corners.as_deref().unwrap_or_default().iter().map(|point| point.on_board);
        let first = points.clone().next().unwrap_or_default();
        let (least, greatest) =
            points.fold((first, first), |(least, greatest): (Vector2<f64>, Vector2<f64>), point| {
                (least.inf(&point), greatest.sup(&point))
            });
        mount_on_floor(view, [least, greatest], along).map_err(|error| Error::new(error).at(&picture.name))
    }

    /// Pictures used.
    pub fn used(&self) -> usize {
        self.fit.views.len()
    }
}

fn most_frequent(pictures: &[Shot]) -> Option<[usize; 2]> {
    let sizes = pictures.iter().filter(|picture| picture.corners.is_ok()).map(|picture| picture.size);
    sizes.clone().max_by_key(|size| sizes.clone().filter(|other| other == size).count())
}

/// The picture that is off by far more than the others.
fn worst(fit: &CameraFit) -> Option<usize> {
    let mut all: Vec<_> = fit.views.iter().map(|view| view.rms).collect();
    all.sort_by(f64::total_cmp);
    let middle = all.get(all.len() / 2)?;
    let (index, view) = fit.views.iter().enumerate().max_by(|a, b| a.1.rms.total_cmp(&b.1.rms))?;
    (view.rms > (OFF * middle).max(GOOD_PX)).then_some(index)
}

fn too_few(pictures: &[Shot], left_out: &[Option<String>]) -> Error {
    let used = left_out.iter().filter(|reason| reason.is_none()).count();
    let reasons =
        pictures.iter().zip(left_out).filter_map(|(picture, reason)| Some((&picture.name, reason.as_ref()?)));
    let said: Vec<_> = reasons.take(3).map(|(name, reason)| format!("{name} {reason}")).collect();
    let said = if said.is_empty() { String::new() } else { format!(" ({})", said.join("; ")) };
    let all = pictures.len();
    let cause = format!("{used} of {all} pictures can be used, and {LEAST} are needed{said}");
    Error::new(cause).help("take ten or more, with the whole board in them, flat, sharp and tilted each time in another direction")
}

fn undetermined() -> Error {
    Error::new("the pictures do not tell the camera: the board was held the same way in all of them")
        .help("tilt the board by 20° to 45° to the camera, each time in another direction, and show it in every part of the picture")
}

/// The standard deviation of focal length or centre that is worst, as a share of the focal length.
fn doubt(fit: &CameraFit) -> f64 {
    let focal = fit.camera.focal();
    let shares = fit.std.iter().zip([focal.x, focal.y, focal.x, focal.y]).map(|(std, focal)| std / focal);
    shares.fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
}

fn check(fit: &CameraFit) -> Result<()> {
    if doubt(fit) <= WORST { Ok(()) } else { Err(undetermined()) }
}

fn warnings(board: &Board, fit: &CameraFit) -> Vec<String> {
    let mut warnings = Vec::new();
    let doubt = doubt(fit);
    if doubt > WORST / 4.0 {
        warnings.push(format!(
            "Focal length and centre are known to {:.1} % only: add pictures with the board tilted in other directions.",
            100.0 * doubt
        ));
    }
    if fit.rms > 1.0 {
        warnings.push(format!(
            "The corners are off by {:.2} px: is the board flat, are the pictures sharp, is the board's pattern {board}?",
            fit.rms
        ));
    }
    warnings
}

//! `calibrate`: the camera, and the mount, from pictures of a printed chessboard.
use crate::outputs::{not_an_input, to_file_or_stdout};
use clap::Args;
use monorange_core::calibration::board::FloorMount;
use monorange_core::geometry::{MOUNT_STD_BY_HAND, Mount, RangeFinder};
use monorange_formats::{
    Error, Result,
    board::{Board, Calibrated, Outcome, Shot, calibrate},
    files::Rig,
    pictures::Picture,
};
use serde_json::json;
use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

/// The camera from pictures of a printed chessboard, and how it sits on the robot where the board lies on the floor.
///
/// Take ten or more pictures of a flat board, sharp, tilted each time by 20° to 45° in another direction, in every part of the picture. A
/// picture without the board is named and left out. Gives focal lengths, centre and lens (plumb_bob) with standard deviations, and for each
/// picture how far its corners are off; with --floor height, tilt and roll too.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange calibrate --board 9x6 --square 0.025 left*.jpg --floor left12.jpg --out rig.toml")]
pub struct Arguments {
    /// Pictures of the board.
    #[arg(required = true, value_name = "PICTURE")]
    pictures: Vec<PathBuf>,
    /// Inner corners, where four squares meet: a board of 10 × 7 squares has 9x6.
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = sides)]
    board: [usize; 2],
    /// Side of a square as measured on the print, m.
    #[arg(long, value_name = "M")]
    square: f64,
    /// The one of the pictures in which the board lies on the floor.
    #[arg(long, value_name = "PICTURE")]
    floor: Option<PathBuf>,
    /// A side of the board on the floor points straight ahead of the robot: the yaw is told too.
    #[arg(long, requires = "floor")]
    along: bool,
    /// Write a rig file; without --floor it lacks the mount.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

fn sides(text: &str) -> std::result::Result<[usize; 2], String> {
    let sides =
        text.split_once(['x', '×']).and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
    sides.ok_or_else(|| "give inner corners across and down, as in 9x6".to_owned())
}

/// Runs the command.
///
/// # Errors
/// When fewer than three pictures show the board, they do not tell a camera, or a file cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let [columns, rows] = arguments.board;
    let board = Board::new(columns, rows, arguments.square)?;
    let floor = arguments.floor.as_deref().map(|floor| place_of(&arguments.pictures, floor)).transpose()?;
    let shots: Vec<_> = arguments.pictures.iter().map(|path| shot(&board, path)).collect();
    arguments.out.as_deref().map(not_an_input).transpose()?;
    let calibrated = calibrate(&board, &shots)?;
    for warning in &calibrated.warnings {
        eprintln!("warning: {warning}");
    }
    let told = floor.map(|index| calibrated.mount(&shots, index, arguments.along)).transpose()?;
    if let Some(out) = &arguments.out {
        let text = rig_text(&calibrated, told.as_ref())?;
        to_file_or_stdout(Some(out), |to| to.write_all(text.as_bytes()))?;
    }
    let text = match arguments.json {
        true => {
            serde_json::to_string_pretty(&as_json(&calibrated, &shots, told.as_ref())).map_err(Error::new)?
                + "\n"
        }
        false => in_words(&calibrated, &shots, told.as_ref()),
    };
    to_file_or_stdout(None, |to| to.write_all(text.as_bytes()))
}

fn place_of(pictures: &[PathBuf], floor: &Path) -> Result<usize> {
    pictures.iter().position(|path| path == floor).ok_or_else(|| {
        Error::new("is not one of the pictures")
            .at(floor)
            .help("name it among them too: it also tells the camera")
    })
}

fn shot(board: &Board, path: &Path) -> Shot {
    let name = path.display().to_string();
    let read = Picture::read(path);
    crate::warnings::say();
    match read.and_then(|picture| Ok(Shot::of(board, &name, &picture.grey()?))) {
        Ok(shot) => shot,
        Err(error) => {
            let (words, place) = (error.in_one_line(), format!("{name}: "));
            let words = words.strip_prefix(&place).unwrap_or(&words);
            Shot { corners: Err(format!("cannot be used: {words}")), name, size: [0, 0] }
        }
    }
}

/// A rig file; without a mount its camera alone.
fn rig_text(calibrated: &Calibrated, told: Option<&FloorMount>) -> Result<String> {
    let fit = &calibrated.fit;
    let mut std = MOUNT_STD_BY_HAND;
    for (std, told) in
        std.iter_mut().zip(told.map_or([0.0; 4], |told| told.std)).filter(|(_, told)| *told > 0.0)
    {
        *std = told;
    }
    let mount = match told {
        Some(told) => told.mount,
        None => Mount::new([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).map_err(Error::new)?,
    };
    let mut bytes = Vec::new();
    let rig = Rig::new(RangeFinder::new(fit.camera, mount), fit.pixel_std, std)?;
    rig.write(&mut bytes).map_err(Error::new)?;
    let text = String::from_utf8_lossy(&bytes).into_owned();
    Ok(match (told, text.split_once("[mount]")) {
        (None, Some((camera, _))) => {
            format!(
                "{camera}# Say how the camera sits on the robot:\n# [mount]\n# height = 0.4     # m\n# tilt_deg = 12.0  # downwards\n"
            )
        }
        _ => text,
    })
}

fn in_words(calibrated: &Calibrated, shots: &[Shot], told: Option<&FloorMount>) -> String {
    let fit = &calibrated.fit;
    let (focal, principal, std) = (fit.camera.focal(), fit.camera.principal(), fit.std);
    let mut text = format!(
        "focal       {:.2} ± {:.2}, {:.2} ± {:.2} px\nprincipal   {:.2} ± {:.2}, {:.2} ± {:.2} px\ndistortion  {:.5?}\n",
        focal.x,
        std[0],
        focal.y,
        std[1],
        principal.x,
        std[2],
        principal.y,
        std[3],
        fit.camera.lens().coefficients(),
    );
    let (used, all) = (calibrated.used(), shots.len());
    let _ = writeln!(text, "The corners of {used} of {all} pictures are off by {:.3} px rms.", fit.rms);
    for (shot, outcome) in shots.iter().zip(&calibrated.outcomes) {
        let _ = match outcome {
            Outcome::Used(view) => {
                let count = shot.corners.as_ref().map_or(0, Vec::len);
                writeln!(text, "  {}: {count} corners, off by {:.2} px", shot.name, view.rms)
            }
            Outcome::LeftOut(reason) => writeln!(text, "  {}: left out: it {reason}", shot.name),
        };
    }
    if let Some(FloorMount { mount, std }) = told {
        let [height, tilt, roll, yaw, ..] = mount.parameters();
        let _ = writeln!(text, "height      {height:.4} ± {:.4} m", std[0]);
        for (name, angle, std) in [("tilt", tilt, std[1]), ("roll", roll, std[2]), ("yaw", yaw, std[3])] {
            if std > 0.0 {
                let _ = writeln!(text, "{name:<11} {:.3} ± {:.3}°", angle.to_degrees(), std.to_degrees());
            }
        }
    }
    text
}

fn as_json(calibrated: &Calibrated, shots: &[Shot], told: Option<&FloorMount>) -> serde_json::Value {
    let fit = &calibrated.fit;
    let pictures = shots.iter().zip(&calibrated.outcomes).map(|(shot, outcome)| match outcome {
        Outcome::Used(view) => json!({ "name": shot.name, "rms_px": view.rms }),
        Outcome::LeftOut(reason) => json!({ "name": shot.name, "left_out": reason }),
    });
    let mount = told.map(|FloorMount { mount, std }| {
        let [height, tilt, roll, yaw, ..] = mount.parameters();
        json!({
            "height": height, "tilt_deg": tilt.to_degrees(), "roll_deg": roll.to_degrees(), "yaw_deg": yaw.to_degrees(),
            "height_std": std[0], "tilt_std_deg": std[1].to_degrees(), "roll_std_deg": std[2].to_degrees(), "yaw_std_deg": std[3].to_degrees(),
        })
    });
    json!({
        "width": fit.camera.width(), "height": fit.camera.height(),
        "focal": fit.camera.focal().as_slice(), "principal": fit.camera.principal().as_slice(),
        "distortion": fit.camera.lens().coefficients().as_slice(), "std": fit.std, "pixel_std": fit.pixel_std, "rms_px": fit.rms,
        "pictures": pictures.collect::<Vec<_>>(), "mount": mount, "warnings": calibrated.warnings,
    })
}

//! Which lens a camera file tells of: the one place where its words and coefficients become a model.
use super::entries::Entries;
use crate::{Error, Result};
use monorange_core::geometry::Lens;
use serde_json::Value;

/// Entries that name a model.
const MODELS: [&str; 12] = [
    "distortion_model",
    "camera_model",
    "model",
    "model_type",
    "type",
    "camera_type",
    "lens_model",
    "projection_model",
    "distortion_type",
    "cam_model",
    "fisheye_model",
    "is_fisheye",
];

/// What the coefficients mean.
#[derive(Clone, Copy, PartialEq)]
enum Model {
    /// k₁ k₂ p₁ p₂ k₃ k₄ k₅ k₆, as many of them as are given.
    Polynomial,
    /// k₁ k₂ k₃ k₄ of the angle off the axis.
    Equidistant,
    /// None are needed.
    None,
    /// Said of the camera, not of the lens.
    Pinhole,
}

/// The lens that the file names and gives coefficients of, under one of the names `coefficients` or each by itself.
pub(super) fn lens(entries: &Entries<'_>, coefficients: &[&'static str]) -> Result<Lens<f64>> {
    let model = model(entries)?;
    let list = match entries.numbers(coefficients)? {
        Some(list) => Some(list),
        None => match entries.get(&["distortion_parameters"]).and_then(Value::as_object) {
            Some(nested) => {
                let nested = Entries::new(nested, "");
                let list = singly(&nested, model)?;
                nested.finish()?;
                list
            }
            None => singly(entries, model)?,
        },
    };
    match (list.as_deref(), model) {
        (None | Some([]), Model::None) => Ok(Lens::default()),
        (None | Some([]), _) => {
            Err(Error::new("`distortion_coefficients` is missing: a lens without them is not read as none")
                .help("write `distortion_coefficients: [0, 0, 0, 0, 0]` if the pictures are undistorted"))
        }
        (Some(&[k1, k2, k3, k4]), Model::Equidistant) => Ok(Lens::Equidistant([k1, k2, k3, k4])),
        (Some(list), Model::Equidistant) => {
            Err(wrong_count(list, "4", "give k1 k2 k3 k4 of the fisheye calibration"))
        }
        (Some(list), _) => polynomial(list),
    }
}

fn model(entries: &Entries<'_>) -> Result<Model> {
    let mut model = None;
    for (entry, word) in entries.words(&MODELS) {
        let plain: String = word.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
        let this = match plain.as_str() {
            "0" | "false" | "pinhole" | "perspective" | "standard" => Model::Pinhole,
            "plumbbob"
            | "radtan"
            | "radialtangential"
            | "rationalpolynomial"
            | "brownconrady"
            | "brown"
            | "opencv"
            | "pinholeradtan"
            | "modifiedbrownconrady" => Model::Polynomial,
            "" | "none" | "null" | "rectified" | "nodistortion" | "undistorted" => Model::None,
            "equidistant" | "equi" | "fisheye" | "kannalabrandt" | "kannalabrandt4" | "kannalabrandt8"
            | "opencvfisheye" => Model::Equidistant,
            "1" | "true" if entry.contains("fisheye") => Model::Equidistant,
            _ => return Err(other_model(entry, &word)),
        };
        model = match (model, this) {
            (None | Some(Model::Pinhole), this) | (Some(this), Model::Pinhole) => Some(this),
            (Some(before), this) if before == this => Some(this),
            (Some(Model::Polynomial), Model::Equidistant) if entry.contains("fisheye") => Some(this),
            (Some(_), _) => {
                let cause = format!("`{entry}` says `{word}`, another entry names another lens model");
                return Err(Error::new(cause).help("keep the one that the calibration was made with"));
            }
        };
    }
    for entry in ["xi", "mirror_parameters", "fov", "omega"] {
        let zero = entries.number(&[entry]).is_ok_and(|number| number == Some(0.0));
        if entries.has(&[entry]) && !zero {
            return Err(other_model(entry, "of another lens"));
        }
    }
    Ok(model.unwrap_or(Model::Polynomial))
}

/// The coefficients under names of their own.
fn singly(entries: &Entries<'_>, model: Model) -> Result<Option<Vec<f64>>> {
    let names: &[[&'static str; 2]] = match model {
        Model::Equidistant => &[["k1", "k_1"], ["k2", "k_2"], ["k3", "k_3"], ["k4", "k_4"]],
        _ => &[
            ["k1", "k_1"],
            ["k2", "k_2"],
            ["p1", "p_1"],
            ["p2", "p_2"],
            ["k3", "k_3"],
            ["k4", "k_4"],
            ["k5", "k_5"],
            ["k6", "k_6"],
        ],
    };
    let values = names.iter().map(|names| entries.number(names)).collect::<Result<Vec<_>>>()?;
    let Some(last) = values.iter().rposition(Option::is_some) else { return Ok(None) };
    // Two of a polynomial are k₁ k₂ without tangential terms. Any other gap is a name that was not understood.
    let least = if last < 2 && model != Model::Equidistant { 2 } else { 4 };
    let named = values.iter().zip(names).take(least.max(last + 1));
    if let Some((_, [name, _])) = { named }.find(|(value, _)| value.is_none()) {
        let error = Error::new(format!("the lens's coefficient `{name}` is missing, others are there"));
        return Err(error.help(format!("write `{name}: 0` if it was not calibrated")));
    }
    Ok(Some(values.into_iter().map(|value| value.unwrap_or(0.0)).collect()))
}

fn polynomial(list: &[f64]) -> Result<Lens<f64>> {
    if list.len() < 4 {
        let help = "give k1 k2 p1 p2, and zeros for those that were not calibrated";
        return Err(wrong_count(list, "4, 5 or 8", help));
    }
    // Thin prism (12) and tilted (14) models are read where they do nothing.
    let used = list.iter().rposition(|k| *k != 0.0).map_or(0, |last| last + 1);
    let length = match used {
        0..=5 => 5,
        6..=8 => 8,
        _ => {
            let help = "calibrate without the thin prism and tilted models";
            return Err(wrong_count(list, "at most 8 that are not 0", help));
        }
    };
    let mut padded = list.to_vec();
    padded.resize(length, 0.0);
    Ok(Lens::from_polynomial(&padded).unwrap_or_default())
}

fn wrong_count(list: &[f64], expected: &str, help: &str) -> Error {
    Error::new(format!("the lens model has {} coefficients, must have {expected}", list.len())).help(help)
}

fn other_model(entry: &str, word: &str) -> Error {
    let cause = format!(
        "the camera model `{word}` is not supported (entry `{entry}`), only pinhole with plumb_bob (radtan), \
         rational_polynomial or equidistant (fisheye) is"
    );
    Error::new(cause)
        .help("calibrate with one of these models, or undistort the pictures and give their camera matrix")
}

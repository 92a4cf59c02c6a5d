//! Camera files of other programs: ROS camera_info, OpenCV's FileStorage (YAML, XML), Kalibr's camchain.
//!
//! All three become one tree of values, and differ only in the names of their entries. Kalibr and ROS put pixel
//! (0, 0) at the centre of the top-left pixel as we do, and so does OpenCV: nothing is shifted.
use crate::{Error, Result};
use monorange_core::geometry::Lens;
use serde_json::{Map, Value};
use std::path::Path;

/// A pinhole camera's numbers, not yet checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Intrinsics {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// (f_u, f_v), px.
    pub focal: [f64; 2],
    /// (u₀, v₀), px.
    pub principal: [f64; 2],
    /// Factor of y' in u.
    pub skew: f64,
    /// The lens model.
    pub lens: Lens<f64>,
}

/// The camera in a ROS camera_info, OpenCV or Kalibr file; of several cameras in a Kalibr camchain, the first.
///
/// # Errors
/// Names the file, the entry, and what is wrong: missing, not numbers, or a lens model that is not known.
pub fn read_camera_info(path: &Path) -> Result<Intrinsics> {
    let text = super::read_text(path)?;
    let tree = if text.trim_start().starts_with('<') { from_xml(&text) } else { from_yaml(&text) };
    tree.and_then(|tree| intrinsics(&tree)).map_err(|error| error.at(path))
}

fn from_yaml(text: &str) -> Result<Map<String, Value>> {
    // OpenCV writes `%YAML:1.0`, which is not YAML, and tags that say no more than the entries do.
    let text = text.trim_start();
    let body = if text.starts_with('%') { text.split_once('\n').map_or("", |(_, body)| body) } else { text };
    let body = body.replace("!!opencv-matrix", "").replace("!!opencv-nd-matrix", "");
    let help = "give a camera file of ROS (camera_info), OpenCV or Kalibr";
    match serde_saphyr::from_str(&body) {
        Ok(Value::Object(tree)) => Ok(tree),
        Ok(_) => Err(Error::new("is not a camera file: it has no named entries").help(help)),
        Err(error) => {
            let first_line = error.to_string().lines().next().unwrap_or_default().to_owned();
            Err(Error::new(format!("is not YAML: {first_line}")).help(help))
        }
    }
}

fn from_xml(text: &str) -> Result<Map<String, Value>> {
    let document = roxmltree::Document::parse(text).map_err(|error| {
        Error::new(format!("is not XML: {error}")).help("give a camera file that OpenCV wrote")
    })?;
    Ok(entries(document.root_element()))
}

fn entries(node: roxmltree::Node<'_, '_>) -> Map<String, Value> {
    let value = |child: roxmltree::Node<'_, '_>| {
        if child.children().any(|grandchild| grandchild.is_element()) {
            return Value::Object(entries(child));
        }
        let words: Vec<_> = child.text().unwrap_or_default().split_whitespace().collect();
        let scalar = |word: &&str| word.parse::<f64>().map_or(Value::from(*word), Value::from);
        match words.as_slice() {
            [word] => scalar(word),
            words => words.iter().map(scalar).collect(),
        }
    };
    node.children()
        .filter(|child| child.is_element())
        .map(|child| (child.tag_name().name().to_owned(), value(child)))
        .collect()
}

fn intrinsics(tree: &Map<String, Value>) -> Result<Intrinsics> {
    let first_camera = tree
        .iter()
        .find_map(|(name, entry)| entry.as_object().filter(|_| name.starts_with("cam") && name.len() == 4));
    if let Some(camera) = first_camera {
        return kalibr(camera);
    }
    let matrix = numbers(tree, &["camera_matrix", "k", "m1"])?.ok_or_else(|| missing("camera_matrix"))?;
    let &[fu, shear, u0, _, fv, v0, ..] = matrix.as_slice() else {
        let cause = format!("`camera_matrix` has {} numbers, must have 9", matrix.len());
        return Err(Error::new(cause).help("write the 3×3 matrix row by row"));
    };
    let [width, height] = [["image_width", "width"], ["image_height", "height"]].map(|names| {
        let value = entry(tree, &names).and_then(Value::as_f64);
        value
            .filter(|size| *size >= 1.0 && size.fract() == 0.0)
            .map(|size| size as usize)
            .ok_or_else(|| missing(names[0]))
    });
    let model = model(entry(tree, &["distortion_model", "camera_model"]))?;
    let coefficients =
        numbers(tree, &["distortion_coefficients", "dist_coeffs", "d", "d1"])?.unwrap_or_default();
    let skew = if fu == 0.0 { 0.0 } else { shear / fu };
    let lens = model.lens(&coefficients)?;
    Ok(Intrinsics { width: width?, height: height?, focal: [fu, fv], principal: [u0, v0], skew, lens })
}

fn kalibr(camera: &Map<String, Value>) -> Result<Intrinsics> {
    model(entry(camera, &["camera_model"]))?;
    let model = model(entry(camera, &["distortion_model"]))?;
    let four = numbers(camera, &["intrinsics"])?.ok_or_else(|| missing("intrinsics"))?;
    let size = numbers(camera, &["resolution"])?.ok_or_else(|| missing("resolution"))?;
    let (&[fu, fv, u0, v0], &[width, height]) = (four.as_slice(), size.as_slice()) else {
        let error = Error::new("`intrinsics` must have 4 numbers and `resolution` 2");
        return Err(error.help("write them as Kalibr does: [fu, fv, u0, v0] and [width, height]"));
    };
    let coefficients = numbers(camera, &["distortion_coeffs"])?.unwrap_or_default();
    Ok(Intrinsics {
        width: width as usize,
        height: height as usize,
        focal: [fu, fv],
        principal: [u0, v0],
        skew: 0.0,
        lens: model.lens(&coefficients)?,
    })
}

/// The lens models of other programs, by what their coefficients mean.
#[derive(Clone, Copy, Debug)]
enum Model {
    /// k₁ k₂ p₁ p₂ k₃ k₄ k₅ k₆, as many of them as are given.
    Polynomial,
    /// k₁ k₂ k₃ k₄ of the angle off the axis.
    Equidistant,
}

fn model(name: Option<&Value>) -> Result<Model> {
    let name = name.and_then(Value::as_str).unwrap_or_default();
    match name {
        "" | "none" | "pinhole" | "plumb_bob" | "radtan" | "rational_polynomial" | "brown_conrady" => {
            Ok(Model::Polynomial)
        }
        "equidistant" | "fisheye" | "kannala_brandt" => Ok(Model::Equidistant),
        _ => {
            let cause = format!(
                "the camera model `{name}` is not supported, only pinhole with plumb_bob (radtan), \
                 rational_polynomial or equidistant (fisheye) is"
            );
            let help =
                "calibrate with one of these models, or undistort the pictures and give their camera matrix";
            Err(Error::new(cause).help(help))
        }
    }
}

impl Model {
    fn lens(self, coefficients: &[f64]) -> Result<Lens<f64>> {
        let wrong = |expected: &str, help: &str| {
            let cause =
                format!("the lens model has {} coefficients, must have {expected}", coefficients.len());
            Err(Error::new(cause).help(help))
        };
        match self {
            Self::Polynomial => {
                // Thin prism (12) and tilted (14) models are read where they do nothing.
                let used = coefficients.iter().rposition(|k| *k != 0.0).map_or(0, |last| last + 1);
                let length = match used {
                    0..=5 => 5,
                    6..=8 => 8,
                    _ => {
                        return wrong(
                            "at most 8 that are not 0",
                            "calibrate without the thin prism and tilted models",
                        );
                    }
                };
                let mut padded = coefficients.to_vec();
                padded.resize(length, 0.0);
                Ok(Lens::from_polynomial(&padded).unwrap_or_default())
            }
            Self::Equidistant => match *coefficients {
                [k1, k2, k3, k4] => Ok(Lens::Equidistant([k1, k2, k3, k4])),
                _ => wrong("4", "give k1 k2 k3 k4 of the fisheye calibration"),
            },
        }
    }
}

/// An entry by any of its names; case and underscores do not count, since OpenCV's programs differ in them.
fn entry<'a>(tree: &'a Map<String, Value>, names: &[&str]) -> Option<&'a Value> {
    let plain = |name: &str| name.replace('_', "").to_lowercase();
    let find =
        |wanted: &&str| tree.iter().find(|(name, _)| plain(name) == plain(wanted)).map(|(_, value)| value);
    names.iter().find_map(find)
}

fn numbers(tree: &Map<String, Value>, names: &[&str]) -> Result<Option<Vec<f64>>> {
    let Some(value) = entry(tree, names) else { return Ok(None) };
    let list = value.as_object().and_then(|matrix| matrix.get("data")).unwrap_or(value);
    let finite = |value: &Value| value.as_f64().filter(|number| number.is_finite());
    let numbers: Option<Vec<f64>> = match list {
        Value::Array(items) => items.iter().map(finite).collect(),
        scalar => finite(scalar).map(|number| vec![number]),
    };
    let name = names.first().unwrap_or(&"entry");
    numbers.map(Some).ok_or_else(|| {
        Error::new(format!("`{name}` does not hold finite numbers")).help("correct the camera file")
    })
}

fn missing(name: &str) -> Error {
    let help =
        "give a camera file of ROS (camera_info), OpenCV or Kalibr, or write its numbers into [camera]";
    Error::new(format!("`{name}` is missing")).help(help)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(text: &str) -> Result<Lens<f64>> {
        from_yaml(text).and_then(|tree| intrinsics(&tree)).map(|camera| camera.lens)
    }

    const SIZE: &str = "image_width: 640\nimage_height: 480\n";
    const MATRIX: &str = "camera_matrix: {rows: 3, cols: 3, data: [400, 0, 320, 0, 400, 240, 0, 0, 1]}\n";

    #[test]
    fn fisheye_files_of_ros_and_kalibr_are_equidistant() {
        let ros = "distortion_model: equidistant\ndistortion_coefficients: {rows: 1, cols: 4, data: [0.1, 0.2, 0.3, 0.4]}";
        let kalibr = "cam0:\n  camera_model: pinhole\n  intrinsics: [400, 400, 320, 240]\n  resolution: [640, 480]\n  \
                      distortion_model: equidistant\n  distortion_coeffs: [0.1, 0.2, 0.3, 0.4]";
        for text in [format!("{SIZE}{MATRIX}{ros}"), kalibr.to_owned()] {
            assert_eq!(lens(&text).unwrap(), Lens::Equidistant([0.1, 0.2, 0.3, 0.4]));
        }
        let five =
            "distortion_model: equidistant\ndistortion_coefficients: {data: [0.1, 0.2, 0.3, 0.4, 0.5]}";
        let refusal = lens(&format!("{SIZE}{MATRIX}{five}")).unwrap_err().to_string();
        assert!(refusal.contains("5 coefficients, must have 4"), "{refusal}");
    }

    #[test]
    fn eight_coefficients_are_rational_and_more_are_refused_unless_they_are_zero() {
        let with = |data: &str| lens(&format!("{SIZE}{MATRIX}distortion_coefficients: {{data: [{data}]}}"));
        let eight = [0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6];
        let expected = Lens::from_polynomial(&eight).unwrap();
        assert!(matches!(expected, Lens::Rational { .. }));
        assert_eq!(with("0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6").unwrap(), expected);
        assert_eq!(with("0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6, 0, 0, 0, 0").unwrap(), expected);
        let refusal = with("0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6, 0.7, 0, 0, 0").unwrap_err().to_string();
        assert!(refusal.contains("thin prism"), "{refusal}");
    }
}

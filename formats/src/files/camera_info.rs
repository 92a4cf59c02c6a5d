//! Camera files of other programs: ROS camera_info, OpenCV's FileStorage (YAML, XML), Kalibr's camchain.
//!
//! All three become one tree of values, and differ only in the names of their entries. Kalibr and ROS put pixel
//! (0, 0) at the centre of the top-left pixel as we do, and so does OpenCV: nothing is shifted.
use crate::{Error, Result};
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
    /// k₁ k₂ p₁ p₂ k₃.
    pub distortion: [f64; 5],
}

/// The camera in a ROS camera_info, OpenCV or Kalibr file; of several cameras in a Kalibr camchain, the first.
///
/// # Errors
/// Names the file, the entry, and what is wrong: missing, not numbers, or a lens model other than Brown–Conrady's.
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
    check_model(entry(tree, &["distortion_model", "camera_model"]))?;
    let coefficients =
        numbers(tree, &["distortion_coefficients", "dist_coeffs", "d", "d1"])?.unwrap_or_default();
    let skew = if fu == 0.0 { 0.0 } else { shear / fu };
    let distortion = brown_conrady(&coefficients)?;
    Ok(Intrinsics { width: width?, height: height?, focal: [fu, fv], principal: [u0, v0], skew, distortion })
}

fn kalibr(camera: &Map<String, Value>) -> Result<Intrinsics> {
    check_model(entry(camera, &["camera_model"]))?;
    check_model(entry(camera, &["distortion_model"]))?;
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
        distortion: brown_conrady(&coefficients)?,
    })
}

fn check_model(model: Option<&Value>) -> Result<()> {
    const KNOWN: [&str; 7] =
        ["", "none", "pinhole", "plumb_bob", "radtan", "rational_polynomial", "brown_conrady"];
    let name = model.and_then(Value::as_str).unwrap_or_default();
    if KNOWN.contains(&name) {
        return Ok(());
    }
    let cause =
        format!("the camera model `{name}` is not supported, only pinhole with plumb_bob (radtan) is");
    Err(Error::new(cause)
        .help("calibrate with the plumb_bob model, or undistort the pictures and give their camera matrix"))
}

/// The five coefficients, when the model has no others that differ from 0.
fn brown_conrady(coefficients: &[f64]) -> Result<[f64; 5]> {
    let mut five = [0.0; 5];
    for (slot, coefficient) in five.iter_mut().zip(coefficients) {
        *slot = *coefficient;
    }
    if coefficients.iter().skip(5).any(|coefficient| *coefficient != 0.0) {
        let cause = format!(
            "the lens model has {} coefficients, only k1 k2 p1 p2 k3 are supported",
            coefficients.len()
        );
        return Err(Error::new(cause).help("calibrate without the rational, thin prism and tilted models"));
    }
    Ok(five)
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

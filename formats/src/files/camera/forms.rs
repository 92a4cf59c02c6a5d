//! The camera that named values tell of, whatever program wrote them.
use super::{Intrinsics, entries::Entries, lens, tree::Tree};
use crate::{Error, Result};
use monorange_core::geometry::Lens;
use serde_json::Value;
use std::path::Path;

const MATRIX: [&str; 10] = [
    "camera_matrix",
    "camera_mat",
    "k",
    "m1",
    "intrinsic_matrix",
    "mtx",
    "camera_mtx",
    "intrinsics_matrix",
    "cammat",
    "camera_intrinsics",
];
const COEFFICIENTS: [&str; 12] = [
    "distortion_coefficients",
    "distortion_coeffs",
    "dist_coeffs",
    "dist_coeff",
    "dist_coef",
    "d",
    "d1",
    "distortion",
    "dist",
    "distortion_coefs",
    "coeffs",
    "distortion_vector",
];
const WIDTH: [&str; 6] = ["image_width", "width", "resolution_width", "img_width", "cols", "w"];
const HEIGHT: [&str; 6] = ["image_height", "height", "resolution_height", "img_height", "rows", "h"];
const SIZE: [&str; 4] = ["resolution", "image_size", "img_size", "size"];

/// Camera `number` of those in a tree.
pub(super) fn camera(
    tree: &Tree,
    path: &Path,
    number: Option<usize>,
    size: Option<[usize; 2]>,
) -> Result<Intrinsics> {
    let cameras = cameras(tree);
    let names: Vec<_> = cameras.iter().map(|camera| camera.name.as_str()).collect();
    let place = number.unwrap_or(0);
    let Some(chosen) = cameras.get(place) else {
        let cause = format!("has no camera {place}: it holds {} ({})", names.len(), names.join(", "));
        return Err(Error::new(cause).help("give --camera a number from 0 on"));
    };
    if number.is_none() && names.len() > 1 {
        let cause =
            format!("holds {} cameras ({}), of which {} is used", names.len(), names.join(", "), chosen.name);
        Error::new(cause)
            .at(path)
            .help("leave the others out of the file, or choose on the command line with --camera N, counted from 0")
            .warn();
    }
    chosen.read(size).map_err(|error| match (names.len(), tree.get(&chosen.name)) {
        (1, None | Some(Value::String(_) | Value::Array(_))) => error,
        _ => error.in_entry(&format!("`{}`:", chosen.name)),
    })
}

struct Chosen<'a> {
    name: String,
    tree: &'a Tree,
    form: Form<'a>,
}

enum Form<'a> {
    Named {
        prefix: &'a str,
    },
    /// OpenCV's stereo program: M1 D1 M2 D2.
    Second,
    /// A rectified camera of KITTI: the entries of its projection and its size.
    Rectified {
        projection: String,
        size: Option<String>,
    },
}

fn cameras(tree: &Tree) -> Vec<Chosen<'_>> {
    let numbered = |name: &str| {
        let rest = name.to_lowercase().trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
        rest.len() < name.len() && matches!(rest.trim_end_matches('_'), "cam" | "camera")
    };
    let is_camera = |map: &Tree| {
        let entries = Entries::new(map, "");
        entries.has(&MATRIX) || entries.has(&["intrinsics", "fx", "projection_parameters"])
    };
    let named =
        |name: &str, tree, prefix| Chosen { name: name.to_owned(), tree, form: Form::Named { prefix } };
    let nested: Vec<_> = tree
        .iter()
        .filter_map(|(name, value)| Some((name, value.as_object()?)))
        .filter(|(name, map)| numbered(name) || is_camera(map))
        .map(|(name, map)| named(name, map, ""))
        .collect();
    if !nested.is_empty() && !is_camera(tree) {
        return nested;
    }
    if tree.contains_key("M1") && tree.contains_key("M2") {
        let second = Chosen { name: "M2".to_owned(), tree, form: Form::Second };
        return vec![named("M1", tree, ""), second];
    }
    for prefixes in [&["Camera1.", "Camera2."][..], &["Camera."]] {
        let there = |prefix: &&&str| {
            ["fx", "fy", "cx"].iter().any(|name| tree.contains_key(&format!("{prefix}{name}")))
        };
        let found: Vec<_> = prefixes.iter().filter(there).map(|prefix| named(prefix, tree, prefix)).collect();
        if !found.is_empty() {
            return found;
        }
    }
    let projections = |beginning: &str| {
        let of = |name: &&String| name.strip_prefix(beginning).is_some_and(|rest| rest.parse::<u8>().is_ok());
        let camera = |projection: &String| Chosen {
            name: projection.clone(),
            tree,
            form: Form::Rectified {
                projection: projection.clone(),
                size: projection.strip_prefix("P_rect").map(|number| format!("S_rect{number}")),
            },
        };
        tree.keys().filter(of).map(camera).collect::<Vec<_>>()
    };
    for beginning in ["P_rect_", "P"] {
        let found = projections(beginning);
        if !found.is_empty() {
            return found;
        }
    }
    vec![named("the camera", tree, "")]
}

impl Chosen<'_> {
    fn read(&self, size: Option<[usize; 2]>) -> Result<Intrinsics> {
        match &self.form {
            Form::Named { prefix } => read(&Entries::new(self.tree, prefix), &MATRIX, &COEFFICIENTS, size),
            Form::Second => read(&Entries::new(self.tree, ""), &["m2"], &["d2"], size),
            Form::Rectified { projection, size: key } => {
                rectified(self.tree, projection, key.as_deref(), size)
            }
        }
    }
}

fn read(
    entries: &Entries<'_>,
    matrix: &[&'static str],
    coefficients: &[&'static str],
    given: Option<[usize; 2]>,
) -> Result<Intrinsics> {
    // All that is known is asked for before anything is called missing: a misspelt name is the better answer.
    let parts = (projection(entries, matrix), size(entries, given), lens::lens(entries, coefficients));
    let (([focal, principal], skew), size, lens) = match parts {
        (Ok(projection), Ok(size), Ok(lens)) => (projection, size, lens),
        (projection, size, lens) => {
            let errors = [projection.err(), size.err(), lens.err()].into_iter().flatten();
            let (missing, wrong): (Vec<_>, Vec<_>) = errors.partition(|error| error.says("missing"));
            if let Some(error) = wrong.into_iter().next() {
                return Err(error);
            }
            entries.get(&["binning_x", "binning_y", "roi"]);
            entries.finish()?;
            return Err(missing.into_iter().next().unwrap_or_else(|| entries.missing("camera_matrix")));
        }
    };
    let [width, height] = size;
    let camera = Intrinsics { width, height, focal, principal, skew, lens };
    check_crop(entries, &camera)?;
    if entries.has(&["m1"]) {
        entries.get(&["m1", "d1", "m2", "d2", "r", "t", "e", "f"]); // both cameras of a stereo file
    }
    entries.finish()?;
    Ok(camera)
}

/// Focal length and principal point, and the skew.
fn projection(entries: &Entries<'_>, matrix: &[&'static str]) -> Result<([[f64; 2]; 2], f64)> {
    if let Some(matrix) = entries.numbers(matrix)? {
        return of_matrix(&matrix);
    }
    if let Some(intrinsics) = entries.numbers(&["intrinsics"])? {
        return match *intrinsics.as_slice() {
            [fu, fv, u0, v0] => Ok(([[fu, fv], [u0, v0]], 0.0)),
            ref nine if nine.len() == 9 => of_matrix(nine),
            ref other => {
                let cause =
                    format!("`intrinsics` has {} numbers, must have 4: [fu, fv, u0, v0]", other.len());
                Err(Error::new(cause)
                    .help("five are those of an omnidirectional lens, which is not supported"))
            }
        };
    }
    let nested = entries.get(&["projection_parameters"]).and_then(Value::as_object);
    let own = nested.map(|nested| Entries::new(nested, ""));
    let entries = own.as_ref().unwrap_or(entries);
    let names: [&[&'static str]; 4] = [
        &["fx", "fu", "f_x", "fl_x"],
        &["fy", "fv", "f_y", "fl_y"],
        &["cx", "u0", "ppx", "c_x"],
        &["cy", "v0", "ppy", "c_y"],
    ];
    let numbers = names.map(|names| entries.number(names));
    let numbers = numbers.into_iter().collect::<Result<Vec<_>>>()?;
    let skew = entries.number(&["skew"])?.unwrap_or(0.0);
    if let Some(own) = &own {
        own.finish()?;
    }
    match *numbers.as_slice() {
        [Some(fu), Some(fv), Some(u0), Some(v0)] => Ok(([[fu, fv], [u0, v0]], skew)),
        [None, None, None, None] => Err(entries.missing("camera_matrix")),
        ref some => {
            let missing = names.iter().zip(some).find(|(_, number)| number.is_none());
            Err(entries.missing(missing.and_then(|(names, _)| names.first()).unwrap_or(&"fx")))
        }
    }
}

fn of_matrix(matrix: &[f64]) -> Result<([[f64; 2]; 2], f64)> {
    let &[fu, shear, u0, lower, fv, v0, a, b, c] = matrix else {
        let cause = format!("`camera_matrix` has {} numbers, must have 9", matrix.len());
        return Err(Error::new(cause).help("write the 3×3 matrix row by row"));
    };
    if [lower, a, b] != [0.0; 3] || c != 1.0 {
        let error = Error::new(format!("the last row of `camera_matrix` is {a}, {b}, {c}, must be 0, 0, 1"));
        return Err(error.help(match (u0, v0, c) {
            (0.0, 0.0, 1.0) => {
                "it looks transposed (MATLAB's order): write it row by row, fx 0 cx 0 fy cy 0 0 1"
            }
            _ => "write the 3×3 matrix row by row, fx 0 cx 0 fy cy 0 0 1",
        }));
    }
    Ok(([[fu, fv], [u0, v0]], if fu == 0.0 { 0.0 } else { shear / fu }))
}

fn size(entries: &Entries<'_>, given: Option<[usize; 2]>) -> Result<[usize; 2]> {
    let pair = entries.numbers(&SIZE)?;
    let sides = [entries.number(&WIDTH)?, entries.number(&HEIGHT)?];
    let found = match (sides, pair.as_deref()) {
        ([Some(width), Some(height)], _) | (_, Some(&[width, height])) => Some([width, height]),
        ([None, None], None) => None,
        ([None, _], _) => return Err(entries.missing("image_width")),
        ([_, None], _) => return Err(entries.missing("image_height")),
    };
    whole_size(found, given)?.ok_or_else(|| {
        entries.missing("image_width").help(
            "the file does not say the picture's size: write width and height into [camera] of the rig, beside camera_info",
        )
    })
}

/// The picture's size as the file says, or as the rig does: where both do, they must agree.
fn whole_size(found: Option<[f64; 2]>, given: Option<[usize; 2]>) -> Result<Option<[usize; 2]>> {
    let Some([width, height]) = found else { return Ok(given) };
    let whole = |side: f64| side >= 1.0 && side.fract() == 0.0 && side <= 65_536.0;
    if !whole(width) || !whole(height) {
        let cause = format!("the picture's size is {width}×{height}, must be whole numbers above 0");
        return Err(Error::new(cause).help("correct the camera file"));
    }
    let size = [width as usize, height as usize];
    match given {
        Some(given) if given != size => {
            let cause = format!("the picture is {width}×{height} here, {}×{} in the rig", given[0], given[1]);
            Err(Error::new(cause).help("leave width and height out of [camera], or correct one of them"))
        }
        _ => Ok(Some(size)),
    }
}

/// Refuses a crop or a binning: the matrix is that of the whole picture, the pictures are not.
fn check_crop(entries: &Entries<'_>, camera: &Intrinsics) -> Result<()> {
    let binning =
        [entries.number(&["binning_x"])?, entries.number(&["binning_y"])?].map(|b| b.unwrap_or(0.0).max(1.0));
    let (mut offset, mut whole) = ([0.0; 2], [camera.width as f64, camera.height as f64]);
    if let Some(roi) = entries.get(&["roi"]).and_then(Value::as_object) {
        let roi = Entries::new(roi, "");
        offset = [roi.number(&["x_offset"])?, roi.number(&["y_offset"])?].map(|side| side.unwrap_or(0.0));
        let size = [roi.number(&["width"])?, roi.number(&["height"])?].map(|side| side.unwrap_or(0.0));
        if size.iter().all(|side| *side > 0.0) {
            whole = size;
        }
    }
    if binning == [1.0; 2] && offset == [0.0; 2] && whole == [camera.width as f64, camera.height as f64] {
        return Ok(());
    }
    let [width, height] = [0, 1].map(|axis| libm::floor(whole[axis] / binning[axis]));
    let focal = [0, 1].map(|axis| camera.focal[axis] / binning[axis]);
    // Between pixels' corners, where a scale is a factor; pixel centres are half a pixel further.
    let principal = [0, 1].map(|axis| (camera.principal[axis] + 0.5 - offset[axis]) / binning[axis] - 0.5);
    let what = if binning == [1.0; 2] { "roi" } else { "binning_x" };
    let cause = format!(
        "`{what}` says that the pictures are {width}×{height}, a binned or cropped part of the {}×{} of the matrix",
        camera.width, camera.height
    );
    Err(Error::new(cause).help(format!(
        "give the camera of these pictures in [camera]: width = {width}, height = {height}, focal = [{:.3}, {:.3}], principal = [{:.3}, {:.3}], \
         distortion = {:?}; or remove `{what}` if the pictures are whole",
        focal[0], focal[1], principal[0], principal[1], camera.lens.coefficients()
    )))
}

/// A camera of KITTI, whose pictures are rectified.
fn rectified(
    tree: &Tree,
    projection: &str,
    size_key: Option<&str>,
    given: Option<[usize; 2]>,
) -> Result<Intrinsics> {
    let numbers = |key: &str, count: usize| -> Result<Option<Vec<f64>>> {
        let Some(value) = tree.get(key) else { return Ok(None) };
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let words: Vec<_> = text.split_whitespace().collect();
        let numbers: Vec<f64> = words
            .iter()
            .filter_map(|word| word.parse().ok())
            .filter(|number: &f64| number.is_finite())
            .collect();
        if numbers.len() != count || words.len() != count {
            let cause = format!("`{key}` holds {} finite numbers, must hold {count}", numbers.len());
            return Err(Error::new(cause).help("is the file cut short? Correct the camera file"));
        }
        Ok(Some(numbers))
    };
    let matrix = numbers(projection, 12)?.unwrap_or_default();
    let &[fu, shear, u0, _, _, fv, v0, ..] = matrix.as_slice() else {
        return Err(Error::new(format!("`{projection}` is missing")).help("correct the camera file"));
    };
    let found =
        size_key.map_or(Ok(None), |key| numbers(key, 2))?.and_then(|size| <[f64; 2]>::try_from(size).ok());
    let size = whole_size(found, given)?.ok_or_else(|| {
        Error::new("KITTI's calib.txt does not say the picture's size")
            .help("write width and height into [camera] of the rig, beside camera_info")
    })?;
    Error::new(format!("`{projection}` is of rectified pictures: no lens is taken off them"))
        .help("give the rectified pictures (image_0 or sync), not the raw ones")
        .warn();
    let [width, height] = size;
    Ok(Intrinsics {
        width,
        height,
        focal: [fu, fv],
        principal: [u0, v0],
        skew: shear / fu,
        lens: Lens::default(),
    })
}

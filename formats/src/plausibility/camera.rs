use crate::{Error, Result, files::Intrinsics};
use monorange_core::geometry::Lens;
use std::path::Path;

/// Fails when focal length, principal point and picture cannot belong together; warns when they hardly do.
///
/// # Errors
/// When the numbers look normalised, transposed, or are larger than 32 bits hold.
pub fn check_camera(intrinsics: &Intrinsics) -> Result<()> {
    let Intrinsics { width, height, focal, principal, skew, lens } = intrinsics;
    let size = [*width as f64, *height as f64];
    let help = "give focal length and principal point in pixels of this picture";
    for (name, number) in
        [("focal", focal[0]), ("focal", focal[1]), ("principal", principal[0]), ("principal", principal[1])]
    {
        if !number.is_finite() || number.abs() > 1e7 {
            return Err(Error::new(format!("`{name}` is {number:e}, which no camera has")).help(help));
        }
    }
    // A pinhole picture of 170° has a focal length of 0.044 widths; lenses that wide are not pinholes.
    if focal[0].abs() < 0.04 * size[0] && size[0] > 16.0 {
        let cause = format!("the focal length is {} px for a picture {width} px wide", focal[0]);
        return Err(Error::new(cause).help(match (principal[0].abs() <= 2.0, focal[0] <= 3.0) {
            (true, _) => format!(
                "the numbers look like parts of the picture's width: {help}, focal {:.1}, {:.1}, principal {:.1}, {:.1}",
                focal[0] * size[0],
                focal[1] * size[1],
                principal[0] * size[0],
                principal[1] * size[1]
            ),
            (_, true) => format!("the focal lengths look like parts of the picture's width: {help}"),
            _ => help.to_owned(),
        }));
    }
    if principal.iter().all(|place| place.abs() <= 1.5) && size.iter().all(|size| *size > 16.0) {
        let [u, v] = principal;
        let cause = format!("the principal point ({u}, {v}) is in the corner of the picture");
        return Err(
            Error::new(cause).help(format!("is the matrix transposed, or in parts of the width? {help}"))
        );
    }
    let mut doubts = Vec::new();
    if principal.iter().zip(size).any(|(place, size)| *place < 0.0 || *place > size) {
        let [u, v] = principal;
        doubts.push(format!("the principal point ({u}, {v}) is outside the picture of {width}×{height}"));
    } else if principal.iter().zip(size).any(|(place, size)| (place / size - 0.5).abs() > 0.25)
        && size[0] > 16.0
    {
        let [u, v] = principal;
        doubts.push(format!(
            "the principal point ({u}, {v}) is far from the middle of the picture of {width}×{height}"
        ));
    }
    if focal[0] > 20.0 * size[0] {
        doubts.push(format!(
            "the focal length of {} px sees only {:.1}° across",
            focal[0],
            across(focal[0], size[0])
        ));
    } else if focal[0] < 0.25 * size[0] && !matches!(lens, Lens::Equidistant(_)) {
        doubts.push(format!(
            "the focal length of {} px sees {:.0}° across, more than a lens without a fisheye model does",
            focal[0],
            across(focal[0], size[0])
        ));
    }
    if !(0.5..=2.0).contains(&(focal[1] / focal[0])) {
        doubts.push(format!(
            "the focal lengths {} and {} px differ as if pixels were not square",
            focal[0], focal[1]
        ));
    }
    if skew.abs() > 0.1 {
        doubts.push(format!("the skew of {skew} leans columns by more than 5°"));
    }
    // At the picture's edge r = 1 px/px or so; a k₁ beyond this folds the picture over long before.
    if lens.coefficients().iter().any(|k| k.abs() > 1e3) {
        doubts.push(format!("the lens coefficients {:?} bend the picture over itself", lens.coefficients()));
    }
    for doubt in doubts {
        Error::new(doubt)
            .help("check that the calibration is of pictures of this size and not cropped")
            .warn();
    }
    Ok(())
}

fn across(focal: f64, width: f64) -> f64 {
    2.0 * libm::atan(width / (2.0 * focal)).to_degrees()
}

/// Fails when a picture has another size than the camera.
///
/// # Errors
/// Says what the sizes look like: turned, binned, cropped.
pub fn check_picture(path: &Path, picture: [usize; 2], camera: [usize; 2]) -> Result<()> {
    let ([w, h], [width, height]) = (picture, camera);
    if picture == camera {
        return Ok(());
    }
    let error = Error::new(format!("the picture is {w}×{h}, the rig's camera {width}×{height}")).at(path);
    let factor = (1..=8).find(|n| n * w == width && n * h == height || n * width == w && n * height == h);
    Err(error.help(match factor {
        _ if [h, w] == camera => "the picture is turned by 90°: turn it back, or calibrate with turned pictures".to_owned(),
        Some(n) => format!("one is {n} times the other, binned or scaled: give pictures as they were calibrated, or a rig for this size"),
        None => "give pictures as they were calibrated, or a rig for this size".to_owned(),
    }))
}

//! What a photograph says of its camera: a focal length to begin with, where nobody has calibrated.
use exif::{Exif, In, Reader, Tag, Value};
use std::io::Cursor;
use wasm_bindgen::prelude::*;

/// Diagonal of a frame of 35 mm film, 36 × 24 mm: an equivalent focal length is by the diagonal (CIPA DCG-001).
const FILM_DIAGONAL_MM: f64 = 43.266_615;
/// How wrong the focal length may be, one standard deviation as a share of it: judgement. Makers who reckon by the width
/// are 4 % off in pictures of 4:3, whole millimetres are 2 % at a phone's 26 mm, and a lens breathes as it focuses.
const STD: f64 = 0.05;
/// A picture whose sides differ so much from those that the camera wrote was cut since.
const CUT: f64 = 0.02;

/// Focal length in pixels of a picture of this size and its standard deviation, by the EXIF data in the first bytes of
/// its file.
#[wasm_bindgen(js_name = focalOf)]
pub fn focal_of(head: &[u8], width: u32, height: u32) -> Option<Vec<f64>> {
    let exif = Reader::new().read_from_container(&mut Cursor::new(head)).ok()?;
    let focal = focal(&exif, [width, height].map(f64::from))?;
    Some(vec![focal, STD * focal])
}

fn focal(exif: &Exif, size: [f64; 2]) -> Option<f64> {
    let number = |tag| number(&exif.get_field(tag, In::PRIMARY)?.value).filter(|number| *number > 0.0);
    let sides = |[a, b]: [f64; 2]| [a.max(b), a.min(b)];
    let [long, short] = sides(size);
    // A picture may have been turned and made smaller since; of one that was cut nothing is known.
    let taken = number(Tag::PixelXDimension).zip(number(Tag::PixelYDimension));
    let [taken_long, taken_short] = taken.map_or([long, short], |(x, y)| sides([x, y]));
    if (long * taken_short / (short * taken_long) - 1.0).abs() > CUT {
        return None;
    }
    let of_film = || Some(number(Tag::FocalLengthIn35mmFilm)? * long.hypot(short) / FILM_DIAGONAL_MM);
    let of_sensor = || {
        let unit_mm = match number(Tag::FocalPlaneResolutionUnit) {
            Some(3.0) => 10.0,
            Some(4.0) => 1.0,
            Some(5.0) => 1e-3,
            _ => 25.4,
        };
        let per_mm = number(Tag::FocalPlaneXResolution)? / unit_mm;
        Some(number(Tag::FocalLength)? * per_mm * long / taken_long)
    };
    // Between 143° and 1.7° across: what else a camera writes is a mistake.
    let plausible = |focal: &f64| (long / 6.0..33.0 * long).contains(focal);
    of_film().filter(plausible).or_else(|| of_sensor().filter(plausible))
}

/// A number of either kind.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Rational(values) => values.first().map(exif::Rational::to_f64),
        value => value.get_uint(0).map(f64::from),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A JPEG's head with these entries of EXIF data: tag and value, a fraction where the tag wants one.
    fn photo(entries: &[(u16, [u32; 2])]) -> Vec<u8> {
        let long = |number: u32| number.to_be_bytes().to_vec();
        let short = |number: u16| number.to_be_bytes().to_vec();
        // Main directory with one entry, where EXIF's own is; its fractions stand behind it.
        let mut tiff =
            [b"MM\0\x2a".to_vec(), long(8), short(1), short(0x8769), short(4), long(1), long(26), long(0)]
                .concat();
        let mut behind = 26 + 2 + 12 * entries.len() as u32 + 4;
        let mut fractions = Vec::new();
        tiff.extend(short(entries.len() as u16));
        for (tag, [above, below]) in entries {
            tiff.extend(short(*tag));
            if *below == 0 {
                tiff.extend([short(3), long(1), short(*above as u16), short(0)].concat());
            } else {
                tiff.extend([short(5), long(1), long(behind)].concat());
                fractions.extend([long(*above), long(*below)].concat());
                behind += 8;
            }
        }
        tiff.extend([long(0), fractions].concat());
        let body = [b"Exif\0\0".to_vec(), tiff].concat();
        [vec![0xff, 0xd8, 0xff, 0xe1], short(body.len() as u16 + 2), body, vec![0xff, 0xd9]].concat()
    }

    const FILM: u16 = 0xa405;
    const X: u16 = 0xa002;
    const Y: u16 = 0xa003;

    fn first(entries: &[(u16, [u32; 2])], width: u32, height: u32) -> Option<f64> {
        focal_of(&photo(entries), width, height).map(|found| found[0])
    }

    #[test]
    fn the_equivalent_focal_length_is_by_the_diagonal() {
        // 26 mm on 4032 × 3024: 26 · 5040 / 43.27.
        let found = focal_of(&photo(&[(FILM, [26, 0])]), 4032, 3024).unwrap();
        assert!((found[0] - 3028.6).abs() < 0.1 && (found[1] / found[0] - 0.05).abs() < 1e-12, "{found:?}");
        let small = first(&[(FILM, [26, 0]), (X, [4032, 0]), (Y, [3024, 0])], 756, 1008).unwrap();
        assert!((small - 757.2).abs() < 0.1, "turned and a quarter as large: {small}");
    }

    #[test]
    fn the_sensors_resolution_serves_where_there_is_no_equivalent() {
        // 50 mm at 4000 pixels for 22.3 mm.
        let entries = [
            (0x920a, [50, 1]),
            (0xa20e, [40_000_000, 8779]),
            (0xa210, [2, 0]),
            (X, [4000, 0]),
            (Y, [3000, 0]),
        ];
        let found = first(&entries, 2000, 1500).unwrap();
        assert!((found - 50.0 * 40_000.0 / 8.779 / 25.4 / 2.0).abs() / found < 1e-9, "{found}");
    }

    #[test]
    fn of_a_picture_that_was_cut_or_without_a_focal_length_nothing_is_said() {
        assert_eq!(first(&[(FILM, [26, 0]), (X, [4032, 0]), (Y, [3024, 0])], 1000, 1000), None);
        assert_eq!(first(&[(FILM, [0, 0])], 640, 480), None);
        assert_eq!(first(&[(FILM, [60_000, 0])], 640, 480), None);
        assert_eq!(focal_of(b"\x89PNG", 640, 480), None);
    }
}

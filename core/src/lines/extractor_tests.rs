//! The extractor on pictures made for one question each.
use super::super::memory::{point_count, row_words};
use super::*;
use crate::geometry::{Camera, Distortion, Mount};
use std::{vec, vec::Vec};

type HostExtractor = Extractor<Vec<u16>, Vec<u32>, Vec<EdgePoint>>;

fn finder(width: usize, height: usize) -> RangeFinder<f32> {
    let principal = [width as f32 / 2.0, height as f32 / 2.0];
    let camera = Camera::new(width, height, [365.0, 365.0], principal, 0.0, Distortion::default()).unwrap();
    RangeFinder::new(camera, Mount::new([0.4, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap())
}

fn extractor(width: usize, height: usize, points: usize) -> HostExtractor {
    let words = vec![0; row_words(width, height).max(3 * points)];
    let points = vec![EdgePoint::default(); points];
    let masks = vec![0; mask_words(width)];
    Extractor::new(ExtractConfig::default(), finder(width, height), words, masks, points).unwrap()
}

fn extract(width: usize, height: usize, pixel: impl FnMut(usize) -> u8) -> Extraction {
    let pixels: Vec<u8> = (0..width * height).map(pixel).collect();
    let mut extractor = extractor(width, height, point_count(width, height));
    extractor.extract(Grey::new(&pixels, width, height).unwrap()).unwrap().clone()
}

#[test]
fn the_extractor_of_a_quarter_vga_camera_fits_48_kib() {
    type Small =
        Extractor<[u16; row_words(320, 240)], [u32; mask_words(320)], [EdgePoint; point_count(320, 240)]>;
    assert!(size_of::<Small>() <= 48 * 1024, "{} bytes", size_of::<Small>());
}

#[test]
fn pictures_without_texture_give_nothing_at_any_size() {
    for (width, height) in [(1, 1), (1, 300), (8, 8), (9, 9), (10_000, 12), (12, 1000), (33, 17)] {
        for level in [0, 255] {
            let found = extract(width, height, |_| level);
            assert!(found.corners.is_empty() && found.edge_points == 0, "{width}×{height}");
            assert!(!found.truncations.any());
        }
    }
}

#[test]
fn white_noise_is_truncated_with_a_report() {
    let mut state = 7_u32;
    let found = extract(320, 240, |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    });
    assert!(found.truncations.edge_stride > 1 && found.truncations.any());
    assert!(found.edge_points > 1536);
}

#[test]
fn wide_pictures_are_searched_to_their_ends() {
    let (width, height) = (10_000, 60);
    let found = extract(width, height, |k| match (k / width, k % width) {
        (36.., _) => 60,
        (_, 9_960..) => 200,
        _ => 130,
    });
    assert!(found.floor_lines.iter().any(|line| line.length() > 5_000.0));
    let corner = found.corners.iter().find(|corner| (corner.pixel.x - 9_959.5).abs() < 0.2).unwrap();
    assert!((corner.pixel.y - 35.5).abs() < 0.2, "{corner:?}");
}

#[test]
fn a_steep_edge_must_fill_the_opening() {
    let steep_points = |rows: usize, opening: usize| {
        let in_bar = |k: usize| (20..20 + rows).contains(&(k / 64)) && (20..44).contains(&(k % 64));
        let pixels: Vec<u8> = (0..64 * 64).map(|k| if in_bar(k) { 85 } else { 60 }).collect();
        let config = ExtractConfig { opening, ..Default::default() };
        let points = vec![EdgePoint::default(); 200];
        let (words, masks) = (vec![0; row_words(64, 64)], vec![0; mask_words(64)]);
        let mut extractor = Extractor::new(config, finder(64, 64), words, masks, points).unwrap();
        extractor.extract(Grey::new(&pixels, 64, 64).unwrap()).unwrap();
        let points = extractor.edge_points().iter().filter(|point| point.direction().cos().abs() > 0.9);
        assert!(points.clone().all(|point| in_bar(64 * point.ideal().y as usize + 30)));
        points.count()
    };
    // The smoothing leaves four of six rows strong enough, and five of seven.
    assert_eq!((steep_points(6, 5), steep_points(6, 4)), (0, 4));
    assert_eq!((steep_points(7, 6), steep_points(7, 5) > 0), (0, true));
    assert_eq!(steep_points(20, 6), steep_points(20, 1));
}

#[test]
fn lines_beyond_the_capacity_are_counted() {
    // 40 stripes of 8 px: 80 upright edges for 32 places.
    let found = extract(640, 100, |k| if k % 640 / 8 % 2 == 0 { 60 } else { 160 });
    assert_eq!(found.vertical_lines.len(), 32);
    assert!(found.truncations.lines > 0 || found.truncations.peaks > 0, "{:?}", found.truncations);
}

#[test]
fn rows_must_fit_and_be_complete() {
    let mut extractor = extractor(20, 20, 64);
    assert_eq!(extractor.push_row(&[0; 19]), Err(Error::Size { name: "row", got: 19, expected: 20 }));
    assert!(matches!(extractor.finish(), Err(Error::Size { name: "rows", got: 0, expected: 20 })));
    (0..20).for_each(|_| extractor.push_row(&[0; 20]).unwrap());
    assert!(extractor.finish().is_ok());
    assert!(extractor.push_row(&[0; 20]).is_err());
    extractor.begin();
    assert!(extractor.push_row(&[0; 20]).is_ok());
}

#[test]
fn too_little_memory_is_an_error() {
    let with = |words: usize, masks: usize, points: usize| {
        let points = vec![EdgePoint::default(); points];
        Extractor::new(ExtractConfig::default(), finder(64, 48), vec![0; words], vec![0; masks], points).err()
    };
    assert_eq!(with(row_words(64, 48), mask_words(64), 64), None);
    let name = |error: Option<Error>| match error {
        Some(Error::Size { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    assert_eq!(name(with(16 * 64 - 1, mask_words(64), 64)), "extractor.words");
    assert_eq!(name(with(row_words(64, 48), 3, 64)), "extractor.masks");
    assert_eq!(name(with(row_words(64, 48), mask_words(64), 0)), "extractor.points");
}

#[test]
fn the_same_picture_gives_the_same_bits_again() {
    let picture = |k: usize| ((k % 160) * 3 + (k / 160) * (k % 7) + if k % 160 > 70 { 90 } else { 0 }) as u8;
    let pixels: Vec<u8> = (0..160 * 120).map(picture).collect();
    let grey = Grey::new(&pixels, 160, 120).unwrap();
    let mut extractor = extractor(160, 120, point_count(160, 120));
    let first = extractor.extract(grey).unwrap().clone();
    assert_eq!(*extractor.extract(grey).unwrap(), first);
}

//! What an extractor finds in pictures that are drawn here.
use super::memory::{mask_words, point_count, row_words};
use super::{EdgePoint, Extraction, Extractor, MAX_LINES, Proposal, ProposalConfig};
use crate::Error;
use crate::geometry::{Camera, Distortion, Mount, RangeFinder};
use crate::image::Grey;
use nalgebra::Vector2;
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
    Extractor::new(ProposalConfig::default(), finder(width, height), words, masks, points).unwrap()
}

fn extract(width: usize, height: usize, pixel: impl FnMut(usize) -> u8) -> Extraction {
    let pixels: Vec<u8> = (0..width * height).map(pixel).collect();
    let mut extractor = extractor(width, height, point_count(width, height));
    extractor.extract(Grey::new(&pixels, width, height).unwrap()).unwrap().clone()
}

#[test]
fn the_extractor_of_a_quarter_vga_camera_fits_56_kib() {
    type Small =
        Extractor<[u16; row_words(320, 240)], [u32; mask_words(320)], [EdgePoint; point_count(320, 240)]>;
    assert!(size_of::<Small>() <= 56 * 1024, "{} bytes", size_of::<Small>());
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
fn white_noise_has_no_corner() {
    let mut state = 7_u32;
    let found = extract(320, 240, |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    });
    assert!(found.threshold > 30.0, "noise is no edge: {}", found.threshold);
    assert!(found.corners.is_empty(), "{:?}", found.corners);
}

/// A wall's upright edge at column `u` on the floor's edge at row `v`, `contrast` of the grey levels 60, 120 and 180.
fn wall(width: usize, u: usize, v: usize, contrast: f32) -> impl Fn(usize) -> u8 {
    move |k| {
        let level = if k / width > v {
            60.0
        } else if k % width > u {
            180.0
        } else {
            120.0
        };
        (128.0 + (level - 128.0) * contrast) as u8
    }
}

fn nearest(found: &Extraction, u: f32, v: f32) -> f32 {
    let off = |one: &Proposal| (one.pixel - Vector2::new(u, v)).norm();
    found.proposals.iter().map(off).fold(f32::MAX, f32::min)
}

#[test]
fn a_foot_is_proposed_at_every_contrast() {
    for contrast in [1.0, 0.35, 0.1] {
        let found = extract(160, 120, wall(160, 80, 84, contrast));
        assert!(nearest(&found, 80.5, 84.5) < 0.2, "{contrast}: {:?}", found.proposals);
    }
}

#[test]
fn a_larger_picture_is_searched_as_the_small_one_is() {
    let small = extract(160, 120, wall(160, 80, 84, 0.8));
    let camera = Camera::new(480, 360, [1095.0; 2], [241.0, 181.0], 0.0, Default::default()).unwrap();
    let finder = RangeFinder::new(camera, Mount::new([0.4, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap());
    let picture = wall(160, 80, 84, 0.8);
    let pixels: Vec<u8> = (0..480 * 360).map(|k| picture(k / 480 / 3 * 160 + k % 480 / 3)).collect();
    let memory = (vec![0; row_words(480, 360)], vec![0; mask_words(480)]);
    let points = vec![EdgePoint::default(); point_count(160, 120)];
    let mut extractor =
        Extractor::new(ProposalConfig::default(), finder, memory.0, memory.1, points).unwrap();
    let large = extractor.extract(Grey::new(&pixels, 480, 360).unwrap()).unwrap();
    assert!(!small.proposals.is_empty());
    assert_eq!(small.proposals.len(), large.proposals.len());
    for (small, large) in small.proposals.iter().zip(&large.proposals) {
        assert!((small.pixel * 3.0 + Vector2::repeat(1.0) - large.pixel).norm() < 0.02);
        assert!((small.covariance * 9.0 - large.covariance).norm() < 0.02 * large.covariance.norm());
    }
}

#[test]
fn a_bend_of_the_floors_edge_is_proposed_where_no_vertical_edge_is_seen() {
    let floor = |u: usize| if u < 80 { 70 + u / 8 } else { 80 + (u - 80) / 2 };
    let found = extract(160, 120, |k| if k / 160 > floor(k % 160) { 60 } else { 150 });
    assert!(found.vertical_lines.is_empty());
    assert!(nearest(&found, 80.0, 80.5) < 1.5, "{:?}", found.proposals);
}

#[test]
fn wide_pictures_are_searched_to_their_ends() {
    let (width, height) = (1400, 120);
    let found = extract(width, height, wall(width, 1375, 84, 1.0));
    assert!(nearest(&found, 1375.5, 84.5) < 0.5, "{:?}", found.proposals);
}

#[test]
fn lines_beyond_the_capacity_are_counted() {
    // 80 stripes of 16 px: as many upright edges.
    let found = extract(1280, 100, |k| if (k % 1280 / 16).is_multiple_of(2) { 60 } else { 160 });
    assert!((40..=MAX_LINES).contains(&found.vertical_lines.len()));
    assert!(found.truncations.lines > 0, "{:?}", found.truncations);
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
        Extractor::new(ProposalConfig::default(), finder(64, 48), vec![0; words], vec![0; masks], points)
            .err()
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

use super::*;
extern crate std;
use std::{vec, vec::Vec};

/// A sum of Gaussian blobs (x, y, σ, height) on grey 100.
fn blobs(width: usize, height: usize, list: &[[f32; 4]]) -> Vec<u8> {
    let pixel = |index: usize| {
        let (u, v) = ((index % width) as f32, (index / width) as f32);
        let sum: f32 = list
            .iter()
            .map(|[x, y, sigma, amount]| {
                let (du, dv) = (u - x, v - y);
                amount * libm::expf(-(du * du + dv * dv) / (2.0 * sigma * sigma))
            })
            .sum();
        (100.5 + sum) as u8
    };
    (0..width * height).map(pixel).collect()
}

/// Blobs of many sizes, some upon each other so that they have a direction.
fn scene(width: usize, height: usize) -> Vec<u8> {
    let mut state = 12345_u32;
    let mut random = |most: f32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        most * (state >> 8) as f32 / 16_777_216.0
    };
    let list: Vec<[f32; 4]> = (0..120)
        .map(|_| [random(width as f32), random(height as f32), 1.0 + random(5.0), random(120.0) - 60.0])
        .collect();
    blobs(width, height, &list)
}

fn detect(
    config: SiftConfig,
    pixels: &[u8],
    width: usize,
    height: usize,
) -> (SiftReport, Vec<(Keypoint, SiftDescriptor)>) {
    let picture = Grey::new(pixels, width, height).expect("the size is right");
    let mut samples = vec![-1; sift_samples_len(width, height, &config)];
    let mut candidates = vec![Candidate::default(); 2000];
    let (mut keypoints, mut descriptors) = (vec![Keypoint::default(); 2000], vec![[0; 128]; 2000]);
    let mut work = SiftWork { samples: &mut samples, candidates: &mut candidates };
    let sift = Sift::new(config).expect("valid settings");
    let report = sift.detect(picture, &mut work, &mut keypoints, &mut descriptors).expect("room");
    let found = keypoints.into_iter().zip(descriptors).take(report.keypoints).collect();
    (report, found)
}

#[test]
fn a_blob_is_found_where_it_is_and_as_large_as_it_is() {
    for doubled in [true, false] {
        for (x, y, size) in [(40.0, 40.0, 4.0), (40.3, 38.8, 3.0), (41.5, 40.7, 6.0)] {
            let pixels = blobs(81, 80, &[[x, y, size, 100.0]]);
            let (_, found) = detect(SiftConfig { doubled, ..Default::default() }, &pixels, 81, 80);
            let best = found.iter().max_by(|a, b| a.0.response.total_cmp(&b.0.response)).expect("a blob");
            let error = (best.0.pixel - Vector2::new(x, y)).norm();
            assert!(error < 0.01 * size, "{error} px off at {x}, {y}, doubled {doubled}");
            // The difference of Gaussians 2^(1/3) apart answers most at the blob's own size over 2^(1/6).
            let ratio = best.0.scale / size * libm::powf(2.0, 1.0 / 6.0);
            assert!((ratio - 1.0).abs() < 0.06, "scale {} of a blob of {size}", best.0.scale);
        }
    }
}

#[test]
fn a_quarter_turn_turns_keypoints_and_keeps_descriptors() {
    let side = 161; // odd, so that samples fall on samples
    let pixels = scene(side, side);
    let turned: Vec<u8> = (0..side * side).map(|n| pixels[(side - 1 - n % side) * side + n / side]).collect();
    // The scene is dim; those of so little contrast have directions that come and go.
    let config = SiftConfig { doubled: false, contrast: 0.06, ..Default::default() };
    let (a, b) = (detect(config, &pixels, side, side).1, detect(config, &turned, side, side).1);
    let mut same = 0;
    for (keypoint, descriptor) in &a {
        let place = Vector2::new(side as f32 - 1.0 - keypoint.pixel.y, keypoint.pixel.x);
        let found = b.iter().find(|(other, bytes)| {
            let turn = libm::remainderf(other.angle - keypoint.angle, core::f32::consts::TAU);
            let quarter = (turn - core::f32::consts::FRAC_PI_2).abs() < 0.1;
            let apart: u32 =
                bytes.iter().zip(descriptor).map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2)).sum();
            (other.pixel - place).norm() < 0.05 * keypoint.scale && quarter && apart < 40 * 40
        });
        same += usize::from(found.is_some());
    }
    // Directions close to the least part of the highest peak come and go.
    assert!(a.len() > 40 && same * 10 >= a.len() * 9, "{same} of {}", a.len());
}

#[test]
fn root_descriptors_have_length_512_and_plain_ones_too() {
    let pixels = scene(128, 96);
    for root in [true, false] {
        for (_, descriptor) in detect(SiftConfig { root, ..Default::default() }, &pixels, 128, 96).1 {
            let squares: u32 = descriptor.iter().map(|&v| u32::from(v).pow(2)).sum();
            let length = libm::sqrtf(squares as f32);
            assert!((length - 512.0).abs() < 8.0, "{length}");
        }
    }
}

#[test]
fn gain_and_offset_change_little() {
    let pixels = scene(128, 96);
    let brighter: Vec<u8> = pixels.iter().map(|&p| (f32::from(p) * 0.8 + 40.0) as u8).collect();
    let config = SiftConfig::default();
    let (a, b) = (detect(config, &pixels, 128, 96).1, detect(config, &brighter, 128, 96).1);
    let again = |k: &Keypoint| b.iter().any(|(other, _)| (other.pixel - k.pixel).norm() < 0.5);
    let strong: Vec<_> = a.iter().filter(|(k, _)| k.response > 0.02).collect();
    let found = strong.iter().filter(|(k, _)| again(k)).count();
    assert!(strong.len() > 15 && found * 10 >= strong.len() * 9, "{found} of {}", strong.len());
}

#[test]
fn a_dim_picture_has_as_many_keypoints() {
    let seen = |contrast: f32| {
        let grey = |grey: &u8| ((f32::from(*grey) - 100.0) * contrast + 110.5) as u8;
        let pixels: Vec<u8> = scene(160, 120).iter().map(grey).collect();
        detect(SiftConfig::default(), &pixels, 160, 120).0.keypoints
    };
    let counts = [2.0, 0.7].map(seen); // as a window's light, and a third of it
    assert!(counts[0] > 30 && counts[1] * 10 > counts[0] * 7, "{counts:?}");
}

#[test]
fn small_flat_and_long_pictures_have_a_stated_outcome() {
    for (width, height, octaves) in [(1, 1, 0), (7, 7, 0), (10_000, 1, 0), (10_000, 9, 1), (64, 64, 4)] {
        for grey in [0, 128, 255] {
            let (report, _) = detect(SiftConfig::default(), &vec![grey; width * height], width, height);
            assert_eq!(report, SiftReport { octaves, ..Default::default() }, "{width} × {height}");
        }
    }
    let picture = vec![0; 16_385];
    let picture = Grey::new(&picture, 16_385, 1).expect("the size is right");
    let sift = Sift::new(SiftConfig::default()).expect("valid settings");
    let mut work = SiftWork { samples: &mut [], candidates: &mut [] };
    let error = Error::Size { name: "picture", got: 16_385, expected: 16_384 };
    assert_eq!(sift.detect(picture, &mut work, &mut [], &mut []), Err(error));
}

#[test]
fn noise_of_full_contrast_gives_finite_numbers() {
    let mut state = 1_u32;
    let mut bit = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        if state >> 31 == 0 { 0 } else { 255 }
    };
    let pixels: Vec<u8> = (0..61 * 47).map(|_| bit()).collect();
    let config = SiftConfig { contrast: 0.001, edge: 1e6, ..Default::default() };
    let (report, found) = detect(config, &pixels, 61, 47);
    assert!(report.keypoints > 20, "{report:?}");
    for (k, _) in found {
        let finite = [k.pixel.x, k.pixel.y, k.scale, k.angle, k.response].iter().all(|v| v.is_finite());
        assert!(
            finite && k.pixel.x > 0.0 && k.pixel.x < 61.0 && k.angle.abs() <= core::f32::consts::PI,
            "{k:?}"
        );
    }
}

#[test]
fn a_grid_keeps_the_strongest_of_every_cell() {
    let pixels = scene(160, 120);
    let all = detect(SiftConfig::default(), &pixels, 160, 120).1;
    let grid = GridCap { cell_px: 40, most: 2 };
    let (report, capped) = detect(SiftConfig { grid: Some(grid), ..Default::default() }, &pixels, 160, 120);
    assert!(report.thinned > 0 && capped.len() < all.len());
    let cell = |k: &Keypoint| ((k.pixel.x / 40.0) as usize, (k.pixel.y / 40.0) as usize);
    for (keypoint, descriptor) in &capped {
        assert!(all.contains(&(*keypoint, *descriptor)), "the grid changes no keypoint");
        let mut places: Vec<_> = all
            .iter()
            .filter(|(other, _)| cell(other) == cell(keypoint) && other.response > keypoint.response)
            .map(|(other, _)| (other.pixel.x.to_bits(), other.pixel.y.to_bits()))
            .collect();
        places.dedup();
        assert!(places.len() < 2, "a stronger one was left out");
    }
}

#[test]
fn full_memory_keeps_the_strongest_and_says_so() {
    let pixels = scene(160, 120);
    let config = SiftConfig::default();
    let picture = Grey::new(&pixels, 160, 120).expect("the size is right");
    let (all, _) = detect(config, &pixels, 160, 120);
    let mut samples = vec![0; sift_samples_len(160, 120, &config)];
    let (mut candidates, mut keypoints) = ([Candidate::default(); 40], [Keypoint::default(); 10]);
    let mut work = SiftWork { samples: &mut samples, candidates: &mut candidates };
    let sift = Sift::new(config).expect("valid settings");
    let report = sift.detect(picture, &mut work, &mut keypoints, &mut [[0; 128]; 10]).expect("room");
    assert_eq!((report.keypoints, report.extrema), (10, all.extrema));
    assert!(report.dropped >= all.extrema - 40 && report.dropped < all.extrema - 10);
    assert!(report.truncated >= 10);
}

#[test]
fn broken_contracts_are_named() {
    let bad = |config| Sift::new(config).map(|_| ());
    let named = |name: &'static str, result: Result<()>| {
        assert!(matches!(result, Err(Error::OutOfRange { name: n, .. }) if n == name), "{result:?}");
    };
    named("sift.contrast", bad(SiftConfig { contrast: f32::NAN, ..Default::default() }));
    named("sift.edge", bad(SiftConfig { edge: 0.5, ..Default::default() }));
    let grid = Some(GridCap { cell_px: 0, most: 1 });
    named("sift.grid.cell_px", bad(SiftConfig { grid, ..Default::default() }));
    let picture = vec![0; 400];
    let picture = Grey::new(&picture, 20, 20).expect("the size is right");
    let mut work = SiftWork { samples: &mut [0; 3], candidates: &mut [] };
    let sift = Sift::new(SiftConfig::default()).expect("valid settings");
    let result = sift.detect(picture, &mut work, &mut [], &mut []);
    assert!(matches!(result, Err(Error::Size { name: "sift work samples", got: 3, .. })));
}

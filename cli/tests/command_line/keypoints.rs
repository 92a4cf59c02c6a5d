//! `keypoints`: its table.
use crate::command::{Folder, column};
use image::GrayImage;

/// A bright disc on grey, and no other keypoint.
fn disc() -> GrayImage {
    GrayImage::from_fn(80, 60, |u, v| {
        let (du, dv) = (f64::from(u) - 40.0, f64::from(v) - 30.0);
        image::Luma([(90.0 + 100.0 * (-(du * du + dv * dv) / 32.0).exp()) as u8])
    })
}

#[test]
fn a_blob_is_a_line_with_its_place_size_and_descriptor() {
    let folder = Folder::new();
    disc().save(folder.path("disc.png")).unwrap();
    let csv = folder.run("keypoints disc.png --descriptors").success();
    assert!(csv.starts_with("u,v,scale,angle,response,d0,d1,"), "{csv}");
    let number = |name: &str| column(&csv, name)[0].parse::<f64>().unwrap();
    assert!((number("u") - 40.0).hypot(number("v") - 30.0) < 0.1, "{csv}");
    assert!((number("scale") / 4.0 - 0.9).abs() < 0.1, "{csv}");
    let sum: f64 = (0..128).map(|d| number(&format!("d{d}")).powi(2)).sum();
    assert!((sum.sqrt() - 512.0).abs() < 10.0, "the descriptor's length is {}", sum.sqrt());
    let plain = folder.run("keypoints disc.png").success();
    assert!(plain.starts_with("u,v,scale,angle,response\n") && plain.lines().count() == csv.lines().count());
}

#[test]
fn brief_writes_32_bytes() {
    let folder = Folder::new();
    // The corner of a square is at (40, 30).
    let square = GrayImage::from_fn(80, 60, |u, v| image::Luma([if u >= 40 && v >= 30 { 200 } else { 50 }]));
    square.save(folder.path("square.png")).unwrap();
    let csv = folder.run("keypoints square.png --features brief --descriptors --out k.csv").success();
    assert_eq!(csv, "");
    let csv = folder.read("k.csv");
    assert_eq!(csv.lines().next().unwrap().split(',').count(), 5 + 32);
    assert_eq!((column(&csv, "u")[0], column(&csv, "v")[0]), ("40", "30"));
}

#[test]
fn pictures_without_keypoints_give_the_header_alone() {
    let folder = Folder::new();
    for (width, height) in [(1, 1), (10_000, 1), (10_000, 40), (64, 64)] {
        GrayImage::from_pixel(width, height, image::Luma([99])).save(folder.path("flat.png")).unwrap();
        for kind in ["sift", "brief"] {
            let csv = folder.run(&format!("keypoints flat.png --features {kind}")).success();
            assert_eq!(csv, "u,v,scale,angle,response\n", "{width}×{height}, {kind}");
        }
    }
    GrayImage::new(16_385, 1).save(folder.path("wide.png")).unwrap();
    folder.fails("keypoints wide.png", &["wide.png", "16385", "16384", "give a smaller picture"]);
    folder.fails("keypoints absent.png", &["absent.png"]);
}

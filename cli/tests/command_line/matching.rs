//! `match`: the homography that it finds, and why it finds none.
use crate::command::{Folder, column, data};
use image::{GrayImage, Luma};
use serde_json::Value;

/// Discs of many sizes and greys.
fn texture(width: u32, height: u32, shift: u32, seed: u32) -> GrayImage {
    let mut state = seed;
    let mut random = |most: f64| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        most * f64::from(state >> 8) / 16_777_216.0
    };
    let discs: Vec<_> = (0..width * height / 150)
        .map(|_| [random(f64::from(width)), random(f64::from(height)), 2.0 + random(6.0), random(255.0)])
        .collect();
    let mut picture = GrayImage::from_pixel(width, height, Luma([128]));
    for [x, y, radius, grey] in discs {
        let x = x - f64::from(shift);
        for v in (y - radius).max(0.0) as u32..((y + radius) as u32).min(height) {
            for u in (x - radius).max(0.0) as u32..((x + radius).max(0.0) as u32).min(width) {
                if (f64::from(u) - x).hypot(f64::from(v) - y) < radius {
                    picture.put_pixel(u, v, Luma([grey as u8]));
                }
            }
        }
    }
    image::imageops::blur(&picture, 0.8)
}

fn numbers(json: &Value, name: &str) -> Vec<f64> {
    json[name].as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

#[test]
fn a_shifted_picture_has_a_shift_as_homography() {
    let folder = Folder::new();
    texture(320, 200, 0, 7).save(folder.path("a.png")).unwrap();
    texture(320, 200, 12, 7).save(folder.path("b.png")).unwrap();
    for kind in ["sift", "brief"] {
        let json = folder
            .run(&format!("match a.png b.png --features {kind} --pairs p.csv --overlay o.png"))
            .success();
        let json: Value = serde_json::from_str(&json).unwrap();
        let m = numbers(&json, "homography");
        assert!((m.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((m[2] / m[8] + 12.0).abs() < 0.2 && (m[5] / m[8]).abs() < 0.2, "{kind}: A → B is {m:?}");
        let covariance = numbers(&json, "covariance");
        assert_eq!(covariance.len(), 81);
        // Rank 8: nothing is known, and nothing to be known, along M itself.
        let along: f64 =
            (0..9).map(|row| (0..9).map(|k| covariance[9 * row + k] * m[k]).sum::<f64>().abs()).sum();
        assert!(along < 1e-9 * covariance.iter().map(|c| c.abs()).sum::<f64>() && covariance[20] > 0.0);
        assert!(json["rms_px"].as_f64().unwrap() < 0.7, "{json}");
        let pairs = folder.read("p.csv");
        let inliers = column(&pairs, "inlier").iter().filter(|flag| **flag == "1").count();
        assert_eq!(json["matches"].as_u64().unwrap() as usize, pairs.lines().count() - 1);
        assert_eq!(json["inliers"].as_u64().unwrap() as usize, inliers);
        assert!(inliers > 30);
        assert!(image::open(folder.path("o.png")).unwrap().width() >= 640);
    }
}

#[test]
fn identical_pictures_have_the_identity() {
    let folder = Folder::new();
    texture(320, 200, 0, 7).save(folder.path("a.png")).unwrap();
    let json: Value = serde_json::from_str(&folder.run("match a.png a.png").success()).unwrap();
    for (index, element) in numbers(&json, "homography").into_iter().enumerate() {
        let expected = if index % 4 == 0 { 1.0 / 3_f64.sqrt() } else { 0.0 };
        assert!((element - expected).abs() < 1e-6, "{json}");
    }
    assert!(json["rms_px"].as_f64().unwrap() < 1e-4);
    assert!(numbers(&json, "covariance").iter().all(|element| element.is_finite()));
}

#[test]
fn pictures_without_a_homography_say_why() {
    let folder = Folder::new();
    let save = |name: &str, picture: &GrayImage| picture.save(folder.path(name)).unwrap();
    save("texture.png", &texture(320, 200, 0, 7));
    save("flat.png", &GrayImage::from_pixel(320, 200, Luma([77])));
    save("one.png", &GrayImage::new(1, 1));
    save("wide.png", &texture(10_000, 24, 0, 7));
    // Dots of their own brightness, 7 to 12 pixels apart on one line: so many that nothing fainter is looked for.
    let mut line = GrayImage::from_pixel(2600, 60, Luma([100]));
    let mut u = 30;
    for n in 0..250_u32 {
        let draw = n.wrapping_mul(2_654_435_761) >> 16;
        line.put_pixel(u, 30, Luma([140 + (draw % 115) as u8]));
        u += 7 + draw / 115 % 6;
    }
    save("line.png", &line);
    let few = "at least four matches";
    folder
        .fails("match texture.png flat.png --pairs p.csv", &["texture.png: ", few, "0 in flat.png", "help:"]);
    folder.fails("match one.png one.png", &[few]);
    folder.fails("match wide.png one.png --features brief", &[few]);
    folder.fails("match line.png line.png --features brief", &["on a line"]);
    folder.fails("match texture.png absent.png", &["absent.png"]);
    // A picture 10,000 wide is nothing special.
    let json: Value = serde_json::from_str(&folder.run("match wide.png wide.png").success()).unwrap();
    assert!(numbers(&json, "homography").iter().all(|element| element.is_finite()));
}

#[test]
fn unrelated_pictures_have_no_consensus() {
    let folder = Folder::new();
    texture(240, 160, 0, 7).save(folder.path("a.png")).unwrap();
    texture(240, 160, 0, 8).save(folder.path("b.png")).unwrap();
    folder.fails("match a.png b.png", &["a.png: ", "help:"]);
}

#[test]
fn the_box_is_found_in_its_scene() {
    let Some(pictures) = data("opencv") else { return };
    let folder = Folder::new();
    let [a, b] = ["box.png", "box_in_scene.png"].map(|name| pictures.join(name).display().to_string());
    let json: Value = serde_json::from_str(&folder.run(&format!("match {a} {b}")).success()).unwrap();
    let m = numbers(&json, "homography");
    let carry = |x: f64, y: f64| {
        let third = m[6] * x + m[7] * y + m[8];
        ((m[0] * x + m[1] * y + m[2]) / third, (m[3] * x + m[4] * y + m[5]) / third)
    };
    // Read off the scene by eye: where the box's corners are.
    for ((x, y), (u, v)) in [(0.0, 0.0), (323.0, 0.0), (323.0, 222.0), (0.0, 222.0)].into_iter().zip([
        (119.0, 162.0),
        (285.0, 175.0),
        (269.0, 298.0),
        (91.0, 272.0),
    ]) {
        let found = carry(x, y);
        assert!((found.0 - u).hypot(found.1 - v) < 5.0, "({x}, {y}) is at {found:?}, not ({u}, {v})");
    }
}

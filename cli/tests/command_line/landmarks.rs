//! `landmarks`: its table, its overlays, and the pictures it refuses.
use crate::command::{Folder, RIG, column};

fn simulated() -> Folder {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 3 --out sim").success();
    folder
}

#[test]
fn corners_have_the_range_that_their_pixel_has() {
    let folder = simulated();
    let csv = folder.run("landmarks --rig sim/rig.toml sim/frames --overlay drawn/here").success();
    let pixels: Vec<_> = column(&csv, "u").into_iter().zip(column(&csv, "v")).collect();
    assert!(pixels.len() > 3, "{csv}");
    let input: String = pixels.iter().map(|(u, v)| format!("{u},{v}\n")).collect();
    let ranges = folder.run_with_input("range --rig sim/rig.toml", &format!("u,v\n{input}")).success();
    for (found, expected) in column(&csv, "range").iter().zip(column(&ranges, "range")) {
        if found.is_empty() && expected.is_empty() {
            continue;
        }
        let ratio = found.parse::<f64>().unwrap() / expected.parse::<f64>().unwrap();
        assert!((ratio - 1.0).abs() < 1e-5, "{found} {expected}"); // pixels are printed in 32 bits
    }
    for name in ["000000", "000001", "000002"] {
        let drawn = image::open(folder.path(&format!("drawn/here/{name}.png"))).unwrap();
        assert_eq!((drawn.width(), drawn.height()), (960, 720));
    }
}

#[test]
fn a_truncated_picture_is_named_and_left_out() {
    let folder = simulated();
    let whole = std::fs::read(folder.path("sim/frames/000001.png")).unwrap();
    folder.write("sim/frames/000001.png", &whole[..whole.len() / 2]);
    let outcome = folder.run("landmarks --rig sim/rig.toml sim/frames");
    assert_eq!(outcome.status, 0, "{}", outcome.stderr);
    assert!(
        outcome.stderr.contains("left out: sim/frames/000001.png: the picture is damaged"),
        "{}",
        outcome.stderr
    );
    let images = column(&outcome.stdout, "image");
    assert!(images.contains(&"sim/frames/000000.png") && !images.contains(&"sim/frames/000001.png"));
}

#[test]
fn pictures_that_cannot_be_used_are_refused() {
    let folder = simulated();
    folder.write("rig.toml", RIG.replace("width = 320", "width = 640"));
    folder.fails(
        "landmarks --rig rig.toml sim/frames --overlay drawn",
        &["000000.png: the picture is 320×240", "640×240"],
    );
    folder.write("empty/notes.txt", "no picture");
    folder.fails("landmarks --rig sim/rig.toml empty", &["empty: the folder holds no picture"]);
    folder.fails("landmarks --rig sim/rig.toml absent.png", &["absent.png: no such file"]);
    folder.fails(
        "landmarks --rig sim/rig.toml empty/notes.txt --overlay drawn",
        &["none of the pictures could be read"],
    );
    folder.write("rig.toml", format!("{RIG}\n[extract]\nreach_pix = 3\n"));
    folder.fails(
        "landmarks --rig rig.toml sim/frames",
        &["line 14", "`extract.reach_pix`", "`extract.reach_px`"],
    );
    folder.write("rig.toml", format!("{RIG}\n[extract]\nopening = 2.5\n"));
    folder.fails(
        "landmarks --rig rig.toml sim/frames",
        &["line 14", "`extract.opening` is 2.5", "whole number"],
    );
    folder.write("rig.toml", format!("{RIG}\n[extract]\nopening = 30\n"));
    folder
        .fails("landmarks --rig rig.toml sim/frames", &["line 14", "`extract.opening` is 30", "from 1 to 6"]);
}

#[test]
fn proposals_are_shown_with_what_they_are_worth_and_a_picture_without_a_corner_says_why() {
    let folder = simulated();
    let corners = folder.run("landmarks --rig sim/rig.toml sim/frames").success();
    let proposals = folder.run("landmarks --rig sim/rig.toml sim/frames --proposals").success();
    let worth = |csv: &str| -> Vec<f64> {
        column(csv, "probability").iter().map(|value| value.parse().expect("a number")).collect()
    };
    assert!(worth(&corners).iter().all(|p| *p >= 0.5 && *p <= 1.0));
    assert!(worth(&proposals).len() > worth(&corners).len());
    assert!(worth(&proposals).iter().any(|p| *p < 0.5));
    let fewer = folder.run("landmarks --rig sim/rig.toml sim/frames --min-probability 0.8").success();
    assert!(worth(&fewer).iter().all(|p| *p >= 0.8) && worth(&fewer).len() < worth(&corners).len());
    let strict = folder.run("landmarks --rig sim/rig.toml sim/frames --min-probability 1");
    assert!(
        strict.stderr.contains("3 of 3 pictures have no corner: what was found is less likely"),
        "{}",
        strict.stderr
    );
    let refused = folder.run("landmarks --rig sim/rig.toml sim/frames --min-probability 1.5");
    assert!(refused.status == 2 && refused.stderr.contains("from 0 to 1"), "{}", refused.stderr);
}

//! `scan`: its table, its overlays, and what it refuses.
use crate::command::{Folder, column};

#[test]
fn every_picture_has_a_row_for_every_beam_and_unknown_is_never_free() {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 4 --out sim").success();
    let csv = folder
        .run("scan --rig sim/rig.toml --frames sim/frames --odometry sim/odometry.csv --beams 21 --field 40 --overlay drawn")
        .success();
    assert_eq!(csv.lines().next(), Some("t,bearing,free,range,var_range,kind"));
    assert_eq!(csv.lines().count(), 1 + 4 * 21);
    let number = |text: &str| text.parse::<f64>().unwrap();
    let mut known = 0;
    for (((free, range), var), kind) in column(&csv, "free")
        .iter()
        .zip(column(&csv, "range"))
        .zip(column(&csv, "var_range"))
        .zip(column(&csv, "kind"))
    {
        match kind {
            "boundary" | "obstacle" => {
                known += 1;
                assert!(number(free) <= number(range) && number(var) > 0.0, "{free} {range} {var}");
            }
            "unknown" | "beyond" => assert!(range.is_empty() && var.is_empty()),
            _ => panic!("{kind}"),
        }
    }
    assert!(known > 40, "{csv}");
    let bearings = column(&csv, "bearing");
    assert!(
        (number(bearings[0]) + 20_f64.to_radians()).abs() < 1e-6
            && (number(bearings[20]) - 20_f64.to_radians()).abs() < 1e-6
    );
    let drawn = image::open(folder.path("drawn/000003.png")).unwrap();
    assert_eq!((drawn.width(), drawn.height()), (960, 720));
}

#[test]
fn a_field_or_beams_that_make_no_sense_are_refused() {
    let folder = Folder::new();
    for wrong in ["--field 0", "--field 181", "--beams 1", "--beams 97"] {
        assert_eq!(folder.run(&format!("scan --rig rig.toml --frames frames {wrong}")).status, 2, "{wrong}");
    }
}

//! Pictures as people have them: cut short, turned by a tag, in the low bits of sixteen, in odd folders.
use crate::command::{Folder, RIG, column};
use image::{ExtendedColorType, GrayImage, ImageBuffer, ImageEncoder, Luma, codecs::jpeg::JpegEncoder};

/// A frame of a drive, and a rig for it.
fn frame() -> (Folder, GrayImage) {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 1 --walkers 0 --out sim").success();
    folder.write("rig.toml", RIG);
    let picture = image::open(folder.path("sim/frames/000000.png")).unwrap().to_luma8();
    (folder, picture)
}

fn jpeg(picture: &GrayImage, orientation: u8) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut file, 95);
    // A TIFF header and one entry: tag 0x112 (orientation), a short.
    let exif =
        [b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".as_slice(), &[orientation, 0, 0, 0, 0, 0, 0, 0]]
            .concat();
    encoder.set_exif_metadata(exif).unwrap();
    encoder.write_image(picture, picture.width(), picture.height(), ExtendedColorType::L8).unwrap();
    file
}

#[test]
fn a_picture_that_is_cut_short_is_left_out_by_name() {
    let (folder, picture) = frame();
    let whole = jpeg(&picture, 1);
    folder.write("half.jpg", &whole[..whole.len() / 2]).write("whole.jpg", &whole);
    folder.fails("landmarks --rig rig.toml half.jpg", &["half.jpg", "cut short", "none of the pictures"]);
    folder.fails("keypoints half.jpg", &["half.jpg", "cut short", "help:"]);
    let said = folder.run("landmarks --rig rig.toml half.jpg whole.jpg");
    assert!(said.status == 0 && said.stderr.contains("left out: half.jpg"), "{said:?}");
}

#[test]
fn a_picture_is_turned_as_its_tag_says() {
    let (folder, picture) = frame();
    let upside_down = image::imageops::rotate180(&picture);
    folder.write("upright.jpg", jpeg(&picture, 1)).write("turned.jpg", jpeg(&upside_down, 3));
    let corners =
        |name: &str| column(&folder.run(&format!("landmarks --rig rig.toml {name}")).success(), "u").len();
    assert!(corners("upright.jpg") > 0);
    assert_eq!(corners("turned.jpg"), corners("upright.jpg"));
    // The tag counts before the size is compared: this one is 240×320 until it is turned.
    folder.write("on-its-side.jpg", jpeg(&image::imageops::rotate270(&picture), 6));
    assert_eq!(corners("on-its-side.jpg"), corners("upright.jpg"));
    folder.write("side.jpg", jpeg(&image::imageops::rotate270(&picture), 1));
    folder.fails("landmarks --rig rig.toml side.jpg", &["side.jpg", "240×320", "turned by 90°"]);
}

#[test]
fn twelve_bits_in_sixteen_are_said_to_be_black() {
    let (folder, picture) = frame();
    let deep = ImageBuffer::from_fn(320, 240, |u, v| Luma([u16::from(picture.get_pixel(u, v)[0]) << 4]));
    deep.save(folder.path("dark.png")).unwrap();
    let said = folder.run("keypoints dark.png --features brief");
    assert!(
        said.status == 0 && said.stderr.starts_with("warning: dark.png: the picture is almost black"),
        "{said:?}"
    );
    assert!(said.stderr.contains("12 or 14 bits"), "{}", said.stderr);
}

#[test]
fn odd_folders_are_passed_over_and_times_in_names_go_by_value() {
    let (folder, _) = frame();
    let names = ["1305031102.1", "1305031102.15", "1305031102.2"];
    for name in names {
        std::fs::create_dir_all(folder.path("f")).unwrap();
        std::fs::copy(folder.path("sim/frames/000000.png"), folder.path(&format!("f/{name}.png"))).unwrap();
    }
    std::fs::create_dir(folder.path("f/thumbs.png")).unwrap();
    let table = folder.run("landmarks --rig rig.toml f").success();
    let mut order = column(&table, "image");
    order.dedup();
    assert_eq!(order, names.map(|name| format!("f/{name}.png")));
}

#[test]
fn a_camera_that_froze_is_not_called_consistent() {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 12 --walkers 0 --out sim").success();
    for frame in 1..12 {
        std::fs::copy(
            folder.path("sim/frames/000000.png"),
            folder.path(&format!("sim/frames/{frame:06}.png")),
        )
        .unwrap();
    }
    let said =
        folder.run("slam --rig sim/rig.toml --frames sim/frames --odometry sim/odometry.csv --out out");
    assert!(said.status == 0 && said.stdout.contains("unchecked"), "{said:?}");
    assert!(said.stderr.contains("11 of 12 pictures are the one before"), "{}", said.stderr);
}

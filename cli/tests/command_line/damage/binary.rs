//! Pictures and recordings, which have no lines: the file by its name, what it looks like, and what to do.
use crate::command::{Folder, RIG};
use image::{GrayImage, ImageFormat, Luma};
use std::io::Cursor;

const ONE: &str = "landmarks --rig rig.toml";
const BAG: &str = "slam --rig rig.toml --out out --bag";

fn picture(format: ImageFormat) -> Vec<u8> {
    let grey = GrayImage::from_fn(320, 240, |u, v| Luma([(u * v % 251) as u8]));
    let mut bytes = Cursor::new(Vec::new());
    grey.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn with(mut bytes: Vec<u8>, place: usize, flipped: u8) -> Vec<u8> {
    bytes[place] ^= flipped;
    bytes
}

#[test]
fn a_damaged_picture_is_answered_with_its_name_and_what_to_do() {
    let folder = Folder::new();
    folder.write("rig.toml", RIG);
    let [png, jpeg, pgm] = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Pnm].map(picture);
    let half = |bytes: &[u8]| bytes[..bytes.len() / 2].to_vec();
    let small = {
        let mut bytes = Cursor::new(Vec::new());
        GrayImage::new(160, 120).write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    let cases: [(&str, Vec<u8>, &[&str]); 14] = [
        ("empty.png", Vec::new(), &["is empty", "copy the picture again"]),
        (
            "text.png",
            b"\xef\xbb\xbfno picture\r\n".to_vec(),
            &["is not a PNG, JPEG or PNM picture", "save it as PNG"],
        ),
        (
            "picture.webp",
            b"RIFF\x24\x00\x00\x00WEBPVP8 ".to_vec(),
            &["is not a PNG, JPEG or PNM picture", "save it as PNG"],
        ),
        ("head.png", png[..20].to_vec(), &["damaged or cut short"]),
        ("cut.png", half(&png), &["damaged or cut short"]),
        ("flipped.png", with(png.clone(), png.len() / 2, 0xff), &["damaged or cut short", "CRC"]),
        ("wide.png", with(png.clone(), 16, 0x7f), &["damaged or cut short", "CRC"]),
        ("cut.jpg", half(&jpeg), &["cut short", "JPEG data has no end"]),
        ("head.jpg", jpeg[..10].to_vec(), &["cut short"]),
        ("cut.pgm", half(&pgm), &["damaged or cut short"]),
        ("words.pgm", b"P5 320 wide 255\n".to_vec(), &["damaged or cut short"]),
        ("none.pgm", b"P5 0 0 255\n".to_vec(), &["0×0", "320×240"]),
        ("huge.pgm", b"P5 4000000000 4000000000 255\n".to_vec(), &["4000000000×4000000000", "320×240"]),
        ("small.png", small, &["160×120", "320×240", "2 times"]),
    ];
    for (name, bytes, words) in cases {
        folder.write(name, bytes);
        folder.fails(&format!("{ONE} {name}"), &[&[name], words].concat());
    }
    for (name, bytes) in [("sound.png", png), ("sound.jpg", jpeg), ("sound.pgm", pgm)] {
        folder.write(name, bytes).run(&format!("{ONE} {name}")).success();
    }
}

#[test]
fn a_damaged_recording_is_answered_with_its_name_and_what_to_do() {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 3 --out sim").success();
    folder.write("rig.toml", folder.read("sim/rig.toml"));
    let drive = "--frames sim/frames --times sim/times.txt --odometry sim/odometry.csv";
    folder.run(&format!("slam --rig rig.toml {drive} --out run --mcap run.mcap")).success();
    let mcap = std::fs::read(folder.path("run.mcap")).unwrap();
    let database = [b"SQLite format 3\0".as_slice(), &[7; 2000]].concat();
    let cases: [(&str, Vec<u8>, &[&str]); 9] = [
        ("empty.mcap", Vec::new(), &["is empty", "record the drive again"]),
        ("text.mcap", b"no recording\n".to_vec(), &["neither MCAP nor a rosbag2 database"]),
        ("text.db3", b"no recording\n".to_vec(), &["neither MCAP nor a rosbag2 database"]),
        ("head.mcap", mcap[..60].to_vec(), &["is cut off before its first picture", "copy the file again"]),
        ("flipped.mcap", with(mcap.clone(), 20, 0xff), &["is damaged", "mcap recover"]),
        ("empty.db3", Vec::new(), &["is empty"]),
        ("damaged.db3", database, &["is a damaged SQLite file", "recover"]),
        ("bag/empty.mcap", Vec::new(), &["is empty"]),
        // Its pictures are the run's overlays, twice as large as the camera's.
        ("overlays.mcap", mcap, &["640×480", "320×240"]),
    ];
    for (name, bytes, words) in cases {
        folder.write(name, bytes);
        folder.fails(&format!("{BAG} {name}"), &[&[name, "help:"], words].concat());
    }
    std::fs::create_dir(folder.path("nothing")).unwrap();
    folder.fails(&format!("{BAG} nothing"), &["nothing", "no .mcap and no .db3 file"]);
    folder.fails(&format!("{BAG} absent.mcap"), &["absent.mcap", "check the path"]);
}

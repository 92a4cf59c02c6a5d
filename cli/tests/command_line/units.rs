//! Another unit, sign, order or size than is meant: said, or refused where the result would be worthless.
use crate::command::{Folder, RIG};
use image::GrayImage;

const RUN: &str = "slam-log --odometry o.csv --measurements m.csv --truth t.csv --true-map map.csv --out out";

/// A circle of 5 m at 1 m/s past three landmarks with names, for 12 s.
fn drive() -> Folder {
    let folder = Folder::new();
    let (mut odometry, mut truth, mut measured) =
        (String::from("t,v,omega\n"), String::from("t,x,y,heading\n"), String::from("t,range,bearing,id\n"));
    for tick in 0..=120 {
        let t = f64::from(tick) / 10.0;
        let heading = 0.2 * t;
        let (x, y) = (5.0 * heading.sin(), 5.0 * (1.0 - heading.cos()));
        odometry += &format!("{t},1,0.2\n");
        truth += &format!("{t},{x},{y},{heading}\n");
        for (id, [lx, ly]) in [[4.0, 2.0], [14.0, -2.0], [9.0, 3.0]].iter().enumerate() {
            let bearing = (ly - y).atan2(lx - x) - heading;
            measured +=
                &format!("{t},{},{},{id}\n", (lx - x).hypot(ly - y), bearing.sin().atan2(bearing.cos()));
        }
    }
    folder.write("o.csv", odometry).write("t.csv", truth).write("m.csv", measured);
    folder.write("map.csv", "id,x,y\n0,4,2\n1,14,-2\n2,9,3\n");
    folder
}

/// Multiplies a column of a table of numbers.
fn scaled(csv: &str, column: usize, factor: f64) -> String {
    let line = |(number, line): (usize, &str)| {
        let mut cells: Vec<_> = line.split(',').map(str::to_owned).collect();
        if number > 0 {
            cells[column] = (cells[column].parse::<f64>().unwrap() * factor).to_string();
        }
        cells.join(",") + "\n"
    };
    csv.lines().enumerate().map(line).collect()
}

#[track_caller]
fn warned(folder: &Folder, command: &str, words: &[&str]) -> String {
    let outcome = folder.run(command);
    assert_eq!(outcome.status, 0, "{}", outcome.stderr);
    for word in words {
        assert!(outcome.stderr.contains(word), "`{word}` is missing from: {}", outcome.stderr);
    }
    let _ = std::fs::remove_dir_all(folder.path("out"));
    outcome.stdout
}

#[test]
fn a_sound_log_is_not_doubted() {
    let outcome = drive().run(RUN);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (0, ""));
}

#[test]
fn a_log_in_other_units_is_said() {
    let folder = drive();
    let files = ["o.csv", "m.csv", "t.csv", "map.csv"].map(|name| (name, folder.read(name)));
    for (name, columns, factor, words) in [
        ("m.csv", [1].as_slice(), 100.0, ["m.csv: the ranges change by", "look like centimetres"]),
        ("m.csv", &[1], 1000.0, ["m.csv: the ranges change by", "look like millimetres"]),
        ("m.csv", &[2], -1.0, ["m.csv: the bearings turn against", "positive to the right"]),
        ("t.csv", &[1, 2], 100.0, ["the true path spans", "centimetres"]),
        ("map.csv", &[1, 2], 1000.0, ["the true map spans", "millimetres"]),
        ("o.csv", &[1], 100.0, ["o.csv: the median speed is 100 m/s", "centimetres"]),
        ("o.csv", &[1], -1.0, ["calls its result lost", "drives backwards"]),
        ("o.csv", &[2], -1.0, ["m.csv: the bearings turn against", "turn rates are"]),
    ] {
        let sound = &files.iter().find(|(file, _)| *file == name).unwrap().1;
        let wrong = columns.iter().fold(sound.clone(), |text, column| scaled(&text, *column, factor));
        folder.write(name, wrong);
        warned(&folder, RUN, &words);
        folder.write(name, sound);
    }
    let named =
        folder.read("map.csv").replace("\n0,", "\n10,").replace("\n1,", "\n11,").replace("\n2,", "\n12,");
    folder.write("map.csv", named);
    let said = warned(&folder, RUN, &["none of the map's 3 landmarks is one of the 3 true ones"]);
    assert!(said.contains("map error  none"), "nothing compared is no error of 0: {said}");
}

#[test]
fn faults_of_a_sensor_are_refused_with_their_line() {
    let folder = drive();
    let (odometry, measured) = (folder.read("o.csv"), folder.read("m.csv"));
    for (word, place) in [("1e30,0.2", "`v` is 1e30"), ("1,1e30", "`omega` is 1e30")] {
        folder.write("o.csv", odometry.replace("\n0.3,1,0.2\n", &format!("\n0.3,{word}\n")));
        folder.fails(RUN, &["o.csv, line 5", place, "help:"]);
    }
    folder.write("o.csv", odometry.replace("\n0.3,1,0.2\n", "\n0.3,500,0.2\n"));
    warned(&folder, RUN, &["o.csv: 1 of 121 speeds are above 100 m/s"]);
    folder.write("o.csv", odometry);
    let line = measured.lines().nth(4).unwrap();
    let [t, _, bearing, id] = line.split(',').collect::<Vec<_>>()[..] else { panic!("{line}") };
    folder.write("m.csv", measured.replace(line, &format!("{t},65535,{bearing},{id}")));
    folder.fails(RUN, &["m.csv, line 5", "the range is 65535", "no echo"]);
    folder.write("m.csv", "t,range,bearing,id\n");
    folder.fails(RUN, &["m.csv: holds no measurement", "help:"]);
    folder.write("m.csv", measured);
    let truth = folder.read("t.csv");
    let line = truth.lines().nth(51).unwrap();
    folder.write("t.csv", truth.replace(line, "5,5000,0,1"));
    warned(&folder, RUN, &["t.csv, line 52: the pose is 499", "2 such steps"]);
    assert!(folder.run(&format!("{RUN} --range-std -1")).stderr.contains("'-1' for '--range-std"));
}

#[test]
fn times_with_names_or_numbers_are_understood_or_refused() {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 4 --walkers 0 --out sim").success();
    let run = "scan --rig sim/rig.toml --frames sim/frames --times times.txt --beams 9";
    let times: Vec<f64> = folder.read("sim/times.txt").lines().map(|line| line.parse().unwrap()).collect();
    let list = |line: &dyn Fn(usize, f64) -> String| -> String {
        times.iter().enumerate().map(|(number, time)| line(number, *time) + "\n").collect()
    };
    folder.write("times.txt", list(&|_, time| time.to_string()));
    let plain = folder.run(run).success();
    folder.write("times.txt", list(&|number, time| format!("{time} frames/{number:06}.png")));
    assert_eq!(folder.run(run).success(), plain);
    folder.write("times.txt", list(&|number, time| format!("{time},{:06}.png", 3 - number)));
    let turned = folder.run(run).success();
    for number in 0..4 {
        let frame = std::fs::read(folder.path(&format!("sim/frames/{number:06}.png"))).unwrap();
        folder.write(&format!("turned/{}.png", 3 - number), frame);
    }
    folder.write("times.txt", list(&|_, time| time.to_string()));
    assert!(
        turned != plain && turned == folder.run(&run.replace("sim/frames", "turned")).success(),
        "a list's own order"
    );
    folder.write("times.txt", list(&|number, time| format!("{number} {time}")));
    folder.fails(run, &["times.txt, line 1", "frame's number", "help:"]);
    folder.write("times.txt", list(&|number, time| format!("{time} other{number}.png")));
    folder.fails(run, &["times.txt: names the picture `other0.png`, which is not in", "help:"]);
}

#[test]
fn every_reader_of_a_folder_says_what_it_leaves_out() {
    let folder = Folder::new();
    folder.run("simulate --scene corridor --frames 6 --walkers 0 --out sim").success();
    let whole = std::fs::read(folder.path("sim/frames/000004.png")).unwrap();
    folder.write("sim/frames/000004.png", &whole[..whole.len() / 3]);
    for command in [
        "landmarks --rig sim/rig.toml sim/frames",
        "scan --rig sim/rig.toml --frames sim/frames",
        "slam --rig sim/rig.toml --frames sim/frames --odometry sim/odometry.csv --out out",
        "calibrate-mount --rig sim/rig.toml --frames sim/frames",
    ] {
        warned(&folder, command, &["warning: left out: sim/frames/000004.png"]);
    }
    folder.write("sim/frames/000004.png", &whole).write("sim/frames/thumbs.tif", "II*");
    for command in
        ["landmarks --rig sim/rig.toml sim/frames", "calibrate-mount --rig sim/rig.toml --frames sim/frames"]
    {
        warned(
            &folder,
            command,
            &["sim/frames: the folder holds 1 pictures of formats that are not read (thumbs.tif)"],
        );
    }
    folder.write("bmp/a.bmp", "BM");
    folder.fails(
        "landmarks --rig sim/rig.toml bmp",
        &["bmp: the folder holds no picture", "(a.bmp): convert them to PNG"],
    );
    // A picture of another size in the middle of the folder.
    GrayImage::new(160, 120).save(folder.path("sim/frames/000003.png")).unwrap();
    for command in ["landmarks --rig sim/rig.toml sim/frames", "scan --rig sim/rig.toml --frames sim/frames"]
    {
        folder.fails(command, &["sim/frames/000003.png", "160×120", "2 times the other", "help:"]);
    }
}

#[test]
fn points_and_pixels_that_are_read_otherwise_are_named() {
    let folder = Folder::new();
    folder.write("rig.toml", RIG);
    // (u, v, range, bearing) of that rig, to a centimetre and half a degree.
    let points = [
        [60.0, 200.0, 0.88, 0.22],
        [250.0, 195.0, 0.92, -0.27],
        [60.0, 150.0, 1.33, 0.23],
        [240.0, 140.0, 1.5, -0.25],
    ];
    let table = |header: &str, read: &dyn Fn([f64; 4]) -> [f64; 4]| {
        let rows = points.iter().map(|point| read(*point).map(|number| number.to_string()).join(","));
        format!("{header}\n{}\n", rows.collect::<Vec<_>>().join("\n"))
    };
    let polar = "u,v,range,bearing";
    let run = "calibrate-mount --rig rig.toml --points p.csv --fit tilt,height,yaw";
    folder.write("p.csv", table(polar, &|point| point));
    folder.run(run).success();
    let fails = |text: String, words: &[&str]| {
        folder.write("p.csv", text);
        folder.fails(run, &[&["p.csv", "help:"], words].concat());
    };
    fails(table(polar, &|[u, v, r, b]| [u, v, r, b.to_degrees()]), &["degrees"]);
    fails(table(polar, &|[u, v, r, b]| [u, v, r, -b]), &["positive to the right"]);
    fails(table("u,v,x,y", &|[u, v, r, b]| [u, v, r * b.sin(), r * b.cos()]), &["x and y look exchanged"]);
    fails(table(polar, &|[u, v, r, b]| [u, v, 100.0 * r, b]), &["centimetres"]);
    fails(
        table(polar, &|[u, v, r, b]| [8.0 * u, 8.0 * v, r, b]),
        &["line 2", "is not in the picture of 320×240"],
    );
    fails(format!("{polar}\n"), &["holds no point"]);
    folder.write("p.csv", "u,v\n0.5,0.9\n0.3,0.8\n");
    warned(&folder, "range --rig rig.toml p.csv", &["parts of the picture's size"]);
    folder.write("p.csv", "u,v\n1600,1200\n");
    warned(&folder, "range --rig rig.toml p.csv", &["none of the 1 pixels lies in the picture"]);
    let plain = RIG.replace("distortion = [-0.22776, 0.36413, -0.00545, -0.00192, 0.0]\n", "");
    folder.write("rig.toml", plain).write("p.csv", "u,v\n160,200\n");
    warned(&folder, "range --rig rig.toml p.csv", &["rig.toml, line 1: `camera.distortion` is missing"]);
}

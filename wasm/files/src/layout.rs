//! What the files of a drop are to one another: pictures in order, and the text files beside them, read by the
//! command line's own readers. A file of no use is a note; only one that is meant, and wrong, is an error.
use crate::drop::{Drop, plural, sentence};
use crate::kinds::{Kind, base_name, is_litter};
use monorange_core::geometry::{Camera, Lens, Pose, RangeFinder};
use monorange_core::pipeline::{self, Config};
use monorange_formats::evaluation::{MAX_TRUTH_GAP, Truth};
use monorange_formats::files::{
    self, Intrinsics, Odometry, Rig, Table, changed_settings, memory, read_times, read_trajectory,
};
use monorange_formats::pictures::times_in_names;
use monorange_formats::{plausibility, warnings};
use monorange_protocol::{conversion::message_from_config, message::Answers};
use monorange_wasm_record::{Reading, record::readings_to_bytes};
use nalgebra::Vector2;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use wasm_bindgen::prelude::*;

type Answer<T> = Result<T, String>;

/// Seconds between pictures whose times nobody has given.
const INTERVAL: f64 = 0.1;
/// More points of a laser would only be drawn over one another.
const MOST_LASER_POINTS: usize = 20_000;

/// Makes a file readable under its path.
#[wasm_bindgen]
pub fn offer(path: &str, content: Vec<u8>) {
    memory::offer(path, content);
}

/// Forgets every file that was offered, and what was said of it.
#[wasm_bindgen]
pub fn forget_all() {
    memory::withdraw_all();
    warnings::forget();
}

/// Whether the file is a text file that a sequence may need.
#[wasm_bindgen]
pub fn wants(path: &str) -> bool {
    !is_litter(path)
        && !matches!(Kind::of(path), Kind::Picture | Kind::Video | Kind::Container | Kind::List | Kind::Other)
}

/// Width and height of a picture, by the first bytes of its file.
#[wasm_bindgen(js_name = sizeOf)]
pub fn size_of(head: &[u8]) -> Option<Vec<u32>> {
    let size = imagesize::blob_size(head).ok()?;
    Some(vec![u32::try_from(size.width).ok()?, u32::try_from(size.height).ok()?])
}

/// What the files of a drop are to one another. Of `paths` the first `fresh` have just been given; the files that
/// [`wants`] names have been offered. `streamed` is the number of pictures of a video, `interval` seconds apart.
///
/// # Errors
/// A sentence with the file, the line and the key.
#[wasm_bindgen]
pub fn layout(
    paths: Vec<String>,
    fresh: usize,
    streamed: Option<usize>,
    interval: f64,
) -> Result<Layout, JsError> {
    let video = streamed.map(|count| (count, interval));
    Layout::new(&paths, fresh, video).map_err(|reason| JsError::new(&reason))
}

/// A drop in order.
#[wasm_bindgen]
pub struct Layout {
    frames: Vec<u32>,
    times: Vec<f64>,
    title: String,
    name: String,
    rig: Option<Value>,
    rig_size: Option<[u32; 2]>,
    rig_source: String,
    odometry: Option<Odometry>,
    truth: Option<Vec<f32>>,
    laser: Option<Vec<f32>>,
    used: bool,
    brought: &'static str,
    notes: Vec<String>,
    warnings: Vec<String>,
}

#[wasm_bindgen]
impl Layout {
    /// Which of the paths are the pictures, in order.
    #[wasm_bindgen(getter)]
    pub fn frames(&self) -> Vec<u32> {
        self.frames.clone()
    }
    /// Seconds.
    #[wasm_bindgen(getter)]
    pub fn times(&self) -> Vec<f64> {
        self.times.clone()
    }
    /// As the command line names a run: the folder of frames and the one that it is in.
    #[wasm_bindgen(getter)]
    pub fn title(&self) -> String {
        self.title.clone()
    }
    /// For the page.
    #[wasm_bindgen(getter)]
    pub fn name(&self) -> String {
        self.name.clone()
    }
    /// The rig, or null.
    #[wasm_bindgen(getter)]
    pub fn rig(&self) -> JsValue {
        let text = self.rig.as_ref().map(Value::to_string);
        text.and_then(|text| js_sys::JSON::parse(&text).ok()).unwrap_or(JsValue::NULL)
    }
    /// Its width and height.
    #[wasm_bindgen(getter, js_name = rigSize)]
    pub fn rig_size(&self) -> Option<Vec<u32>> {
        self.rig_size.map(Vec::from)
    }
    /// The file that it came from.
    #[wasm_bindgen(getter, js_name = rigSource)]
    pub fn rig_source(&self) -> String {
        self.rig_source.clone()
    }
    /// Whether there is odometry.
    #[wasm_bindgen(getter)]
    pub fn wheels(&self) -> bool {
        self.odometry.is_some()
    }
    /// The true x, y, heading at each frame, relative to the first one; not a number where the truth is silent.
    #[wasm_bindgen(getter)]
    pub fn truth(&self) -> JsValue {
        self.truth.as_deref().map_or(JsValue::NULL, |rows| js_sys::Float32Array::from(rows).into())
    }
    /// Points of a laser as x, y, relative to the first true pose where there is one.
    #[wasm_bindgen(getter)]
    pub fn laser(&self) -> JsValue {
        self.laser.as_deref().map_or(JsValue::NULL, |rows| js_sys::Float32Array::from(rows).into())
    }
    /// Whether any of the fresh files is of use.
    #[wasm_bindgen(getter)]
    pub fn used(&self) -> bool {
        self.used
    }
    /// What of the rig the fresh files bring: "rig", "camera" or nothing.
    #[wasm_bindgen(getter)]
    pub fn brought(&self) -> String {
        self.brought.to_owned()
    }
    /// Sentences about files that were left aside.
    #[wasm_bindgen(getter)]
    pub fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }
    /// What looks wrong in the files and is used all the same, a sentence each.
    #[wasm_bindgen(getter)]
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }
    /// Length of the way that the wheels made between two times, m.
    pub fn way(&self, from: f64, to: f64) -> f64 {
        let motions = self.odometry.iter().flat_map(|wheels| wheels.between(from, to));
        motions.map(|motion| motion.way()).sum()
    }
    /// The robot's motion by its wheels between two times: forward, left (m), turn (rad); nothing where the log has a gap.
    pub fn motion(&self, from: f64, to: f64) -> Option<Vec<f32>> {
        let Pose { x, y, heading } = self.odometry.as_ref()?.motion(from, to)?;
        Some(vec![x, y, heading])
    }
    /// The odometry's readings between two times, as the pipeline's module reads them.
    pub fn between(&self, from: f64, to: f64) -> Vec<u8> {
        let reading = |motion: &files::Control| match motion.reading() {
            pipeline::Odometry::Velocity { v, omega, .. } => {
                Reading::Velocity { seconds: motion.duration, v, omega }
            }
            pipeline::Odometry::Increment { forward, left, turn, .. } => {
                Reading::Increment { seconds: motion.duration, forward, left, turn }
            }
        };
        let readings = self.odometry.iter().flat_map(|wheels| wheels.between(from, to));
        let readings: Vec<_> = readings.map(|motion| reading(&motion)).collect();
        readings_to_bytes(&readings).unwrap_or_default()
    }
}

impl Layout {
    /// As [`layout`], for Rust; `video` is a video's number of pictures and seconds between them.
    ///
    /// # Errors
    /// As [`layout`].
    pub fn new(paths: &[String], fresh: usize, video: Option<(usize, f64)>) -> Answer<Self> {
        let mut drop = Drop::sort(paths, fresh);
        let frames = if video.is_some() { Vec::new() } else { drop.main_folder() };
        let count = video.map_or(frames.len(), |(count, _)| count);
        if count == 0 && drop.first(Kind::Rig).is_none() && drop.first(Kind::Camera).is_none() {
            return Err(drop.nothing_to_show());
        }
        let first = frames.first().and_then(|&index| paths.get(index as usize)).map_or("", String::as_str);
        let folders: Vec<_> = first.split('/').collect();
        let folders = folders.get(..folders.len() - 1).unwrap_or_default();
        let title = folders.get(folders.len().saturating_sub(2)..).unwrap_or_default().join("/");
        let name = match folders.first() {
            Some(folder) => (*folder).to_owned(),
            None if count == 1 && !first.is_empty() => first.to_owned(),
            None => plural(count, "picture"),
        };
        let interval = video.map_or(INTERVAL, |(_, interval)| interval);
        let mut layout = Self {
            title: if title.is_empty() { name.clone() } else { title },
            name,
            times: (0..count).map(|frame| frame as f64 * interval).collect(),
            frames,
            rig: None,
            rig_size: None,
            rig_source: String::new(),
            odometry: None,
            truth: None,
            laser: None,
            used: false,
            brought: "",
            notes: Vec::new(),
            warnings: Vec::new(),
        };
        layout.read_rig(&mut drop)?;
        layout.read_beside(&mut drop, paths)?;
        drop.say_what_is_left(count);
        layout.used = drop.used;
        layout.notes.extend(drop.notes);
        layout.warnings = warnings::fresh();
        Ok(layout)
    }

    /// The rig, or a camera file; one that was given after the rig takes the place of the rig's camera.
    fn read_rig(&mut self, drop: &mut Drop) -> Answer<()> {
        let rig = drop.one(Kind::Rig);
        let replaces = rig.as_ref().is_none_or(|(_, fresh)| !fresh);
        let text = rig.as_ref().and_then(|(path, _)| files::read_text(Path::new(path)).ok());
        let camera = drop.camera(replaces, text.as_deref().unwrap_or_default());
        if let Some((path, fresh)) = &rig {
            self.brought = if *fresh { "rig" } else { "" };
            let rig = Rig::read(Path::new(path)).map_err(sentence)?;
            self.take_rig(rig_entries(&rig)?, base_name(path));
        }
        let Some((path, camera, fresh)) = camera else { return Ok(()) };
        if fresh {
            self.brought = "camera";
        }
        let entries = camera_entries(&camera);
        let source = base_name(&path).to_owned();
        match &mut self.rig {
            Some(Value::Object(rig)) => {
                if let Value::Object(entries) = entries {
                    rig.extend(entries);
                }
                drop.notes.push(format!(
                    "The camera is {source}’s now; how it sits is still {}’s.",
                    self.rig_source
                ));
            }
            _ => {
                self.rig = Some(entries);
                drop.notes.push(format!(
                    "{source} says nothing of how the camera sits: set its height and tilt in Set-up."
                ));
            }
        }
        self.rig_size = Some([camera.width as u32, camera.height as u32]);
        self.rig_source = source;
        Ok(())
    }

    fn take_rig(&mut self, entries: Value, source: &str) {
        let size = |key: &str| entries.get(key).and_then(Value::as_u64).unwrap_or_default() as u32;
        self.rig_size = Some([size("width"), size("height")]);
        self.rig_source = source.to_owned();
        self.rig = Some(entries);
    }

    fn read_beside(&mut self, drop: &mut Drop, paths: &[String]) -> Answer<()> {
        if let Some((path, _)) = drop.one(Kind::Times) {
            let times = read_times(Path::new(&path)).map_err(sentence)?;
            let (given, pictures) = (times.len(), self.times.len());
            if given != pictures {
                return Err(format!(
                    "{} has {} for {}. Give one time a picture, in the order of the pictures’ names.",
                    base_name(&path),
                    plural(given, "time"),
                    plural(pictures, "picture")
                ));
            }
            self.times = times;
        } else if let Some((folder, times)) = times_of_names(&self.frames, paths) {
            plausibility::check_steps(&folder, &times).map_err(sentence)?;
            self.times = times;
        } else if drop.first(Kind::Odometry).or(drop.first(Kind::Truth)).is_some() {
            drop.notes.push("The pictures have no times: 10 a second are supposed. Add times.txt, a time in seconds a line.".into());
        }
        if let Some((path, _)) = drop.one(Kind::Odometry) {
            let odometry = Odometry::read(Path::new(&path)).map_err(sentence)?;
            odometry.check_cover(Path::new(&path), &self.times).map_err(sentence)?;
            self.odometry = Some(odometry);
        }
        let mut first = Pose::default();
        if let Some((path, _)) = drop.one(Kind::Truth) {
            let poses = read_trajectory(Path::new(&path)).map_err(sentence)?;
            let truth = Truth::new(&poses, MAX_TRUTH_GAP);
            first = self.times.first().and_then(|time| truth.at(*time)).unwrap_or_default();
            self.truth = Some(truth_rows(&truth, &self.times));
        }
        if let Some((path, _)) = drop.one(Kind::Laser) {
            let points = Table::read(Path::new(&path))
                .and_then(|table| table.numbers(["x", "y"]))
                .map_err(sentence)?;
            let kept = points.iter().step_by(points.len().div_ceil(MOST_LASER_POINTS).max(1));
            let row = |[x, y]: &[f64; 2]| <[f64; 2]>::from(first.inverse_transform(Vector2::new(*x, *y)));
            self.laser = Some(kept.flat_map(row).map(|number| number as f32).collect());
        }
        drop.one(Kind::Landmarks);
        Ok(())
    }
}

fn truth_rows(truth: &Truth, times: &[f64]) -> Vec<f32> {
    let poses: Vec<_> = times.iter().map(|time| truth.at(*time)).collect();
    let first_from_world = poses.iter().flatten().next().copied().unwrap_or_default().inverse();
    let row = |pose: Option<Pose<f64>>| match pose.map(|pose| first_from_world.compose(&pose)) {
        Some(Pose { x, y, heading }) => [x, y, heading].map(|number| number as f32),
        None => [f32::NAN; 3],
    };
    poses.into_iter().flat_map(row).collect()
}

/// The pictures' folder, and the times that their names are.
fn times_of_names(frames: &[u32], paths: &[String]) -> Option<(PathBuf, Vec<f64>)> {
    let images: Option<Vec<PathBuf>> =
        frames.iter().map(|index| paths.get(*index as usize).map(PathBuf::from)).collect();
    let images = images.filter(|images| images.len() > 1)?;
    let folder = images.first()?.parent()?.to_owned();
    let times = times_in_names(&folder, &images)?;
    Some((folder, times))
}

/// What a device would send of its own accord; here there is none.
const NO_ANSWERS: Answers = Answers { observations: false, map_every: 0, statistics_every: 0 };

fn camera_entries(camera: &Intrinsics) -> Value {
    json!({
        "width": camera.width, "height": camera.height, "focal": camera.focal, "principal": camera.principal,
        "skew": camera.skew, "lens": lens_name(&camera.lens), "distortion": camera.lens.coefficients().as_slice(),
    })
}

fn lens_name(lens: &Lens<f64>) -> &'static str {
    match lens {
        Lens::Equidistant(_) => "equidistant",
        _ => "polynomial",
    }
}

/// A mount's entries, in the order of [`Mount::parameters`](monorange_core::geometry::Mount::parameters).
const MOUNT: [&str; 6] = ["height", "tilt", "roll", "yaw", "forward", "left"];

fn rig_entries(rig: &Rig) -> Answer<Value> {
    let Rig { finder, pixel_std, mount_std, assumed_std, settings, .. } = rig;
    let mut buffer = [0; 1024];
    // The message's own camera is not looked at, and has no room for every lens.
    let plain = Camera::new(2, 2, [1.0; 2], [0.5; 2], 0.0, Default::default()).map_err(sentence)?;
    let plain = Config { finder: RangeFinder::new(plain, *settings.finder.mount()), ..rig.on_a_device() };
    let message = message_from_config(&plain, NO_ANSWERS);
    let message: &[u8] = postcard::to_slice(&message, &mut buffer).map_err(sentence)?;
    let camera = finder.camera();
    let six = |numbers: [f64; 6]| Value::from_iter(MOUNT.into_iter().zip(numbers));
    let assumed = MOUNT.into_iter().zip(mount_std).zip(assumed_std).filter(|(_, assumed)| **assumed);
    let assumed = assumed.map(|((name, std), _)| (name.to_owned(), json!(std)));
    Ok(json!({
        "width": camera.width(),
        "height": camera.height(),
        "focal": [camera.focal().x, camera.focal().y],
        "principal": [camera.principal().x, camera.principal().y],
        "skew": camera.skew(),
        "lens": lens_name(camera.lens()),
        "distortion": camera.lens().coefficients().as_slice(),
        "pixelStd": pixel_std,
        "mount": six(finder.mount().parameters()),
        "mountStd": six(*mount_std),
        "assumedStd": assumed.collect::<serde_json::Map<_, _>>(),
        "settings": message,
        "settingsToml": changed_settings(settings),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laid_out(paths: &[&str]) -> Answer<Layout> {
        let paths: Vec<_> = paths.iter().map(|path| (*path).to_owned()).collect();
        Layout::new(&paths, paths.len(), None)
    }

    #[test]
    fn the_folder_with_most_pictures_is_the_sequence_in_natural_order() {
        let layout = laid_out(&["d/logo.png", "d/frames/10.png", "d/frames/9.png"]).unwrap();
        assert_eq!(
            (layout.frames, layout.title.as_str(), layout.name.as_str()),
            (vec![2, 1], "d/frames", "d")
        );
    }

    #[test]
    fn colour_comes_before_depth_and_names_may_be_times() {
        let layout = laid_out(&[
            "d/depth/1305031102.20.png",
            "d/depth/1305031102.30.png",
            "d/rgb/1305031102.25.png",
            "d/rgb/1305031102.50.png",
        ])
        .unwrap();
        assert_eq!((layout.frames, layout.times), (vec![2, 3], vec![1305031102.25, 1305031102.5]));
        assert!(
            layout.notes.iter().any(|note| note.contains("2 pictures were in d/depth")),
            "{:?}",
            layout.notes
        );
    }

    #[test]
    fn a_foreign_yaml_is_a_note_and_not_the_end() {
        memory::offer("mav0/imu0/sensor.yaml", b"gyroscope_noise_density: 1.6968e-04\n".to_vec());
        let layout = laid_out(&["mav0/cam0/data/1.png", "mav0/imu0/sensor.yaml"]).unwrap();
        assert!(layout.rig.is_none());
        assert!(
            layout.notes.iter().any(|note| note.starts_with("sensor.yaml is not used: ")),
            "{:?}",
            layout.notes
        );
    }

    #[test]
    fn a_camera_file_given_after_a_rig_takes_the_place_of_its_camera() {
        memory::offer("rig.toml", b"[camera]\nwidth = 8\nheight = 6\nfocal = [9.0, 9.0]\nprincipal = [4.0, 3.0]\n[mount]\nheight = 0.7\ntilt_deg = 9.0\n".to_vec());
        memory::offer("cam.yaml", b"image_width: 8\nimage_height: 6\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [7, 0, 4, 0, 7, 3, 0, 0, 1]\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n".to_vec());
        let paths = ["cam.yaml", "1.png", "rig.toml"].map(str::to_owned);
        let layout = Layout::new(&paths, 1, None).unwrap();
        let rig = layout.rig.unwrap();
        assert_eq!((rig["focal"][0].as_f64(), rig["mount"]["height"].as_f64()), (Some(7.0), Some(0.7)));
        assert!(layout.used && layout.rig_source == "cam.yaml");
    }

    #[test]
    fn of_a_camera_file_that_the_rig_names_nothing_is_said() {
        memory::offer(
            "d/rig.toml",
            b"camera_info = \"cam.yaml\"\n[mount]\nheight = 0.7\ntilt_deg = 9.0\n".to_vec(),
        );
        memory::offer("d/cam.yaml", b"image_width: 8\nimage_height: 6\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [7, 0, 4, 0, 7, 3, 0, 0, 1]\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n".to_vec());
        let layout = laid_out(&["d/1.png", "d/rig.toml", "d/cam.yaml"]).unwrap();
        assert_eq!((layout.notes, layout.rig_size), (vec![], Some([8, 6])));
    }

    #[test]
    fn rubbish_beside_a_sequence_is_of_no_use_and_a_log_says_what_to_do() {
        let paths = ["drive.bag", "1.png"].map(str::to_owned);
        let layout = Layout::new(&paths, 1, None).unwrap();
        assert!(!layout.used && layout.notes[0].contains("bag of ROS 1"), "{:?}", layout.notes);
    }
}

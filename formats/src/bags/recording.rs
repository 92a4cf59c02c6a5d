use super::{
    bag::{Bag, Passing, Place, Topic},
    messages::{self, CameraInfo, Link, Moved, Stamp, seconds},
    mount, picture,
};
use crate::{
    Error, Result,
    files::{MOUNT_KEYS, Odometry, Rig, Table, memory},
    pictures::Picture,
};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

/// Which topics to take; one that is not named is found by its type, if there is only one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Choice<'a> {
    /// Of `sensor_msgs/msg/Image` or `CompressedImage`.
    pub image: Option<&'a str>,
    /// Of `nav_msgs/msg/Odometry`; without one the motion comes from the pictures.
    pub odometry: Option<&'a str>,
    /// Of `sensor_msgs/msg/CameraInfo`.
    pub camera_info: Option<&'a str>,
}

/// What `slam` takes from a recording.
#[derive(Debug)]
pub struct Recording {
    /// Pictures in the order of their stamps.
    pub frames: Vec<Frame>,
    /// Their stamps, s.
    pub times: Vec<f64>,
    /// What the wheels say.
    pub odometry: Option<Odometry>,
    path: PathBuf,
    camera_info: Option<CameraInfo>,
    /// By the child's frame.
    links: BTreeMap<String, Link>,
    camera_frame: String,
    robot_frame: String,
}

/// A picture in a recording, which is read when it is asked for.
#[derive(Clone, Debug)]
pub struct Frame {
    bag: Arc<Bag>,
    place: Place,
    packed: bool,
    size: Option<[usize; 2]>,
    name: PathBuf,
}

/// A picture that passed: stamp, when it was recorded, its frame, its size if that can be seen.
struct Sight {
    stamp: Stamp,
    recorded: u64,
    frame: String,
    size: Option<[usize; 2]>,
    place: Place,
}

/// All that passed, by topic.
#[derive(Default)]
struct Passed {
    pictures: BTreeMap<String, Vec<Sight>>,
    moved: BTreeMap<String, Vec<Moved>>,
    cameras: BTreeMap<String, CameraInfo>,
    links: BTreeMap<String, Link>,
}

const IMAGE: &str = "sensor_msgs/msg/Image";
const PACKED: &str = "sensor_msgs/msg/CompressedImage";
const ODOMETRY: &str = "nav_msgs/msg/Odometry";
const CAMERA: &str = "sensor_msgs/msg/CameraInfo";

impl Recording {
    /// The chosen topics of the recording at `path`.
    ///
    /// # Errors
    /// When it cannot be read, a topic is not there or of another type (all are listed then), or several could be meant.
    pub fn read(path: &Path, choice: Choice<'_>) -> Result<Self> {
        let bag = Arc::new(Bag::open(path)?);
        let mut passed = Passed::default();
        let (topics, ends) = bag.scan(&mut |passing| {
            passed.note(passing).map_err(|error| {
                let (topic, path) = (&passing.topic.name, bag.path().display());
                Error::new(format!("a message of {topic} cannot be read: {error}"))
                    .at(path.to_string())
                    .help("record the drive again, or name another topic")
            })
        })?;
        let chooser = Chooser { path, topics: &topics };
        let image = chooser.choose("--image-topic", choice.image, &[IMAGE, PACKED])?.ok_or_else(|| {
            if ends.is_empty() {
                let error = Error::new(format!("holds no pictures{}", chooser.list())).at(path);
                return error.help(format!("record a topic of {IMAGE} or {PACKED}"));
            }
            let cause = format!("is cut off before its first picture{}", chooser.list());
            Error::new(cause).at(path).help("copy the file again; `mcap recover` saves what is whole")
        })?;
        let odometry = chooser.choose("--odometry-topic", choice.odometry, &[ODOMETRY])?;
        let beside = format!("{}/camera_info", parent(image.name.trim_end_matches("/compressed")));
        let camera = match choice.camera_info {
            None if passed.cameras.contains_key(&beside) => Some(beside),
            named => chooser.choose("--camera-info-topic", named, &[CAMERA])?.map(|topic| topic.name.clone()),
        };
        ends.into_iter().for_each(Error::warn);
        let mut sights = passed.pictures.remove(&image.name).unwrap_or_default();
        if sights.iter().all(|sight| sight.stamp == (0, 0)) {
            let cause = format!("the pictures of {} have no stamps", image.name);
            Error::new(cause).at(path).help("the times at which they were recorded are used").warn();
            for sight in &mut sights {
                let (whole, rest) = (sight.recorded / 1_000_000_000, sight.recorded % 1_000_000_000);
                sight.stamp = (whole as i32, rest as u32);
            }
        }
        sights.sort_by_key(|sight| sight.stamp);
        let before = sights.len();
        sights.dedup_by_key(|sight| sight.stamp);
        let left_out = |count: usize, why: &str| {
            if count > 0 {
                let cause = format!("{count} pictures of {} {why}", image.name);
                Error::new(cause).at(path).help("they are left out").warn();
            }
        };
        left_out(before - sights.len(), "have the stamp of another one");
        let moved = odometry.and_then(|topic| passed.moved.remove(&topic.name));
        let robot_frame = moved.as_ref().and_then(|moved| moved.first()).map(|moved| moved.frame.clone());
        let odometry = match (moved, odometry) {
            (Some(moved), Some(topic)) => Some(wheels(path, &topic.name, moved)?),
            _ => None,
        };
        if let Some([start, end]) = odometry.as_ref().map(Odometry::range) {
            let (all, slack) = (sights.len(), 1e-6 * (end - start));
            sights.retain(|sight| (start - slack..=end + slack).contains(&seconds(sight.stamp)));
            left_out(all - sights.len(), "were taken before the odometry begins or after it ends");
        }
        let camera_frame = sights.first().map(|sight| sight.frame.clone()).unwrap_or_default();
        let (packed, place) = (image.kind == PACKED, path.display());
        let frame = |(number, sight): (usize, &Sight)| {
            let name = format!("{place}, {} picture {number}", image.name).into();
            Frame { bag: Arc::clone(&bag), place: sight.place, packed, size: sight.size, name }
        };
        let recording = Self {
            frames: sights.iter().enumerate().map(frame).collect(),
            times: sights.iter().map(|sight| seconds(sight.stamp)).collect(),
            odometry,
            path: path.to_owned(),
            camera_info: camera.and_then(|camera| passed.cameras.remove(&camera)),
            links: passed.links,
            camera_frame,
            robot_frame: robot_frame
                .filter(|frame| !frame.is_empty())
                .unwrap_or_else(|| "base_link".to_owned()),
        };
        match recording.frames.is_empty() {
            true => {
                let error = Error::new(format!("no picture of {} can be used", image.name)).at(path);
                Err(error.help("record pictures and odometry at the same time, with one clock"))
            }
            false => recording.of_one_size(),
        }
    }

    fn of_one_size(self) -> Result<Self> {
        let mut sizes = self.frames.iter().filter_map(|frame| Some((frame, frame.size?)));
        let Some((_, first)) = sizes.next() else { return Ok(self) };
        match sizes.find(|(_, size)| *size != first) {
            None => Ok(self),
            Some((frame, [width, height])) => {
                let [w, h] = first;
                let cause = format!("the picture is {width}×{height}, the first one {w}×{h}");
                Err(Error::new(cause).at(&frame.name).help("record pictures of one size"))
            }
        }
    }

    /// Camera and mount as the recording has them, with the default settings.
    ///
    /// # Errors
    /// When it holds no camera_info, its lens model is not supported, or no transforms lead from the camera to the robot.
    pub fn rig(&self) -> Result<Rig> {
        let camera = self.camera_info.as_ref().ok_or_else(|| {
            Error::new("has no camera_info for its pictures")
                .at(&self.path)
                .help("name it with --camera-info-topic, or give --rig")
        })?;
        let mount = mount::from_links(&self.links, &self.camera_frame, &self.robot_frame)
            .map_err(|error| error.at(&self.path))?;
        // A rig file in memory: what holds for those that people write holds for this one.
        let mut rig = "camera_info = \"camera_info.yaml\"\n[mount]\n".to_owned();
        for ((key, _, unit), value) in MOUNT_KEYS.into_iter().zip(mount.parameters()) {
            rig += &format!("{key} = {:?}\n", value / unit);
        }
        let place = self.path.join("rig.toml");
        memory::offer(self.path.join("camera_info.yaml"), camera.yaml.clone().into_bytes());
        Rig::parse(&place, &rig)
    }
}

impl Frame {
    /// Decodes the picture.
    ///
    /// # Errors
    /// When the recording cannot be read, or the picture is damaged or in an encoding that is not read.
    pub fn read(&self) -> Result<Picture> {
        let data = self.bag.fetch(self.place)?;
        let damaged = |error| Error::new(format!("the picture is damaged ({error})"));
        let picture = if self.packed {
            let image = messages::compressed_image(&data).map_err(damaged);
            image.and_then(|image| Picture::decode(&self.name, image.data))
        } else {
            messages::image(&data).map_err(damaged).and_then(|image| picture::raw(&image))
        };
        picture.map_err(|error| error.at(&self.name))
    }

    /// (width, height), where it can be seen without decoding.
    pub fn size(&self) -> Option<[usize; 2]> {
        self.size
    }

    /// The recording, the topic and the picture's number, for messages.
    pub fn name(&self) -> &Path {
        &self.name
    }
}

impl Passed {
    fn note(&mut self, passing: &Passing<'_>) -> std::result::Result<(), re_cdr::Error> {
        let Passing { topic, recorded, data, place } = *passing;
        if topic.encoding != "cdr" {
            return Ok(());
        }
        let name = || topic.name.clone();
        let mut sight = |stamp, frame: &str, size| {
            let sight = Sight { stamp, recorded, frame: frame.to_owned(), size, place };
            self.pictures.entry(name()).or_default().push(sight);
        };
        match topic.kind.as_str() {
            IMAGE => {
                let image = messages::image(data)?;
                sight(image.head.stamp, image.head.frame, Some([image.width, image.height]));
            }
            PACKED => {
                let image = messages::compressed_image(data)?;
                if !image.format.contains("compressedDepth") {
                    sight(image.head.stamp, image.head.frame, Picture::size_of(image.data));
                }
            }
            ODOMETRY => self.moved.entry(name()).or_default().push(messages::odometry(data)?),
            CAMERA => {
                self.cameras.insert(name(), messages::camera_info(data)?);
            }
            "tf2_msgs/msg/TFMessage" => {
                for link in messages::transforms(data)? {
                    // Of frames that move the first pose counts; a camera's mount does not.
                    self.links.entry(link.child.clone()).or_insert(link);
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Finds topics by name or by type.
struct Chooser<'a> {
    path: &'a Path,
    topics: &'a [Topic],
}

impl<'a> Chooser<'a> {
    fn choose(&self, option: &str, named: Option<&str>, kinds: &[&str]) -> Result<Option<&'a Topic>> {
        let fits = |topic: &&Topic| kinds.contains(&topic.kind.as_str());
        if let Some(name) = named {
            let found = self
                .topics
                .iter()
                .find(|topic| topic.name.trim_start_matches('/') == name.trim_start_matches('/'));
            let cause = match found {
                None => format!("has no topic {name}{}", self.list()),
                Some(topic) if !fits(&topic) => {
                    format!("the topic {name} is of type {}, not {}", topic.kind, kinds.join(" or "))
                }
                Some(topic) => return self.readable(topic).map(Some),
            };
            return Err(Error::new(cause).at(self.path).help(format!("correct {option}")));
        }
        let mut fitting: Vec<_> =
            self.topics.iter().filter(fits).filter(|topic| topic.messages > 0).collect();
        // A picture that is there raw and packed is one picture.
        let raw: Vec<_> = fitting.iter().map(|topic| topic.name.clone()).collect();
        fitting.retain(|topic| {
            topic.name.rsplit_once('/').is_none_or(|(base, last)| {
                !(last.starts_with("compressed") && raw.iter().any(|name| name == base))
            })
        });
        match fitting.as_slice() {
            [] => Ok(None),
            [one] => self.readable(one).map(Some),
            several => {
                let names: Vec<_> = several.iter().map(|topic| topic.name.as_str()).collect();
                let cause = format!("several topics could be meant: {}", names.join(", "));
                Err(Error::new(cause).at(self.path).help(format!("name one of them with {option}")))
            }
        }
    }

    fn readable(&self, topic: &'a Topic) -> Result<&'a Topic> {
        if topic.encoding == "cdr" {
            return Ok(topic);
        }
        let cause =
            format!("the messages of {} are encoded as `{}`, not as `cdr`", topic.name, topic.encoding);
        Err(Error::new(cause).at(self.path).help("give a recording of ROS 2"))
    }

    fn list(&self) -> String {
        let lines = self
            .topics
            .iter()
            .map(|topic| format!("\n    {} ({}, {})", topic.name, topic.kind, topic.messages));
        match self.topics.is_empty() {
            true => "; it holds no topic at all".to_owned(),
            false => format!("; its topics are{}", lines.collect::<String>()),
        }
    }
}

/// The namespace that a topic is in.
fn parent(topic: &str) -> &str {
    topic.rsplit_once('/').map_or("", |(parent, _)| parent)
}

/// The odometry in messages: their speeds, which hold until the next message; where these are all 0, what their poses differ by.
fn wheels(path: &Path, topic: &str, mut moved: Vec<Moved>) -> Result<Odometry> {
    moved.sort_by_key(|moved| moved.stamp);
    moved.dedup_by_key(|moved| moved.stamp);
    let speeds = moved.iter().any(|moved| moved.speeds != [0.0; 2]);
    let mut text = String::from(if speeds { "t,v,omega\n" } else { "t,dx,dy,dtheta\n" });
    let mut before = moved.first().map(|moved| moved.odom_from_robot).unwrap_or_default();
    for Moved { stamp, speeds: [v, omega], odom_from_robot, .. } in &moved {
        let t = seconds(*stamp);
        if speeds {
            text += &format!("{t:?},{v:?},{omega:?}\n");
        } else {
            let step = before.inverse() * odom_from_robot;
            let turn = step.rotation.to_rotation_matrix();
            let turn = libm::atan2(turn.matrix().m21, turn.matrix().m11);
            text += &format!("{t:?},{:?},{:?},{turn:?}\n", step.translation.x, step.translation.y);
            before = *odom_from_robot;
        }
    }
    // As a file of the same numbers: what holds for those holds here.
    let place = PathBuf::from(format!("{}, {topic}", path.display()));
    Odometry::from_table(&Table::parse(&place, &text)?)
}

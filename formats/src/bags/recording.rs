use super::{
    bag::{Bag, Place},
    choice::{CAMERA, Choice, Chooser, IMAGE, ODOMETRY, PACKED},
    messages::{self, CameraInfo, Link, Moved, seconds},
    mount, picture,
    reading::{Reading, Sight},
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
    /// The odometry as the file of that name.
    wheels: Option<String>,
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

impl Recording {
    /// The chosen topics of the recording at `path`.
    ///
    /// # Errors
    /// When it cannot be read, a topic is not there or of another type (all are listed then), or several could be meant.
    pub fn read(path: &Path, choice: Choice<'_>) -> Result<Self> {
        let mut reading = Reading::begin(path)?;
        while reading.go_on(u64::MAX / 2)? {}
        Self::of(reading, choice)
    }

    /// The chosen topics of a recording that was read to its end.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn of(reading: Reading, choice: Choice<'_>) -> Result<Self> {
        let (bag, mut passed, topics, ends) = reading.end();
        let path = bag.path();
        let chooser = Chooser { path, topics: &topics, fullest: choice.fullest };
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
            // Another camera's would be worse than none.
            named => {
                match (Chooser { fullest: false, ..chooser }).choose("--camera-info-topic", named, &[CAMERA])
                {
                    Err(_) if choice.fullest => None,
                    chosen => chosen?.map(|topic| topic.name.clone()),
                }
            }
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
        let wheels = moved.map(wheels);
        let odometry = match (&wheels, odometry) {
            (Some(text), Some(topic)) => {
                // As a file of the same numbers: what holds for those holds here.
                let place = PathBuf::from(format!("{}, {}", path.display(), topic.name));
                Some(Odometry::from_table(&Table::parse(&place, text)?)?)
            }
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
            wheels,
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
        let camera = self.camera_info().ok_or_else(|| {
            Error::new("has no camera_info for its pictures")
                .at(&self.path)
                .help("name it with --camera-info-topic, or give --rig")
        })?;
        let (place, rig) = (self.path.join("rig.toml"), self.rig_file()?);
        memory::offer(self.path.join("camera_info.yaml"), camera.to_owned().into_bytes());
        Rig::parse(&place, &rig)
    }

    /// The mount as a rig file, which names the camera file `camera_info.yaml` beside it: what holds for those that
    /// people write holds for this one.
    ///
    /// # Errors
    /// When no transforms lead from the camera to the robot.
    pub fn rig_file(&self) -> Result<String> {
        let mount = mount::from_links(&self.links, &self.camera_frame, &self.robot_frame)
            .map_err(|error| error.at(&self.path))?;
        let mut rig = "camera_info = \"camera_info.yaml\"\n[mount]\n".to_owned();
        for ((key, _, unit), value) in MOUNT_KEYS.into_iter().zip(mount.parameters()) {
            rig += &format!("{key} = {:?}\n", value / unit);
        }
        Ok(rig)
    }

    /// The camera as the file `camera_info.yaml`, where the recording has one.
    pub fn camera_info(&self) -> Option<&str> {
        self.camera_info.as_ref().map(|camera| camera.yaml.as_str())
    }

    /// The odometry as the file `odometry.csv`, where the recording has some.
    pub fn wheels(&self) -> Option<&str> {
        self.wheels.as_deref()
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

/// The namespace that a topic is in.
fn parent(topic: &str) -> &str {
    topic.rsplit_once('/').map_or("", |(parent, _)| parent)
}

/// The odometry in messages: their speeds, which hold until the next message; where these are all 0, what their poses differ by.
fn wheels(mut moved: Vec<Moved>) -> String {
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
    text
}

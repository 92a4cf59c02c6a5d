//! A recording on its way past: what is kept of every message.
use super::{
    bag::{Bag, Passing, Place, Topic, Walk},
    choice::{CAMERA, IMAGE, ODOMETRY, PACKED},
    messages::{self, CameraInfo, Link, Moved, Stamp},
};
use crate::{Error, Result, pictures::Picture};
use std::{collections::BTreeMap, path::Path, sync::Arc};

/// A recording that is read a stretch at a time, for those who show how far it is; then
/// [`Recording::of`](super::Recording::of) chooses among its topics.
pub struct Reading {
    pub(super) bag: Arc<Bag>,
    walk: Walk,
    passed: Passed,
}

/// A picture that passed: stamp, when it was recorded, its frame, its size if that can be seen.
pub(super) struct Sight {
    pub(super) stamp: Stamp,
    pub(super) recorded: u64,
    pub(super) frame: String,
    pub(super) size: Option<[usize; 2]>,
    pub(super) place: Place,
}

/// All that passed, by topic.
#[derive(Default)]
pub(super) struct Passed {
    pub(super) pictures: BTreeMap<String, Vec<Sight>>,
    pub(super) moved: BTreeMap<String, Vec<Moved>>,
    pub(super) cameras: BTreeMap<String, CameraInfo>,
    pub(super) links: BTreeMap<String, Link>,
}

impl Reading {
    /// The recording at `path`, of which nothing is read yet.
    ///
    /// # Errors
    /// As [`Bag::open`].
    pub fn begin(path: &Path) -> Result<Self> {
        Ok(Self { bag: Arc::new(Bag::open(path)?), walk: Walk::default(), passed: Passed::default() })
    }

    /// Reads about so many bytes more; whether there are others.
    ///
    /// # Errors
    /// When the recording cannot be read or a message in it is damaged.
    pub fn go_on(&mut self, bytes: u64) -> Result<bool> {
        let Self { bag, walk, passed } = self;
        walk.go_on(bag, bytes, &mut |passing| {
            passed.note(passing).map_err(|error| {
                let (topic, path) = (&passing.topic.name, bag.path().display());
                Error::new(format!("a message of {topic} cannot be read: {error}"))
                    .at(path.to_string())
                    .help("record the drive again, or name another topic")
            })
        })
    }

    /// The part that is read, 0 to 1.
    pub fn share(&self) -> f64 {
        (self.walk.done() as f64 / self.bag.length().max(1) as f64).min(1.0)
    }

    /// What passed, all topics, and what is wrong with the files' ends.
    pub(super) fn end(self) -> (Arc<Bag>, Passed, Vec<Topic>, Vec<Error>) {
        let (topics, warnings) = self.walk.end();
        (self.bag, self.passed, topics, warnings)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bags::{Choice, Recorder, Recording},
        files::{Rig, Stamped, memory},
    };
    use monorange_core::geometry::Pose;

    const RIG: &str = "[camera]\nwidth = 64\nheight = 48\nfocal = [60.0, 60.0]\nprincipal = [31.5, 23.5]\n\
        [mount]\nheight = 0.4\ntilt_deg = 12.0\n";

    #[test]
    fn a_recording_in_memory_is_read_stretch_by_stretch() {
        let rig = Rig::parse(Path::new("rig.toml"), RIG).unwrap();
        let mut recorder = Recorder::new(Vec::new(), &rig).unwrap();
        for step in 0..300 {
            let (time, pose) = (f64::from(step) / 10.0, Pose { x: f64::from(step), y: 0.0, heading: 0.0 });
            recorder.frame(&Stamped { time, pose, covariance: None }, &[7; 5000], &[]).unwrap();
        }
        let file = recorder.finish().unwrap();
        let length = file.len() as u64;
        memory::lend("drive.mcap", length, move |at, into| {
            into.copy_from_slice(&file[at as usize..at as usize + into.len()]);
            Ok(())
        });
        let mut reading = Reading::begin(Path::new("drive.mcap")).unwrap();
        let mut shares = vec![reading.share()];
        while reading.go_on(1).unwrap() {
            shares.push(reading.share());
        }
        assert!(shares.len() > 3 && shares.is_sorted(), "{shares:?}");
        assert!(reading.share() > 0.99);
        let [stretches, whole] = [
            Recording::of(reading, Choice::default()),
            Recording::read(Path::new("drive.mcap"), Choice::default()),
        ]
        .map(Result::unwrap);
        assert_eq!((stretches.times.len(), &stretches.times), (300, &whole.times));
        assert_eq!(stretches.wheels(), whole.wheels());
        assert_eq!(stretches.rig_file().unwrap(), whole.rig_file().unwrap());
        memory::withdraw(Path::new("drive.mcap"));
        assert!(stretches.frames[0].read().is_err());
    }
}

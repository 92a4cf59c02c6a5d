//! Which topics of a recording are taken.
use super::bag::Topic;
use crate::{Error, Result};
use std::path::Path;

pub(super) const IMAGE: &str = "sensor_msgs/msg/Image";
pub(super) const PACKED: &str = "sensor_msgs/msg/CompressedImage";
pub(super) const ODOMETRY: &str = "nav_msgs/msg/Odometry";
pub(super) const CAMERA: &str = "sensor_msgs/msg/CameraInfo";

/// Which topics to take; one that is not named is found by its type, if there is only one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Choice<'a> {
    /// Of `sensor_msgs/msg/Image` or `CompressedImage`.
    pub image: Option<&'a str>,
    /// Of `nav_msgs/msg/Odometry`; without one the motion comes from the pictures.
    pub odometry: Option<&'a str>,
    /// Of `sensor_msgs/msg/CameraInfo`.
    pub camera_info: Option<&'a str>,
    /// Takes the one with the most messages where several could be meant, with a warning, instead of refusing.
    pub fullest: bool,
}

/// Finds topics by name or by type.
#[derive(Clone, Copy)]
pub(super) struct Chooser<'a> {
    pub(super) path: &'a Path,
    pub(super) topics: &'a [Topic],
    /// As in [`Choice`].
    pub(super) fullest: bool,
}

/// What the names of second cameras have in them: of depth, of a stereo pair.
const SECOND: [&str; 5] = ["depth", "right", "infra", "cam1", "image_1"];

impl<'a> Chooser<'a> {
    pub(super) fn choose(
        &self,
        option: &str,
        named: Option<&str>,
        kinds: &[&str],
    ) -> Result<Option<&'a Topic>> {
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
            several if self.fullest => {
                let second = |topic: &Topic| SECOND.iter().any(|part| topic.name.contains(part));
                // Of equals the first.
                let best = several.iter().rev().max_by_key(|topic| (!second(topic), topic.messages));
                let Some(best) = best else { return Ok(None) };
                let others: Vec<_> = several
                    .iter()
                    .map(|topic| topic.name.as_str())
                    .filter(|name| *name != best.name)
                    .collect();
                let cause = format!("{} is taken; it could have been {} too", best.name, others.join(", "));
                Error::new(cause)
                    .at(self.path)
                    .help("record one topic of its kind if another one is meant")
                    .warn();
                self.readable(best).map(Some)
            }
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

    pub(super) fn list(&self) -> String {
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

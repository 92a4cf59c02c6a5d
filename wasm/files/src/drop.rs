//! The files of a drop by their kinds, and what is said of those that nothing takes.
use crate::kinds::{Kind, base_name, is_litter};
use core::fmt::Display;
use monorange_formats::files::{self, Intrinsics, read_camera_info};
use std::collections::BTreeMap;
use std::path::Path;

/// What an error says, in one line.
pub(crate) fn sentence(error: impl Display) -> String {
    error.to_string().replace("\n  help: ", ". To mend it: ")
}

/// "1 picture", "2 pictures".
pub(crate) fn plural(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// The files of a drop by their kinds; what is not taken is said to be left.
pub(crate) struct Drop {
    /// Kind, path, place among the paths, whether it was just given.
    files: Vec<(Kind, String, usize, bool)>,
    pub(crate) used: bool,
    pub(crate) notes: Vec<String>,
}

impl Drop {
    pub(crate) fn sort(paths: &[String], fresh: usize) -> Self {
        let files = paths.iter().enumerate().filter(|(_, path)| !is_litter(path));
        let files = files.map(|(index, path)| (Kind::of(path), path.clone(), index, index < fresh)).collect();
        Self { files, used: false, notes: Vec::new() }
    }

    pub(crate) fn first(&self, kind: Kind) -> Option<&str> {
        self.files.iter().find(|file| file.0 == kind).map(|file| file.1.as_str())
    }

    fn of(&self, kind: Kind) -> Vec<(String, bool)> {
        self.files
            .iter()
            .filter(|file| file.0 == kind)
            .map(|(_, path, _, fresh)| (path.clone(), *fresh))
            .collect()
    }

    /// The one file of a kind; others of it are said to be left out.
    pub(crate) fn one(&mut self, kind: Kind) -> Option<(String, bool)> {
        let found = self.of(kind);
        let (first, more) = found.split_first()?;
        for (path, fresh) in more {
            if *fresh {
                self.notes.push(format!(
                    "{} is not used: {} came first.",
                    base_name(path),
                    base_name(&first.0)
                ));
            }
        }
        self.used |= first.1;
        Some(first.clone())
    }

    /// The first camera file that is one, and is wanted; of one that the rig names nothing is said.
    pub(crate) fn camera(&mut self, wanted: bool, rig: &str) -> Option<(String, Intrinsics, bool)> {
        let mut found: Option<(String, Intrinsics, bool)> = None;
        for (path, fresh) in self.of(Kind::Camera) {
            let name = base_name(&path).to_owned();
            let reason = match (&found, wanted, read_camera_info(Path::new(&path))) {
                (None, true, Ok(camera)) => {
                    self.used |= fresh;
                    found = Some((path, camera, fresh));
                    continue;
                }
                (Some((first, ..)), _, Ok(_)) => format!("{} came first", base_name(first)),
                (None, _, Ok(_)) if rig.contains(&format!("{name}\"")) => continue,
                (None, _, Ok(_)) => "the rig has a camera".to_owned(),
                (_, _, Err(error)) => {
                    let said = sentence(error);
                    said.strip_prefix(&format!("{path}: ")).unwrap_or(&said).to_owned()
                }
            };
            if fresh {
                self.notes.push(format!("{name} is not used: {}.", reason.trim_end_matches('.')));
            }
        }
        found
    }

    /// The pictures of the folder that holds most of them, in the order of the command line's frames.
    pub(crate) fn main_folder(&mut self) -> Vec<u32> {
        let mut folders: BTreeMap<String, Vec<(String, usize, bool)>> = BTreeMap::new();
        for (_, path, index, fresh) in self.files.iter().filter(|file| file.0 == Kind::Picture) {
            let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder).to_owned();
            folders.entry(folder).or_default().push((path.clone(), *index, *fresh));
        }
        // Of folders that hold as many, colour pictures before depth, the left camera before the right one.
        let rank = |folder: &str| {
            usize::from(["depth", "right", "image_1", "cam1"].iter().any(|second| folder.ends_with(second)))
        };
        let best = folders.iter().max_by_key(|(folder, pictures)| {
            (pictures.len(), usize::MAX - rank(folder), core::cmp::Reverse((*folder).clone()))
        });
        let Some(best) = best.map(|(folder, _)| folder.clone()) else { return Vec::new() };
        let mut pictures = folders.remove(&best).unwrap_or_default();
        for (folder, left) in folders {
            let place = if folder.is_empty() { "beside it".to_owned() } else { format!("in {folder}") };
            self.notes.push(format!(
                "{} {place} left aside: one camera’s pictures make a sequence.",
                were(left.len(), "picture")
            ));
        }
        files::sort_names(&mut pictures, |(path, ..)| base_name(path).to_owned());
        self.used |= pictures.iter().any(|(.., fresh)| *fresh);
        pictures.into_iter().map(|(_, index, _)| index as u32).collect()
    }

    /// Sentences about what a sequence has no use for.
    pub(crate) fn say_what_is_left(&mut self, count: usize) {
        let fresh = self.files.iter().filter(|file| file.3);
        let mut notes: Vec<_> = fresh
            .clone()
            .filter(|file| matches!(file.0, Kind::Other | Kind::Container))
            .map(|(kind, path, ..)| format!("{} is not used: {}", base_name(path), what_to_do(*kind, path)))
            .collect();
        if count > 0 {
            let videos = fresh.filter(|file| file.0 == Kind::Video && !self.used);
            notes.extend(
                videos.map(|file| format!("{} is not used: open a video by itself.", base_name(&file.1))),
            );
        }
        if notes.len() > 3 {
            let more = notes.split_off(2);
            notes.push(format!("{} more files are not used either.", more.len()));
        }
        self.notes.extend(notes);
    }

    pub(crate) fn nothing_to_show(&self) -> String {
        let help =
            "Drop pictures (PNG, JPEG, PGM …), a folder or ZIP of them, a video or a recording of ROS 2.";
        match self.files.as_slice() {
            [] => format!("There was nothing in that. {help}"),
            [(kind @ (Kind::Container | Kind::Other), path, ..)] => match kind {
                Kind::Container => {
                    format!("{} is not a picture: {}", base_name(path), what_to_do(*kind, path))
                }
                _ => format!("{} is not a picture. {help}", base_name(path)),
            },
            [(_, path, ..)] => format!("{} needs pictures beside it. {help}", base_name(path)),
            files => format!("None of these {} files is a picture. {help}", files.len()),
        }
    }
}

fn were(count: usize, noun: &str) -> String {
    format!("{} {}", plural(count, noun), if count == 1 { "was" } else { "were" })
}

/// Why a file is of no use, and what to do, as the end of a sentence.
fn what_to_do(kind: Kind, path: &str) -> &'static str {
    let end = path.rsplit_once('.').map_or("", |(_, end)| end).to_ascii_lowercase();
    match (kind, end.as_str()) {
        (Kind::Container, "mcap" | "db3") => "open a recording by itself, without pictures beside it.",
        (Kind::Container, "zip") => "open an archive by itself, without pictures beside it.",
        (Kind::Container, "bag") => {
            "it is a bag of ROS 1. Turn it into ROS 2’s (`rosbags-convert --src drive.bag --dst drive`, PyPI: rosbags), then \
             drop that folder."
        }
        (Kind::Container, _) => "it is an archive. Unpack it, or make a ZIP of the folder, then drop that.",
        _ => "it is neither a picture nor a file that a sequence needs.",
    }
}

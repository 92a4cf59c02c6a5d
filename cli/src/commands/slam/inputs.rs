//! The files of a sequence, as `slam` and `feed` are given them.
use crate::{
    commands::Cli,
    sequence::{Sequence, SequenceFiles},
};
use clap::{Args, CommandFactory, error::ErrorKind};
use monorange_formats::{
    Error, Result,
    bags::{Choice, Recording},
    files::Rig,
};
use std::path::{Path, PathBuf};

/// The files of a sequence.
#[derive(Args, Debug)]
pub(in crate::commands) struct Inputs {
    /// Camera, mount and settings (TOML); with --bag by default what the recording says.
    #[arg(long, value_name = "FILE", num_args = 1.., required_unless_present = "bag")]
    rig: Vec<PathBuf>,
    /// Which camera of the file that the rig names with `camera_info`, counted from 0, where it holds several.
    #[arg(long, value_name = "N", requires = "rig")]
    camera: Option<usize>,
    /// The folder of pictures, or a folder of EuRoC, KITTI or TUM RGB-D.
    #[arg(long, value_name = "DIR", num_args = 1.., required_unless_present = "bag")]
    frames: Vec<PathBuf>,
    /// A recording of ROS 2 instead: an MCAP file, a .db3 file, or rosbag2's folder.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["frames", "times"])]
    pub(super) bag: Vec<PathBuf>,
    /// The recording's topic of pictures, where there are several.
    #[arg(long, value_name = "TOPIC", requires = "bag")]
    image_topic: Option<String>,
    /// The recording's topic of odometry, where there are several.
    #[arg(long, value_name = "TOPIC", requires = "bag", conflicts_with = "odometry")]
    odometry_topic: Option<String>,
    /// The recording's topic of camera_info, where the pictures' own is not meant.
    #[arg(long, value_name = "TOPIC", requires = "bag")]
    camera_info_topic: Option<String>,
    /// Times of the frames, one a line, s.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    times: Vec<PathBuf>,
    /// Odometry (CSV `t,v,omega` or `t,dx,dy,dtheta`, or poses as TUM or `t,x,y,heading`); from the pictures without it.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    odometry: Vec<PathBuf>,
    /// How the robot leans, by an IMU (CSV `t,pitch,roll` in rad, nose down and left side up positive, or `t,qx,qy,qz,qw`).
    #[arg(long, value_name = "FILE", num_args = 1..)]
    attitude: Vec<PathBuf>,
    /// True trajectory (TUM or CSV), for the report.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub(super) truth: Vec<PathBuf>,
}

impl Inputs {
    /// The rig and the drive, of files or of a recording.
    ///
    /// # Errors
    /// When a file is missing, malformed or does not fit the others.
    pub(in crate::commands) fn read(&self) -> Result<(Rig, Sequence)> {
        let rig = self.rig.first().map(|rig| Rig::read_of(rig, self.camera)).transpose()?;
        crate::warnings::say();
        let Some(bag) = self.bag.first() else {
            let rig = rig.ok_or_else(|| Error::new("there is no rig").help("give --rig"))?;
            let sequence = Sequence::read(self.files(), &rig)?;
            return Ok((rig, sequence));
        };
        let choice = Choice {
            image: self.image_topic.as_deref(),
            odometry: self.odometry_topic.as_deref(),
            camera_info: self.camera_info_topic.as_deref(),
            fullest: false,
        };
        let recording = Recording::read(bag, choice)?;
        let rig = rig.map_or_else(|| recording.rig(), Ok)?;
        crate::warnings::say();
        let sequence = Sequence::of_recording(recording, self.files(), &rig)?;
        Ok((rig, sequence))
    }

    /// The file that settings came from, for messages.
    pub(in crate::commands) fn rig_place(&self) -> &Path {
        self.rig.first().map_or_else(|| self.place(), PathBuf::as_path)
    }

    /// The folder of pictures, or the recording.
    pub(super) fn place(&self) -> &Path {
        self.places().first().map_or(Path::new(""), PathBuf::as_path)
    }

    /// The folders of pictures, or the recordings.
    pub(super) fn places(&self) -> &[PathBuf] {
        if self.bag.is_empty() { &self.frames } else { &self.bag }
    }

    /// The drives one by one. What is given once is every drive's.
    ///
    /// Ends the process where something is given neither once nor once for each drive.
    pub(super) fn each(&self) -> Vec<Self> {
        let drives = self.places().len();
        let [rig, times] = [("--rig", &self.rig), ("--times", &self.times)];
        let [odometry, truth] = [("--odometry", &self.odometry), ("--truth", &self.truth)];
        for (name, files) in [rig, times, odometry, ("--attitude", &self.attitude), truth] {
            if files.len() > 1 && files.len() != drives {
                wrong(&format!(
                    "{name} is given {} times for {drives} drives: give it once for all, or once for each in the same order",
                    files.len()
                ));
            }
        }
        let of = |files: &[PathBuf], drive: usize| -> Vec<PathBuf> {
            files.get(drive).or(files.first()).cloned().into_iter().collect()
        };
        let one = |drive| Self {
            rig: of(&self.rig, drive),
            camera: self.camera,
            frames: of(&self.frames, drive),
            bag: of(&self.bag, drive),
            image_topic: self.image_topic.clone(),
            odometry_topic: self.odometry_topic.clone(),
            camera_info_topic: self.camera_info_topic.clone(),
            times: of(&self.times, drive),
            odometry: of(&self.odometry, drive),
            attitude: of(&self.attitude, drive),
            truth: of(&self.truth, drive),
        };
        (0..drives).map(one).collect()
    }

    /// Ends the process where more than one drive is given.
    pub(in crate::commands) fn only_one(&self) {
        if self.each().len() > 1 {
            wrong("this command takes one drive; `monorange slam` takes several");
        }
    }

    fn files(&self) -> SequenceFiles<'_> {
        SequenceFiles {
            frames: self.place(),
            times: self.times.first().map(PathBuf::as_path),
            odometry: self.odometry.first().map(PathBuf::as_path),
            attitude: self.attitude.first().map(PathBuf::as_path),
            truth: self.truth.first().map(PathBuf::as_path),
        }
    }

    /// `corridor/frames`, which says more than `frames`.
    pub(in crate::commands) fn title(&self) -> String {
        let folder = std::path::absolute(self.place()).unwrap_or_else(|_| self.place().to_owned());
        let names: Vec<_> =
            folder.components().rev().take(2).map(|part| part.as_os_str().to_string_lossy()).collect();
        names.into_iter().rev().collect::<Vec<_>>().join("/")
    }
}

/// Ends the process: the command line is wrong.
pub(super) fn wrong(why: &str) -> ! {
    Cli::command().error(ErrorKind::WrongNumberOfValues, why).exit()
}

//! What a dropped file is for, by its name.

/// What a file is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A picture of the sequence.
    Picture,
    /// A video, which only the page can play.
    Video,
    /// Camera, mount and settings.
    Rig,
    /// A camera file of another program.
    Camera,
    /// What the wheels said.
    Odometry,
    /// A time a picture.
    Times,
    /// The true poses.
    Truth,
    /// A laser's points.
    Laser,
    /// The true corners.
    Landmarks,
    /// An archive, or a log of a robot, which must be taken apart first.
    Container,
    /// A dataset's list of its own pictures, whose names say the same.
    List,
    /// Nothing that a sequence needs.
    Other,
}

const PICTURES: &str = "png jpg jpeg webp bmp gif avif heic heif pgm ppm pnm pbm tif tiff";
const VIDEOS: &str = "mp4 m4v webm mov mkv ogv avi";
const CONTAINERS: &str = "zip bag mcap db3 tar gz tgz 7z rar";

impl Kind {
    /// What the file of this path is for.
    pub fn of(path: &str) -> Self {
        let name = base_name(path).to_ascii_lowercase();
        let end = name.rsplit_once('.').map_or("", |(_, end)| end);
        let is = |ends: &str| ends.split(' ').any(|known| known == end);
        let begins = |starts: &[&str]| starts.iter().any(|start| name.starts_with(start));
        match end {
            _ if is(PICTURES) => Self::Picture,
            _ if is(VIDEOS) => Self::Video,
            _ if is(CONTAINERS) => Self::Container,
            "toml" => Self::Rig,
            "yaml" | "yml" | "xml" => Self::Camera,
            "tum" => Self::Truth,
            "txt" | "csv" if begins(&["truth", "groundtruth", "ground_truth", "gt.", "gt_"]) => Self::Truth,
            "txt" if begins(&["calib"]) => Self::Camera,
            "txt" if ["rgb.txt", "depth.txt", "associations.txt"].contains(&name.as_str()) => Self::List,
            "csv" if name == "data.csv" && path.contains("cam") => Self::List,
            "txt" | "csv" if begins(&["time"]) => Self::Times,
            "txt" | "csv" if begins(&["odo"]) => Self::Odometry,
            "csv" if begins(&["laser"]) => Self::Laser,
            "csv" if begins(&["landmarks"]) => Self::Landmarks,
            _ => Self::Other,
        }
    }
}

/// A path's last part.
pub fn base_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

/// Whether the file is one that systems leave in folders, and nobody means to open.
pub fn is_litter(path: &str) -> bool {
    path.split('/').any(|part| part.starts_with('.') || part == "__MACOSX")
        || ["thumbs.db", "desktop.ini"].contains(&base_name(path).to_ascii_lowercase().as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_told_apart_by_their_names() {
        for (path, kind) in [
            ("a/frames/000001.png", Kind::Picture),
            ("IMG_2.JPEG", Kind::Picture),
            ("drive.mp4", Kind::Video),
            ("rig.toml", Kind::Rig),
            ("left_intrinsics.yml", Kind::Camera),
            ("odometry.csv", Kind::Odometry),
            ("times.txt", Kind::Times),
            ("truth.tum", Kind::Truth),
            ("groundtruth.txt", Kind::Truth),
            ("laser.csv", Kind::Laser),
            ("landmarks.csv", Kind::Landmarks),
            ("drive.mcap", Kind::Container),
            ("00/calib.txt", Kind::Camera),
            ("calib_cam_to_cam.txt", Kind::Camera),
            ("rgbd/rgb.txt", Kind::List),
            ("mav0/cam0/data.csv", Kind::List),
            ("notes.txt", Kind::Other),
        ] {
            assert_eq!(Kind::of(path), kind, "{path}");
        }
    }

    #[test]
    fn litter_of_the_system_is_not_opened() {
        assert!([".DS_Store", "a/.git/x.png", "__MACOSX/a.png", "a/Thumbs.db"].into_iter().all(is_litter));
        assert!(!is_litter("a/frame.png"));
    }
}

//! Where a drive's pictures are, and when they were taken.
use super::in_folder;
use crate::{Error, Result, files::read_frame_list, plausibility};
use std::path::{Path, PathBuf};

/// The pictures of a drive with their times.
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    /// In the order of time.
    pub images: Vec<PathBuf>,
    /// When each was taken, s.
    pub times: Vec<f64>,
    /// The folder that they are in.
    pub folder: PathBuf,
}

/// The pictures in `folder` and their times, from the file `times` or from what is beside them.
///
/// | folder | pictures | times |
/// |---|---|---|
/// | of pictures | all, in natural order | `times.txt`, `timestamps.txt` beside it; EuRoC's `data.csv`, TUM's `rgb.txt`; names that are dates |
/// | EuRoC: with `mav0`, `cam0`, or `data.csv` | `mav0/cam0/data` | `data.csv` |
/// | TUM RGB-D: with `rgb.txt` | as listed | `rgb.txt` |
/// | KITTI: with `image_0` or `image_2` | `image_0` or `image_2` | `times.txt` |
///
/// # Errors
/// When there are no pictures or no times, or more of one than of the other.
pub fn frames(folder: &Path, times: Option<&Path>) -> Result<Frames> {
    let (folder, list) = located(folder);
    let list = list.filter(|_| times.is_none());
    if let Some(list) = list {
        return listed(&folder, &list);
    }
    let images = in_folder(&folder)?;
    let beside = ["times.txt", "timestamps.txt"].iter().find_map(|name| beside(&folder, name));
    let Some(path) = times.map(Path::to_owned).or(beside) else {
        let times = times_in_names(&folder, &images).ok_or_else(|| {
            Error::new("the frames have no times").at(&folder).help("give --times with one time a line, s")
        })?;
        return Ok(Frames { images, times, folder });
    };
    let list = read_frame_list(&path)?;
    if list.iter().any(|(_, name)| name.as_deref().is_some_and(is_picture)) {
        return named(&folder, &path, &images, list);
    }
    let times: Vec<_> = list.into_iter().map(|(time, _)| time).collect();
    if times.len() != images.len() {
        let cause = format!("has {} times for {} pictures", times.len(), images.len());
        return Err(Error::new(cause).at(path).help("give one time for every picture of the folder"));
    }
    Ok(Frames { images, times, folder })
}

/// The pictures of a folder as a file of times and names says, in its order.
fn named(folder: &Path, path: &Path, images: &[PathBuf], list: Vec<(f64, Option<String>)>) -> Result<Frames> {
    let (mut taken, mut times) = (Vec::new(), Vec::new());
    for (time, name) in list {
        let Some(name) = name else {
            return Err(Error::new(format!("names no picture at {time} s, but does in other lines"))
                .at(path)
                .help("name every picture as the folder does, or give the times alone"));
        };
        // Lists name pictures with or without a folder before them.
        let file = Path::new(name.trim_matches('"')).file_name();
        let Some(image) = images.iter().find(|image| file.is_some() && image.file_name() == file) else {
            return Err(Error::new(format!(
                "names the picture `{name}`, which is not in {}",
                folder.display()
            ))
            .at(path)
            .help("name every picture as the folder does, or give the times alone"));
        };
        taken.push(image.clone());
        times.push(time);
    }
    if taken.len() < images.len() {
        let cause = format!("names {} of the {} pictures of the folder", taken.len(), images.len());
        Error::new(cause).at(path).help("the others are left out").warn();
    }
    Ok(Frames { images: taken, times, folder: folder.to_owned() })
}

/// Whether a name is that of a picture.
fn is_picture(name: &str) -> bool {
    let extension = name.trim_matches('"').rsplit_once('.').map(|(_, extension)| extension.to_lowercase());
    extension.is_some_and(|extension| super::EXTENSIONS.contains(&extension.as_str()))
}

/// A file of this name beside the folder, if there is one.
pub fn beside(folder: &Path, name: &str) -> Option<PathBuf> {
    let path = folder.components().as_path().parent()?.join(name);
    path.is_file().then_some(path)
}

/// The folder that holds the pictures, and the list that names them, where they are laid out as a known dataset is.
fn located(folder: &Path) -> (PathBuf, Option<PathBuf>) {
    for cam in ["mav0/cam0", "cam0", ""] {
        let cam = folder.join(cam);
        if cam.join("data.csv").is_file() && cam.join("data").is_dir() {
            return (cam.join("data"), Some(cam.join("data.csv")));
        }
    }
    if folder.join("rgb.txt").is_file() {
        return (folder.to_owned(), Some(folder.join("rgb.txt")));
    }
    for images in ["image_0", "image_2", "image_00/data", "image_02/data"] {
        if folder.join(images).is_dir() {
            return (folder.join(images), None);
        }
    }
    let named = |name: &str| folder.file_name().is_some_and(|folder| folder == name);
    let list = match () {
        () if named("data") => beside(folder, "data.csv"),
        () if named("rgb") => beside(folder, "rgb.txt"),
        () => None,
    };
    match list {
        // The list names pictures from where it is.
        Some(list) if named("rgb") => (list.parent().unwrap_or(folder).to_owned(), Some(list)),
        list => (folder.to_owned(), list),
    }
}

/// The pictures that a list names, in its order; those that are not there are left out, with a warning.
fn listed(folder: &Path, list: &Path) -> Result<Frames> {
    let (mut images, mut times, mut missing) = (Vec::new(), Vec::new(), Vec::new());
    for (time, name) in read_frame_list(list)? {
        let Some(name) = name else {
            return Err(Error::new(format!("names no picture at {time} s"))
                .at(list)
                .help("give `time,picture` a line"));
        };
        let image = folder.join(name.trim().trim_matches('"'));
        match image.is_file() {
            true => {
                images.push(image);
                times.push(time);
            }
            false => missing.push(name),
        }
    }
    if images.is_empty() {
        return Err(Error::new("names no picture that is there")
            .at(list)
            .help("unpack the pictures beside it"));
    }
    if let Some(first) = missing.first() {
        let cause = format!("{} of its pictures are not there, {first} first", missing.len());
        Error::new(cause).at(list).help("they are left out").warn();
    }
    Ok(Frames { images, times, folder: folder.to_owned() })
}

/// The times that pictures are named after: seconds, or smaller units, since 1970. Says so in a warning.
pub fn times_in_names(folder: &Path, images: &[PathBuf]) -> Option<Vec<f64>> {
    let stem =
        |image: &PathBuf| image.file_stem()?.to_str()?.parse::<f64>().ok().filter(|time| time.is_finite());
    let mut times: Vec<f64> = images.iter().map(stem).collect::<Option<_>>()?;
    let unit = plausibility::seconds_of_clock(folder, times.iter().copied());
    for time in &mut times {
        *time /= unit;
    }
    let dates = times.iter().all(|time| (0.9e9..2.5e9).contains(time));
    let growing = times.windows(2).all(|pair| matches!(pair, [a, b] if a < b));
    if !(dates && growing) {
        return None;
    }
    Error::new("the frames have no times of their own")
        .at(folder)
        .help("they are taken from the pictures' names")
        .warn();
    Some(times)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn pictures(folder: &Path, names: &[&str]) {
        fs::create_dir_all(folder).unwrap();
        for name in names {
            fs::write(folder.join(name), "").unwrap();
        }
    }

    #[test]
    fn folders_of_known_datasets_are_found() {
        let root = tempfile::tempdir().unwrap();
        let euroc = root.path().join("MH_01");
        pictures(&euroc.join("mav0/cam0/data"), &["1403636579763555584.png", "1403636579813555456.png"]);
        fs::write(
            euroc.join("mav0/cam0/data.csv"),
            "#timestamp [ns],filename\r\n1403636579763555584,1403636579763555584.png\r\n\
             1403636579813555456,1403636579813555456.png\r\n1403636579863555584,gone.png\r\n",
        )
        .unwrap();
        for place in ["", "mav0", "mav0/cam0", "mav0/cam0/data"] {
            let found = frames(&euroc.join(place), None).unwrap();
            assert_eq!((found.images.len(), found.times.len()), (2, 2), "{place}");
            assert!((found.times[1] - found.times[0] - 0.05).abs() < 1e-5);
        }
        let tum = root.path().join("tum");
        pictures(&tum.join("rgb"), &["1305031102.175304.png", "1305031102.211214.png"]);
        fs::write(tum.join("rgb.txt"), "# list\n1305031102.175304 rgb/1305031102.175304.png\n1305031102.211214 rgb/1305031102.211214.png\n").unwrap();
        for place in ["", "rgb"] {
            assert_eq!(
                frames(&tum.join(place), None).unwrap().times,
                [1_305_031_102.175_304, 1_305_031_102.211_214]
            );
        }
        fs::remove_file(tum.join("rgb.txt")).unwrap();
        assert_eq!(frames(&tum.join("rgb"), None).unwrap().times.len(), 2, "from the names");
        let kitti = root.path().join("00");
        pictures(&kitti.join("image_0"), &["000000.png", "000001.png"]);
        assert!(frames(&kitti, None).unwrap_err().to_string().contains("no times"));
        fs::write(kitti.join("times.txt"), "0.000000e+00\n1.037359e-01\n").unwrap();
        assert_eq!(frames(&kitti, None).unwrap().times, [0.0, 0.103_735_9]);
        fs::write(kitti.join("times.txt"), "0 000001.png\n0.1 image_0/000000.png\n").unwrap();
        assert!(frames(&kitti, None).unwrap().images[0].ends_with("000001.png"), "a list's own order");
        fs::write(kitti.join("times.txt"), "0 000001.png\n0.1 2.png\n").unwrap();
        assert!(frames(&kitti, None).unwrap_err().to_string().contains("`2.png`, which is not in"));
        fs::write(kitti.join("times.txt"), "0.000000e+00\n1.037359e-01\n").unwrap();
        pictures(&kitti.join("image_0"), &["000002.png"]);
        assert!(frames(&kitti, None).unwrap_err().to_string().contains("2 times for 3 pictures"));
        crate::warnings::forget();
    }
}

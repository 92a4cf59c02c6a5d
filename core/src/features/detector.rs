//! Either kind of keypoints with memory from the heap, for hosts and browsers.
use super::{
    BriefDescriptor, Keypoint, Match, MatchConfig, Nearest, brief_work_len, detect_brief, match_descriptors,
};
#[cfg(feature = "sift")]
use super::{Candidate, Sift, SiftConfig, SiftDescriptor, SiftWork, sift_samples_len};
use crate::Result;
use crate::image::Grey;
use alloc::vec;
use alloc::vec::Vec;

/// Which keypoints, and how they are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FeatureKind {
    /// FAST-9 corners with oriented BRIEF.
    Brief {
        /// Grey levels by which an arc of the circle differs.
        threshold: u8,
    },
    /// Blobs of any scale.
    #[cfg(feature = "sift")]
    Sift(SiftConfig),
}

/// The descriptors of a picture's keypoints.
#[derive(Clone, Debug, PartialEq)]
pub enum Descriptors {
    /// Of FAST corners.
    Brief(Vec<BriefDescriptor>),
    /// Of blobs.
    #[cfg(feature = "sift")]
    Sift(Vec<SiftDescriptor>),
}

/// A picture's keypoints with a descriptor each.
#[derive(Clone, Debug, PartialEq)]
pub struct Features {
    /// Where they are.
    pub keypoints: Vec<Keypoint>,
    /// What they look like, in the same order.
    pub descriptors: Descriptors,
    /// Keypoints that the capacity of one for 20 pixels, at most [`MAX_KEYPOINTS`], left out.
    pub left_out: usize,
}

/// Keypoints of a picture at most.
pub const MAX_KEYPOINTS: usize = 50_000;

/// Keypoints of a picture that [`Detector::detect_at_least`] is asked for by `match`: chosen on simulated corridors, with and
/// without texture.
pub const ENOUGH_KEYPOINTS: usize = 200;

/// Shares of the contrast that are asked for where there are too few keypoints, of blobs and of corners: below the last
/// it is noise that is found.
const LESS_CONTRAST: [[f32; 2]; 3] = [[0.57, 0.7], [0.343, 0.5], [0.2, 0.35]];

impl FeatureKind {
    fn with_less_contrast(self, shares: [f32; 2]) -> Self {
        match self {
            Self::Brief { threshold } => Self::Brief { threshold: (f32::from(threshold) * shares[1]) as u8 },
            #[cfg(feature = "sift")]
            Self::Sift(config) => Self::Sift(SiftConfig { contrast: config.contrast * shares[0], ..config }),
        }
    }
}

impl Features {
    /// The matches of these, as the first, with another picture's. Different kinds have none. Of two keypoints in
    /// one place with two directions, both matched with one place, one is left: they are one piece of evidence.
    ///
    /// # Errors
    /// As [`match_descriptors`].
    pub fn matches(&self, other: &Self, config: &MatchConfig) -> Result<Vec<Match>> {
        let mut work = vec![Nearest::default(); self.keypoints.len() + other.keypoints.len()];
        let mut matches = vec![Match::default(); self.keypoints.len().min(other.keypoints.len())];
        let report = match (&self.descriptors, &other.descriptors) {
            (Descriptors::Brief(first), Descriptors::Brief(second)) => {
                match_descriptors(first, second, config, &mut work, &mut matches)?
            }
            #[cfg(feature = "sift")]
            (Descriptors::Sift(first), Descriptors::Sift(second)) => {
                match_descriptors(first, second, config, &mut work, &mut matches)?
            }
            #[cfg(feature = "sift")]
            _ => return Ok(Vec::new()),
        };
        matches.truncate(report.matches);
        let place = |features: &Self, index: usize| features.keypoints.get(index).map(|point| point.pixel);
        let places = |pair: &Match| (place(self, pair.first), place(other, pair.second));
        matches.dedup_by(|later, earlier| places(later) == places(earlier));
        Ok(matches)
    }
}

/// A detector of one kind that keeps its working memory from picture to picture.
///
/// ```
/// use monorange_core::features::{Detector, FeatureKind, SiftConfig};
/// use monorange_core::image::Grey;
/// let pixels: Vec<u8> = (0..64 * 64).map(|k| if (k % 64 - 30) * (k % 64 - 30) + (k / 64 - 30) * (k / 64 - 30) < 50 { 200 } else { 60 }).collect();
/// let mut detector = Detector::new(FeatureKind::Sift(SiftConfig::default()))?;
/// let found = detector.detect(Grey::new(&pixels, 64, 64)?)?;
/// assert!(found.keypoints.iter().any(|blob| (blob.pixel.x - 30.0).abs() < 0.1));
/// # Ok::<(), monorange_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Detector {
    kind: FeatureKind,
    rows: Vec<u8>,
    #[cfg(feature = "sift")]
    samples: Vec<i16>,
    #[cfg(feature = "sift")]
    candidates: Vec<Candidate>,
}

impl Detector {
    /// A detector of a kind.
    ///
    /// # Errors
    /// [`Error::OutOfRange`](crate::Error::OutOfRange) for an unusable setting.
    pub fn new(kind: FeatureKind) -> Result<Self> {
        #[cfg(feature = "sift")]
        if let FeatureKind::Sift(config) = kind {
            Sift::new(config)?;
        }
        Ok(Self {
            kind,
            rows: Vec::new(),
            #[cfg(feature = "sift")]
            samples: Vec::new(),
            #[cfg(feature = "sift")]
            candidates: Vec::new(),
        })
    }

    /// The picture's keypoints.
    ///
    /// # Errors
    /// [`Error::Size`](crate::Error::Size) for a picture of more than 16,384 pixels a side (SIFT only).
    pub fn detect(&mut self, picture: Grey<'_>) -> Result<Features> {
        let (width, height) = (picture.width(), picture.height());
        let room = (width.saturating_mul(height) / 20).clamp(100, MAX_KEYPOINTS);
        let mut keypoints = vec![Keypoint::default(); room];
        let (count, descriptors, left_out) = match self.kind {
            FeatureKind::Brief { threshold } => {
                self.rows.resize(brief_work_len(width), 0);
                let mut descriptors = vec![BriefDescriptor::default(); room];
                let report =
                    detect_brief(picture, threshold, &mut self.rows, &mut keypoints, &mut descriptors)?;
                descriptors.truncate(report.keypoints);
                (report.keypoints, Descriptors::Brief(descriptors), report.truncated)
            }
            #[cfg(feature = "sift")]
            FeatureKind::Sift(config) => {
                self.samples.resize(sift_samples_len(width, height, &config), 0);
                self.candidates.resize(room, Candidate::default());
                let mut work = SiftWork { samples: &mut self.samples, candidates: &mut self.candidates };
                let mut descriptors = vec![[0; 128]; room];
                let sift = Sift::new(config)?;
                let report = sift.detect(picture, &mut work, &mut keypoints, &mut descriptors)?;
                descriptors.truncate(report.keypoints);
                let left_out = report.dropped + report.truncated;
                (report.keypoints, Descriptors::Sift(descriptors), left_out)
            }
        };
        keypoints.truncate(count);
        Ok(Features { keypoints, descriptors, left_out })
    }

    /// The picture's keypoints, as [`detect`](Self::detect), and where they are fewer than `wanted`, those of less contrast:
    /// a picture of plain walls has a dozen otherwise, and of a dozen none may be on one plane.
    ///
    /// # Errors
    /// As [`detect`](Self::detect).
    pub fn detect_at_least(&mut self, picture: Grey<'_>, wanted: usize) -> Result<Features> {
        let asked = self.kind;
        let mut outcome = self.detect(picture);
        for shares in LESS_CONTRAST {
            if outcome.as_ref().is_ok_and(|found| found.keypoints.len() < wanted) {
                self.kind = asked.with_less_contrast(shares);
                outcome = self.detect(picture);
            }
        }
        self.kind = asked;
        outcome
    }
}

#[cfg(all(test, feature = "sift"))]
mod tests {
    use super::*;

    #[test]
    fn too_few_keypoints_are_looked_for_again_with_less_contrast() {
        // Squares of 60, 13 and 5 grey levels above their ground.
        let above = |u: usize| [60, 13, 5][u / 64];
        let grey = |k: usize| {
            let (u, v) = (k % 192, k / 192);
            100 + if u % 16 < 8 && v % 16 < 8 { above(u) } else { 0 }
        };
        let pixels: Vec<u8> = (0..192 * 160).map(grey).collect();
        let picture = Grey::new(&pixels, 192, 160).expect("as many pixels as it says");
        for kind in [FeatureKind::Brief { threshold: 20 }, FeatureKind::Sift(SiftConfig::default())] {
            let mut detector = Detector::new(kind).expect("sound settings");
            let plain = detector.detect(picture).expect("a small picture");
            let count = plain.keypoints.len();
            assert_eq!(detector.detect_at_least(picture, count).expect("the same"), plain, "they are enough");
            let more = detector.detect_at_least(picture, count + 1).expect("a small picture");
            assert!(more.keypoints.len() > count, "{count}, then {}", more.keypoints.len());
            assert_eq!(detector.detect(picture).expect("the same"), plain, "the setting is as it was");
        }
    }

    #[test]
    fn a_place_with_two_directions_is_matched_once() {
        let keypoint = |u: f32, angle: f32| Keypoint { pixel: [u, 5.0].into(), angle, ..Default::default() };
        let (mut one, mut two) = ([0; 128], [0; 128]);
        (one[0], two[1]) = (200, 200);
        let seen = |u| Features {
            keypoints: vec![keypoint(u, 0.0), keypoint(u, 2.0)],
            descriptors: Descriptors::Sift(vec![one, two]),
            left_out: 0,
        };
        let matches = seen(3.0).matches(&seen(8.0), &MatchConfig::default()).expect("a ratio");
        assert_eq!(matches.len(), 1);
        let mut elsewhere = seen(8.0);
        elsewhere.keypoints[1].pixel.x = 9.0;
        let matches = seen(3.0).matches(&elsewhere, &MatchConfig::default()).expect("a ratio");
        assert_eq!(matches.len(), 2, "two places are two pieces of evidence");
    }
}

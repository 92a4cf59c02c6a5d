//! What a pipeline is set to: the camera on its mount, and every setting.
use super::MotionNoise;
#[cfg(all(feature = "alloc", feature = "sift"))]
use super::VisualConfig;
use crate::association::Carrier;
use crate::geometry::{MOUNT_STD_BY_HAND, RangeFinder};
use crate::lines::ExtractConfig;
use crate::setting::{self, choices, settings};
use crate::slam::{Covariance, FilterConfig, MapConfig, Variant, View};
use crate::{Error, Result};
use nalgebra::Vector2;

/// What the filter is told of a floor corner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Model {
    /// Range and bearing with first-order covariance, as in the paper.
    RangeBearing,
    /// The pixel itself, whose noise is Gaussian up to the horizon.
    #[default]
    Pixel,
}

choices!(Model { "range_bearing" => RangeBearing, "pixel" => Pixel });

/// What is done about the error of the mount, which all corners share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MountError {
    /// The mount is taken as exact.
    Exact,
    /// Its errors are states of the filter, with these standard deviations as prior: the filter calibrates the mount as it drives.
    #[default]
    Estimated,
}

choices!(MountError { "exact" => Exact, "estimated" => Estimated });

/// Where the robot's motion comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotionFrom {
    /// Its odometry; together with the pictures where the floor carries corners ([`Carrier::Floor`]).
    #[default]
    ByCarrier,
    /// Its odometry alone.
    Odometry,
    /// The pictures; together with odometry where some is given.
    Pictures,
}

/// What finds a picture's corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CornersFrom {
    /// Lines of the Hough transform: few, and the same on every target ([`lines`](crate::lines)).
    #[default]
    Lines,
    /// Feet of upright edges, each with a probability: more, on hosts only ([`proposals`](crate::proposals)).
    Proposals,
}

choices!(CornersFrom { "lines" => Lines, "proposals" => Proposals });

/// Settings of the whole pipeline. Checked once, by [`Pipeline::new`](super::Pipeline::new).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// The camera on its mount.
    pub finder: RangeFinder<f32>,
    /// Standard deviations of the mount's height (m), tilt, roll and yaw (rad).
    pub mount_std: [f32; 4],
    /// Seconds from the first row's exposure to the last one's, of a rolling shutter; 0 of a global one.
    pub readout: f32,
    /// What is done about the mount's errors.
    pub mount_error: MountError,
    /// Standard deviation by which tilt and roll change from picture to picture, because the robot pitches and rolls, rad; 0 of
    /// one that does not. Above 0 the mount's errors must be estimated, and the covariance packed.
    pub sway: f32,
    /// Standard deviation by which each of the mount's angles changes from picture to picture for good, because it gives way or is
    /// knocked, rad; 0 of one that is bolted on. As [`sway`](Self::sway) otherwise.
    pub mount_walk: f32,
    /// What the filter is told of a corner.
    pub model: Model,
    /// Least standard deviation of a corner in either direction, px: what calibration and undistortion leave.
    pub corner_std_floor_px: f32,
    /// Least angle below the horizon at which a corner is measured, rad: nearer to it a range is a guess, and a skirting board
    /// is narrower than the smoothing, which pushes the edge of the floor half a pixel off.
    pub min_depression: f32,
    /// Which filter, and its gate. Its range finder, its mount's and its wheels' states, its sway and its mount's walk are set from the fields beside it.
    pub filter: FilterConfig<f32>,
    /// What carries corners from picture to picture. All but [`Carrier::Map`] need the features `alloc` and `sift`.
    pub carrier: Carrier,
    /// Where the robot's motion comes from. [`MotionFrom::Pictures`] needs the features `alloc` and `sift`.
    pub motion_from: MotionFrom,
    /// How the motion follows from pictures, where they are asked.
    #[cfg(all(feature = "alloc", feature = "sift"))]
    pub visual: VisualConfig,
    /// Who is who, and what becomes of landmarks. Its view is set from the camera.
    pub map: MapConfig<f32>,
    /// How well odometry tells the robot's motion.
    pub motion: MotionNoise,
    /// What finds corners. [`CornersFrom::Proposals`] needs the features `alloc` and `proposals`.
    pub corners_from: CornersFrom,
    /// What counts as an edge, a line and a corner, where lines find them.
    pub extract: ExtractConfig,
}

impl Config {
    /// The defaults for a camera on its mount.
    pub fn new(finder: RangeFinder<f32>) -> Self {
        let [height, tilt, roll, yaw, ..] = MOUNT_STD_BY_HAND;
        Self {
            finder,
            mount_std: [height, tilt, roll, yaw].map(|std| std as f32),
            readout: 0.0,
            mount_error: MountError::default(),
            sway: 0.0,
            mount_walk: 0.0,
            model: Model::default(),
            corner_std_floor_px: 0.3,
            min_depression: 3_f32.to_radians(),
            filter: FilterConfig::default(),
            carrier: Carrier::default(),
            motion_from: MotionFrom::default(),
            #[cfg(all(feature = "alloc", feature = "sift"))]
            visual: VisualConfig::default(),
            // In a corridor of 66 m by 2 m the extractor finds some 110 corners, and each picture shows half of those in view.
            map: MapConfig { density: 0.3, caution: 6.0, ..MapConfig::default() },
            motion: MotionNoise::default(),
            corners_from: CornersFrom::default(),
            extract: ExtractConfig::default(),
        }
    }

    /// The paper's own choices where this project has others: textbook filter, range and bearing, the mount taken
    /// as exact, corners carried by the free homography of eight parameters. With [`Carrier::Map`] instead, the same
    /// without a homography.
    pub fn as_in_the_paper(finder: RangeFinder<f32>) -> Self {
        let mut config = Self::new(finder);
        config.filter.variant = Variant::Textbook;
        config.filter.covariance = Covariance::Packed;
        config.model = Model::RangeBearing;
        config.mount_error = MountError::Exact;
        config.carrier = Carrier::Free;
        config
    }

    /// Whether this build has what the settings ask for.
    ///
    /// # Errors
    /// As [`needs_no_features`](Self::needs_no_features), without the features `alloc` and `sift`;
    /// [`Error::Unsupported`] for [`Carrier::Free`] without the feature `free-homography`, and for [`CornersFrom::Proposals`]
    /// without `alloc` and `proposals`.
    pub fn supported(&self) -> Result<()> {
        if self.corners_from == CornersFrom::Proposals && !cfg!(all(feature = "alloc", feature = "proposals"))
        {
            let reason = "proposals are found on hosts only, here \"lines\" works";
            return Err(Error::Unsupported { name: "extract.corners", reason });
        }
        if !cfg!(all(feature = "alloc", feature = "sift")) {
            return self.needs_no_features();
        }
        if self.carrier == Carrier::Free && !cfg!(feature = "free-homography") {
            let reason = "the free homography is not built in here, \"map\" and \"floor\" work";
            return Err(Error::Unsupported { name: "association.carrier", reason });
        }
        Ok(())
    }

    /// Whether rows and odometry are all that the settings need: no picture is matched with another.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a carrier other than the map, and for a motion from pictures.
    pub fn needs_no_features(&self) -> Result<()> {
        let (name, reason) = match (self.motion_from, self.carrier) {
            (MotionFrom::ByCarrier | MotionFrom::Odometry, Carrier::Map) => return Ok(()),
            (MotionFrom::ByCarrier | MotionFrom::Odometry, _) => {
                ("association.carrier", "pictures are not matched here, only \"map\" works")
            }
            (MotionFrom::Pictures, _) => ("motion_from", "pictures are not matched here, give odometry"),
        };
        Err(Error::Unsupported { name, reason })
    }

    /// Whether pictures are matched with one another: for the robot's motion, or to carry corners.
    #[cfg(all(feature = "alloc", feature = "sift"))]
    pub(super) fn asks_pictures(&self) -> bool {
        self.needs_no_features().is_err()
    }

    /// The settings with those that follow from others filled in, if every value is usable.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name of the first value that is not, as a rig file has it.
    pub fn validated(mut self) -> Result<Self> {
        for (name, std) in MOUNT_STD_NAMES.into_iter().zip(self.mount_std) {
            if !(std.is_finite() && std >= 0.0) {
                let expected = "finite and at least 0";
                return Err(Error::OutOfRange { name, value: std.into(), expected });
            }
        }
        setting::check(&EXTRACTED, &mut self)?;
        setting::check(&FILTERED, &mut self)?;
        setting::check(&MEASURED, &mut self)?;
        setting::check(&SHUTTER, &mut self)?;
        self.motion = self.motion.validated()?;
        #[cfg(all(feature = "alloc", feature = "sift"))]
        self.visual.check()?;
        self.extract = self.extract.validated()?;
        self.filter.finder = Some(self.finder);
        self.filter.mount_std = match self.mount_error {
            MountError::Exact => None,
            // A parameter known exactly is a state that hardly moves: the filter wants variances above 0.
            MountError::Estimated => Some(self.mount_std.map(|std| std.max(1e-5))),
        };
        (self.filter.sway, self.filter.mount_walk) = (self.sway, self.mount_walk);
        self.filter.wheels_std = self.motion.scale_std();
        self.map.view = self.view();
        self.filter = self.filter.validated()?;
        self.map = self.map.validated()?;
        Ok(self)
    }

    /// The farthest range that is measured, m.
    pub(super) fn max_range(&self) -> f32 {
        self.finder.mount().height() / libm::tanf(self.min_depression)
    }

    /// The part of the floor that is in the picture, as a sector round the robot.
    fn view(&self) -> View<f32> {
        let camera = self.finder.camera();
        let (width, height) = (camera.width() as f32, camera.height() as f32);
        let bearing =
            |u: f32| self.finder.sight(Vector2::new(u, 0.6 * height)).map_or(0.0, |seen| seen.bearing.abs());
        let bottom = self.finder.sight(Vector2::new(0.5 * width, height - 1.0));
        View {
            near: bottom.map_or(0.0, |seen| seen.range),
            far: self.max_range(),
            half_angle: bearing(0.0).min(bearing(width - 1.0)),
        }
    }
}

const MOUNT_STD_NAMES: [&str; 4] =
    ["mount.height_std", "mount.tilt_std_deg", "mount.roll_std_deg", "mount.yaw_std_deg"];

settings! { EXTRACTED, EXTRACTED_REFERENCES, Config, "extract" {
    60 corners: Choice [corners_from] "What finds corners: lines, few and on every target, or proposals, feet of upright edges each with a probability, on hosts.", "lines is what every target has; slam of a host takes proposals where the rig does not say (tests/scoring/README.md).";
}}

settings! { FILTERED, FILTERED_REFERENCES, Config, "filter" {
    2 model: Choice [model] "What the filter is told of a corner: its pixel, or range and bearing as in the paper.", "Equation: a pixel's noise is Gaussian up to the horizon, a range's is not.";
    1 mount: Choice [mount_error] "What is done about the mount's own error: estimated along with the map, or taken as exact.", "All corners share the mount's error, so that it is no independent noise (theory page of core::slam).";
    64 sway: Number [sway] (0, 0.2, "rad"), "Standard deviation by which tilt and roll change from picture to picture, as the robot pitches and rolls; 0 of one that does not.", "Most robots with wheels are stiff; README tells by how much a pitching one errs.";
    66 mount_walk: Number [mount_walk] (0, 0.1, "rad"), "Standard deviation by which each of the mount's angles changes from picture to picture for good, as where it gives way or is knocked; 0 of one that is bolted on.", "0 is what was measured with so far; README tells what 0.001 does to a camera that is knocked.";
}}

settings! { MEASURED, MEASURED_REFERENCES, Config, "association" {
    3 corner_std_floor_px: Number [corner_std_floor_px] (0, 100, "px"), "Least standard deviation of a corner: what calibration and undistortion leave. A rig whose pixel_std is larger raises the default to it.", "Simulated corridors.";
    4 min_depression: Number [min_depression] (0.001, 1.57, "rad"), "Least angle below the horizon at which a corner is measured.", "Simulated corridors: nearer to the horizon a skirting board is narrower than the smoothing, which pushes the floor's edge half a pixel off.";
    44 carrier: Choice [carrier] "What carries corners to the next picture: map is nothing, floor the floor's homography, free the one of eight parameters as in the paper.", "map is the only one that every target can run; in tests/dynamic_corridor floor misses the fewest corners.";
}}

settings! { SHUTTER, SHUTTER_REFERENCES, Config, "shutter" {
    65 readout: Number [readout] (0, 1, "s"), "Seconds from the first row's exposure to the last one's, of a rolling shutter; 0 of a global one. A picture's time is then that of its middle row.", "0 is a global shutter; the data sheet says it, many small cameras take 0.02 to 0.035.";
}}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Camera, Mount};
    use std::string::ToString;

    #[test]
    fn what_needs_features_is_refused_in_words_where_there_are_none() {
        let camera = Camera::new(64, 48, [60.0; 2], [32.0, 24.0], 0.0, Default::default()).unwrap();
        let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
        let config = Config::new(finder);
        assert_eq!(config.needs_no_features(), Ok(()));
        for carrier in [Carrier::Floor, Carrier::Free] {
            let refused = Config { carrier, ..config }.needs_no_features().unwrap_err().to_string();
            assert!(refused.contains("association.carrier") && refused.contains("\"map\""), "{refused}");
        }
        let free = Config { carrier: Carrier::Free, ..config }.supported();
        assert_eq!(free.is_ok(), cfg!(feature = "free-homography"), "{free:?}");
        let refused = Config { motion_from: MotionFrom::Pictures, ..config }.needs_no_features();
        assert!(refused.unwrap_err().to_string().contains("give odometry"));
    }

    fn config() -> Config {
        let camera = Camera::new(320, 240, [365.0, 365.0], [160.0, 120.0], 0.0, Default::default()).unwrap();
        Config::new(RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap()))
    }

    fn refused(change: impl FnOnce(&mut Config)) -> &'static str {
        let mut config = config();
        change(&mut config);
        match config.validated() {
            Err(Error::OutOfRange { name, .. }) => name,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_defaults_are_valid() {
        assert!(config().validated().is_ok());
        assert!(Config::as_in_the_paper(config().finder).validated().is_ok());
    }

    #[test]
    fn a_caution_that_is_no_number_is_refused() {
        // Every comparison with NaN fails, so that nothing would ever be sure.
        assert_eq!(refused(|config| config.map.caution = f32::NAN), "association.caution");
    }

    #[test]
    fn a_horizon_or_a_plumb_line_is_no_least_depression() {
        for angle in [0.0, -0.1, core::f32::consts::FRAC_PI_2, 2.0, f32::NAN, f32::INFINITY] {
            assert_eq!(refused(|config| config.min_depression = angle), "association.min_depression");
        }
    }

    #[test]
    fn one_verb_checks_filter_and_map_too() {
        assert_eq!(refused(|config| config.map.birth_nis = 1.0), "association.birth_nis");
        assert_eq!(refused(|config| config.map.within = 2), "association.confirm");
        assert_eq!(refused(|config| config.map.joint_nodes = 0), "association.joint_nodes");
        assert_eq!(refused(|config| config.filter.linearity = 0.0), "filter.linearity");
        assert_eq!(refused(|config| config.mount_std[1] = f32::NAN), "mount.tilt_std_deg");
    }
}

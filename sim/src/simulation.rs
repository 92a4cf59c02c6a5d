//! A drive through a scene: pictures, odometry, laser, and the truth about them.
use crate::laser::{Beam, LaserConfig};
use crate::odometry::OdometryNoise;
use crate::path::{Drive, Path, Twist};
use crate::render::{Lens, Looks, Sensor, View, render};
use crate::scene::{Landmark, Scene, Use};
use crate::truth::{TrueCorner, corners};
use crate::walker::{Walker, walk};
use monorange_core::geometry::{Mount, Pose, RangeFinder};
use monorange_core::{Error, Result};

/// How the robot drives and how well its sensors see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimConfig {
    /// Seed of all noise and of the walkers' ways. The scene has a seed of its own.
    pub seed: u64,
    /// Pictures; the robot goes round again when the way is shorter.
    pub frames: usize,
    /// Seconds from one picture to the next.
    pub interval: f64,
    /// Of the robot, m/s.
    pub speed: f64,
    /// How far the robot weaves to each side, m.
    pub weave: f64,
    /// People about.
    pub walkers: usize,
    /// Standard deviation of a pixel's grey level.
    pub pixel_noise: f64,
    /// Standard deviation of the lens's blur, px (at most 0.8).
    pub blur_px: f64,
    /// Factor on every grey level.
    pub gain: f64,
    /// Share of the light lost at the picture's corners.
    pub vignette: f64,
    /// How far the robot pitches about its lens to either side, rad, and how often a second.
    pub pitch: f64,
    /// Of the pitching, Hz.
    pub pitch_rate: f64,
    /// Seconds from the first row's exposure to the last one's; 0 for a global shutter.
    pub readout: f64,
    /// Errors of the wheels.
    pub odometry: OdometryNoise,
    /// Factor on all of them.
    pub odometry_noise_scale: f64,
    /// The laser beside the camera.
    pub laser: LaserConfig,
}

impl Default for SimConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            frames: 600,
            interval: 0.6,
            speed: 0.2,
            weave: 0.1,
            walkers: 3,
            pixel_noise: 2.0,
            blur_px: 0.5,
            gain: 1.0,
            vignette: 0.18,
            pitch: 0.0,
            pitch_rate: 1.0,
            readout: 0.0,
            odometry: OdometryNoise::default(),
            odometry_noise_scale: 1.0,
            laser: LaserConfig::default(),
        }
    }
}

impl SimConfig {
    fn check(&self) -> Result<()> {
        let above = [("interval", self.interval), ("speed", self.speed), ("gain", self.gain)];
        let least = [
            ("weave", self.weave),
            ("pixel_noise", self.pixel_noise),
            ("blur_px", self.blur_px),
            ("vignette", self.vignette),
            ("pitch", self.pitch),
            ("pitch_rate", self.pitch_rate),
            ("readout", self.readout),
            ("odometry_noise_scale", self.odometry_noise_scale),
            ("laser.range_std", self.laser.range_std),
            ("laser.max_range", self.laser.max_range),
        ];
        for (name, value) in above {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::OutOfRange { name, value, expected: "a finite number above 0" });
            }
        }
        for (name, value) in least {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::OutOfRange { name, value, expected: "a finite number of at least 0" });
            }
        }
        if self.interval * self.speed > 0.6 {
            let value = self.interval * self.speed;
            return Err(Error::OutOfRange {
                name: "interval · speed",
                value,
                expected: "at most 0.6 m a frame",
            });
        }
        Ok(())
    }
}

/// Rows of a rolling shutter that are drawn as of one moment.
const BAND: usize = 10;

/// A drive: everything about frame k follows from the scene, the rig, the settings and k alone.
///
/// ```
/// use monorange_sim::{Scene, SceneConfig, SimConfig, Simulation, default_rig};
/// let scene = Scene::corridor(&SceneConfig::default());
/// let config = SimConfig { frames: 10, ..SimConfig::default() };
/// let simulation = Simulation::new(scene, default_rig()?, config)?;
/// let mut pixels = vec![0; 320 * 240];
/// simulation.render(3, &mut pixels)?;
/// assert!((simulation.time(3) - 1.8).abs() < 1e-12);
/// # Ok::<(), monorange_core::Error>(())
/// ```
pub struct Simulation {
    scene: Scene,
    rig: RangeFinder<f64>,
    config: SimConfig,
    drive: Drive,
    odometry: Vec<Twist>,
    walkers: Vec<Vec<Walker>>,
    lens: Lens,
    looks: Looks,
    sensor: Sensor,
}

impl Simulation {
    /// A drive through `scene` with the camera that `rig` truly is.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a setting that is not finite or absurd, named.
    pub fn new(scene: Scene, rig: RangeFinder<f64>, config: SimConfig) -> Result<Self> {
        config.check()?;
        let noise = config.odometry.scaled(config.odometry_noise_scale);
        let (drive, walkers) = match &scene.purpose {
            Use::Loop { way, walkway } => {
                let path = Path::rounded(way);
                let drive = Drive::new(&path, config.frames, config.interval, config.speed, config.weave);
                let people = config.walkers;
                let walkers = walk(&path, &drive.arcs, config.interval, *walkway, people, config.seed);
                (drive, walkers)
            }
            Use::Stands(stands) => {
                let poses = stands.iter().copied().cycle().take(config.frames).collect();
                let still = vec![Twist::default(); config.frames];
                let drive = Drive { poses, twists: still, arcs: vec![0.0; config.frames] };
                (drive, vec![Vec::new(); config.frames])
            }
        };
        let odometry = noise.measure(&drive.twists, config.seed);
        let lens = Lens::new(&rig);
        let looks = Looks::new(&scene, lens.pixel_angle());
        let sensor = Sensor::new(&rig, config.gain, config.vignette, config.blur_px, config.pixel_noise);
        Ok(Self { scene, rig, config, drive, odometry, walkers, lens, looks, sensor })
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.drive.poses.len()
    }

    /// Whether there are no frames.
    pub fn is_empty(&self) -> bool {
        self.drive.poses.is_empty()
    }

    /// Where the robot drives.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The camera as it truly is.
    pub fn rig(&self) -> &RangeFinder<f64> {
        &self.rig
    }

    /// The camera as it sits when the picture is taken: tilted further while the robot pitches forward.
    pub fn true_rig(&self, frame: usize) -> RangeFinder<f64> {
        let turns = self.config.pitch_rate * self.time(frame);
        let pitch = self.config.pitch * libm::sin(core::f64::consts::TAU * turns);
        let mount = self.rig.mount();
        let [height, tilt, roll, yaw, forward, left] = mount.parameters();
        let pitched = Mount::new([height, tilt + pitch, roll, yaw, forward, left]);
        RangeFinder::new(*self.rig.camera(), pitched.unwrap_or(*mount))
    }

    /// The settings.
    pub fn config(&self) -> &SimConfig {
        &self.config
    }

    /// Every true floor corner.
    pub fn landmarks(&self) -> &[Landmark] {
        self.scene.landmarks()
    }

    /// When the picture is taken, s.
    pub fn time(&self, frame: usize) -> f64 {
        frame as f64 * self.config.interval
    }

    /// The robot in the world when the picture is taken; frames beyond the last are the last.
    pub fn true_pose(&self, frame: usize) -> Pose<f64> {
        self.clamped(&self.drive.poses, frame).unwrap_or_default()
    }

    /// The true motion from this frame to the next.
    pub fn true_twist(&self, frame: usize) -> Twist {
        self.clamped(&self.drive.twists, frame).unwrap_or_default()
    }

    /// What the wheels report of the motion from this frame to the next: a line of odometry at this frame's
    /// time, which holds until the next.
    pub fn odometry(&self, frame: usize) -> Twist {
        self.clamped(&self.odometry, frame).unwrap_or_default()
    }

    /// The noise that the odometry was drawn with, scale factor included.
    pub fn odometry_noise(&self) -> OdometryNoise {
        self.config.odometry.scaled(self.config.odometry_noise_scale)
    }

    /// Root mean square over the drive of the standard deviations of a line of odometry: the constant σ of
    /// speed and turn rate for a filter that has one.
    pub fn odometry_std(&self) -> Twist {
        let noise = self.odometry_noise();
        let count = self.len().max(1) as f64;
        let sum = self
            .drive
            .twists
            .iter()
            .map(|twist| noise.std(*twist))
            .fold([0.0; 2], |sum, std| [sum[0] + std.speed * std.speed, sum[1] + std.turn * std.turn]);
        Twist { speed: libm::sqrt(sum[0] / count), turn: libm::sqrt(sum[1] / count) }
    }

    /// The people about.
    pub fn walkers(&self, frame: usize) -> &[Walker] {
        let last = self.walkers.len().saturating_sub(1);
        self.walkers.get(frame.min(last)).map_or(&[], Vec::as_slice)
    }

    /// Draws the picture into `pixels`, row-major, one byte each.
    ///
    /// # Errors
    /// [`Error::Size`] unless `pixels` has the camera's width × height.
    pub fn render(&self, frame: usize, pixels: &mut [u8]) -> Result<()> {
        let expected = self.rig.camera().width() * self.rig.camera().height();
        if pixels.len() != expected {
            return Err(Error::Size { name: "pixels", got: pixels.len(), expected });
        }
        let rig = self.true_rig(frame);
        let pitched = (self.config.pitch > 0.0).then(|| Lens::new(&rig));
        let lens = pitched.as_ref().unwrap_or(&self.lens);
        let draw = |pose: &Pose<f64>, levels: &mut [f32]| {
            let view = View::new(lens, &rig, &self.scene, self.walkers(frame), pose);
            render(lens, &view, &self.looks, levels);
        };
        let mut levels = vec![0.0; expected];
        if self.config.readout > 0.0 {
            let width = rig.camera().width();
            let mut moment = vec![0.0; expected];
            for (band, levels) in levels.chunks_mut(BAND * width).enumerate() {
                draw(&self.pose_at_row(frame, (band * BAND) as f64 + 0.5 * (BAND - 1) as f64), &mut moment);
                levels.copy_from_slice(&moment[band * BAND * width..][..levels.len()]);
            }
        } else {
            draw(&self.true_pose(frame), &mut levels);
        }
        self.sensor.expose(&mut levels, self.config.seed, frame, pixels);
        Ok(())
    }

    /// Every true floor corner within the picture, hidden ones too. Range and bearing are those of the moment when the picture is
    /// taken, the pixel is where a rolling shutter has it.
    pub fn corners(&self, frame: usize) -> Vec<TrueCorner> {
        let rig = self.true_rig(frame);
        let mut seen = corners(&self.scene, &rig, self.walkers(frame), &self.true_pose(frame));
        if self.config.readout > 0.0 {
            for corner in &mut seen {
                let Some(place) = self.landmarks().iter().find(|landmark| landmark.id == corner.id) else {
                    continue;
                };
                // The row that sees it is exposed when it is there.
                for _ in 0..10 {
                    let robot = self.pose_at_row(frame, corner.pixel.y);
                    let pixel = rig.pixel_from_floor_unbounded(robot.inverse_transform(place.position));
                    corner.pixel = pixel.unwrap_or(corner.pixel);
                }
            }
        }
        seen
    }

    /// The robot in the world when a row of the picture is exposed: the middle one when the picture is taken.
    fn pose_at_row(&self, frame: usize, row: f64) -> Pose<f64> {
        let rows = self.rig.camera().height() as f64 - 1.0;
        let later = (row / rows - 0.5) * self.config.readout;
        self.true_twist(frame).step(&self.true_pose(frame), later)
    }

    /// The true floor corners that the picture shows.
    pub fn visible_corners(&self, frame: usize) -> Vec<TrueCorner> {
        let mut corners = self.corners(frame);
        corners.retain(|corner| corner.hidden.is_none());
        corners
    }

    /// A laser scan at the same moment.
    pub fn laser(&self, frame: usize) -> Vec<Beam> {
        let pose = self.true_pose(frame);
        self.config.laser.scan(&self.scene, self.walkers(frame), &pose, self.config.seed, frame)
    }

    fn clamped<T: Copy>(&self, values: &[T], frame: usize) -> Option<T> {
        values.get(frame).or(values.last()).copied()
    }
}

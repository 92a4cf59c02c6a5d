//! Visual odometry alone, on a simulated corridor and on a real road, against the truth.
use monorange_core::features::{Detector, FeatureKind};
use monorange_core::geometry::{Pose, RangeFinder, wrap_angle};
use monorange_core::homography::FloorTexture;
use monorange_core::image::Grey;
use monorange_core::pipeline::{Look, VisualConfig, VisualMotion, VisualStep};
use monorange_sim::Simulation;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// A picture's features with the time it was taken (s) and the robot's true pose.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Seconds.
    pub time: f64,
    /// What the picture shows.
    pub look: Look,
    /// In the world.
    pub truth: Pose<f64>,
}

/// The features of a simulation's pictures.
///
/// # Panics
/// None: the simulation draws pictures of its own size.
pub fn simulated(simulation: &Simulation, kind: FeatureKind) -> Vec<Frame> {
    let camera = simulation.rig().camera();
    let (width, height) = (camera.width(), camera.height());
    let finder = camera.cast().expect("a camera for single precision");
    let mut detector = Detector::new(kind).expect("usable settings");
    let mut pixels = vec![0; width * height];
    let frame = |frame| {
        simulation.render(frame, &mut pixels).expect("the size is the rig's");
        let picture = Grey::new(&pixels, width, height).expect("the size is the rig's");
        let features = detector.detect(picture).expect("not too large");
        let texture = Some(FloorTexture::new(&finder, picture));
        Frame {
            time: simulation.time(frame),
            look: Look { features, texture },
            truth: simulation.true_pose(frame),
        }
    };
    (0..simulation.len()).map(frame).collect()
}

/// What visual odometry made of a drive.
#[derive(Clone, Debug, Default)]
pub struct VisualDrive {
    /// Length of the true way, m.
    pub path: f64,
    /// Length of the estimated way, m.
    pub estimated_path: f64,
    /// Distance from the true position at the end, m.
    pub end_error: f64,
    /// Heading error at the end, and the largest on the way, rad.
    pub heading_error: f64,
    /// The largest heading error, rad.
    pub worst_heading: f64,
    /// Steps that pictures gave, and all.
    pub measured: [usize; 2],
    /// Mean squared error of (path, turn) of a step over its covariance; 2 is right.
    pub step_nees: f64,
    /// Mean squared errors of the path and of the turn since the keyframe over their variances, as the pictures give
    /// them, before [`VisualConfig::covariance_factor`]; 1 is right.
    pub motion_nees: [f64; 2],
    /// Mean NEES of the pose with the steps' covariances added up as a filter does; 3 is right.
    pub pose_nees: f64,
    /// Standard deviation of the path at the end as the steps' covariances add up, m.
    pub path_std: f64,
    /// Mean number of matches on the floor.
    pub floor: f64,
    /// Mean of the residuals' variance factor.
    pub variance_factor: f64,
}

impl VisualDrive {
    /// Share of the way that the end is off by.
    pub fn end_share(&self) -> f64 {
        self.end_error / self.path
    }
}

/// Runs visual odometry over the frames.
///
/// # Panics
/// When times do not grow.
pub fn drive(config: VisualConfig, finder: &RangeFinder<f32>, frames: &[Frame]) -> VisualDrive {
    let mut visual = VisualMotion::new(config).expect("usable settings");
    let mut result = VisualDrive::default();
    let mut last: Option<(Pose<f64>, Pose<f64>)> = None;
    let (mut covariance, mut path_variance, mut counted) = (Matrix3::zeros(), 0.0, 0.0);
    let mut keyframe = Pose::default();
    for frame in frames {
        let step = visual.follow(finder, frame.time, None, frame.look.clone()).expect("times grow");
        let Some((estimate, truth)) = last else {
            last = Some((frame.truth, frame.truth));
            keyframe = frame.truth;
            continue;
        };
        let Some(step) = step else { continue };
        let true_step = truth.inverse().compose(&frame.truth);
        let found = pose_of(&step);
        let step_covariance = step.increment.covariance.cast::<f64>();
        result.path += true_step.position().norm();
        result.estimated_path += found.position().norm();
        result.measured[0] += usize::from(step.measured);
        result.measured[1] += 1;
        if let Ok(motion) = &step.motion {
            result.floor += f64::from(motion.floor);
            result.variance_factor += f64::from(motion.variance_factor);
            let moved = keyframe.inverse().compose(&frame.truth);
            let error = [
                moved.position().norm() - f64::from(motion.pose.position().norm()),
                wrap_angle(moved.heading - f64::from(motion.arc.y)),
            ];
            let variances = motion.arc_covariance.diagonal().cast::<f64>();
            for ((sum, error), variance) in result.motion_nees.iter_mut().zip(error).zip(variances.iter()) {
                *sum += error * error / variance;
            }
        }
        if step.new_keyframe {
            keyframe = frame.truth;
        }
        let error = Vector2::new(found.x - true_step.x, found.heading - true_step.heading);
        let c = step_covariance;
        let arc = Matrix2::new(c.m11, c.m13, c.m31, c.m33);
        result.step_nees += arc.try_inverse().map_or(0.0, |inverse| error.dot(&(inverse * error)));
        path_variance += c.m11;

        let estimate_now = estimate.compose(&found);
        let moved = estimate_now.position() - estimate.position();
        let carry = Matrix3::new(1.0, 0.0, -moved.y, 0.0, 1.0, moved.x, 0.0, 0.0, 1.0);
        let turn = estimate.rotation().to_homogeneous();
        covariance = carry * covariance * carry.transpose() + turn * step_covariance * turn.transpose();
        let error = Vector3::new(
            estimate_now.x - frame.truth.x,
            estimate_now.y - frame.truth.y,
            wrap_angle(estimate_now.heading - frame.truth.heading),
        );
        if let Some(inverse) = covariance.try_inverse() {
            result.pose_nees += error.dot(&(inverse * error));
            counted += 1.0;
        }
        result.end_error = error.xy().norm();
        result.heading_error = error.z.abs();
        result.worst_heading = result.worst_heading.max(error.z.abs());
        last = Some((estimate_now, frame.truth));
    }
    let steps = (result.measured[1] as f64).max(1.0);
    result.step_nees /= steps;
    result.motion_nees = result.motion_nees.map(|sum| sum / (result.measured[0] as f64).max(1.0));
    result.floor /= steps;
    result.variance_factor /= steps;
    result.pose_nees /= f64::max(counted, 1.0);
    result.path_std = path_variance.sqrt();
    result
}

fn pose_of(step: &VisualStep) -> Pose<f64> {
    let [x, y, heading] = step.increment.delta.cast::<f64>().into();
    Pose::new(x, y, heading)
}

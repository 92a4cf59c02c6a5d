//! Is the filter to be believed? A verdict from what every update and every frame says about itself.
//!
//! | evidence | what it sees |
//! |---|---|
//! | normalised innovations, mean of the last 64 measurements | noise that is set too low; 1 ± 0.125 a degree of freedom is right |
//! | measurements beyond their gate in a row | the state has left the place that the sensor sees |
//! | standard deviation of the heading, the largest since it was last known | a turn that nobody measured: no Jacobian holds |
//! | standard deviation of the position beside the path | a pose that is honest and of no use |
//! | covariances that failed | the map began anew |
//! | errors of mount and wheels beside their priors | a rig that is not as it says |
//! | refusals among landmarks that should be in view | measurements that are told to be of the wrong landmark |
//!
//! An innovation beyond its gate contributes the gate's value, not its own NIS: it may come from a neighbour that has no landmark, and
//! that neighbour's distance tells nothing of the covariance. The last row is needed because innovations are of accepted pairs only, and a pair
//! is accepted where it fits.
use crate::Real;
use crate::slam::filter::{Decision, Outcome};

/// What a user can act on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verdict {
    /// No landmark was measured twice: nothing speaks for or against the motion.
    #[default]
    Unchecked,
    /// Errors are of the size the covariance says.
    Consistent,
    /// Do not rely on it: see the [`Reason`].
    Doubtful,
    /// The pose is not known. Drive to where the map is well known, or start anew.
    Lost,
}

/// What speaks against the filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A covariance failed, and the map began anew.
    Indefinite,
    /// The heading is uncertain by more than a turn that is still linear: its change was not measured.
    Heading,
    /// Measurement after measurement lies beyond its gate: the map or the pose is wrong.
    BeyondGate,
    /// The camera seems knocked again and again: the robot pitches or rolls, and `filter.sway` says less than that.
    Attitude,
    /// Innovations are larger than the covariance says: raise the sensor's or the odometry's noise.
    Innovations,
    /// The pose may be off by more than a twentieth of the path.
    Uncertain,
    /// Where landmarks should be seen again, measurements are of none: some are told to be of a wrong one.
    Association,
    /// The camera sits otherwise than the rig says, by more than its standard deviations allow: calibrate the mount.
    Mount,
    /// The wheels read travel or turns otherwise than their standard deviations allow: measure a metre with them.
    Wheels,
    /// The robot's place in a saved map was not found: drive on where that map has landmarks.
    Elsewhere,
}

impl Reason {
    /// Every reason, the worst first.
    pub const ALL: [Self; 10] = [
        Self::Indefinite,
        Self::Heading,
        Self::BeyondGate,
        Self::Attitude,
        Self::Innovations,
        Self::Uncertain,
        Self::Association,
        Self::Mount,
        Self::Wheels,
        Self::Elsewhere,
    ];

    /// The words for it in a report.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Indefinite => "the covariance failed and the map began anew",
            Self::Heading => "a turn was not measured and the heading is not known",
            Self::BeyondGate => "measurement after measurement lies beyond its gate",
            Self::Attitude => {
                "the camera's attitude changes again and again, as of a robot that pitches or rolls"
            }
            Self::Innovations => "innovations are larger than the noise that was set explains",
            Self::Uncertain => "the pose may be off by more than a twentieth of the path",
            Self::Association => "measurements on mapped ground are of none of its landmarks",
            Self::Mount => "the camera sits otherwise than the rig and its standard deviations say",
            Self::Wheels => "the wheels read otherwise than their standard deviations say",
            Self::Elsewhere => "the place in the saved map was not found",
        }
    }

    /// How bad it is.
    pub const fn verdict(self) -> Verdict {
        match self {
            Self::Indefinite | Self::Heading | Self::BeyondGate | Self::Elsewhere => Verdict::Lost,
            Self::Attitude
            | Self::Innovations
            | Self::Uncertain
            | Self::Association
            | Self::Mount
            | Self::Wheels => Verdict::Doubtful,
        }
    }
}

impl Verdict {
    /// Every verdict.
    pub const ALL: [Self; 4] = [Self::Unchecked, Self::Consistent, Self::Doubtful, Self::Lost];

    /// The word for it.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Unchecked => "unchecked",
            Self::Consistent => "consistent",
            Self::Doubtful => "doubtful",
            Self::Lost => "lost",
        }
    }
}

/// Measurements in the window.
const WINDOW: usize = 64;
/// Measurements beyond their gate in a row that mean divergence.
const RUN: u32 = 12;
/// Standard deviation of the heading, rad, above which it is lost: no Jacobian holds.
const LOST_HEADING: f64 = 0.35;
/// And below which one that was lost is known again.
pub const KNOWN_HEADING: f64 = 0.25;
/// Landmarks in view from which on ground is mapped.
const MAPPED: u32 = 3;
/// Standard deviation of the position, in parts of the path, from which on a pose is of no use.
const UNCERTAIN: f64 = 0.025;
/// And beside that, m.
const UNCERTAIN_AT_REST: f64 = 0.1;
/// Knocks from which on it is the robot that pitches or rolls.
const KNOCKS: u32 = 4;
/// Share of measurements on mapped ground that are nobody's.
const STRANGERS: f64 = 0.3;
/// Deviations of its prior by which no error of mount or wheels moves by chance.
const BEYOND_PRIOR: f64 = 4.0;

/// Running figures of the updates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health<T> {
    /// Measurements beyond their gate in a row, up to now.
    pub beyond_gate_in_a_row: u32,
    /// Measurements beyond their gate, ever.
    pub beyond_gate: u32,
    /// Measurements with an innovation, ever.
    pub measurements: u32,
    /// The last measurement's ratio of the eigenvalues of S: 1e6 in `f32` leaves no digit.
    pub condition: T,
    /// How often the camera seems to have been knocked, by the map's corners.
    pub knocks: u32,
    /// How often pictures saw it knocked, and by how much.
    pub jolts: u32,
    /// What the frames say, beside the measurements.
    pub frames: FrameHealth<T>,
    window: [T; WINDOW],
}

/// What a frame tells of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameEvidence<T> {
    /// The robot's position.
    pub position: [T; 2],
    /// Variance of the position, x and y together.
    pub position_variance: T,
    /// Variance of the heading.
    pub heading_variance: T,
    /// Covariances that failed, ever.
    pub resets: u32,
    /// Confirmed landmarks that should be in view.
    pub expected: u32,
    /// Measurements that corrected the state.
    pub updates: u32,
    /// Measurements that were nobody's, or left out between two explanations.
    pub refused: u32,
    /// Landmarks born.
    pub births: u32,
    /// Squares of how many of their prior's deviations the errors of mount and wheels have moved, the largest of each.
    pub moved: [T; 2],
}

/// Running figures of the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameHealth<T> {
    /// The last frame's.
    pub last: Option<FrameEvidence<T>>,
    /// Path so far, m.
    pub path: T,
    /// The largest variance of the heading since it was last known to [`KNOWN_HEADING`].
    pub heading_variance: T,
    /// Updates, refusals and births among landmarks that should be in view, each forgotten by 1 in 256 measurements.
    pub mapped: [T; 3],
}

impl<T: Real> Default for FrameHealth<T> {
    fn default() -> Self {
        Self { last: None, path: T::zero(), heading_variance: T::zero(), mapped: [T::zero(); 3] }
    }
}

impl<T: Real> FrameHealth<T> {
    /// Takes note of a frame.
    pub fn note(&mut self, frame: &FrameEvidence<T>) {
        if let Some(FrameEvidence { position: [x, y], .. }) = self.last {
            let [x, y] = [frame.position[0] - x, frame.position[1] - y];
            self.path += (x * x + y * y).sqrt();
        }
        let known = T::lit(KNOWN_HEADING * KNOWN_HEADING);
        self.heading_variance = match frame.heading_variance {
            now if now < known => now,
            now => now.max(self.heading_variance),
        };
        if frame.expected >= MAPPED {
            let counts = [frame.updates, frame.refused, frame.births];
            let share = T::lit(f64::from(counts.iter().sum::<u32>()) / 256.0);
            for (sum, count) in self.mapped.iter_mut().zip(counts) {
                *sum = *sum * (T::one() - share.min(T::one())) + T::lit(f64::from(count));
            }
        }
        self.last = Some(*frame);
    }

    /// Shares of refusals and births among the measurements on mapped ground, once there are 64.
    pub fn strangers(&self) -> Option<[T; 2]> {
        let [updates, refused, births] = self.mapped;
        let all = updates + refused + births;
        (all > T::lit(64.0)).then(|| [refused / all, births / all])
    }
}

impl<T: Real> Default for Health<T> {
    fn default() -> Self {
        Self {
            beyond_gate_in_a_row: 0,
            beyond_gate: 0,
            measurements: 0,
            condition: T::one(),
            knocks: 0,
            jolts: 0,
            frames: FrameHealth::default(),
            window: [T::one(); WINDOW],
        }
    }
}

impl<T: Real> Health<T> {
    /// Takes note of an outcome. `threshold` is the gate it was held against.
    pub fn note(&mut self, outcome: &Outcome<T>, threshold: T) {
        let Some(nis) = outcome.nis else { return };
        if !matches!(outcome.decision, Decision::Update | Decision::Tentative | Decision::Gated) {
            return;
        }
        let at = self.measurements as usize % WINDOW;
        if let Some(entry) = self.window.get_mut(at) {
            *entry = nis.min(threshold) / T::lit(outcome.dof.max(1) as f64);
        }
        self.measurements = self.measurements.wrapping_add(1);
        if nis > threshold {
            self.beyond_gate = self.beyond_gate.saturating_add(1);
            self.beyond_gate_in_a_row = self.beyond_gate_in_a_row.saturating_add(1);
        } else {
            self.beyond_gate_in_a_row = 0;
        }
        let s = &outcome.covariance;
        let half = T::lit(0.5);
        let (mean, difference) = ((s.m11 + s.m22) * half, (s.m11 - s.m22) * half);
        let spread = (difference * difference + s.m12 * s.m12).sqrt();
        self.condition = (mean + spread) / (mean - spread).max(T::default_epsilon() * mean);
    }

    /// How often the camera was knocked, by the map's corners and by pictures.
    pub(in crate::slam) fn knocked(&self) -> u32 {
        self.knocks.saturating_add(self.jolts)
    }

    /// Mean of the normalised innovation squared a degree of freedom, over the last 64 measurements (1 before
    /// there are any).
    pub fn mean_nis(&self) -> T {
        let used = (self.measurements as usize).clamp(1, WINDOW);
        let sum = self.window.iter().take(used).fold(T::zero(), |sum, value| sum + *value);
        sum / T::lit(used as f64)
    }

    /// The verdict.
    pub fn verdict(&self) -> Verdict {
        let silent = if self.measurements == 0 { Verdict::Unchecked } else { Verdict::Consistent };
        self.reason().map_or(silent, Reason::verdict)
    }

    /// What speaks against the filter, the worst first; `None` where nothing does.
    pub fn reason(&self) -> Option<Reason> {
        let frames = &self.frames;
        let lost = T::lit(LOST_HEADING * LOST_HEADING);
        let most = frames.path * T::lit(UNCERTAIN) + T::lit(UNCERTAIN_AT_REST);
        let uncertain = frames.last.is_some_and(|frame| frame.position_variance > most * most);
        let told = self.measurements as usize >= WINDOW;
        let strange = frames.strangers().is_some_and(|[refused, _]| refused > T::lit(STRANGERS));
        let beyond = T::lit(BEYOND_PRIOR * BEYOND_PRIOR);
        let [mount, wheels] =
            frames.last.map_or([false; 2], |frame| frame.moved.map(|square| square > beyond));
        let reasons = [
            (frames.last.is_some_and(|frame| frame.resets > 0), Reason::Indefinite),
            (frames.heading_variance > lost, Reason::Heading),
            (self.beyond_gate_in_a_row >= RUN, Reason::BeyondGate),
            (self.knocked() >= KNOCKS, Reason::Attitude),
            (told && self.mean_nis() > T::lit(1.5), Reason::Innovations),
            (uncertain, Reason::Uncertain),
            (strange, Reason::Association),
            (mount, Reason::Mount),
            (wheels, Reason::Wheels),
        ];
        reasons.into_iter().find_map(|(holds, reason)| holds.then_some(reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict_after(nis: impl Fn(usize) -> f64) -> Verdict {
        let mut health = Health::default();
        for index in 0..2 * WINDOW {
            let nis = nis(index);
            let decision = if nis > 9.21 { Decision::Gated } else { Decision::Update };
            health.note(&Outcome { decision, nis: Some(nis), dof: 2, ..Outcome::default() }, 9.21);
        }
        health.verdict()
    }

    #[test]
    fn nothing_measured_is_unchecked() {
        assert_eq!(Health::<f32>::default().verdict(), Verdict::Unchecked);
        let mut health = Health::default();
        health.note(&Outcome { decision: Decision::Birth, ..Outcome::default() }, 9.21);
        assert_eq!(health.verdict(), Verdict::Unchecked);
        health.note(
            &Outcome { decision: Decision::Update, nis: Some(1.0), dof: 2, ..Outcome::default() },
            9.21,
        );
        assert_eq!(health.verdict(), Verdict::Consistent);
    }

    #[test]
    fn a_neighbour_that_is_gated_again_and_again_is_not_over_confidence() {
        assert_eq!(verdict_after(|index| if index % 5 == 0 { 24.0 } else { 1.0 }), Verdict::Consistent);
        assert_eq!(verdict_after(|_| 4.0), Verdict::Doubtful);
        assert_eq!(verdict_after(|index| if index % 2 == 0 { 24.0 } else { 1.0 }), Verdict::Doubtful);
        assert_eq!(verdict_after(|_| 24.0), Verdict::Lost);
    }

    fn frame(heading_std: f64, position_std: f64, x: f64) -> FrameEvidence<f64> {
        FrameEvidence {
            position: [x, 0.0],
            position_variance: position_std * position_std,
            heading_variance: heading_std * heading_std,
            resets: 0,
            expected: 8,
            updates: 2,
            refused: 0,
            births: 0,
            moved: [0.0; 2],
        }
    }

    #[test]
    fn a_heading_that_nobody_measured_is_lost_until_it_is_known_again() {
        let mut health = Health::default();
        let mut said = |std| {
            health.frames.note(&frame(std, 0.01, 1.0));
            health.reason()
        };
        assert_eq!(
            [0.01, 0.3, 0.4, 0.3].map(&mut said),
            [None, None, Some(Reason::Heading), Some(Reason::Heading)]
        );
        assert_eq!([0.2, 0.3].map(said), [None, None]);
        assert_eq!(Reason::Heading.verdict().as_str(), "lost");
    }

    #[test]
    fn a_pose_that_may_be_off_by_more_than_a_twentieth_of_the_path_is_doubtful() {
        let mut health = Health::default();
        for metre in 0..=40 {
            health.frames.note(&frame(0.1, 0.02 * f64::from(metre), f64::from(metre)));
            assert_eq!(health.reason(), None, "{metre} m");
        }
        health.frames.note(&frame(0.1, 1.5, 41.0));
        assert_eq!((health.verdict(), health.reason()), (Verdict::Doubtful, Some(Reason::Uncertain)));
    }

    #[test]
    fn measurements_on_mapped_ground_that_are_nobodys_are_doubtful_and_those_on_new_ground_are_not() {
        for (expected, reason) in [(8, Some(Reason::Association)), (0, None)] {
            let mut health = Health::default();
            for metre in 0..100 {
                let frame = frame(0.01, 0.01, f64::from(metre));
                health.frames.note(&FrameEvidence { expected, refused: 2, ..frame });
            }
            assert_eq!(health.reason(), reason);
        }
    }

    #[test]
    fn a_mount_or_wheels_far_from_what_was_said_of_them_are_doubtful() {
        for (moved, reason) in
            [([9.0, 9.0], None), ([17.0, 0.0], Some(Reason::Mount)), ([0.0, 17.0], Some(Reason::Wheels))]
        {
            let mut health = Health::default();
            health.frames.note(&FrameEvidence { moved, ..frame(0.01, 0.01, 1.0) });
            assert_eq!(health.reason(), reason);
        }
    }

    #[test]
    fn a_covariance_that_failed_is_lost_for_good() {
        let mut health = Health::default();
        health.frames.note(&FrameEvidence { resets: 1, ..frame(0.01, 0.01, 1.0) });
        assert_eq!(health.reason(), Some(Reason::Indefinite));
    }
}

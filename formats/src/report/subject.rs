//! What a run's filter was given, and the report's words for it.
use monorange_core::slam::Verdict;

/// What the filter of a run was given, for the words of its report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// Floor corners of pictures.
    FloorCorners,
    /// Measurements of a log.
    Measurements,
}

impl Subject {
    /// Several of them, in full.
    pub const fn long(self) -> &'static str {
        match self {
            Self::FloorCorners => "floor corners",
            Self::Measurements => "measurements",
        }
    }

    /// What to do about a verdict of the filter.
    pub(super) fn advice(self, verdict: Verdict) -> &'static str {
        match (verdict, self) {
            (Verdict::Consistent, _) => "The innovations are of the size that the filter expects.",
            (Verdict::Unchecked, Self::FloorCorners) => {
                "No floor corner was seen twice: nothing speaks for or against the motion, which is all there is."
            }
            (Verdict::Unchecked, Self::Measurements) => {
                "No landmark was measured twice: nothing speaks for or against the odometry, which is all there is."
            }
            (Verdict::Doubtful, Self::FloorCorners) => {
                "Innovations are larger than the noise explains, the pose is uncertain, or corners are not of the landmarks that \
                 should be there: raise the noise of odometry or corners in the rig file, and let it see more of what it knows."
            }
            (Verdict::Doubtful, Self::Measurements) => {
                "Innovations are larger than the noise explains, the pose is uncertain, or measurements are not of the landmarks \
                 that should be there: raise the noise of the odometry or of the sensor (<code>--speed-std</code>, \
                 <code>--turn-std</code>, <code>--range-std</code>, <code>--bearing-std</code>)."
            }
            (Verdict::Lost, Self::FloorCorners) => {
                "The pose is not known: a turn was not measured, or corner after corner lies beyond the gate. Check mount, odometry \
                 and light; drive on where the map is well known, or start anew."
            }
            (Verdict::Lost, Self::Measurements) => {
                "The pose is not known: measurement after measurement lies beyond the gate, or the heading is uncertain. Check the \
                 odometry, and the names if they were used."
            }
        }
    }
}

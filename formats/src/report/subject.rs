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
    pub(super) fn advice(self, verdict: &str) -> &'static str {
        match (verdict, self) {
            ("consistent", _) => "The innovations are of the size that the filter expects.",
            ("unchecked", Self::FloorCorners) => {
                "No floor corner was seen twice: nothing speaks for or against the motion, which is all there is."
            }
            ("unchecked", Self::Measurements) => {
                "No landmark was measured twice: nothing speaks for or against the odometry, which is all there is."
            }
            ("over-confident", Self::FloorCorners) => {
                "The innovations are larger than the filter expects: raise the noise of odometry or corners in the rig file."
            }
            ("over-confident", Self::Measurements) => {
                "The innovations are larger than the filter expects: raise the noise of the odometry or of the sensor \
                 (<code>--speed-std</code>, <code>--turn-std</code>, <code>--range-std</code>, <code>--bearing-std</code>)."
            }
            (_, Self::FloorCorners) => {
                "Corner after corner lies beyond the gate: the map or the pose is wrong. Check mount and odometry."
            }
            (_, Self::Measurements) => {
                "Measurement after measurement lies beyond the gate: the map or the pose is wrong. Check the odometry, and \
                 the names if they were used."
            }
        }
    }
}

/// What ends the free floor of a beam.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// A foot that its neighbours continue: a wall, a long piece of furniture.
    Boundary,
    /// A foot by itself: a leg, a post, a person, a corner.
    Obstacle,
    /// Nothing that is certain: what lies beyond `free` is not known.
    #[default]
    Unknown,
    /// Nothing: the floor is free as far as the scan reaches.
    Beyond,
}

impl Kind {
    /// The word of the files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Boundary => "boundary",
            Self::Obstacle => "obstacle",
            Self::Unknown => "unknown",
            Self::Beyond => "beyond",
        }
    }
}

/// One beam of the scan, from the point of the floor under the lens; the robot's origin is the mount's lever arm behind it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// From the robot's x axis, positive to the left, rad.
    pub bearing: f32,
    /// The floor is seen clear up to here, m; 0 where no floor is seen.
    pub free: f32,
    /// What bounds it, m; `None` for [`Kind::Unknown`] and [`Kind::Beyond`].
    pub range: Option<f32>,
    /// Variance of the range, m²: of the foot in the picture, and of the mount.
    pub var_range: f32,
    /// What bounds it.
    pub kind: Kind,
}

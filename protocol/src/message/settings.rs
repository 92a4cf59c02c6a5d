//! Settings, one by one as in the rig file; each has its sentence in the crate `monorange-core`, which they are for.
use serde::{Deserialize, Serialize};

/// Everything that can be set. Zeros are not the defaults: a host sends all of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// What is done about the mount's own error.
    pub mount_error: MountError,
    /// What the filter is told of a corner.
    pub model: Model,
    /// Least standard deviation of a corner in either direction, px.
    pub corner_std_floor_px: f32,
    /// Least angle below the horizon at which a corner is measured, rad.
    pub min_depression: f32,
    /// The filter.
    pub filter: FilterSettings,
    /// Who is who, and what becomes of landmarks.
    pub map: MapSettings,
    /// The wheels.
    pub motion: MotionSettings,
    /// Edges, lines and corners.
    pub extract: ExtractSettings,
}

/// What is done about the mount's own error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MountError {
    /// The mount is taken as exact.
    Exact,
    /// The filter estimates it.
    Estimated,
}

/// What the filter is told of a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Model {
    /// Range and bearing.
    RangeBearing,
    /// The pixel.
    Pixel,
}

/// Which filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Variant {
    /// Right-invariant.
    Invariant,
    /// The paper's.
    Textbook,
    /// Jacobians at first estimates.
    FirstEstimates,
}

/// How the covariance is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CovarianceForm {
    /// Packed.
    Packed,
    /// As U D Uᵀ.
    Factored,
}

/// What is done beyond the gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Gate {
    /// Noise is inflated.
    Soft,
    /// The measurement is dropped.
    Hard,
    /// It is used as it is.
    Open,
}

/// How pairs of corner and landmark are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pairing {
    /// Joint compatibility.
    Joint,
    /// Exclusive nearest.
    Nearest,
}

/// The filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilterSettings {
    /// Which.
    pub variant: Variant,
    /// How its covariance is kept.
    pub covariance: CovarianceForm,
    /// What is done beyond the gate.
    pub gate: Gate,
    /// The gate for 1 and 2 degrees of freedom.
    pub gate_nis: [f32; 2],
    /// Range and standard deviation of a landmark seen by its bearing alone, m.
    pub range_prior: [f32; 2],
    /// Linearity index below which an inverse-distance landmark becomes a point.
    pub linearity: f32,
}

/// Who is who, and what becomes of landmarks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapSettings {
    /// How pairs are chosen.
    pub pairing: Pairing,
    /// Largest innovation of a pair, for 1 and 2 degrees of freedom.
    pub match_nis: [f32; 2],
    /// Least innovation of a birth to every landmark.
    pub birth_nis: f32,
    /// Sightings that confirm.
    pub confirm: u32,
    /// Expected sightings within which.
    pub within: u32,
    /// Frames after which an unseen tentative landmark goes.
    pub forget: u32,
    /// Expected sightings missed after which a confirmed one goes; 0 is never.
    pub delete_after: u32,
    /// Duplicates lie closer than this, m; 0 merges nothing.
    pub merge_distance: f32,
    /// Expected sightings that a duplicate has missed.
    pub merge_missed: u32,
    /// Nodes of the joint search.
    pub joint_nodes: u32,
}

/// The wheels: standard deviations of speed and turn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionSettings {
    /// For each m/s.
    pub speed_by_speed: f32,
    /// For each rad/s.
    pub turn_by_turn: f32,
    /// rad/m.
    pub turn_by_speed: f32,
    /// For each metre.
    pub slip_by_speed: f32,
    /// m/s.
    pub speed_floor: f32,
    /// rad/s.
    pub turn_floor: f32,
}

/// What counts as an edge, a line and a corner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExtractSettings {
    /// Grey levels per pixel.
    pub edge_threshold: f32,
    /// Pixels in a row.
    pub opening: u8,
    /// Fraction of the height.
    pub floor_top: f32,
    /// rad.
    pub floor_spread: f32,
    /// rad.
    pub vertical_spread: f32,
    /// rad.
    pub gravity_tolerance: f32,
    /// rad.
    pub direction_tolerance: f32,
    /// Fraction of the height.
    pub min_vertical_length: f32,
    /// Fraction of the height.
    pub min_floor_length: f32,
    /// px.
    pub max_gap_px: f32,
    /// px.
    pub reach_px: f32,
    /// px.
    pub floor_reach_px: f32,
    /// px.
    pub overshoot_px: f32,
    /// m.
    pub skirting_height: f32,
    /// Fraction of the height.
    pub min_bound_length: f32,
    /// px.
    pub max_width_px: f32,
    /// rad.
    pub min_crossing: f32,
}

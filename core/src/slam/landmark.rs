//! A landmark's record beside its place in the state.
use nalgebra::Vector2;

/// How a landmark is written in the state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// (x, y) in the world.
    #[default]
    Point,
    /// (x₀, y₀, φ, ρ): seen first from (x₀, y₀) in the world's direction φ, at the distance 1/ρ.
    InverseDistance,
}

impl Form {
    /// Numbers in the state.
    pub const fn len(self) -> usize {
        match self {
            Self::Point => 2,
            Self::InverseDistance => 4,
        }
    }

    /// Never: every form has numbers.
    pub const fn is_empty(self) -> bool {
        false
    }
}

/// Where a landmark is in its life.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Status {
    /// Born, and not yet seen often enough to be believed.
    #[default]
    Tentative,
    /// Part of the map.
    Confirmed,
}

/// A landmark's record. Its numbers are in the filter's state; this is what is known beside them, and the
/// association may keep its own facts here.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Landmark<T> {
    /// Unique, chosen at birth.
    pub id: u32,
    /// First of its numbers in the state. The filter's to change.
    pub offset: usize,
    /// How its numbers are to be read. The filter's to change.
    pub form: Form,
    /// Tentative or confirmed.
    pub status: Status,
    /// Updates, its birth included.
    pub seen: u32,
    /// Frames since its birth in which it should have been in view.
    pub expected: u32,
    /// Frames in a row in which it should have been in view and was not seen.
    pub missed: u32,
    /// Whether it should have been in view of the last frame, as predicted.
    pub in_view: bool,
    /// Time of its birth in seconds.
    pub first_time: f64,
    /// Time of its last update in seconds.
    pub last_time: f64,
    /// Number of the frame that saw it last.
    pub last_frame: u32,
    /// Where it was seen last, for association in pixels.
    pub last_pixel: Option<Vector2<T>>,
    /// The caller's index of a descriptor.
    pub descriptor: Option<u32>,
}

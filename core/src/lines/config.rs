//! What counts as an edge, a line and a corner: the settings of the extractor.
use crate::setting::{self, settings};
use crate::{Error, Result};

/// What counts as an edge, a line and a floor corner. Lengths of lines are fractions of the picture's height,
/// so that one configuration serves every resolution; what follows from the width of the smoothed edge is in
/// pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtractConfig {
    /// Least gradient of an edge point along its dominant axis, grey levels per pixel.
    pub edge_threshold: f32,
    /// Pixels in a row that an edge must fill along its dominant axis to survive the opening, 1 to 6.
    pub opening: usize,
    /// Top of the region of interest of the floor's edges, as a fraction of the height (the paper's 48 of 240).
    pub floor_top: f32,
    /// Largest angle of a floor edge from the picture's horizontal, rad.
    pub floor_spread: f32,
    /// Largest angle of a vertical edge from the picture's vertical, rad.
    pub vertical_spread: f32,
    /// Largest angle of a vertical line from the direction of gravity as the mount has it, rad.
    pub gravity_tolerance: f32,
    /// Largest angle between an edge point's gradient and the normal of the line it votes for, rad.
    pub direction_tolerance: f32,
    /// Shortest vertical line, as a fraction of the height.
    pub min_vertical_length: f32,
    /// Shortest floor line, as a fraction of the height.
    pub min_floor_length: f32,
    /// Widest profile of a floor edge, px (see [`Line::width_px`](super::Line::width_px)): the rim of a shadow is wider.
    pub max_width_px: f32,
    /// Longest gap within a line, px.
    pub max_gap_px: f32,
    /// Farthest that a vertical line may end above its foot, px.
    pub reach_px: f32,
    /// Farthest that a floor line may end beside a foot on it, px.
    pub floor_reach_px: f32,
    /// Farthest that the vertical line may run on below the floor line, px.
    pub overshoot_px: f32,
    /// Highest skirting board that may hide the foot of a vertical edge, m; 0 for none.
    pub skirting_height: f32,
    /// A floor line of at least this length below a foot shows that the foot is on a wall; a fraction of the height.
    pub min_bound_length: f32,
    /// Least angle between the lines of a corner, rad.
    pub min_crossing: f32,
}

impl Default for ExtractConfig {
    fn default() -> Self {
        Self {
            edge_threshold: 6.0,
            opening: 5,
            floor_top: 48.0 / 240.0,
            floor_spread: 60_f32.to_radians(),
            vertical_spread: 25_f32.to_radians(),
            gravity_tolerance: 2.5_f32.to_radians(),
            direction_tolerance: 9_f32.to_radians(),
            min_vertical_length: 0.13,
            min_floor_length: 0.06,
            max_width_px: 1.6,
            max_gap_px: 6.0,
            reach_px: 8.0,
            floor_reach_px: 4.5,
            overshoot_px: 3.0,
            skirting_height: 0.2,
            min_bound_length: 0.1,
            min_crossing: 20_f32.to_radians(),
        }
    }
}

impl ExtractConfig {
    /// The configuration itself if every value is usable.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name of the first value that is not.
    pub fn validated(self) -> Result<Self> {
        let mut config = self;
        setting::check(&EXTRACT, &mut config)?;
        let spread = self.floor_spread + self.vertical_spread;
        if spread > core::f32::consts::FRAC_PI_2 {
            let (name, expected) = ("extract.floor_spread", "at most 90° together with vertical_spread");
            return Err(Error::OutOfRange { name, value: f64::from(self.floor_spread), expected });
        }
        Ok(self)
    }
}

settings! { EXTRACT, EXTRACT_REFERENCES, ExtractConfig, "extract" {
    27 edge_threshold: Number [edge_threshold] (0.1, 127, "grey/px"), "Least gradient of an edge point along its dominant axis.", "Twenty simulated corridors: at 4 the floor's texture fills the list of points, and half as many corners are found.";
    28 opening: Size [opening] (1, 6, "px"), "Pixels in a row that an edge must fill along its dominant axis to survive the opening.", "The paper's morphological opening.";
    29 floor_top: Number [floor_top] (0, 1, "of height"), "Top of the region in which floor edges are searched.", "The paper's region of interest: row 48 of 240.";
    30 floor_spread: Number [floor_spread] (0.02, 1.571, "rad"), "Largest angle of a floor edge from the picture's horizontal.", "Judgement: together with vertical_spread it must stay within 90 degrees.";
    31 vertical_spread: Number [vertical_spread] (0.02, 0.79, "rad"), "Largest angle of a vertical edge from the picture's vertical.", "Judgement: it bounds how far tilt and lens lean a vertical.";
    32 gravity_tolerance: Number [gravity_tolerance] (0, 1.571, "rad"), "Largest angle of a vertical line from gravity as the mount has it.", "Judgement: errors of the mount and of the fit.";
    33 direction_tolerance: Number [direction_tolerance] (0.01, 0.8, "rad"), "Largest angle between an edge point's gradient and the normal of its line.", "Not recorded: kept since the first simulated corridors.";
    34 min_vertical_length: Number [min_vertical_length] (0, 1, "of height"), "Shortest vertical line.", "Not recorded: kept since the first simulated corridors.";
    35 min_floor_length: Number [min_floor_length] (0, 10, "of height"), "Shortest floor line.", "Not recorded: kept since the first simulated corridors.";
    42 max_width_px: Number [max_width_px] (1, 1e4, "px"), "Widest profile of a floor edge, as a Gaussian's deviation; the rim of a shadow is wider.", "Smoothing alone makes 1.3 px.";
    36 max_gap_px: Number [max_gap_px] (1, 1e4, "px"), "Longest gap within a line.", "Not recorded: kept since the first simulated corridors.";
    37 reach_px: Number [reach_px] (0, 1e4, "px"), "Farthest that a vertical line may end above its foot.", "Smoothing smears 5 px of an edge beside a crossing one; the rest is not recorded.";
    38 floor_reach_px: Number [floor_reach_px] (0, 1e4, "px"), "Farthest that a floor line may end beside a foot on it.", "Not recorded: kept since the first simulated corridors.";
    39 overshoot_px: Number [overshoot_px] (0, 1e4, "px"), "Farthest that a vertical line may run on below the floor line.", "Not recorded: kept since the first simulated corridors.";
    40 skirting_height: Number [skirting_height] (0, 10, "m"), "Highest skirting board that may hide the foot of a vertical edge; 0 for none.", "Judgement: skirting boards are 5 to 20 cm high.";
    41 min_bound_length: Number [min_bound_length] (0, 10, "of height"), "A floor line of at least this length below a foot shows that the foot is on a wall.", "Not recorded: kept since the first simulated corridors.";
    43 min_crossing: Number [min_crossing] (0.05, 1.571, "rad"), "Least angle between the two lines of a corner.", "Judgement: a corner's variance grows with the inverse squared sine of this angle.";
}}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid() {
        assert!(ExtractConfig::default().validated().is_ok());
    }

    #[test]
    fn a_value_that_is_not_a_number_is_named() {
        let config = ExtractConfig { reach_px: f32::NAN, ..Default::default() };
        let error = config.validated().unwrap_err();
        assert!(matches!(error, Error::OutOfRange { name: "extract.reach_px", .. }), "{error}");
    }

    #[test]
    fn an_edge_cannot_be_both_vertical_and_floor() {
        let config = ExtractConfig { floor_spread: 1.4, vertical_spread: 0.3, ..Default::default() };
        assert!(config.validated().is_err());
    }
}

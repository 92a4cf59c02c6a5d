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
        let quarter_turn = core::f32::consts::FRAC_PI_2;
        let checks = [
            (
                "extract.edge_threshold",
                self.edge_threshold,
                0.1,
                127.0,
                "from 0.1 to 127 grey levels per pixel",
            ),
            ("extract.opening", self.opening as f32, 1.0, 6.0, "from 1 to 6 pixels"),
            ("extract.floor_top", self.floor_top, 0.0, 1.0, "a fraction of the height"),
            ("extract.floor_spread", self.floor_spread, 0.02, quarter_turn, "from 1° to 90°"),
            ("extract.vertical_spread", self.vertical_spread, 0.02, quarter_turn / 2.0, "from 1° to 45°"),
            ("extract.gravity_tolerance", self.gravity_tolerance, 0.0, quarter_turn, "from 0° to 90°"),
            ("extract.direction_tolerance", self.direction_tolerance, 0.01, 0.8, "from 0.01 to 0.8 rad"),
            ("extract.min_vertical_length", self.min_vertical_length, 0.0, 1.0, "a fraction of the height"),
            ("extract.min_floor_length", self.min_floor_length, 0.0, 10.0, "a fraction of the height"),
            ("extract.max_width_px", self.max_width_px, 1.0, 1e4, "from 1 to 10000 pixels"),
            ("extract.max_gap_px", self.max_gap_px, 1.0, 1e4, "from 1 to 10000 pixels"),
            ("extract.reach_px", self.reach_px, 0.0, 1e4, "from 0 to 10000 pixels"),
            ("extract.floor_reach_px", self.floor_reach_px, 0.0, 1e4, "from 0 to 10000 pixels"),
            ("extract.overshoot_px", self.overshoot_px, 0.0, 1e4, "from 0 to 10000 pixels"),
            ("extract.skirting_height", self.skirting_height, 0.0, 10.0, "from 0 to 10 metres"),
            ("extract.min_bound_length", self.min_bound_length, 0.0, 10.0, "a fraction of the height"),
            ("extract.min_crossing", self.min_crossing, 0.05, quarter_turn, "from 0.05 rad to 90°"),
        ];
        for (name, value, least, most, expected) in checks {
            if !(least..=most).contains(&value) {
                return Err(Error::OutOfRange { name, value: f64::from(value), expected });
            }
        }
        let spread = self.floor_spread + self.vertical_spread;
        if spread > quarter_turn {
            let (name, expected) = ("extract.floor_spread", "at most 90° together with vertical_spread");
            return Err(Error::OutOfRange { name, value: f64::from(self.floor_spread), expected });
        }
        Ok(self)
    }
}

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

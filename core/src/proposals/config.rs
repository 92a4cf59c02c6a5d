use crate::{Error, Result};

/// What counts as an edge, a vertical edge and a corner of the floor. Lengths are angles and metres, edges are held against
/// the picture's own noise: one configuration serves every camera.
/// The score was fitted to proposals by these defaults (`tests/scoring`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProposalConfig {
    /// Least gradient of an edge point, in deviations of the gradient where there is no edge: 3, beyond which noise alone makes
    /// one point in ninety (exp(−3²/2)).
    pub edge_noise: f32,
    /// The same, grey levels per pixel, in pictures without noise: 0.5, what rounding to whole grey levels hides.
    pub edge_threshold: f32,
    /// Longest focal length of the picture that is searched, px: larger pictures are made smaller by a whole number. 450 leaves
    /// pictures 320 px wide as they are.
    pub max_focal_px: f32,
    /// Largest angle of a vertical edge from the direction of gravity as the mount has it, rad: 3.5°.
    pub gravity_tolerance: f32,
    /// Highest skirting board that may hide the foot of a vertical edge, m; 0 for none.
    pub skirting_height: f32,
    /// Least angle below the horizon at which corners are proposed, rad: 1°, where the floor is 57 heights away.
    pub min_depression: f32,
    /// Least probability of a corner of the floor; less likely ones are proposals only. 0.5: the odds are even.
    pub min_probability: f32,
}

impl Default for ProposalConfig {
    fn default() -> Self {
        Self {
            edge_noise: 3.0,
            edge_threshold: 0.5,
            max_focal_px: 450.0,
            gravity_tolerance: 3.5_f32.to_radians(),
            skirting_height: 0.16,
            min_depression: 1_f32.to_radians(),
            min_probability: 0.5,
        }
    }
}

impl ProposalConfig {
    /// The configuration itself if every value is usable.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name of the first value that is not.
    pub fn validated(self) -> Result<Self> {
        let quarter_turn = core::f32::consts::FRAC_PI_2;
        let checks = [
            ("proposals.edge_noise", self.edge_noise, 0.0, 100.0, "from 0 to 100 deviations"),
            (
                "proposals.edge_threshold",
                self.edge_threshold,
                0.1,
                127.0,
                "from 0.1 to 127 grey levels per pixel",
            ),
            ("proposals.max_focal_px", self.max_focal_px, 50.0, 1e5, "from 50 to 100000 pixels"),
            ("proposals.gravity_tolerance", self.gravity_tolerance, 0.0, 0.2, "from 0 to 0.2 rad"),
            ("proposals.skirting_height", self.skirting_height, 0.0, 10.0, "from 0 to 10 metres"),
            ("proposals.min_depression", self.min_depression, 0.001, quarter_turn, "from 0.001 rad to 90°"),
            ("proposals.min_probability", self.min_probability, 0.0, 1.0, "a probability"),
        ];
        for (name, value, least, most, expected) in checks {
            if !(least..=most).contains(&value) {
                return Err(Error::OutOfRange { name, value: f64::from(value), expected });
            }
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid() {
        assert!(ProposalConfig::default().validated().is_ok());
    }

    #[test]
    fn a_value_that_is_not_a_number_is_named() {
        let config = ProposalConfig { edge_noise: f32::NAN, ..Default::default() };
        let error = config.validated().unwrap_err();
        assert!(matches!(error, Error::OutOfRange { name: "proposals.edge_noise", .. }), "{error}");
    }
}

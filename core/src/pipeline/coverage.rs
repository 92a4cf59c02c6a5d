//! How the odometry's intervals cover the time between pictures.

/// Seconds below which the times of two readings are one: what rounding of recorded times leaves.
const SLACK: f64 = 1e-3;

/// How the odometry's readings covered the time since the last picture. Each holds over its own interval, from
/// `until − seconds` to `until`; the robot is taken to stand where there is none, and to move twice where two overlap.
/// Readings that are cut at the pictures' times leave neither.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coverage {
    /// Readings since the last picture.
    pub readings: u32,
    /// Seconds that no reading covers, up to the picture.
    pub gap: f32,
    /// Seconds that two readings cover, or that lie beyond the picture.
    pub overlap: f32,
}

/// The intervals as they come.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Intervals {
    /// The end of the last one; `None` before the first.
    until: Option<f64>,
    so_far: Coverage,
}

impl Intervals {
    /// Takes a reading of `seconds` that ends at `until`.
    pub(super) fn reading(&mut self, until: f64, seconds: f64) {
        self.compare(until - seconds);
        self.until = Some(until);
        self.so_far.readings += 1;
    }

    /// Takes a step that begins where the last one ended.
    pub(super) fn step(&mut self, until: f64) {
        self.until = Some(until);
        self.so_far.readings += 1;
    }

    /// Whether anything came since the last picture.
    pub(super) fn moved(&self) -> bool {
        self.so_far.readings > 0
    }

    /// Ends at a picture's time.
    pub(super) fn picture(&mut self, time: f64) -> Coverage {
        self.compare(time);
        self.until = self.until.map(|until| until.max(time));
        core::mem::take(&mut self.so_far)
    }

    fn compare(&mut self, begin: f64) {
        let Some(until) = self.until else { return };
        if begin - until > SLACK {
            self.so_far.gap += (begin - until) as f32;
        } else if until - begin > SLACK {
            self.so_far.overlap += (until - begin) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_that_meet_leave_nothing_and_others_are_measured() {
        let mut intervals = Intervals::default();
        for until in [0.1, 0.2] {
            intervals.reading(until, 0.1);
        }
        assert_eq!(intervals.picture(0.2), Coverage { readings: 2, gap: 0.0, overlap: 0.0 });
        intervals.reading(0.35, 0.1); // nothing from 0.2 to 0.25
        intervals.reading(0.4, 0.1); // twice from 0.3 to 0.35
        let Coverage { readings, gap, overlap } = intervals.picture(0.5); // nothing from 0.4 to 0.5
        assert_eq!(readings, 2);
        assert!((gap - 0.15).abs() < 1e-6 && (overlap - 0.05).abs() < 1e-6, "{gap} {overlap}");
        intervals.reading(0.65, 0.15);
        let Coverage { gap, overlap, .. } = intervals.picture(0.6); // 0.05 beyond the picture
        assert!(gap == 0.0 && (overlap - 0.05).abs() < 1e-6, "{gap} {overlap}");
    }
}

use super::Table;
use crate::{Error, Result};
use monorange_core::pipeline;
use nalgebra::{Matrix2, Vector2};
use std::path::Path;

/// A constant motion of the robot over some time, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// (forward, left) speed, m/s; the left one is 0 for `t,v,omega` files.
    pub velocity: Vector2<f64>,
    /// Turn rate, rad/s.
    pub turn_rate: f64,
    /// Seconds.
    pub duration: f64,
}

impl Control {
    /// (forward, left) and turn at its end, in the frame of its beginning: V(turn) · way.
    pub fn step(&self) -> (Vector2<f64>, f64) {
        let turn = self.turn_rate * self.duration;
        let [along, across] = arc(turn);
        (Matrix2::new(along, -across, across, along) * self.velocity * self.duration, turn)
    }

    /// As the pipeline takes it.
    pub fn reading(&self) -> pipeline::Odometry {
        let seconds = self.duration as f32;
        if self.velocity.y == 0.0 {
            let (v, omega) = (self.velocity.x as f32, self.turn_rate as f32);
            return pipeline::Odometry::Velocity { v, omega, seconds };
        }
        let (step, turn) = self.step();
        let [forward, left, turn] = [step.x, step.y, turn].map(|number| number as f32);
        pipeline::Odometry::Increment { forward, left, turn, seconds }
    }
}

/// What the wheels say, as constant motions between growing times.
#[derive(Clone, Debug)]
pub struct Odometry {
    /// (from, motion until the next one's start), sorted.
    spans: Vec<(f64, Control)>,
    end: f64,
}

impl Odometry {
    /// The odometry in a CSV, either `t,v,omega` (holds until the next line; the last one as long as the line
    /// before it did) or `t,dx,dy,dtheta` (increments in the robot frame since the line before).
    ///
    /// # Errors
    /// When the file cannot be read, lacks a column, holds something else than finite numbers, is too short or
    /// its times do not grow.
    pub fn read(path: &Path) -> Result<Self> {
        Self::from_table(&Table::read(path)?)
    }

    /// As [`read`](Self::read), of a table at hand.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn from_table(table: &Table) -> Result<Self> {
        let increments = table.has("dx") && !table.has("v");
        let odometry = if increments { Self::from_increments(table)? } else { Self::from_speeds(table)? };
        if odometry.spans.is_empty() {
            let error =
                Error::new(format!("has {} lines of odometry, at least 2 are needed", table.lines().len()));
            return Err(error
                .at(table.path())
                .help("give t,v,omega or t,dx,dy,dtheta over the whole sequence"));
        }
        Ok(odometry)
    }

    fn from_speeds(table: &Table) -> Result<Self> {
        let rows = table.numbers(["t", "v", "omega"])?;
        table.check_order(rows.iter().map(|row| row[0]))?;
        let [.., [before, ..], [last, ..]] = rows.as_slice() else {
            return Ok(Self { spans: Vec::new(), end: 0.0 });
        };
        let end = last + (last - before);
        let ends = rows.iter().skip(1).map(|row| row[0]).chain([end]);
        let spans = rows.iter().zip(ends).map(|(&[start, speed, turn_rate], end)| {
            (start, Control { velocity: Vector2::new(speed, 0.0), turn_rate, duration: end - start })
        });
        Ok(Self { spans: spans.collect(), end })
    }

    fn from_increments(table: &Table) -> Result<Self> {
        let rows = table.numbers(["t", "dx", "dy", "dtheta"])?;
        table.check_order(rows.iter().map(|row| row[0]))?;
        let spans = rows.windows(2).filter_map(|pair| {
            let &[[start, ..], [end, dx, dy, turn]] = pair else { return None };
            let duration = end - start;
            let velocity = arc_from_step(Vector2::new(dx, dy), turn) / duration;
            Some((start, Control { velocity, turn_rate: turn / duration, duration }))
        });
        Ok(Self { spans: spans.collect(), end: rows.last().map_or(0.0, |row| row[0]) })
    }

    /// The times between which it is known.
    pub fn range(&self) -> [f64; 2] {
        [self.spans.first().map_or(self.end, |(start, _)| *start), self.end]
    }

    /// Fails unless the odometry reaches from the first frame to the last one.
    ///
    /// # Errors
    /// When it begins later or ends earlier.
    pub fn check_cover(&self, path: &Path, frames: &[f64]) -> Result<()> {
        let ([start, end], Some(first), Some(last)) = (self.range(), frames.first(), frames.last()) else {
            return Ok(());
        };
        // Times are decimal text: a rounding step beyond the end is not a gap.
        let slack = 1e-6 * (end - start);
        if start <= first + slack && *last <= end + slack {
            return Ok(());
        }
        let cause = format!("covers {start} s to {end} s, the frames need {first} s to {last} s");
        Err(Error::new(cause).at(path).help("give odometry for the whole sequence, on the frames' clock"))
    }

    /// The motions from one time to a later one, cut at both ends.
    pub fn between(&self, from: f64, to: f64) -> Vec<Control> {
        let first = self.spans.partition_point(|(start, span)| start + span.duration <= from);
        let cut = |&(start, span): &(f64, Control)| {
            let duration = (start + span.duration).min(to) - start.max(from);
            Control { duration, ..span }
        };
        let begun = self.spans.iter().skip(first).take_while(|(start, _)| *start < to);
        begun.map(cut).filter(|span| span.duration > 0.0).collect()
    }
}

/// The way (along, across) of a constant motion that ends at `step`, turned by `turn`: V(turn)⁻¹ step.
fn arc_from_step(step: Vector2<f64>, turn: f64) -> Vector2<f64> {
    let [along, across] = arc(turn);
    Matrix2::new(along, across, -across, along) * step / (along * along + across * across)
}

/// sin a / a and (1 − cos a) / a, the entries of V(a).
fn arc(turn: f64) -> [f64; 2] {
    if turn.abs() < 1e-3 {
        return [1.0 - turn * turn / 6.0, turn / 2.0 - turn * turn * turn / 24.0];
    }
    let (sin, cos) = libm::sincos(turn); // not the platform's: the motion must be the same in a browser
    [sin / turn, (1.0 - cos) / turn]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Odometry {
        let table = Table::parse(Path::new("odometry.csv"), text).unwrap();
        if text.contains("dx") { Odometry::from_increments(&table) } else { Odometry::from_speeds(&table) }
            .unwrap()
    }

    #[test]
    fn speeds_hold_until_the_next_line() {
        let odometry = parse("t,v,omega\n0,1,0\n1,2,0.5\n2,3,0\n");
        assert_eq!(odometry.range(), [0.0, 3.0]);
        let cut = odometry.between(0.5, 2.25);
        assert_eq!(cut.iter().map(|c| c.duration).collect::<Vec<_>>(), [0.5, 1.0, 0.25]);
        assert_eq!(cut.iter().map(|c| c.velocity.x).collect::<Vec<_>>(), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn a_step_of_a_circle_is_a_constant_forward_motion() {
        let (radius, turn) = (2.0_f64, 0.7_f64);
        let step = format!(
            "t,dx,dy,dtheta\n0,0,0,0\n0.5,{},{},{turn}\n",
            radius * turn.sin(),
            radius * (1.0 - turn.cos())
        );
        let [control] = parse(&step).between(0.0, 0.5)[..] else { panic!("one span") };
        assert!((control.velocity - Vector2::new(radius * turn / 0.5, 0.0)).norm() < 1e-12);
        assert!((control.turn_rate - turn / 0.5).abs() < 1e-12);
        let (back, _) = control.step();
        assert!((back - Vector2::new(radius * turn.sin(), radius * (1.0 - turn.cos()))).norm() < 1e-12);
    }
}

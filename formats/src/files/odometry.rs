use super::{Stamped, Table, trajectory};
use crate::{Error, Result, plausibility};
use monorange_core::{geometry::Pose, pipeline};
use nalgebra::{Matrix2, Vector2};
use std::path::Path;

/// Times nearer than this are one, s: no clock of a robot is finer, and a way over less would be no speed.
const ONE_TIME: f64 = 1e-9;

/// A constant motion of the robot over some time, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// (forward, left) speed, m/s; the left one is 0 for `t,v,omega` files.
    pub velocity: Vector2<f64>,
    /// Turn rate, rad/s.
    pub turn_rate: f64,
    /// Seconds.
    pub duration: f64,
    /// Speed (m/s) and turn rate (rad/s) that the robot may have had beside this: above 0 in a gap of the log.
    pub unknown: [f64; 2],
}

impl Control {
    /// (forward, left) and turn at its end, in the frame of its beginning: V(turn) · way.
    pub fn step(&self) -> (Vector2<f64>, f64) {
        let turn = self.turn_rate * self.duration;
        let [along, across] = arc(turn);
        (Matrix2::new(along, -across, across, along) * self.velocity * self.duration, turn)
    }

    /// Length of the way, m.
    pub fn way(&self) -> f64 {
        self.velocity.norm() * self.duration
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
    /// before it did) or `t,dx,dy,dtheta` (increments in the robot frame since the line before); or as poses that the wheels
    /// were added up to, in any form of [`read_trajectory`](super::read_trajectory): what counts is how they differ.
    ///
    /// Of lines with one time the last one holds, and their increments add up; a line that is there twice counts once.
    /// A gap in a log of speeds is bridged: the last line holds for a usual step, then nothing is known
    /// ([`Control::unknown`]). A turn that is a difference of wrapped headings is wrapped back. Each is a warning.
    ///
    /// # Errors
    /// When the file cannot be read, lacks a column, holds something else than finite numbers, is too short, or
    /// its times run backwards or are no seconds.
    pub fn read(path: &Path) -> Result<Self> {
        let text = super::read_text(path)?;
        if trajectory::is_columns(&text) {
            return Self::from_poses(path, &trajectory::parse(path, &text)?);
        }
        let table = Table::parse(path, &text)?;
        match table.has("x") && table.has("y") && !table.has("v") && !table.has("dx") {
            true => Self::from_poses(path, &trajectory::parse(path, &text)?),
            false => Self::from_table(&table),
        }
    }

    /// As [`read`](Self::read), of a table at hand.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn from_table(table: &Table) -> Result<Self> {
        let increments = table.has("dx") && !table.has("v");
        let odometry = if increments { Self::from_increments(table)? } else { Self::from_speeds(table)? };
        odometry.checked(table.path(), table.lines().len())
    }

    /// Fails where nothing moves between two times, and warns of motions that no robot makes.
    fn checked(self, path: &Path, lines: usize) -> Result<Self> {
        if self.spans.is_empty() {
            let cause = format!("has {lines} lines of odometry, at least 2 at different times are needed");
            let help = "give t,v,omega or t,dx,dy,dtheta or poses over the whole sequence";
            return Err(Error::new(cause).at(path).help(help));
        }
        let motions = self.spans.iter().map(|(_, span)| [span.velocity.norm(), span.turn_rate]);
        plausibility::check_motion(path, motions);
        Ok(self)
    }

    fn from_poses(path: &Path, poses: &[Stamped]) -> Result<Self> {
        let steps: Vec<_> = poses
            .windows(2)
            .filter_map(|pair| {
                let [before, after] = pair else { return None };
                let step = before.pose.inverse().compose(&after.pose);
                Some([after.time, step.x, step.y, step.heading])
            })
            .collect();
        let first = poses.first().map(|first| [first.time, 0.0, 0.0, 0.0]);
        Self::from_steps(path, &first.into_iter().chain(steps).collect::<Vec<_>>()).checked(path, poses.len())
    }

    fn from_speeds(table: &Table) -> Result<Self> {
        let rows = table.numbers(["t", "v", "omega"])?;
        check_readings(table, &rows, ["v", "omega"])?;
        let rows = in_order(table, rows, |last, row| *last = row)?;
        let [.., [before, ..], [last, ..]] = rows.as_slice() else {
            return Ok(Self { spans: Vec::new(), end: 0.0 });
        };
        let end = last + (last - before);
        let ends = rows.iter().skip(1).map(|row| row[0]).chain([end]);
        let spans = rows.iter().zip(ends).map(|(&[start, speed, turn_rate], end)| {
            let velocity = Vector2::new(speed, 0.0);
            (start, Control { velocity, turn_rate, duration: end - start, unknown: [0.0; 2] })
        });
        let mut spans: Vec<_> = spans.collect();
        let times: Vec<_> = rows.iter().map(|row| row[0]).collect();
        let (step, gaps) = plausibility::gaps(&times);
        warn_of_gaps(table.path(), &times, &gaps, "the robot's motion there is not known, and taken so");
        let rms = |index: usize| {
            (rows.iter().map(|row| row[index] * row[index]).sum::<f64>() / rows.len() as f64).sqrt()
        };
        let unknown = [rms(1), rms(2)];
        for gap in gaps.into_iter().rev() {
            let Some((start, span)) = spans.get_mut(gap) else { continue };
            let silence = span.duration - step;
            span.duration = step;
            let control = Control { velocity: Vector2::zeros(), turn_rate: 0.0, duration: silence, unknown };
            let at = *start + step;
            spans.insert(gap + 1, (at, control));
        }
        Ok(Self { spans, end })
    }

    fn from_increments(table: &Table) -> Result<Self> {
        let mut rows = table.numbers(["t", "dx", "dy", "dtheta"])?;
        check_readings(table, &rows, ["dx", "dy"])?;
        let mut wrapped = Vec::new();
        for (row, line) in rows.iter_mut().zip(table.lines()) {
            let (turn, was) =
                plausibility::wrapped_turn(row[3]).map_err(|error| error.at_line(table.path(), line))?;
            wrapped.extend(was.then_some((line, row[3])));
            row[3] = turn;
        }
        if let Some((line, turn)) = wrapped.first() {
            let cause = format!(
                "`dtheta` is {turn}, more than half a turn: it looks like a difference of wrapped headings ({} such line{})",
                wrapped.len(),
                if wrapped.len() == 1 { "" } else { "s" }
            );
            Error::new(cause).at_line(table.path(), *line).help("it is wrapped to within half a turn").warn();
        }
        let rows = in_order(table, rows, |last, [time, dx, dy, turn]| {
            let (sin, cos) = libm::sincos(last[3]);
            *last = [time, last[1] + cos * dx - sin * dy, last[2] + sin * dx + cos * dy, last[3] + turn];
        })?;
        Ok(Self::from_steps(table.path(), &rows))
    }

    /// Of rows (t, dx, dy, dtheta), at growing times.
    fn from_steps(path: &Path, rows: &[[f64; 4]]) -> Self {
        let times: Vec<_> = rows.iter().map(|row| row[0]).collect();
        let (_, gaps) = plausibility::gaps(&times);
        warn_of_gaps(path, &times, &gaps, "the line after it is taken to hold the whole motion");
        let spans = rows.windows(2).filter_map(|pair| {
            let &[[start, ..], [end, dx, dy, turn]] = pair else { return None };
            let duration = end - start;
            let velocity = arc_from_step(Vector2::new(dx, dy), turn) / duration;
            Some((start, Control { velocity, turn_rate: turn / duration, duration, unknown: [0.0; 2] }))
        });
        Self { spans: spans.collect(), end: rows.last().map_or(0.0, |row| row[0]) }
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

    /// The length of the way from one time to a later one, m.
    pub fn way(&self, from: f64, to: f64) -> f64 {
        self.between(from, to).iter().map(|span| span.velocity.norm() * span.duration).sum()
    }

    /// (forward, left) and turn from one time to a later one, in the frame of the first.
    pub fn step(&self, from: f64, to: f64) -> (Vector2<f64>, f64) {
        self.between(from, to).iter().fold((Vector2::zeros(), 0.0), |(way, turn), span| {
            let (step, more) = span.step();
            let (sin, cos) = libm::sincos(turn);
            (way + Matrix2::new(cos, -sin, sin, cos) * step, turn + more)
        })
    }

    /// The robot's frame at a later time in that of an earlier one; `None` where the log has a gap between them.
    pub fn motion(&self, from: f64, to: f64) -> Option<Pose<f32>> {
        if self.between(from, to).iter().any(|span| span.unknown != [0.0; 2]) {
            return None;
        }
        let (step, turn) = self.step(from, to);
        Some(Pose::new(step.x as f32, step.y as f32, turn as f32))
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

/// Fails at the first line whose columns behind the time hold what nothing drives.
fn check_readings<const N: usize>(table: &Table, rows: &[[f64; N]], names: [&str; 2]) -> Result<()> {
    for (row, line) in rows.iter().zip(table.lines()) {
        for (name, number) in names.into_iter().zip(row.iter().skip(1)) {
            plausibility::check_reading(name, *number).map_err(|error| error.at_line(table.path(), line))?;
        }
    }
    Ok(())
}

/// The rows on a clock of seconds, those of one time as one.
fn in_order<const N: usize>(
    table: &Table,
    mut rows: Vec<[f64; N]>,
    join: impl Fn(&mut [f64; N], [f64; N]),
) -> Result<Vec<[f64; N]>> {
    let path = table.path();
    let unit = plausibility::seconds_of_clock(path, rows.iter().map(|row| row[0]));
    for row in &mut rows {
        row[0] /= unit;
    }
    let mut ordered: Vec<[f64; N]> = Vec::with_capacity(rows.len());
    let (mut before, mut equal) = (None, Vec::new());
    for (row, line) in rows.into_iter().zip(table.lines()) {
        match ordered.last_mut() {
            Some(last) if row[0] < last[0] => {
                let cause = format!("time {} is before the line before's, {}", row[0], last[0]);
                return Err(Error::new(cause).at_line(path, line).help("sort the lines by time"));
            }
            Some(last) if row[0] - last[0] < ONE_TIME => {
                equal.push(line);
                if before != Some(row) {
                    join(last, row);
                }
            }
            _ => ordered.push(row),
        }
        before = Some(row);
    }
    if let Some(first) = equal.first() {
        let cause = format!("{} lines have the time of the line before", equal.len());
        Error::new(cause)
            .at_line(path, *first)
            .help("they are taken in order, and a line that is there twice once")
            .warn();
    }
    let times: Vec<_> = ordered.iter().map(|row| row[0]).collect();
    plausibility::check_steps(path, &times)?;
    Ok(ordered)
}

fn warn_of_gaps(path: &Path, times: &[f64], gaps: &[usize], what: &str) {
    let longest =
        gaps.iter().filter_map(|gap| Some((times.get(*gap)?, times.get(gap + 1)? - times.get(*gap)?)));
    if let Some((at, length)) = longest.max_by(|a, b| a.1.total_cmp(&b.1)) {
        let (step, _) = plausibility::gaps(times);
        let cause = format!(
            "says nothing for {length:.3} s from {at} s on, among steps of {step:.3} s ({} such gap{}): {what}",
            gaps.len(),
            if gaps.len() == 1 { "" } else { "s" }
        );
        let help = "give lines also while the robot stands, or leave the part out";
        Error::new(cause).at(path).help(help).warn();
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
    fn poses_are_as_good_as_their_differences() {
        let folder = tempfile::tempdir().expect("a folder");
        let step = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).expect("a file");
            Odometry::read(&path).expect("sound odometry").step(0.5, 2.0)
        };
        // Straight on for a metre, then a quarter turn to the left round a circle of one metre, seen from elsewhere.
        let increments = step("steps.csv", "t,dx,dy,dtheta\n0,0,0,0\n1,1,0,0\n2,1,1,1.5707963267948966\n");
        let poses = step(
            "poses.csv",
            "t,x,y,heading\n0,5,5,3.0\n1,4.010007503399555,5.141120008059867,3.0\n2,2.8788949987392423,4.2922475195192895,-1.7123889803846897\n",
        );
        let tum = step(
            "odom.tum",
            "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 1 0 0 0 0.7071067811865476 0.7071067811865476\n",
        );
        for other in [poses, tum] {
            assert!(
                (other.0 - increments.0).norm() < 1e-9 && (other.1 - increments.1).abs() < 1e-9,
                "{other:?} {increments:?}"
            );
        }
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
    fn a_gap_is_bridged_without_motion_and_with_noise() {
        let odometry = parse("t,v,omega\n0,1,0\n0.1,1,0\n0.2,1,0\n60.2,1,0\n60.3,1,0\n");
        let way: f64 = odometry.between(0.0, 60.2).iter().map(|c| c.velocity.x * c.duration).sum();
        assert!((way - 0.3).abs() < 1e-9, "{way} m in a gap");
        let unknown: f64 = odometry.between(0.0, 60.2).iter().map(|c| c.unknown[0] * c.duration).sum();
        assert!((unknown - 59.9).abs() < 1e-9);
        assert!(crate::warnings::fresh()[0].contains("60.000 s from 0.2 s"));
    }

    #[test]
    fn lines_of_one_time_are_taken_in_order() {
        let once = parse("t,v,omega\n0,1,0\n1,2,0\n2,3,0\n");
        assert_eq!(
            parse("t,v,omega\n0,1,0\n1,5,0\n1,2,0\n2,3,0\n").between(0.0, 3.0),
            once.between(0.0, 3.0)
        );
        let way =
            |text: &str| parse(text).between(0.0, 2.0).iter().map(|c| c.velocity.x * c.duration).sum::<f64>();
        assert_eq!(way("t,dx,dy,dtheta\n0,0,0,0\n1,1,0,0\n1,1,0,0\n2,1,0,0\n"), 2.0, "the same line twice");
        assert_eq!(way("t,dx,dy,dtheta\n0,0,0,0\n1,1,0,0\n1,2,0,0\n2,1,0,0\n"), 4.0, "two increments");
        assert!(crate::warnings::fresh()[0].contains("line 4"));
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

//! What a run found, written by the command line's own writers: the same bytes, the same report.
//!
//! It is told of the run frame by frame, in rows of numbers as `monorange-wasm` gives them, and loads only when
//! something is to be saved. Of six frames the report shows the picture with what was found in it: their pixels are
//! asked for ([`Results::telling_frames`]) and looked at again, by the same code that saw the same in them before.
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use core::fmt::Display;
use monorange_core::geometry::Pose;
use monorange_core::image::Grey;
use monorange_core::slam::{Decision, Verdict};
use monorange_formats::extraction::extractor;
use monorange_formats::files::{MapPoint, Rig, Stamped, Table, memory, read_trajectory};
use monorange_formats::report::{Observation, Run, SHOTS, shot};
use nalgebra::{Matrix2, Matrix3, Vector2};
use std::path::Path;
use wasm_bindgen::prelude::*;

/// Numbers in a row of corners.
const CORNER_COLUMNS: usize = 11;
/// In the order of their numbers in a corner's row.
const DECISIONS: [Decision; 5] =
    [Decision::Update, Decision::Birth, Decision::Gated, Decision::Tentative, Decision::Rejected];

type Answer<T> = Result<T, JsError>;

fn sentence(error: impl Display) -> JsError {
    JsError::new(&error.to_string().replace("\n  help: ", ". To mend it: "))
}

/// Makes a file readable by [`Results::compare`] under its path.
#[wasm_bindgen]
pub fn offer(path: &str, content: Vec<u8>) {
    memory::offer(path, content);
}

/// A run, told frame by frame.
#[wasm_bindgen]
pub struct Results {
    run: Run,
    rig: Rig,
    /// Index, and corners, of every frame that was used.
    used: Vec<(usize, usize)>,
    start: f64,
}

#[wasm_bindgen]
impl Results {
    /// A run of so many frames that begins at `start` seconds, with the rig of this file.
    ///
    /// # Errors
    /// A sentence with the line and the key at fault.
    #[wasm_bindgen(constructor)]
    pub fn begin(title: &str, command: &str, rig: &str, frames: usize, start: f64) -> Answer<Results> {
        Self::new(title, command, rig, frames, start).map_err(sentence)
    }

    /// Tells of a frame: pose x, y, heading; covariance var_x, cov_xy, cov_xh, var_y, cov_yh, var_h; rows of corners;
    /// milliseconds of the stages.
    #[wasm_bindgen(js_name = addFrame)]
    pub fn add_frame(
        &mut self,
        frame: usize,
        time: f64,
        pose: &[f32],
        covariance: &[f32],
        corners: &[f32],
        stages_ms: &[f32],
    ) {
        let (&[x, y, heading], &[xx, xy, xh, yy, yh, hh]) = (pose, covariance) else { return };
        let covariance = Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh).map(f64::from);
        // As it is: wrapping again could change the last bit.
        let pose = Pose { x: x.into(), y: y.into(), heading: heading.into() };
        self.run.frames_used += 1;
        self.run.trajectory.push(Stamped { time, pose, covariance: Some(covariance) });
        let rows = corners.chunks_exact(CORNER_COLUMNS);
        self.used.push((frame, rows.len()));
        self.run.observations.extend(rows.filter_map(|row| observation(time, frame, row)));
        for (stage, spent) in self.run.stages.iter_mut().zip(stages_ms) {
            stage.times_ms.push(f64::from(*spent));
        }
    }

    /// Tells of a frame that could not be used, in a sentence.
    #[wasm_bindgen(js_name = leaveOut)]
    pub fn leave_out(&mut self, reason: String) {
        self.run.left_out.push(reason);
    }

    /// Tells of the map as rows id, x, y, var_x, cov_xy, var_y, seen, first and last time since the start; of corners
    /// without a range, landmarks without room, and, where the motion came from the pictures, steps without a
    /// measurement; of the filter's verdict on itself.
    pub fn end(
        &mut self,
        map: &[f64],
        without_range: u32,
        no_room: u32,
        unmeasured: Option<usize>,
        verdict: &str,
        mean_nis: f32,
    ) {
        self.run.map = map.chunks_exact(9).filter_map(|row| map_point(row, self.start)).collect();
        (self.run.without_range, self.run.no_room, self.run.unmeasured) =
            (without_range, no_room, unmeasured);
        let named = Verdict::ALL.into_iter().find(|known| known.as_str() == verdict);
        self.run.verdict = named.unwrap_or_default();
        self.run.mean_nis = mean_nis;
    }

    /// Puts the truth, a laser's points and the true landmarks, of files that were offered, beside what was found.
    ///
    /// # Errors
    /// A sentence with the file and the line.
    pub fn compare(
        &mut self,
        truth: Option<String>,
        laser: Option<String>,
        landmarks: Option<String>,
    ) -> Answer<()> {
        let [laser, landmarks] = [points(laser)?, points(landmarks)?];
        let Some(truth) = truth else {
            self.run.laser = laser;
            return Ok(());
        };
        let poses = read_trajectory(Path::new(&truth)).map_err(sentence)?;
        match self.run.compare(self.start, &poses, &laser, &landmarks) {
            true => Ok(()),
            false => Err(JsError::new(&format!("{truth} has no pose at the first frame's time"))),
        }
    }

    /// The frames whose pictures the report shows: of each part of the drive the one with the most corners.
    #[wasm_bindgen(js_name = tellingFrames)]
    pub fn telling_frames(&self) -> Vec<usize> {
        let mut best = [None::<(usize, usize)>; SHOTS];
        for &(frame, corners) in &self.used {
            let part = frame * SHOTS / self.run.frames.max(1);
            if let Some(best) = best.get_mut(part).filter(|best| best.is_none_or(|(_, most)| corners > most))
            {
                *best = Some((frame, corners));
            }
        }
        best.into_iter().flatten().map(|(frame, _)| frame).collect()
    }

    /// Adds the grey picture of a frame to the report.
    ///
    /// # Errors
    /// A sentence, where it has another size than the rig's.
    #[wasm_bindgen(js_name = addPicture)]
    pub fn add_picture(&mut self, frame: usize, pixels: &[u8]) -> Answer<()> {
        self.shoot(frame, pixels).map_err(sentence)
    }

    /// One of the command line's outputs, by its name.
    ///
    /// # Errors
    /// A sentence, where there is none of this name.
    pub fn write(&self, name: &str) -> Answer<String> {
        let mut text = Vec::new();
        self.run.write(name, &mut text).map_err(sentence)?;
        String::from_utf8(text).map_err(sentence)
    }
}

impl Results {
    /// As [`begin`](Self::begin), for Rust.
    ///
    /// # Errors
    /// As [`Rig::parse`].
    pub fn new(
        title: &str,
        command: &str,
        rig: &str,
        frames: usize,
        start: f64,
    ) -> Result<Self, monorange_formats::Error> {
        let rig = Rig::parse(Path::new("rig.toml"), rig)?;
        let run = Run::of_pictures(title.into(), command.into(), &rig, frames);
        Ok(Self { run, rig, used: Vec::new(), start })
    }

    fn shoot(&mut self, frame: usize, pixels: &[u8]) -> Result<(), monorange_formats::Error> {
        let camera = self.rig.finder.camera();
        let picture =
            Grey::new(pixels, camera.width(), camera.height()).map_err(monorange_formats::Error::new)?;
        let mut extractor = extractor(&self.rig)?;
        extractor.begin();
        for row in picture.rows() {
            extractor.push_row(row).map_err(monorange_formats::Error::new)?;
        }
        let extraction = extractor.finish().map_err(monorange_formats::Error::new)?;
        let seen: Vec<_> = self.run.observations.iter().filter(|seen| seen.frame == frame).copied().collect();
        let time = self.used.iter().position(|(used, _)| *used == frame);
        let time = time.and_then(|index| self.run.trajectory.get(index)).map_or(0.0, |pose| pose.time);
        self.run.shots.push(shot(
            &self.rig,
            pixels,
            |overlay| overlay.lines(extraction),
            &seen,
            frame,
            time - self.start,
        )?);
        Ok(())
    }
}

fn points(path: Option<String>) -> Answer<Vec<Vector2<f64>>> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let rows = Table::read(Path::new(&path)).and_then(|table| table.numbers(["x", "y"])).map_err(sentence)?;
    Ok(rows.into_iter().map(Vector2::from).collect())
}

fn observation(time: f64, frame: usize, row: &[f32]) -> Option<Observation> {
    let [u, v, uu, uv, vv, range, bearing, _, landmark, decision, nis] = *row else { return None };
    Some(Observation {
        time,
        frame,
        pixel: Some(Vector2::new(u, v)),
        pixel_covariance: Some(Matrix2::new(uu, uv, uv, vv)),
        range: Some(range),
        bearing: Some(bearing),
        landmark: (landmark >= 0.0).then_some(landmark as u32),
        decision: *DECISIONS.get(decision as usize)?,
        nis: nis.is_finite().then_some(nis),
    })
}

fn map_point(row: &[f64], start: f64) -> Option<MapPoint> {
    let [id, x, y, xx, xy, yy, seen, first, last] = *row else { return None };
    Some(MapPoint {
        id: id as u64,
        position: Vector2::new(x, y),
        covariance: Some(Matrix2::new(xx, xy, xy, yy)),
        seen: seen as u64,
        first_and_last: Some([first + start, last + start]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: &str = "[camera]\nwidth = 64\nheight = 48\nfocal = [60.0, 60.0]\nprincipal = [31.5, 23.5]\n\
        [mount]\nheight = 0.4\ntilt_deg = 12.0\n[filter]\nvariant = \"textbook\"\n";

    fn results() -> Results {
        let mut results = Results::new("a drive", "test", RIG, 12, 0.5).unwrap();
        for (frame, corners) in [(0, 1), (1, 0), (2, 2), (3, 2)] {
            let row = [20.0, 30.0, 0.1, 0.0, 0.1, 1.5, 0.1, 0.01, 7.0, 0.0, 1.0];
            let covariance = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0];
            results.add_frame(frame, 0.5, &[0.1, -2.0, 0.0], &covariance, &row.repeat(corners), &[1.0; 5]);
        }
        results
    }

    fn written(results: &Results, name: &str) -> String {
        let mut text = Vec::new();
        results.run.write(name, &mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn a_pose_is_written_with_all_its_bits() {
        let tum = written(&results(), "trajectory.tum");
        assert_eq!(tum.lines().next(), Some(format!("0.5 {} -2 0 0 0 0 1", f64::from(0.1_f32)).as_str()));
    }

    #[test]
    fn a_map_has_a_line_a_landmark_on_the_clock_of_the_frames() {
        let mut results = results();
        results.end(&[7.0, 1.0, 2.0, 0.1, 0.0, 0.2, 3.0, 0.5, 1.5], 0, 0, None, "consistent", 1.0);
        assert_eq!(written(&results, "map.csv").lines().nth(1), Some("7,1,2,0.1,0,0.2,3,1,2"));
        assert!(written(&results, "map.ply").starts_with("ply\n"));
    }

    #[test]
    fn the_first_frame_with_the_most_corners_of_each_part_tells_most() {
        assert_eq!(results().telling_frames(), [0, 2]);
    }

    #[test]
    fn the_report_has_the_pictures_and_the_settings_of_the_rig() {
        let mut results = results();
        results.shoot(2, &[128; 64 * 48]).unwrap();
        let page = written(&results, "report.html");
        assert!(page.contains("Frame 2, 0.0 s: 2 floor corners, 2 matched."));
        assert!(page.contains("<tr class=\"changed\"><td>filter.variant<td class=\"n\">textbook"));
    }
}

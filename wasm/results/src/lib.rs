//! What a run found, written by the command line's own writers: the same bytes, the same report.
//!
//! It is given the record of a `Session` and loads only when something is to be saved. Of six frames the report shows the picture with what was found in it: their pixels are
//! asked for ([`Results::telling_frames`]) and looked at again, by the same code that saw the same in them before.
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

mod mcap;

use crate::mcap::Mcap;
use core::fmt::Display;
use monorange_core::geometry::Pose;
use monorange_core::image::Grey;
use monorange_core::slam::Reason;
use monorange_formats::draw::Overlay;
use monorange_formats::extraction::extractor;
use monorange_formats::files::{MapPoint, Rig, Stamped, Table, memory, read_trajectory};
use monorange_formats::report::{Carried, Observation, Run, SHOTS, Shot, shot};
use monorange_formats::warnings;
use monorange_wasm_record::{Corner, Decision, Frame, Landmark, Record};
use nalgebra::{Matrix2, Matrix3, Vector2};
use std::path::Path;
use wasm_bindgen::prelude::*;

type Answer<T> = Result<T, JsError>;

fn sentence(error: impl Display) -> JsError {
    JsError::new(&error.to_string().replace("\n  help: ", ". To mend it: "))
}

/// Makes a file readable by [`Results::compare`] under its path.
#[wasm_bindgen]
pub fn offer(path: &str, content: Vec<u8>) {
    memory::offer(path, content);
}

/// A run.
#[wasm_bindgen]
pub struct Results {
    run: Run,
    rig: Rig,
    /// Index, and corners, of every frame that was used.
    used: Vec<(usize, usize)>,
    /// How the robot had moved in each of them since the one before.
    moved: Vec<Option<Pose<f32>>>,
    start: f64,
    /// What the run warned of.
    told: Vec<String>,
    /// When, and the confirmed landmarks then.
    maps: Vec<(f64, Vec<MapPoint>)>,
    /// A recording that is being written.
    mcap: Option<Mcap>,
}

#[wasm_bindgen]
impl Results {
    /// The run of a `Session`'s record, with the rig of this file.
    ///
    /// # Errors
    /// A sentence with the line and the key at fault.
    #[wasm_bindgen(constructor)]
    pub fn begin(command: &str, rig: &str, record: &[u8]) -> Answer<Results> {
        let record = Record::from_bytes(record).map_err(sentence)?;
        Self::new(command, rig, &record).map_err(sentence)
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
        match self.run.compare(self.start, None, &poses, &laser, &landmarks) {
            Some(_) => Ok(()),
            None => Err(JsError::new(&format!("{truth} has no pose at the first frame's time"))),
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
        let shot = self.shot(frame, pixels).map_err(sentence)?;
        self.run.shots.push(shot);
        Ok(())
    }

    /// Begins `drive.mcap`: the frames whose pictures it wants, one after the other, by [`record`](Self::record).
    ///
    /// # Errors
    /// Without memory.
    #[wasm_bindgen(js_name = beginMcap)]
    pub fn begin_mcap(&mut self) -> Answer<Vec<usize>> {
        self.mcap = Some(Mcap::new(&self.rig).map_err(sentence)?);
        Ok(self.used.iter().map(|(frame, _)| *frame).collect())
    }

    /// Adds the next frame with its grey picture; what there is of the file since the call before.
    ///
    /// # Errors
    /// As [`add_picture`](Self::add_picture).
    pub fn record(&mut self, pixels: &[u8]) -> Answer<Vec<u8>> {
        self.add_to_mcap(pixels).map_err(sentence)
    }

    /// The end of the file.
    ///
    /// # Errors
    /// Where it was not begun.
    #[wasm_bindgen(js_name = endMcap)]
    pub fn end_mcap(&mut self) -> Answer<Vec<u8>> {
        let mcap = self.mcap.take().ok_or_else(|| JsError::new("there is no recording"))?;
        let end = self.run.trajectory.last().map_or(self.start, |pose| pose.time);
        mcap.end(end, &self.run.map).map_err(sentence)
    }

    /// One of the command line's outputs, by its name.
    ///
    /// # Errors
    /// A sentence, where there is none of this name.
    pub fn write(&mut self, name: &str) -> Answer<String> {
        self.run.warn();
        self.run.warnings = self.told.iter().cloned().chain(warnings::all()).collect();
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
    pub fn new(command: &str, rig: &str, record: &Record) -> Result<Self, monorange_formats::Error> {
        let rig = Rig::parse(Path::new("rig.toml"), rig)?;
        // The run has told what there is to say of its rig.
        warnings::forget();
        let mut run = Run::of_pictures(record.title.clone(), command.into(), &rig, record.frames);
        let (mut used, mut moved) = (Vec::new(), Vec::new());
        for frame in &record.used {
            let [xx, xy, xh, yy, yh, hh] = frame.covariance;
            let covariance = Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh).map(f64::from);
            // As it is: wrapping again could change the last bit.
            let [x, y, heading] = frame.pose.map(f64::from);
            run.frames_used += 1;
            run.trajectory.push(Stamped {
                time: frame.time,
                pose: Pose { x, y, heading },
                covariance: Some(covariance),
            });
            let corners = frame.corners.chunks_exact(Corner::WIDTH).filter_map(Corner::of);
            let before = run.observations.len();
            run.observations.extend(corners.map(|corner| observation(frame, &corner)));
            moved.push(frame.moved.map(|[x, y, heading]| Pose { x, y, heading }));
            used.push((frame.index, run.observations.len() - before));
            for (stage, spent) in run.stages.iter_mut().zip(frame.stages_ms) {
                stage.times_ms.push(f64::from(spent));
            }
        }
        run.left_out.clone_from(&record.left_out);
        run.map = record.map.iter().map(|point| map_point(point, record.start)).collect();
        (run.without_range, run.no_room) = (record.without_range, record.no_room);
        run.unmeasured = record.unmeasured;
        run.knocked.clone_from(&record.knocked);
        run.carried = record.carried.map(|[floor, free, map]| Carried { floor, free, map });
        run.verdict = record.verdict.into();
        run.reason = Reason::ALL.into_iter().find(|reason| reason.as_str() == record.reason);
        run.mean_nis = record.mean_nis;
        let rows = |rows: &[f32]| rows.chunks_exact(Landmark::WIDTH).filter_map(map_point_then).collect();
        let maps = record.maps.iter().map(|map| (map.time, rows(&map.landmarks))).collect();
        let (start, told) = (record.start, record.warnings.clone());
        Ok(Self { run, rig, used, moved, start, told, maps, mcap: None })
    }

    fn add_to_mcap(&mut self, pixels: &[u8]) -> Result<Vec<u8>, monorange_formats::Error> {
        let next = self.mcap.as_ref().map_or(0, |mcap| mcap.frames);
        let (Some((frame, _)), Some(pose)) = (self.used.get(next), self.run.trajectory.get(next)) else {
            return Err(monorange_formats::Error::new("the run has no more frames"));
        };
        let jpeg = self.shot(*frame, pixels)?.jpeg;
        let map = self.maps.iter().find(|(time, _)| *time == pose.time).map(|(_, map)| map.as_slice());
        let moved = self.moved.get(next).and_then(Option::as_ref);
        let picture = self.grey(pixels)?;
        match &mut self.mcap {
            Some(mcap) => mcap.frame(pose, moved, picture, &jpeg, map),
            None => Err(monorange_formats::Error::new("the recording was not begun")),
        }
    }

    fn grey<'a>(&self, pixels: &'a [u8]) -> Result<Grey<'a>, monorange_formats::Error> {
        let camera = self.rig.finder.camera();
        Grey::new(pixels, camera.width(), camera.height()).map_err(monorange_formats::Error::new)
    }

    /// The picture of a frame with what was found in it.
    fn shot(&self, frame: usize, pixels: &[u8]) -> Result<Shot, monorange_formats::Error> {
        let picture = self.grey(pixels)?;
        let mut extractor = extractor(&self.rig)?;
        extractor.begin();
        for row in picture.rows() {
            extractor.push_row(row).map_err(monorange_formats::Error::new)?;
        }
        let extraction = extractor.finish().map_err(monorange_formats::Error::new)?;
        let seen: Vec<_> = self.run.observations.iter().filter(|seen| seen.frame == frame).copied().collect();
        let time = self.used.iter().position(|(used, _)| *used == frame);
        let time = time.and_then(|index| self.run.trajectory.get(index)).map_or(0.0, |pose| pose.time);
        let lines = |overlay: &mut Overlay<'_>| overlay.lines(extraction);
        shot(&self.rig, pixels, lines, &seen, frame, time - self.start)
    }
}

fn points(path: Option<String>) -> Answer<Vec<Vector2<f64>>> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let rows = Table::read(Path::new(&path)).and_then(|table| table.numbers(["x", "y"])).map_err(sentence)?;
    Ok(rows.into_iter().map(Vector2::from).collect())
}

fn observation(frame: &Frame, corner: &Corner) -> Observation {
    let decision = Decision::of(corner.decision).unwrap_or(Decision::Rejected);
    Observation {
        time: frame.time,
        frame: frame.index,
        pixel: Some(Vector2::new(corner.u, corner.v)),
        pixel_covariance: Some(Matrix2::new(corner.var_u, corner.cov_uv, corner.cov_uv, corner.var_v)),
        range: Some(corner.range),
        bearing: Some(corner.bearing),
        landmark: corner.landmark_id(),
        decision: decision.into(),
        nis: corner.nis.is_finite().then_some(corner.nis),
    }
}

fn map_point(point: &monorange_wasm_record::MapPoint, start: f64) -> MapPoint {
    let ([x, y], [xx, xy, yy]) = (point.position.map(f64::from), point.covariance.map(f64::from));
    MapPoint {
        id: point.id,
        position: Vector2::new(x, y),
        covariance: Some(Matrix2::new(xx, xy, xy, yy)),
        seen: point.seen,
        first_and_last: Some(point.times.map(|time| time + start)),
    }
}

/// A landmark in the middle of a run.
fn map_point_then(row: &[f32]) -> Option<MapPoint> {
    let Landmark { id, x, y, var_x, cov_xy, var_y, seen, .. } = Landmark::of(row)?;
    let [x, y, var_x, cov_xy, var_y] = [x, y, var_x, cov_xy, var_y].map(f64::from);
    Some(MapPoint {
        id: id as u64,
        position: Vector2::new(x, y),
        covariance: Some(Matrix2::new(var_x, cov_xy, cov_xy, var_y)),
        seen: seen as u64,
        first_and_last: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: &str = "[camera]\nwidth = 64\nheight = 48\nfocal = [60.0, 60.0]\nprincipal = [31.5, 23.5]\n\
        [mount]\nheight = 0.4\ntilt_deg = 12.0\n[filter]\nvariant = \"textbook\"\n";

    fn record() -> Record {
        let corner = Corner {
            u: 20.0,
            v: 30.0,
            var_u: 0.1,
            cov_uv: 0.0,
            var_v: 0.1,
            range: 1.5,
            bearing: 0.1,
            range_std: 0.01,
            landmark: 7.0,
            decision: Decision::Update as u32 as f32,
            nis: 1.0,
        };
        let mut rows = Vec::new();
        corner.push(&mut rows);
        let frame = |(index, corners): (usize, usize)| Frame {
            index,
            time: 0.5,
            pose: [0.1, -2.0, 0.0],
            covariance: [1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
            moved: None,
            corners: rows.repeat(corners),
            stages_ms: [1.0; 5],
        };
        let used = [(0, 1), (1, 0), (2, 2), (3, 2)].map(frame).to_vec();
        let (title, frames, start) = ("a drive".to_owned(), 12, 0.5);
        Record { title, frames, start, used, ..Record::default() }
    }

    fn results() -> Results {
        Results::new("test", RIG, &record()).unwrap()
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
        let point = monorange_wasm_record::MapPoint {
            id: 7,
            position: [1.0, 2.0],
            covariance: [0.25, 0.0, 0.5],
            seen: 3,
            times: [0.5, 1.5],
        };
        let results = Results::new("test", RIG, &Record { map: vec![point], ..record() }).unwrap();
        assert_eq!(written(&results, "map.csv").lines().nth(1), Some("7,1,2,0.25,0,0.5,3,1,2"));
        assert!(written(&results, "map.ply").starts_with("ply\n"));
    }

    #[test]
    fn the_first_frame_with_the_most_corners_of_each_part_tells_most() {
        assert_eq!(results().telling_frames(), [0, 2]);
    }

    #[test]
    fn the_report_has_the_pictures_and_the_settings_of_the_rig() {
        let mut results = results();
        let shot = results.shot(2, &[128; 64 * 48]).unwrap();
        results.run.shots.push(shot);
        let page = written(&results, "report.html");
        assert!(page.contains("Frame 2, 0.0 s: 2 floor corners, 2 matched."));
        assert!(page.contains("<tr class=\"changed\"><td>filter.variant<td class=\"n\">textbook"));
    }

    #[test]
    fn a_recording_grows_frame_by_frame_and_is_read_again() {
        use monorange_formats::bags::{Choice, Recording};
        use monorange_wasm_record::record::MapThen;
        let maps = vec![MapThen { time: 0.5, landmarks: vec![7.0, 1.0, 2.0, 0.25, 0.0, 0.5, 3.0, 1.0] }];
        let mut results = Results::new("test", RIG, &Record { maps, ..record() }).unwrap();
        results.run.trajectory.iter_mut().enumerate().for_each(|(k, pose)| pose.time = 0.5 + k as f64);
        let frames = results.begin_mcap().unwrap();
        assert_eq!(frames, [0, 1, 2, 3]);
        let mut file = Vec::new();
        for _ in frames {
            file.extend(results.add_to_mcap(&[128; 64 * 48]).unwrap());
        }
        assert!(results.add_to_mcap(&[128; 64 * 48]).is_err());
        file.extend(results.end_mcap().unwrap());
        memory::offer("drive.mcap", file);
        let recording = Recording::read(Path::new("drive.mcap"), Choice::default()).unwrap();
        memory::withdraw_all();
        assert_eq!(recording.times, [0.5, 1.5, 2.5, 3.5]);
        // Of the overlays, which are enlarged.
        let camera = *recording.rig().unwrap().finder.camera();
        assert_eq!(recording.frames[0].size(), Some([camera.width(), camera.height()]));
        assert_eq!(camera.width(), 8 * 64);
    }
}

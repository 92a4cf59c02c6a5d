//! `slam --map`: the run's place in the map of an earlier one.
use super::placed::{double, of_the_frame, put};
use crate::outputs::Outputs;
use monorange_core::{
    geometry::Pose,
    pipeline::{Located, OnHeap, Pipeline, Report},
    slam::Reason,
};
use monorange_formats::{
    Error, Result,
    files::MapFile,
    report::{InMap, Run},
};

/// What it writes beside a run's own files.
pub(super) const OUTPUT: &str = "map.bin";

/// A map that the run begins in, and whether it knows by now where.
pub(super) struct Saved<'a> {
    file: &'a MapFile,
    fixed: bool,
    found: Option<Pose<f64>>,
}

impl<'a> Saved<'a> {
    /// Looks for the place in this map. With `fixed` the map stays as it is.
    pub(super) fn new(file: &'a MapFile, fixed: bool, pipeline: &mut Pipeline<OnHeap>) -> Result<Self> {
        pipeline.number_from(file.map()?.next_id());
        Ok(Self { file, fixed, found: None })
    }

    /// Takes the last frame's report. Where the place is found now, what the run has found so far is put there; then the map's frame is
    /// given in which its own was.
    pub(super) fn look(
        &mut self,
        pipeline: &mut Pipeline<OnHeap>,
        start: f64,
        report: &Report,
        run: &mut Run,
    ) -> Result<Option<Pose<f32>>> {
        if self.found.is_some() {
            return Ok(None);
        }
        let (own, map) = (pipeline.filter().pose_covariance(), self.file.map()?);
        let later = self.file.start - start;
        let located = pipeline.locate(&map, later, self.fixed, report);
        let refused = |error| Error::new(error).at(self.file.path());
        let Some(Located { map_from_own, names }) = located.map_err(refused)? else { return Ok(None) };
        let filter = pipeline.filter();
        let now = (double(filter.pose()), filter.pose_covariance().cast());
        let moved = double(map_from_own);
        let uncertain = of_the_frame(&moved, &now, &own.cast());
        if let Some((last, before)) = run.trajectory.split_last_mut() {
            before.iter_mut().for_each(|stamped| put(stamped, &moved, &uncertain));
            (last.pose, last.covariance) = (now.0, Some(now.1));
        }
        for seen in &mut run.observations {
            let name = names.iter().find(|(own, _)| seen.landmark == Some(*own));
            seen.landmark = name.map(|(_, name)| *name).or(seen.landmark);
        }
        self.found = Some(moved);
        run.in_map = Some(InMap {
            found_after_s: Some(run.seconds()),
            found_after_m: Some(run.path()),
            recognised: names.len(),
            ..self.told()
        });
        Ok(Some(map_from_own))
    }

    /// Whether the map stays as it is.
    pub(super) fn is_fixed(&self) -> bool {
        self.fixed
    }

    /// Whether the place is known.
    pub(super) fn is_found(&self) -> bool {
        self.found.is_some()
    }

    fn told(&self) -> InMap {
        let (found_after_s, found_after_m) = (None, None);
        InMap {
            map: self.file.path().display().to_string(),
            found_after_s,
            found_after_m,
            recognised: 0,
            localise_only: self.fixed,
        }
    }

    /// Ends the run: one that has not found its place is lost. The world of the truth in the map, where it is known.
    pub(super) fn finish(&self, run: &mut Run) -> Option<Pose<f64>> {
        if self.found.is_none() {
            run.in_map = Some(self.told());
            (run.verdict, run.reason) = (Reason::Elsewhere.verdict(), Some(Reason::Elsewhere));
            return None;
        }
        self.file.map_from_truth
    }
}

/// Writes the map for later runs.
pub(super) fn write(
    outputs: &mut Outputs,
    pipeline: &mut Pipeline<OnHeap>,
    start: f64,
    map_from_truth: Option<Pose<f64>>,
) -> Result<()> {
    let file = MapFile::of(pipeline, start, map_from_truth)?;
    outputs.write(OUTPUT, |out| file.write(out))
}

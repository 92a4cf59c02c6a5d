//! The virtual scan of every picture, for `slam --scan` with the grid that the scans make along the path, and for `--mcap`.
use crate::{
    commands::scan::{HEADER, row},
    outputs::Outputs,
};
use monorange_core::{
    geometry::Pose,
    image::Grey,
    pipeline::{MovedBy, Report},
    scan::{Reading, ScanConfig, Scanner, motion_in_run},
};
use monorange_formats::{
    Error, Result,
    extraction::scanner,
    files::{Odometry, Rig},
    grid::Scans,
};
use nalgebra::Vector2;

/// What it writes beside a run's own files.
pub(super) const OUTPUTS: [&str; 3] = ["scan.csv", "map.pgm", "map.yaml"];

/// The scans of a drive so far.
pub(super) struct Scanned {
    scanner: Box<Scanner>,
    table: String,
    scans: Scans,
    /// Of the lens on the robot.
    lever_arm: Vector2<f32>,
    before: Option<(f64, Pose<f32>)>,
}

impl Scanned {
    pub(super) fn new(rig: &Rig) -> Result<Self> {
        let scanner = scanner(rig, ScanConfig::default())?;
        let (table, scans, before) = (HEADER.to_owned(), Scans::default(), None);
        Ok(Self { scanner, table, scans, lever_arm: rig.finder.mount().lever_arm().cast(), before })
    }

    /// Scans the picture at a time, from where the run has put the robot.
    pub(super) fn look(
        &mut self,
        time: f64,
        picture: Grey<'_>,
        odometry: Option<&Odometry>,
        report: &Report,
    ) -> Result<()> {
        if let Some((before, pose)) = &self.before {
            let wheels = odometry.map(|odometry| odometry.motion(*before, time));
            let held = report.moved_by == MovedBy::Held;
            self.scanner.follow(motion_in_run(wheels, held, pose, &report.pose).as_ref());
        }
        self.before = Some((time, report.pose));
        let readings = self.scanner.scan(picture).map_err(Error::new)?;
        readings.iter().for_each(|reading| row(&mut self.table, time, reading));
        self.scans.add(report.pose, self.lever_arm, readings);
        Ok(())
    }

    /// Puts what there is into another world.
    pub(super) fn put(&mut self, moved: &Pose<f32>) {
        self.scans.put(moved);
        self.before = self.before.map(|(time, pose)| (time, moved.compose(&pose)));
    }

    /// Puts the robot to other places in the pictures before this one.
    pub(super) fn put_last(&mut self, poses: &[Pose<f32>]) {
        self.scans.put_last(poses, self.lever_arm);
        if let (Some((_, before)), Some(pose)) = (&mut self.before, poses.last()) {
            *before = *pose;
        }
    }

    /// The last picture's.
    pub(super) fn last(&self) -> &[Reading] {
        self.scans.last()
    }

    pub(super) fn write(&self, outputs: &mut Outputs) -> Result<()> {
        let grid = self.scans.grid();
        let [table, picture, words] = OUTPUTS;
        outputs.write(table, |out| out.write_all(self.table.as_bytes()))?;
        outputs.write(picture, |out| grid.write_pgm(out))?;
        outputs.write(words, |out| grid.write_yaml(out))
    }
}

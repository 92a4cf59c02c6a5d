//! People in the corridor: who is who, in pixels and in the map, against the truth.
use crate::corridor::config_for;
use monorange_core::Result;
use monorange_core::features::{Detector, Features};
use monorange_core::image::Grey;
use monorange_core::pipeline::{Carrier, Config, Memory, MotionFrom, Odometry, OnHeap, Pipeline};
use monorange_core::slam::{Decision, Status};
use monorange_sim::{Simulation, TrueCorner};
use nalgebra::Vector2;
use std::collections::{BTreeMap, BTreeSet};

/// How a picture's corners met their landmarks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Association {
    /// Updates of landmarks.
    pub updates: usize,
    /// Updates by another corner than the one that most of the landmark's are by, or by none that is true.
    pub wrong: usize,
    /// Sightings of true corners that had a landmark in the map.
    pub expected: usize,
    /// Of those, the sightings that updated no landmark.
    pub missed: usize,
    /// Confirmed landmarks at the end.
    pub landmarks: usize,
    /// True corners that were seen often enough to be confirmed.
    pub seen: usize,
    /// Pictures whose corners a homography carried, and pictures.
    pub carried: usize,
    /// Pictures.
    pub frames: usize,
    /// Distance from the true position at the end, m.
    pub end_error: f64,
    /// Path, m.
    pub path: f64,
}

impl Association {
    /// The sums of both.
    pub fn with(self, other: Self) -> Self {
        Self {
            updates: self.updates + other.updates,
            wrong: self.wrong + other.wrong,
            expected: self.expected + other.expected,
            missed: self.missed + other.missed,
            landmarks: self.landmarks + other.landmarks,
            seen: self.seen + other.seen,
            carried: self.carried + other.carried,
            frames: self.frames + other.frames,
            end_error: self.end_error + other.end_error,
            path: self.path + other.path,
        }
    }

    /// Wrong associations in parts of the updates.
    pub fn wrong_share(&self) -> f64 {
        self.wrong as f64 / self.updates.max(1) as f64
    }

    /// Missed associations in parts of those expected.
    pub fn missed_share(&self) -> f64 {
        self.missed as f64 / self.expected.max(1) as f64
    }

    /// Landmarks for every corner really seen.
    pub fn map_ratio(&self) -> f64 {
        self.landmarks as f64 / self.seen.max(1) as f64
    }
}

/// A corner this close to a true one's pixel is that one's.
const SAME_PX: f64 = 3.0;

/// Runs pipelines with each of the carriers over the same pictures.
///
/// # Errors
/// What the pipeline or the simulator refuses.
pub fn associate(simulation: &Simulation, carriers: &[Carrier]) -> Result<Vec<Association>> {
    let config = config_for(simulation)?;
    let camera = *config.finder.camera();
    let (width, height) = (camera.width(), camera.height());
    let mut detector = Detector::new(config.visual.features)?;
    let mut runs = Vec::new();
    for carrier in carriers {
        // The wheels alone move the robot, so that the carriers differ in nothing else.
        let config = Config { carrier: *carrier, motion_from: MotionFrom::Odometry, ..config };
        runs.push(Run::new(Pipeline::new(config, Memory::on_heap(width, height, 512))?));
    }
    let mut picture = vec![0; width * height];
    for frame in 0..simulation.len() {
        let time = simulation.time(frame);
        let odometry = frame.checked_sub(1).map(|before| {
            let (twist, seconds) = (simulation.odometry(before), time - simulation.time(before));
            Odometry::Velocity { v: twist.speed as f32, omega: twist.turn as f32, seconds: seconds as f32 }
        });
        simulation.render(frame, &mut picture)?;
        let grey = Grey::new(&picture, width, height)?;
        let features = detector.detect(grey)?;
        for run in &mut runs {
            if let Some(reading) = &odometry {
                run.pipeline.odometry(time, reading)?;
            }
            run.picture(simulation, frame, grey, &features)?;
        }
    }
    Ok(runs.into_iter().map(Run::finish).collect())
}

struct Run {
    pipeline: Pipeline<OnHeap>,
    score: Association,
    sightings: Vec<Sighting>,
    /// Landmark → the pictures between which it was in the map.
    lives: BTreeMap<u32, [usize; 2]>,
}

/// A corner that was reported.
struct Sighting {
    frame: usize,
    /// The true corners that it can be, the nearest first.
    near: Vec<usize>,
    /// Whether another corner of the picture is at the same true one.
    again: bool,
    /// The landmark that it was taken for.
    landmark: Option<u32>,
    born: bool,
}

impl Run {
    fn new(pipeline: Pipeline<OnHeap>) -> Self {
        let (score, sightings, lives) = (Association::default(), Vec::new(), BTreeMap::new());
        Self { pipeline, score, sightings, lives }
    }

    fn picture(
        &mut self,
        simulation: &Simulation,
        frame: usize,
        grey: Grey<'_>,
        features: &Features,
    ) -> Result<()> {
        let report = self.pipeline.step_with_features(simulation.time(frame), grey, features, |_| ())?;
        let truth = simulation.corners(frame);
        let mut met = BTreeSet::new();
        for corner in &report.corners {
            let pixel: Vector2<f64> = corner.pixel.cast();
            let distance = |t: &TrueCorner| (t.pixel - pixel).norm();
            let mut near: Vec<_> = truth.iter().filter(|t| distance(t) <= SAME_PX).collect();
            near.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
            let near: Vec<_> = near.iter().map(|t| t.id as usize).collect();
            let decision = corner.outcome.decision;
            let taken = matches!(decision, Decision::Update | Decision::Tentative | Decision::Birth);
            self.sightings.push(Sighting {
                frame,
                // Of two corners reported at one true corner, the first is it.
                again: near.first().is_some_and(|id| !met.insert(*id)),
                near,
                landmark: corner.outcome.landmark.filter(|_| taken),
                born: decision == Decision::Birth,
            });
        }
        for landmark in self.pipeline.filter().landmarks() {
            self.lives.entry(landmark.id).or_insert([frame, frame])[1] = frame;
        }
        self.score.carried += usize::from(report.carried_by != Carrier::Map);
        self.score.frames += 1;
        if let Some(before) = frame.checked_sub(1) {
            let [from, to] = [before, frame].map(|frame| simulation.true_pose(frame).position());
            self.score.path += (to - from).norm();
        }
        let truth = simulation.true_pose(0).inverse().compose(&simulation.true_pose(frame));
        self.score.end_error = (report.pose.position().cast::<f64>() - truth.position()).norm();
        Ok(())
    }

    /// A landmark is of the true corner that most of its sightings are nearest to; a sighting elsewhere was wrong.
    fn finish(self) -> Association {
        let mut votes = BTreeMap::<u32, BTreeMap<Option<usize>, usize>>::new();
        for Sighting { near, landmark, .. } in &self.sightings {
            if let Some(landmark) = landmark {
                *votes.entry(*landmark).or_default().entry(near.first().copied()).or_default() += 1;
            }
        }
        let most = |votes: &BTreeMap<_, usize>| {
            votes.iter().max_by_key(|(_, n)| **n).and_then(|(corner, _)| *corner)
        };
        let owners: BTreeMap<u32, Option<usize>> =
            votes.iter().map(|(id, votes)| (*id, most(votes))).collect();
        let owner = |id: u32| owners.get(&id).copied().flatten();
        let mut score = self.score;
        let mut seen = BTreeMap::<usize, usize>::new();
        for Sighting { frame, near, again, landmark, born } in &self.sightings {
            if let Some(id) = landmark.filter(|_| !born) {
                score.updates += 1;
                let right = owner(id).map_or(near.is_empty(), |corner| near.contains(&corner));
                score.wrong += usize::from(!right);
            }
            let Some(corner) = near.first().filter(|_| !again) else { continue };
            *seen.entry(*corner).or_default() += 1;
            let there = |(id, [born, last]): (&u32, &[usize; 2])| {
                owner(*id).is_some_and(|corner| near.contains(&corner)) && born < frame && frame <= last
            };
            if self.lives.iter().any(there) {
                score.expected += 1;
                score.missed += usize::from(landmark.is_none() || *born);
            }
        }
        let landmarks = self.pipeline.filter().landmarks().iter();
        score.landmarks = landmarks.filter(|landmark| landmark.status == Status::Confirmed).count();
        let needed = self.pipeline.config().map.confirm as usize;
        score.seen = seen.values().filter(|count| **count >= needed).count();
        score
    }
}

//! Association in pixels, wired into the pipeline: the paper's, with keyframes.
//!
//! ```text
//! picture → features → matches with the keyframe → homography keyframe → picture      (VisualMotion)
//! corners the keyframe remembers ──► carried by it, with covariance ──► paired with the picture's corners   (10), (11)
//!                                                                         └► named for the map, or refused
//! ```
//!
//! The memory is kept in the keyframe's pixels: a corner seen in a later picture is carried back to it, and when a
//! picture becomes the keyframe all are carried there. A landmark that is predicted takes the corner inside its gate
//! and no other; a corner close to a prediction but outside its gate is refused, neither matched nor born: people's
//! feet on top of a corner look like that. What is not predicted is left to the map.
//!
//! Which homography ([`Carrier`]): in a corridor the free one is mostly a wall's, and misses half of the corners; the
//! floor's misses 0.5 % (`cargo run -p monorange-tests --example dynamic_corridor -- 5 100`).
use super::sightings::Sightings;
use super::{CornerReport, Pipeline, Report, Storage, VisualStep};
use crate::Result;
use crate::association::{
    CHI2_99, Carrier, Corner, PixelMemory, PixelPairing, Remembered, carry_pixel, choose_carrier,
    normalised_square,
};
use crate::geometry::Camera;
use crate::homography::{Homography, PredictedPoint};
use crate::lines::{self, MAX_CORNERS};
use crate::slam::{Decision, Feature, Hint, Landmark, Outcome};

/// Corners that are remembered at most.
const MAX_REMEMBERED: usize = 512;

/// The landmarks' corners in the keyframe, and the homography from there to the picture at hand.
#[derive(Clone, Debug)]
pub(super) struct PixelAssociation {
    carrier: Carrier,
    /// Matches that a homography needs to be trusted.
    least: f32,
    /// χ²(2) of a pair.
    gate: f32,
    /// χ²(2) below which an unpaired corner is refused.
    refusal: f32,
    memory: PixelMemory<f32, MAX_REMEMBERED>,
    homography: Option<Homography<f32>>,
    used: Carrier,
    /// Whether the picture at hand becomes the keyframe.
    new_keyframe: bool,
}

/// What pixels say of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Verdict {
    /// Nothing.
    Unknown,
    /// It is this landmark's.
    Landmark(u32),
    /// It lies beside this landmark's prediction, this far in χ².
    Refused(u32, f32),
}

impl PixelAssociation {
    /// A memory of nothing.
    pub(super) fn new(carrier: Carrier) -> Self {
        Self {
            carrier,
            least: 12.0,
            gate: CHI2_99[1] as f32,
            refusal: 40.0,
            memory: PixelMemory::new(),
            homography: None,
            used: Carrier::Map,
            new_keyframe: true,
        }
    }

    /// Takes what matches with the keyframe gave for the picture at hand; `None` for the first, which is the keyframe.
    pub(super) fn look(&mut self, step: Option<&VisualStep>) {
        let floor = step.and_then(|step| step.motion.as_ref().ok());
        let free = step.and_then(|step| step.free.as_ref());
        let (used, homography) = match self.carrier {
            Carrier::Map => (Carrier::Map, None),
            Carrier::Floor => choose_carrier(floor, free, self.least),
            Carrier::Free => choose_carrier(None, free, self.least),
        };
        (self.used, self.homography) = (used, homography.copied());
        self.new_keyframe = step.is_none_or(|step| step.new_keyframe);
    }

    /// What the homography says of each corner.
    fn verdicts(&self, camera: &Camera<f32>, corners: &[CornerReport], out: &mut [Verdict]) {
        let Some(homography) = &self.homography else { return };
        let seen =
            |corner: &CornerReport| Corner { pixel: corner.pixel, covariance: corner.pixel_covariance };
        let corners: heapless::Vec<_, MAX_CORNERS> = corners.iter().map(seen).collect();
        let mut pairings = heapless::Vec::<PixelPairing<f32>, { crate::association::MAX_CANDIDATES }>::new();
        self.memory.associate(camera, homography, &corners, self.gate, &mut pairings);
        for pairing in &pairings {
            if let Some(verdict) = out.get_mut(pairing.corner) {
                *verdict = Verdict::Landmark(pairing.landmark);
            }
        }
        let predictions = || {
            self.memory.remembered().iter().filter_map(|known| {
                let carried = carry_pixel(camera, homography, known.pixel, &known.covariance)?;
                Some((known.landmark, carried))
            })
        };
        for (corner, verdict) in corners.iter().zip(out).filter(|(_, verdict)| **verdict == Verdict::Unknown)
        {
            for (landmark, PredictedPoint { point, covariance }) in predictions() {
                let distance2 = normalised_square(&(corner.pixel - point), &(covariance + corner.covariance));
                if let Some(distance2) = distance2.filter(|distance2| *distance2 <= self.refusal) {
                    *verdict = Verdict::Refused(landmark, distance2);
                }
            }
        }
    }

    /// Calls the landmarks by their names in another map; those that have none are forgotten.
    fn rename(&mut self, names: &[(u32, u32)]) {
        let name = |own| names.iter().find(|(known, _)| *known == own).map(|(_, name)| *name);
        self.memory.rename(name);
    }

    /// Whether pixels predict this landmark.
    fn predicts(&self, landmark: u32) -> bool {
        self.homography.is_some() && self.memory.remembered().iter().any(|known| known.landmark == landmark)
    }

    /// Remembers whose corners were whose.
    fn learn(&mut self, camera: &Camera<f32>, seen: &[CornerReport], alive: impl Fn(u32) -> bool) {
        match (self.new_keyframe, &self.homography) {
            (true, Some(homography)) => self.memory.carry(camera, homography),
            (true, None) => self.memory = PixelMemory::new(),
            (false, _) => {}
        }
        let back = self.homography.as_ref().and_then(Homography::inverse);
        let taken = [Decision::Update, Decision::Tentative, Decision::Birth];
        for corner in seen.iter().filter(|corner| taken.contains(&corner.outcome.decision)) {
            let (Some(landmark), pixel, covariance) =
                (corner.outcome.landmark, corner.pixel, corner.pixel_covariance)
            else {
                continue;
            };
            let place = match (self.new_keyframe, &back) {
                (true, _) => Some(PredictedPoint { point: pixel, covariance }),
                (false, Some(back)) => carry_pixel(camera, back, pixel, &covariance),
                (false, None) => None,
            };
            if let Some(PredictedPoint { point, covariance }) = place {
                self.memory.remember(Remembered { landmark, pixel: point, covariance });
            }
        }
        self.memory.retain(alive);
    }
}

impl<S: Storage> Pipeline<S> {
    /// Calls the landmarks whose corners are carried by their names in another map.
    pub(super) fn rename_carried(&mut self, names: &[(u32, u32)]) {
        if let Some(pictures) = &mut self.pictures {
            pictures.pixels().rename(names);
        }
    }

    /// As [`observe`](Self::observe), with the help of pixels, which have looked at the picture's motion.
    pub(super) fn observe_carried(
        &mut self,
        time: f64,
        corners: &[lines::Corner],
        report: &mut Report,
    ) -> Result<()> {
        self.moment.begin();
        let mut seen = Sightings::default();
        self.sight_all(corners, &mut seen, &mut report.corners);
        self.advance(time)?;
        self.sway();
        let camera = *self.finder().camera();
        let Some(pictures) = self.pictures.as_deref_mut() else {
            return self.observe_into(time, corners, report);
        };
        let pixels = pictures.pixels();
        let mut verdicts = [Verdict::Unknown; MAX_CORNERS];
        pixels.verdicts(&camera, &report.corners, &mut verdicts);
        // The map sees those that are not refused, each with the name that pixels give it.
        let mut places = heapless::Vec::<usize, MAX_CORNERS>::new();
        let mut features = heapless::Vec::<Feature<f32>, MAX_CORNERS>::new();
        for (index, (feature, verdict)) in seen.features.iter().zip(verdicts).enumerate() {
            let hint = match verdict {
                Verdict::Landmark(id) => Hint::Landmark(id),
                Verdict::Unknown => Hint::Free,
                Verdict::Refused(..) => continue,
            };
            let _ = places.push(index); // of the same capacity
            let _ = features.push(Feature { hint, ..*feature });
        }
        let may_be = |index: usize, landmark: &Landmark<f32>| {
            let Some(place) = places.get(index).copied() else { return false };
            let named = verdicts.get(place).is_some_and(|verdict| *verdict == Verdict::Landmark(landmark.id));
            seen.looks_alike(place, landmark) && (named || !pixels.predicts(landmark.id))
        };
        let mut outcomes = [Outcome::default(); MAX_CORNERS];
        let map = self.map.observe(&features, may_be, &mut outcomes)?;
        for (corner, verdict) in report.corners.iter_mut().zip(verdicts) {
            if let Verdict::Refused(landmark, distance2) = verdict {
                let (decision, landmark, nis) = (Decision::Gated, Some(landmark), Some(distance2));
                corner.outcome = Outcome { decision, landmark, nis, dof: 2, ..Outcome::default() };
            }
        }
        for (place, outcome) in places.iter().zip(outcomes) {
            if let Some(corner) = report.corners.get_mut(*place) {
                corner.outcome = outcome;
            }
        }
        let filter = self.map.filter();
        pixels.learn(&camera, &report.corners, |id| filter.landmark(id).is_some());
        let carried_by = pixels.used;
        self.range_again(report);
        self.report(time, &seen, map, report);
        report.carried_by = carried_by;
        Ok(())
    }
}

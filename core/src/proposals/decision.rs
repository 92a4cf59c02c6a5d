//! Which proposals are corners: of several in one place one.
use super::extraction::{Corner, MAX_CORNERS, MAX_PROPOSALS};
use super::proposal::Proposal;
use super::view::View;
use heapless::Vec;
use nalgebra::Vector2;

/// Proposals nearer than this are one, units.
const SAME_UNITS: f32 = 6.0;
/// Proposals on one upright edge are this near to one another across it, units.
const ACROSS_UNITS: f32 = 5.0;
/// A lower one takes the place of one above it that is likelier by no more than this, in the logarithm of the odds.
const LOWER_ODDS: f32 = 0.5;

/// The likeliest proposals, from the likeliest down.
#[derive(Default)]
pub(super) struct Ranked {
    pub(super) found: Vec<Proposal, MAX_PROPOSALS>,
    pub(super) lost: u32,
}

impl Ranked {
    pub(super) fn add(&mut self, proposal: Proposal) {
        let rank = self.found.iter().take_while(|other| other.probability >= proposal.probability).count();
        if self.found.is_full() {
            self.lost += 1;
            if rank == MAX_PROPOSALS {
                return;
            }
            self.found.truncate(MAX_PROPOSALS - 1);
        }
        let _ = self.found.insert(rank, proposal); // there is room
    }
}

/// The corners among the proposals, which are sorted from the likeliest down and lie at `places` of the picture searched; and how
/// many did not fit.
pub(super) fn corners(
    proposals: &[Proposal],
    places: &[Vector2<f32>],
    view: &View,
    skirting: f32,
    least: f32,
) -> (Vec<Corner, MAX_CORNERS>, u32) {
    let mut out = [false; MAX_PROPOSALS];
    let (mut corners, mut lost) = (Vec::new(), 0);
    let one = view.unit;
    // Whether two places are one corner, or one skirting board's edges.
    let rivals = |a: Vector2<f32>, b: Vector2<f32>| {
        let moved = b - a;
        if moved.norm_squared() < SAME_UNITS * SAME_UNITS * one * one {
            return true;
        }
        let gravity = view.gravity(a);
        let (lower, higher) = if gravity.dot(&moved) > 0.0 { (b, a) } else { (a, b) };
        gravity.perp(&moved).abs() < ACROSS_UNITS * one && view.height(higher, lower) < skirting
    };
    let odds = |p: &Proposal| libm::logf(p.probability.max(1e-6) / (1.0 - p.probability).max(1e-6));
    let ranked = || proposals.iter().zip(places).enumerate();
    for (k, (proposal, place)) in ranked() {
        if out.get(k).is_none_or(|out| *out) || proposal.probability < least {
            continue;
        }
        let gravity = view.gravity(*place);
        let lower = ranked().filter(|(j, (other, there))| {
            let free = out.get(*j).is_some_and(|out| !out);
            free && gravity.dot(&(*there - place)) > 0.0
                && odds(other) >= odds(proposal) - LOWER_ODDS
                && rivals(*place, **there)
        });
        let lowest = lower.max_by(|a, b| a.1.1.y.total_cmp(&b.1.1.y));
        let (chosen, at) = lowest.map_or((proposal, place), |(_, (other, there))| (other, there));
        for (j, (_, there)) in ranked() {
            if (rivals(*place, *there) || rivals(*at, *there))
                && let Some(out) = out.get_mut(j)
            {
                *out = true;
            }
        }
        let corner = Corner {
            pixel: chosen.pixel,
            covariance: chosen.covariance,
            probability: chosen.probability,
            brighter_right: chosen.brighter_right,
            brighter_below: chosen.brighter_below,
        };
        lost += u32::from(corners.push(corner).is_err());
    }
    (corners, lost)
}

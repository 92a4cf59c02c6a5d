//! RANSAC with local optimisation, then the maximum likelihood and its covariance.
use super::estimate::matrix_of;
use super::matches::Normalisation;
use super::normal_equations::Mixture;
use super::refine::{Effort, Family, Free, Refined, refine, step, variance_factor};
use super::sample::{Sampler, homography_of_four};
use super::{Homography, Match, NoHomography};
use crate::Real;
use crate::sort::sort_by_key;
use nalgebra::{Matrix3, SMatrix, Vector2};

/// Settings of [`estimate_homography`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomographyConfig<T> {
    /// Chance of having drawn at least one sample without a wrong match when the search stops.
    pub confidence: T,
    /// Samples drawn at most.
    pub max_samples: u32,
    /// Seed of the samples: the same seed and matches give the same bits.
    pub seed: u64,
    /// Whether to estimate the noise's variance factor from the residuals and to scale Σ_M with it, for
    /// detectors whose covariances are only right up to a factor.
    pub scale_noise: bool,
}

impl<T: Real> Default for HomographyConfig<T> {
    fn default() -> Self {
        Self { confidence: T::lit(0.99), max_samples: 2000, seed: 1, scale_noise: false }
    }
}

/// A homography estimated from matches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomographyEstimate<T> {
    /// M and Σ_M in the coordinates of the matches.
    pub homography: Homography<T>,
    /// Expected number of right matches, the sum of the posteriors.
    pub inliers: T,
    /// Weighted squared residuals per degree of freedom: 1 when the matches' covariances are right.
    pub variance_factor: T,
    /// Samples drawn.
    pub samples: u32,
}

/// The homography that most of the matches agree with, with its covariance; `posteriors` receives each match's
/// probability of being right.
///
/// # Errors
/// [`NoHomography`], every variant; the posteriors are then all zero.
///
/// ```
/// use monorange_core::homography::{HomographyConfig, Match, estimate_homography};
/// use nalgebra::Vector2;
/// let mut matches = [Match::new(Vector2::zeros(), Vector2::zeros(), 0.1_f64, 0.1); 20];
/// for (i, pair) in matches.iter_mut().enumerate() {
///     pair.from = Vector2::new((37 * i % 100) as f64, (61 * i % 100) as f64);
///     pair.to = pair.from + Vector2::new(5.0, -2.0);
/// }
/// let mut posteriors = [0.0; 20];
/// let found = estimate_homography(&HomographyConfig::default(), &matches, &mut posteriors)?;
/// let m = found.homography.matrix();
/// assert!((m.m13 / m.m33 - 5.0).abs() < 1e-9 && posteriors[7] > 0.99);
/// # Ok::<(), monorange_core::homography::NoHomography>(())
/// ```
pub fn estimate_homography<T: Real>(
    config: &HomographyConfig<T>,
    matches: &[Match<T>],
    posteriors: &mut [T],
) -> Result<HomographyEstimate<T>, NoHomography> {
    posteriors.fill(T::zero());
    let problem = Problem::new(matches, posteriors.len())?;
    let (matrix, samples) = problem.search(config)?;
    // From the core outwards the noise grows by half in a step at most, and settles slowly.
    let iterations = if config.scale_noise { 40 } else { 10 };
    let effort = Effort { iterations, scale_noise: config.scale_noise };
    let keep = |index: usize, weight| {
        if let Some(posterior) = posteriors.get_mut(index) {
            *posterior = weight;
        }
    };
    let start = Free::new(problem.to.matrix() * matrix * problem.from.inverse());
    let outcome = refine(start, matches, problem.mixture(T::lit(0.5), T::one()), effort, keep)
        .ok_or(NoHomography::Degenerate)
        .and_then(|refined| problem.conclude(&refined, samples));
    if outcome.is_err() {
        posteriors.fill(T::zero());
    }
    outcome
}

/// Matches that fit to be tried: enough, finite, spread over the pictures.
pub(super) struct Problem<'a, T> {
    pub(super) matches: &'a [Match<T>],
    from: Normalisation<T>,
    to: Normalisation<T>,
    /// What wrong matches spread over, in units of `to` squared.
    area: T,
    /// Mean variances of `from` and `to`.
    variances: (T, T),
}

/// Matches that a model is tried on before the rest.
const PREVIEW: usize = 64;

impl<'a, T: Real> Problem<'a, T> {
    pub(super) fn new(matches: &'a [Match<T>], room: usize) -> Result<Self, NoHomography> {
        if room < matches.len() {
            return Err(NoHomography::TooFewPosteriors);
        }
        if matches.len() < 4 {
            return Err(NoHomography::TooFewMatches);
        }
        if !matches.iter().all(Match::is_finite) {
            return Err(NoHomography::NotFinite);
        }
        let from = Normalisation::of(matches.iter().map(|m| m.from)).ok_or(NoHomography::Degenerate)?;
        let to = Normalisation::of(matches.iter().map(|m| m.to)).ok_or(NoHomography::Degenerate)?;
        let count = T::lit(matches.len() as f64);
        let (mut var_from, mut var_to) = (T::zero(), T::zero());
        let (mut low, mut high) = (to.centre, to.centre);
        for pair in matches {
            let variances = pair.variances();
            var_from += variances.0;
            var_to += variances.1;
            low = low.inf(&pair.to);
            high = high.sup(&pair.to);
        }
        let variances = (var_from / count, var_to / count);
        let extent = high - low;
        let noise = (variances.0 + variances.1) * T::lit(400.0);
        let area = (extent.x * extent.y).max(noise);
        Ok(Self { matches, from, to, area, variances })
    }

    fn mixture(&self, share: T, variance_factor: T) -> Mixture<T> {
        let area = self.area * self.to.scale * self.to.scale;
        Mixture { from: self.from, to: self.to, share, area, variance_factor }
    }

    /// The best sample's matrix, locally optimised, and the number of samples drawn.
    fn search(&self, config: &HomographyConfig<T>) -> Result<(Matrix3<T>, u32), NoHomography> {
        let mut sampler = Sampler::new(config.seed);
        let count = self.matches.len();
        let miss = (T::one() - config.confidence).max(T::lit(1e-9)).ln();
        let (mut best, mut best_score) = (None, T::zero());
        let mut best_preview = T::zero();
        let (mut drawn, mut needed) = (0, config.max_samples);
        while drawn < needed {
            drawn += 1;
            let Some(matrix) = self.sample(&mut sampler, count).and_then(|four| homography_of_four(&four))
            else {
                continue;
            };
            let scorer = self.scorer(&matrix);
            let stride = count.div_ceil(PREVIEW);
            let preview = scorer.score(self.matches, stride);
            // A sample of right matches has about the best one's share of support in any part.
            if stride > 1 && preview < best_preview * T::lit(0.5) {
                continue;
            }
            let score = if stride > 1 { scorer.score(self.matches, 1) } else { preview };
            // Where the noise is not known a sample's own score says less: one that comes near is optimised, too.
            let near = if config.scale_noise { best_score * T::lit(0.7) } else { best_score };
            let promising = score > near;
            if !promising {
                continue;
            }
            let (matrix, score) = self.optimise(matrix, score);
            let better = score > best_score;
            if !better {
                continue;
            }
            let scorer = self.scorer(&matrix);
            (best, best_score, best_preview) = (Some(matrix), score, scorer.score(self.matches, stride));
            let share = scorer.support(self.matches) / T::lit(count as f64);
            let hit = (share * share * share * share).max(T::lit(1e-9)).min(T::lit(0.999));
            let enough = miss / (-hit).ln_1p();
            let limit = T::lit(f64::from(config.max_samples));
            needed = if enough < limit { enough.to_f64() as u32 + 1 } else { config.max_samples };
        }
        best.map(|matrix| (matrix, drawn)).ok_or(NoHomography::Degenerate)
    }

    fn sample(&self, sampler: &mut Sampler, count: usize) -> Option<[Match<T>; 4]> {
        let [a, b, c, d] = sampler.four(count);
        let at = |index: usize| self.matches.get(index).copied();
        Some([at(a)?, at(b)?, at(c)?, at(d)?])
    }

    /// A sample's homography leans on four noisy points: refined with the noise first taken for larger, so that
    /// all of its plane's matches have their say.
    fn optimise(&self, matrix: Matrix3<T>, score: T) -> (Matrix3<T>, T) {
        let (to_normal, from_normal) = (self.to.matrix(), self.from.inverse());
        let (from_pixel, to_pixel) = (self.from.matrix(), self.to.inverse());
        let mut model = Free::new(to_normal * matrix * from_normal);
        for inflation in [25.0, 4.0] {
            let mixture = self.mixture(T::lit(0.5), T::lit(inflation));
            let Some(moved) = step(&model, self.matches, &mixture) else { break };
            model = moved;
        }
        let optimised = to_pixel * model.matrix() * from_pixel;
        let improved = self.scorer(&optimised).score(self.matches, 1);
        if improved > score { (optimised, improved) } else { (matrix, score) }
    }

    fn scorer(&self, matrix: &Matrix3<T>) -> Scorer<T> {
        // One variance for all matches: the mean ones, with M's magnification at the centre of the picture.
        let centre = matrix * self.from.centre.push(T::one());
        let third = centre.z.max(T::default_epsilon());
        let magnification2 = (matrix.determinant() / (third * third * third)).abs();
        let variance = self.variances.1 + self.variances.0 * magnification2;
        let log_odds = (self.area / (T::two_pi() * variance)).ln();
        // An M that magnifies the noise to the size of the picture explains any match, and so none.
        let log_odds = if log_odds > T::lit(3.0) { log_odds } else { T::zero() };
        Scorer { matrix: *matrix, log_odds, half_information: T::lit(0.5) / variance }
    }

    fn conclude(
        &self,
        refined: &Refined<T, Free<T>, 8>,
        samples: u32,
    ) -> Result<HomographyEstimate<T>, NoHomography> {
        let inliers = refined.sums.mass;
        if !self.meaningful(inliers, T::one()) {
            return Err(NoHomography::NoConsensus);
        }
        let tangent = refined.model.tangent();
        let inverse = refined.information.cholesky().ok_or(NoHomography::Degenerate)?.inverse();
        let covariance: SMatrix<T, 9, 9> = tangent * inverse * tangent.transpose();
        let homography = Homography::new(refined.model.matrix(), covariance)
            .and_then(|normal| normal.sandwiched(&self.to.inverse(), &self.from.matrix()))
            .ok_or(NoHomography::Degenerate)?;
        // The refinement absorbed a factor into the covariances only when it was asked to.
        let variance_factor = refined.mixture.variance_factor * variance_factor::<T, 8>(&refined.sums);
        Ok(HomographyEstimate { homography, inliers, variance_factor, samples })
    }

    pub(super) fn meaningful(&self, inliers: T, variance_factor: T) -> bool {
        meaningful(self.matches.len(), inliers, 4, self.gate_share(variance_factor))
    }

    /// Squared radius of a match's gate, which 99 % of the right ones lie in.
    pub(super) fn gate2(&self, variance_factor: T) -> T {
        T::lit(9.21) * (self.variances.0 + self.variances.1) * variance_factor
    }

    /// Share of the picture's area within a match's gate.
    pub(super) fn gate_share(&self, variance_factor: T) -> T {
        T::pi() * self.gate2(variance_factor) / self.area
    }
}

/// Whether chance would rarely give so many right ones among `count` matches: the a-contrario test of Moisan &
/// Stival (2004). When all are but a sample there is nothing to test.
pub(super) fn meaningful<T: Real>(count: usize, inliers: T, sample: usize, gate_share: T) -> bool {
    let right = ((inliers + T::lit(0.5)).to_f64() as usize).min(count);
    let enough = right >= sample;
    enough && (count == sample || ln_false_alarms(count, right, sample, gate_share) < T::zero())
}

/// The logarithm of the expected false alarms (n − s) C(n, k) C(k, s) p^(k−s), with p the share of the area within a
/// match's gate and s the size of a sample, below n; k is at least s and at most n.
pub(super) fn ln_false_alarms<T: Real>(n: usize, k: usize, sample: usize, gate_share: T) -> T {
    let chance = gate_share.min(T::lit(0.5)).ln();
    let ln_choose = |n: usize, k: usize| {
        (0..k.min(n - k)).fold(T::zero(), |sum, i| sum + T::lit((n - i) as f64 / (i + 1) as f64).ln())
    };
    let tests = T::lit((n - sample) as f64).ln() + ln_choose(n, k) + ln_choose(k, sample);
    tests + chance * T::lit((k - sample) as f64)
}

/// The mixture's score in pixels with one variance, for thousands of models.
struct Scorer<T> {
    matrix: Matrix3<T>,
    log_odds: T,
    half_information: T,
}

impl<T: Real> Scorer<T> {
    /// Σ of a match's log-likelihood ratio, ln(1 + e^t) as max(t, 0): the two differ by at most ln 2, where t = 0.
    fn score(&self, matches: &[Match<T>], stride: usize) -> T {
        let log_odds = |pair: &Match<T>| self.log_odds - self.distance2(pair) * self.half_information;
        matches.iter().step_by(stride).fold(T::zero(), |score, pair| score + log_odds(pair).max(T::zero()))
    }

    fn support(&self, matches: &[Match<T>]) -> T {
        // 99 % of the right matches, and few of those beside the plane, which no sample of right ones explains.
        let limit = self.log_odds.min(T::lit(4.605)) / self.half_information;
        let supports = |pair: &&Match<T>| self.distance2(pair) < limit;
        T::lit(matches.iter().filter(supports).count() as f64)
    }

    #[inline]
    fn distance2(&self, pair: &Match<T>) -> T {
        let m = &self.matrix;
        let (x, y) = (pair.from.x, pair.from.y);
        let third = m.m31 * x + m.m32 * y + m.m33;
        // Not in front: as far away as can be.
        let scale = if third > T::zero() { T::one() / third } else { T::lit(1e9) };
        let du = (m.m11 * x + m.m12 * y + m.m13) * scale - pair.to.x;
        let dv = (m.m21 * x + m.m22 * y + m.m23) * scale - pair.to.y;
        du * du + dv * dv
    }
}

/// The normalised direct linear transform of all matches alike: the algebraic error's least squares, for matches
/// that are all right.
///
/// # Errors
/// [`NoHomography::TooFewMatches`], [`NoHomography::NotFinite`], [`NoHomography::Degenerate`].
pub fn direct_linear_transform<T: Real>(matches: &[Match<T>]) -> Result<Matrix3<T>, NoHomography> {
    let problem = Problem::new(matches, matches.len())?;
    let mut scatter = SMatrix::<T, 9, 9>::zeros();
    for pair in matches {
        let p = problem.from.apply(pair.from).push(T::one());
        let q: Vector2<T> = problem.to.apply(pair.to);
        // Rows (p, 0, −u p) and (0, p, −v p) of A; their outer products have blocks of p pᵀ.
        let outer = p * p.transpose();
        let mut add = |row: usize, column: usize, factor: T| {
            let mut block = scatter.fixed_view_mut::<3, 3>(3 * row, 3 * column);
            block += outer * factor;
        };
        add(0, 0, T::one());
        add(1, 1, T::one());
        add(0, 2, -q.x);
        add(2, 0, -q.x);
        add(1, 2, -q.y);
        add(2, 1, -q.y);
        add(2, 2, q.norm_squared());
    }
    let eigen = scatter.symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    let mut values: [T; 9] = eigen.eigenvalues.into();
    sort_by_key(&mut values, |value| *value);
    let [_, second, .., largest] = values;
    // A second null direction: points on a line, or too few different ones.
    let determined = second > largest * T::default_epsilon() * T::lit(64.0);
    if !determined {
        return Err(NoHomography::Degenerate);
    }
    let vector = eigen.eigenvectors.column(smallest).into_owned();
    let matrix = problem.to.inverse() * matrix_of(&vector) * problem.from.matrix();
    let third = matrix * problem.from.centre.push(T::one());
    let matrix = if third.z < T::zero() { -matrix } else { matrix };
    Ok(matrix / matrix.norm())
}

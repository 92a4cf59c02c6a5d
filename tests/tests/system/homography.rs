//! The homography's covariance against the scatter that it predicts, over thousands of seeded problems.
use monorange_core::Real;
use monorange_core::homography::{
    Homography, HomographyConfig, HomographyEstimate, Match, direct_linear_transform, estimate_homography,
};
use monorange_tests::Noise;
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2};
use std::fmt::Write;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 480.0;

fn carry(m: &Matrix3<f64>, p: Vector2<f64>) -> Vector2<f64> {
    let q = m * p.push(1.0);
    q.xy() / q.z
}

fn corners() -> [Vector2<f64>; 4] {
    [[0.0, 0.0], [WIDTH, 0.0], [WIDTH, HEIGHT], [0.0, HEIGHT]].map(Vector2::from)
}

/// Corner shifts of ±12 %, rotation ±0.5 rad, scale 0.75–1.2 about the centre.
fn random_homography(noise: &mut Noise) -> Matrix3<f64> {
    let (angle, scale) = (noise.uniform(-0.5, 0.5), noise.uniform(0.75, 1.2));
    let turn = Matrix2::new(angle.cos(), -angle.sin(), angle.sin(), angle.cos()) * scale;
    let centre = Vector2::new(WIDTH / 2.0, HEIGHT / 2.0);
    let pairs = corners().map(|corner| {
        let shift = Vector2::new(noise.uniform(-0.12, 0.12) * WIDTH, noise.uniform(-0.12, 0.12) * HEIGHT);
        Match::new(corner, turn * (corner + shift - centre) + centre, 1.0, 1.0)
    });
    direct_linear_transform(&pairs).expect("four corners")
}

struct Problem {
    truth: Matrix3<f64>,
    sigma: f64,
    matches: Vec<Match<f64>>,
}

fn problem(noise: &mut Noise, right: usize, wrong: usize, sigma: f64) -> Problem {
    let truth = random_homography(noise);
    let point = |noise: &mut Noise| Vector2::new(noise.uniform(0.0, WIDTH), noise.uniform(0.0, HEIGHT));
    let jitter = |noise: &mut Noise| Vector2::new(noise.normal() * sigma, noise.normal() * sigma);
    let mut matches = Vec::new();
    for i in 0..right + wrong {
        let from = point(noise);
        let to = if i < right { carry(&truth, from) } else { point(noise) };
        let var = sigma * sigma;
        matches.push(Match::new(from + jitter(noise), to + jitter(noise), var, var));
    }
    Problem { truth, sigma, matches }
}

fn narrowed<T: Real>(pair: &Match<f64>) -> Match<T> {
    let point = |p: Vector2<f64>| p.map(T::lit);
    Match::new(point(pair.from), point(pair.to), T::lit(pair.from_cov.m11), T::lit(pair.to_cov.m11))
}

fn solve<T: Real>(problem: &Problem) -> (HomographyEstimate<T>, Vec<T>) {
    let matches: Vec<Match<T>> = problem.matches.iter().map(narrowed).collect();
    let mut posteriors = vec![T::zero(); matches.len()];
    let found = estimate_homography(&HomographyConfig::default(), &matches, &mut posteriors);
    (
        found.unwrap_or_else(|e| panic!("{e} {} {} {}", problem.sigma, problem.truth, matches.len())),
        posteriors,
    )
}

/// eᵀ Σ⁻¹ e in the eight coordinates of the picture's corners carried over: the same number, to first order, as
/// over the tangent space of M.
fn nees<T: Real>(found: &Homography<T>, truth: &Matrix3<f64>) -> f64 {
    let matrix = found.matrix().map(Real::to_f64);
    let covariance = found.covariance().map(Real::to_f64);
    let wide = Homography::new(matrix, covariance).expect("finite");
    let (mut error, mut jacobian) = (SVector::<f64, 8>::zeros(), SMatrix::<f64, 8, 9>::zeros());
    for (i, corner) in corners().into_iter().enumerate() {
        error.fixed_rows_mut::<2>(2 * i).copy_from(&(carry(&matrix, corner) - carry(truth, corner)));
        let by_matrix = wide.by_matrix(corner).expect("in front");
        jacobian.fixed_rows_mut::<2>(2 * i).copy_from(&by_matrix);
    }
    let spread = jacobian * covariance * jacobian.transpose();
    error.dot(&spread.cholesky().expect("rank 8").solve(&error))
}

/// Error of one fresh point carried over, against its predicted covariance.
fn point_nees<T: Real>(found: &Homography<T>, problem: &Problem, noise: &mut Noise) -> f64 {
    let point = Vector2::new(noise.uniform(0.0, WIDTH), noise.uniform(0.0, HEIGHT));
    let measured = point + Vector2::new(noise.normal(), noise.normal()) * problem.sigma;
    let covariance = Matrix2::identity() * T::lit(problem.sigma * problem.sigma);
    let predicted = found.predict(measured.map(T::lit), &covariance).expect("in front");
    let error = predicted.point.map(Real::to_f64) - carry(&problem.truth, point);
    let spread = predicted.covariance.map(Real::to_f64);
    error.dot(&spread.cholesky().expect("positive").solve(&error))
}

#[test]
fn covariance_is_consistent_over_noise_outliers_and_scalars() {
    let mut table = String::from("scalar right wrong sigma_px  NEES(8)  point NEES(2)\n");
    let cases = [(100, 0), (100, 100), (30, 10), (300, 150)];
    for scalar in ["f64", "f32"] {
        let (mut all, mut all_points, mut problems) = (0.0, 0.0, 0);
        for (case, (right, wrong)) in cases.into_iter().enumerate() {
            for (level, sigma) in [0.3, 0.7, 1.5].into_iter().enumerate() {
                let trials = 200;
                let (mut sum, mut sum_points) = (0.0, 0.0);
                for trial in 0..trials {
                    let mut noise = Noise::new((case * 30_000 + level * 10_000 + trial) as u64);
                    let problem = problem(&mut noise, right, wrong, sigma);
                    let (matrix, point) = if scalar == "f64" {
                        let found = solve::<f64>(&problem).0.homography;
                        (nees(&found, &problem.truth), point_nees(&found, &problem, &mut noise))
                    } else {
                        let found = solve::<f32>(&problem).0.homography;
                        (nees(&found, &problem.truth), point_nees(&found, &problem, &mut noise))
                    };
                    sum += matrix;
                    sum_points += point;
                }
                (all, all_points, problems) = (all + sum, all_points + sum_points, problems + trials);
                let (mean, mean_points) = (sum / trials as f64, sum_points / trials as f64);
                writeln!(table, "{scalar} {right:9} {wrong:5} {sigma:8} {mean:8.2} {mean_points:14.2}")
                    .expect("a string");
            }
        }
        let (mean, mean_points) = (all / problems as f64, all_points / problems as f64);
        writeln!(table, "{scalar} all {problems:23} {mean:5.2} {mean_points:14.2}").expect("a string");
        assert!((7.5..8.5).contains(&mean), "NEES {mean}\n{table}");
        assert!((1.8..2.2).contains(&mean_points), "point NEES {mean_points}\n{table}");
    }
    insta::assert_snapshot!("homography_nees", table);
}

#[test]
fn noise_that_is_not_as_stated_is_estimated() {
    let mut table = String::from("noise/stated  NEES(8)  variance factor\n");
    // Noise twice as large as stated is found, but not its effect on the covariance to the last eighth.
    for (ratio, highest) in [(0.5, 8.5), (1.0, 8.5), (2.0, 9.2)] {
        let (mut sum, mut factor, trials) = (0.0, 0.0, 400);
        for trial in 0..trials {
            let mut noise = Noise::new(700_000 + trial);
            let mut problem = problem(&mut noise, 100, 50, 0.5);
            for pair in &mut problem.matches {
                (pair.from_cov, pair.to_cov) =
                    (pair.from_cov / (ratio * ratio), pair.to_cov / (ratio * ratio));
            }
            let config = HomographyConfig { scale_noise: true, ..HomographyConfig::default() };
            let mut posteriors = vec![0.0; problem.matches.len()];
            let found =
                estimate_homography(&config, &problem.matches, &mut posteriors).expect("half are right");
            sum += nees(&found.homography, &problem.truth);
            factor += found.variance_factor / (ratio * ratio);
        }
        let (mean, factor) = (sum / trials as f64, factor / trials as f64);
        writeln!(table, "{ratio:12} {mean:8.2} {factor:10.3}").expect("a string");
        assert!((7.5..highest).contains(&mean) && (factor - 1.0).abs() < 0.02, "{table}");
    }
    println!("{table}");
}

#[test]
fn four_to_eight_matches_give_an_honest_covariance() {
    let mut table = String::from("matches  NEES(8)  solved of 400\n");
    for count in 4..=8 {
        let (mut sum, mut solved) = (0.0, 0);
        for trial in 0..400 {
            let mut noise = Noise::new(900_000 + 1000 * count as u64 + trial);
            let problem = spread_problem(&mut noise, count, 0.5);
            let mut posteriors = vec![0.0; count];
            let config = HomographyConfig::default();
            if let Ok(found) = estimate_homography(&config, &problem.matches, &mut posteriors) {
                sum += nees(&found.homography, &problem.truth);
                solved += 1;
            }
        }
        let mean = sum / f64::from(solved);
        writeln!(table, "{count:7} {mean:8.2} {solved:8}").expect("a string");
        assert!(solved >= 390 && (7.2..8.8).contains(&mean), "{table}");
    }
    insta::assert_snapshot!("homography_few_matches", table);
}

/// Points near the corners and the middles of the sides: few, but well spread.
fn spread_problem(noise: &mut Noise, count: usize, sigma: f64) -> Problem {
    let places =
        [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9], [0.5, 0.1], [0.5, 0.9], [0.1, 0.5], [0.9, 0.5]];
    let truth = random_homography(noise);
    let jitter = |noise: &mut Noise| Vector2::new(noise.normal() * sigma, noise.normal() * sigma);
    let matches = places.iter().take(count).map(|[x, y]| {
        let from =
            Vector2::new(x * WIDTH + noise.uniform(-40.0, 40.0), y * HEIGHT + noise.uniform(-40.0, 40.0));
        let to = carry(&truth, from);
        Match::new(from + jitter(noise), to + jitter(noise), sigma * sigma, sigma * sigma)
    });
    let matches = matches.collect();
    Problem { truth, sigma, matches }
}

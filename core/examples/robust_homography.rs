//! Times the robust homography with its covariance on problems of 300 matches.
//!
//! `cargo run --release -p monorange-core --example robust_homography -- MATCHES.txt` reads lines `ua va ub vb`,
//! 300 a problem, so that another library can be timed on the same numbers.
use monorange_core::Real;
use monorange_core::homography::{HomographyConfig, Match, estimate_homography};
use nalgebra::Vector2;
use std::time::Instant;

const MATCHES: usize = 300;
const VARIANCE: f64 = 0.35 * 0.35;

fn time<T: Real>(numbers: &[f64]) -> f64 {
    let matches: Vec<Match<T>> = numbers
        .chunks_exact(4)
        .map(|row| {
            let [ua, va, ub, vb] = [row[0], row[1], row[2], row[3]].map(T::lit);
            let variance = T::lit(VARIANCE);
            Match::new(Vector2::new(ua, va), Vector2::new(ub, vb), variance, variance)
        })
        .collect();
    let problems = matches.len() / MATCHES;
    let mut posteriors = vec![T::zero(); MATCHES];
    let config = HomographyConfig::default();
    let mut fastest = f64::INFINITY;
    let (mut solved, mut samples) = (0, 0);
    for _ in 0..20 {
        let start = Instant::now();
        (solved, samples) = (0, 0);
        for problem in matches.chunks_exact(MATCHES) {
            if let Ok(found) = estimate_homography(&config, problem, &mut posteriors) {
                solved += 1;
                samples += found.samples;
            }
        }
        fastest = fastest.min(start.elapsed().as_secs_f64() / problems as f64);
    }
    println!("solved {solved} of {problems}, {:.1} samples each", f64::from(samples) / f64::from(solved));
    fastest * 1e3
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give a file of matches, lines of ua va ub vb")?;
    let text = std::fs::read_to_string(path)?;
    let numbers = text.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    println!("f32: {:.3} ms a problem, fastest of 20 runs", time::<f32>(&numbers));
    println!("f64: {:.3} ms a problem, fastest of 20 runs", time::<f64>(&numbers));
    Ok(())
}

//! Times the robust homography with its covariance on problems of 300 matches, half a pixel of noise in each picture.
//!
//! `cargo run --release -p monorange-tests --example robust_homography -- MATCHES.txt [OUT]` reads lines `ua va ub vb`,
//! 300 a problem, so that another library can be timed on the same numbers (`tests/peers/features.py robust`). Prints
//! a line for each scalar: name, least milliseconds a problem, problems solved, mean number of samples; writes the
//! matrices to `OUT.f32` and `OUT.f64`, nine numbers a line.
use monorange_core::Real;
use monorange_core::homography::{HomographyConfig, Match, estimate_homography};
use nalgebra::{Matrix3, Vector2};
use std::error::Error;
use std::fmt::Write;
use std::time::Instant;

const MATCHES: usize = 300;
const VARIANCE: f64 = 0.5 * 0.5;
const REPEATS: usize = 20;

fn run<T: Real>(name: &str, numbers: &[f64], out: Option<&String>) -> Result<(), Box<dyn Error>> {
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
    let mut found = Vec::new();
    for _ in 0..REPEATS {
        found.clear();
        let start = Instant::now();
        for problem in matches.chunks_exact(MATCHES) {
            found.push(estimate_homography(&config, problem, &mut posteriors));
        }
        fastest = fastest.min(start.elapsed().as_secs_f64() * 1e3 / problems as f64);
    }
    let solved = found.iter().flatten().count();
    let samples: u32 = found.iter().flatten().map(|found| found.samples).sum();
    println!("{name} {fastest:.4} {solved} {:.1}", f64::from(samples) / solved as f64);
    if let Some(out) = out {
        let mut text = String::new();
        for found in &found {
            let matrix =
                found.as_ref().map_or_else(|_| Matrix3::zeros(), |f| f.homography.matrix().map(Real::to_f64));
            matrix.transpose().iter().try_for_each(|element| write!(text, "{element} "))?;
            text.push('\n');
        }
        std::fs::write(format!("{out}.{name}"), text)?;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let path = arguments.first().ok_or("give a file of matches, lines of ua va ub vb")?;
    let text = std::fs::read_to_string(path)?;
    let numbers = text.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    run::<f32>("f32", &numbers, arguments.get(1))?;
    run::<f64>("f64", &numbers, arguments.get(1))
}

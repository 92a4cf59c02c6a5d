//! Times the detectors on a binary PGM picture, and writes the keypoints on request:
//! `cargo run --release -p monorange-tests --example features -- PICTURE.pgm [REPEATS [OUT.csv [CONTRAST]]]`.
//!
//! Prints a line for each detector: name, least milliseconds of the repeats, keypoints.
use monorange_core::features::{
    Candidate, Keypoint, Sift, SiftConfig, SiftWork, brief_work_len, detect_brief, detect_fast,
    sift_samples_len,
};
use monorange_core::image::Grey;
use std::error::Error;
use std::fmt::Write;
use std::time::Instant;

/// FAST's threshold in grey levels.
const THRESHOLD: u8 = 20;
const ROOM: usize = 20_000;

/// Width, height and pixels of a binary PGM file with at most 256 greys.
fn parse_pgm(file: &[u8]) -> Option<(usize, usize, &[u8])> {
    let mut rest = file.strip_prefix(b"P5")?;
    let mut numbers = [0; 3];
    for number in &mut numbers {
        loop {
            rest = rest.trim_ascii_start();
            match rest.strip_prefix(b"#") {
                Some(comment) => rest = &comment[comment.iter().position(|&b| b == b'\n')?..],
                None => break,
            }
        }
        let end = rest.iter().position(u8::is_ascii_whitespace)?;
        *number = std::str::from_utf8(&rest[..end]).ok()?.parse().ok()?;
        rest = &rest[end..];
    }
    let [width, height, _] = numbers;
    Some((width, height, rest.get(1..1 + width * height)?))
}

fn least_ms<R>(repeats: usize, mut run: impl FnMut() -> R) -> (f64, R) {
    let mut result = run();
    let mut least = f64::INFINITY;
    for _ in 0..repeats {
        let start = Instant::now();
        result = run();
        least = least.min(start.elapsed().as_secs_f64() * 1e3);
    }
    (least, result)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let path =
        arguments.first().ok_or("which picture? features PICTURE.pgm [REPEATS [OUT.csv [CONTRAST]]]")?;
    let repeats: usize = arguments.get(1).map_or(Ok(10), |n| n.parse())?;
    let file = std::fs::read(path)?;
    let (width, height, pixels) = parse_pgm(&file).ok_or("not a binary PGM picture")?;
    let picture = Grey::new(pixels, width, height)?;

    let mut config = SiftConfig::default();
    if let Some(contrast) = arguments.get(3) {
        config.contrast = contrast.parse()?;
    }
    let sift = Sift::new(config)?;
    let mut samples = vec![0; sift_samples_len(width, height, &config)];
    let mut candidates = vec![Candidate::default(); ROOM];
    let (mut keypoints, mut descriptors) = (vec![Keypoint::default(); ROOM], vec![[0; 128]; ROOM]);
    let (ms, report) = least_ms(repeats, || {
        let mut work = SiftWork { samples: &mut samples, candidates: &mut candidates };
        sift.detect(picture, &mut work, &mut keypoints, &mut descriptors)
    });
    let count = report?.keypoints;
    println!("sift {ms:.3} {count}");

    let mut corners = vec![Keypoint::default(); ROOM];
    let mut rows = vec![0; 3 * width];
    let (ms, report) = least_ms(10 * repeats, || detect_fast(picture, THRESHOLD, &mut rows, &mut corners));
    println!("fast {ms:.4} {}", report?.keypoints);

    let (mut rows, mut bits) = (vec![0; brief_work_len(width)], vec![[0; 8]; ROOM]);
    let (ms, report) =
        least_ms(10 * repeats, || detect_brief(picture, THRESHOLD, &mut rows, &mut corners, &mut bits));
    println!("brief {ms:.4} {}", report?.keypoints);

    if let Some(out) = arguments.get(2).filter(|path| !path.is_empty()) {
        let mut text = String::new();
        for (k, descriptor) in keypoints.iter().zip(&descriptors).take(count) {
            write!(text, "{},{},{},{},{}", k.pixel.x, k.pixel.y, k.scale, k.angle, k.response)?;
            descriptor.iter().try_for_each(|number| write!(text, ",{number}"))?;
            text.push('\n');
        }
        std::fs::write(out, text)?;
    }
    Ok(())
}

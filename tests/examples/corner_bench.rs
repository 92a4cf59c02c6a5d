//! Time of one extraction: `corner_bench PICTURE.pgm [repetitions]` prints the least of many, in milliseconds.
use monorange_core::geometry::{Camera, Mount, RangeFinder};
use monorange_core::image::Grey;
use monorange_core::lines::{EdgePoint, ExtractConfig, Extractor, mask_words, point_count, row_words};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = std::fs::read(arguments.next().ok_or("which picture?")?)?;
    let repetitions: usize = arguments.next().map_or(Ok(300), |text| text.parse())?;
    let (width, height, pixels) = parse_pgm(&file).ok_or("not a binary PGM of 8 bits")?;
    let principal = [width as f32 / 2.0, height as f32 / 2.0];
    let camera = Camera::new(width, height, [width as f32; 2], principal, 0.0, Default::default())?;
    let finder = RangeFinder::new(camera, Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0])?);
    let (words, masks) = (vec![0; row_words(width, height)], vec![0; mask_words(width)]);
    let points = vec![EdgePoint::default(); point_count(width, height)];
    let mut extractor = Extractor::new(ExtractConfig::default(), finder, words, masks, points)?;
    let picture = Grey::new(pixels, width, height)?;
    let mut least = f64::INFINITY;
    for _ in 0..repetitions {
        let start = Instant::now();
        extractor.extract(std::hint::black_box(picture))?;
        least = least.min(start.elapsed().as_secs_f64() * 1e3);
    }
    let found = extractor.finish()?.clone();
    println!(
        "{width}x{height}: {least:.4} ms; {} edge points of {}, {} + {} lines, {} corners, {:?}",
        extractor.edge_points().len(),
        found.edge_points,
        found.vertical_lines.len(),
        found.floor_lines.len(),
        found.corners.len(),
        found.truncations
    );
    Ok(())
}

fn parse_pgm(file: &[u8]) -> Option<(usize, usize, &[u8])> {
    let mut fields = file.splitn(4, |byte| byte.is_ascii_whitespace());
    let mut next = || core::str::from_utf8(fields.next()?).ok();
    let ("P5", width, height) = (next()?, next()?.parse().ok()?, next()?.parse().ok()?) else { return None };
    let pixels = file.get(file.len().checked_sub(width * height)?..)?;
    Some((width, height, pixels))
}

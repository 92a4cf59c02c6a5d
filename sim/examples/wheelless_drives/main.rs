//! Drives without wheels through mixed scenes, and whether the verdict tells the truth about each:
//! `cargo run --release -p monorange-sim --example wheelless_drives -- 1 200`, a line a drive, then the sums. A run is wrong
//! where its mean NEES/3 exceeds 5 or its end is off by more than 5 % of the path, and right where it is not wrong and NEES/3 is
//! below 2. Two hundred drives take a quarter of an hour.
use drive::{course, judge};
use std::error::Error;

mod drive;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default| words.get(at).and_then(|word| word.parse().ok()).unwrap_or(default);
    let (mut all, mut indefinite, mut wrong, mut right) = (0, 0, [0; 2], [0; 2]);
    for seed in number(0, 1)..=number(1, 200) {
        let course = course(seed)?;
        let judged = judge(&course)?;
        let consistent = judged.verdict == monorange_core::slam::Verdict::Consistent;
        println!(
            "{}: {:.1} m, end {:.2} m {:.2} %, NEES/3 {:.2}, in 3σ {:.1} %, {} indefinite, {} not measured, σ of heading up to {:.2}; {}: {}",
            course.title,
            judged.path,
            judged.end_error,
            100.0 * judged.end_error / judged.path,
            judged.nees,
            100.0 * judged.within_3_sigma,
            judged.indefinite,
            judged.unmeasured,
            judged.heading_std,
            judged.verdict.as_str(),
            judged.why
        );
        all += 1;
        indefinite += usize::from(judged.indefinite > 0);
        if judged.is_wrong() {
            wrong = [wrong[0] + 1, wrong[1] + usize::from(consistent)];
        } else if judged.is_right() {
            right = [right[0] + 1, right[1] + usize::from(!consistent)];
        }
    }
    println!(
        "{all} drives: {indefinite} indefinite; {} wrong, {} of them called consistent; {} right, {} of them called otherwise",
        wrong[0], wrong[1], right[0], right[1]
    );
    Ok(())
}

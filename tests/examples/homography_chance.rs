//! How often `match` gives a homography: for pairs of different places, and for pairs that overlap.
//!
//! `cargo run --release -p monorange-tests --example homography_chance [FIRST_SEED]`, an odd number
//!
//! Six simulated corridors, and six that are next to plain, two and two, each picture of one against each of the other:
//! within one corridor the floor's pattern repeats every 3.072 m, and a pattern that is seen twice has an honest homography
//! wherever it lies. Where the real data are, their pictures of different places and their consecutive ones as well.
use monorange_core::features::{FeatureKind, Features};
use monorange_formats::pictures::Picture;
use monorange_sim::Simulation;
use monorange_tests::chance::{Found, corridor, features, homography, kinds, plain_corridor, seen};
use monorange_tests::real_data;
use std::path::Path;

fn main() {
    let first = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1);
    for (name, kind) in kinds() {
        println!("{name}, corridors");
        simulated(name, kind, first, corridor);
        println!("{name}, plain corridors");
        simulated(name, kind, first, plain_corridor);
        real(name, kind);
    }
}

#[derive(Default)]
struct Count {
    /// With a homography that is confirmed.
    accepted: usize,
    /// With one at all.
    found: usize,
    pairs: usize,
}

impl Count {
    fn add(&mut self, a: &Features, b: &Features) {
        self.pairs += 1;
        let found = homography(a, b);
        self.found += usize::from(found != Found::Nothing);
        self.accepted += usize::from(found == Found::Confirmed);
    }

    fn say(&self, name: &str, what: &str) {
        let Self { accepted, found, pairs } = self;
        println!("{name}: {what}: {accepted} of {pairs} accepted; {found} have a homography");
    }
}

fn simulated(name: &str, kind: FeatureKind, first: u64, corridor: fn(u64, usize) -> Simulation) {
    let mut apart = Count::default();
    let mut ahead = [(1, Count::default()), (5, Count::default()), (10, Count::default())];
    for seed in (first..first + 6).step_by(2) {
        let [one, two] = [seed, seed + 1].map(|seed| {
            let drive = corridor(seed, 580);
            let frames = (0..560).step_by(40);
            let there: Vec<_> = frames.clone().map(|frame| seen(&drive, frame, kind)).collect();
            for (frame, a) in frames.zip(&there) {
                for (steps, count) in &mut ahead {
                    let [from, to] = [frame, frame + *steps].map(|frame| drive.true_pose(frame).heading);
                    // Round a corner there is nothing that both show.
                    if (to - from).cos() > 0.966 {
                        count.add(a, &seen(&drive, frame + *steps, kind));
                    }
                }
            }
            there
        });
        for a in &one {
            two.iter().for_each(|b| apart.add(a, b));
        }
    }
    apart.say(name, "different corridors");
    for (steps, count) in ahead {
        let way = format!("{:.1} m on, turned by 15° at most", 0.12 * steps as f64);
        count.say(name, &way);
    }
}

fn real(name: &str, kind: FeatureKind) {
    let folders =
        ["real/cabinet/pictures", "real/corridors", "drives/dev_home/frames", "drives/dev_office/frames"];
    let places: Option<Vec<_>> =
        folders.iter().map(|folder| Some(pictures(&real_data(folder)?, kind))).collect();
    let Some(places) = places else { return };
    let mut apart = Count::default();
    for (index, place) in places.iter().enumerate() {
        for other in places.iter().skip(index + 1) {
            for a in place.iter().step_by(6) {
                other.iter().step_by(6).for_each(|b| apart.add(a, b));
            }
        }
    }
    apart.say(name, "different real and rendered places");
    for (place, what) in [(0, "cabinet, 0.2 m and 8° on"), (2, "home, 0.1 m on"), (3, "office, 0.1 m on")] {
        let mut next = Count::default();
        places[place].windows(2).for_each(|two| next.add(&two[0], &two[1]));
        next.say(name, what);
    }
}

/// The keypoints of a folder's pictures, masks left out.
fn pictures(folder: &Path, kind: FeatureKind) -> Vec<Features> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension != "toml"));
    paths.retain(|path| !path.to_string_lossy().contains("_floor"));
    paths.sort();
    let read = |path: &std::path::PathBuf| {
        let picture = Picture::read(path).expect("a sound picture");
        features(&picture.pixels, [picture.width, picture.height], kind)
    };
    paths.iter().map(read).collect()
}

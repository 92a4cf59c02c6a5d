//! Bearing-only landmarks, started with and without the floor's range: what the paper proposes and did not test.
//!
//! A robot drives 12 m past vertical edges and measures their bearings. Without a range, a landmark starts as an
//! inverse-distance landmark anywhere along its ray; with the virtual range finder it starts there at the range of
//! its foot, r ± r² σ_px/(f h), and only its bearing is used from then on. The third row measures the range every
//! time. Who is who is known, so that nothing but the start differs.
use super::{Figures, Section};
use monorange_core::geometry::{Pose, range_bearing_from_floor};
use monorange_core::slam::{
    Filter, FilterConfig, Increment, Integration, Landmark, Measurement, Observation, Outcome, states_for,
    storage_len,
};
use monorange_formats::{Error, Result};
use monorange_sim::{Random, Stream, default_rig};
use nalgebra::{Matrix2, Matrix3, Vector2};

const RUNS: u64 = 50;
const STEPS: usize = 240;
/// Length of a step in metres, and its duration in seconds.
const STEP: [f64; 2] = [0.05, 0.25];
const EDGES: usize = 16;
const BEARING_STD: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// Of an edge's foot, px.
const PIXEL_STD: f64 = 0.5;
/// Of the wheels: share of the speed, and rad/s.
const WHEELS_STD: [f64; 2] = [0.05, 0.02];
/// Nearest range (m), farthest range (m) and largest bearing (rad) at which an edge is seen.
const VIEW: [f64; 3] = [0.6, 8.0, 0.41];
/// A landmark has converged when its larger standard deviation is below this, m.
const CONVERGED: f64 = 0.1;

/// How landmarks start, and what is measured of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// By the bearing alone.
    Bearing,
    /// By the bearing, and the floor's range once.
    FloorRange,
    /// By range and bearing, every time.
    Both,
}

const STARTS: [(Start, &str); 3] = [
    (Start::Bearing, "bearing alone"),
    (Start::FloorRange, "bearing, floor range once"),
    (Start::Both, "range and bearing always"),
];

/// Figures of many runs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Score {
    /// Sightings until a landmark has converged, mean over those that do.
    pub sightings: f64,
    /// Share of landmarks that converge.
    pub converged: f64,
    /// Root mean square error of a landmark's position at the end, m.
    pub landmark_rms: f64,
    /// Mean NEES of a landmark's position at the end, a degree of freedom.
    pub landmark_nees: f64,
    /// Root mean square position error of the robot, m.
    pub robot_rms: f64,
    /// Mean NEES of the pose at the end, a degree of freedom.
    pub robot_nees: f64,
}

/// Figures of a way to start, over seeded runs.
///
/// # Errors
/// When the filter refuses a measurement, which would be a mistake here.
pub fn score(start: Start, runs: u64) -> Result<Score> {
    let mut sum = Sums::default();
    for seed in 1..=runs {
        run(start, seed, &mut sum).map_err(Error::new)?;
    }
    let mean = |[sum, count]: [f64; 2]| sum / count.max(1.0);
    Ok(Score {
        sightings: mean(sum.sightings),
        converged: mean(sum.converged),
        landmark_rms: mean(sum.landmark_squares).sqrt(),
        landmark_nees: mean(sum.landmark_nees) / 2.0,
        robot_rms: mean(sum.robot_squares).sqrt(),
        robot_nees: mean(sum.robot_nees) / 3.0,
    })
}

/// Sums and counts.
#[derive(Default)]
struct Sums {
    sightings: [f64; 2],
    converged: [f64; 2],
    landmark_squares: [f64; 2],
    landmark_nees: [f64; 2],
    robot_squares: [f64; 2],
    robot_nees: [f64; 2],
}

fn add(sum: &mut [f64; 2], value: f64) {
    *sum = [sum[0] + value, sum[1] + 1.0];
}

fn run(start: Start, seed: u64, sums: &mut Sums) -> monorange_core::Result<()> {
    let mut random = Random::new(seed, Stream::Experiment(1));
    let edges: Vec<_> = (0..EDGES)
        .map(|edge| {
            let side = if edge % 2 == 0 { 1.0 } else { -1.0 };
            Vector2::new(random.within(1.5, 14.0), side * random.within(0.7, 2.5))
        })
        .collect();
    let rig = default_rig()?;
    // Range's derivative by the row, r²/(f h), in metres a pixel at 1 m.
    let metres_by_pixel = PIXEL_STD / (rig.camera().focal().y * rig.mount().height());
    let storage = vec![0.0; storage_len(states_for(2 * EDGES, false))];
    let records = vec![Landmark::default(); EDGES];
    let mut filter =
        Filter::new(storage, records, Pose::default(), Matrix3::identity() * 1e-10, FilterConfig::default())?;
    let mut truth = Pose::<f64>::default();
    let mut seen = [(0_u32, false); EDGES];
    let [metres, seconds] = STEP;
    let speed = metres / seconds;
    let noise =
        Matrix2::from_diagonal(&Vector2::new(WHEELS_STD[0] * speed, WHEELS_STD[1]).map(|std| std * std));
    for step in 1..=STEPS {
        let time = step as f64 * seconds;
        let turn = 0.15 * (0.05 * step as f64).cos();
        truth = truth.compose(&arc(speed * seconds, turn * seconds));
        let v = speed * (1.0 + WHEELS_STD[0] * random.normal());
        let omega = turn + WHEELS_STD[1] * random.normal();
        filter.predict(time, &Increment::from_velocity(v, omega, seconds, &noise, Integration::Arc))?;
        for ((id, edge), (sightings, converged)) in (0_u32..).zip(&edges).zip(&mut seen) {
            let (range, bearing) = range_bearing_from_floor(truth.inverse_transform(*edge));
            let [near, far, half_angle] = VIEW;
            let (noisy, range_std) =
                (bearing + BEARING_STD * random.normal(), metres_by_pixel * range * range);
            let measured_range = range + range_std * random.normal();
            if !(near..far).contains(&range) || bearing.abs() > half_angle {
                continue;
            }
            let variance = BEARING_STD * BEARING_STD;
            let measurement = match start {
                Start::Bearing => Measurement::Bearing { bearing: noisy, variance, range_prior: None },
                Start::FloorRange => {
                    let range_prior = Some((measured_range.max(0.1), range_std));
                    Measurement::Bearing { bearing: noisy, variance, range_prior }
                }
                Start::Both => {
                    Measurement::range_bearing(measured_range.max(0.1), noisy, range_std, BEARING_STD)
                }
            };
            *sightings += 1;
            if *sightings == 1 {
                filter.birth(time, id, &measurement)?;
            } else {
                filter.update(&[Observation { landmark: id, measurement }], &mut [Outcome::default()])?;
                filter.convert(id)?;
            }
            let known = filter.landmark(id).and_then(|landmark| filter.position_covariance(landmark));
            let spread =
                known.map_or(f64::INFINITY, |covariance| covariance.symmetric_eigenvalues().max().sqrt());
            if !*converged && spread < CONVERGED {
                *converged = true;
                add(&mut sums.sightings, f64::from(*sightings));
            }
        }
        add(&mut sums.robot_squares, (filter.pose().position() - truth.position()).norm_squared());
    }
    for ((id, edge), (sightings, converged)) in (0_u32..).zip(&edges).zip(seen) {
        if sightings < 10 {
            continue;
        }
        add(&mut sums.converged, f64::from(u8::from(converged)));
        let Some(landmark) = filter.landmark(id) else { continue };
        let (position, covariance) = (filter.position(landmark), filter.position_covariance(landmark));
        if let (Some(position), Some(inverse)) =
            (position, covariance.and_then(|matrix| matrix.try_inverse()))
        {
            let error = position - edge;
            add(&mut sums.landmark_squares, error.norm_squared());
            add(&mut sums.landmark_nees, error.dot(&(inverse * error)));
        }
    }
    if let Some(nees) = filter.pose_nees(&truth) {
        add(&mut sums.robot_nees, nees);
    }
    Ok(())
}

/// The motion along an arc of so many metres and radians.
fn arc(way: f64, turn: f64) -> Pose<f64> {
    let half = 0.5 * turn;
    let chord = if half.abs() < 1e-9 { way } else { way * half.sin() / half };
    Pose::new(chord * half.cos(), chord * half.sin(), turn)
}

/// The section.
///
/// # Errors
/// As [`score`].
pub fn section() -> Result<Section> {
    let header = [
        "landmarks start by",
        "sightings to 10 cm",
        "that converge %",
        "landmark rms cm",
        "NEES/2",
        "robot rms cm",
        "NEES/3",
    ];
    let mut table =
        Figures::new(format!("{RUNS} runs of 12 m past {EDGES} vertical edges, bearings to 0.5°"), &header);
    for (start, name) in STARTS {
        let score = score(start, RUNS)?;
        table.row([
            name.to_owned(),
            format!("{:.1}", score.sightings),
            format!("{:.1}", 100.0 * score.converged),
            format!("{:.1}", 100.0 * score.landmark_rms),
            format!("{:.2}", score.landmark_nees),
            format!("{:.1}", 100.0 * score.robot_rms),
            format!("{:.2}", score.robot_nees),
        ]);
    }
    Ok(Section {
        name: "bearing-only",
        title: "Bearing-only landmarks with the floor’s range to start from",
        words: vec![
            "A vertical edge gives a bearing; its foot on the floor, seen once, gives the range to start from. Counted are the sightings \
             until a landmark is known to 10 cm, the errors at the end, and whether the filter knows them (NEES a degree of freedom, 1 is \
             right)."
                .to_owned(),
        ],
        tables: vec![table],
        drawings: vec![],
    })
}

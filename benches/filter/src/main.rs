//! One range-and-bearing landmark update, and one prediction, at N landmarks in `f32`: this project's filter beside
//! minikalman, kfilter and numeris, and beside one pass over the packed covariance's memory. Ratios of one run on one
//! machine; an absolute time of another day says nothing.
//!
//! ```sh
//! cargo run --release --manifest-path benches/filter/Cargo.toml
//! ```
//!
//! The peers have dense covariances and Jacobians, which is what they offer: the update costs them O(n³) or n²·m.
//! They hold theirs by value, so the measuring thread has a large stack.
//!
//! An update of the textbook's filter needs two products and two sums an entry of P, the invariant filter's reset as many
//! again, once a frame; the pass over the memory has one product. All of them run with the widest vectors that the
//! processor has (the core's feature `dispatch`; `--no-default-features` leaves it out), and the pass is the fastest of its
//! compilations. "update / pass" says how much longer the update takes, and "reset / pass" what the reset adds to a frame
//! of one landmark; the bits are the same at every width.
//!
//! Measured (Intel Xeon of 2023 with AVX-512, run-time dispatch): 1.7 and 1.4 × the pass for one landmark at N = 100 and 400,
//! of which the reset 0.3 and 0.2; 1.3 and 1.0 × in a frame of four. At N = 20 the pass takes 40 ns, the update 15 to 18 times
//! that: linearisation, gate and the search for the landmark. 8, 53 and 110 times as fast as minikalman, the fastest peer, whose
//! figures change by a fifth at N = 100 and to the half at N = 20 with the code that its loops are compiled next to.
//! With AVX2 alone one landmark takes 1.5 times as long at N = 100, with SSE2 2.3 times.
mod peers;

use monorange_core::geometry::Pose;
use monorange_core::slam::{
    Covariance, Filter, FilterConfig, Increment, Integration, Landmark, Measurement, Observation, Outcome,
    Variant, packed_len, states_for, storage_len,
};
use nalgebra::{Matrix2, Matrix3, Vector2};
use std::hint::black_box;
use std::time::Instant;

/// Microseconds of one call: the least of the batches of 0.3 s, three at the least. The clock is read once a batch, which
/// takes 10 ms: reading it takes as long as a small prediction.
pub(crate) fn time(mut call: impl FnMut()) -> f64 {
    let (mut calls, mut least, mut total, mut batches) = (1_u32, f64::INFINITY, 0.0, 0);
    while total < 0.3 || batches < 3 {
        let start = Instant::now();
        for _ in 0..calls {
            call();
        }
        let seconds = start.elapsed().as_secs_f64();
        if seconds < 0.01 {
            calls *= 2;
        } else {
            (least, total, batches) = (least.min(seconds / f64::from(calls)), total + seconds, batches + 1);
        }
    }
    least * 1e6
}

type HostFilter = Filter<f32, Vec<f32>, Vec<Landmark<f32>>>;

/// A map of so many landmarks, all correlated: the robot drives a circle and finds a landmark at every step.
fn filter(landmarks: usize, variant: Variant, covariance: Covariance) -> HostFilter {
    let storage = vec![0.0; storage_len(states_for(landmarks, false))];
    let config = FilterConfig { variant, covariance, ..FilterConfig::default() };
    let records = vec![Landmark::default(); landmarks];
    let mut filter =
        Filter::new(storage, records, Pose::default(), Matrix3::identity() * 0.01, config).expect("sound");
    for id in 0..landmarks {
        filter
            .predict(id as f64, &along_circle(std::f32::consts::TAU / landmarks as f32))
            .expect("time goes on");
        let (range, bearing) = (3.0 + (id % 7) as f32, (0.1 * id as f32) % 3.0 - 1.5);
        filter
            .birth(id as f64, id as u32, &Measurement::range_bearing(range, bearing, 0.1, 0.03))
            .expect("there is room");
    }
    filter
}

/// A step that turns by so much along a circle of 10 m.
fn along_circle(turn: f32) -> Increment<f32> {
    let noise = Matrix2::from_diagonal(&Vector2::new(1e-4, 1e-5));
    Increment::from_velocity(10.0 * turn, turn, 1.0, &noise, Integration::Arc)
}

/// What is measured of a landmark, half a standard deviation off.
fn sighting(filter: &HostFilter, id: u32) -> Observation<f32> {
    let landmark = filter.landmark(id).expect("born");
    let (robot, point) = (filter.pose(), filter.position(landmark).expect("a point"));
    let (x, y) = (point.x - robot.x, point.y - robot.y);
    let bearing = monorange_core::geometry::wrap_angle(y.atan2(x) - robot.heading);
    let measurement = Measurement::range_bearing(x.hypot(y) + 0.05, bearing + 0.015, 0.1, 0.03);
    Observation { landmark: id, measurement }
}

/// Microseconds of an update by `seen` landmarks of one frame, a landmark; and of a prediction.
fn ours(landmarks: usize, seen: usize, variant: Variant, covariance: Covariance) -> [f64; 2] {
    let fresh = filter(landmarks, variant, covariance);
    let frame: Vec<_> = (0..seen)
        .map(|k| sighting(&fresh, ((landmarks / 4 + k * landmarks / (seen + 1)) % landmarks) as u32))
        .collect();
    let mut outcomes = vec![Outcome::default(); seen];
    let (mut working, mut calls) = (fresh.clone(), 0);
    let update = time(|| {
        working.update(black_box(&frame), &mut outcomes).expect("known landmarks");
        calls += 1;
        // So that P stays of a size that it has on a drive.
        if calls % 1024 == 0 {
            working.clone_from(&fresh);
        }
    });
    let mut working = fresh;
    let (step, mut now) = (along_circle(0.01), working.time());
    let predict = time(|| {
        now += 1.0;
        working.predict(now, black_box(&step)).expect("time goes on");
    });
    black_box(working.pose());
    [update / seen as f64, predict]
}

/// Microseconds to read and write the packed covariance once: the least of what each compilation takes.
fn memory_pass(landmarks: usize) -> f64 {
    let mut packed = vec![1.0_f32; packed_len(states_for(landmarks, false))];
    let factor = black_box(1.000_000_1_f32);
    let scale = |packed: &mut [f32]| packed.iter_mut().for_each(|entry| *entry *= factor);
    let plain = time(|| scale(black_box(&mut packed)));
    #[cfg(all(feature = "dispatch", target_arch = "x86_64"))]
    {
        use fearless_simd::{Level, Simd};
        let level = Level::new();
        let avx2 = level.as_avx2().map(|avx2| {
            time(|| {
                avx2.vectorize(
                    #[inline(always)]
                    || scale(black_box(&mut packed)),
                );
            })
        });
        let avx512 = match level {
            Level::Avx512(avx512) => Some(time(|| {
                avx512.vectorize(
                    #[inline(always)]
                    || scale(black_box(&mut packed)),
                );
            })),
            _ => None,
        };
        return avx2.into_iter().chain(avx512).fold(plain, f64::min);
    }
    #[allow(unreachable_code, reason = "what is left without dispatch")]
    plain
}

fn line<const STATES: usize>() {
    let landmarks = (STATES - 3) / 2;
    let [update, predict] = ours(landmarks, 1, Variant::Invariant, Covariance::Packed);
    let [in_frame, _] = ours(landmarks, 4, Variant::Invariant, Covariance::Packed);
    let [textbook, _] = ours(landmarks, 1, Variant::Textbook, Covariance::Packed);
    let [factored, _] = ours(landmarks, 1, Variant::Invariant, Covariance::Factored);
    let pass = memory_pass(landmarks);
    let peers = [
        ("minikalman", peers::minikalman::<STATES>()),
        ("kfilter", peers::kfilter::<STATES>()),
        ("numeris", peers::numeris::<STATES>()),
    ];
    println!("N = {landmarks} ({STATES} states), µs a landmark update");
    println!(
        "  monorange invariant {update:10.2}   in a frame of 4 {in_frame:.2}   textbook {textbook:.2}   factored {factored:.2}   predict {predict:.3}"
    );
    println!("  pass over P         {pass:10.2}");
    println!(
        "  update / pass       {:10.2}   in a frame of 4 {:.2}   textbook {:.2}   reset / pass {:.2}",
        update / pass,
        in_frame / pass,
        textbook / pass,
        (update - textbook) / pass
    );
    for (name, [peer_update, peer_predict]) in peers {
        println!(
            "  {name:<19} {peer_update:10.2}   {:.0} × ours   predict {peer_predict:.2}",
            peer_update / update
        );
    }
}

fn main() {
    // The peers hold their matrices by value.
    let measure = || {
        line::<43>();
        line::<203>();
        line::<803>();
    };
    let thread = std::thread::Builder::new().stack_size(1 << 30).spawn(measure).expect("a thread");
    thread.join().expect("no peer overflows");
}

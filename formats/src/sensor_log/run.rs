use super::{LogSighting, SensorLog};
use crate::files::{Control, MapPoint, Stamped};
use crate::{Error, Result};
use monorange_core::geometry::Pose;
use monorange_core::slam::{
    Decision, Feature, Filter, FilterConfig, Health, Increment, Landmark, Map, MapConfig, Measurement,
    Observation, Outcome, Reason, RingStart, Status, Verdict, WHEEL_STATES, arc_rotation, states_for,
    storage_len,
};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::collections::BTreeMap;

/// Whether the log's names are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Association {
    /// The column `id` names the landmark.
    Known,
    /// Whose a measurement is, is found in the map.
    #[default]
    Unknown,
}

/// How a log is run.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Whether names are used.
    pub association: Association,
    /// The filter.
    pub filter: FilterConfig<f64>,
    /// The map's upkeep, without names.
    pub map: MapConfig<f64>,
    /// What the sensor reads too much, m.
    pub range_offset: f64,
    /// Metres, where the log gives no variance: a constant, and a fraction of the range.
    pub range_std: [f64; 2],
    /// Radians, where the log gives no variance.
    pub bearing_std: f64,
    /// Of the speed ahead, m/s over a second; it grows with the square root of time.
    pub speed_std: f64,
    /// Of the speed sideways, m/s over a second.
    pub slip_std: f64,
    /// Of the turn rate, rad/s over a second.
    pub turn_std: f64,
    /// What a metre driven adds, as fractions: of the way to the way (m/√m), and of turns to turns (rad/√rad).
    pub growth: [f64; 2],
    /// What the odometry reads wrongly all the time and the filter estimates: shares of the way and of the turn, and the turn that
    /// comes with each metre (rad/m); where all are 0 it is taken to be right on average.
    pub scale_std: [f64; 3],
    /// Where the robot starts.
    pub start: Pose<f64>,
    /// Landmarks there is room for.
    pub landmarks: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            association: Association::default(),
            filter: FilterConfig::default(),
            map: MapConfig::default(),
            range_offset: 0.0,
            range_std: [0.1, 0.0],
            bearing_std: 0.02,
            speed_std: 0.05,
            slip_std: 0.01,
            turn_std: 0.05,
            growth: [0.0; 2],
            scale_std: [0.0; 3],
            start: Pose::default(),
            landmarks: 1000,
        }
    }
}

/// A line of `observations.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObservationRow {
    /// The measurement.
    pub sighting: LogSighting,
    /// Number of the frame: measurements of one time are one.
    pub frame: u32,
    /// What became of it.
    pub outcome: Outcome<f64>,
}

/// What a run gives.
#[derive(Clone, Debug)]
pub struct LogResult {
    /// The robot after every line of odometry and every frame.
    pub trajectory: Vec<Stamped>,
    /// The confirmed landmarks.
    pub map: Vec<MapPoint>,
    /// A line a measurement.
    pub observations: Vec<ObservationRow>,
    /// Whether to believe it.
    pub verdict: Verdict,
    /// What speaks against the filter, where anything does.
    pub reason: Option<Reason>,
    /// The figures behind the verdict.
    pub health: Health<f64>,
    /// Landmarks for which there was no room.
    pub no_room: u32,
    /// Measurements that lie beyond the odometry's ends.
    pub beyond: usize,
}

type HostMap = Map<f64, Vec<f64>, Vec<Landmark<f64>>>;

/// Runs the filter over a log. Measurements beyond the ends of the odometry are left out.
///
/// # Errors
/// When a setting is out of its range, or names are asked for and missing.
pub fn run(log: &SensorLog, settings: &Settings) -> Result<LogResult> {
    let core = |error: monorange_core::Error| Error::new(error);
    // One that is known exactly is a state that hardly moves: the filter wants variances above 0.
    let wheels_std =
        settings.scale_std.iter().any(|std| *std > 0.0).then(|| settings.scale_std.map(|std| std.max(1e-6)));
    let config = FilterConfig { wheels_std, ..settings.filter };
    let states = states_for(settings.landmarks, config.mount_std.is_some())
        + config.wheels_std.map_or(0, |_| WHEEL_STATES);
    let storage = vec![0.0; storage_len(states)];
    let records = vec![Landmark::default(); settings.landmarks];
    let covariance = Matrix3::identity() * 1e-10;
    let filter = Filter::new(storage, records, settings.start, covariance, config).map_err(core)?;
    let map = Map::new(filter, settings.map).map_err(core)?;
    let [begin, end] = log.odometry.range();
    let mut run =
        Run { map, settings, rings: BTreeMap::new(), time: begin, health: Health::default(), no_room: 0 };
    let (mut trajectory, mut observations, mut beyond) = (Vec::new(), Vec::new(), 0);
    let frames = log.sightings.chunk_by(|a, b| a.time == b.time);
    for (frame, seen) in (0_u32..).zip(frames) {
        let Some(time) = seen.first().map(|sighting| sighting.time) else { continue };
        if time < begin || time > end {
            beyond += seen.len(); // no odometry there
            continue;
        }
        for control in log.odometry.between(run.time, time) {
            run.step(&control)?;
            trajectory.push(run.stamped());
        }
        run.time = run.time.max(time);
        let outcomes = match settings.association {
            Association::Known => run.known(seen)?,
            Association::Unknown => run.unknown(seen)?,
        };
        let rows = seen.iter().zip(outcomes);
        observations.extend(rows.map(|(&sighting, outcome)| ObservationRow { sighting, frame, outcome }));
        if trajectory.last().is_some_and(|last| last.time >= run.time) {
            trajectory.pop();
        }
        trajectory.push(run.stamped());
    }
    for control in log.odometry.between(run.time, end) {
        run.step(&control)?;
        trajectory.push(run.stamped());
    }
    let health = if settings.association == Association::Known { run.health } else { *run.map.health() };
    Ok(LogResult {
        trajectory,
        map: run.points(begin),
        observations,
        verdict: health.verdict(),
        reason: health.reason(),
        health,
        no_room: run.no_room,
        beyond,
    })
}

struct Run<'a> {
    map: HostMap,
    settings: &'a Settings,
    rings: BTreeMap<u32, RingStart<f64>>,
    /// Of the log's clock.
    time: f64,
    health: Health<f64>,
    no_room: u32,
}

impl Run<'_> {
    fn step(&mut self, control: &Control) -> Result<()> {
        let Settings { speed_std, slip_std, turn_std, growth, .. } = *self.settings;
        let (dt, turn) = (control.duration, control.turn_rate * control.duration);
        let way = control.velocity * dt;
        let d = arc_rotation(turn) * way;
        let [unknown_way, unknown_turn] = control.unknown.map(|rate| rate * dt * rate * dt);
        let variances = Vector3::new(
            speed_std * speed_std * dt + growth[0] * growth[0] * way.norm() + unknown_way,
            slip_std * slip_std * dt + unknown_way,
            // Of a heading of which nothing is known: uniform over a turn, π²/3.
            turn_std * turn_std * dt + growth[1] * growth[1] * turn.abs() + unknown_turn.min(3.29),
        );
        let covariance = Matrix3::from_diagonal(&variances);
        let increment = Increment { delta: Vector3::new(d.x, d.y, turn), covariance };
        self.time += dt;
        let filter = self.map.filter_mut();
        let (corrected, _) = filter.driven(&increment);
        filter.predict_driven(filter.time() + dt, &increment).map_err(Error::new)?;
        for ring in self.rings.values_mut() {
            ring.predict(&corrected);
        }
        Ok(())
    }

    fn measurement(&self, sighting: &LogSighting) -> Option<Measurement<f64>> {
        let range_variance = |range: f64| {
            let [constant, fraction] = self.settings.range_std;
            sighting.variances[0].unwrap_or(constant * constant + (fraction * range).powi(2))
        };
        let bearing_variance = sighting.variances[1].unwrap_or(self.settings.bearing_std.powi(2));
        let range = sighting.range.map(|range| range - self.settings.range_offset);
        Some(match (range, sighting.bearing) {
            (Some(range), Some(bearing)) => {
                let coupling = sighting.covariance;
                let covariance = Matrix2::new(range_variance(range), coupling, coupling, bearing_variance);
                Measurement::RangeBearing { range, bearing, covariance, by_mount: None }
            }
            (Some(range), None) => Measurement::Range { range, variance: range_variance(range) },
            (None, Some(bearing)) => {
                Measurement::Bearing { bearing, variance: bearing_variance, range_prior: None }
            }
            (None, None) => return None,
        })
    }

    fn known(&mut self, seen: &[LogSighting]) -> Result<Vec<Outcome<f64>>> {
        let mut outcomes = vec![Outcome::default(); seen.len()];
        let (mut places, mut known) = (Vec::new(), Vec::new());
        for (place, sighting) in seen.iter().enumerate() {
            let id = sighting.id.ok_or_else(|| {
                Error::new(format!("the measurement at {} s has no `id`", sighting.time))
                    .help("name every landmark, or use --association unknown")
            })?;
            let Some(measurement) = self.measurement(sighting).filter(|measured| measured.check().is_ok())
            else {
                continue;
            };
            if self.map.filter().landmark(id).is_some() {
                places.push(place);
                known.push(Observation { landmark: id, measurement });
            }
        }
        let mut results = vec![Outcome::default(); known.len()];
        self.map.filter_mut().update(&known, &mut results).map_err(Error::new)?;
        let thresholds = self.map.filter().config().gate_nis;
        for (place, outcome) in places.into_iter().zip(results) {
            outcomes[place] = outcome;
            self.health.note(&outcome, thresholds[outcome.dof.clamp(1, 2) - 1]);
        }
        for Observation { landmark, .. } in known {
            // A bearing's landmark, once it is a point; where the covariance failed there is none left.
            if self.map.filter().landmark(landmark).is_some() {
                self.map.filter_mut().convert(landmark).map_err(Error::new)?;
            }
        }
        let filter = self.map.filter();
        let fresh: Vec<_> = seen
            .iter()
            .enumerate()
            .filter(|(_, sighting)| sighting.id.is_some_and(|id| filter.landmark(id).is_none()))
            .collect();
        for (place, sighting) in fresh {
            let (Some(id), Some(measurement)) = (sighting.id, self.measurement(sighting)) else { continue };
            outcomes[place].decision = self.start(id, &measurement);
            outcomes[place].landmark = Some(id);
        }
        Ok(outcomes)
    }

    /// Starts a landmark, or brings its ring nearer to a start.
    fn start(&mut self, id: u32, measurement: &Measurement<f64>) -> Decision {
        let filter = self.map.filter_mut();
        let time = filter.time();
        let born = if let Measurement::Range { range, variance } = *measurement {
            let Some(ring) = self.rings.get_mut(&id) else {
                self.rings.insert(id, RingStart::new(range, variance));
                return Decision::Tentative;
            };
            ring.update(range, variance);
            let Some((point, covariance)) = ring.settled(0.1) else { return Decision::Tentative };
            self.rings.remove(&id);
            filter.birth_at(time, id, point, &covariance)
        } else {
            filter.birth(time, id, measurement)
        };
        if born.is_err() {
            self.no_room += u32::from(filter.landmarks().len() >= self.settings.landmarks);
            return Decision::Rejected; // beyond the capacity, or a measurement that is none
        }
        if let Some(record) = filter.landmarks_mut().last_mut() {
            record.status = Status::Confirmed; // its name is known
        }
        Decision::Birth
    }

    fn unknown(&mut self, seen: &[LogSighting]) -> Result<Vec<Outcome<f64>>> {
        let measured: Vec<_> = seen.iter().map(|sighting| self.measurement(sighting)).collect();
        let features: Vec<_> = measured.into_iter().flatten().map(Feature::new).collect();
        let mut outcomes = vec![Outcome::default(); features.len()];
        self.map.observe(&features, |_, _| true, &mut outcomes).map_err(Error::new)?;
        Ok(outcomes)
    }

    fn stamped(&self) -> Stamped {
        let filter = self.map.filter();
        Stamped { time: self.time, pose: filter.pose(), covariance: Some(filter.pose_covariance()) }
    }

    fn points(&self, begin: f64) -> Vec<MapPoint> {
        let filter = self.map.filter();
        let confirmed = filter.landmarks().iter().filter(|landmark| landmark.status == Status::Confirmed);
        confirmed
            .filter_map(|landmark| {
                let position: Vector2<f64> = filter.position(landmark)?;
                Some(MapPoint {
                    id: u64::from(landmark.id),
                    position,
                    covariance: filter.position_covariance(landmark),
                    seen: u64::from(landmark.seen),
                    first_and_last: Some([begin + landmark.first_time, begin + landmark.last_time]),
                })
            })
            .collect()
    }
}

use crate::{
    error::{Error, fail, there, told},
    extractor::{give, row, working_bytes},
    rig::Rig,
    room::{Room, bytes_of},
};
use core::ffi::{CStr, c_char, c_void};
use monorange_core::{
    lines::{EdgePoint, Extraction, mask_words, point_count, row_words},
    pipeline::{self, Config, Lent, Memory, Odometry, Pipeline, Report},
    setting::Value,
    slam::{self, states_for, storage_len},
};

/// Pose and map of a robot from its camera's pictures and its wheels.
pub struct Drive {
    pipeline: Pipeline<Lent>,
    report: Option<Report>,
    width: usize,
}

/// A setting with a value of its own; `docs/settings.md` lists them all.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// For instance `association.caution`, with a zero at its end.
    pub name: *const c_char,
    /// A number; 0 or 1 for a switch; the place of a word, from 0, for a choice.
    pub value: f32,
}

/// Where the robot is: in the world, which is its first pose.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// m.
    pub x: f32,
    /// m.
    pub y: f32,
    /// rad.
    pub heading: f32,
    /// Of (x, y, heading), row by row.
    pub covariance: [f32; 9],
}

/// What became of a corner.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// It corrected the state.
    Update = 0,
    /// It corrected the state through a landmark that is not yet confirmed.
    Tentative = 1,
    /// It began a landmark.
    Birth = 2,
    /// It lay outside the gate.
    Gated = 3,
    /// It was not used.
    Rejected = 4,
}

impl From<slam::Decision> for Decision {
    fn from(decision: slam::Decision) -> Self {
        match decision {
            slam::Decision::Update => Self::Update,
            slam::Decision::Tentative => Self::Tentative,
            slam::Decision::Birth => Self::Birth,
            slam::Decision::Gated => Self::Gated,
            slam::Decision::Rejected => Self::Rejected,
        }
    }
}

/// A corner of the last picture.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Column, px.
    pub u: f32,
    /// Row, px.
    pub v: f32,
    /// m.
    pub range: f32,
    /// rad.
    pub bearing: f32,
    /// Number of its landmark, -1 for none.
    pub landmark: i64,
    /// What became of it.
    pub decision: Decision,
}

/// A landmark of the map.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Landmark {
    /// Its number, the same for ever.
    pub id: u32,
    /// Whether it has been seen often enough.
    pub confirmed: bool,
    /// In the world, m; NaN while only its bearing is known.
    pub x: f32,
    /// In the world, m.
    pub y: f32,
    /// m².
    pub var_x: f32,
    /// m².
    pub cov_xy: f32,
    /// m².
    pub var_y: f32,
}

/// The filter's opinion of itself.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No landmark was measured twice.
    Unchecked = 0,
    /// Errors are of the size that the covariance says.
    Consistent = 1,
    /// Do not rely on it.
    Doubtful = 2,
    /// The pose is not known.
    Lost = 3,
}

pub(crate) const fn bytes(width: usize, height: usize, landmarks: usize) -> usize {
    bytes_of::<Drive>(1)
        + bytes_of::<Extraction>(1)
        + working_bytes(width, height)
        + bytes_of::<f32>(storage_len(states_for(landmarks, true)))
        + bytes_of::<slam::Landmark<f32>>(landmarks)
}

/// Bytes of memory for a drive with pictures of this size and a map of so many landmarks.
#[unsafe(no_mangle)]
pub extern "C" fn monorange_drive_bytes(width: u32, height: u32, landmarks: u32) -> usize {
    bytes(width as usize, height as usize, landmarks as usize)
}

/// A drive at the world's origin with an empty map for so many landmarks, in `memory` of `monorange_drive_bytes`; null, and why, for a rig or a
/// setting that cannot be. `settings` has `count` of them; every other has its default.
///
/// # Safety
/// Nothing else uses the memory while the drive is in use. `settings` points to `count` settings whose names end with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn monorange_drive_start(
    rig: Option<&Rig>,
    settings: *const Setting,
    count: usize,
    landmarks: u32,
    memory: *mut c_void,
    bytes: usize,
    mut error: Option<&mut Error>,
) -> Option<&'static mut Drive> {
    let Some(rig) = rig else {
        fail(error, "rig is NULL");
        return None;
    };
    let config =
        rig.finder().map(|finder| Config { mount_std: first_four(rig.mount_std()), ..Config::new(finder) });
    let mut config = match config {
        Ok(config) => config,
        Err(why) => {
            fail(error, why);
            return None;
        }
    };
    let count = if settings.is_null() { 0 } else { count };
    for index in 0..count {
        // SAFETY: as promised for this function.
        let (name, value) = unsafe {
            let Setting { name, value } = *settings.add(index);
            (if name.is_null() { c"" } else { CStr::from_ptr(name) }, value)
        };
        if !set(&mut config, name, value, error.as_deref_mut()) {
            return None;
        }
    }
    // SAFETY: as promised for this function.
    let room = unsafe { Room::new(memory, bytes) };
    let Some(started) = start(rig, config, landmarks as usize, room) else {
        let needed = monorange_drive_bytes(rig.camera.width, rig.camera.height, landmarks);
        fail(error, format_args!("memory has {bytes} bytes, this drive needs {needed}"));
        return None;
    };
    match started {
        Ok(drive) => Some(drive),
        Err(why) => {
            fail(error, why);
            None
        }
    }
}

fn first_four([height, tilt, roll, yaw, ..]: [f32; 6]) -> [f32; 4] {
    [height, tilt, roll, yaw]
}

fn set(config: &mut Config, name: &CStr, value: f32, error: Option<&mut Error>) -> bool {
    let number = name.to_str().ok().and_then(pipeline::setting_number);
    let Some((setting, before)) = number.and_then(|number| config.numbered(number)) else {
        return fail(error, format_args!("there is no setting {name:?}; docs/settings.md lists them"));
    };
    let value = match before {
        Value::Number(_) => Value::Number(value),
        Value::Whole(_) => Value::Whole(value as u32),
        Value::Switch(_) => Value::Switch(value != 0.0),
        Value::Choice(_, words) => Value::Choice(value as u8, words),
        Value::Pair(_) => {
            return fail(error, format_args!("{} is a pair, which has no place here", setting.name));
        }
    };
    told(config.set(setting, value), error)
}

/// `None` where there is too little room.
fn start(
    rig: &Rig,
    config: Config,
    count: usize,
    mut room: Room,
) -> Option<monorange_core::Result<&'static mut Drive>> {
    let (width, height) = (rig.camera.width as usize, rig.camera.height as usize);
    let place = room.place()?;
    let memory = Memory::<Lent> {
        words: room.filled(row_words(width, height), 0)?,
        masks: room.filled(mask_words(width), 0)?,
        points: room.filled(point_count(width, height), EdgePoint::default())?,
        extraction: room.place()?.write(Extraction::zero()),
        numbers: room.filled(storage_len(states_for(count, true)), 0.0)?,
        landmarks: room.filled(count, slam::Landmark::default())?,
    };
    let made = config.needs_no_features().and_then(|()| Pipeline::new(config, memory));
    Some(made.map(|pipeline| place.write(Drive { pipeline, report: None, width })))
}

/// What the wheels say: forward speed (m/s) and turn rate (rad/s) for `seconds` up to the time `until` (s).
#[unsafe(no_mangle)]
pub extern "C" fn monorange_drive_velocity(
    drive: Option<&mut Drive>,
    until: f64,
    v: f32,
    omega: f32,
    seconds: f32,
    mut error: Option<&mut Error>,
) -> bool {
    let Some(drive) = there(drive, &mut error) else { return false };
    told(drive.pipeline.odometry(until, &Odometry::Velocity { v, omega, seconds }), error)
}

/// What the wheels say: a step forward and left (m) and its turn (rad), in `seconds` up to the time `until` (s).
#[unsafe(no_mangle)]
pub extern "C" fn monorange_drive_increment(
    drive: Option<&mut Drive>,
    until: f64,
    forward: f32,
    left: f32,
    turn: f32,
    seconds: f32,
    mut error: Option<&mut Error>,
) -> bool {
    let Some(drive) = there(drive, &mut error) else { return false };
    told(drive.pipeline.odometry(until, &Odometry::Increment { forward, left, turn, seconds }), error)
}

/// A picture begins.
#[unsafe(no_mangle)]
pub extern "C" fn monorange_drive_begin(drive: Option<&mut Drive>) {
    if let Some(drive) = drive {
        drive.report = None;
        drive.pipeline.begin();
    }
}

/// Takes its next row: as many grey pixels as the camera is wide.
///
/// # Safety
/// `pixels` points to so many bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn monorange_drive_row(
    drive: Option<&mut Drive>,
    pixels: *const u8,
    mut error: Option<&mut Error>,
) -> bool {
    let Some(drive) = there(drive, &mut error) else { return false };
    // SAFETY: as promised for this function.
    let row = unsafe { row(pixels, drive.width) };
    told(drive.pipeline.push_row(row), error)
}

/// Ends the picture, which was taken at `time` (s): the pose and the map are of that time now.
#[unsafe(no_mangle)]
pub extern "C" fn monorange_drive_finish(
    drive: Option<&mut Drive>,
    time: f64,
    mut error: Option<&mut Error>,
) -> bool {
    let Some(drive) = there(drive, &mut error) else { return false };
    let finished = drive.pipeline.finish(time).map(|report| drive.report = Some(report));
    told(finished, error)
}

/// Where the robot is.
#[unsafe(no_mangle)]
pub extern "C" fn monorange_drive_pose(drive: Option<&Drive>, pose: Option<&mut Pose>) -> bool {
    let (Some(drive), Some(pose)) = (drive, pose) else { return false };
    let (at, covariance) = (drive.pipeline.filter().pose(), drive.pipeline.filter().pose_covariance());
    let mut rows = [0.0; 9];
    rows.copy_from_slice(covariance.transpose().as_slice());
    *pose = Pose { x: at.x, y: at.y, heading: at.heading, covariance: rows };
    true
}

/// The corners of the last picture, `room` at most; returns how many there are.
///
/// # Safety
/// `observations` points to room for so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn monorange_drive_observations(
    drive: Option<&Drive>,
    observations: *mut Observation,
    room: usize,
) -> i32 {
    let corners = drive.and_then(|drive| drive.report.as_ref()).map_or(&[][..], |report| &report.corners);
    let told = corners.iter().map(|corner| Observation {
        u: corner.pixel.x,
        v: corner.pixel.y,
        range: corner.range,
        bearing: corner.bearing,
        landmark: corner.outcome.landmark.map_or(-1, i64::from),
        decision: corner.outcome.decision.into(),
    });
    // SAFETY: as promised for this function.
    unsafe { give(told, observations, room) }
}

/// The landmarks, `room` at most; returns how many there are.
///
/// # Safety
/// `landmarks` points to room for so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn monorange_drive_landmarks(
    drive: Option<&Drive>,
    landmarks: *mut Landmark,
    room: usize,
) -> i32 {
    let Some(drive) = drive else { return 0 };
    let filter = drive.pipeline.filter();
    let told = filter.landmarks().iter().map(|record| {
        let [x, y] = filter.position(record).map_or([f32::NAN; 2], Into::into);
        let [var_x, cov_xy, var_y] =
            filter.position_covariance(record).map_or([f32::NAN; 3], |p| [p.m11, p.m12, p.m22]);
        let confirmed = record.status == slam::Status::Confirmed;
        Landmark { id: record.id, confirmed, x, y, var_x, cov_xy, var_y }
    });
    // SAFETY: as promised for this function.
    unsafe { give(told, landmarks, room) }
}

/// How far the filter's own figures can be believed.
#[unsafe(no_mangle)]
pub extern "C" fn monorange_drive_verdict(drive: Option<&Drive>) -> Verdict {
    match drive.map(|drive| drive.pipeline.health().verdict()) {
        None | Some(slam::Verdict::Unchecked) => Verdict::Unchecked,
        Some(slam::Verdict::Consistent) => Verdict::Consistent,
        Some(slam::Verdict::Doubtful) => Verdict::Doubtful,
        Some(slam::Verdict::Lost) => Verdict::Lost,
    }
}

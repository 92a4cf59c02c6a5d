//! The C API gives what the core gives, bit by bit; what cannot be is said in words.
use monorange_c::*;
use monorange_core::{
    geometry::{self, RangeFinder as Finder},
    image::Grey,
    pipeline::{Config, Memory, Odometry, Pipeline},
};
use nalgebra::{Matrix2, Vector2};
use std::{ffi::CStr, ptr};

const SIZE: (usize, usize) = (320, 240);

fn rig() -> Rig {
    let camera = Camera {
        width: 320,
        height: 240,
        focal: [365.0; 2],
        principal: [160.0, 120.0],
        ..Default::default()
    };
    Rig { camera, mount: Mount { height: 0.4, tilt: 0.2, ..Default::default() }, ..Default::default() }
}

fn finder() -> Finder<f32> {
    let camera =
        geometry::Camera::new(320, 240, [365.0; 2], [160.0, 120.0], 0.0, Default::default()).unwrap();
    Finder::new(camera, geometry::Mount::new([0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap())
}

/// An upright edge that stands on the floor, nearer in every picture.
fn picture(number: usize) -> Vec<u8> {
    let pixel = |(u, v): (usize, usize)| if v > 140 + number { 60 } else { [120, 180][usize::from(u > 160)] };
    (0..SIZE.0 * SIZE.1).map(|place| pixel((place % SIZE.0, place / SIZE.0))).collect()
}

fn memory(bytes: usize) -> &'static mut [u8] {
    // One byte off every alignment.
    &mut Box::leak(vec![0; bytes + 1].into_boxed_slice())[1..]
}

fn no_error() -> Error {
    Error { text: [0; MONORANGE_ERROR_BYTES] }
}

fn words(error: &Error) -> &str {
    // SAFETY: the text ends with a zero.
    unsafe { CStr::from_ptr(error.text.as_ptr()) }.to_str().unwrap()
}

fn start(rig: &Rig, settings: &[Setting], bytes: usize, error: &mut Error) -> Option<&'static mut Drive> {
    let (memory, count) = (memory(bytes), settings.len());
    // SAFETY: the memory is nobody else's for ever; the settings' names are literals of C.
    unsafe {
        monorange_drive_start(
            Some(rig),
            settings.as_ptr(),
            count,
            32,
            memory.as_mut_ptr().cast(),
            bytes,
            Some(error),
        )
    }
}

#[test]
fn a_drive_is_the_cores_bit_by_bit() {
    let mut error = no_error();
    let settings = [Setting { name: c"association.confirm".as_ptr(), value: 2.0 }];
    let bytes = monorange_drive_bytes(320, 240, 32);
    let mut drive = start(&rig(), &settings, bytes, &mut error);
    let mut config = Config::new(finder());
    config.map.confirm = 2;
    let mut pipeline = Pipeline::new(config, Memory::on_heap(SIZE.0, SIZE.1, 32)).unwrap();
    for number in 0..4 {
        let time = 0.1 * number as f64;
        if number > 0 {
            assert!(monorange_drive_velocity(drive.as_deref_mut(), time, 0.2, 0.0, 0.1, Some(&mut error)));
            pipeline.odometry(time, &Odometry::Velocity { v: 0.2, omega: 0.0, seconds: 0.1 }).unwrap();
        }
        let pixels = picture(number);
        monorange_drive_begin(drive.as_deref_mut());
        for row in pixels.chunks(SIZE.0) {
            // SAFETY: a row has as many pixels as the camera.
            assert!(unsafe { monorange_drive_row(drive.as_deref_mut(), row.as_ptr(), Some(&mut error)) });
        }
        assert!(monorange_drive_finish(drive.as_deref_mut(), time, Some(&mut error)), "{}", words(&error));
        pipeline.step(time, Grey::new(&pixels, SIZE.0, SIZE.1).unwrap()).unwrap();
    }
    let mut pose = Pose::default();
    assert!(monorange_drive_pose(drive.as_deref(), Some(&mut pose)));
    let (at, covariance) = (pipeline.filter().pose(), pipeline.filter().pose_covariance());
    assert_eq!([pose.x, pose.y, pose.heading], [at.x, at.y, at.heading]);
    assert_eq!(pose.covariance, covariance.transpose().as_slice());
    let mut landmarks = [Landmark::default(); 32];
    // SAFETY: there is room for 32.
    let count = unsafe { monorange_drive_landmarks(drive.as_deref(), landmarks.as_mut_ptr(), 32) } as usize;
    assert!(count > 0 && landmarks[..count].iter().any(|landmark| landmark.confirmed), "{landmarks:?}");
    assert_eq!(count, pipeline.filter().landmarks().len());
    for (landmark, record) in landmarks.iter().zip(pipeline.filter().landmarks()) {
        let place = pipeline.filter().position(record).unwrap();
        assert_eq!((landmark.id, landmark.x, landmark.y), (record.id, place.x, place.y));
    }
    // SAFETY: there is no room, and none is used.
    let seen = unsafe { monorange_drive_observations(drive.as_deref(), ptr::null_mut(), 9) };
    assert!(seen > 0);
}

#[test]
fn a_range_and_the_corners_are_the_cores() {
    let (rig, mut error, mut seen) = (rig(), no_error(), Sighting::default());
    let place = memory(MONORANGE_RANGE_FINDER_BYTES);
    // SAFETY: the memory is nobody else's for ever.
    let ranger = unsafe {
        monorange_range_finder_start(Some(&rig), place.as_mut_ptr().cast(), place.len(), Some(&mut error))
    };
    assert_eq!(monorange_sight(ranger.as_deref(), 160.0, 200.0, 0.5, Some(&mut seen)), Sees::Floor);
    let ours = finder().sight(Vector2::new(160.0, 200.0)).unwrap();
    assert_eq!((seen.range, seen.bearing), (ours.range, ours.bearing));
    assert_eq!(seen.noise, (ours.noise(&(Matrix2::identity() * 0.25))).into());
    assert!(seen.systematic.var_range > seen.noise.var_range, "a mount measured by hand");
    assert_eq!(monorange_sight(ranger.as_deref(), 160.0, 5.0, 0.5, Some(&mut seen)), Sees::AboveHorizon);
    assert_eq!(monorange_sight(ranger.as_deref(), -9.0, 5.0, 0.5, Some(&mut seen)), Sees::OutsideImage);
    assert_eq!(monorange_sight(None, 160.0, 200.0, 0.5, Some(&mut seen)), Sees::Nothing);

    let place = memory(monorange_extractor_bytes(320, 240));
    // SAFETY: the memory is nobody else's for ever, the rows and the corners are as long as is said.
    unsafe {
        let mut extractor =
            monorange_extractor_start(Some(&rig), place.as_mut_ptr().cast(), place.len(), Some(&mut error));
        monorange_extractor_begin(extractor.as_deref_mut());
        for row in picture(0).chunks(SIZE.0) {
            assert!(monorange_extractor_row(extractor.as_deref_mut(), row.as_ptr(), Some(&mut error)));
        }
        let mut corners = [Corner::default(); 4];
        assert_eq!(monorange_extractor_finish(extractor, corners.as_mut_ptr(), 4, Some(&mut error)), 1);
        assert!((corners[0].u - 160.5).abs() < 1.0 && (corners[0].v - 140.5).abs() < 1.0, "{:?}", corners[0]);
    }
}

#[test]
fn what_cannot_be_is_said_in_words() {
    let (mut error, bytes) = (no_error(), monorange_drive_bytes(320, 240, 32));
    let mut says = |rig: &Rig, settings: &[Setting], bytes, expected: &str| {
        assert!(start(rig, settings, bytes, &mut error).is_none());
        assert!(words(&error).contains(expected), "{}", words(&error));
    };
    let named = |name: &'static CStr, value| [Setting { name: name.as_ptr(), value }];
    says(&rig(), &[], bytes - 200, &format!("this drive needs {bytes}"));
    says(&rig(), &named(c"association.confrm", 2.0), bytes, "association.confrm");
    says(&rig(), &named(c"association.confirm", -1.0), bytes, "association.confirm");
    says(&rig(), &[Setting { name: ptr::null(), value: 0.0 }], bytes, "no setting");
    let mut low = rig();
    low.mount.height = f32::NAN;
    says(&low, &[], bytes, "mount.height is NaN");
    let mut odd = rig();
    odd.camera.lens = 7;
    says(&odd, &[], bytes, "camera.lens is 7");
    assert!(!monorange_drive_finish(None, 0.0, Some(&mut error)));
    assert!(words(&error).contains("not started"));
    let drive = start(&rig(), &[], bytes, &mut error);
    // SAFETY: no row is no row.
    assert!(!unsafe { monorange_drive_row(drive, ptr::null(), Some(&mut error)) });
    assert!(words(&error).contains("row"));
}

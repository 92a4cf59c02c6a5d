import csv
import subprocess

import numpy as np
import pytest

import monorange


def columns(path):
    with open(path) as file:
        return [[float(cell) if cell else np.nan for cell in row] for row in list(csv.reader(file))[1:]]


def times(folder):
    return [float(line) for line in (folder / "times.txt").read_text().split()]


def drive_through(folder, pictures, **options):
    """Gives a drive the wheels' readings and the pictures, as a robot would."""
    drive = monorange.Drive(monorange.RangeFinder.from_rig(folder / "rig.toml"), **options)
    wheels, stamps = columns(folder / "odometry.csv"), times(folder)
    ends = [row[0] for row in wheels[1:]] + [2 * wheels[-1][0] - wheels[-2][0]]
    reached, steps = stamps[0], []
    for stamp, picture in zip(stamps, pictures):
        for (start, v, omega), end in zip(wheels, ends):
            if start < stamp and end > reached:
                drive.odometry(max(start, reached), min(end, stamp), v, omega)
        reached = stamp
        steps.append(drive.picture(stamp, picture))
    return drive, steps


def test_a_drive_in_python_is_the_drive_of_the_command_line(command, drive, pictures, tmp_path):
    files = [f"--{name}={drive / file}" for name, file in [("rig", "rig.toml"), ("frames", "frames"), ("odometry", "odometry.csv")]]
    subprocess.run([command, "slam", *files, "--out", tmp_path], check=True, capture_output=True)
    theirs = columns(tmp_path / "trajectory.csv")
    made, steps = drive_through(drive, pictures)
    assert len(steps) == len(theirs) == made.frames
    for step, (time, x, y, heading, xx, xy, xh, yy, yh, hh) in zip(steps, theirs):
        assert step.time == time
        assert step.pose.tolist() == pytest.approx([x, y, heading], abs=1e-6)
        assert step.covariance.ravel() == pytest.approx([xx, xy, xh, xy, yy, yh, xh, yh, hh], abs=1e-7)
    landmarks = columns(tmp_path / "map.csv")
    assert made.map().ids.tolist() == [int(row[0]) for row in landmarks]
    assert np.allclose(made.map().positions, [row[1:3] for row in landmarks], atol=1e-5)


def test_without_wheels_the_pictures_tell_the_motion_as_on_the_command_line(command, drive, pictures, tmp_path):
    files = [f"--{name}={drive / file}" for name, file in [("rig", "rig.toml"), ("frames", "frames")]]
    subprocess.run([command, "slam", *files, "--out", tmp_path], check=True, capture_output=True)
    made = monorange.Drive(monorange.RangeFinder.from_rig(drive / "rig.toml"), wheels=False)
    poses = [made.picture(stamp, picture).pose for stamp, picture in zip(times(drive), pictures)]
    theirs = [row[1:4] for row in columns(tmp_path / "trajectory.csv")]
    assert np.allclose(poses, theirs, atol=1e-6)
    assert np.hypot(*poses[-1][:2]) > 1.0, "it has moved"


def test_corners_have_symmetric_covariances_above_zero(drive, pictures):
    corners = monorange.Extractor(monorange.RangeFinder.from_rig(drive / "rig.toml")).corners(pictures[0])
    assert len(corners) > 2
    assert np.allclose(corners.covariances, corners.covariances.transpose(0, 2, 1))
    assert (np.linalg.eigvalsh(corners.covariances) > 0).all()


def test_what_is_wrong_with_a_picture_or_a_reading_is_said(drive, pictures):
    finder = monorange.RangeFinder.from_rig(drive / "rig.toml")
    made = monorange.Drive(finder)
    with pytest.raises(ValueError, match="240, 320"):
        made.picture(0.0, np.zeros((10, 10), np.uint8))
    with pytest.raises(ValueError, match="contiguous"):
        made.picture(0.0, np.asfortranarray(pictures[0]))
    with pytest.raises(TypeError):
        made.picture(0.0, pictures[0].astype(np.float64))
    with pytest.raises(ValueError, match="end after its start"):
        made.odometry(1.0, 0.5, 0.1, 0.0)
    made.picture(1.0, pictures[0])
    with pytest.raises(ValueError, match="not after the last one"):
        made.picture(0.5, pictures[1])


def test_calibrate_finds_the_mount_and_says_when_points_contradict():
    camera = dict(camera_matrix=[[365.0, 0, 160], [0, 365, 120], [0, 0, 1]], size=(320, 240))
    truth = monorange.RangeFinder(**camera, height=0.4, tilt=0.2, roll=0.01, yaw=0.02)
    pixels = np.array([[40.0, 230], [280, 225], [60, 120], [250, 110], [160, 150], [100, 180]])
    seen = truth.sight(pixels)
    places = np.column_stack([seen.x, seen.y])
    by_hand = monorange.RangeFinder(**camera, height=0.42, tilt=0.22)
    found = monorange.calibrate(by_hand, pixels, places)
    assert [found.mount[name] for name in ("height", "tilt", "roll", "yaw")] == pytest.approx([0.4, 0.2, 0.01, 0.02], abs=1e-8)
    assert found.consistent and np.abs(found.residuals).max() < 1e-8
    places[2] += 0.5
    assert not monorange.calibrate(by_hand, pixels, places).consistent
    with pytest.raises(ValueError, match="pitch"):
        monorange.calibrate(by_hand, pixels, places, fit=["pitch"])
    with pytest.raises(ValueError):
        monorange.calibrate(by_hand, pixels[:1], places[:1])


def test_evaluate_takes_files_and_arrays(drive, command, tmp_path):
    truth = drive / "truth.tum"
    rows = np.loadtxt(truth)
    heading = 2 * np.arctan2(rows[:, 6], rows[:, 7])
    poses = np.column_stack([rows[:, 1] + 0.03, rows[:, 2] - 0.04, heading])
    errors = monorange.evaluate(truth, (rows[:, 0].copy(), poses, None))
    assert errors["absolute"]["position"]["rms"] == pytest.approx(0.05, abs=1e-9)
    with pytest.raises(ValueError, match="no time in common"):
        monorange.evaluate(truth, (rows[:, 0] + 1e6, poses, None))
    with pytest.raises(ValueError, match="align"):
        monorange.evaluate(truth, truth, align="se3")


def test_the_lock_is_released_while_rust_works(drive):
    """A thread that waits gets its turn before `sight` is done: nobody else gives the lock up in this test."""
    import sys
    import threading
    import time

    finder = monorange.RangeFinder.from_rig(drive / "rig.toml")
    pixels = np.random.default_rng(1).uniform([0, 60], [319, 239], (2_000_000, 2))
    begun, turn = threading.Event(), []
    other = threading.Thread(target=lambda: (begun.wait(), turn.append(time.perf_counter())))
    other.start()
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        begun.set()
        finder.sight(pixels)
        end = time.perf_counter()
    finally:
        sys.setswitchinterval(interval)
    other.join()
    assert turn[0] < end

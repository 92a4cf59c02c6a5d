import csv
import subprocess

import numpy as np
import pytest

import monorange
from test_drive import drive_through, times


def of_the_command_line(command, drive, *more):
    """The beams of each picture, as `monorange scan` writes them."""
    files = [f"--rig={drive / 'rig.toml'}", f"--frames={drive / 'frames'}", f"--times={drive / 'times.txt'}"]
    text = subprocess.run([command, "scan", *files, *more], check=True, capture_output=True, text=True).stdout
    rows = list(csv.DictReader(text.splitlines()))
    assert rows
    return [[row for row in rows if float(row["t"]) == time] for time in times(drive)]


def assert_same(scan, rows):
    assert len(scan) == len(rows) > 10
    assert scan.kind == [row["kind"] for row in rows]
    for name in ("bearing", "free", "range", "var_range"):
        theirs = np.array([float(row[name] or "nan") for row in rows], np.float32)
        assert np.array_equal(getattr(scan, name), theirs, equal_nan=True), name


def test_pictures_by_themselves_give_the_scan_of_the_command_line(command, drive, pictures):
    scanner = monorange.Scanner(monorange.RangeFinder.from_rig(drive / "rig.toml"))
    for picture, rows in zip(pictures, of_the_command_line(command, drive)):
        assert_same(scanner.scan(picture), rows)


def test_what_the_robot_has_moved_puts_pictures_together_as_on_the_command_line(command, drive, pictures, tmp_path):
    stamps = times(drive)
    wheels = tmp_path / "wheels.csv"
    wheels.write_text("t,v,omega\n" + "".join(f"{t},0.5,0\n" for t in stamps))
    scanner = monorange.Scanner(monorange.RangeFinder.from_rig(drive / "rig.toml"), beams=40, field=np.radians((-20, 20)))
    alone = monorange.Scanner(monorange.RangeFinder.from_rig(drive / "rig.toml"), beams=40, field=np.radians((-20, 20)))
    before, differ = stamps[0], False
    rows = of_the_command_line(command, drive, f"--odometry={wheels}", "--beams=40", "--field=40")
    for now, picture, row in zip(stamps, pictures, rows):
        if now > before:
            scanner.moved(0.5 * (now - before), 0.0, 0.0)
        before = now
        scan = scanner.scan(picture)
        assert len(scan) == 40
        assert scan.kind == [cell["kind"] for cell in row]
        # The command line rounds the way once more.
        assert scan.free == pytest.approx([float(cell["free"]) for cell in row], rel=1e-4)
        differ |= not np.array_equal(scan.free, alone.scan(picture).free)
    assert differ, "memory says something"


def test_a_drive_scans_too_as_the_command_line_does_with_its_odometry(command, drive, pictures):
    rows = of_the_command_line(command, drive, f"--odometry={drive / 'odometry.csv'}")
    _, steps = drive_through(drive, pictures, scan=True)
    for step, row in zip(steps, rows, strict=True):
        assert step.scan.kind == [cell["kind"] for cell in row]
        assert step.scan.free == pytest.approx([float(cell["free"]) for cell in row], rel=1e-4)
    assert drive_through(drive, pictures[:1])[1][0].scan is None


def test_without_wheels_the_pictures_motion_puts_scans_together(drive, pictures):
    finder = monorange.RangeFinder.from_rig(drive / "rig.toml")
    made, scanner = monorange.Drive(finder, wheels=False, scan=True), monorange.Scanner(finder)
    steps = [made.picture(stamp, picture) for stamp, picture in zip(times(drive), pictures)]
    poses = np.array([step.pose for step in steps])
    for k, (step, picture) in enumerate(zip(steps, pictures)):
        if k:
            (dx, dy, turn), heading = poses[k] - poses[k - 1], poses[k - 1][2]
            scanner.moved(dx * np.cos(heading) + dy * np.sin(heading), dy * np.cos(heading) - dx * np.sin(heading), turn)
        scan = scanner.scan(picture)
        assert step.scan.kind == scan.kind
        assert step.scan.free == pytest.approx(scan.free, rel=1e-4)


def test_what_is_wrong_is_said(drive):
    finder = monorange.RangeFinder.from_rig(drive / "rig.toml")
    with pytest.raises(ValueError, match="beams"):
        monorange.Scanner(finder, beams=1000)
    with pytest.raises(ValueError, match="240, 320"):
        monorange.Scanner(finder).scan(np.zeros((10, 10), np.uint8))
    with pytest.raises(ValueError, match="finite"):
        monorange.Scanner(finder).moved(np.nan, 0.0, 0.0)

"""A simulated drive, made once by the command line that stands beside the package in the repository."""

import os
import pathlib
import shutil
import subprocess

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def command():
    """The program `monorange`, as `cargo xtask test` names it."""
    found = os.environ.get("MONORANGE") or shutil.which("monorange")
    if not found:
        found = next((str(p) for p in (ROOT / "target").glob("*/monorange") if os.access(p, os.X_OK)), None)
    assert found, "build the command line first: cargo build --bin monorange"
    return found


@pytest.fixture(scope="session")
def drive(command, tmp_path_factory):
    """A folder with frames/, rig.toml, times.txt, odometry.csv and truth.tum: 20 pictures of a corridor."""
    folder = tmp_path_factory.mktemp("drives") / "corridor"
    subprocess.run([command, "simulate", "--scene", "corridor", "--frames", "20", "--out", folder], check=True)
    return folder


@pytest.fixture(scope="session")
def pictures(drive):
    """The drive's pictures as arrays of grey."""
    from PIL import Image

    return [np.asarray(Image.open(path).convert("L")) for path in sorted((drive / "frames").iterdir())]


SKIPPED = []


def pytest_runtest_logreport(report):
    if report.skipped:
        SKIPPED.append((report.nodeid, report.longrepr[2]))


pytest_collectreport = pytest_runtest_logreport  # modules that are skipped as a whole


def pytest_sessionfinish(session):
    """A test that lacks another package is counted as `cargo xtask test` counts them, and fails under CI."""
    lines = [f"{name}: SKIPPED, {why.removeprefix('Skipped: ')}\n" for name, why in SKIPPED]
    if lines and os.environ.get("CI") == "true":
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
        print("under CI nothing may be skipped:", *lines, sep="\n")
    elif lines and "MONORANGE_SKIPPED" in os.environ:
        with open(os.environ["MONORANGE_SKIPPED"], "a", encoding="utf-8") as file:
            file.writelines(lines)

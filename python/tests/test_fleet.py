"""Twenty drives on a local Ray cluster of two workers, one of which is killed half-way."""

import os
import pathlib
import signal
import subprocess
import threading
import time

import numpy as np
import pytest

from test_examples import load

ray = pytest.importorskip("ray", reason="pip install ray: the fleet on a cluster of this machine")
DRIVES = 20


def workers():
    """Processes of this test's cluster that are at a drive."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            at_work = (entry / "cmdline").read_bytes().startswith(b"ray::one")
            pid = ancestor = int(entry.name)
            while at_work and ancestor not in (0, 1, os.getpid()):
                ancestor = int((pathlib.Path("/proc") / str(ancestor) / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except (FileNotFoundError, ProcessLookupError):
            continue
        if at_work and ancestor == os.getpid():
            found.append(pid)
    return found


def test_a_killed_worker_costs_nothing_but_time(command, tmp_path):
    drives, out, alone = tmp_path / "drives", tmp_path / "out", tmp_path / "alone"
    for seed in range(DRIVES):
        words = [command, "simulate", "--scene", "corridor", "--frames", "12", "--seed", str(seed + 1)]
        subprocess.run([*words, "--out", drives / f"drive-{seed:02}"], check=True, capture_output=True)
    killed = []

    def kill_one():
        while len(list(out.glob("*.npz"))) < DRIVES // 4:
            time.sleep(0.01)
        while not killed:
            for pid in workers()[:1]:
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)

    killer = threading.Thread(target=kill_one, daemon=True)
    killer.start()
    files = load("fleet").fleet(drives, out, num_cpus=2, include_dashboard=False, logging_level="ERROR")
    killer.join(timeout=10)
    ray.shutdown()
    assert killed, "no worker was killed: the test shows nothing"
    assert [pathlib.Path(file).stem for file in files] == [f"drive-{seed:02}" for seed in range(DRIVES)]
    for seed in range(DRIVES):
        one = load("fleet").one(drives / f"drive-{seed:02}", alone)
        ours, theirs = np.load(one), np.load(out / pathlib.Path(one).name)
        assert all(np.array_equal(ours[key], theirs[key]) for key in ours.files)

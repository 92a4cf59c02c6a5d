"""evo (PyPI), which SLAM researchers use, reads our trajectory and agrees with `evaluate`."""

import numpy as np
import pytest

import monorange

pytest.importorskip("evo", reason="pip install evo: an oracle of trajectory errors")


@pytest.mark.parametrize("align", ["none", "se2"])
def test_evo_agrees_with_evaluate(command, drive, tmp_path, align):
    import subprocess

    from evo.core import metrics, sync
    from evo.tools import file_interface

    words = ["--rig", drive / "rig.toml", "--frames", drive / "frames", "--odometry", drive / "odometry.csv"]
    subprocess.run([command, "slam", *words, "--out", tmp_path], check=True, capture_output=True)
    ours = monorange.evaluate(drive / "truth.tum", tmp_path / "trajectory.tum", align=align)["absolute"]["position"]
    truth = file_interface.read_tum_trajectory_file(str(drive / "truth.tum"))
    estimate = file_interface.read_tum_trajectory_file(str(tmp_path / "trajectory.tum"))
    truth, estimate = sync.associate_trajectories(truth, estimate)
    if align == "se2":
        estimate.align(truth)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((truth, estimate))
    theirs = error.get_all_statistics()
    assert ours["rms"] == pytest.approx(theirs["rmse"], abs=1e-9)
    assert ours["mean"] == pytest.approx(theirs["mean"], abs=1e-9)
    assert ours["max"] == pytest.approx(theirs["max"], abs=1e-9)

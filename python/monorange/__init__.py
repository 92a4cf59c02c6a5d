"""monorange: one calibrated camera as a range finder and map maker.

``RangeFinder`` turns pixels of the floor into range and bearing with their covariance, ``Extractor`` finds floor corners,
``Drive`` makes pose and map of pictures and wheels, ``Scanner`` says how far the floor is free, ``calibrate`` fits the mount,
``evaluate`` compares trajectories, and ``Device`` speaks to a co-processor. The robot's frame is x forward, y left, z up; metres and radians everywhere; pixel (0, 0)
is the centre of the top-left pixel. The interpreter's lock is released while Rust works.
"""

from __future__ import annotations

import json

from ._monorange import Device, Drive, Extractor, RangeFinder, Scanner, __version__, calibrate
from ._monorange import _evaluate
from ._results import STATUS, Calibration, Corners, Map, Scan, Sightings, Step

__all__ = [
    "STATUS",
    "Calibration",
    "Corners",
    "Device",
    "Drive",
    "Extractor",
    "Map",
    "RangeFinder",
    "Scan",
    "Scanner",
    "Sightings",
    "Step",
    "__version__",
    "calibrate",
    "evaluate",
]


def evaluate(truth, estimate, *, align="none", delta=1.0, max_gap=1.0):
    """The errors of a trajectory against the truth, as ``monorange evaluate`` prints them.

    Args:
        truth, estimate: a file's name (TUM or CSV), or a tuple (times (N,), poses (N, 3) of x, y, heading, covariances
            (N, 3, 3) or None), float64.
        align: "none", "se2" or "sim2".
        delta: length of the stretches for the relative error, m.
        max_gap: true poses further apart are not interpolated between, s.

    Returns:
        dict: metres and radians; 1 is right for every ``..._per_dof``.

    Raises:
        ValueError: a file is malformed, or the two have no time in common.
    """
    return json.loads(_evaluate(truth, estimate, align, float(delta), float(max_gap)))

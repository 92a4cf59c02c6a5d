"""What functions give. Lengths in metres, angles in radians, pixels in px; arrays of float64 unless said otherwise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

STATUS = ("ok", "above_horizon", "outside_image", "outside_lens_model")


@dataclass(frozen=True)
class Sightings:
    """What N pixels see of the floor; NaN where they see none."""

    range: Any  #: (N,) from the robot's origin, m
    bearing: Any  #: (N,) from the robot's x axis, positive to the left, rad
    covariance: Any  #: (N, 2, 2) of (range, bearing)
    x: Any  #: (N,) forward, m
    y: Any  #: (N,) to the left, m
    status: Any  #: (N,) uint8, an index into ``STATUS``; 0 is ok

    def __len__(self) -> int:
        return len(self.range)

    @property
    def range_std(self) -> Any:
        """(N,) standard deviation of the range, m."""
        return self.covariance[:, 0, 0] ** 0.5

    @property
    def bearing_std(self) -> Any:
        """(N,) standard deviation of the bearing, rad."""
        return self.covariance[:, 1, 1] ** 0.5

    @property
    def ok(self) -> Any:
        """(N,) bool: whether the pixel sees the floor."""
        return self.status == 0


@dataclass(frozen=True)
class Corners:
    """Floor corners of a picture."""

    pixels: Any  #: (N, 2) of (u, v)
    covariances: Any  #: (N, 2, 2), px^2

    def __len__(self) -> int:
        return len(self.pixels)


@dataclass(frozen=True)
class Scan:
    """How far the floor is free along N beams."""

    bearing: Any  #: (N,) from the robot's x axis, positive to the left, rad
    free: Any  #: (N,) the floor is seen clear up to here, m; 0 where no floor is seen
    range: Any  #: (N,) of what bounds it, m; NaN for ``unknown`` and ``beyond``
    var_range: Any  #: (N,) m^2, NaN without a range
    kind: list[str]  #: boundary, obstacle, unknown (nothing certain beyond ``free``) or beyond (free as far as is looked at)

    def __len__(self) -> int:
        return len(self.bearing)


@dataclass(frozen=True)
class Step:
    """Where the robot is after a picture, and its N corners."""

    time: float  #: s
    pose: Any  #: (3,) x, y (m), heading (rad) in the world
    covariance: Any  #: (3, 3)
    pixels: Any  #: (N, 2)
    range: Any  #: (N,), NaN without one
    bearing: Any  #: (N,), NaN without one
    landmark: Any  #: (N,) int64, -1 for none
    decision: list[str]  #: update, birth, gated, tentative or rejected
    nis: Any  #: (N,) normalised innovation squared, NaN without one
    scan: Scan | None = None  #: with `Drive(…, scan=True)`


@dataclass(frozen=True)
class Map:
    """The confirmed landmarks."""

    ids: Any  #: (N,) uint64
    positions: Any  #: (N, 2) in the world, m
    covariances: Any  #: (N, 2, 2), m^2

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True)
class Calibration:
    """A mount that was fitted."""

    finder: Any  #: the range finder with it
    mount: dict[str, float]  #: height, tilt, roll, yaw, forward, left: m and rad
    std: list[float]  #: of height, tilt, roll, yaw, forward, left; 0 where not fitted
    residuals: Any  #: (N, 2) of (range, bearing), as measured less as seen
    consistent: bool  #: whether the residuals agree with the noise

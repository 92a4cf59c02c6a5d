from os import PathLike
from typing import Any, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from ._results import STATUS as STATUS
from ._results import Calibration as Calibration
from ._results import Corners as Corners
from ._results import Map as Map
from ._results import Scan as Scan
from ._results import Sightings as Sightings
from ._results import Step as Step

__version__: str

_Path = Union[str, "PathLike[str]"]
_Poses = tuple[NDArray[np.float64], NDArray[np.float64], Union[NDArray[np.float64], None]]

class RangeFinder:
    def __init__(
        self,
        camera_matrix: Sequence[Sequence[float]] | NDArray[np.float64],
        *,
        size: tuple[int, int],
        height: float,
        tilt: float,
        distortion: Sequence[float] = ...,
        lens: str = "plumb_bob",
        roll: float = 0.0,
        yaw: float = 0.0,
        forward: float = 0.0,
        left: float = 0.0,
        pixel_std: tuple[float, float] | None = None,
        mount_std: Sequence[float] | None = None,
    ) -> None: ...
    @staticmethod
    def from_rig(path: _Path) -> RangeFinder: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def mount(self) -> dict[str, float]: ...
    @property
    def mount_std(self) -> list[float]: ...
    @property
    def pixel_std(self) -> list[float]: ...
    def write_rig(self, path: _Path) -> None: ...
    def sight(
        self,
        pixels: NDArray[np.float64],
        pixel_std: tuple[float, float] | None = None,
        mount_uncertainty: bool = False,
        height_above_floor: float = 0.0,
    ) -> Sightings: ...
    def pixels(self, points: NDArray[np.float64]) -> NDArray[np.float64]: ...

class Extractor:
    def __init__(self, finder: RangeFinder) -> None: ...
    def corners(self, picture: NDArray[np.uint8]) -> Corners: ...

class Drive:
    def __init__(
        self, finder: RangeFinder, max_landmarks: int = 512, wheels: bool = True, scan: bool = False
    ) -> None: ...
    def odometry(self, start: float, end: float, v: float, omega: float) -> None: ...
    def increment(self, start: float, end: float, forward: float, left: float, turn: float) -> None: ...
    def attitude(self, pitch: float, roll: float, std: float = 0.003) -> None: ...
    def picture(self, time: float, picture: NDArray[np.uint8]) -> Step: ...
    def map(self) -> Map: ...
    @property
    def verdict(self) -> str: ...
    @property
    def frames(self) -> int: ...

class Scanner:
    def __init__(
        self, finder: RangeFinder, beams: int | None = None, field: tuple[float, float] | None = None
    ) -> None: ...
    def moved(self, forward: float, left: float, turn: float) -> None: ...
    def scan(self, picture: NDArray[np.uint8]) -> Scan: ...

class Device:
    def __init__(self, stream: Any, finder: RangeFinder, *, patience: float = 10.0, nonce: int = 0) -> None: ...
    def odometry(self, start: float, end: float, v: float, omega: float) -> None: ...
    def attitude(self, pitch: float, roll: float, std: float = 0.003) -> None: ...
    def picture(self, time: float, picture: NDArray[np.uint8]) -> dict[str, Any]: ...
    def map(self) -> list[dict[str, Any]]: ...

def calibrate(
    finder: RangeFinder,
    pixels: NDArray[np.float64],
    places: NDArray[np.float64],
    *,
    fit: Sequence[str] | None = None,
    pixel_std: float = 1.0,
    range_std: float = 0.01,
    bearing_std: float = 0.01,
) -> Calibration: ...
def evaluate(
    truth: _Path | _Poses,
    estimate: _Path | _Poses,
    *,
    align: str = "none",
    delta: float = 1.0,
    max_gap: float = 1.0,
) -> dict[str, Any]: ...

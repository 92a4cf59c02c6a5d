"""A million pixels to ranges, beside OpenCV's undistortPoints and a plane in numpy. Needs opencv-python-headless.

    python speed.py
"""

import time

import numpy as np

import monorange

MATRIX = np.array([[365.12674, 0.0, 145.79917], [0.0, 365.02905, 114.50956], [0.0, 0.0, 1.0]])
LENS = [-0.22776, 0.36413, -0.00545, -0.00192, 0.0]
HEIGHT, TILT = 0.40, np.radians(12)
PIXELS = 1_000_000


def with_opencv(pixels):
    """Range and bearing, without covariance, as a numpy user would."""
    import cv2

    rays = cv2.undistortPoints(pixels, MATRIX, np.array(LENS)).reshape(-1, 2)
    sin, cos = np.sin(TILT), np.cos(TILT)
    forward, down = cos - rays[:, 1] * sin, sin + rays[:, 1] * cos
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = HEIGHT * forward / down, -HEIGHT * rays[:, 0] / down
    return np.hypot(x, y), np.arctan2(y, x)


def seconds(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def measured(rounds=7):
    """The best times of both, taken in turns (s), and the largest difference of a range below 10 m."""
    pixels = np.random.default_rng(1).uniform([0, 60], [319, 239], (PIXELS, 2))
    finder = monorange.RangeFinder(MATRIX, size=(320, 240), height=HEIGHT, tilt=TILT, distortion=LENS)
    seen, (their_range, _) = finder.sight(pixels), with_opencv(pixels)
    apart = np.abs(seen.range - their_range)[seen.ok & (seen.range < 10)].max()
    times = [(seconds(lambda: finder.sight(pixels)), seconds(lambda: with_opencv(pixels))) for _ in range(rounds)]
    ours, theirs = map(min, zip(*times))
    return ours, theirs, apart


def main():
    ours, theirs, apart = measured()
    print(f"monorange  {ours:.3f} s for range, bearing, covariance, x, y of {PIXELS} pixels")
    print(f"OpenCV     {theirs:.3f} s for range and bearing: monorange takes {ours / theirs:.2f} x")
    print(f"largest difference of a range below 10 m: {apart:.2e} m")


if __name__ == "__main__":
    main()

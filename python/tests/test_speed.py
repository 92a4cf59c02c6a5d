"""A million pixels, beside OpenCV in the same run."""

import pytest

from test_examples import load

pytest.importorskip("cv2", reason="pip install opencv-python-headless: the speed of `sight` beside it")


def test_a_million_pixels_are_ranged_about_as_fast_as_opencv_undistorts_them():
    # Other work of the machine makes single rounds slower, hardly ever all of them. The bounds are twice what an idle machine takes.
    ours, theirs, apart = load("speed").measured(rounds=15)
    print(f"\na million pixels: {ours:.3f} s, OpenCV and a plane {theirs:.3f} s ({ours / theirs:.2f} x)")
    assert apart < 1e-3, "both see the same floor"
    assert ours <= 0.5
    assert ours <= 2 * theirs

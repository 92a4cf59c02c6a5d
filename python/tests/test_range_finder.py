import pathlib
import subprocess

import numpy as np
import pytest

import monorange

MATRIX = [[365.0, 0.0, 160.0], [0.0, 365.0, 120.0], [0.0, 0.0, 1.0]]


def finder(**changes):
    given = dict(size=(320, 240), height=0.40, tilt=0.2, pixel_std=(0.3, 0.3))
    return monorange.RangeFinder(MATRIX, **{**given, **changes})


def test_the_optical_axis_meets_the_floor_where_geometry_says():
    seen = finder().sight(np.array([[160.0, 120.0]]))
    assert seen.range[0] == pytest.approx(0.4 / np.tan(0.2), abs=1e-12)
    assert seen.bearing[0] == pytest.approx(0.0, abs=1e-12)
    assert seen.ok.all() and len(seen) == 1


def test_a_lamp_is_ranged_at_its_height():
    up = finder(tilt=-0.2)
    lamp = up.sight(np.array([[160.0, 120.0], [160.0, 239.0]]), height_above_floor=2.4)
    assert lamp.range[0] == pytest.approx(2.0 / np.tan(0.2), abs=1e-12) and list(lamp.ok) == [True, False]
    with pytest.raises(ValueError, match="height of the lens"):
        up.sight(np.array([[160.0, 120.0]]), height_above_floor=0.4)


def test_the_covariance_is_what_differences_of_pixels_give():
    camera = finder(distortion=[-0.2, 0.3, -0.005, -0.002, 0.0], roll=0.02, yaw=-0.1, forward=0.1, left=0.05)
    pixel, step = np.array([[100.0, 180.0]]), 1e-4
    columns = []
    for axis in np.eye(2):
        up, down = (camera.sight(pixel + sign * step * axis) for sign in (1, -1))
        columns.append([(up.range - down.range)[0], (up.bearing - down.bearing)[0]])
    jacobian = np.array(columns).T / (2 * step)
    assert np.allclose(camera.sight(pixel).covariance[0], 0.09 * jacobian @ jacobian.T, rtol=1e-6)


def test_points_and_pixels_are_each_others_inverse():
    camera = finder(distortion=[-0.2, 0.3, -0.005, -0.002, 0.0])
    points = np.array([[1.0, 0.2], [3.0, -0.5]])
    seen = camera.sight(camera.pixels(points))
    assert np.allclose(np.column_stack([seen.x, seen.y]), points, atol=1e-9)
    assert np.isnan(camera.pixels(np.array([[-1.0, 0.0]]))).all()


def test_what_sees_no_floor_is_nan_and_says_why():
    seen = finder().sight(np.array([[160.0, 10.0], [160.0, 500.0], [160.0, 200.0]]))
    assert [monorange.STATUS[code] for code in seen.status] == ["above_horizon", "outside_image", "ok"]
    assert np.isnan(seen.range[:2]).all() and np.isnan(seen.covariance[:2]).all()


def test_the_numbers_are_those_of_the_command_line(command, drive):
    rig = drive / "rig.toml"
    pixels = np.array([[160.0, 200.0], [40.5, 150.25], [300.0, 90.0], [10.0, 5.0]])
    text = "u,v\n" + "".join(f"{u!r},{v!r}\n" for u, v in pixels.tolist())
    out = subprocess.run([command, "range", "--rig", rig], input=text, capture_output=True, text=True, check=True)
    seen = monorange.RangeFinder.from_rig(rig).sight(pixels)
    for index, line in enumerate(out.stdout.splitlines()[1:]):
        cells = line.split(",")
        assert cells[-1] == monorange.STATUS[seen.status[index]]
        if cells[-1] == "ok":
            c = seen.covariance[index]
            ours = [seen.range[index], seen.bearing[index], c[0, 0], c[0, 1], c[1, 1], seen.x[index], seen.y[index]]
            assert [float(cell) for cell in cells[2:9]] == ours


def test_errors_are_the_cores_words():
    with pytest.raises(ValueError, match="height"):
        finder(height=-0.4)
    with pytest.raises(ValueError, match=r"\(N, 2\)"):
        finder().sight(np.zeros((3, 3)))
    with pytest.raises(ValueError, match="contiguous"):
        finder().sight(np.zeros((2, 8))[:, ::4])
    with pytest.raises(ValueError, match="contiguous"):
        finder().sight(np.asfortranarray(np.full((3, 2), 100.0)))
    with pytest.raises(ValueError, match="camera_matrix"):
        monorange.RangeFinder(np.eye(3) * 2, size=(320, 240), height=0.4, tilt=0.2)
    with pytest.raises(ValueError, match="no such file"):
        monorange.RangeFinder.from_rig("missing.toml")
    with pytest.raises(TypeError):
        finder().sight(np.zeros((3, 2), dtype=np.float32))


def test_a_rig_that_was_written_is_the_same_rig(tmp_path):
    camera = finder(mount_std=[0.01, 0.02, 0.02, 0.02, 0.0, 0.0])
    camera.write_rig(tmp_path / "rig.toml")
    again = monorange.RangeFinder.from_rig(tmp_path / "rig.toml")
    assert again.mount == pytest.approx(camera.mount, abs=1e-10)
    assert again.mount_std == pytest.approx(camera.mount_std, abs=1e-10)


def test_arrays_go_in_and_out_without_copies():
    many = np.full((1000, 2), 150.0)
    part = many[100:200]  # a view that is contiguous
    seen = finder().sight(part)
    for array in (seen.range, seen.bearing, seen.x, seen.y, seen.covariance, seen.status):
        assert len(array) == 100 and array.flags.c_contiguous and array.flags.writeable
        assert not array.flags.owndata, "numpy has the memory that Rust filled, and no copy of it"
    many.setflags(write=False)
    assert np.array_equal(finder().sight(many).range[:100], seen.range)


def test_every_public_name_has_a_docstring_and_a_type():
    stub = (pathlib.Path(monorange.__file__).parent / "__init__.pyi").read_text()
    for name in monorange.__all__:
        assert name in stub, name
        if name not in ("STATUS", "__version__"):
            assert getattr(monorange, name).__doc__, name
    for kind in (monorange.RangeFinder, monorange.Extractor, monorange.Drive, monorange.Device):
        for name in vars(kind):
            if not name.startswith("_"):
                assert getattr(kind, name).__doc__ and f"def {name}(" in stub, f"{kind.__name__}.{name}"

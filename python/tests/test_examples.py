"""The examples run as they stand."""

import importlib.util
import pathlib
import subprocess
import sys
import types

import numpy as np
import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[1] / "examples"


def load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(*words):
    done = subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_tutorial_makes_a_map_and_draws_it(drive, tmp_path):
    said = run(EXAMPLES / "tutorial.py", drive, tmp_path / "map.png")
    error = float(said.split("position error ")[1].split(" m")[0])
    assert error < 0.1
    assert (tmp_path / "map.png").read_bytes()[:4] == b"\x89PNG"


def test_boxes_become_ranges(drive, tmp_path):
    (tmp_path / "boxes.csv").write_text("label,u0,v0,u1,v1\nchair,140,100,180,200\nlamp,10,0,20,10\n")
    chair, lamp = run(EXAMPLES / "boxes.py", drive / "rig.toml", tmp_path / "boxes.csv").splitlines()
    assert chair.startswith("chair: ") and " ± " in chair
    assert lamp == "lamp: above_horizon"


def test_one_drive_of_a_fleet_is_the_drive(drive, tmp_path):
    run(EXAMPLES / "fleet.py", "--one", drive, tmp_path)
    found = np.load(tmp_path / f"{drive.name}.npz")
    assert len(found["times"]) == len(found["poses"]) == 20
    assert not list(tmp_path.glob("*.part"))


class Message(types.SimpleNamespace):
    """Stands for any message of ROS: fields appear when they are asked for."""

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        value = Message()
        setattr(self, name, value)
        return value


@pytest.fixture
def rclpy_stub(monkeypatch, drive):
    """A stub of rclpy, since ROS 2 is no package of PyPI: topics are dictionaries, nothing runs by itself."""
    published = {}

    class Node:
        def __init__(self, name):
            self.subscribed, self.warnings = {}, []

        def declare_parameter(self, name, default):
            return Message(value=str(drive / "rig.toml") if name == "rig" else default)

        def create_publisher(self, kind, topic, depth):
            return Message(publish=published.setdefault(topic, []).append)

        def create_subscription(self, kind, topic, callback, qos):
            self.subscribed[topic] = callback

        def get_logger(self):
            return Message(warning=self.warnings.append)

    modules = {
        "rclpy": {}, "rclpy.node": {"Node": Node}, "rclpy.qos": {"qos_profile_sensor_data": 1},
        "geometry_msgs": {}, "geometry_msgs.msg": {"Point32": Message, "PoseWithCovarianceStamped": Message},
        "nav_msgs": {}, "nav_msgs.msg": {"Odometry": Message},
        "sensor_msgs": {}, "sensor_msgs.msg": {"Image": Message, "PointCloud": Message},
    }
    for name, content in modules.items():
        module = types.ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    return published


def test_the_ros2_node_makes_the_drive_with_a_stub_of_rclpy(rclpy_stub, drive, pictures, command, tmp_path):
    import csv

    node = load("ros2_node").Mapper()
    stamp = lambda time: Message(sec=int(time), nanosec=round(time % 1 * 1e9))
    times = [float(word) for word in (drive / "times.txt").read_text().split()]
    with open(drive / "odometry.csv") as file:
        wheels = [[float(row[key]) for key in ("t", "v", "omega")] for row in csv.DictReader(file)]
    events = sorted([(t, 0, (v, w)) for t, v, w in wheels] + [(t, 1, p) for t, p in zip(times, pictures)], key=lambda e: e[:2])
    for time, kind, content in events:
        message = Message(header=Message(stamp=stamp(time)))
        if kind == 0:
            message.twist.twist.linear.x, message.twist.twist.angular.z = content
            node.subscribed["odom"](message)
        else:
            height, width = content.shape
            vars(message).update(encoding="mono8", height=height, width=width, step=width, data=content.tobytes())
            node.subscribed["image"](message)
    assert not node.warnings
    assert len(rclpy_stub["pose"]) == len(times)
    files = [f"--{name}={drive / file}" for name, file in [("rig", "rig.toml"), ("frames", "frames"), ("odometry", "odometry.csv")]]
    subprocess.run([command, "slam", *files, "--out", tmp_path], check=True, capture_output=True)
    with open(tmp_path / "trajectory.csv") as file:
        last = list(csv.DictReader(file))[-1]
    pose = rclpy_stub["pose"][-1].pose.pose
    assert [pose.position.x, pose.position.y] == pytest.approx([float(last["x"]), float(last["y"])], abs=1e-4)
    assert 2 * np.arctan2(pose.orientation.z, pose.orientation.w) == pytest.approx(float(last["heading"]), abs=1e-4)
    assert all(len(cloud.points) for cloud in rclpy_stub["corners"][:3])

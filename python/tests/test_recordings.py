"""Recordings of ROS 2: what other programs write is read, and what we write others read.

PyPI's `rosbags` writes MCAP and SQLite, `mcap`, `mcap-ros2-support` and `rosbags` read ours.
"""

import csv
import subprocess

import numpy as np
import pytest

rosbags = pytest.importorskip("rosbags", reason="pip install rosbags mcap mcap-ros2-support: oracles of recordings")
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402

STORE = get_typestore(Stores.ROS2_HUMBLE)
KINDS = STORE.types
OUTPUTS = ["trajectory.tum", "trajectory.csv", "map.csv", "observations.csv"]


def stamp(text):
    """A time's decimal text as a stamp."""
    whole, _, rest = text.partition(".")
    return KINDS["builtin_interfaces/msg/Time"](sec=int(whole), nanosec=int((rest + "0" * 9)[:9]))


def header(text, frame):
    return KINDS["std_msgs/msg/Header"](stamp=stamp(text), frame_id=frame)


def vector(x=0.0, y=0.0, z=0.0):
    return KINDS["geometry_msgs/msg/Vector3"](x=float(x), y=float(y), z=float(z))


def quaternion(matrix):
    """Of a rotation matrix: the eigenvector of its largest eigenvalue (Bar-Itzhack)."""
    m = matrix
    k = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
            [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
            [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], np.trace(m)],
        ]
    )
    x, y, z, w = np.linalg.eigh(k)[1][:, -1]
    return KINDS["geometry_msgs/msg/Quaternion"](x=float(x), y=float(y), z=float(z), w=float(w))


def mount(height, tilt, roll, yaw, forward, left):
    """The link from base_link to the camera's optical frame."""
    (sy, cy), (st, ct), (sr, cr) = ((np.sin(a), np.cos(a)) for a in (yaw, tilt, roll))
    turn = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ [[ct, 0, st], [0, 1, 0], [-st, 0, ct]]
    turn = turn @ [[1, 0, 0], [0, cr, -sr], [0, sr, cr]] @ [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    transform = KINDS["geometry_msgs/msg/Transform"](translation=vector(forward, left, height), rotation=quaternion(turn))
    link = KINDS["geometry_msgs/msg/TransformStamped"](header("0", "base_link"), "camera_optical", transform)
    return KINDS["tf2_msgs/msg/TFMessage"](transforms=[link])


def camera_info(finder_matrix, lens, size):
    roi = KINDS["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    eye = np.eye(3).ravel()
    return KINDS["sensor_msgs/msg/CameraInfo"](
        header("0", "camera_optical"), size[1], size[0], "plumb_bob", np.array(lens), np.array(finder_matrix).ravel(), eye,
        np.hstack([np.array(finder_matrix), np.zeros((3, 1))]).ravel(), 0, 0, roi,
    )


def images(pictures, texts, encoding):
    for text, picture in zip(texts, pictures):
        at = header(text, "camera_optical")
        if encoding == "png":
            import io

            from PIL import Image

            out = io.BytesIO()
            Image.fromarray(picture).save(out, "PNG")
            data = np.frombuffer(out.getvalue(), np.uint8)
            yield text, KINDS["sensor_msgs/msg/CompressedImage"](at, "mono8; png compressed", data)
        else:
            channels = {"mono8": 1, "bgr8": 3}[encoding]
            data = np.repeat(picture.ravel(), channels)
            height, width = picture.shape
            yield text, KINDS["sensor_msgs/msg/Image"](at, height, width, encoding, 0, width * channels, data)


def write(path, storage, folder, pictures, encoding="mono8", compression=None):
    """The drive of a folder as a recording."""
    texts = (folder / "times.txt").read_text().split()
    with open(folder / "odometry.csv") as file:
        wheels = list(csv.DictReader(file))
    writer = Writer(path, version=9, storage_plugin=storage)
    if compression:
        writer.set_compression(*compression)
    with writer:

        def topic(name, kind):
            connection = writer.add_connection(name, kind, typestore=STORE)

            def put(text, message):
                at = stamp(text)
                writer.write(connection, at.sec * 10**9 + at.nanosec, STORE.serialize_cdr(message, kind))

            return put

        kind = "sensor_msgs/msg/CompressedImage" if encoding == "png" else "sensor_msgs/msg/Image"
        put_image = topic("/camera/image_raw", kind)
        put_odometry = topic("/odom", "nav_msgs/msg/Odometry")
        put_info = topic("/camera/camera_info", "sensor_msgs/msg/CameraInfo")
        topic("/tf_static", "tf2_msgs/msg/TFMessage")("0", mount(*MOUNT))
        put_info("0", camera_info(MATRIX, LENS, (320, 240)))
        for text, image in images(pictures, texts, encoding):
            put_image(text, image)
        nothing = KINDS["geometry_msgs/msg/PoseWithCovariance"](
            KINDS["geometry_msgs/msg/Pose"](
                KINDS["geometry_msgs/msg/Point"](0.0, 0.0, 0.0), KINDS["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
            ),
            np.zeros(36),
        )
        for row in wheels:
            twist = KINDS["geometry_msgs/msg/Twist"](vector(row["v"]), vector(0, 0, row["omega"]))
            twist = KINDS["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36))
            put_odometry(row["t"], KINDS["nav_msgs/msg/Odometry"](header(row["t"], "odom"), "base_link", nothing, twist))


def rig_of(folder):
    import tomllib

    rig = tomllib.loads((folder / "rig.toml").read_text())
    camera, mount = rig["camera"], rig["mount"]
    (fu, fv), (u0, v0) = camera["focal"], camera["principal"]
    angles = [np.radians(mount.get(f"{name}_deg", 0.0)) for name in ("tilt", "roll", "yaw")]
    parameters = [mount["height"], *angles, mount.get("forward", 0.0), mount.get("left", 0.0)]
    return [[fu, 0.0, u0], [0.0, fv, v0], [0.0, 0.0, 1.0]], camera["distortion"], parameters


def slam(command, out, *words):
    run = subprocess.run([command, "slam", *map(str, words), "--out", out], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return {name: (out / name).read_bytes() for name in OUTPUTS}


@pytest.fixture(scope="module")
def from_folder(command, drive, tmp_path_factory):
    global MATRIX, LENS, MOUNT
    MATRIX, LENS, MOUNT = rig_of(drive)
    words = ["--rig", drive / "rig.toml", "--frames", drive / "frames", "--odometry", drive / "odometry.csv"]
    return slam(command, tmp_path_factory.mktemp("folder"), *words)


@pytest.mark.parametrize(
    "storage, encoding, compression",
    [
        (StoragePlugin.MCAP, "mono8", None),
        (StoragePlugin.MCAP, "bgr8", None),
        (StoragePlugin.MCAP, "png", None),
        (StoragePlugin.SQLITE3, "mono8", None),
        (StoragePlugin.SQLITE3, "png", (CompressionMode.MESSAGE, CompressionFormat.ZSTD)),
    ],
)
def test_a_recording_gives_what_its_folder_gives_byte_for_byte(
    command, drive, pictures, from_folder, tmp_path, storage, encoding, compression
):
    write(tmp_path / "bag", storage, drive, pictures, encoding, compression)
    assert slam(command, tmp_path / "out", "--rig", drive / "rig.toml", "--bag", tmp_path / "bag") == from_folder
    # Without a rig the recording's own camera and mount are taken: the same but for the deviations that it cannot know.
    slam(command, tmp_path / "own", "--bag", tmp_path / "bag")


def packed(plain, target, compression):
    """The messages of a recording in the order of their times, in chunks of 200 kB."""
    from mcap.reader import make_reader
    from mcap.writer import CompressionType
    from mcap.writer import Writer as McapWriter

    with open(plain, "rb") as source, open(target, "wb") as file:
        writer = McapWriter(file, compression=CompressionType[compression], chunk_size=200_000)
        writer.start("ros2")
        channels = {}
        for schema, channel, message in make_reader(source).iter_messages():
            if channel.id not in channels:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, known)
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        writer.finish()
    return target


@pytest.mark.parametrize("compression", ["NONE", "LZ4", "ZSTD"])
def test_packed_chunks_are_unpacked(command, drive, pictures, from_folder, tmp_path, compression):
    write(tmp_path / "bag", StoragePlugin.MCAP, drive, pictures)
    bag = packed(next((tmp_path / "bag").glob("*.mcap")), tmp_path / "packed.mcap", compression)
    assert slam(command, tmp_path / "out", "--rig", drive / "rig.toml", "--bag", bag) == from_folder


def test_what_we_write_is_read_by_mcap_and_rosbags(command, drive, from_folder, tmp_path):
    from mcap_ros2.reader import read_ros2_messages
    from rosbags.highlevel import AnyReader

    made = tmp_path / "out.mcap"
    words = ["--rig", drive / "rig.toml", "--frames", drive / "frames", "--odometry", drive / "odometry.csv"]
    assert slam(command, tmp_path / "out", *words, "--mcap", made) == from_folder
    # The recording has its scans without --scan too.
    assert not (tmp_path / "out" / "scan.csv").exists()
    assert slam(command, tmp_path / "scanned", *words, "--scan") == from_folder
    rows = [[float(cell) for cell in line.split(",")] for line in from_folder["trajectory.csv"].decode().splitlines()[1:]]
    landmarks = from_folder["map.csv"].decode().splitlines()[1:]

    by_topic = {}
    for message in read_ros2_messages(made):
        by_topic.setdefault(message.channel.topic, []).append(message.ros_msg)
    assert {topic: len(messages) for topic, messages in by_topic.items()}.items() >= {
        "/monorange/odometry": len(rows), "/monorange/pose": len(rows), "/monorange/overlay/compressed": len(rows),
        "/monorange/scan": len(rows), "/monorange/camera_info": len(rows), "/tf": len(rows), "/tf_static": 1,
    }.items()
    for pose, row in zip(by_topic["/monorange/pose"], rows):
        time, x, y, heading, xx, xy, xh, yy, yh, hh = row
        assert pose.header.stamp.sec + 1e-9 * pose.header.stamp.nanosec == pytest.approx(time, abs=1e-9)
        place, turn = pose.pose.pose.position, pose.pose.pose.orientation
        assert [place.x, place.y, 2 * np.arctan2(turn.z, turn.w)] == pytest.approx([x, y, heading], abs=1e-12)
        assert list(pose.pose.covariance[0:2]) + [pose.pose.covariance[35]] == pytest.approx([xx, xy, hh], rel=1e-6)
    assert by_topic["/monorange/map"][-1].width == len(landmarks)
    jpeg = bytes(by_topic["/monorange/overlay/compressed"][0].data)
    assert jpeg[:2] == b"\xff\xd8"

    with AnyReader([made]) as reader:
        connections = [connection for connection in reader.connections if connection.topic == "/monorange/map"]
        *_, (connection, _, raw) = reader.messages(connections=connections)
        cloud = reader.deserialize(raw, connection.msgtype)
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "id", "sigma"]
    points = np.frombuffer(bytes(cloud.data), "<f4").reshape(-1, 5)
    places = [[float(cell) for cell in line.split(",")[1:3]] for line in landmarks]
    assert np.allclose(points[:, :2], places, atol=1e-6)

    with AnyReader([made]) as reader:
        connections = [connection for connection in reader.connections if connection.topic == "/monorange/scan"]
        again = [reader.deserialize(raw, connection.msgtype) for connection, _, raw in reader.messages(connections=connections)]
    check_scans(by_topic["/monorange/scan"], tmp_path / "scanned" / "scan.csv")
    check_scans(again, tmp_path / "scanned" / "scan.csv")


def check_scans(scans, table):
    """The scans of a recording are the rows of `scan.csv`, beam by beam, with REP 117's ranges."""
    with open(table) as file:
        rows = list(csv.DictReader(file))
    beams = len(scans[0].ranges)
    assert len(scans) * beams == len(rows)
    kinds, before = set(), float(rows[0]["t"])
    for index, scan in enumerate(scans):
        beside = rows[index * beams : (index + 1) * beams]
        assert scan.header.frame_id == "scan_origin"
        assert scan.header.stamp.sec + 1e-9 * scan.header.stamp.nanosec == pytest.approx(float(beside[0]["t"]), abs=1e-9)
        angles = scan.angle_min + scan.angle_increment * np.arange(beams)
        assert angles == pytest.approx([float(row["bearing"]) for row in beside], abs=1e-5)
        assert scan.angle_max == pytest.approx(angles[-1], abs=1e-5)
        assert scan.scan_time == pytest.approx(float(beside[0]["t"]) - before, abs=1e-6)
        before = float(beside[0]["t"])
        assert np.array_equal(np.float32(scan.intensities), np.float32([row["free"] for row in beside]))
        ends = {"unknown": np.nan, "beyond": np.inf}
        expected = np.float32([row["range"] or ends[row["kind"]] for row in beside])
        assert np.array_equal(np.float32(scan.ranges), expected, equal_nan=True)
        finite = expected[np.isfinite(expected)]
        assert scan.range_min == 0 and np.all(finite <= np.float32(scan.range_max))
        kinds |= {row["kind"] for row in beside}
    assert {"boundary", "unknown"} <= kinds


def test_what_is_not_there_is_said_with_what_is(command, drive, pictures, from_folder, tmp_path):
    write(tmp_path / "bag", StoragePlugin.MCAP, drive, pictures[:2])

    def refused(*words):
        run = subprocess.run([command, "slam", "--bag", *map(str, words), "--out", tmp_path / "out"], capture_output=True, text=True)
        assert run.returncode == 1
        return run.stderr

    missing = refused(tmp_path / "bag", "--image-topic", "/front/image")
    assert "/front/image" in missing and "/camera/image_raw (sensor_msgs/msg/Image, 2)" in missing and "/odom" in missing
    wrong = refused(tmp_path / "bag", "--image-topic", "/odom")
    assert "nav_msgs/msg/Odometry" in wrong and "--image-topic" in wrong
    assert "no such file" in refused(tmp_path / "nothing.mcap")
    assert "neither MCAP" in refused(drive / "rig.toml")


def test_a_recording_that_was_cut_off_gives_what_is_there(command, drive, pictures, from_folder, tmp_path):
    write(tmp_path / "bag", StoragePlugin.MCAP, drive, pictures)
    whole = packed(next((tmp_path / "bag").glob("*.mcap")), tmp_path / "whole.mcap", "ZSTD").read_bytes()

    def run(name, content):
        (tmp_path / name).write_bytes(content)
        words = [command, "slam", "--rig", drive / "rig.toml", "--bag", tmp_path / name, "--out", tmp_path / "out"]
        return subprocess.run(words, capture_output=True, text=True)

    half = run("half.mcap", whole[: len(whole) // 2])
    assert half.returncode == 0 and half.stderr.startswith("warning: ") and "ends early" in half.stderr
    poses = (tmp_path / "out" / "trajectory.tum").read_text().splitlines()
    assert 3 < len(poses) < len(pictures)
    for first in (8, 20, 100, 2000):
        start = run("start.mcap", whole[:first])
        assert start.returncode == 1 and "cut off before its first picture" in start.stderr, first
        assert "help: copy the file again" in start.stderr, first
    assert "is empty" in run("empty.mcap", b"").stderr

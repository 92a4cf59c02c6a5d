"""A ROS 2 node: pictures and odometry in, the robot's pose and the floor corners out.

    ros2 launch ros2_launch.py rig:=/path/rig.toml

Subscribes `image` (sensor_msgs/Image, mono8 or bgr8/rgb8) and `odom` (nav_msgs/Odometry); publishes `pose`
(geometry_msgs/PoseWithCovarianceStamped) and `corners` (sensor_msgs/PointCloud, robot frame).
"""

import numpy as np
import rclpy
from geometry_msgs.msg import Point32, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image, PointCloud

import monorange


class Mapper(Node):
    def __init__(self):
        super().__init__("monorange")
        finder = monorange.RangeFinder.from_rig(self.declare_parameter("rig", "rig.toml").value)
        self.drive = monorange.Drive(finder, max_landmarks=self.declare_parameter("max_landmarks", 512).value)
        self.world = self.declare_parameter("map_frame", "map").value
        self.robot = self.declare_parameter("base_frame", "base_link").value
        self.moves, self.reached = [], None
        self.poses = self.create_publisher(PoseWithCovarianceStamped, "pose", 10)
        self.corners = self.create_publisher(PointCloud, "corners", 10)
        self.create_subscription(Odometry, "odom", self.moved, 50)
        self.create_subscription(Image, "image", self.seen, qos_profile_sensor_data)

    def moved(self, odometry):
        twist = odometry.twist.twist
        self.moves.append((seconds(odometry.header.stamp), twist.linear.x, twist.angular.z))

    def seen(self, image):
        now = seconds(image.header.stamp)
        # A speed holds until the next one is told; what is older than the last picture is done with.
        ends = [move[0] for move in self.moves[1:]] + [np.inf]
        for (start, v, omega), end in zip(self.moves, ends):
            start = start if self.reached is None else max(start, self.reached)
            if start < min(end, now) and self.reached is not None:
                self.drive.odometry(start, min(end, now), v, omega)
        self.moves = [move for move, end in zip(self.moves, ends) if end > now]
        self.reached = now
        try:
            step = self.drive.picture(now, grey(image))
        except ValueError as error:
            self.get_logger().warning(f"picture left out: {error}")
            return
        self.publish(image.header.stamp, step)

    def publish(self, stamp, step):
        out = PoseWithCovarianceStamped()
        out.header.stamp, out.header.frame_id = stamp, self.world
        (x, y, heading), pose = step.pose, out.pose.pose
        pose.position.x, pose.position.y = float(x), float(y)
        pose.orientation.z, pose.orientation.w = float(np.sin(heading / 2)), float(np.cos(heading / 2))
        covariance = np.zeros((6, 6))
        covariance[np.ix_([0, 1, 5], [0, 1, 5])] = step.covariance
        out.pose.covariance = covariance.ravel().tolist()
        self.poses.publish(out)
        cloud = PointCloud()
        cloud.header.stamp, cloud.header.frame_id = stamp, self.robot
        near = np.isfinite(step.range)
        xs, ys = step.range * np.cos(step.bearing), step.range * np.sin(step.bearing)
        cloud.points = [Point32(x=float(x), y=float(y), z=0.0) for x, y in zip(xs[near], ys[near])]
        self.corners.publish(cloud)


def seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


def grey(image):
    """The grey of a picture, without a copy where it is grey already."""
    channels = {"mono8": 1, "8UC1": 1, "bgr8": 3, "rgb8": 3}.get(image.encoding)
    if channels is None:
        raise ValueError(f"the encoding {image.encoding} is not mono8, bgr8 or rgb8")
    rows = np.frombuffer(image.data, np.uint8).reshape(image.height, image.step)[:, : image.width * channels]
    if channels == 1:
        return np.ascontiguousarray(rows)
    weights = np.array([0.2126, 0.7152, 0.0722]) if image.encoding == "rgb8" else np.array([0.0722, 0.7152, 0.2126])
    return (rows.reshape(image.height, image.width, 3) @ weights + 0.5).astype(np.uint8)


def main():
    rclpy.init()
    try:
        rclpy.spin(Mapper())
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()

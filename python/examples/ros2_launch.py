"""Starts `ros2_node.py` with a rig: ros2 launch ros2_launch.py rig:=rig.toml image:=/camera/image_raw odom:=/odom"""

import pathlib

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration

NODE = str(pathlib.Path(__file__).with_name("ros2_node.py"))
ARGUMENTS = {"rig": "rig.toml", "image": "/camera/image_raw", "odom": "/odom", "map_frame": "map", "base_frame": "base_link"}


def generate_launch_description():
    declared = [DeclareLaunchArgument(name, default_value=value) for name, value in ARGUMENTS.items()]
    words = ["python3", NODE, "--ros-args"]
    for topic in ("image", "odom"):
        words += ["-r", [topic, ":=", LaunchConfiguration(topic)]]
    for parameter in ("rig", "map_frame", "base_frame"):
        words += ["-p", [parameter, ":=", LaunchConfiguration(parameter)]]
    return LaunchDescription([*declared, ExecuteProcess(cmd=words, output="screen")])

"""Listens for MAVLink on a port of its own and prints what comes, a message a line, as JSON.

Prints the port first. Ends after as many ODOMETRY messages as it is told, and the scan that follows the last.
"""

import json
import sys

from pymavlink import mavutil

wanted = int(sys.argv[1])
line = mavutil.mavlink_connection("udpin:127.0.0.1:0", dialect="common")
print(line.port.getsockname()[1], flush=True)
poses = 0
while message := line.recv_match(blocking=True, timeout=120):
    kind = message.get_type()
    if kind == "BAD_DATA":
        sys.exit(f"pymavlink does not understand {message}")
    sender = {"system": message.get_srcSystem(), "component": message.get_srcComponent()}
    # NaN, as ODOMETRY's deviations of the speed, is no JSON.
    fields = {key: None if value != value else value for key, value in message.to_dict().items() if key != "velocity_covariance"}
    print(json.dumps(fields | sender), flush=True)
    poses += kind == "ODOMETRY"
    if poses == wanted and kind == "OBSTACLE_DISTANCE":
        break

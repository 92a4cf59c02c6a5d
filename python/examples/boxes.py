"""A detector's boxes to ranges: the middle of a box's lower edge is where the thing stands on the floor.

    python boxes.py rig.toml boxes.csv      # boxes.csv: label,u0,v0,u1,v1 (px)
"""

import csv
import sys

import numpy as np

import monorange


def ranges(finder, boxes, edge_std=2.0):
    """Range and bearing of the feet of (N, 4) boxes u0, v0, u1, v1.

    A box's lower edge is good to `edge_std` px; across, the foot is somewhere in the box: a sixth of its width.
    """
    boxes = np.asarray(boxes, np.float64).reshape(-1, 4)
    seen = []
    for u0, _, u1, v1 in boxes:
        foot = np.array([[0.5 * (u0 + u1), v1]])
        seen.append(finder.sight(foot, pixel_std=(max(abs(u1 - u0) / 6, edge_std), edge_std)))
    return seen


def main(rig, table):
    finder = monorange.RangeFinder.from_rig(rig)
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    boxes = [[float(row[name]) for name in ("u0", "v0", "u1", "v1")] for row in rows]
    for row, seen in zip(rows, ranges(finder, boxes)):
        if seen.ok[0]:
            print(f"{row['label']}: {seen.range[0]:.2f} ± {seen.range_std[0]:.2f} m, {np.degrees(seen.bearing[0]):+.1f} deg")
        else:
            print(f"{row['label']}: {monorange.STATUS[seen.status[0]]}")


if __name__ == "__main__":
    main(*sys.argv[1:3])

#!/usr/bin/env python3
"""Floor corners from plain crossings of LSD segments, beside ours: recall and precision on labelled pictures.

    python tests/peers/lsd_corners.py LABELS.json... [--ours target/release/monorange] [--half]

LABELS is a list of pictures with their rigs and corners (`image`, `rig`, `set`, `corners`, `tolerance` in px of the picture's width,
and corners that are neither asked for nor wrong in `others` and `beyond`). What any line detector finds of such corners: OpenCV's
LSD at a focal length of 370 px, a segment within 20° of the picture's vertical that ends near one within 65° of the
horizontal, below the horizon. No probability, no floor, no motion.

Needs numpy and opencv-python-headless. Says SKIPPED where one of them or a file is missing."""
import argparse
import csv
import json
import math
import os
import re
import subprocess
import sys
import tempfile

try:
    import cv2
    import numpy as np
except ImportError as missing:
    print(f"SKIPPED: {missing}; pip install numpy opencv-python-headless")
    sys.exit(0)

FOCAL = 370.0
LEAST_VERTICAL, LEAST_FLOOR = 12.0, 8.0
"""Lengths of segments, px at FOCAL."""
STEEP, FLAT = math.radians(20.0), math.radians(65.0)
"""Largest angles from the picture's vertical and horizontal."""
REACH = 8.0
"""How far from the ends of both segments they may cross, px at FOCAL."""
SAME = 4.0
"""Crossings nearer than this are one, px at FOCAL."""


def rig_of(path):
    text = open(path).read()
    camera, mount = text.split("[mount]")

    def value(text, name):
        return json.loads(re.search(rf"^{name}\s*=\s*(.+)$", text, re.M).group(1))

    matrix = np.eye(3)
    matrix[0, 0], matrix[1, 1] = value(camera, "focal")
    matrix[:2, 2] = value(camera, "principal")
    tilt, roll = (math.radians(value(mount, name)) for name in ("tilt_deg", "roll_deg"))
    up = np.array([-math.cos(tilt) * math.sin(roll), -math.cos(tilt) * math.cos(roll), -math.sin(tilt)])
    return matrix, np.array(value(camera, "distortion")), up


def crossings(grey, rig):
    """Pixels of the picture where LSD's segments cross, one of each place."""
    matrix, lens, up = rig
    scale = min(1.0, FOCAL / matrix[0, 0])
    if scale < 1.0:
        grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    found = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD).detect(grey)[0]
    if found is None:
        return np.zeros((0, 2))
    segments = found.reshape(-1, 2, 2).astype(float)
    along = segments[:, 1] - segments[:, 0]
    length = np.linalg.norm(along, axis=1)
    angle = np.arctan2(np.abs(along[:, 1]), np.abs(along[:, 0]))
    verticals = segments[(angle > math.pi / 2 - STEEP) & (length >= LEAST_VERTICAL)]
    floors = segments[(angle < FLAT) & (length >= LEAST_FLOOR)]
    places = []
    for vertical in verticals:
        low, high = vertical[np.argsort(-vertical[:, 1])]
        down = (low - high) / np.linalg.norm(low - high)
        for first, last in floors:
            way = last - first
            sine = down[0] * way[1] - down[1] * way[0]
            if abs(sine) < 1e-6:
                continue
            offset = first - low
            below = (offset[0] * way[1] - offset[1] * way[0]) / sine
            share = (offset[0] * down[1] - offset[1] * down[0]) / sine
            beyond = max(0.0, -share, share - 1.0) * np.linalg.norm(way)
            if abs(below) <= REACH and beyond <= REACH:
                places.append((abs(below) + beyond, *(low + below * down)))
    kept = []
    for _, *place in sorted(places):
        if all(math.dist(place, other) >= SAME for other in kept):
            kept.append(place)
    pixels = (np.array(kept).reshape(-1, 2) + 0.5) / scale - 0.5
    rays = cv2.undistortPoints(pixels.reshape(-1, 1, 2), matrix, lens).reshape(-1, 2) if len(pixels) else pixels
    below = up[0] * rays[:, 0] + up[1] * rays[:, 1] + up[2] < 0.0
    return pixels[below]


def ours(binary, rig, picture):
    run = subprocess.run([binary, "landmarks", "--rig", rig, picture], capture_output=True, text=True, check=True)
    return np.array([(float(row["u"]), float(row["v"])) for row in csv.DictReader(run.stdout.splitlines())]).reshape(-1, 2)


def judge(found, entry):
    """Labels found (each by a place of its own), and places that are wrong."""
    pairs = sorted((math.dist(label, place), i, j) for i, label in enumerate(entry["corners"]) for j, place in enumerate(found))
    seen, used = set(), set()
    for distance, i, j in pairs:
        if distance <= entry["tolerance"] and i not in seen and j not in used:
            seen.add(i)
            used.add(j)
    spare = entry.get("others", []) + entry.get("beyond", [])
    wrong = [j for j, place in enumerate(found) if j not in used and all(math.dist(place, c) > entry["tolerance"] for c in spare)]
    return len(seen), len(wrong)


def halved(entry, folder, root):
    """The entry at half the size, its picture and rig in `folder`."""
    grey = cv2.imread(os.path.join(root, entry["image"]), cv2.IMREAD_GRAYSCALE)
    grey = cv2.resize(grey, (grey.shape[1] // 2, grey.shape[0] // 2), interpolation=cv2.INTER_AREA)
    text = open(os.path.join(root, entry["rig"])).read()
    matrix, _, _ = rig_of(os.path.join(root, entry["rig"]))
    values = {
        "width": grey.shape[1],
        "focal": [float(matrix[i, i]) / 2 for i in (0, 1)],
        "principal": [(float(c) + 0.5) / 2 - 0.5 for c in matrix[:2, 2]],
    }
    for name, value in values.items():
        text = re.sub(rf"^{name} = .*$", f"{name} = {value}", text, count=1, flags=re.M)
    text = re.sub(r"^height = \d+$", f"height = {grey.shape[0]}", text, count=1, flags=re.M)
    image, rig = os.path.join(folder, "half.png"), os.path.join(folder, "half.toml")
    cv2.imwrite(image, grey)
    open(rig, "w").write(text)
    half = [[((x + 0.5) / 2 - 0.5) for x in c] for c in entry["corners"]]
    spare = [[((x + 0.5) / 2 - 0.5) for x in c] for c in entry.get("others", []) + entry.get("beyond", [])]
    return {**entry, "image": image, "rig": rig, "corners": half, "others": spare, "beyond": [], "tolerance": entry["tolerance"] / 2}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("labels", nargs="+")
    parser.add_argument("--ours", help="a binary of monorange")
    parser.add_argument("--half", action="store_true", help="the pictures at half their size")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    for labels in options.labels:
        if not os.path.exists(labels):
            print(f"SKIPPED: {labels} is missing")
            continue
        root, totals = os.path.dirname(os.path.abspath(labels)), {}
        with tempfile.TemporaryDirectory() as folder:
            for entry in json.load(open(labels)):
                if options.half:
                    entry = halved(entry, folder, root)
                image, rig = (os.path.join(root, entry[name]) for name in ("image", "rig"))
                methods = {"LSD": crossings(cv2.imread(image, cv2.IMREAD_GRAYSCALE), rig_of(rig))}
                if options.ours:
                    methods["ours"] = ours(options.ours, rig, image)
                for method, found in methods.items():
                    hits, wrong = judge(found, entry)
                    total = totals.setdefault((entry["set"], method), [0, 0, 0])
                    total[0] += hits
                    total[1] += len(entry["corners"])
                    total[2] += wrong
        for (name, method), (hits, labelled, wrong) in totals.items():
            print(
                f"{name:10s} {method:5s} recall {hits}/{labelled} = {hits / max(1, labelled):.2f}, false {wrong},"
                f" precision {hits / max(1, hits + wrong):.2f}"
            )


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Labelled pictures and altered copies of them, for the dump of proposals.

    python tests/scoring/augment.py OUT --stills LABELS.json... --drives FOLDER... [--copies 4] [--every 4]

Writes OUT/NAME/list.tsv (rig, picture: what `proposals` reads) and OUT/NAME/index.json (what `train.py` reads: the labels
of every picture) for each set, named after its folder, and the altered copies beside them. `LABELS.json` is as
`tests/peers/lsd_corners.py` says; a drive is a folder as `monorange simulate` writes one, with `corners.csv` (`frame,id,u,v,visible`)
and `landmarks.csv` with `kind`.

A copy differs in contrast (0.35 to 1.3), gamma, brightness, blur (to 1.2 px at 320 wide), noise, a slow slope of the light, JPEG.
Mirrors are not needed: the score mirrors its input. Deterministic by the copy's number. Needs numpy and opencv-python-headless."""
import argparse
import csv
import json
import math
import os
import re

import cv2
import numpy as np

NEAREST, FARTHEST, LEAST_DEPRESSION = 0.5, 6.0, math.radians(3.0)
"""What of a drive's true corners counts: range on the floor, m, and angle below the horizon."""
SAME_PX = 3.0
"""Corners of a drive nearer than this are one label."""


def altered(grey, random):
    uniform = random.uniform
    x = (grey.astype(np.float32) / 255.0) ** math.exp(uniform(-0.45, 0.45))
    contrast = math.exp(uniform(math.log(0.35), math.log(1.3)))
    mean = x.mean()
    x = mean + contrast * (x - mean) + uniform(-0.12, 0.12)
    blur = uniform(0.3, 1.2) * max(1.0, grey.shape[1] / 320.0)
    if random.random() < 0.45:
        x = cv2.GaussianBlur(x, (0, 0), blur)
    x = x + random.normal(size=x.shape) * math.exp(uniform(math.log(0.001), math.log(0.012)))
    if random.random() < 0.2:
        rows, columns = np.mgrid[0 : x.shape[0], 0 : x.shape[1]]
        x *= 1 + uniform(-0.25, 0.25) * (columns / x.shape[1] - 0.5) + uniform(-0.25, 0.25) * (rows / x.shape[0] - 0.5)
    x = np.clip(np.rint(x * 255.0), 0, 255).astype(np.uint8)
    if random.random() < 0.35:
        quality = int(uniform(55, 95))
        x = cv2.imdecode(cv2.imencode(".jpg", x, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_GRAYSCALE)
    return x


def stills(labels):
    root = os.path.dirname(os.path.abspath(labels))
    for entry in json.load(open(labels)):
        yield {
            "set": entry["set"],
            "group": f"{entry['set']}{entry.get('seed', '')}",
            "picture": os.path.join(root, entry["image"]),
            "rig": os.path.join(root, entry["rig"]),
            "tolerance": entry["tolerance"],
            "corners": entry["corners"],
            "spare": entry.get("others", []) + entry.get("beyond", []),
            "label": list(range(len(entry["corners"]))),
            "wanted": [True] * len(entry["corners"]),
        }


def drive(folder, every):
    """Every so many pictures of a drive. A label is a group of true corners; furniture's are not asked for, but right."""
    marks = list(csv.DictReader(open(f"{folder}/landmarks.csv")))
    poses = [[float(x) for x in line.split()] for line in open(f"{folder}/truth.tum") if line.strip()]
    width = int(re.search(r"^width = (\d+)", open(f"{folder}/rig.toml").read(), re.M).group(1))
    height = json.load(open(f"{folder}/true_mount.json"))["height"]
    seen = {}
    for row in csv.DictReader(open(f"{folder}/corners.csv")):
        if row["visible"] == "1":
            seen.setdefault(int(row["frame"]), []).append((int(row["id"]), float(row["u"]), float(row["v"])))
    tolerance = SAME_PX * width / 320.0
    for frame in range(0, len(poses), every):
        corners, kinds, far = [], [], []
        for mark, u, v in seen.get(frame, []):
            away = math.dist((float(marks[mark]["x"]), float(marks[mark]["y"])), poses[frame][1:3])
            if NEAREST <= away <= FARTHEST and math.atan2(height, away) >= LEAST_DEPRESSION:
                corners.append([u, v])
                kinds.append(marks[mark]["kind"])
            else:
                far.append([u, v])
        label = list(range(len(corners)))
        for a in range(len(corners)):
            for b in range(a):
                if math.dist(corners[a], corners[b]) < tolerance:
                    old, new = label[a], label[b]
                    label = [new if one == old else one for one in label]
        structure = {one for one, kind in zip(label, kinds) if kind != "furniture"}
        yield {
            "set": os.path.basename(folder.rstrip("/")),
            "group": f"{os.path.basename(folder.rstrip('/'))}{frame // 25}",
            "picture": os.path.join(folder, "frames", f"{frame:06d}.png"),
            "rig": f"{folder}/rig.toml",
            "tolerance": tolerance,
            "corners": corners,
            "spare": [],
            "also_right": far,
            "label": label,
            "wanted": [one in structure for one in label],
        }


def write(out, name, entries, copies):
    folder = os.path.join(out, name)
    os.makedirs(folder, exist_ok=True)
    index, pairs = [], []
    for number, entry in enumerate(entries):
        grey = cv2.imread(entry["picture"], cv2.IMREAD_GRAYSCALE)
        for copy in range(copies + 1):
            picture = entry["picture"]
            if copy:
                picture = os.path.join(folder, f"{number:04d}_{copy}.png")
                if not os.path.exists(picture):
                    cv2.imwrite(picture, altered(grey, np.random.default_rng([number, copy])))
            pairs.append(f"{entry['rig']}\t{picture}")
            index.append({**entry, "picture": picture, "copy": copy})
    with open(os.path.join(folder, "list.tsv"), "w") as file:
        file.write("\n".join(pairs) + "\n")
    with open(os.path.join(folder, "index.json"), "w") as file:
        json.dump(index, file)
    print(f"{name}: {len(index)} pictures, {sum(len(one['corners']) for one in index)} labels")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out")
    parser.add_argument("--stills", nargs="*", default=[])
    parser.add_argument("--drives", nargs="*", default=[])
    parser.add_argument("--copies", type=int, default=4)
    parser.add_argument("--every", type=int, default=4)
    options = parser.parse_args()
    for labels in options.stills:
        name = os.path.basename(os.path.dirname(os.path.abspath(labels)))
        write(options.out, name, stills(labels), options.copies)
    for folder in options.drives:
        write(options.out, os.path.basename(folder.rstrip("/")), drive(folder, options.every), options.copies)


if __name__ == "__main__":
    main()

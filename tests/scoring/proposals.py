"""Proposals with labels: the dump of `proposals` joined to the labels of `augment.py`, turned so that left and right do not matter."""
import json
import math
import os
import tomllib

import numpy as np

PATCH, CONTEXT = 16, 12
"""Samples along a side of the two pictures round a proposal."""
UNIT_FOCAL = 370.0
"""Focal length of the units that lengths are given in."""
EXCHANGED = {
    "above_left": "above_right", "below_left": "below_right",
    **{f"left_{n}": f"right_{n}" for n in ("points", "length", "begin", "gradient", "width", "residual", "fall", "brighter_below", "sight")},
}
"""Features that the mirror exchanges."""


class Picture:
    """The proposals of one picture, one a row."""

    def __init__(self, entry, rows, names):
        self.entry = entry
        column = {name: rows[:, i] for i, name in enumerate(names)}
        self.pixel = np.stack([column["u"], column["v"]], 1)
        self.ideal = np.stack([column["iu"], column["iv"]], 1)
        self.range = column["range"]
        self.before = column["probability"]
        first = names.index("var_v") + 1
        last = names.index("p0")
        self.names = names[first:last]
        self.features = rows[:, first:last].copy()
        self.patch = rows[:, last : last + PATCH * PATCH].reshape(-1, PATCH, PATCH).astype(np.uint8)
        self.context = rows[:, last + PATCH * PATCH :].reshape(-1, CONTEXT, CONTEXT).astype(np.uint8)
        self.place(entry["rig"])
        self.turn()
        self.label()

    def place(self, rig):
        """Pixels to a unit, the camera's height, and the way down at every proposal."""
        with open(rig, "rb") as file:
            rig = tomllib.load(file)
        camera, mount = rig["camera"], rig["mount"]
        focal, principal = np.array(camera["focal"]), np.array(camera["principal"])
        tilt, roll = (math.radians(mount.get(name, 0.0)) for name in ("tilt_deg", "roll_deg"))
        up = np.array([-math.cos(tilt) * math.sin(roll), -math.cos(tilt) * math.cos(roll), -math.sin(tilt)])
        rays = (self.ideal - principal) / focal
        down = (rays * up[2] - up[:2]) * focal
        self.down = down / np.maximum(np.linalg.norm(down, axis=1, keepdims=True), 1e-9)
        self.unit, self.height = focal.mean() / UNIT_FOCAL, mount["height"]

    def turn(self):
        """Mirrors what is brighter on the left of its vertical edge, or falls more to the left where it has none."""
        at = {name: i for i, name in enumerate(self.names)}
        polarity, left, right = (self.features[:, at[name]] for name in ("vertical_brighter_right", "left_fall", "right_fall"))
        turned = (polarity < 0) | ((polarity == 0) & (left > right))
        for one, other in EXCHANGED.items():
            i, j = at[one], at[other]
            self.features[np.ix_(turned, [i, j])] = self.features[np.ix_(turned, [j, i])]
        for name in ("left_sight", "right_sight"):
            self.features[turned, at[name]] *= -1
        self.patch[turned] = self.patch[turned][:, :, ::-1]
        self.context[turned] = self.context[turned][:, :, ::-1]

    def label(self):
        """1 within the tolerance of a true corner, 0 far from all, −1 where it is neither right nor wrong."""
        entry, count = self.entry, len(self.pixel)
        self.right, self.nearest, self.distance = np.zeros(count, int), np.full(count, -1), np.full(count, 99.0)

        def distances(places):
            places = np.array(places, float).reshape(-1, 2)
            return np.linalg.norm(self.pixel[:, None] - places[None], axis=2) / entry["tolerance"]

        if entry["corners"]:
            apart = distances(entry["corners"])
            self.nearest, self.distance = apart.argmin(1), apart.min(1)
            self.right[self.distance <= 1.0] = 1
        for places, value in ((entry["spare"], -1), (entry.get("also_right", []), 1)):
            if places:
                self.right[(self.right == 0) & (distances(places).min(1) <= 1.0)] = value


def read(folder):
    """The pictures of a set: `index.json` and `dump.csv` in a folder."""
    entries = json.load(open(os.path.join(folder, "index.json")))
    cache = os.path.join(folder, "dump.npz")
    path = os.path.join(folder, "dump.csv")
    with open(path) as file:
        names = file.readline().strip().split(",")[1:]
        if not os.path.exists(cache) or os.path.getmtime(cache) < os.path.getmtime(path):
            pictures, rows = [], []
            for line in file:
                picture, _, values = line.partition(",")
                pictures.append(picture)
                rows.append(np.array(values.split(","), np.float32))
            np.savez(cache, pictures=np.array(pictures), rows=np.array(rows, np.float32).reshape(-1, len(names)))
    saved = np.load(cache)
    where = {}
    for i, picture in enumerate(saved["pictures"]):
        where.setdefault(str(picture), []).append(i)
    rows = saved["rows"]
    return [Picture(entry, rows[where.get(entry["picture"], [])], names) for entry in entries]


def suppress(picture, odds, skirting=0.16, same=6.0, across=5.0, lower_odds=0.5):
    """The rows that stay when of several proposals in one place one is chosen, as `core/src/proposals/decision.rs` does."""
    free = np.ones(len(odds), bool)
    chosen = []
    along = (picture.ideal * picture.down).sum(1)

    def rivals(k):
        moved = picture.ideal - picture.ideal[k]
        near = (moved**2).sum(1) < (same * picture.unit) ** 2
        down = picture.down[k]
        beside = np.abs(moved[:, 1] * down[0] - moved[:, 0] * down[1]) < across * picture.unit
        nearer, farther = (choice(picture.range, picture.range[k]) for choice in (np.minimum, np.maximum))
        return near | (beside & (picture.height * (1.0 - nearer / farther) < skirting))

    for k in np.argsort(-odds, kind="stable"):
        if not free[k]:
            continue
        here = rivals(k)
        lower = [j for j in np.flatnonzero(here & free) if along[j] > along[k] and odds[j] >= odds[k] - lower_odds]
        best = max(lower, key=lambda j: along[j], default=k)
        chosen.append(best)
        free &= ~(here | rivals(best))
        free[[k, best]] = False
    return chosen

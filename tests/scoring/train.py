#!/usr/bin/env python3
"""Fits the score that tells floor corners from false ones, judges it on what it was not fitted to, and writes its weights.

    python tests/scoring/augment.py SETS --stills stills/corners.json real/corners.json --drives dev_office dev_home
    for each set:  cargo run --release -p monorange-tests --example proposals SETS/NAME/list.tsv SETS/NAME/dump.csv
    python tests/scoring/train.py SETS judge                 # every set judged by a fit without it
    python tests/scoring/train.py SETS write WEIGHTS.rs      # fitted on all but the judges

Judges (`real`, `half`) are never fitted to. Stills are judged by five folds of their seeds, drives by fits without
that drive. Needs numpy."""
import os
import sys

import numpy as np

import network
import weights
from inputs import Inputs, plain
from proposals import read, suppress

JUDGES = ("real", "half")
FOLDS = 5
WEIGHTS = {"dev_": 0.5, "sim_": 0.4}
"""Of a proposal beside one on a still, by the beginning of its set's name: a drive's neighbours in time look alike, and the
simulator's places are all of one kind."""
UNITS, EPOCHS = (20, 20, 10), 6
TEACHERS = 2
"""The shipped network learns what so many say together on the average."""
WANTED = {"cabinet": 0.9, "cabinet_half": 0.9, "corridors": 0.8, "stills": 0.75, "dev_office": 0.8, "dev_home": 0.8}
"""The precision at which each set's recall is asked for."""


def is_drive(picture):
    return picture.entry["set"].startswith("dev_")


SHARES = (0.75, 0.5)
"""Of the network's logit and of the straight score's in the sum."""


def logistic(columns, right, weight, ridge=1.0):
    """Coefficients, the last of 1, of the likeliest logistic score (Newton's method)."""
    design = np.column_stack([columns, np.ones(len(columns))])
    keep = ridge * np.eye(design.shape[1])
    keep[-1, -1] = 1e-9
    at = np.zeros(design.shape[1])
    for _ in range(30):
        p = 1 / (1 + np.exp(-design @ at))
        gradient = design.T @ (weight * (right - p)) - keep @ at
        at += np.linalg.solve((design.T * (weight * p * (1 - p))) @ design + keep, gradient)
    return at


def weight_of(picture):
    return next((weight for name, weight in WEIGHTS.items() if picture.entry["set"].startswith(name)), 1.0)


def fit(pictures, teachers=0):
    """The inputs' scales, the network and the straight score. With teachers the network learns the mean of their probabilities."""
    pictures = [p for p in pictures if len(p.right)]
    clean = [p for p in pictures if p.entry["copy"] == 0]
    known = [p.right >= 0 for p in clean]
    straight = logistic(
        np.concatenate([plain(p)[k] for p, k in zip(clean, known)]),
        np.concatenate([p.right[k] for p, k in zip(clean, known)]),
        np.concatenate([np.full(k.sum(), weight_of(p)) for p, k in zip(clean, known)]),
    )
    inputs = Inputs.measured(pictures)
    rows = [p.right >= 0 for p in pictures]
    features = np.concatenate([inputs.features(p)[k] for p, k in zip(pictures, rows)])
    pixels = np.concatenate([inputs.pixels(p)[k] for p, k in zip(pictures, rows)])
    right = np.concatenate([p.right[k] for p, k in zip(pictures, rows)]).astype(np.float32)
    weight = np.concatenate([np.full(k.sum(), weight_of(p)) for p, k in zip(pictures, rows)]).astype(np.float32)

    def one(target, seed):
        return network.fit(features, pixels, target, weight, seed, UNITS, EPOCHS)

    if teachers:
        taught = [network.forward(one(right, seed), features, pixels) for seed in range(1, teachers + 1)]
        right = np.mean([1 / (1 + np.exp(-z)) for z in taught], 0).astype(np.float32)
    return inputs, one(right, 0), straight


def odds(model, picture):
    """The logits of a picture's proposals."""
    inputs, net, straight = model
    if len(picture.right) == 0:
        return np.zeros(0)
    by_network = network.forward(net, inputs.features(picture), inputs.pixels(picture))
    return SHARES[0] * by_network + SHARES[1] * (plain(picture) @ straight[:-1] + straight[-1])


class Tally:
    """Finds of a set, from the likeliest down."""

    def __init__(self):
        self.finds, self.labels, self.pairs, self.reach = [], 0, [], 0

    def add(self, picture, z):
        entry, drive = picture.entry, is_drive(picture)
        wanted = {one for one, yes in zip(entry["label"], entry["wanted"]) if yes}
        self.labels += len(wanted)
        near = [entry["label"][picture.nearest[i]] for i in np.flatnonzero(picture.distance <= 1.0)]
        self.reach += len(wanted & set(near))
        self.pairs += [(z[i], picture.right[i]) for i in np.flatnonzero(picture.right >= 0)]
        found = set()
        for i in suppress(picture, z):
            if picture.right[i] < 0:
                continue
            label = entry["label"][picture.nearest[i]] if picture.distance[i] <= 1.0 else None
            new = label in wanted and label not in found
            right = picture.right[i] == 1 and (drive or new)
            if new:
                found.add(label)
            self.finds.append((z[i], right, new))

    def curve(self):
        finds = sorted(self.finds, key=lambda find: -find[0])
        right, new = (np.cumsum([float(find[i]) for find in finds]) for i in (1, 2))
        return np.array([find[0] for find in finds]), new / max(1, self.labels), right / np.arange(1, len(finds) + 1)

    def at_precision(self, least):
        z, recall, precision = self.curve()
        good = np.flatnonzero(precision >= least)
        return (recall[good[-1]], z[good[-1]]) if len(good) else (0.0, np.inf)

    def at(self, least):
        z, recall, precision = self.curve()
        count = int((z >= least).sum())
        return (recall[count - 1], precision[count - 1]) if count else (0.0, 1.0)

    def area(self):
        _, recall, precision = self.curve()
        envelope = np.maximum.accumulate(precision[::-1])[::-1]
        return float(np.sum(np.diff(np.r_[0.0, recall]) * envelope))

    def reliability(self, calibrate=lambda z: z, bins=5):
        z, right = np.array(self.pairs, float).reshape(-1, 2).T
        p = 1 / (1 + np.exp(-calibrate(z)))
        out = []
        for b in range(bins):
            k = (p >= b / bins) & ((p < (b + 1) / bins) | (b == bins - 1))
            if k.any():
                out.append((int(k.sum()), float(p[k].mean()), float(right[k].mean())))
        return out


def fold_of(pictures):
    groups = sorted({p.entry["group"] for p in pictures})
    return {group: i % FOLDS for i, group in enumerate(groups)}


def judge(sets, only=None):
    """A tally of every set by fits that have not seen it."""
    names = [name for name in sets if name not in JUDGES]
    all_fits = [p for name in names for p in sets[name]]
    tallies = {}

    def add(picture, model):
        tallies.setdefault(picture.entry["set"], Tally()).add(picture, odds(model, picture))

    if only is None or "judges" in only:
        model = fit(all_fits)
        for name in JUDGES:
            for picture in sets.get(name, []):
                add(picture, model)
    if "stills" in sets and (only is None or "stills" in only):
        fold = fold_of(sets["stills"])
        others = [p for name in names if name != "stills" for p in sets[name]]
        for k in range(FOLDS):
            model = fit([p for p in sets["stills"] if fold[p.entry["group"]] != k] + others)
            for picture in sets["stills"]:
                if picture.entry["copy"] == 0 and fold[picture.entry["group"]] == k:
                    add(picture, model)
    for name in names:
        if name.startswith("dev_") and (only is None or "drives" in only):
            model = fit([p for other in names if other != name for p in sets[other]])
            for picture in sets[name]:
                if picture.entry["copy"] == 0:
                    add(picture, model)
    return tallies


def show(tallies):
    for name, tally in tallies.items():
        least = WANTED.get(name, 0.8)
        recall, z = tally.at_precision(least)
        half = tally.at(0.0)
        bins = " ".join(f"{p:.2f}:{y:.2f}({n})" for n, p, y in tally.reliability())
        print(
            f"{name:12s} proposed {tally.reach / max(1, tally.labels):.2f} of {tally.labels}; recall {recall:.2f} at precision {least}"
            f" (odds {z:+.2f}); at p 0.5 {half[0]:.2f}/{half[1]:.2f}; area {tally.area():.3f}; p:true {bins}",
            flush=True,
        )


def platt(pairs):
    """Slope and shift that make logits of pictures not fitted to the likeliest (Newton's method)."""
    z, right = np.array(pairs, float).T
    at = np.array([1.0, 0.0])
    design = np.stack([z, np.ones_like(z)], 1)
    for _ in range(30):
        p = 1 / (1 + np.exp(-design @ at))
        at += np.linalg.solve((design.T * (p * (1 - p))) @ design + 1e-6 * np.eye(2), design.T @ (right - p))
    return at


def write(sets, path):
    """One network on all sets but the judges, calibrated by the logits of stills and drives in fits without them."""
    left_out = judge(sets, only={"stills", "drives"})
    show(left_out)
    slope, shift = platt([pair for tally in left_out.values() for pair in tally.pairs])
    print(f"calibration: {slope:.3f} logit {shift:+.3f}")
    pictures = [p for name in sets if name not in JUDGES for p in sets[name]]
    inputs, net, straight = fit(pictures, TEACHERS)
    w = weights.joined(weights.quantised(net), straight, SHARES, slope, shift)
    judged = {}
    for name in JUDGES:
        for picture in sets.get(name, []):
            judged.setdefault(picture.entry["set"], Tally()).add(picture, weights.logits(inputs, w, picture))
    show(judged)
    note = "\n".join(
        ["Fitted on " + ", ".join(name for name in sets if name not in JUDGES) + "; never on " + ", ".join(JUDGES) + "."]
    )
    with open(path, "w") as file:
        file.write(weights.rust(inputs, pictures[0].names, w, weights.expected(inputs, pictures[0].names, w), note))


def main():
    folder, command = sys.argv[1:3]
    sets = {name: read(os.path.join(folder, name)) for name in sorted(os.listdir(folder)) if os.path.exists(os.path.join(folder, name, "dump.csv"))}
    if command == "judge":
        show(judge(sets))
    elif command == "write":
        write(sets, sys.argv[3])
    else:
        sys.exit(f"{command}: not judge or write")


if __name__ == "__main__":
    main()

"""The fitted network as a table for `core/src/proposals/score.rs`: whole numbers of eight bits with a scale for each unit."""
import numpy as np

import network
from inputs import plain
from proposals import Picture

SIDE, CONTEXT_SIDE = 16, 12
CASES = 4


def quantised(w):
    """The network as the core computes it: each unit's weights rounded to 255 steps."""
    out = dict(w)
    for name in ("patch", "feature", "hidden"):
        scale = np.maximum(np.abs(w[name]).max(0), 1e-9) / 127.0
        out[name + "_steps"] = np.clip(np.rint(w[name] / scale), -127, 127).astype(int)
        out[name + "_scale"] = scale.astype(np.float32)
        out[name] = (out[name + "_steps"] * scale).astype(np.float32)
    return out


def joined(w, straight, shares, slope, shift):
    """The network and the straight score as one table whose logit is slope · (their sum by shares) + shift."""
    by_network, by_straight = slope * shares[0], slope * shares[1]
    out = dict(w)
    out["out"], out["straight"] = w["out"] * by_network, w["straight"] * by_network
    out["plain"] = straight[:-1] * by_straight
    out["bias"] = w["bias"] * by_network + straight[-1] * by_straight + shift
    return out


def logits(inputs, w, picture):
    """What the core computes."""
    if len(picture.features) == 0:
        return np.zeros(0)
    return network.forward(w, inputs.features(picture), inputs.pixels(picture)) + plain(picture) @ w["plain"]


def made_up(number, names):
    """The candidate that `score_test.rs` makes: features by name, patch, context, turned as the score turns them."""
    state = 12345 + number

    def step():
        nonlocal state
        state = (state * 1664525 + 1013904223) & 0xFFFFFFFF
        return state >> 24

    patch = np.array([step() for _ in range(SIDE * SIDE)], np.uint8).reshape(1, SIDE, SIDE)
    context = np.array([step() for _ in range(CONTEXT_SIDE * CONTEXT_SIDE)], np.uint8).reshape(1, CONTEXT_SIDE, CONTEXT_SIDE)
    turned = number % 2 == 1
    values = {"vertical_length": float(step()), "vertical_brighter_right": -1.0 if turned else 1.0}
    values["below_end"] = step() / 16.0 - 8.0
    values["left_length"] = float(step())
    values["right_fall"] = step() / 256.0
    values["left_sight"] = step() / 128.0 - 1.0
    values["above_left"] = step() / 8.0 - 16.0
    values["below_right"] = step() / 8.0 - 16.0
    values["contrast_floor"] = step() / 4.0
    values["range"] = step() / 32.0
    values["noise"] = 1.0 + step() / 64.0
    return np.array([[values.get(name, 0.0) for name in names]], np.float32), patch, context


def expected(inputs, names, w):
    """The logits of the made-up candidates."""
    out = []
    for number in range(CASES):
        case = Case(names, *made_up(number, names))
        out.append(float(logits(inputs, w, case)[0]))
    return out


class Case(Picture):
    """A candidate without a picture."""

    def __init__(self, names, features, patch, context):
        self.names, self.features, self.patch, self.context = names, features, patch, context
        self.turn()


def numbers(values):
    return ", ".join(f"{float(value):.6e}" for value in values)


def layer(name, w, key):
    steps, scale, bias = w[key + "_steps"], w[key + "_scale"], w[key + "_bias"]
    inputs, outputs = steps.shape
    rows = "\n".join("        [" + ", ".join(str(v) for v in steps[:, j]) + "]," for j in range(outputs))
    return (
        f"pub(super) static {name}: Layer<{inputs}, {outputs}> = Layer {{\n    weights: [\n{rows}\n    ],\n"
        f"    scale: [{numbers(scale)}],\n    bias: [{numbers(bias)}],\n}};\n"
    )


def rust(inputs, all_names, w, expected, note):
    index = {name: i for i, name in enumerate(all_names)}
    kind = {"log": "Log", "signed": "Signed", "plain": "Plain"}
    scales = "\n".join(
        f"    Input {{ index: {index[name]}, shape: Shape::{kind[k]}, mean: {float(m):.6e}, gain: {1 / float(s):.6e} }}, // {name}"
        for name, k, m, s in zip(inputs.names, inputs.kinds, inputs.mean, inputs.spread)
    )
    names = ", ".join(f'"{name}"' for name in inputs.names)
    note = "\n".join(f"//! {line}".rstrip() for line in note.splitlines())
    return f"""//! The weights of [`super::score`]. Written by `tests/scoring/train.py`; do not edit.
//!
{note}
#![cfg_attr(rustfmt, rustfmt_skip)]
#![allow(clippy::unreadable_literal, clippy::excessive_precision, reason = "a table that a program writes")]
use super::score::{{Input, Layer, Shape}};

pub(super) const INPUTS: usize = {len(inputs.names)};
pub(super) const PIXELS: usize = {w["patch"].shape[0]};
pub(super) const PATCH_UNITS: usize = {w["patch"].shape[1]};
pub(super) const FEATURE_UNITS: usize = {w["feature"].shape[1]};
pub(super) const HIDDEN_UNITS: usize = {w["hidden"].shape[1]};

pub(super) static SCALES: [Input; INPUTS] = [
{scales}
];

{layer("PATCH", w, "patch")}
{layer("FEATURE", w, "feature")}
{layer("HIDDEN", w, "hidden")}
pub(super) static OUT: [f32; HIDDEN_UNITS] = [{numbers(w["out"])}];
pub(super) static STRAIGHT: [f32; INPUTS] = [{numbers(w["straight"])}];
pub(super) static PLAIN: [f32; {len(w["plain"])}] = [{numbers(w["plain"])}];
pub(super) const BIAS: f32 = {float(w["bias"][0]):.6e};

/// The inputs' names, and the logits of the tests' made-up candidates.
#[cfg(test)]
pub(super) const NAMES: [&str; INPUTS] = [{names}];
#[cfg(test)]
pub(super) const EXPECTED: [f32; {CASES}] = [{numbers(expected)}];
"""

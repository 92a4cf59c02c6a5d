"""A small network: patch → P, features → F, both → H → 1, and a straight path of the features. Adam, deterministic by its seed."""
import math

import numpy as np

RATE, DECAY, DROP, BATCH = 4e-3, 1e-3, 0.15, 256


def begin(random, features, pixels, patch_units, feature_units, hidden):
    def matrix(inputs, outputs, gain=1.0):
        return (random.normal(size=(inputs, outputs)) * gain / math.sqrt(max(inputs, 1))).astype(np.float32)

    def zeros(count):
        return np.zeros(count, np.float32)

    return {
        "patch": matrix(pixels, patch_units, 0.7),
        "patch_bias": zeros(patch_units),
        "feature": matrix(features, feature_units),
        "feature_bias": zeros(feature_units),
        "hidden": matrix(patch_units + feature_units, hidden),
        "hidden_bias": zeros(hidden),
        "out": matrix(hidden, 1, 0.3)[:, 0],
        "straight": zeros(features),
        "bias": zeros(1),
    }


def forward(w, features, pixels):
    first = np.concatenate([pixels @ w["patch"] + w["patch_bias"], features @ w["feature"] + w["feature_bias"]], 1)
    second = np.maximum(first, 0.0) @ w["hidden"] + w["hidden_bias"]
    return np.maximum(second, 0.0) @ w["out"] + features @ w["straight"] + w["bias"][0]


def fit(features, pixels, right, weight, seed, units=(16, 16, 8), epochs=5, rate=RATE, decay=DECAY, drop=DROP):
    random = np.random.default_rng(seed)
    count = units[0]
    w = begin(random, features.shape[1], pixels.shape[1], *units)
    w["bias"][0] = math.log((weight * right).sum() / (weight * (1 - right)).sum())
    mean, square = ({k: np.zeros_like(v) for k, v in w.items()} for _ in range(2))
    batches = len(features) // BATCH
    step = 0
    for _ in range(epochs):
        order = random.permutation(len(features))
        for b in range(batches):
            rows = order[b * BATCH : (b + 1) * BATCH]
            x, p, t, s = features[rows], pixels[rows], right[rows], weight[rows]
            first = np.concatenate([p @ w["patch"] + w["patch_bias"], x @ w["feature"] + w["feature_bias"]], 1)
            kept = (random.random(first.shape, np.float32) > drop).astype(np.float32) / (1 - drop)
            active = np.maximum(first, 0.0) * kept
            second = active @ w["hidden"] + w["hidden_bias"]
            last = np.maximum(second, 0.0)
            z = last @ w["out"] + x @ w["straight"] + w["bias"][0]
            d = (s * (1 / (1 + np.exp(-z)) - t) / s.sum()).astype(np.float32)
            d2 = np.outer(d, w["out"]) * (second > 0)
            d1 = (d2 @ w["hidden"].T) * kept * (first > 0)
            gradient = {
                "out": last.T @ d,
                "straight": x.T @ d,
                "bias": d.sum(keepdims=True),
                "hidden": active.T @ d2,
                "hidden_bias": d2.sum(0),
                "patch": p.T @ d1[:, :count],
                "patch_bias": d1[:, :count].sum(0),
                "feature": x.T @ d1[:, count:],
                "feature_bias": d1[:, count:].sum(0),
            }
            step += 1
            now = rate * 0.5 * (1 + math.cos(math.pi * step / (epochs * batches)))
            for k, g in gradient.items():
                if "bias" not in k:
                    g = g + decay * w[k]
                mean[k] += 0.1 * (g - mean[k])
                square[k] += 0.01 * (g * g - square[k])
                w[k] -= now * (mean[k] / (1 - 0.9**step)) / (np.sqrt(square[k] / (1 - 0.99**step)) + 1e-7)
    return w

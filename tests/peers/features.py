#!/usr/bin/env python3
"""SIFT, FAST and the robust homography beside OpenCV, in one run on the same pictures and matches.

    cargo build --release -p monorange-tests --examples
    python tests/peers/features.py speed PICTURE.pgm...      # least time of one call, keypoints, ratio
    python tests/peers/features.py accuracy PICTURE.pgm...   # random homographies: see `pair`
    python tests/peers/features.py robust                    # 300 matches, half of them wrong: see `robust`

Needs numpy, scipy and opencv-python-headless; EXAMPLES names the folder if it is not target/release/examples.
The two alternate and the least time of many calls counts; OpenCV runs on one thread. Ours is the default x86-64 build, OpenCV dispatches to AVX2."""
import os
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np
from scipy.spatial import cKDTree

EXAMPLES = os.environ.get("EXAMPLES", "target/release/examples")
FEATURES = os.path.join(EXAMPLES, "features")
cv2.setNumThreads(1)


def ours_ms(picture, name):
    """Least milliseconds that the example itself saw, and keypoints."""
    out = subprocess.run([FEATURES, picture, "30"], check=True, capture_output=True, text=True).stdout
    ms, count = next(line.split()[1:] for line in out.splitlines() if line.split()[0] == name)
    return float(ms), int(count)


def opencv_ms(call, repeats):
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        best = min(best, (time.perf_counter() - start) * 1e3)
    return best


def speed(pictures):
    fast, sift = cv2.FastFeatureDetector_create(20, True), cv2.SIFT_create()
    print("OpenCV", cv2.__version__)
    for picture in pictures:
        grey = cv2.imread(picture, cv2.IMREAD_GRAYSCALE)
        # A mask of nothing is applied to the finished corners: making objects of Python of them does not count.
        nowhere = np.zeros_like(grey)
        for name, call, found, repeats in (
            ("fast", lambda: fast.detect(grey, nowhere), lambda: fast.detect(grey), 1000),
            ("sift", lambda: sift.detectAndCompute(grey, None), lambda: sift.detect(grey), 30),
        ):
            # Alternate, so that both see the same machine.
            theirs, ours = [], []
            for _ in range(3):
                theirs.append(opencv_ms(call, repeats))
                ours.append(ours_ms(picture, name))
            their_ms, their_count = min(theirs), len(found())
            our_ms, our_count = min(ours)
            print(
                f"{os.path.basename(picture)} {name}: ours {our_ms:.3f} ms, {our_count} keypoints;"
                f" OpenCV {their_ms:.3f} ms, {their_count}; ratio {our_ms / their_ms:.2f}"
            )


def ours(grey):
    with tempfile.TemporaryDirectory() as folder:
        picture, out = os.path.join(folder, "a.pgm"), os.path.join(folder, "a.csv")
        cv2.imwrite(picture, grey)
        subprocess.run([FEATURES, picture, "0", out], check=True, stdout=subprocess.DEVNULL)
        rows = np.loadtxt(out, ndmin=2, delimiter=",")
    return rows[:, :2], rows[:, 5:].astype(np.float32)


def opencv(grey):
    keypoints, descriptors = cv2.SIFT_create().detectAndCompute(grey, None)
    return np.array([k.pt for k in keypoints]), descriptors


def carry(matrix, points):
    q = np.c_[points, np.ones(len(points))] @ matrix.T
    return q[:, :2] / q[:, 2:]


def random_homography(width, height, random):
    p = np.float32([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]])
    q = p + random.uniform(-0.12, 0.12, (4, 2)) * [width, height]
    angle, scale = random.uniform(-0.5, 0.5), random.uniform(0.75, 1.2)
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    centre = np.array([width / 2, height / 2])
    return cv2.getPerspectiveTransform(p, ((q - centre) @ turn.T + centre).astype(np.float32)).astype(float)


def pair(a, b, truth, detect, mutual):
    """Keypoints; repeatability at 1 px; matches; part of them within 1 px; corner error of OpenCV's RANSAC."""
    height, width = a.shape
    (p, dp), (q, dq) = detect(a), detect(b)

    def inside(points):
        x, y = points.T
        return (x > 8) & (y > 8) & (x < width - 8) & (y < height - 8)

    carried = carry(truth, p)
    seen = inside(carried)
    seen_back = inside(carry(np.linalg.inv(truth), q)).sum()
    distance, _ = cKDTree(q).query(carried[seen])
    matches = [m for m, n in cv2.BFMatcher().knnMatch(dp, dq, k=2) if m.distance < 0.8 * n.distance]
    if mutual:
        back = {m.queryIdx: m.trainIdx for m in cv2.BFMatcher().match(dq, dp)}
        matches = [m for m in matches if back[m.trainIdx] == m.queryIdx]
    source, target = p[[m.queryIdx for m in matches]], q[[m.trainIdx for m in matches]]
    error = np.linalg.norm(carry(truth, source) - target, axis=1)
    corners = np.array([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]], float)
    corner_errors = []
    for seed in range(5):
        order = np.random.default_rng(seed).permutation(len(matches))
        cv2.setRNGSeed(seed)
        found, _ = cv2.findHomography(source[order], target[order], cv2.RANSAC, 2.0, maxIters=5000, confidence=0.999)
        corner_errors.append(np.linalg.norm(carry(found, corners) - carry(truth, corners), axis=1).mean())
    repeated = (distance < 1).sum() / min(seen.sum(), seen_back)
    return len(p), repeated, len(matches), (error < 1).mean(), np.median(corner_errors)


def accuracy(pictures):
    detectors = {"ours, mutual + ratio": (ours, True), "ours, ratio": (ours, False), "OpenCV, ratio": (opencv, False)}
    scores = {name: [] for name in detectors}
    for picture in pictures:
        a = cv2.imread(picture, cv2.IMREAD_GRAYSCALE)
        height, width = a.shape
        for trial in range(4):
            random = np.random.default_rng(1000 + trial)
            truth = random_homography(width, height, random)
            view = cv2.warpPerspective(a, truth, (width, height), flags=cv2.INTER_CUBIC).astype(float)
            view = view * random.uniform(0.8, 1.15) + random.normal(0, 3, view.shape) + random.uniform(-10, 10)
            b = np.clip(view, 0, 255).astype(np.uint8)
            for name, (detect, mutual) in detectors.items():
                scores[name].append(pair(a, b, truth, detect, mutual))
    for name, rows in scores.items():
        keypoints, repeated, matches, right, _ = np.mean(rows, axis=0)
        print(
            f"{name}: {keypoints:.0f} keypoints, repeatability {repeated:.3f}, {matches:.0f} matches,"
            f" {right:.3f} within 1 px, median corner error (RANSAC) {np.median(rows, axis=0)[4]:.3f} px"
        )


def robust_problem(random, matches=300, wrong=0.5, noise_px=0.5, width=640, height=480):
    """A homography and matches under it with noise in both pictures, some replaced by points anywhere."""
    truth = random_homography(width, height, random)
    source = random.uniform([0, 0], [width, height], (matches, 2))
    target = carry(truth, source)
    count = int(matches * wrong)
    target[:count] = random.uniform([0, 0], [width, height], (count, 2))
    order = random.permutation(matches)
    noisy = [points[order] + random.normal(0, noise_px, points.shape) for points in (source, target)]
    return truth, noisy[0].astype(np.float32), noisy[1].astype(np.float32)


def corner_error(found, truth, width=640, height=480):
    corners = np.array([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]], float)
    return np.linalg.norm(carry(found, corners) - carry(truth, corners), axis=1).mean()


def robust(problems=200):
    """The same matches for both, one after the other; the least time of the runs over all problems counts.

    Ours includes the maximum-likelihood refinement and the covariance, from matches as pixels with their variances;
    OpenCV's returns the matrix and a mask. Both: confidence 0.99, at most 2,000 samples."""
    made = [robust_problem(np.random.default_rng(seed)) for seed in range(problems)]
    print("OpenCV", cv2.__version__)
    with tempfile.TemporaryDirectory() as folder:
        path, out = os.path.join(folder, "matches.txt"), os.path.join(folder, "found.txt")
        np.savetxt(path, np.vstack([np.c_[source, target] for _, source, target in made]), fmt="%.6f")
        command = [os.path.join(EXAMPLES, "robust_homography"), path, out]
        methods = {"USAC_MAGSAC": cv2.USAC_MAGSAC, "RANSAC": cv2.RANSAC}
        times = {}
        for _ in range(5):
            for name, method in methods.items():
                for threshold in (1.5, 3.0):
                    cv2.setRNGSeed(1)
                    start = time.perf_counter()
                    found = [
                        cv2.findHomography(source, target, method, threshold, maxIters=2000, confidence=0.99)[0]
                        for _, source, target in made
                    ]
                    ms = (time.perf_counter() - start) * 1e3 / problems
                    key = f"OpenCV {name}, {threshold} px"
                    before = times.get(key, (float("inf"), None))[0]
                    times[key] = (min(ms, before), found)
            lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
            for name, ms in (line.split()[:2] for line in lines):
                key = f"ours {name}"
                before = times.get(key, (float("inf"), None))[0]
                found = np.loadtxt(f"{out}.{name}").reshape(-1, 3, 3)
                times[key] = (min(float(ms), before), found)
    least = min(ms for name, (ms, _) in times.items() if "MAGSAC" in name)
    for name, (ms, found) in times.items():
        pairs = list(zip(found, made))
        errors = [float("inf") if h is None else corner_error(h, truth) for h, (truth, _, _) in pairs]
        print(
            f"{name}: {ms:.4f} ms, ratio to the faster MAGSAC {ms / least:.2f}; corner error mean"
            f" {np.mean(errors):.3f}, median {np.median(errors):.3f}, worst {np.max(errors):.2f} px"
        )


if __name__ == "__main__":
    if sys.argv[1:] == ["robust"]:
        robust()
    elif len(sys.argv) < 3 or sys.argv[1] not in ("speed", "accuracy"):
        sys.exit(__doc__)
    else:
        {"speed": speed, "accuracy": accuracy}[sys.argv[1]](sys.argv[2:])

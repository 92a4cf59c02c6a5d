"""From pictures to a map, step by step: python tutorial.py DRIVE [OUT.png]

DRIVE is a folder with rig.toml, frames/, times.txt, odometry.csv and perhaps truth.tum; this makes one:

    monorange simulate --scene corridor --frames 120 --out corridor
"""

import csv
import pathlib
import sys

import numpy as np
from PIL import Image, ImageDraw

import monorange


def main(folder, out="tutorial.png"):
    folder = pathlib.Path(folder)

    # 1. The range finder. A rig file holds the camera's calibration and how it sits on the robot.
    finder = monorange.RangeFinder.from_rig(folder / "rig.toml")
    print(finder)

    # 2. A range. Far pixels are worse: the error grows with the square of the range.
    width, height = finder.size
    column = np.array([[width / 2, v] for v in (height - 1, height * 0.75, height * 0.6)])
    for pixel, range_, std in zip(column, *(lambda s: (s.range, s.range_std))(finder.sight(column))):
        print(f"pixel {pixel}: {range_:.3f} m, one sigma {1000 * std:.1f} mm")

    # 3. Corners: where upright edges meet the floor. These are the landmarks.
    frames = sorted((folder / "frames").iterdir())
    grey = lambda path: np.asarray(Image.open(path).convert("L"))
    corners = monorange.Extractor(finder).corners(grey(frames[0]))
    print(f"{len(corners)} corners in the first picture")

    # 4. The drive. Odometry up to each picture, then the picture.
    drive = monorange.Drive(finder)
    times = [float(word) for word in (folder / "times.txt").read_text().split()]
    with open(folder / "odometry.csv") as file:
        wheels = [[float(row[key]) for key in ("t", "v", "omega")] for row in csv.DictReader(file)]
    ends = [row[0] for row in wheels[1:]] + [2 * wheels[-1][0] - wheels[-2][0]]
    steps, reached = [], times[0]
    for now, path in zip(times, frames):
        for (start, v, omega), end in zip(wheels, ends):
            if start < now and end > reached:
                drive.odometry(max(start, reached), min(end, now), v, omega)
        reached = now
        steps.append(drive.picture(now, grey(path)))
    poses = np.array([step.pose for step in steps])
    covariances = np.array([step.covariance for step in steps])
    landmarks = drive.map()
    sigma = np.sqrt(np.trace(covariances[-1][:2, :2]))
    print(f"{len(steps)} pictures, {len(landmarks)} landmarks, end at {poses[-1].round(3)}, one sigma {sigma:.3f} m: {drive.verdict}")

    # 5. Against the truth, moved into the map's frame by its first pose.
    if (folder / "truth.tum").exists():
        truth = np.loadtxt(folder / "truth.tum")
        heading = 2 * np.arctan2(truth[:, 6], truth[:, 7])
        cos, sin = np.cos(heading[0]), np.sin(heading[0])
        moved = (truth[:, 1:3] - truth[0, 1:3]) @ np.array([[cos, -sin], [sin, cos]])
        true_poses = np.column_stack([moved, heading - heading[0]])
        errors = monorange.evaluate((truth[:, 0].copy(), true_poses, None), (np.array(times), poses, covariances))
        print(f"position error {errors['absolute']['position']['rms']:.3f} m rms")

    draw(out, grey(frames[0]), corners, poses, landmarks)
    print(f"drawn: {out}")


def draw(out, picture, corners, poses, landmarks):
    """The first picture with its corners, and the map from above with three-sigma ellipses."""
    size = 480
    sheet = Image.new("RGB", (2 * size * 4 // 3, size), "white")
    scale = size / picture.shape[0]
    first = Image.fromarray(picture).convert("RGB").resize((round(picture.shape[1] * scale), size))
    pen = ImageDraw.Draw(first)
    for u, v in (corners.pixels + 0.5) * scale:
        pen.ellipse([u - 5, v - 5, u + 5, v + 5], outline="orange", width=2)
    sheet.paste(first, (0, 0))
    pen = ImageDraw.Draw(sheet)
    left, room = first.width + 20, sheet.width - first.width - 40
    points = np.vstack([poses[:, :2], landmarks.positions])
    low, span = points.min(axis=0), np.ptp(points, axis=0).max() + 1e-9
    place = lambda point: (left + (point[0] - low[0]) / span * room, size - 30 - (point[1] - low[1]) / span * room)
    for position, covariance in zip(landmarks.positions, landmarks.covariances):
        values, axes = np.linalg.eigh(covariance)
        turns = np.linspace(0, 2 * np.pi, 40)
        ring = position + 3 * (np.column_stack([np.cos(turns), np.sin(turns)]) * np.sqrt(values.clip(0))) @ axes.T
        pen.line([place(point) for point in ring], fill="#0072B2")
        u, v = place(position)
        pen.ellipse([u - 2, v - 2, u + 2, v + 2], fill="#0072B2")
    pen.line([place(point) for point in poses], fill="#D55E00", width=2)
    pen.text((left, 10), f"map from above, {span:.1f} m wide: path, landmarks with 3 sigma", fill="black")
    sheet.save(out)


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Many drives over a cluster: every folder of drives becomes a trajectory and a map, on Ray (PyPI: ray).

    python fleet.py DRIVES OUT [--address auto]       # DRIVES holds folders as `monorange simulate` makes them

A drive is a task of its own: a worker that dies takes only the drive that it was at, and that one is done again elsewhere.
Without Ray any job engine does: `python fleet.py --one DRIVE OUT` is one drive, and writes one file, whole or not at all.
"""

import argparse
import csv
import os
import pathlib
import tempfile

import numpy as np


def one(folder, out):
    """Runs a drive and writes OUT/<name>.npz: times, poses, covariances, ids, positions."""
    from PIL import Image

    import monorange

    folder, out = pathlib.Path(folder), pathlib.Path(out)
    drive = monorange.Drive(monorange.RangeFinder.from_rig(folder / "rig.toml"))
    times = [float(word) for word in (folder / "times.txt").read_text().split()]
    with open(folder / "odometry.csv") as file:
        wheels = [[float(row[key]) for key in ("t", "v", "omega")] for row in csv.DictReader(file)]
    ends = [row[0] for row in wheels[1:]] + [2 * wheels[-1][0] - wheels[-2][0]]
    steps, reached = [], times[0]
    for now, path in zip(times, sorted((folder / "frames").iterdir())):
        for (start, v, omega), end in zip(wheels, ends):
            if start < now and end > reached:
                drive.odometry(max(start, reached), min(end, now), v, omega)
        reached = now
        steps.append(drive.picture(now, np.asarray(Image.open(path).convert("L"))))
    found = drive.map()
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=out, suffix=".part", delete=False) as file:
        poses, covariances = [s.pose for s in steps], [s.covariance for s in steps]
        np.savez(file, times=times, poses=poses, covariances=covariances, ids=found.ids, positions=found.positions)
    target = out / f"{folder.name}.npz"
    os.replace(file.name, target)
    return str(target)


def fleet(drives, out, address=None, **options):
    """Runs every drive in a folder on the cluster; gives the files, in the drives' order."""
    import ray

    if not ray.is_initialized():
        ray.init(address=address, **options)
    # A worker that is killed is no error of the drive's: its task goes to another one.
    task = ray.remote(num_cpus=1, max_retries=5)(one)
    folders = sorted(folder for folder in pathlib.Path(drives).iterdir() if (folder / "rig.toml").exists())
    waiting = {task.remote(str(folder.resolve()), str(pathlib.Path(out).resolve())): folder for folder in folders}
    files = {}
    while waiting:
        done, _ = ray.wait(list(waiting), num_returns=1)
        files[waiting.pop(done[0])] = ray.get(done[0])
        print(f"\r{len(files)} of {len(folders)} drives", end="", flush=True)
    print()
    return [files[folder] for folder in folders]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("drives")
    parser.add_argument("out")
    parser.add_argument("--one", action="store_true", help="DRIVES is a single drive, done here")
    parser.add_argument("--address", help="of the cluster; a local one without it")
    chosen = parser.parse_args()
    if chosen.one:
        print(one(chosen.drives, chosen.out))
    else:
        print(*fleet(chosen.drives, chosen.out, chosen.address), sep="\n")

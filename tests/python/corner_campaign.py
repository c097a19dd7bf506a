"""Compares `hzn.find_corners` with OpenCV's finders on rendered boards with known corners.

    python corner_campaign.py -o corners.md

It needs the wheel of hzn and OpenCV. Every finder uses one thread.
"""

import argparse
import pathlib
import time

import cv2
import numpy as np

import boards
import hzn

# Name: (seed, size, options of the renderer).
KINDS = {
    "clean": (90100, (1280, 960), {}),
    "noise": (90500, (640, 480), {"noise": 0.05}),
    "blur": (90400, (1280, 960), {"psf": 1.8, "noise": 0.02}),
    "partial": (90200, (1280, 960), {"noise": 0.015, "partial": 1.0}),
    "covered": (90300, (1280, 960), {"noise": 0.015, "covered": 1.0}),
}
SIZE = (boards.COLUMNS, boards.ROWS)
FALSE_PX = 1.5


def by_hzn(picture):
    found = hzn.find_corners(picture, SIZE)
    return None if found is None else found[1]


def by_opencv(picture):
    found, at = cv2.findChessboardCorners(picture, SIZE)
    return cv2.cornerSubPix(picture, at, (5, 5), (-1, -1), (3, 40, 1e-3))[:, 0] if found else None


def by_opencv_sb(picture):
    found, at = cv2.findChessboardCornersSB(picture, SIZE)
    return at.reshape(-1, 2) if found else None


FINDERS = {
    "hzn": by_hzn,
    "OpenCV, findChessboardCorners": by_opencv,
    "OpenCV, findChessboardCornersSB": by_opencv_sb,
}


def measure(find, views):
    """Boards found, visible corners found, their errors in pixels, number of false corners, and times in seconds."""
    found, seen, errors, false, times = 0, 0, [], 0, []
    for picture, truth, visible, *_ in views:
        start = time.perf_counter()
        at = find(picture)
        times.append(time.perf_counter() - start)
        if at is None:
            continue
        found += 1
        distance = np.linalg.norm(at[:, None] - truth[None], axis=-1)
        nearest, error = distance.argmin(axis=1), distance.min(axis=1)
        good = (error < FALSE_PX) & visible[nearest]
        seen += len(set(nearest[good]))
        errors += list(error[good])
        false += int((error >= FALSE_PX).sum())
    return found, seen, errors, false, times


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--views", type=int, default=10, help="pictures of each lens and kind")
    parser.add_argument("-o", "--output", type=pathlib.Path)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    lines = ["| boards | finder | boards found | visible corners found | RMS error, px | errors above 1.5 px | ms |",
             "|---|---|---|---|---|---|---|"]
    for kind, (seed, (width, height), options) in KINDS.items():
        options = {"psf": 0.8, "noise": 0.01, **options}
        views = [v for lens in boards.LENSES
                 for v in boards.render_set(lens, args.views, seed, width, height, **options)[1]]
        visible = sum(int(v[2].sum()) for v in views)
        for name, find in FINDERS.items():
            found, seen, errors, false, times = measure(find, views)
            rms = np.sqrt(np.mean(np.square(errors))) if errors else float("nan")
            lines.append(f"| {kind} | {name} | {found} of {len(views)} | {seen} of {visible} | {rms:.3f} | {false} | "
                         f"{1000 * np.median(times):.0f} |")
            print(lines[-1], flush=True)
    if args.output:
        args.output.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

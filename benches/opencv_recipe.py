"""Finds the limb as a usual program with OpenCV does, and measures the time of each stage.

threshold -> findContours (external, every point) -> longest contour without border points ->
fisheye.undistortPoints -> least squares for the direction (Braun & Barf, equation 24) -> normalise

The benchmark harness runs this program. It sends one JSON request per line and reads one JSON answer per line, so that
both programs take turns on the same frames. The level in the request is the threshold that hzn has found.
"""

import json
import sys
import time
from pathlib import Path

import cv2
import numpy as np

cv2.setNumThreads(1)

FLUSH = np.zeros(64 << 20, dtype=np.uint8)


class Case:
    """The frames of one case in memory, and the lens."""

    def __init__(self, folder):
        manifest = json.loads((folder / "case.json").read_text())
        camera = manifest["camera"]
        shape = (camera["height"], camera["width"])
        self.frames = [np.fromfile(folder / f["file"], dtype=np.uint8).reshape(shape) for f in manifest["frames"]]
        self.shape = shape
        self.matrix = np.array(
            [[camera["fx_px"], 0, camera["cx_px"]], [0, camera["fy_px"], camera["cy_px"]], [0, 0, 1]], dtype=np.float64
        )
        k = list(camera.get("k", [])) + [0.0] * 4
        self.k = np.array(k[:4], dtype=np.float64)
        # Preallocated, as one would for a stream of frames.
        self.binary = np.empty(shape, dtype=np.uint8)


def flush_caches():
    """Walks through more memory than the caches hold."""
    FLUSH[::64] += 1


def find_axis(case, image, level):
    clock = time.perf_counter_ns
    t0 = clock()
    _, binary = cv2.threshold(image, level - 1, 255, cv2.THRESH_BINARY, dst=case.binary)
    t1 = clock()
    contours, _ = cv2.findContours(binary, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    t2 = clock()
    height, width = case.shape
    points = max(contours, key=len, default=np.empty((0, 1, 2), np.int32))
    x, y = points[:, 0, 0], points[:, 0, 1]
    inside = (x > 0) & (x < width - 1) & (y > 0) & (y < height - 1)
    points = points[inside].astype(np.float64)
    t3 = clock()
    axis = None
    t4 = t5 = t3
    if len(points) >= 3:
        plane = cv2.fisheye.undistortPoints(points, case.matrix, case.k)[:, 0, :]
        t4 = clock()
        rows = np.column_stack((plane, np.ones(len(plane))))
        solution = np.linalg.lstsq(rows, np.sqrt((rows * rows).sum(axis=1)), rcond=None)[0]
        length = np.sqrt(solution @ solution)
        if np.isfinite(length) and length > 0:
            axis = (solution / length).tolist()
        t5 = clock()
    return {
        "stages_us": {
            "threshold": (t1 - t0) / 1e3,
            "findContours": (t2 - t1) / 1e3,
            "longest": (t3 - t2) / 1e3,
            "undistortPoints": (t4 - t3) / 1e3,
            "lstsq": (t5 - t4) / 1e3,
        },
        "total_us": (t5 - t0) / 1e3,
        "axis": axis,
        "points": len(points),
        "contours": len(contours),
    }


def main():
    folder = Path(sys.argv[1])
    print(json.dumps({"opencv": cv2.__version__, "numpy": np.__version__}), flush=True)
    name, case = None, None
    for line in sys.stdin:
        request = json.loads(line)
        if request["case"] != name:
            name, case = request["case"], Case(folder / request["case"])
            # The libraries prepare things on first use; this time is not a cost of the recipe.
            find_axis(case, case.frames[0], 128)
        flush_caches()
        print(json.dumps(find_axis(case, case.frames[request["frame"]], request["level"])), flush=True)


if __name__ == "__main__":
    main()

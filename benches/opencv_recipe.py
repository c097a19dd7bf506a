"""Finds the limb as a usual program with OpenCV does, and measures the time of each stage.

threshold -> findContours (external, every point) -> longest contour without border points ->
fisheye.undistortPoints -> least squares for the direction (Braun & Barf, equation 24) -> normalise

An expert replaces the first three steps: `find_crossings` looks at every 8th pixel, and then only between two of them.

The least squares are solved with `numpy.linalg.lstsq`, as one usually does, or with the normal equations, which are
faster. The benchmark harness runs this program. It sends one JSON request per line and reads one JSON answer per line,
so that both programs take turns on the same frames. The level in the request is the threshold that hzn has found.
"""

import json
import mmap
import sys
import time
from pathlib import Path

import cv2
import numpy as np

cv2.setNumThreads(1)

FLUSH = np.zeros(64 << 20, dtype=np.uint8)
LARGE_PAGE = 2 << 20


def on_large_pages(data, shape):
    """Returns a copy of the data as an image at the start of a page of 2 MiB, where the system has such pages."""
    # Memory that programs could share has large pages only where the system's settings say so.
    private = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
    room = mmap.mmap(-1, -(-len(data) // LARGE_PAGE) * LARGE_PAGE + LARGE_PAGE, flags=private)
    if hasattr(mmap, "MADV_HUGEPAGE"):
        room.madvise(mmap.MADV_HUGEPAGE)
    whole = np.frombuffer(room, dtype=np.uint8)
    start = -whole.ctypes.data % LARGE_PAGE
    image = whole[start : start + len(data)].reshape(shape)
    image[:] = np.frombuffer(data, dtype=np.uint8).reshape(shape)
    return image


class Case:
    """The frames of one case in memory, and the lens."""

    def __init__(self, folder):
        manifest = json.loads((folder / "case.json").read_text())
        camera = manifest["camera"]
        shape = (camera["height"], camera["width"])
        self.frames = [on_large_pages((folder / f["file"]).read_bytes(), shape) for f in manifest["frames"]]
        self.shape = shape
        self.matrix = np.array(
            [[camera["fx_px"], 0, camera["cx_px"]], [0, camera["fy_px"], camera["cy_px"]], [0, 0, 1]], dtype=np.float64
        )
        k = list(camera.get("k", [])) + [0.0] * 4
        self.k = np.array(k[:4], dtype=np.float64)
        # Preallocated, as one would for a stream of frames.
        self.binary = on_large_pages(bytes(shape[0] * shape[1]), shape)


def flush_caches():
    """Walks through more memory than the caches hold."""
    FLUSH[::64] += 1


def solve_lstsq(rows, right):
    return np.linalg.lstsq(rows, right, rcond=None)[0]


def solve_normal_equations(rows, right):
    return np.linalg.solve(rows.T @ rows, rows.T @ right)


SOLVERS = {"lstsq": solve_lstsq, "normal equations": solve_normal_equations, "every 8th pixel": solve_lstsq}


def find_crossings(image, level, step=8):
    """Returns where columns and rows, every 8th of them, cross the threshold, as (x, y) with parts of a pixel."""
    found = []
    for turned in (image, image.T):
        lit = turned[::step, ::step] >= level
        row, column = np.nonzero(lit[1:] != lit[:-1])
        across = np.arange(step + 1)
        profile = turned[row[:, None] * step + across, column[:, None] * step].astype(np.float64)
        crosses = (profile[:, 1:] >= level) != (profile[:, :-1] >= level)
        first = np.argmax(crosses, axis=1)
        each = np.arange(len(row))
        before, after = profile[each, first], profile[each, first + 1]
        along = row * step + first + (level - 0.5 - before) / (after - before)
        place = np.column_stack((column * step, along))
        found.append(place if turned is image else place[:, ::-1])
    return np.concatenate(found)


def find_axis(case, image, level, solver):
    # Processor time: on a busy machine these long runs are interrupted, which is no cost of the recipe.
    clock = time.thread_time_ns
    solve = SOLVERS[solver]
    t0 = clock()
    if solver == "every 8th pixel":
        points = find_crossings(image, level)
        t1 = clock()
        return fit_axis(case, points, solve, {"crossings": (t1 - t0) / 1e3}, t0)
    _, binary = cv2.threshold(image, level - 1, 255, cv2.THRESH_BINARY, dst=case.binary)
    t1 = clock()
    contours, _ = cv2.findContours(binary, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    t2 = clock()
    height, width = case.shape
    points = max(contours, key=len, default=np.empty((0, 1, 2), np.int32))
    x, y = points[:, 0, 0], points[:, 0, 1]
    inside = (x > 0) & (x < width - 1) & (y > 0) & (y < height - 1)
    points = points[inside, 0].astype(np.float64)
    t3 = clock()
    stages_us = {"threshold": (t1 - t0) / 1e3, "findContours": (t2 - t1) / 1e3, "longest": (t3 - t2) / 1e3}
    return fit_axis(case, points, solve, stages_us, t0)


def fit_axis(case, points, solve, stages_us, begun):
    """Fits the direction to points, and returns the answer with the times of the stages before and of these."""
    clock = time.thread_time_ns
    t3 = clock()
    axis = None
    t4 = t5 = t3
    if len(points) >= 3:
        plane = cv2.fisheye.undistortPoints(points[:, None, :], case.matrix, case.k)[:, 0, :]
        t4 = clock()
        rows = np.column_stack((plane, np.ones(len(plane))))
        try:
            solution = solve(rows, np.sqrt((rows * rows).sum(axis=1)))
        except np.linalg.LinAlgError:
            solution = np.full(3, np.nan)
        length = np.sqrt(solution @ solution)
        if np.isfinite(length) and length > 0:
            axis = (solution / length).tolist()
        t5 = clock()
    name = solve.__name__.removeprefix("solve_").replace("_", " ")
    times = {"undistortPoints": (t4 - t3) / 1e3, name: (t5 - t4) / 1e3}
    return {"stages_us": stages_us | times, "total_us": (t5 - begun) / 1e3, "axis": axis, "points": len(points)}


def answer(case, request):
    """Brings the caches into the state of the request and measures one frame."""
    frame, level, solver = request["frame"], request["level"], request["solver"]
    state = request["state"]
    if state == "warm":
        before = [frame, frame]
    else:
        flush_caches()
        other = (frame + 1) % len(case.frames)
        before = [other, other] if state == "picture flushed" else []
    for i in before:
        find_axis(case, case.frames[i], level, solver)
    return find_axis(case, case.frames[frame], level, solver)


def on_large_pages_mib():
    """Returns the memory of this program that lies on large pages, in MiB; 0 if the system does not say."""
    try:
        lines = Path("/proc/self/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0.0
    return sum(float(line.split()[1]) for line in lines if line.startswith("AnonHugePages:")) / 1024


def main():
    folder = Path(sys.argv[1])
    print(json.dumps({"opencv": cv2.__version__, "numpy": np.__version__}), flush=True)
    name, case, large_mib = None, None, 0.0
    for line in sys.stdin:
        request = json.loads(line)
        if request["case"] != name:
            name, case = request["case"], None
            before = on_large_pages_mib()
            case = Case(folder / request["case"])
            large_mib = on_large_pages_mib() - before
            # The libraries prepare things on first use; this time is not a cost of the recipe.
            for solver in SOLVERS:
                find_axis(case, case.frames[0], 128, solver)
        print(json.dumps(answer(case, request) | {"large_pages_mib": large_mib}), flush=True)


if __name__ == "__main__":
    main()

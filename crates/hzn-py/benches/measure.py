"""Measures what Python costs in addition to the sensor. `cargo xtask bench python` runs it.

It writes book/results/python-measured.md.

    measure.py OUTPUT [--frames N]
"""

import argparse
import itertools
import os
import platform
import statistics
import tempfile
import time
from pathlib import Path

import distributed
import numpy as np
from PIL import Image

import hzn
from hzn.dask import process_archive


SIZES = ((160, 120, 20_000), (640, 480, 10_000), (1920, 1080, 6_000), (4096, 3072, 3_000))
"""Sizes of pictures in memory, and the number of pictures of each size."""


def limb(width, height, seed=1):
    """Return a picture and a sensor: a bright body (half-angle 70 degrees, blurred, noise) covers a sixth of it."""
    f = width * 0.9375
    x, y = (np.arange(width) - (width - 1) / 2) / f, (np.arange(height)[:, None] - (height - 1) / 2) / f
    s = np.radians(68.0)
    cos = (y * np.sin(s) + np.cos(s)) / np.sqrt(1 + x * x + y * y)
    px = (np.radians(70.38) - np.arccos(np.clip(cos, -1, 1))) * f
    noise = np.random.default_rng(seed).normal(0, 4, (height, width))
    image = np.clip(20 + 180 * np.clip(0.5 + px / 2, 0, 1) + noise, 0, 255).astype(np.uint8)
    camera = hzn.Camera(
        width=width, height=height, model="pinhole", fx_px=f, fy_px=f, cx_px=(width - 1) / 2, cy_px=(height - 1) / 2
    )
    return image, hzn.Sensor(camera=camera, body={"kind": "earth-sphere", "altitude_km": 400.0})


def overhead(width, height, calls=400):
    """Return the medians of a call from Python, of the Rust call within it, and of the difference, microseconds."""
    image, sensor = limb(width, height)
    whole, within = [], []
    for _ in range(calls):
        start = time.perf_counter()
        report = sensor.process(image)
        whole.append((time.perf_counter() - start) * 1e6)
        assert report.ok
        within.append(report.elapsed_us)
    more = [a - b for a, b in zip(whole, within, strict=True)]
    return [statistics.median(times) for times in (whole, within, more)]


def rate(reports, frames):
    """Return the pictures per second."""
    start = time.perf_counter()
    for report in reports:
        assert report.ok
    return frames / (time.perf_counter() - start)


def threads():
    """Return 1, 2, 4 and so on, up to the number of cores."""
    return list(itertools.takewhile(lambda n: n <= (os.cpu_count() or 1), (1 << i for i in range(10))))


def scaling(width, height, frames):
    """Return pictures per second of a loop over `process`, and of `process_many` by threads; eight pictures in turn."""
    pictures = [limb(width, height, seed)[0] for seed in range(8)]
    sensor = limb(width, height)[1]

    def images():
        return itertools.islice(itertools.cycle(pictures), frames)

    return [rate(map(sensor.process, images()), frames)] + [
        rate(sensor.process_many(images(), jobs=jobs), frames) for jobs in threads()
    ]


def scaling_of_files(width, height, frames):
    """Return pictures per second of `process_many` by threads, from PNG files, with decoding."""
    sensor = limb(width, height)[1]
    with tempfile.TemporaryDirectory() as folder:
        kinds = []
        for seed in range(4):
            kinds.append(Path(folder) / f"{seed}.png")
            Image.fromarray(limb(width, height, seed)[0]).save(kinds[-1])
        paths = [kinds[i % 4] for i in range(frames)]
        return [rate(sensor.process_many(paths, jobs=jobs), frames) for jobs in threads()]


def resident_mb():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def memory(frames):
    """Return the resident megabytes after a tenth of the pictures and after all; each picture is a new array."""
    image, sensor = limb(160, 120)
    after = []
    for count, report in enumerate(sensor.process_many((image.copy() for _ in range(frames)), jobs=2), 1):
        assert report.ok
        if count in (frames // 10, frames):
            after.append(resident_mb())
    return after


def archive(width, height, ending, frames, workers):
    """Return pictures per second of `hzn.dask`, from files on this machine, and milliseconds of processors per picture.

    The processors' time is that of the workers, with the decoding of the pictures and the writing of the shards.
    """
    image, sensor = limb(width, height)
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / f"picture.{ending}"
        Image.fromarray(image).save(picture)
        with distributed.LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=None
        ) as cluster, distributed.Client(cluster) as client:
            urls = [(str(picture), {"time_s": float(i)}) for i in range(frames)]
            process_archive(urls[: 2 * workers], sensor, client=client, out=f"{folder}/warm", shard_frames=1)
            start, before = time.perf_counter(), sum(client.run(time.process_time).values())
            result = process_archive(urls, sensor, client=client, out=f"{folder}/out", shard_frames=frames // 20)
            assert not result.failed
            wall_s, used_s = time.perf_counter() - start, sum(client.run(time.process_time).values()) - before
            return frames / wall_s, used_s / frames * 1e3


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("output", type=Path)
    parser.add_argument("--frames", type=int, default=100_000, help="pictures of the run that measures the memory")
    arguments = parser.parse_args()
    load = os.getloadavg()[0]
    lines = [
        "# Measurements of the Python package",
        "",
        "Written by `cargo xtask bench python`: the wheel of a release build, "
        f"Python {platform.python_version()}, NumPy {np.__version__}, {os.cpu_count()} cores; "
        f"load of the machine at the start {load:.1f}.",
        "",
        "## Time of a call",
        "",
        "Medians of 400 calls of `Sensor.process` on one picture, warm, in double precision. The difference is the time"
        " that Python adds to the Rust call: it reads the array, takes an idle sensor, releases the interpreter and makes the"
        " report.",
        "",
        "| picture | call, µs | Rust within it, µs | difference, µs |",
        "|---|---|---|---|",
    ]
    for width, height in ((640, 480), (1920, 1080)):
        whole, within, more = overhead(width, height)
        lines.append(f"| {width}×{height} | {whole:.1f} | {within:.1f} | {more:.1f} |")
    head = "".join(f" {jobs} {'thread' if jobs == 1 else 'threads'} |" for jobs in threads())
    lines += [
        "",
        "## `process_many`",
        "",
        "Pictures per second. The number in brackets is the ratio to a loop over `process` in the same run (for files, to one"
        " thread). The arrays are eight pictures in turn. The PNG files are four pictures in turn; their time includes the"
        " decoding.",
        "",
        f"| picture | loop over `process` |{head}",
        "|---|---|" + "---|" * len(threads()),
    ]
    for width, height, frames in SIZES:
        alone, *many = scaling(width, height, frames)
        cells = "".join(f" {r:.0f} ({r / alone:.2f}) |" for r in many)
        lines.append(f"| {width}×{height} array | {alone:.0f} |{cells}")
    many = scaling_of_files(1920, 1080, 400)
    lines.append("| 1920×1080 PNG file | |" + "".join(f" {r:.0f} ({r / many[0]:.2f}) |" for r in many))
    tenth, full = memory(arguments.frames)
    lines += [
        "",
        f"The process uses {tenth:.0f} MB after {arguments.frames // 10} pictures and {full:.0f} MB after {arguments.frames}"
        " pictures (160×120, each a new array).",
        "",
        "## `hzn.dask`",
        "",
        "A `LocalCluster` on this machine, from files, into twenty Parquet shards. The processors' time is that of the"
        " processes, and does not count the client.",
        "",
        "| pictures | processes | pictures per second | processors, ms per picture |",
        "|---|---|---|---|",
    ]
    for width, height, ending, frames in ((640, 480, "pgm", 10_000), (1920, 1080, "png", 4_000)):
        for workers in (1, 2):
            per_second, used_ms = archive(width, height, ending, frames, workers)
            name = f"{frames} of {width}×{height}, {ending.upper()}"
            lines.append(f"| {name} | {workers} | {per_second:.0f} | {used_ms:.2f} |")
    lines.append("")
    arguments.output.write_text("\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    main()

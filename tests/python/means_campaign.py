"""Flies hzn through simulated flights of 100 pictures, and compares the errors of means with what is common to them.

    python means_campaign.py --hzn target/release/hzn --flights 20 --first-seed 930000

The pictures are 640 wide at most. The sensor has default settings; it gets the camera and the position. A filter takes
means of many answers: their NEES with the common part should be 2, and from 0.5 to 3 it is as wanted.
"""

import argparse
import concurrent.futures
import csv
import json
import math
import pathlib
import re
import shutil
import subprocess
import tempfile

SCENES = ["rocket-clean", "rocket", "leo-infrared", "horace-wide", "full-disc"]
WIDEST_PX = 640
LENGTHS = [3, 10, 100]
# Pictures of a flight are taken within this time, so that the limb hardly moves: its errors stay the same.
SECONDS = 10.0


def hzn(program, *args):
    done = subprocess.run([program, *map(str, args)], capture_output=True, text=True)
    # 3: a picture has no answer that can be; its row says so.
    if done.returncode not in (0, 3):
        raise RuntimeError(f"hzn {' '.join(map(str, args))}: {done.stderr.strip()}")
    return done.stdout


def smaller(scene):
    """Returns a scene with a smaller camera of the same field of view."""
    width = int(re.search(r"^width = (\d+)", scene, re.M)[1])
    scale = min(1.0, WIDEST_PX / width)

    def number(match):
        key, value = match[1], float(match[2])
        if key in ("width", "height"):
            return f"{key} = {round(value * scale)}"
        # The middle of the first pixel is 0.
        return f"{key} = {(value + 0.5) * scale - 0.5 if key.startswith('c') else value * scale:.6f}"

    return re.sub(r"^(width|height|[fc][xy]_px) = ([\d.]+)", number, scene, flags=re.M)


def short(scene, share):
    """Returns a scene whose pictures are taken within SECONDS, after this share of the whole capture."""
    found = re.search(r"^from_s = ([\d.]+)\n", scene, re.M)
    begin, end = float(found[1]) if found else 0.0, float(re.search(r"^to_s = ([\d.]+)", scene, re.M)[1])
    begin += share * (end - begin)
    scene = re.sub(r"^from_s = [\d.]+\n", "", scene, flags=re.M)
    return re.sub(r"^to_s = [\d.]+", f"from_s = {begin}\nto_s = {begin + SECONDS}", scene, flags=re.M)


def axes(table):
    """Returns the axes of a table by file; those of the answers, if it has results."""
    with table.open() as file:
        rows = list(csv.DictReader(file))
    return {row["file"]: [float(row[f"axis_{k}"]) for k in "xyz"] for row in rows if row.get("status", "ok") == "ok"}


def errors_deg(found, truth):
    """Returns the errors of answers by file, in degrees."""
    half_chord = {name: math.dist(axis, truth[name]) / 2 for name, axis in found.items()}
    return {name: math.degrees(2 * math.asin(min(1.0, x))) for name, x in half_chord.items()}


def fly(program, root, scene, share, seed, pictures):
    """Renders and processes a flight. Returns the scene, hzn's report, and the errors of hzn and of the recipe of
    dlr-2022 on the pictures that both answer."""
    folder, file = root / f"{scene}-{seed}", root / f"{scene}-{seed}.toml"
    file.write_text(short((root / f"{scene}.toml").read_text(), share))
    of = ["--frames", pictures, "--seed", seed, "--no-noise", "-q"]
    hzn(program, "simulate", file, "-o", folder, *of)
    truth = axes(folder / "truth.csv")
    sensor = folder / "sensor.toml"
    found, found_by = [], [("hzn", sensor.read_text())]
    found_by.append(("dlr-2022", found_by[0][1].replace('preset = "hzn"', 'preset = "dlr-2022"')))
    for name, text in found_by:
        sensor.write_text(text)
        table = folder / f"{name}.csv"
        hzn(program, "run", folder, "-o", table, "-q")
        found.append(errors_deg(axes(table), truth))
    report = json.loads(hzn(program, "evaluate", folder / "hzn.csv", "--truth", folder, "--json"))
    shutil.rmtree(folder)
    both = found[0].keys() & found[1].keys()
    return scene, report["evaluations"][0], [[of[name] for name in both] for of in found]


def mean(values, weights=None):
    weights = weights or [1] * len(values)
    return sum(v * w for v, w in zip(values, weights)) / sum(weights) if values else math.nan


def table(flown, scenes):
    print("| scene | answered | NEES | of means of 3, 10, 100 | if independent | RMS of hzn, dlr-2022 (both) |")
    print("|---|---:|---:|---:|---:|---:|")
    for scene in scenes:
        reports = [report for name, report, _ in flown if name == scene]
        answers = [report["honesty"]["answers"] for report in reports]
        nees = mean([report["honesty"]["nees"] for report in reports], answers)
        cells = []
        for key in ["nees", "nees_if_independent"]:
            of = [[row for report in reports for row in report["means"] if row["answers"] == n] for n in LENGTHS]
            means = [mean([row[key] for row in rows], [row["groups"] for row in rows]) for rows in of]
            cells.append(", ".join(f"{value:.2f}" for value in means))
        both = [errors for name, _, errors in flown if name == scene]
        rms = [math.sqrt(mean([error**2 for errors in both for error in errors[i]])) for i in (0, 1)]
        limbs, shared = sum(report["with_limb"] for report in reports), sum(len(errors[0]) for errors in both)
        print(f"| {scene} | {sum(answers)} of {limbs} | {nees:.2f} | {cells[0]} | {cells[1]} "
              f"| {rms[0]:.3f}°, {rms[1]:.3f}° ({shared}) |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--flights", type=int, default=20, help="flights of each scene (20)")
    parser.add_argument("--first-seed", type=int, default=930000, help="first seed of each scene (930000)")
    parser.add_argument("--pictures", type=int, default=100, help="pictures of a flight (100)")
    parser.add_argument("--scenes", nargs="+", default=SCENES, choices=SCENES, help="scenes (all)")
    options = parser.parse_args()
    program = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it or give a path")
    with tempfile.TemporaryDirectory() as temporary, concurrent.futures.ThreadPoolExecutor(2) as pool:
        root = pathlib.Path(temporary)
        for scene in options.scenes:
            (root / f"{scene}.toml").write_text(smaller(hzn(program, "simulate", scene, "--show")))
        jobs = []
        for scene in options.scenes:
            for number in range(options.flights):
                share, seed = number / options.flights, options.first_seed + number
                jobs.append(pool.submit(fly, program, root, scene, share, seed, options.pictures))
        flown = [job.result() for job in jobs]
    table(flown, options.scenes)


if __name__ == "__main__":
    main()

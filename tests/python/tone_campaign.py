"""Measures what a known tone gives a sensor with the default limb height: the same pictures, once with the tone, once without.

    python tone_campaign.py --hzn target/release/hzn --flights 6 --first-seed 8300

Scenes of the simulator (`hzn simulate`, all cameras of a scene) and pictures by day of another program (limb_pictures.py).
The sensor has the lens, the mask and the position; the limb height, its sigma and the noise are the defaults. Each line
has its own answers, and the ratio is over the pictures that both answer. The NEES is 2 if the covariance is right.
"""

import argparse
import concurrent.futures
import csv
import math
import pathlib
import re
import shutil
import subprocess
import tempfile

import numpy as np

import limb_campaign
import limb_pictures

SCENES = ["rocket", "rocket-clean", "atek", "tumble"]
OTHER = "another program, day"
OTHER_PICTURES = 8


def simulate(hzn, folder, scene, seed, frames):
    """Renders a flight. Returns, per camera: folder, tone, and the axis of each picture with a limb."""
    command = [hzn, "simulate", scene, "--frames", str(frames), "--seed", str(seed), "--no-noise", "-q", "-o", str(folder)]
    subprocess.run(command, check=True, capture_output=True)
    flown = []
    for sensor in sorted(folder.glob("**/sensor.toml")):
        text = sensor.read_text()
        tone = re.search(r'(?m)^tone = "?([^"\n]*)', text)[1]
        # What is left of [body] is the kind and the altitude's reference.
        text = re.sub(r"(?m)^(limb|airglow|clipped|night)\w* = .*\n", "", text)
        sensor.write_text(re.sub(r"(?m)^(\[input\]\n)?tone = .*\n", "", text))
        with (sensor.parent / "truth.csv").open() as file:
            truth = {row["file"]: np.array([float(row[f"axis_{k}"]) for k in "xyz"]) for row in csv.DictReader(file)
                     if row["limb"] == "1"}
        flown.append((sensor.parent, tone, truth))
    return flown


def render(folder, seed):
    """Renders a flight by day of the other program. Returns the same as `simulate`."""
    truth = limb_pictures.render_flight(folder, seed, "day", OTHER_PICTURES)
    return [(folder, (folder / "tone").read_text(), {name: axis for name, (axis, _) in truth.items()})]


def fly(hzn, root, scene, seed, frames):
    """Returns, per picture with a limb, the error and its square over the covariance without and with the tone."""
    folder = root / f"{scene.replace(', ', '-').replace(' ', '-')}-{seed}"
    cameras = render(folder, seed) if scene == OTHER else simulate(hzn, folder, scene, seed, frames)
    found = []
    for camera, tone, truth in cameras:
        columns = (camera / "frames.csv").read_text().splitlines()[0].split(",")
        # An attitude would say where the limb is.
        columns = [name for name in columns if name not in limb_campaign.ATTITUDE]
        answers = []
        for told in ("unknown", tone):
            value = told if re.fullmatch(r"[\d.]+", told) else f'"{told}"'
            rows = limb_campaign.process(hzn, camera, columns, f"\n[input]\ntone = {value}\n")
            rows = {pathlib.Path(row["file"]).name: row for row in rows if row["status"] == "ok"}
            answers.append({name: limb_campaign.miss(row, truth[name]) for name, row in rows.items() if name in truth})
        found += [tuple(answer.get(name) for answer in answers) for name in truth]
    shutil.rmtree(folder)
    return scene, found


def show(scenes, flown):
    print("| pictures | tone | limbs | answered | RMS | NEES | beyond 3 sigma | RMS x unknown |")
    print("|---|---|---:|---:|---:|---:|---:|---:|")
    for scene in scenes:
        rows = [row for name, found in flown if name == scene for row in found]
        both = np.array([[unknown[0], told[0]] for unknown, told in rows if unknown and told])
        ratio = np.sqrt(np.divide(*(both[::, ::-1] ** 2).mean(0))) if len(both) else math.nan
        for column, told in enumerate(("unknown", "told")):
            errors, squares = np.array([row[column] for row in rows if row[column]]).reshape(-1, 2).T
            cells = [scene, told, f"{len(rows)}", f"{len(errors)}", f"{math.sqrt((errors**2).mean()):.3f}°",
                     f"{squares.mean():.2f}", f"{100 * (squares > limb_campaign.BEYOND_3).mean():.1f} %",
                     f"{ratio:.2f}" if column else ""]
            print(f"| {' | '.join(cells)} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--flights", type=int, default=6, help="flights of each scene (6)")
    parser.add_argument("--frames", type=int, default=24, help="pictures of each camera of a scene (24)")
    parser.add_argument("--first-seed", type=int, default=8300, help="seed of the first flight (8300)")
    parser.add_argument("--scenes", nargs="+", default=[*SCENES, OTHER], help="without it, all")
    parser.add_argument("--jobs", type=int, help="number of processes; without it, all cores")
    options = parser.parse_args()
    hzn = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it, or give its path")
    seeds = range(options.first_seed, options.first_seed + options.flights)
    with tempfile.TemporaryDirectory() as root, concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        todo = [pool.submit(fly, hzn, pathlib.Path(root), scene, seed, options.frames)
                for scene in options.scenes for seed in seeds]
        show(options.scenes, [flight.result() for flight in todo])


if __name__ == "__main__":
    main()

"""Runs hzn on pictures of the limb that another program renders (limb_pictures.py), and counts errors against sigma.

    python limb_campaign.py --hzn target/release/hzn --flights 30 --first-seed 2000

The sensor has default settings. It gets the camera, whose calibration has errors of the given sizes, and the position.
Others also get an attitude with errors of 5 degrees, the direction to the Sun with body.sunlit = true, or both. With
--check the program exits with 1 if an answer by day is beyond 5 sigma, or if fewer than nine of ten limbs by day are
answered.
"""

import argparse
import concurrent.futures
import csv
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np

import limb_pictures

PICTURES = 8
# A limb counts as visible if sunlight reaches this many pixels of it.
LEAST_LIMB_PX = 50
# Chi-square of two degrees of freedom, with the probabilities of 3 and 5 sigma of one degree.
BEYOND_3, BEYOND_5 = 11.83, 28.74
# What each sensor gets: columns of frames.csv, and lines at the end of its sensor.toml.
POSITION, SUN = ["file", "x_km", "y_km", "z_km"], ["sun_x", "sun_y", "sun_z"]
ATTITUDE = ["qw", "qx", "qy", "qz", "attitude_sigma_deg"]
SENSORS = {
    "default": (POSITION, ""),
    "with an attitude": (POSITION + ATTITUDE, ""),
    "with the Sun": (POSITION + SUN, "sunlit = true\n"),
    "with both": (POSITION + ATTITUDE + SUN, "sunlit = true\n"),
}
# The recipe of a published system, which gets what the sensor "default" gets.
RECIPE = "dlr-2022"


def answers(hzn, folder, sensor):
    """Runs hzn on a flight. Returns the rows of its results."""
    return process(hzn, folder, *SENSORS[sensor])


def process(hzn, folder, columns, lines, table="frames.csv", first=""):
    """Runs hzn with these columns of a table and these further lines of sensor.toml. Returns the rows of its results."""
    (folder / "used.toml").write_text(first + (folder / "sensor.toml").read_text() + lines)
    with (folder / table).open() as file:
        rows = list(csv.DictReader(file))
    with (folder / "used.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    out = folder / "out.csv"
    command = [hzn, "run", *sorted(str(folder / row["file"]) for row in rows), "--sensor", str(folder / "used.toml"),
               "--frames", str(folder / "used.csv"), "-o", str(out), "--force", "-q"]
    done = subprocess.run(command, capture_output=True, text=True)
    # 3: a picture has no altitude above the limb height; its row says so.
    if done.returncode not in (0, 3):
        raise RuntimeError(f"{folder}: {done.stderr.strip()}")
    with out.open() as file:
        return list(csv.DictReader(file))


def miss(row, axis):
    """Returns the error in degrees and the squared error over the covariance."""
    answer = np.array([float(row[f"axis_{k}"]) for k in "xyz"])
    covariance = np.array([[float(row["cov_" + "".join(sorted(a + b))]) for b in "xyz"] for a in "xyz"])
    off = axis - answer
    # The covariance has rank two: the largest two eigenvectors span the tangent plane.
    values, vectors = np.linalg.eigh(covariance)
    normalised = ((vectors[:, 1:].T @ off) ** 2 / values[1:]).sum()
    return math.degrees(math.atan2(np.linalg.norm(np.cross(axis, answer)), axis @ answer)), normalised


def fly(hzn, root, kind, seed):
    """Renders a flight and returns, per sensor, [picture, whether its limb is lit, error and squared error or None]."""
    folder = root / f"{kind.replace(', ', '-').replace(' ', '-')}-{seed}"
    truth = limb_pictures.render_flight(folder, seed, kind, PICTURES)
    results = {}
    for sensor in SENSORS:
        results[sensor] = []
        for row in answers(hzn, folder, sensor):
            axis, limb_px = truth[pathlib.Path(row["file"]).name]
            found = miss(row, axis) if row["status"] == "ok" else None
            results[sensor].append((f"{folder.name}/{pathlib.Path(row['file']).name}", limb_px >= LEAST_LIMB_PX, found))
    results[RECIPE] = recipe(hzn, folder, truth, results["default"])
    return kind, results


def recipe(hzn, folder, truth, found):
    """Returns the errors of hzn and of the published recipe, in degrees, on pictures with a limb that both answer."""
    pairs = []
    rows = process(hzn, folder, POSITION, "", first=f'preset = "{RECIPE}"\n')
    for row, (_, lit, answer) in zip(rows, found, strict=True):
        if lit and answer and row["status"] == "ok":
            pairs.append((answer[0], miss(row, truth[pathlib.Path(row["file"]).name][0])[0]))
    return pairs


def table(flown):
    print("| pictures | sensor | limbs | answered | other answers | median error | NEES | beyond 3 sigma | beyond 5 sigma |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|")
    for kind in limb_pictures.CLASSES:
        for sensor in SENSORS:
            rows = [row for k, results in flown if k == kind for row in results[sensor]]
            limbs = [row for row in rows if row[1]]
            found = [row[2] for row in rows if row[2]]
            errors, squares = np.array(found).T if found else np.zeros((2, 1))
            print(f"| {kind} | {sensor} | {len(limbs)} | {sum(row[2] is not None for row in limbs)} "
                  f"| {sum(row[2] is not None for row in rows if not row[1])} | {np.median(errors):.3f}° "
                  f"| {squares.mean():.2f} | {(squares > BEYOND_3).sum()} | {(squares > BEYOND_5).sum()} |")


def compare_with_recipe(flown):
    print(f"\n| pictures | answered by both | hzn: RMS, median | {RECIPE}: RMS, median |\n|---|---:|---:|---:|")
    for kind in limb_pictures.CLASSES:
        pairs = np.array([pair for k, results in flown if k == kind for pair in results[RECIPE]]).reshape(-1, 2)
        if len(pairs):
            rms, median = np.sqrt((pairs**2).mean(axis=0)), np.median(pairs, axis=0)
            cells = " | ".join(f"{rms[i]:.3f}°, {median[i]:.3f}°" for i in (0, 1))
            print(f"| {kind} | {len(pairs)} | {cells} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--flights", type=int, default=30, help="flights of each kind, with eight pictures (30)")
    parser.add_argument("--first-seed", type=int, default=2000, help="seed of the first flight of each kind (2000)")
    parser.add_argument("--keep", type=pathlib.Path, help="folder that keeps the flights")
    parser.add_argument("--list", action="store_true", help="names the pictures beyond 3 sigma")
    parser.add_argument("--check", action="store_true", help="exits with 1 if the answers by day are not right")
    options = parser.parse_args()
    hzn = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it, or give its path")
    with tempfile.TemporaryDirectory() as temporary, concurrent.futures.ProcessPoolExecutor() as pool:
        root = options.keep or pathlib.Path(temporary)
        seeds = range(options.first_seed, options.first_seed + options.flights)
        flights = [pool.submit(fly, hzn, root, kind, seed) for kind in limb_pictures.CLASSES for seed in seeds]
        flown = [flight.result() for flight in flights]
    table(flown)
    compare_with_recipe(flown)
    if options.list:
        for kind, results in flown:
            for sensor in SENSORS:
                for name, lit, found in results[sensor]:
                    if found and found[1] > BEYOND_3:
                        print(f"{name}  {sensor}: {found[0]:.3f} deg, squared error {found[1]:.1f}")
    if options.check:
        by_day = [row for kind, results in flown if kind.startswith("day") for row in results["default"]]
        limbs = [row for row in by_day if row[1]]
        answered = sum(row[2] is not None for row in limbs)
        far = [row[0] for row in by_day if row[2] and row[2][1] > BEYOND_5]
        if far or 10 * answered < 9 * len(limbs):
            sys.exit(f"by day {answered} of {len(limbs)} limbs are answered; beyond 5 sigma: {', '.join(far) or 'none'}")


if __name__ == "__main__":
    main()

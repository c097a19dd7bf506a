"""Errors of hzn towards the middle of the limb in view and across it, by the Sun's elevation at the limb.

    python low_sun_campaign.py --hzn target/release/hzn --flights 30 --first-seed 5000

The pictures are those of another program (limb_pictures.py) with a low Sun, whose air scatters light once, so that the
edge of the limb rises where the Sun is low; --even keeps the light of all heights equal. The sensors have default
settings and the position, and one of them the direction to the Sun. NEES is normalised: 1 is ideal. A turn across the
limb is one about the line from the Earth's centre to the middle of the limb in view.
"""

import argparse
import concurrent.futures
import csv
import math
import pathlib
import shutil
import tempfile

import numpy as np

import limb_campaign
import limb_pictures

SENSORS = {"position": limb_campaign.POSITION, "position and Sun": limb_campaign.POSITION + limb_campaign.SUN}
# Elevations of the Sun at the middle of the limb in view, degrees.
BANDS = [(-20, -2), (-2, 6), (6, 15), (15, 90)]


def errors(row, axis, sun):
    """Returns the Sun's elevation, the error in degrees, NEES, and the square of each component over its variance."""
    answer = np.array([float(row[f"axis_{k}"]) for k in "xyz"])
    covariance = np.array([[float(row["cov_" + "".join(sorted(a + b))]) for b in "xyz"] for a in "xyz"])
    towards = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    towards /= np.linalg.norm(towards)
    across = np.cross(axis, towards)
    half_angle = math.radians(float(row["half_angle_deg"]))
    sine = math.cos(half_angle) * (towards @ sun) - math.sin(half_angle) * (axis @ sun)
    parts = [(v @ (axis - answer)) ** 2 / (v @ covariance @ v) for v in (across, towards)]
    error, square = limb_campaign.miss(row, axis)
    sigmas = [math.degrees(math.sqrt(v @ covariance @ v)) for v in (across, towards)]
    return [math.degrees(math.asin(max(-1.0, min(1.0, sine)))), error, square / 2, *parts, *sigmas]


def fly(hzn, root, seed, shade, size, pictures):
    """Renders a flight, and returns the errors of its answers by sensor."""
    limb_pictures.WIDTH, limb_pictures.HEIGHT = size
    folder = root / str(seed)
    truth = limb_pictures.render_flight(folder, seed, "low Sun", pictures, shade)
    with (folder / "frames.csv").open() as file:
        suns = {row["file"]: np.array([float(row[f"sun_{k}"]) for k in "xyz"]) for row in csv.DictReader(file)}
    found, limbs = {}, sum(limb_px >= limb_campaign.LEAST_LIMB_PX for _, limb_px in truth.values())
    for sensor, columns in SENSORS.items():
        found[sensor] = []
        for row in limb_campaign.process(hzn, folder, columns, ""):
            name = pathlib.Path(row["file"]).name
            axis, limb_px = truth[name]
            if row["status"] == "ok" and limb_px >= limb_campaign.LEAST_LIMB_PX:
                found[sensor].append(errors(row, axis, suns[name]))
    return found, limbs


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--flights", type=int, default=30, help="flights with six pictures (30)")
    parser.add_argument("--first-seed", type=int, default=5000, help="seed of the first flight (5000)")
    parser.add_argument("--even", action="store_true", help="the Sun's way through the air does not weaken its light")
    options = parser.parse_args()
    hzn = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it, or give its path")
    with tempfile.TemporaryDirectory() as temporary, concurrent.futures.ProcessPoolExecutor() as pool:
        seeds = range(options.first_seed, options.first_seed + options.flights)
        flights = [pool.submit(fly, hzn, pathlib.Path(temporary), seed, not options.even, (640, 480), 6) for seed in seeds]
        flown = [flight.result() for flight in flights]
    print(f"{sum(limbs for _, limbs in flown)} pictures with a limb")
    print("| sensor | Sun at the limb | answers | RMS | NEES | across | towards | beyond 3 sigma | sigma across, towards |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|")
    for sensor in SENSORS:
        rows = np.array([row for found, _ in flown for row in found[sensor]]).reshape(-1, 7)
        for low, high in BANDS:
            band = rows[(rows[:, 0] >= low) & (rows[:, 0] < high)]
            if not len(band):
                continue
            _, error, nees, across, towards, *sigmas = band.T
            medians = ", ".join(f"{np.median(s):.3f}°" for s in sigmas)
            print(f"| {sensor} | {low} to {high}° | {len(band)} | {np.sqrt((error**2).mean()):.3f}° | {nees.mean():.2f} "
                  f"| {across.mean():.2f} | {towards.mean():.2f} | {(2 * nees > limb_campaign.BEYOND_3).sum()} | {medians} |")


if __name__ == "__main__":
    main()

"""Counts edges that hzn takes as fixed in the picture (`gates.fixed_edge`), on flights of another program.

    python turn_campaign.py --hzn target/release/hzn --flights 20 --first-seed 900000

A flight has PICTURES pictures of a vehicle that turns at a constant rate, and frames.csv has this rate with an error.
It is rendered twice (limb_pictures.py). In the first sequence the limb moves with the turn: every answer that is refused
is a false alarm. In the second one, the same limb stays where it is, with new noise in each picture: an edge of the
window that passes every other gate. It should be refused once the vehicle has turned by a degree.
"""

import argparse
import concurrent.futures
import csv
import math
import pathlib
import shutil
import subprocess
import tempfile

import cv2
import numpy as np

import limb_campaign
import limb_pictures

PICTURES = 8
SIZE = (480, 360)
# Error of the gyro, degrees per second: the bias of a cheap one.
GYRO_DEG_S = 0.02
# Turn from which an edge of the window should be noticed, degrees.
NOTICED_DEG = 1.0


def render(folder, seed, moves):
    """Writes a flight. Returns the rate of rotation in the camera, rad/s, and the time between pictures, s."""
    limb_pictures.WIDTH, limb_pictures.HEIGHT = SIZE
    rng = np.random.default_rng([seed, 7])
    camera, world = limb_pictures.draw_camera(rng, (0.45, 1.3)), limb_pictures.draw_world(rng)
    rays, seen = camera.lens.rays()
    altitude_km = math.exp(rng.uniform(math.log(70), math.log(900)))
    position_km = limb_pictures.draw_position(rng, limb_pictures.unit(rng.normal(size=3)), altitude_km)
    up = limb_pictures.unit(position_km)
    level = limb_pictures.unit(np.cross(up, rng.normal(size=3)))
    elevation = math.radians(rng.uniform(25, 80))
    sun = math.sin(elevation) * up + math.cos(elevation) * level
    # The velocity of a circular orbit, in a direction of its own.
    speed_km_s = math.sqrt(398600.4 / np.linalg.norm(position_km))
    velocity = speed_km_s * limb_pictures.unit(np.cross(up, rng.normal(size=3)))
    start = limb_pictures.draw_attitude(rng, position_km, 0.0)
    rate = math.radians(10 ** rng.uniform(-1, 0.7)) * limb_pictures.unit(rng.normal(size=3))
    after_s = 10 ** rng.uniform(-1, 0.3)
    told = rate + math.radians(GYRO_DEG_S) * rng.normal(size=3)
    folder.mkdir(parents=True)
    rows = ["file,time_s,altitude_km,rate_x,rate_y,rate_z"]
    for index in range(PICTURES):
        time_s = index * after_s if moves else 0.0
        rotation = start @ cv2.Rodrigues(rate * time_s)[0]
        place = position_km + velocity * time_s
        light = limb_pictures.radiance(world, rays, rotation, place, sun)[0]
        image = camera.expose(rng, light, rays, seen, rotation.T @ sun, True)
        cv2.imwrite(str(folder / f"{index:03}.png"), image)
        rows.append(f"{index:03}.png,{index * after_s:.6f},{altitude_km:.6f}," + ",".join(f"{w:.9f}" for w in told))
    (folder / "frames.csv").write_text("\n".join(rows) + "\n")
    (folder / "sensor.toml").write_text(limb_pictures.sensor_toml(rng, camera.lens))
    return rate, after_s


def fly(hzn, seed):
    """Returns, for both sequences, a list of (turn of the axis since the first answer in degrees, refused as fixed)."""
    both = []
    for moves in (True, False):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder) / "flight"
            rate, after_s = render(folder, seed, moves)
            out = folder / "out.csv"
            subprocess.run([hzn, "run", str(folder), "-o", str(out), "-q"], check=True, capture_output=True)
            with out.open() as file:
                rows = list(csv.DictReader(file))
        seen, first = [], None
        for index, row in enumerate(rows):
            fixed = row["detail"].endswith(": fixed") or row["detail"].startswith("suspect")
            if row["status"] != "ok" and not fixed:
                continue
            if first is None:
                first = index, np.array([float(row[f"axis_{k}"]) for k in "xyz"])
                continue
            turned = cv2.Rodrigues(rate * after_s * (index - first[0]))[0].T @ first[1]
            seen.append((math.degrees(math.acos(np.clip(turned @ first[1], -1, 1))), fixed))
        both.append(seen)
    return both


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--flights", type=int, default=20, help="number of flights (20)")
    parser.add_argument("--first-seed", type=int, default=900_000, help="seed of the first flight (900000)")
    parser.add_argument("--jobs", type=int, help="number of processes; without it, all cores")
    options = parser.parse_args()
    hzn = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it, or give its path")
    seeds = range(options.first_seed, options.first_seed + options.flights)
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        flown = list(pool.map(fly, [hzn] * options.flights, seeds))
    print("| sequences | answers after the first | refused as fixed |\n|---|---:|---:|")
    for name, which in (("limb", 0), ("edge of the window", 1)):
        for low, high in ((0.0, NOTICED_DEG), (NOTICED_DEG, 180.0)):
            pairs = [fixed for both in flown for turn, fixed in both[which] if low <= turn < high]
            print(f"| {name}, axis turned by {low:g}° to {high:g}° | {len(pairs)} | {sum(pairs)} |")
    # Flights whose axis turns far enough; a flight without an alert has none at the largest turn.
    alerts = sorted(next((turn for turn, fixed in both[1] if fixed), math.inf) for both in flown
                    if any(turn >= NOTICED_DEG for turn, _ in both[1]))
    if alerts:
        median, late = (alerts[math.ceil(share * len(alerts)) - 1] for share in (0.5, 0.9))
        print(f"\nedge of the window: {len(alerts)} flights turn by {NOTICED_DEG:g}° or more, "
              f"{sum(map(math.isfinite, alerts))} have an alert; turn at the first alert: {median:.2f}° (median), "
              f"{late:.2f}° (nine of ten)")


if __name__ == "__main__":
    main()

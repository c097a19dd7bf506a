"""Compares the limb height of a band with a constant one, on infrared flights over air that hzn does not know.

    target/venv/limb-heights/bin/python tests/python/band_campaign.py --hzn target/release/hzn --flights 12

`cargo xtask reproduce limb-heights` makes the environment. Each flight has the air of NRLMSIS of its own day, hour,
longitude and solar activity, at latitudes that the table of hzn-core does not have, and weather of 1.5 km over 1000 km.
`--filters` draws the filter of each camera; without it, all have that of the table. The sensors know the band, UTC
and the position, or 40 +- 7 km, or the height by latitude of the air that was drawn: what no table can know better, because
only the weather is left. `--weather 0` leaves that out, too. The lens is exact, there is no attitude, and the noise model is
the default.

The camera is that of the scene `leo-infrared`, whose pixels are 26 km wide at the limb; its edge noise hides the error of
the height. `--sharp` has pixels of 5 km, a quarter of the noise, and always a limb in view.
"""

import argparse
import concurrent.futures
import csv
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

sys.path.append(str(pathlib.Path(__file__).parents[2] / "reproduce" / "limb_heights"))
import limb_heights as model  # noqa: E402

LATITUDES = [-90, -80, -62, -50, -37, -22, -8, 8, 22, 37, 50, 62, 80, 90]
OWN = "own air"
TOLD = {"band": 'limb = "co2-15um"\n', "40 +- 7 km": "limb_height_km = 40.0\nlimb_height_sigma_km = 7.0\n", OWN: ""}


def write_radiance(path, table, draw, date, weights):
    """Writes the radiance of one day by latitude and tangent height, 0.75 of full scale at the largest. Returns the lines of
    sensor.toml with the limb height by latitude."""
    longitude, activity = draw.uniform(-180, 180), draw.uniform(70, 180)
    profiles = []
    for latitude in LATITUDES:
        t, density = model.atmosphere(date, latitude, (longitude,), activity)
        profiles.append(model.radiance(table, t, density) @ weights)
    scale = 0.75 / max(p.max() for p in profiles)
    with open(path, "w") as out:
        out.write("latitude_deg,tangent_height_km,radiance\n")
        for latitude, profile in zip(LATITUDES, profiles):
            # Below the lowest tangent height the disc is as bright as there: the band is opaque.
            for height, value in [(0.0, profile[0]), *zip(model.TANGENTS_KM, profile)]:
                out.write(f"{latitude},{height},{value * scale:.6f}\n")
    heights = [[latitude, round(float(model.half_level_km(p)), 3)] for latitude, p in zip(LATITUDES, profiles)]
    # The sigma of the band's table without its climate.
    return f'limb = "height"\nlimb_height_by_latitude_km = {heights}\nlimb_height_sigma_km = 2.2\n'


def hzn(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise RuntimeError(f"hzn {' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return done.stdout


SHARP = {r"(f[xy]_px) = .*": r"\1 = 500.0", "read_noise = .*": "read_noise = 0.005", "theta_max_deg = .*\n": "",
         "off_nadir_deg = .*": "off_nadir_deg = [50.0, 80.0]"}


def fly(program, folder, seed, table, any_filter, frames, sharp, weather_km):
    draw = np.random.default_rng(seed)
    year, month, day, hour = (int(draw.integers(*limits)) for limits in ((2015, 2024), (1, 13), (1, 29), (0, 24)))
    date = f"{year}-{month:02d}-{day:02d}T{hour:02d}:00"
    filters = model.filters(table)
    name = draw.choice(list(filters)) if any_filter else "14 to 16 um"
    own = write_radiance(folder / "radiance.csv", table, draw, date, filters[name])
    text = hzn(program, "simulate", "leo-infrared", "--show")
    text = re.sub(r"utc = .*", f"utc = {date}:00Z", text)
    text = re.sub(r"node_deg = .*", f"node_deg = {draw.uniform(0, 360):.1f}", text)
    text = text.replace("[world.infrared]\n", '[world.infrared]\ntable = "radiance.csv"\n', 1)
    if weather_km > 0:
        weather = f"[world.infrared.weather]\nsigma_km = {weather_km}\nlength_km = 1000.0\nseed = {seed}\n\n"
        text = text.replace("[detector]", weather + "[detector]")
    for old, new in SHARP.items() if sharp else ():
        text = re.sub(old, new, text)
    text = re.sub(r"\[world\.infrared\.clouds\]\n([a-z_]+ = .*\n)+", "", text)
    (folder / "scene.toml").write_text(text)
    pictures = folder / "pictures"
    options = ["--frames", frames, "--seed", seed, "--no-noise", "-q"]
    hzn(program, "simulate", folder / "scene.toml", "-o", pictures, *options)
    sensor = re.sub(r"(?m)^(limb\w*|sunlit) = .*\n", "", (pictures / "sensor.toml").read_text())
    with open(pictures / "truth.csv") as file:
        truth = {row["file"]: row for row in csv.DictReader(file)}
    found = {}
    for told, keys in {**TOLD, OWN: own}.items():
        path = folder / f"{told[:2]}.toml"
        path.write_text(sensor.replace("[body]\n", "[body]\nsunlit = false\n" + keys))
        out = folder / f"{told[:2]}.csv"
        hzn(program, "run", pictures, "--sensor", path, "-o", out, "-q")
        with open(out) as file:
            found[told] = [error(row, truth[row["file"]]) for row in csv.DictReader(file) if row["status"] == "ok"]
    return name, found, len(truth)


def error(row, true):
    """Returns the error in degrees, and the square of the normalised error, whose mean is 2 if the covariance is right."""
    axis, of_truth = (np.array([float(r[f"axis_{x}"]) for x in "xyz"]) for r in (row, true))
    c = {k: float(row[f"cov_{k}"]) for k in ("xx", "xy", "xz", "yy", "yz", "zz")}
    covariance = np.array([[c["xx"], c["xy"], c["xz"]], [c["xy"], c["yy"], c["yz"]], [c["xz"], c["yz"], c["zz"]]])
    d = of_truth - axis
    d -= axis * (axis @ d)
    return np.degrees(np.linalg.norm(d)), d @ np.linalg.pinv(covariance, rcond=1e-9) @ d


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--hzn", required=True)
    arguments.add_argument("--flights", type=int, default=12)
    arguments.add_argument("--first-seed", type=int, default=600)
    arguments.add_argument("--frames", type=int, default=40)
    arguments.add_argument("--filters", action="store_true")
    arguments.add_argument("--sharp", action="store_true", help="a camera with finer pixels and less noise")
    arguments.add_argument("--weather", type=float, default=1.5, metavar="KM", help="1 sigma of the weather (1.5)")
    chosen = arguments.parse_args()
    table = model.Absorption()
    all_found, pictures = {told: [] for told in TOLD}, 0
    with tempfile.TemporaryDirectory() as work, concurrent.futures.ThreadPoolExecutor(2) as pool:
        def one(seed):
            folder = pathlib.Path(work) / str(seed)
            folder.mkdir()
            return fly(chosen.hzn, folder, seed, table, chosen.filters, chosen.frames, chosen.sharp,
                       chosen.weather)

        for name, found, count in pool.map(one, range(chosen.first_seed, chosen.first_seed + chosen.flights)):
            pictures += count
            rms = {told: f"{np.sqrt(np.mean(np.square([e for e, _ in x]))):.4f}" for told, x in found.items() if x}
            print(name, rms, flush=True)
            for told, errors in found.items():
                all_found[told] += errors
    for told, errors in all_found.items():
        e, n = np.array(errors).T
        rms, beyond = np.sqrt(np.mean(e**2)), 100 * np.mean(n > 11.829)
        print(f"{told}: {len(e)} of {pictures} answered, {rms:.4f} deg RMS, NEES {n.mean():.2f}, ", end="")
        print(f"{beyond:.1f} % beyond 3 sigma")


if __name__ == "__main__":
    main()

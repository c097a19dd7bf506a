"""Counts the answers to drawn edges that are no limb, for a lens that is known exactly and for lenses that are not.

    python drawn_edges.py --hzn target/release/hzn --seed 902
"""

import argparse
import csv
import math
import pathlib
import subprocess
import tempfile

import numpy as np

WIDTH, HEIGHT = 320, 240
KINDS = ["disc", "ring", "polygon", "streak", "panel", "ellipse", "parabola", "large disc"]
# The word of `hzn init`, the ideal lens, its horizontal field of view in degrees, and its focal length in pixels.
LENSES = [
    ("fisheye", "equidistant", 92, WIDTH / 2 / math.radians(46)),
    ("pinhole", "pinhole", 75, WIDTH / 2 / math.tan(math.radians(37.5))),
]
ALTITUDES_KM = [250, 500]


def blurred(picture, sigma_px):
    kernel = np.exp(-0.5 * (np.arange(-8, 9) / sigma_px) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        padded = np.pad(picture, [(8, 8) if k == axis else (0, 0) for k in (0, 1)], mode="edge")
        picture = np.apply_along_axis(lambda line: np.convolve(line, kernel, "valid"), axis, padded)
    return picture


def draw(rng, kind):
    """Returns what is bright. The edge crosses the middle part of the picture."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] - np.array([HEIGHT / 2, WIDTH / 2])[:, None, None]
    radius = rng.uniform(170, 300) if kind == "large disc" else math.exp(rng.uniform(math.log(30), math.log(1500)))
    turn, reach = rng.uniform(0, 2 * math.pi), rng.uniform(-80, 80)
    # Along the direction to the middle of the curve, and across it.
    u, v = x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn)
    beyond = u - radius - reach
    rho = np.hypot(beyond, v)
    if kind in ("disc", "large disc"):
        return rho < radius
    if kind == "ring":
        return (rho < radius) & (rho > radius - rng.uniform(4, 40))
    if kind == "streak":
        return np.abs(rho - radius) < rng.uniform(2, 15)
    if kind == "polygon":
        side = 2 * math.pi / rng.integers(4, 9)
        return rho * np.cos((np.arctan2(v, beyond) + rng.uniform(0, 7)) % side - side / 2) < radius
    if kind == "ellipse":
        a, stretch = rng.uniform(0, math.pi), rng.uniform(1, 1.6)
        across = v * math.cos(a) - beyond * math.sin(a)
        return np.hypot(beyond * math.cos(a) + v * math.sin(a), across * stretch) < radius
    if kind == "panel":
        return u > reach
    return u > reach + v * v / (2 * radius) + rng.normal() * 3e-7 * v**3


def write_pictures(folder, seed, pictures):
    for kind in KINDS:
        for number in range(pictures):
            rng = np.random.default_rng([seed, KINDS.index(kind), number])
            light = blurred(draw(rng, kind) * rng.uniform(0.2, 0.9), rng.uniform(0.6, 2.5)) + rng.uniform(0.01, 0.06)
            light += rng.normal(size=light.shape) * rng.uniform(0.003, 0.02)
            data = np.clip(light * 255 + 0.5, 0, 255).astype(np.uint8)
            name = f"{kind.replace(' ', '-')}-{number:03}.pgm"
            (folder / name).write_bytes(b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + data.tobytes())


def sensor(model, focal_px, altitude_km, lens):
    return (f'[camera]\nwidth = {WIDTH}\nheight = {HEIGHT}\nmodel = "{model}"\nfx_px = {focal_px}\nfy_px = {focal_px}\n'
            f'cx_px = {(WIDTH - 1) / 2}\ncy_px = {(HEIGHT - 1) / 2}\n{lens}[body]\nkind = "earth"\n'
            f"altitude_km = {altitude_km}\naltitude_sigma_km = {0.02 * altitude_km}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--pictures", type=int, default=60, help="pictures of each kind (60)")
    parser.add_argument("--seed", type=int, default=902, help="seed of the pictures (902)")
    options = parser.parse_args()
    hzn = str(pathlib.Path(options.hzn).resolve())
    with tempfile.TemporaryDirectory() as temporary:
        root = pathlib.Path(temporary)
        (root / "p").mkdir()
        write_pictures(root / "p", options.seed, options.pictures)
        print(f"{len(KINDS) * options.pictures} pictures\n")
        print("| lens | altitude, km | exact | focal length, centre | init |")
        print("|---|---:|---:|---:|---:|")
        for word, model, fov_deg, focal_px in LENSES:
            for altitude_km in ALTITUDES_KM:
                told = "focal_sigma_percent = 2.9\ncentre_sigma_px = 5\n"
                (root / "exact.toml").write_text(sensor(model, focal_px, altitude_km, ""))
                (root / "scale.toml").write_text(sensor(model, focal_px, altitude_km, told))
                init = [hzn, "init", "p", "--fov", str(fov_deg), "--lens", word, "--altitude", str(altitude_km)]
                subprocess.run([*init, "-o", "init.toml", "--force"], cwd=root, check=True, capture_output=True)
                counts = []
                for name in ["exact", "scale", "init"]:
                    run = [hzn, "run", "p", "--sensor", f"{name}.toml", "-o", "out.csv", "--force", "-q"]
                    subprocess.run(run, cwd=root, check=True)
                    with (root / "out.csv").open() as file:
                        counts.append(sum(row["status"] == "ok" for row in csv.DictReader(file)))
                print(f"| {word} | {altitude_km} | {' | '.join(map(str, counts))} |", flush=True)


main()

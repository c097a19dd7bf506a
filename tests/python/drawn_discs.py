"""Draws bodies without air, and prints how probable hzn takes their edges for the limb (`p_limb`).

A drawn disc has one brightness, or darkens towards its edge, and its edge is blurred by a Gaussian. The evidence takes
it for a sharp ghost, because a real limb fades in the air.

    python tests/python/drawn_discs.py --hzn target/release/hzn
"""

import argparse
import csv
import io
import itertools
import math
import pathlib
import subprocess
import tempfile

import numpy as np

BODY_KM, LIMB_KM = 6371.0, 17.0
CAMERAS = [(640, 480, 60.0), (320, 240, 60.0), (640, 480, 92.0)]
ALTITUDES_KM = [120.0, 500.0]
BLURS_PX, NOISES, SHADES, OFFSETS_RAD = [0.0, 0.7, 1.5, 4.0], [0.0, 2.0], [False, True], [-0.2, 0.1]
LIMITS = [0.1, 0.25, 0.5, 0.75]


def half_angle_rad(altitude_km):
    return math.asin((BODY_KM + LIMB_KM) / (BODY_KM + altitude_km))


def edge(distance_px, blur_px):
    """Returns the share of a pixel's light at a distance inside the edge."""
    if blur_px == 0.0:
        return (distance_px > 0.0) * 1.0
    return 0.5 * (1.0 + np.vectorize(math.erf)(distance_px / (blur_px * math.sqrt(2.0))))


def draw(camera, altitude_km, blur_px, noise, is_shaded, offset_rad, draws):
    width, height, fov_deg = camera
    focal_px = width / 2 / math.tan(math.radians(fov_deg / 2))
    v, u = np.mgrid[0:height, 0:width]
    rays = np.stack([(u - (width - 1) / 2) / focal_px, (v - (height - 1) / 2) / focal_px, np.ones(u.shape)], -1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    down = half_angle_rad(altitude_km) + offset_rad
    axis = np.array([0.1 * math.sin(down), math.sin(down), math.cos(down)])
    angle = np.arccos(np.clip(rays @ (axis / np.linalg.norm(axis)), -1.0, 1.0))
    inside_px = (half_angle_rad(altitude_km) - angle) * focal_px
    light = 0.7 + 0.3 * np.clip(inside_px / 200.0, 0.0, 1.0) if is_shaded else 1.0
    counts = 10.0 + 150.0 * edge(inside_px, blur_px) * light + draws.normal(0.0, noise, u.shape)
    return np.clip(counts, 0, 255).round().astype(np.uint8)


def sensor_toml(camera, altitude_km):
    width, height, fov_deg = camera
    focal_px = width / 2 / math.tan(math.radians(fov_deg / 2))
    return (
        f'preset = "hzn"\n[camera]\nmodel = "pinhole"\nwidth = {width}\nheight = {height}\nfx_px = {focal_px}\n'
        f"fy_px = {focal_px}\ncx_px = {(width - 1) / 2}\ncy_px = {(height - 1) / 2}\n"
        f'[body]\nkind = "earth"\naltitude_km = {altitude_km}\naltitude_sigma_km = 1.0\n[gates]\nmin_p_limb = 0.0\n'
    )


def probabilities(hzn, camera, altitude_km, draws):
    """Returns `p_limb` of each answer, with the blur of its edge."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "sensor.toml").write_text(sensor_toml(camera, altitude_km))
        kinds = list(itertools.product(BLURS_PX, NOISES, SHADES, OFFSETS_RAD))
        for number, kind in enumerate(kinds):
            picture = draw(camera, altitude_km, *kind, draws)
            header = b"P5\n%d %d\n255\n" % (camera[0], camera[1])
            (folder / f"{number:03}.pgm").write_bytes(header + picture.tobytes())
        ran = subprocess.run([hzn, "run", folder, "-q"], capture_output=True, text=True, check=True)
        rows = list(csv.DictReader(io.StringIO(ran.stdout)))
    return [(kind[0], float(row["p_limb"])) for kind, row in zip(kinds, rows, strict=True) if row["status"] == "ok"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    hzn = parser.parse_args().hzn
    draws = np.random.default_rng(1)
    found = []
    for camera, altitude_km in itertools.product(CAMERAS, ALTITUDES_KM):
        found += probabilities(hzn, camera, altitude_km, draws)
    print("blur_px  answers  least   median  " + "  ".join(f"below {limit}" for limit in LIMITS))
    for blur in [*BLURS_PX, None]:
        p = np.array([p for b, p in found if blur is None or b == blur])
        below = "  ".join(f"{np.sum(p < limit):>{len(f'below {limit}')}}" for limit in LIMITS)
        print(f"{'all' if blur is None else blur:>7}  {len(p):>7}  {p.min():.3f}   {np.median(p):.3f}  {below}")


if __name__ == "__main__":
    main()

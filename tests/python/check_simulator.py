"""Renders one simulated picture again with NumPy and OpenCV, from the model in book/theory/simulator.md, and compares.

usage: check_simulator.py HZN FOLDER

This program makes FOLDER: a scene.toml with a map of its own, and the output of `HZN simulate`. The lens is OpenCV's
fisheye. The tangent height of a ray is its lowest geodetic height, by search. Only frames.csv, truth.csv and the picture
come from the simulator. Where a ray grazes the ground, a hundredth of a pixel decides what it sees, so a few pixels may be
off by up to 0.03 of full scale. Exits with 1 if a pixel is off by more, or if one in 100 is off by more than 0.003.
"""

import csv
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np

A, B = 6378137.0, 6356752.314245179
W, H = 480, 320
FX, FY, CX, CY = 305.0, 303.0, 242.5, 157.0
K = [-0.055, 0.011, -0.0035, 0.0002]
PSF, VIGNETTING, EXPOSURE = 0.9, 0.4, 1.2
DEPTH, SCALE_M, BRIGHT = np.array([0.049, 0.097, 0.22]), 8000.0, 0.6
SKYLIGHT = np.array([0.03, 0.05, 0.09])

SCENE = f"""
name = "check"
utc = 2019-06-13T16:30:00Z
[capture]
from_s = 100.0
to_s = 300.0
frames = 3
[camera]
width = {W}
height = {H}
fx_px = {FX}
fy_px = {FY}
cx_px = {CX}
cy_px = {CY}
k = {K}
[trajectory.rocket]
[attitude.pointing]
off_nadir_deg = [70.0, 78.0]
azimuth_deg = [300.0, 120.0]
roll_deg = [10.0, -25.0]
[world.visible]
clear = true
sun_in_view = false
stars = 0
[world.visible.ground]
map = "map.png"
[optics]
vignetting = {VIGNETTING}
[exposure]
gain = {EXPOSURE}
[detector]
psf_sigma_px = {PSF}
bits = 16
"""


def world_map():
    """Returns bands and patches that are smooth enough for the interpolation of both programs; as red is never less than
    blue, there is no sea."""
    lat, lon = np.mgrid[90:-90:181j, -180:180:361j][:, :180, :360]
    red = 120 + 60 * np.sin(np.radians(12 * lon)) * np.cos(np.radians(9 * lat))
    green = 110 + 50 * np.cos(np.radians(7 * lon + 5 * lat))
    blue = 70 + 30 * np.sin(np.radians(11 * lat))
    return np.stack([red, green, blue], axis=-1).round().astype(np.uint8)


def linear(srgb):
    v = srgb / 255.0
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def rotation(w, x, y, z):
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def height(p):
    """Returns geodetic height and latitude, by Bowring's method."""
    r = np.hypot(p[..., 0], p[..., 1])
    e2, ep2 = 1 - (B / A) ** 2, (A / B) ** 2 - 1
    u = np.arctan2(p[..., 2] * A, r * B)
    for _ in range(3):
        lat = np.arctan2(p[..., 2] + ep2 * B * np.sin(u) ** 3, r - e2 * A * np.cos(u) ** 3)
        u = np.arctan2(B * np.sin(lat), A * np.cos(lat))
    n = A / np.sqrt(1 - e2 * np.sin(lat) ** 2)
    return r * np.cos(lat) + p[..., 2] * np.sin(lat) - A * A / n, lat


def sun_path(mu0, grazing, radius):
    near = 1 / np.sqrt(mu0**2 + 1 / grazing**2)
    beyond = 2 * grazing * np.exp(np.minimum(radius / (2 * SCALE_M) * mu0**2, 60)) - near
    return np.where(mu0 >= 0, near, beyond)


def lens():
    """Returns place and unit ray of every pixel; pixel centres are at integers, as in OpenCV."""
    grid = np.stack(np.meshgrid(np.arange(W, dtype=float), np.arange(H, dtype=float)), axis=-1).reshape(-1, 1, 2)
    matrix = np.array([[FX, 0, CX], [0, FY, CY], [0, 0, 1]])
    plane = cv2.fisheye.undistortPoints(grid, matrix, np.array(K), criteria=(3, 100, 1e-12))[:, 0]
    rays = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
    return grid, rays / np.linalg.norm(rays, axis=1, keepdims=True)


def render(position, quaternion, sun, ground):
    grid, rays = lens()
    turn = rotation(*quaternion)
    rays_e, sun_e = rays @ turn.T, turn @ sun

    # A ray meets the ellipsoid at the root of a quadratic in metres.
    d = np.array([1 / A**2, 1 / A**2, 1 / B**2])
    qa, qb, qc = (rays_e**2) @ d, 2 * (rays_e * position) @ d, position**2 @ d - 1
    disc = qb**2 - 4 * qa * qc
    hit = (disc > 0) & (qb < 0)
    near = (-qb - np.sqrt(np.maximum(disc, 0))) / (2 * qa)

    # Otherwise its lowest point is that of a parabola through three heights, refined three times.
    lowest = -qb / (2 * qa)
    for step in (2e4, 2e3, 2e2):
        h0, h1, h2 = (height(position + (lowest + s)[:, None] * rays_e)[0] for s in (-step, 0.0, step))
        lowest = lowest + step * 0.5 * (h0 - h2) / (h0 - 2 * h1 + h2)
    # A ray that leads upwards is lowest at its start.
    lowest = np.maximum(lowest, 0)
    point = position + np.where(hit, near, lowest)[:, None] * rays_e
    tangent, lat = height(point)
    lon = np.arctan2(point[:, 1], point[:, 0])
    normal = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)
    mu0 = normal @ sun_e
    mu = -np.sum(normal * rays_e, axis=1)

    grazing = np.sqrt(np.pi / 2 * A / SCALE_M)
    path = sun_path(mu0, grazing, A)[:, None]
    thin = np.where(hit, 1.0, np.exp(-np.maximum(tangent, 0) / SCALE_M))[:, None]
    depth = np.where(
        hit[:, None],
        DEPTH / np.sqrt(mu[:, None] ** 2 + 1 / grazing**2),
        DEPTH * 2 * grazing * np.exp(-np.maximum(tangent, 0)[:, None] / SCALE_M),
    )
    phase = 0.75 * (1 + (rays @ sun)[:, None] ** 2)
    glow = BRIGHT * phase * np.exp(-DEPTH * thin / (1 + depth) * path) * (1 - np.exp(-depth))
    glow[~hit & (tangent > 15 * SCALE_M)] = 0

    rows, columns = ground.shape[:2]
    u, v = (lon / (2 * np.pi) + 0.5) * columns - 0.5, (0.5 - lat / np.pi) * rows - 0.5
    u, v = (x.reshape(H, W).astype(np.float32) for x in (u, v))
    albedo = cv2.remap(ground, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP).reshape(-1, 3)
    day = np.clip((mu0 + 0.1) * 3, 0, 1)[:, None]
    lit = albedo * (np.exp(-DEPTH * path) * np.maximum(mu0, 0)[:, None] + SKYLIGHT * day)
    light = glow + np.where(hit[:, None], lit * np.exp(-depth), 0)

    grey = light.mean(axis=1).reshape(H, W)
    far2 = max((x - CX) ** 2 + (y - CY) ** 2 for x in (-0.5, W - 0.5) for y in (-0.5, H - 0.5))
    r2 = ((grid[:, 0, 0] - CX) ** 2 + (grid[:, 0, 1] - CY) ** 2).reshape(H, W)
    grey *= EXPOSURE * (1 - VIGNETTING * r2 / far2)
    reach = int(np.ceil(4 * PSF))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / PSF) ** 2)
    kernel /= kernel.sum()
    grey = cv2.sepFilter2D(grey, cv2.CV_64F, kernel, kernel, borderType=cv2.BORDER_REPLICATE)
    return np.clip(grey, 0, 1)


def main():
    hzn, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True)
    picture = world_map()
    cv2.imwrite(str(folder / "map.png"), picture[:, :, ::-1])
    (folder / "scene.toml").write_text(SCENE)
    out = folder / "out"
    subprocess.run([hzn, "simulate", folder / "scene.toml", "-o", out, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    known = list(csv.DictReader(open(out / "frames.csv")))
    truth = list(csv.DictReader(open(out / "truth.csv")))
    ground = linear(picture.astype(float)).astype(np.float32)
    for row, true in zip(known, truth):
        position = np.array([float(row[k]) for k in ("x_km", "y_km", "z_km")]) * 1e3
        quaternion = [float(true[k]) for k in ("qw", "qx", "qy", "qz")]
        sun = np.array([float(true[k]) for k in ("sun_x", "sun_y", "sun_z")])
        theirs = cv2.imread(str(out / row["file"]), cv2.IMREAD_UNCHANGED) / 65535.0
        ours = render(position, quaternion, sun, ground)
        # The Moon is in view, but this program does not draw it, so the pixels around it do not count.
        moon = np.array([float(true[k]) for k in ("moon_x", "moon_y", "moon_z")])
        without_moon = (lens()[1] @ moon < np.cos(np.radians(1.5))).reshape(H, W)
        off = np.abs(theirs - ours) * without_moon
        print(f"{row['file']}: mean {theirs.mean():.3f}, differences {off.max():.5f} at most, {off.mean():.6f} on average, "
              f"{100 * np.mean(off > 0.003):.2f} % above 0.003")
        if not (theirs.shape == ours.shape and theirs.mean() > 0.05 and off.max() < 0.03 and np.mean(off > 0.003) < 0.01 and off.mean() < 5e-4):
            sys.exit(f"{row['file']}: the picture differs from the documented model")


main()

"""Runs hzn on half-lit discs of the Earth with clouds, of another program, and counts errors against sigma.

    python half_lit_campaign.py --hzn target/release/hzn --pictures 300 --first-seed 40000

The whole Earth is in view of each picture. Its phase angle is 60 to 120 degrees. Clouds are brighter than the rest of
the limb by a drawn factor, so that a threshold between dark and bright may follow their edges. Each picture is a flight
of its own: another lens, calibration error, altitude, Sun, world and noise. limb_pictures.py renders ground and air.
Half of the pictures have counts that are proportional to the light, the others the curve of sRGB, which the sensor does
not know. The sensor has default settings and knows the position, and in a second run the direction to the Sun as well.
"""

import argparse
import concurrent.futures
import functools
import math
import pathlib
import shutil
import tempfile

import numpy as np

import decoy_pictures
import limb_campaign
import limb_pictures as limb

WIDTH, HEIGHT = decoy_pictures.WIDTH, decoy_pictures.HEIGHT
# Radius of the disc in pixels; the largest one leaves a margin of sky on all sides.
RADIUS_PX = (40, 210)
PHASE_DEG = (60, 120)
# Light of the air over that of clouds. A real limb is about a third as bright as the clouds.
AIR = (0.15, 0.6)
# Sizes of the clouds, as waves on the sphere; a disc of 200 px does not resolve finer ones.
CLOUDS = ((3, 6), (8, 10), (25, 14), (70, 18))
POSITION, SUN = limb_campaign.POSITION, limb_campaign.SUN
SENSORS = {"default": (POSITION, ""), "with the Sun": (POSITION + SUN, "sunlit = true\n")}


def frame(first, turn):
    """Returns a rotation matrix whose first column is `first`; the others are turned about it."""
    other = limb.unit(np.cross(first, np.eye(3)[np.argmin(np.abs(first))]))
    third = np.cross(first, other)
    c, s = math.cos(turn), math.sin(turn)
    return np.stack([first, c * other + s * third, c * third - s * other], 1)


def draw_view(rng, lens, rays, radius_px):
    """Returns position and attitude. The disc has about this radius, and a margin of sky on all sides."""
    half_angle = min(radius_px / lens.focal_px, 1.0)
    altitude_km = limb.MEAN_KM * (1 / math.sin(half_angle) - 1)
    position_km = limb.draw_position(rng, limb.unit(rng.normal(size=3)), altitude_km)
    half_angle = math.asin((limb.MEAN_KM + 60) / np.linalg.norm(position_km))
    while True:
        v, u = (int(rng.uniform(0.3, 0.7) * size) for size in (HEIGHT, WIDTH))
        beside = np.arccos(np.clip(rays @ rays[v, u], -1, 1))
        edges = [beside[0], beside[-1], beside[:, 0], beside[:, -1]]
        if min(edge.min() for edge in edges) > half_angle + 4 / lens.focal_px:
            down = -limb.unit(position_km)
            return position_km, frame(down, rng.uniform(0, 2 * math.pi)) @ frame(rays[v, u], 0).T
        half_angle *= 0.999


def render(folder, seed):
    """Writes a picture, frames.csv and sensor.toml. Returns the axis of the limb in the camera, and the tone."""
    rng = np.random.default_rng([77, seed])
    lens = decoy_pictures.draw_lens(rng, (12, 110))
    rays, seen = lens.rays()
    position_km, rotation = draw_view(rng, lens, rays, rng.uniform(*RADIUS_PX))
    world = limb.draw_world(rng)
    world.air = np.array([0.75, 0.85, 1.0]) * rng.uniform(*AIR)
    world.clouds, world.cover = limb.Waves(rng, CLOUDS), rng.uniform(-0.2, 0.9)
    phase, side = math.radians(rng.uniform(*PHASE_DEG)), rng.uniform(0, 2 * math.pi)
    sun = frame(limb.unit(position_km), side) @ [math.cos(phase), math.sin(phase), 0]
    light, _, _ = limb.radiance(world, rays, rotation, position_km, sun)
    grey = rng.random() < 0.5
    exposure, blur_px, noise = math.exp(rng.uniform(-0.6, 0.4)), rng.uniform(0.4, 1.8), 10 ** rng.uniform(-3, -1.9)
    light = np.repeat(light.mean(2, keepdims=True), 3, 2) if grey else light
    srgb = rng.random() < 0.5
    image = decoy_pictures.develop(rng, light * exposure, blur_px, noise, srgb)
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    if not limb.cv2.imwrite(str(folder / "000.png"), image[..., ::-1]):
        raise OSError(f"{folder / '000.png'} cannot be written")
    numbers = ",".join(f"{n:.9f}" for n in [*position_km, *(rotation.T @ sun)])
    (folder / "frames.csv").write_text(f"file,x_km,y_km,z_km,sun_x,sun_y,sun_z\n000.png,{numbers}\n")
    (folder / "sensor.toml").write_text(limb.sensor_toml(rng, lens))
    return rotation.T @ limb.limb_axis(position_km), "sRGB" if srgb else "linear"


def measure(hzn, root, seed):
    """Renders one picture and runs it. Returns for each sensor the status, and error and squared error of an answer."""
    folder, found = root / str(seed), {}
    axis, tone = render(folder, seed)
    for sensor, (columns, lines) in SENSORS.items():
        (row,) = limb_campaign.process(hzn, folder, columns, lines)
        found[sensor] = (row["status"], *(limb_campaign.miss(row, axis) if row["status"] == "ok" else ()))
    return seed, tone, found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--pictures", type=int, default=300, help="number of pictures (300)")
    parser.add_argument("--first-seed", type=int, default=40000, help="seed of the first picture (40000)")
    parser.add_argument("--keep", type=pathlib.Path, help="folder that keeps the pictures")
    parser.add_argument("--list", action="store_true", help="names the pictures beyond 3 sigma or without an answer")
    options = parser.parse_args()
    hzn = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it, or give its path")
    with tempfile.TemporaryDirectory() as temporary, concurrent.futures.ProcessPoolExecutor() as pool:
        root = options.keep or pathlib.Path(temporary)
        seeds = range(options.first_seed, options.first_seed + options.pictures)
        measured = list(pool.map(functools.partial(measure, hzn, root), seeds))
    print("| sensor | tone | discs | answered | median error | RMS | mean NEES | beyond 3 sigma | beyond 5 sigma |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|")
    for sensor in SENSORS:
        for tone in ("linear", "sRGB"):
            rows = [found[sensor] for _, kind, found in measured if kind == tone]
            answers = [row[1:] for row in rows if row[0] == "ok"]
            errors, squares = np.array(answers).T if answers else np.zeros((2, 1))
            print(f"| {sensor} | {tone} | {len(rows)} | {len(answers)} | {np.median(errors):.3f}° "
                  f"| {math.sqrt((errors**2).mean()):.3f}° | {squares.mean():.2f} "
                  f"| {(squares > limb_campaign.BEYOND_3).sum()} | {(squares > limb_campaign.BEYOND_5).sum()} |")
    if options.list:
        for seed, tone, found in measured:
            for sensor, (status, *miss) in found.items():
                if not miss or miss[1] > limb_campaign.BEYOND_3:
                    print(f"{seed}  {tone}, {sensor}: {status}", *(f"{x:.3f}" for x in miss))


if __name__ == "__main__":
    main()

"""Faults of the heads of a rig: what `rig_campaign.py faults` does to told mounts and to pictures."""

import csv
import math
import re
import shutil

import cv2
import numpy as np

from rig_flights import (HEADS, Count, by_time, hzn, miss, run, simulate, tell_limb, told_mount, truths, turned,
                         write_rig)

SETS = {"four": HEADS, "three": HEADS[:3], "two opposite": ["front", "back"], "two adjacent": ["front", "right"]}
# The axis of the camera that a wrong mount turns about.
TURNS = {"across its limb": [1, 0, 0], "about its axis": [0, 0, 1], "sideways": [0, 1, 0]}
SIZES_DEG = [0.1, 0.2, 0.3, 0.4, 0.45, 0.5, 0.6, 1.0, 1.3, 2.0]
# Angles between the limb and a ghost that is drawn outside of it.
GHOSTS_DEG = [0.5, 1.0, 3.0, 8.0]
FOCAL_PX = 554.0


class Tally:
    """Joint answers under a fault, and which heads were excluded."""

    def __init__(self):
        self.count = Count()
        self.noticed = self.right = self.wrong = 0

    def add(self, row, truth, heads):
        self.count.add(row, truth)
        excluded = row["heads_excluded"].split()
        self.noticed += bool(excluded) or row["detail"].startswith("inconsistent")
        is_right = excluded == heads
        self.right += bool(excluded) and is_right
        self.wrong += bool(excluded) and not is_right

    def merge(self, other):
        self.count.merge(other.count)
        for key in ("noticed", "right", "wrong"):
            setattr(self, key, getattr(self, key) + getattr(other, key))
        return self

    def line(self, name, size, heads):
        epochs = self.count.epochs
        share = [f"{100 * n / epochs:.1f} %" for n in (self.noticed, self.right, self.wrong)]
        protection = f"{np.median(self.count.protection):.3f}" if self.count.protection else "-"
        errors = f"{max(self.count.errors):.3f}" if self.count.errors else "-"
        cells = [name, size, heads, epochs, *share, len(self.count.errors), errors, protection, self.count.beyond]
        return f"| {' | '.join(map(str, cells))} |"


HEAD = ("| fault | size, deg | heads | epochs | noticed | right head excluded | wrong head excluded | answers "
        "| largest error | protection, median | beyond |\n|---|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|")


def read(path):
    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert picture is not None and picture.ndim == 2, path
    return picture


def with_ghost(picture, outward, size_deg, contrast):
    """Returns the picture with a weaker copy of itself, moved away from the Earth: its edge is as round as the limb."""
    shift = FOCAL_PX * math.tan(math.radians(size_deg)) * np.asarray(outward)
    matrix = np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]])
    sky = float(np.percentile(picture, 1))
    ghost = cv2.warpAffine(picture.astype(np.float32), matrix, picture.shape[::-1], borderMode=cv2.BORDER_REPLICATE)
    return np.maximum(picture, sky + contrast * (ghost - sky)).astype(picture.dtype)


def without_limb(picture, random):
    """Returns ground: bright bands with round borders, and the noise of the picture's dark part."""
    height, width = picture.shape
    y, x = np.mgrid[:height, :width].astype(float)
    low, high = np.percentile(picture, [2, 95])
    ground = np.full(picture.shape, low + 0.4 * (high - low))
    for _ in range(3):
        radius = random.uniform(300.0, 4000.0)
        angle, offset = random.uniform(0.0, math.tau), random.uniform(-200.0, 200.0)
        centre = [width / 2 + (radius + offset) * math.cos(angle), height / 2 + (radius + offset) * math.sin(angle)]
        distance = radius - np.hypot(x - centre[0], y - centre[1])
        softness = np.clip(distance / random.uniform(0.7, 4.0), -50.0, 50.0)
        ground += random.uniform(-0.3, 0.5) * (high - low) / (1.0 + np.exp(-softness))
    noise = random.normal(0.0, max(np.std(picture[picture < low + 0.1 * (high - low)]), 1.0), picture.shape)
    return np.clip(ground + noise, 0, np.iinfo(picture.dtype).max).astype(picture.dtype)


def faults_of(program, root, seed, frames):
    """Flies one scene. Returns the tallies by fault, size and heads."""
    folder = root / f"ring-{seed}"
    simulate(program, folder, "ring", seed, frames)
    truth, tallies = truths(folder), {}
    random = np.random.default_rng(seed)
    tell_limb(folder, seed % 2 == 0)

    def fly(key, heads, wrong, mounts=None, epochs=None):
        tally = tallies.setdefault(key, Tally())
        joint, _ = run(program, folder, write_rig(folder, heads, mounts=mounts))
        for number, row in enumerate(joint):
            if epochs is None or number in epochs:
                tally.add(row, by_time(truth, row), wrong)

    for name, heads in SETS.items():
        wrong = heads[seed % len(heads)]
        fly(("none", 0.0, name), heads, [])
        for turn, axis in TURNS.items():
            for size in SIZES_DEG:
                mount = turned(told_mount(folder, wrong), axis, size if seed % 4 < 2 else -size)
                fly((turn, size, name), heads, [wrong], mounts={wrong: mount})
    # The other faults are in the pictures.
    wrong = HEADS[seed % 4]
    pictures = {head: sorted((folder / head).glob("*.png")) for head in HEADS}
    kept = {head: [path.read_bytes() for path in paths] for head, paths in pictures.items()}
    own = truths(folder / wrong)

    def restore():
        for head, paths in pictures.items():
            for path, data in zip(paths, kept[head]):
                path.write_bytes(data)

    for number in range(1, len(pictures[wrong]), 2):
        pictures[wrong][number].write_bytes(kept[wrong][number - 1])
    fly(("repeated picture", 0.0, "four"), HEADS, [wrong], epochs=set(range(1, len(pictures[wrong]), 2)))
    for number in range(0, len(pictures[wrong]) - 1, 2):
        pictures[wrong][number].write_bytes(kept[wrong][number + 1])
        pictures[wrong][number + 1].write_bytes(kept[wrong][number])
    even = set(range(len(pictures[wrong]) // 2 * 2))
    fly(("picture of another epoch", 0.0, "four"), HEADS, [wrong], epochs=even)
    for size in GHOSTS_DEG:
        restore()
        for path in pictures[wrong]:
            axis = np.array([float(own[path.name][f"axis_{k}"]) for k in "xy"])
            ghost = with_ghost(read(path), -axis / np.linalg.norm(axis), size, random.uniform(0.3, 0.9))
            cv2.imwrite(str(path), ghost)
        for name, step in (("four", None), ("two opposite", 2), ("two adjacent", 1)):
            heads = HEADS if step is None else [wrong, HEADS[(HEADS.index(wrong) + step) % 4]]
            fly(("ghost outside of its limb", size, name), heads, [wrong])
    for heads, name in (([wrong], "ground in one head"), (HEADS, "ground in all heads")):
        restore()
        for head in heads:
            for path in pictures[head]:
                cv2.imwrite(str(path), without_limb(read(path), random))
        fly((name, 0.0, "four"), HEADS, heads)
    shutil.rmtree(folder)
    return tallies


# Angles between the limb and the ghosts of `second_looks_of`.
SECOND_DEG = [1.0, 3.0]


def answer_of(program, folder, sensor, picture):
    """Returns the row of a picture, the number of its edges, and the work that it took."""
    out = folder / "one.csv"
    table = folder / "one-frames.csv"
    with (folder / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    with table.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(row for row in rows if row["file"] == picture.name)
    hzn(program, "run", picture, "--sensor", sensor, "--frames", table, "-o", out, "--force", "-q", "-j", 1)
    with out.open() as file:
        row = next(csv.DictReader(file))
    text = hzn(program, "explain", picture, "--sensor", sensor, "--frames", table)
    work = re.search(r"(?m)^work +(\d+)", text)
    return row, int(row["candidates"] or 0), int(work[1]) if work else 0


def second_looks_of(program, root, seed, frames):
    """Draws ghosts outside of the limb of one head. Returns for each picture: its size, edges, whether the ghost won,
    whether a look at a higher threshold has the limb, and the work of this look over that of the picture."""
    folder, result = root / f"second-{seed}", []
    simulate(program, folder, "ring", seed, frames)
    tell_limb(folder, seed % 2 == 0)
    head = folder / HEADS[seed % 4]
    truth, random = truths(head), np.random.default_rng(seed)
    # The head gets the vehicle's positions.
    with (folder / "frames.csv").open() as file:
        vehicle = list(csv.DictReader(file))
    keys = [key for key in vehicle[0] if key in ("file", "time_s", "x_km", "y_km", "z_km", "utc")]
    pictures = sorted(head.glob("*.png"))
    with (head / "frames.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, keys)
        writer.writeheader()
        for row, path in zip(vehicle, pictures):
            writer.writerow({key: row[key] for key in keys} | {"file": path.name})
    kept = {path: read(path) for path in pictures}
    text = (head / "sensor.toml").read_text()
    assert "[threshold]" not in text, text
    for size in SECOND_DEG:
        for path, picture in kept.items():
            axis = np.array([float(truth[path.name][f"axis_{k}"]) for k in "xy"])
            ghost = with_ghost(picture, -axis / np.linalg.norm(axis), size, random.uniform(0.3, 0.9))
            cv2.imwrite(str(path), ghost)
            row, edges, work = answer_of(program, head, head / "sensor.toml", path)
            is_ghost = row["status"] == "ok" and miss(row, truth[path.name])[0] > size / 2
            # Otsu's threshold of the bright part.
            bright = ghost[ghost > int(row["level"] or 0)].astype(np.float32)
            scaled = np.clip(bright / np.iinfo(ghost.dtype).max * 255, 0, 255).astype(np.uint8)
            level, _ = cv2.threshold(scaled.reshape(-1, 1), 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
            counts = int(level / 255 * np.iinfo(ghost.dtype).max)
            (head / "second.toml").write_text(text + f'\n[threshold]\nmethod = "fixed"\nlevel = {counts}\n')
            again, _, more = answer_of(program, head, head / "second.toml", path)
            has_limb = again["status"] == "ok" and miss(again, truth[path.name])[0] < size / 2
            result.append((size, edges, is_ghost, has_limb, more / max(work, 1)))
    shutil.rmtree(folder)
    return result


def print_second_looks(results):
    print("| ghost, deg | pictures | with one edge | answers of the ghost | of these, a higher threshold has the limb "
          "| work of this look, median |\n|---:|---:|---:|---:|---:|---:|")
    rows = [row for result in results for row in result]
    for size in SECOND_DEG:
        own = [row for row in rows if row[0] == size]
        ghosts = [row for row in own if row[2]]
        one, limbs = sum(row[1] == 1 for row in own), sum(row[3] for row in ghosts)
        work = np.median([row[4] for row in own])
        print(f"| {size} | {len(own)} | {one} | {len(ghosts)} | {limbs} | {work:.2f} |")

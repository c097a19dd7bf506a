"""Flights of the built-in scenes of several heads: what the campaigns of rigs share."""

import csv
import math
import re
import subprocess

import numpy as np

HEADS = ["front", "right", "back", "left"]
# The half level of the scene is at 25 km, and 4.5 km higher or lower at the poles. The sensors are told 10 km less.
TOLD = "limb_height_by_latitude_km = [[-90.0, 10.5], [0.0, 15.0], [90.0, 19.5]]\n"
WEATHER = "\n[world.infrared.weather]\nsigma_km = 1.5\nlength_km = 1000.0\n"


def hzn(program, *args):
    done = subprocess.run([program, *map(str, args)], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise RuntimeError(f"hzn {' '.join(map(str, args))}: {done.stderr.strip()}")
    return done.stdout


def simulate(program, folder, scene, seed, frames, change=lambda text: text):
    """Renders a flight whose scene is changed by a function of its text."""
    text = change(hzn(program, "simulate", scene, "--show"))
    path = folder.parent / f"{folder.name}.toml"
    path.write_text(text)
    hzn(program, "simulate", path, "-o", folder, "--frames", frames, "--seed", seed, "--no-noise", "-q", "--force")


def tell_limb(folder, latitudes):
    """Writes the limb height into the sensors, 10 km too low, with or without its change with latitude."""
    for head in HEADS:
        path = folder / head / "sensor.toml"
        text = re.sub(r"(?m)^limb_height\w*km = (\[[^\n]*\]|[^\n]*)\n", "", path.read_text())
        assert "[body]" in text, text
        lines = "limb_height_km = 15.0\nlimb_height_sigma_km = 10.0\n" + (TOLD if latitudes else "")
        path.write_text(text.replace("[body]\n", "[body]\n" + lines))


def write_rig(folder, heads, name="used.toml", keys="", mounts=None):
    """Writes a rig.toml with some heads of the scene's own, and with other told mounts of some of them."""
    blocks = (folder / "rig.toml").read_text().split("[[head]]")[1:]
    named = {re.search(r'name = "(\w+)"', block)[1]: block for block in blocks}
    text = "[rig]\n" + keys
    for head in heads:
        block = named[head]
        if mounts and head in mounts:
            numbers = ", ".join(repr(float(x)) for x in mounts[head])
            block = re.sub(r"q_rig_from_camera_wxyz = \[[^\]]*\]", f"q_rig_from_camera_wxyz = [{numbers}]", block)
        text += "\n[[head]]" + block
    (folder / name).write_text(text)
    return folder / name


def told_mount(folder, head):
    block = next(b for b in (folder / "rig.toml").read_text().split("[[head]]") if f'name = "{head}"' in b)
    inner = re.search(r"q_rig_from_camera_wxyz = \[([^\]]*)\]", block)[1]
    return np.array([float(x) for x in inner.split(",") if x.strip()])


def turned(q, axis, angle_deg):
    """Returns the mount that is turned about an axis of the camera."""
    half = math.radians(angle_deg) / 2
    w, v = math.cos(half), math.sin(half) * np.asarray(axis, float) / np.linalg.norm(axis)
    scalar, vector = q[0], q[1:]
    return np.concatenate([[scalar * w - vector @ v], scalar * v + w * vector + np.cross(vector, v)])


def run(program, folder, rig):
    """Runs a rig. Returns the rows of the joint answers and those of each head."""
    out = folder / f"{rig.stem}.csv"
    hzn(program, "run", rig, "-o", out, "--force", "-q", "-j", 1)
    with out.open() as file:
        rows = list(csv.DictReader(file))
    out.unlink()
    return [row for row in rows if row["head"] == "rig"], [row for row in rows if row["head"] != "rig"]


def truths(folder):
    with (folder / "truth.csv").open() as file:
        return {row["file"]: row for row in csv.DictReader(file)}


def miss(row, truth):
    """Returns the error in degrees and the squared error over the covariance."""
    answer = np.array([float(row[f"axis_{k}"]) for k in "xyz"])
    axis = np.array([float(truth[f"axis_{k}"]) for k in "xyz"])
    covariance = np.array([[float(row["cov_" + "".join(sorted(a + b))]) for b in "xyz"] for a in "xyz"])
    values, vectors = np.linalg.eigh(covariance)
    squared = ((vectors[:, 1:].T @ (axis - answer)) ** 2 / values[1:]).sum()
    return math.degrees(math.atan2(np.linalg.norm(np.cross(axis, answer)), axis @ answer)), squared


def by_time(truth, row):
    return min(truth.values(), key=lambda t: abs(float(t["time_s"]) - float(row["time_s"])))


class Count:
    """Errors and verdicts of joint answers."""

    def __init__(self):
        self.errors, self.squared, self.protection, self.edges, self.beyond = [], [], [], [], 0
        self.epochs = self.inconsistent = self.excluded = self.silent = 0

    def add(self, row, truth):
        self.epochs += 1
        self.excluded += bool(row["heads_excluded"])
        if row["status"] != "ok":
            is_inconsistent = row["detail"].startswith("inconsistent")
            self.inconsistent += is_inconsistent
            self.silent += not is_inconsistent
            return
        error, squared = miss(row, truth)
        self.errors.append(error)
        self.squared.append(squared)
        if row["protection_deg"]:
            self.protection.append(float(row["protection_deg"]))
            self.beyond += error > self.protection[-1]

    def merge(self, other):
        for key, value in vars(other).items():
            setattr(self, key, getattr(self, key) + value)
        return self

    def rms_deg(self):
        return np.sqrt((np.array(self.errors or [math.nan]) ** 2).mean())

    def line(self, name):
        errors = np.array(self.errors or [math.nan])
        protection = np.median(self.protection) if self.protection else math.nan
        alarms = self.inconsistent + self.excluded
        return (f"| {name} | {self.epochs} | {len(self.errors)} | {self.rms_deg():.4f} | {errors.max():.3f} "
                f"| {np.mean(self.squared or [math.nan]):.2f} | {protection:.3f} | {self.beyond} | {alarms} |")


COUNT_HEAD = ("| rig | epochs | answers | RMS, deg | worst | NEES | protection, median | beyond | alarms |\n"
              "|---|---:|---:|---:|---:|---:|---:|---:|---:|")

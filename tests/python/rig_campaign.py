"""Flies the built-in scenes of several heads, and compares the joint answers with the truth.

    python rig_campaign.py --hzn target/release/hzn --flights 20 --first-seed 100 accuracy
    python rig_campaign.py --hzn target/release/hzn --flights 20 --first-seed 100 faults
    python rig_campaign.py --hzn target/release/hzn --flights 20 --first-seed 100 second
    python rig_campaign.py --hzn target/release/hzn --flights 20 --first-seed 100 pair
    python rig_campaign.py --hzn target/release/hzn --flights 20 --first-seed 100 radial
    python rig_campaign.py --hzn target/release/hzn --flights 10 --frames 100 coarse
    python rig_campaign.py --hzn target/release/hzn --flights 10 --frames 30 mounts

The sensors of the scene `ring` are told a limb height of 15 +- 10 km while the limb is at 25 km. Its change with
latitude is told or not. The mounts are exact, unless a fault turns one of them.

`faults` turns told mounts, and changes the pictures of one head: repeated ones, those of another epoch, ghosts of the
limb, ground without a limb. `second` counts the edges of pictures with a ghost, and what a second look at a higher
threshold would find. Both need opencv-python-headless.

`radial` tells positions that are 300 km too high or too low, with a sigma of 300 km, and none at all.

`coarse` flies the scene with random attitudes and pictures of a quarter of the size, and compares the coarse direction
with the truth. `mounts` tells mounts that are wrong by about a degree, lets the vehicle turn, and compares the mounts of
`hzn calibrate rig` with the true ones.
"""

import argparse
import concurrent.futures
import csv
import math
import pathlib
import re
import shutil
import tempfile

import numpy as np

import rig_design
from rig_flights import (COUNT_HEAD, HEADS, WEATHER, Count, by_time, hzn, run, simulate, tell_limb, told_mount, truths,
                         turned, write_rig)

AZIMUTHS_DEG = {"four": [0, 90, 180, 270], "two opposite": [0, 180], "two adjacent": [0, 90], "one": [0]}


def accuracy_of(program, root, seed, frames):
    """Flies one scene with each set of heads. Returns the counts by name."""
    counts = {}
    for weather in (False, True):
        folder = root / f"ring-{seed}-{weather}"
        change = (lambda text: text.replace("[world.infrared]\n", "[world.infrared]\n", 1) + WEATHER) if weather else (
            lambda text: text)
        simulate(program, folder, "ring", seed, frames, change)
        truth = truths(folder)
        for told in (False, True):
            tell_limb(folder, told)
            sets = {"four": HEADS, "two opposite": ["front", "back"], "two adjacent": ["front", "right"],
                    "one": ["front"]}
            for name, heads in sets.items():
                for keys, how in (("", ""), ("limb_tilt_sigma_km = 0.0\n", ", tilt told")):
                    if how and not told:
                        continue
                    joint, own = run(program, folder, write_rig(folder, heads, keys=keys))
                    count = counts.setdefault((weather, told, f"{name}{how}"), Count())
                    count.edges += [float(row["rms_px"]) for row in own if row["status"] == "ok"]
                    for row in joint:
                        count.add(row, by_time(truth, row))
        shutil.rmtree(folder)
    return counts


RADIAL_KM = {"right position": 0.0, "300 km too high": 300.0, "300 km too low": -300.0, "no position": None}
LIMITS_KM = [200.0, 800.0]


def tell_position(folder, table, radial_km):
    """Writes the table of the vehicle with positions that are radially wrong, or with none."""
    rows = []
    for row in table:
        row = dict(row)
        place = np.array([float(row[key]) for key in ("x_km", "y_km", "z_km")])
        for key, x in zip(("x_km", "y_km", "z_km"), place * (1.0 + (radial_km or 0.0) / np.linalg.norm(place))):
            row[key] = "" if radial_km is None else repr(float(x))
        if "altitude_km" in row:
            row["altitude_km"] = ""
        rows.append(row)
    with (folder / "frames.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(table[0]))
        writer.writeheader()
        writer.writerows(rows)


def radial_of(program, root, seed, frames):
    """Flies the scene with each error of the position. Returns the counts by name."""
    folder, counts = root / f"radial-{seed}", {}
    simulate(program, folder, "ring", seed, frames)
    truth = truths(folder)
    tell_limb(folder, False)
    with (folder / "frames.csv").open() as file:
        table = list(csv.DictReader(file))
    texts = {head: (folder / head / "sensor.toml").read_text() for head in HEADS}
    assert all("[gates]" not in text and "\naltitude_sigma_km" in text for text in texts.values()), texts
    for name, radial_km in RADIAL_KM.items():
        tell_position(folder, table, radial_km)
        for head, text in texts.items():
            if radial_km is None:
                text += f"\n[gates]\naltitude_limits_km = {LIMITS_KM}\n"
            elif radial_km:
                text = re.sub(r"(?m)^altitude_sigma_km = .*$", "altitude_sigma_km = 300.0", text)
            (folder / head / "sensor.toml").write_text(text)
        for which, heads in (("four", HEADS), ("two opposite", ["front", "back"])):
            joint, _ = run(program, folder, write_rig(folder, heads))
            count = counts.setdefault(f"{which}; {name}", Count())
            for row in joint:
                count.add(row, by_time(truth, row))
    shutil.rmtree(folder)
    return counts


def pair_of(program, root, seed, frames):
    folder = root / f"pair-{seed}"
    simulate(program, folder, "pair", seed, frames)
    truth = truths(folder)
    joint, heads = run(program, folder, write_rig(folder, ["left", "right"]))
    counts = {}
    for row in joint:
        name = "both heads" if " " in row["heads_used"] else "one head or none"
        counts.setdefault(name, Count()).add(row, by_time(truth, row))
    both = {row["index"] for row in joint if " " in row["heads_used"]}
    for head in ("left", "right"):
        own = truths(folder / head)
        for row in heads:
            if row["head"] == head and row["index"] in both:
                counts.setdefault(f"{head} alone, in epochs with both", Count()).add(row, own[row["file"]])
    shutil.rmtree(folder)
    return counts


ORBIT = "[trajectory.orbit]\nperigee_km = 500.0\ninclination_deg = 97.4\nnode_deg = 30.0\n"
POINTING = re.compile(r"\[attitude\.pointing\]\n(\w+ = \[[^\n]*\n)+")
STEP_S = 60.0


def smaller(text):
    """Returns the scene with pictures of a quarter of the size."""
    for key, value in (("width", "160"), ("height", "120"), ("fx_px", "138.5"), ("fy_px", "138.5"), ("cx_px", "79.5"),
                       ("cy_px", "59.5")):
        text = re.sub(rf"(?m)^{key} = .*$", f"{key} = {value}", text)
    return text


def coarse_of(program, root, seed, frames):
    """Flies random attitudes. Returns the angles between coarse direction and truth, their sigmas, and the answers."""
    random = np.random.default_rng(seed)
    rows = ["time_s,x_km,y_km,z_km,qw,qx,qy,qz"]
    for i in range(frames + 1):
        along = math.tau * i * STEP_S / 5670.0
        place = 6871.0 * np.array([math.cos(along), 0.3 * math.sin(along), math.sqrt(0.91) * math.sin(along)])
        q = random.normal(size=4)
        q /= np.linalg.norm(q)
        rows.append(",".join(repr(float(x)) for x in [i * STEP_S, *place, *q]))
    (root / f"attitudes-{seed}.csv").write_text("\n".join(rows) + "\n")

    def change(text):
        text = text.replace(ORBIT, f'[trajectory.table]\nfile = "attitudes-{seed}.csv"\n')
        text, count = POINTING.subn("", text)
        assert count == 1 and "trajectory.table" in text, text
        text = text.replace("[capture]\nto_s = 5670.0", f"[capture]\nto_s = {frames * STEP_S}")
        return smaller(text.replace('name = "ring"\n', 'name = "ring"\nattitude = "table"\n', 1))

    folder = root / f"coarse-{seed}"
    simulate(program, folder, "ring", seed, frames, change)
    joint, _ = run(program, folder, write_rig(folder, HEADS))
    truth, result = truths(folder), []
    for row in joint:
        axis = np.array([float(by_time(truth, row)[f"axis_{k}"]) for k in "xyz"])
        if row["status"] == "ok":
            result.append(("ok", math.nan, math.nan))
        elif not row["coarse_x"]:
            result.append(("none", math.nan, math.nan))
        else:
            coarse = np.array([float(row[f"coarse_{k}"]) for k in "xyz"])
            error = math.degrees(math.atan2(np.linalg.norm(np.cross(axis, coarse)), axis @ coarse))
            result.append(("coarse", error, float(row["coarse_sigma_deg"])))
    shutil.rmtree(folder)
    return result


def print_coarse(results):
    rows = [row for result in results for row in result]
    errors = np.array([[error, sigma] for kind, error, sigma in rows if kind == "coarse"])
    count = {kind: sum(row[0] == kind for row in rows) for kind in ("ok", "coarse", "none")}
    print("| attitudes | answers | coarse directions | neither | median error, deg | worst | median sigma | within 3 sigma |\n"
          "|---:|---:|---:|---:|---:|---:|---:|---:|")
    within = (errors[:, 0] <= 3 * errors[:, 1]).mean()
    print(f"| {len(rows)} | {count['ok']} | {count['coarse']} | {count['none']} | {np.median(errors[:, 0]):.1f} "
          f"| {errors[:, 0].max():.1f} | {np.median(errors[:, 1]):.1f} | {100 * within:.1f} % |")


def rotation(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def small_turn(matrix):
    """Returns the rotation vector of a small rotation, degrees."""
    return np.degrees([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]) / 2


def mount_and_covariance(path, head):
    block = next(b for b in path.read_text().split("[[head]]") if f'name = "{head}"' in b)
    numbers = lambda key: np.array([float(x) for x in re.search(rf"{key} = \[([^\]]*)\]", block)[1].split(",") if x.strip()])
    xx, xy, xz, yy, yz, zz = numbers("covariance_deg2")
    return rotation(numbers("q_rig_from_camera_wxyz")), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def mounts_of(program, root, seed, frames):
    """Calibrates wrong mounts on a flight that turns. Returns errors and sigmas about the principal axes, degrees."""
    folder = root / f"mounts-{seed}"
    turning = ("[attitude.pointing]\noff_nadir_deg = [45.0, 91.0]\nazimuth_deg = [0.0, 330.0]\n"
               "roll_deg = [-25.0, 25.0]\n")
    weather = WEATHER if seed % 2 else ""
    simulate(program, folder, "ring", seed, frames, lambda text: POINTING.sub(turning, text) + weather)
    tell_limb(folder, True)
    random = np.random.default_rng(seed)
    wrong = {head: turned(told_mount(folder, head), random.normal(size=3), random.normal()) for head in HEADS}
    out = folder / "calibrated.toml"
    report = hzn(program, "calibrate", "rig", write_rig(folder, HEADS, mounts=wrong), "-o", out, "-q", "-j", 1)
    true = {head: rotation(told_mount(folder, head)) for head in HEADS}
    found = {head: mount_and_covariance(out, head) for head in HEADS}
    result = []
    for a, b in ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)):
        (ra, pa), (rb, pb) = found[HEADS[a]], found[HEADS[b]]
        # The turn of b against a about the axes of the rig.
        error = small_turn(rb @ true[HEADS[b]].T @ true[HEADS[a]] @ ra.T)
        values, vectors = np.linalg.eigh(pa + pb)
        result += list(zip(np.abs(vectors.T @ error), np.sqrt(values)))
    shutil.rmtree(folder)
    assert "epochs" in report
    return result


def print_mounts(results):
    rows = np.array([row for result in results for row in result])
    # The prior of each mount is 5 degrees; a direction that keeps half of it is not determined.
    rows = rows[rows[:, 1] < 2.5]
    within = (rows[:, 0] <= 3 * rows[:, 1]).mean()
    ratio = np.sqrt(((rows[:, 0] / rows[:, 1]) ** 2).mean())
    print("| flights | directions | RMS error, deg | median sigma | largest sigma | error/sigma, RMS | within 3 sigma |\n"
          "|---:|---:|---:|---:|---:|---:|---:|")
    print(f"| {len(results)} | {len(rows)} | {np.sqrt((rows[:, 0] ** 2).mean()):.4f} | {np.median(rows[:, 1]):.4f} "
          f"| {rows[:, 1].max():.3f} | {ratio:.2f} | {100 * within:.1f} % |")


def fly(args, work):
    """Flies all seeds. Returns the results, one for each."""
    seeds = range(args.first_seed, args.first_seed + args.flights)
    with tempfile.TemporaryDirectory() as root, concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        return list(pool.map(lambda seed: work(args.hzn, pathlib.Path(root), seed, args.frames), seeds))


def merge(results):
    total = {}
    for counts in results:
        for key, count in counts.items():
            total[key] = total[key].merge(count) if key in total else count
    return total


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["accuracy", "faults", "second", "pair", "radial", "coarse", "mounts"])
    parser.add_argument("--hzn", default="target/release/hzn")
    parser.add_argument("--flights", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--frames", type=int, default=8)
    parser.add_argument("--jobs", type=int, default=1)
    args = parser.parse_args()
    if args.what in ("coarse", "mounts"):
        work, show = {"coarse": (coarse_of, print_coarse), "mounts": (mounts_of, print_mounts)}[args.what]
        results = fly(args, work)
        print(f"{args.flights} flights of {args.frames} epochs, seeds from {args.first_seed}\n")
        show(results)
        return
    if args.what == "second":
        import rig_faults

        results = fly(args, rig_faults.second_looks_of)
        print(f"{args.flights} flights of {args.frames} epochs, seeds from {args.first_seed}\n")
        rig_faults.print_second_looks(results)
        return
    if args.what == "faults":
        import rig_faults

        total = merge(fly(args, rig_faults.faults_of))
    else:
        total = merge(fly(args, {"accuracy": accuracy_of, "pair": pair_of, "radial": radial_of}[args.what]))
    print(f"{args.flights} flights of {args.frames} epochs, seeds from {args.first_seed}\n")
    if args.what == "faults":
        print(rig_faults.HEAD)
        for key, tally in sorted(total.items(), key=lambda t: (t[0][2], t[0])):
            print(tally.line(*key))
        return
    first, second = COUNT_HEAD.split("\n")
    print(f"{first} bound, deg | RMS over bound |\n{second}---:|---:|" if args.what == "accuracy" else COUNT_HEAD)
    for key, count in total.items():
        name = key
        if args.what == "accuracy":
            weather, told, heads = key
            name = f"{heads}; {'latitude told' if told else 'not told'}{'; weather' if weather else ''}"
            azimuths = AZIMUTHS_DEG[heads.split(",")[0]]
            bound = rig_design.bound_deg(azimuths, np.median(count.edges), 1.5 if weather else 0.0)
            # Without the change with latitude there is a tilt of the limb, which no estimate can find.
            print(f"{count.line(name)} {bound:.4f} | {count.rms_deg() / bound:.2f} |" if told else f"{count.line(name)} - | - |")
            continue
        print(count.line(name))


if __name__ == "__main__":
    main()

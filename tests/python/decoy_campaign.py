"""Runs hzn on pictures with an edge that is no limb, and on pictures of the limb, both of another program, and judges
the probability `p_limb`.

    python decoy_campaign.py --hzn target/release/hzn --flights 20 --first-seed 3000 --keep target/decoys
    python decoy_campaign.py --hzn target/release/hzn --flights 40 --first-seed 11000 --keep target/fitted --fit

decoy_pictures.py and decoy_more.py paint the edges, limb_pictures.py the limbs; all 640x480, in flights of three
pictures. The sensor has default settings and gets the position, and in a second run an attitude with errors of 5
degrees per axis as well. In a third run it gets a position 3000 to 60000 km high, from where the Earth is a disc: most
edges have no size of their own. The limbs of the kind `far` are rendered from there. With --keep a campaign that was
stopped continues after its last flight; if the program was built again, it processes the kept pictures again. With
--check the program exits with 1 if the shares are too large.

--fit prints the weights of the evidence (crates/hzn-core/src/model/evidence.rs): a logistic regression on the answers
of the kinds that are not in HELD_OUT, without the gate on p_limb. Ghosts that are softer than 0.8 scale heights of the
air are left out, because nothing tells them from a limb.
"""

import argparse
import concurrent.futures
import csv
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import numpy as np

import decoy_more
import decoy_pictures
import limb_campaign
import limb_pictures

# Kinds that took no part in the fit of the weights.
HELD_OUT = ["cyclone", "foil", "plume", "river", "cable"]
# decoy_more.py adds its kinds to those of decoy_pictures.py.
LIMBS = limb_pictures.CLASSES | limb_pictures.FAR_CLASSES
KINDS = [*decoy_pictures.KINDS, *LIMBS]
# A ghost counts as sharp if the softness of its edge is below this many scale heights.
SHARP = 0.8
# Terms with a weight. Attitude and Sun are likelihood ratios already.
TERMS = ["curvature", "half-angle", "gaps", "misfit", "sky", "faint-air", "bright-air", "faint-high-air", "layer",
         "second-edge", "flat", "mottled-sky"]
# Shares of the false answers in the fit. The first two are for all kinds but ghosts and airglow together, from the
# altitude of the flight and from afar.
SHARES = {"other": 0.3, "from afar": 0.3, "ghost": 0.2, "airglow": 0.2}
SENSORS = {"default": limb_campaign.POSITION, "with an attitude": limb_campaign.POSITION + limb_campaign.ATTITUDE,
           "from afar": limb_campaign.POSITION}
# Expectation of the figures: share of the pictures without a limb that have an answer, and of lost true answers. The
# limits of --check are those of a few flights, twice as wide, and one flight of three pictures more: they show the
# same edge, so that they are answered together.
LARGEST_FALSE, LARGEST_LOST = 0.02, 0.04


def evidence(hzn, folder, name):
    """Returns the values of the terms of a picture's answer."""
    command = [hzn, "explain", str(folder / name), "--sensor", str(folder / "used.toml"), "--frames",
               str(folder / "used.csv")]
    text = subprocess.run(command, capture_output=True, text=True).stdout
    found = {m[1]: float(m[2]) for m in re.finditer(r"^ +[+-]\d+\.\d+ ([a-z-]+) +(-?\d+\.\d+)  ", text, re.M)}
    return [found.get(term, 0.0) for term in TERMS]


def write_far(folder, kind, seed):
    """Writes frames-far.csv: the same pictures from 3000 to 60000 km."""
    rng = np.random.default_rng([777, seed, KINDS.index(kind)])
    with (folder / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        position_km = np.array([float(row[f"{k}_km"]) for k in "xyz"])
        altitude_km = math.exp(rng.uniform(*np.log(limb_pictures.FAR_ALTITUDES_KM)))
        position_km *= (limb_pictures.MEAN_KM + altitude_km) / np.linalg.norm(position_km)
        row |= {f"{k}_km": f"{x:.6f}" for k, x in zip("xyz", position_km)}
    with (folder / "frames-far.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)


def sensors(kind, fit):
    """Returns the names of the sensors that look at a kind."""
    has_size = kind in LIMBS or kind in ("ghost", "airglow")
    left_out = {"with an attitude"} if fit else set()
    return [name for name in SENSORS if name not in left_out | ({"from afar"} if has_size else set())]


def fly(hzn, root, kind, seed, fit):
    """Renders a flight and runs it. Returns one record per picture and sensor."""
    folder = root / f"{kind.replace(', ', '-').replace(' ', '-')}-{seed}"
    kept, truth_file = folder / ("evidence.json" if fit else "records.json"), folder / "truth.json"
    program = pathlib.Path(hzn).stat()
    stamp = [program.st_size, program.st_mtime_ns]
    if kept.exists() and (before := json.loads(kept.read_text()))["program"] == stamp:
        return before["records"]
    is_limb = kind in LIMBS
    if not truth_file.exists():
        render = limb_pictures.render_flight if is_limb else decoy_pictures.render_flight
        truth = render(folder, seed, kind, decoy_pictures.PICTURES)
        truth_file.write_text(json.dumps({name: [list(axis), *rest] for name, (axis, *rest) in truth.items()}))
    truth = json.loads(truth_file.read_text())
    records = []
    for sensor in sensors(kind, fit):
        table = "frames.csv"
        if sensor == "from afar":
            table = "frames-far.csv"
            write_far(folder, kind, seed)
        # All answers without the gate, so that p_limb is seen; the gate refuses those below its limit.
        for row in limb_campaign.process(hzn, folder, SENSORS[sensor], "[gates]\nmin_p_limb = 0\n", table):
            name = pathlib.Path(row["file"]).name
            axis, *rest = truth[name]
            axis = np.array(axis)
            record = {"kind": kind, "seed": seed, "sensor": sensor, "answered": row["status"] == "ok"}
            record["sharp"] = kind == "ghost" and rest[0] < SHARP * rest[1]
            if record["answered"]:
                error_deg, squared = limb_campaign.miss(row, axis)
                # Only these kinds show a limb; at night the ground's limb may be lit by the Moon.
                right = (is_limb or kind == "airglow") and squared < limb_campaign.BEYOND_5
                record |= {"right": bool(right), "error_deg": error_deg, "p": float(row["p_limb"])}
                if fit:
                    record["values"] = evidence(hzn, folder, name)
            records.append(record)
    kept.write_text(json.dumps({"program": stamp, "records": records}))
    return records


def family(record):
    if record["kind"] in SHARES:
        return record["kind"]
    return "from afar" if record["sensor"] == "from afar" else "other"


def fit(records):
    """Prints the weights of a logistic regression. Right and false answers have equal weights, false ones SHARES."""
    used = [r for r in records if r["answered"] and r["kind"] not in HELD_OUT and (r["kind"] != "ghost" or r["sharp"])]
    # A limb with a large error is a limb.
    used = [r for r in used if r["right"] or r["kind"] not in LIMBS]
    right = np.array([r["right"] for r in used])
    values = np.array([[*r["values"], 1.0] for r in used])
    total = 200.0
    weight = np.where(right, total / max(right.sum(), 1), 0.0)
    for name, share in SHARES.items():
        members = np.array([not r["right"] and family(r) == name for r in used])
        weight[members] = total * share / max(members.sum(), 1)
    # Newton's method with a Gaussian prior of sigma 2 on each weight but the constant, and of sigma 1 on that of the
    # sky: these limbs have little glare, and a lens with glare brightens the sky of a limb, too.
    prior = np.diag([*(1.0 if term == "sky" else 0.25 for term in TERMS), 1e-6])
    solution = np.zeros(len(TERMS) + 1)
    for _ in range(50):
        p = 1 / (1 + np.exp(-values @ solution))
        gradient = values.T @ (weight * (right - p)) - prior @ solution
        hessian = values.T @ (values * (weight * p * (1 - p))[:, None]) + prior
        solution += np.linalg.solve(hessian, gradient)
    print(f"{right.sum()} right and {(~right).sum()} false answers")
    for name, x in zip([*TERMS, "constant"], solution):
        print(f"{name:<15} {x:+.2f}")


def share(part, whole):
    return f"{part} of {whole} ({100 * part / max(whole, 1):.2f} %)"


def table(records, limit):
    """Prints answers per kind before and after the gate. Returns the shares of --check."""
    print("| pictures | sensor | pictures | false before the gate | false after it | right before | lost by the gate |")
    print("|---|---|---:|---:|---:|---:|---:|")
    for kind in KINDS:
        for sensor in sensors(kind, False):
            rows = [r for r in records if r["kind"] == kind and r["sensor"] == sensor]
            parts = {kind: rows}
            if kind == "ghost":
                parts = {name: [r for r in rows if r["sharp"] == (name == "ghost, sharp")]
                         for name in ("ghost, sharp", "ghost, soft")}
            for name, part in parts.items():
                false, right = ([r["p"] for r in part if r["answered"] and r["right"] == k] for k in (False, True))
                print(f"| {name} | {sensor} | {len(part)} | {len(false)} | {sum(p >= limit for p in false)} "
                      f"| {len(right)} | {sum(p < limit for p in right)} |")
    shares = {}
    for sensor in SENSORS:
        rows = [r for r in records if r["sensor"] == sensor]
        plain = [r for r in rows if r["kind"] not in LIMBS and r["kind"] not in ("ghost", "airglow")]
        for name, part in (("kinds of the fit", [r for r in plain if r["kind"] not in HELD_OUT]),
                           ("kinds that were held out", [r for r in plain if r["kind"] in HELD_OUT])):
            passed = sum(r["answered"] and r["p"] >= limit for r in part)
            print(f"{sensor}, no limb, {name}: {share(sum(r['answered'] for r in part), len(part))} before the gate, "
                  f"{share(passed, len(part))} after it")
        right = [r["p"] for r in rows if r["answered"] and r["right"]]
        lost = sum(p < limit for p in right)
        print(f"{sensor}, right answers lost: {share(lost, len(right))}")
        false = sum(r["answered"] and r["p"] >= limit for r in plain)
        flight = 3 / max(len(plain), 1)
        shares[sensor] = (false / max(len(plain), 1), lost / max(len(right), 1), flight)
    return shares


def reliability(records, odds):
    """Prints how often the edge is the limb, by p_limb. Right and false answers are weighted so that their odds are the
    prior odds, and false answers have the SHARES of the fit; soft ghosts are left out."""
    used = [r for r in records if r["answered"] and r["sensor"] != "with an attitude"]
    used = [r for r in used if r["kind"] != "ghost" or r["sharp"]]
    right = [r for r in used if r["right"]]
    groups = {name: [r for r in used if not r["right"] and family(r) == name] for name in SHARES}
    edges = [0.0, 0.1, 0.5, 0.75, 0.9, 0.99, 0.999, 1.0]
    print("| p_limb | right | false | stated 1 - p | measured 1 - p |")
    print("|---|---:|---:|---:|---:|")
    for low, high in zip(edges, edges[1:]):
        inside = [r for r in used if low <= r["p"] < high or r["p"] == high == 1.0]
        n = [sum(r["right"] == k for r in inside) for k in (True, False)]
        true = odds * n[0] / max(len(right), 1)
        false = sum(SHARES[name] * sum(r in members for r in inside) / len(members)
                    for name, members in groups.items() if members)
        weights = [odds / len(right) if r["right"] else SHARES[family(r)] / len(groups[family(r)]) for r in inside]
        stated = sum(w * (1 - r["p"]) for w, r in zip(weights, inside)) / max(sum(weights), 1e-12)
        print(f"| {low} to {high} | {n[0]} | {n[1]} | {stated:.2g} | {false / max(true + false, 1e-12):.2g} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--flights", type=int, default=20, help="flights of each kind, with three pictures (20)")
    parser.add_argument("--first-seed", type=int, default=3000, help="seed of the first flight of each kind (3000)")
    parser.add_argument("--keep", type=pathlib.Path, help="folder of the flights; a stopped campaign continues")
    parser.add_argument("--limit", type=float, default=0.75, help="limit of p_limb (gates.min_p_limb, 0.75)")
    parser.add_argument("--odds", type=float, default=50, help="prior odds (gates.prior_odds, 50)")
    parser.add_argument("--fit", action="store_true", help="prints the weights of the evidence")
    parser.add_argument("--check", action="store_true", help="exits with 1 if too many answers are false, or are lost")
    options = parser.parse_args()
    hzn = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it, or give its path")
    with tempfile.TemporaryDirectory() as temporary, concurrent.futures.ProcessPoolExecutor() as pool:
        root = options.keep or pathlib.Path(temporary)
        seeds = range(options.first_seed, options.first_seed + options.flights)
        kinds = [kind for kind in KINDS if not (options.fit and kind in HELD_OUT)]
        flights = [pool.submit(fly, hzn, root, kind, seed, options.fit) for seed in seeds for kind in kinds]
        records = [record for flight in flights for record in flight.result()]
    if options.fit:
        fit(records)
        return
    shares = table(records, options.limit)
    reliability(records, options.odds)
    if options.check:
        for sensor, (false, lost, flight) in shares.items():
            if not (false <= LARGEST_FALSE + flight and lost <= LARGEST_LOST) or math.isnan(false + lost):
                sys.exit(f"{sensor}: {false:.2%} of the pictures without a limb are answered, {lost:.2%} of the limbs lost")


if __name__ == "__main__":
    main()

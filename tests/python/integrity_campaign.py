"""Counts misleading answers: those whose error is above protection_deg. By state of the vehicle, on pictures of another
program (limb_pictures.py, decoy_pictures.py).

    python integrity_campaign.py --hzn target/release/hzn --pictures 200 --first-seed 700000
    python integrity_campaign.py --hzn target/release/hzn --pictures 2500 --first-seed 700000 --states day

Every picture is a flight of its own: another lens, calibration error, altitude, Sun, and ground. The errors are
therefore independent of each other, and binomial intervals hold. The sensor has default settings and gets the position;
the other sensors of a state get an attitude with errors of 5 degrees, the direction to the Sun, or the time (utc) as well.

The first table has the misleading answers of each state, without a gate on p_limb and with the default limit 0.75. With
the state `day` a second table has the quantiles of error / sigma_max_deg among answers to a limb in view, from which
`protection_factor` in hzn-core is taken. --keep FILE appends the answers to a CSV file, and starts after those it has.
"""

import argparse
import concurrent.futures
import csv
import dataclasses
import math
import pathlib
import shutil
import sys
import tempfile

import numpy as np

import decoy_pictures
import limb_campaign
import limb_pictures

POSITION, ATTITUDE, SUN = limb_campaign.POSITION, limb_campaign.ATTITUDE, limb_campaign.SUN
NO_LIMB = [kind for kind in decoy_pictures.KINDS if kind not in ("ghost", "airglow")]
# A quarter of the pixels of the other campaign on limbs, so that four times as many pictures take the same time.
SMALL = (480, 360)
# At larger latitudes the Sun is never low enough for the night of all of the limb in view.
LARGEST_LATITUDE_DEG = 60
LEAST_P_LIMB = 0.75
SHARES = (1e-1, 1e-2, 1e-3, 1e-4)
COLUMNS = ("state", "sensor", "seed", "kind", "limb_px", "status", "error_deg", "sigma_max_deg", "protection_deg", "p_limb")


def render(folder, seed, kind):
    """Renders one picture of a kind, of the limb or without it. Returns its truth."""
    is_limb = kind in limb_pictures.CLASSES
    limb_pictures.WIDTH, limb_pictures.HEIGHT = SMALL if is_limb else (decoy_pictures.WIDTH, decoy_pictures.HEIGHT)
    program = limb_pictures if is_limb else decoy_pictures
    (truth,) = program.render_flight(folder, seed, kind, 1).values()
    return truth


@dataclasses.dataclass
class State:
    """The kinds of pictures of a state, and for each sensor the columns of frames.csv and lines of sensor.toml."""

    kinds: list
    sensors: dict

    def render(self, folder, seed):
        """Renders one picture. Returns its kind, the limb's axis, and the number of sunlit pixels of the limb."""
        kind = self.kinds[seed % len(self.kinds)]
        axis, *rest = render(folder, seed, kind)
        return kind, axis, rest[0] if kind in limb_pictures.CLASSES else 0


STATES = {
    "day": State(["day", "day, overexposed"], {"position": (POSITION, "")}),
    "low Sun": State(["low Sun"], {"position": (POSITION, ""), "and the Sun": (POSITION + SUN, "sunlit = true\n")}),
    "no limb": State(NO_LIMB, {"position": (POSITION, ""), "and an attitude": (POSITION + ATTITUDE, "")}),
    "matching ghost": State(["ghost"], {"position": (POSITION, ""), "and an attitude": (POSITION + ATTITUDE, "")}),
    "night": State(["airglow"], {"position": (POSITION, ""), "and utc": (POSITION + ["utc"], "")}),
}


def add_time(folder, is_noon=False):
    """Adds the column utc: local midnight in winter, or noon in summer. Returns whether the latitude has a night then."""
    with (folder / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        x, y, z = (float(row[f"{k}_km"]) for k in "xyz")
        latitude_deg = math.degrees(math.atan2(z, math.hypot(x, y)))
        seconds = round(-math.degrees(math.atan2(y, x)) * 240 + 43200 * is_noon) % 86400
        clock = f"{seconds // 3600:02}:{seconds // 60 % 60:02}:{seconds % 60:02}"
        row["utc"] = f"2026-{'12-21' if (z > 0) != is_noon else '06-21'}T{clock}Z"
    with (folder / "frames.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    return abs(latitude_deg) < LARGEST_LATITUDE_DEG


def measure(hzn, name, seed):
    """Renders one picture of a state. Returns a line for each sensor; none if the place has no night."""
    state, lines = STATES[name], []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        kind, axis, limb_px = state.render(folder, seed)
        if name == "night" and not add_time(folder):
            return []
        for sensor, (columns, text) in state.sensors.items():
            # All answers without the gate on p_limb, whose effect the table has.
            (row,) = limb_campaign.process(hzn, folder, columns, text + "[gates]\nmin_p_limb = 0\n")
            line = {"state": name, "sensor": sensor, "seed": seed, "kind": kind, "limb_px": limb_px}
            line |= {key: row[key] for key in ("status", "sigma_max_deg", "protection_deg", "p_limb")}
            line["error_deg"] = limb_campaign.miss(row, axis)[0] if row["status"] == "ok" else ""
            lines.append(line)
    return lines


def interval(hits, count):
    """Returns the 95 % interval of a share after Clopper and Pearson."""

    def up_to(p, most):
        """Probability of at most `most` hits."""
        logs = [math.lgamma(count + 1) - math.lgamma(k + 1) - math.lgamma(count - k + 1)
                + k * math.log(p) + (count - k) * math.log1p(-p) for k in range(most + 1)]
        return sum(math.exp(x) for x in logs)

    def largest(holds):
        """Returns the largest probability for which this holds."""
        low, high = 1e-12, 1 - 1e-12
        for _ in range(80):
            middle = (low + high) / 2
            low, high = (middle, high) if holds(middle) else (low, middle)
        return low

    low = 0.0 if hits == 0 else largest(lambda p: 1 - up_to(p, hits - 1) < 0.025)
    return low, 1.0 if hits == count else largest(lambda p: up_to(p, hits) > 0.025)


def is_misleading(line):
    """Returns whether the error is above the level. An answer without a level misleads if it is beyond 5 sigma."""
    level_deg = float(line["protection_deg"] or 5 * float(line["sigma_max_deg"]))
    return float(line["error_deg"]) > level_deg


def show_states(lines):
    print("| state | sensor knows | pictures = flights | answered | misleading | share of pictures (95 %) "
          f"| misleading with p_limb >= {LEAST_P_LIMB} | share of pictures (95 %) |")
    print("|---|---|---:|---:|---:|---:|---:|---:|")
    for name, state in STATES.items():
        for sensor in state.sensors:
            rows = [line for line in lines if (line["state"], line["sensor"]) == (name, sensor)]
            if not rows:
                continue
            answered = [line for line in rows if line["status"] == "ok"]
            wrong = [line for line in answered if is_misleading(line)]
            probable = [line for line in wrong if float(line["p_limb"] or 0) >= LEAST_P_LIMB]
            cells = [f"{len(rows)}", f"{len(answered)}"]
            for some in (wrong, probable):
                low, high = interval(len(some), len(rows))
                cells += [f"{len(some)}", f"{100 * len(some) / len(rows):.2f} % ({100 * low:.2f} to {100 * high:.2f})"]
            print(f"| {name} | {sensor} | {' | '.join(cells)} |")


def show_quantiles(lines):
    """Prints the quantiles of error over sigma, and the share of errors above the level, among answers to a limb."""
    answered = [line for line in lines if line["state"] == "day" and line["status"] == "ok"
                and int(line["limb_px"]) >= limb_campaign.LEAST_LIMB_PX]
    if not answered:
        return
    error, sigma = (np.array([float(line[key]) for line in answered]) for key in ("error_deg", "sigma_max_deg"))
    ratio = np.sort(error / sigma)
    print(f"\nday: {len(ratio)} answers with a limb in view")
    print("\n| share | error / sigma_max, with its 95 % interval | answers beyond |\n|---:|---:|---:|")
    for share in SHARES:
        beyond = round(share * len(ratio))
        # The quantile is an order statistic, and so are the ends of its interval: a binomial count lies beyond it.
        spread = 1.96 * math.sqrt(max(beyond, 1))
        places = (len(ratio) - 1 - round(k) for k in (beyond + spread, beyond, beyond - spread))
        low, middle, high = (ratio[min(max(place, 0), len(ratio) - 1)] for place in places)
        print(f"| {share:g} | {middle:.2f} ({low:.2f} to {high:.2f}) | {beyond} |")
    print(f"\nlargest: {', '.join(f'{x:.2f}' for x in ratio[-8:])}")
    level = np.array([float(line["protection_deg"] or "nan") for line in answered])
    known = ~np.isnan(level)
    if known.any():
        hits, count = int((error > level)[known].sum()), int(known.sum())
        low, high = interval(hits, count)
        print(f"error above protection_deg: {hits} of {count} ({low:.2e} to {high:.2e}, 95 %); "
              f"median protection_deg / sigma_max_deg {np.median((level / sigma)[known]):.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--pictures", type=int, default=200, help="number of pictures of each state (200)")
    parser.add_argument("--first-seed", type=int, default=700_000, help="seed of the first picture (700000)")
    parser.add_argument("--states", nargs="+", choices=STATES, default=list(STATES), help="states; without it, all")
    parser.add_argument("--jobs", type=int, help="number of processes; without it, all cores")
    parser.add_argument("--keep", type=pathlib.Path, help="CSV file with the answers, which is continued")
    options = parser.parse_args()
    hzn = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it, or give its path")
    lines = []
    if options.keep and options.keep.exists():
        with options.keep.open() as file:
            lines = list(csv.DictReader(file))
    done = {(line["state"], int(line["seed"])) for line in lines}
    seeds = range(options.first_seed, options.first_seed + options.pictures)
    todo = [(name, seed) for seed in seeds for name in options.states if (name, seed) not in done]
    keep = options.keep.open("a", newline="") if options.keep else None
    writer = csv.DictWriter(keep, COLUMNS) if keep else None
    if writer and not lines:
        writer.writeheader()
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        for found in pool.map(measure, [hzn] * len(todo), *zip(*todo)) if todo else []:
            lines += found
            if writer:
                writer.writerows(found)
                keep.flush()
    if not lines:
        sys.exit("no pictures")
    show_states(lines)
    show_quantiles(lines)


if __name__ == "__main__":
    main()

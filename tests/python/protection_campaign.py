"""Measures how far answers are from the truth in units of sigma, on pictures of another program (limb_pictures.py).

    python protection_campaign.py --hzn target/release/hzn --pictures 1500 --first-seed 700000

Every picture is a flight of its own: another lens, calibration error, altitude, Sun, and ground. The errors are
therefore independent of each other, and binomial intervals hold. The Sun is high, the sensor has default settings and
gets the position. A picture counts if its limb is lit and hzn answers it.

The first table has the quantiles of error / sigma_max_deg, from which `protection_factor` in hzn-core is taken. The
second table has the share of errors above protection_deg, with its 95 % interval (Clopper and Pearson). Both must use
other seeds. --keep FILE appends the answers to a CSV file, and starts after the seeds that it has.
"""

import argparse
import concurrent.futures
import csv
import math
import pathlib
import shutil
import sys
import tempfile

import numpy as np

import limb_campaign
import limb_pictures

KINDS = ("day", "day, overexposed")
# A quarter of the pixels of the other campaign, so that four times as many pictures take the same time.
SIZE = (480, 360)
SHARES = (1e-1, 1e-2, 1e-3, 1e-4)
COLUMNS = ("seed", "kind", "error_deg", "sigma_max_deg", "protection_deg")


def measure(hzn, seed):
    """Renders one picture. Returns its line, with empty cells if there is no answer or no limb."""
    limb_pictures.WIDTH, limb_pictures.HEIGHT = SIZE
    kind = KINDS[seed % len(KINDS)]
    line = dict.fromkeys(COLUMNS, "") | {"seed": seed, "kind": kind}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        ((axis, limb_px),) = limb_pictures.render_flight(folder, seed, kind, 1).values()
        (row,) = limb_campaign.answers(hzn, folder, "default")
    if limb_px >= limb_campaign.LEAST_LIMB_PX and row["status"] == "ok":
        line["error_deg"] = limb_campaign.miss(row, axis)[0]
        line["sigma_max_deg"] = float(row["sigma_max_deg"])
        line["protection_deg"] = row.get("protection_deg", "")
    return line


def interval(hits, count):
    """Returns the 95 % interval of a share after Clopper and Pearson."""

    def beyond(p, most):
        """Probability of at most `most` hits."""
        logs = [math.lgamma(count + 1) - math.lgamma(k + 1) - math.lgamma(count - k + 1)
                + k * math.log(p) + (count - k) * math.log1p(-p) for k in range(most + 1)]
        return sum(math.exp(x) for x in logs)

    def solve(falls):
        low, high = 1e-12, 1 - 1e-12
        for _ in range(80):
            middle = (low + high) / 2
            low, high = (middle, high) if falls(middle) else (low, middle)
        return low

    low = 0.0 if hits == 0 else solve(lambda p: 1 - beyond(p, hits - 1) < 0.025)
    return low, solve(lambda p: beyond(p, hits) > 0.025)


def show(lines):
    answered = [line for line in lines if line["error_deg"] != ""]
    errors, sigmas = (np.array([float(line[name]) for line in answered]) for name in ("error_deg", "sigma_max_deg"))
    ratio = np.sort(errors / sigmas)
    print(f"{len(lines)} pictures, {len(ratio)} answers with a limb in view, each of a flight of its own")
    print("\n| share | error / sigma_max, with its 95 % interval | answers beyond |\n|---:|---:|---:|")
    for share in SHARES:
        beyond = round(share * len(ratio))
        # The quantile is the order statistic; its interval has the order statistics of a binomial count.
        spread = 1.96 * math.sqrt(max(beyond, 1))
        pick = [min(max(len(ratio) - 1 - round(k), 0), len(ratio) - 1) for k in (beyond + spread, beyond, beyond - spread)]
        print(f"| {share:g} | {ratio[pick[1]]:.2f} ({ratio[pick[0]]:.2f} to {ratio[pick[2]]:.2f}) | {beyond} |")
    print(f"\nlargest: {', '.join(f'{x:.2f}' for x in ratio[-8:])}")
    protected = [line for line in answered if line["protection_deg"] != ""]
    if protected:
        level = np.array([float(line["protection_deg"]) for line in protected])
        scale = level / np.array([float(line["sigma_max_deg"]) for line in protected])
        error = np.array([float(line["error_deg"]) for line in protected])
        hits = int((error > level).sum())
        low, high = interval(hits, len(level))
        print(f"\nerror above protection_deg: {hits} of {len(level)} ({low:.2e} to {high:.2e}, 95 %); "
              f"median protection_deg / sigma_max_deg {np.median(scale):.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--pictures", type=int, default=200, help="number of pictures (200)")
    parser.add_argument("--first-seed", type=int, default=700_000, help="seed of the first picture (700000)")
    parser.add_argument("--jobs", type=int, help="number of processes; without it, all cores")
    parser.add_argument("--keep", type=pathlib.Path, help="CSV file with the answers, which is continued")
    options = parser.parse_args()
    hzn = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it, or give its path")
    lines = []
    if options.keep and options.keep.exists():
        with options.keep.open() as file:
            lines = list(csv.DictReader(file))
    done = {int(line["seed"]) for line in lines}
    seeds = [s for s in range(options.first_seed, options.first_seed + options.pictures) if s not in done]
    keep = options.keep.open("a", newline="") if options.keep else None
    writer = csv.DictWriter(keep, COLUMNS) if keep else None
    if writer and not lines:
        writer.writeheader()
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        for line in pool.map(measure, [hzn] * len(seeds), seeds):
            lines.append(line)
            if writer:
                writer.writerow(line)
                keep.flush()
    if not lines:
        sys.exit("no pictures")
    show(lines)


if __name__ == "__main__":
    main()

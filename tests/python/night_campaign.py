"""Runs hzn with night = "airglow" on pictures of another program: layers of airglow, and edges that must not be answered.

    python night_campaign.py --hzn target/release/hzn --pictures 300 --first-seed 810000

The layers (decoy_pictures.py) are Chapman layers with peaks from 85 to 105 km, 3 to 12 km thick, above ground that is dark,
lit by the Moon, or by cities; once their thickness is the scale height of the Chapman profile, and once its full width at
half of the emission. Every picture is a flight of its own, with another lens. The sensor gets the position, the time
(midnight in winter), and in one of two runs the tone of the picture. The other pictures are limbs by day (limb_pictures.py)
with a time that is wrong, midnight, and edges that are no limb, at midnight.
"""

import argparse
import concurrent.futures
import math
import pathlib
import shutil
import tempfile

import numpy as np

import decoy_pictures
import integrity_campaign
import limb_campaign
import limb_pictures

COLUMNS = limb_campaign.POSITION + ["utc"]
NIGHT = 'night = "airglow"\n'
# Full width at half maximum of exp(1 - z - exp(-z)), in z.
WIDTH_OF_CHAPMAN = 2.446
DAY, NO_LIMB = "day at a wrong time", "no limb"
LAYERS = {"layer, thickness = scale height": 1.0, "layer, thickness = full width": 1 / WIDTH_OF_CHAPMAN}
KINDS = {DAY: list(limb_pictures.CLASSES), NO_LIMB: integrity_campaign.NO_LIMB}


def run(hzn, name, seed):
    """Renders one picture and runs hzn. Returns the name and, per run, the error and its square over the covariance."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        if name in LAYERS:
            decoy_pictures.THICKNESS = LAYERS[name]
        kinds = KINDS.get(name, ["airglow"])
        axis, *_ = integrity_campaign.render(folder, seed, kinds[seed % len(kinds)])
        if not integrity_campaign.add_midnight(folder):
            return None
        runs = {"unknown": NIGHT}
        tone = folder / "tone"
        if tone.exists() and name in LAYERS:
            runs["told"] = f'{NIGHT}[input]\ntone = "{tone.read_text()}"\n'
        found = {}
        for told, lines in runs.items():
            (row,) = limb_campaign.process(hzn, folder, COLUMNS, lines)
            found[told] = limb_campaign.miss(row, axis) if row["status"] == "ok" else None
        return name, seed, found


def show(done):
    print("| pictures | tone | pictures | answered | RMS | median error | NEES | beyond 3 sigma | largest error |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|")
    for name in [*LAYERS, *KINDS]:
        for told in ("unknown", "told"):
            rows = [found[told] for n, _, found in done if n == name and told in found]
            answers = np.array([row for row in rows if row]).reshape(-1, 2)
            if not rows:
                continue
            cells = [name, told, f"{len(rows)}", f"{len(answers)} ({100 * len(answers) / len(rows):.1f} %)"]
            if len(answers):
                errors, squares = answers.T
                cells += [f"{math.sqrt((errors**2).mean()):.3f}°", f"{np.median(errors):.3f}°", f"{squares.mean():.2f}",
                          f"{(squares > limb_campaign.BEYOND_3).sum()}", f"{errors.max():.2f}°"]
            else:
                cells += ["–"] * 5
            print(f"| {' | '.join(cells)} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True, help="the program")
    parser.add_argument("--pictures", type=int, default=300, help="number of pictures of each kind (300)")
    parser.add_argument("--first-seed", type=int, default=810_000, help="seed of the first picture (810000)")
    parser.add_argument("--kinds", nargs="+", choices=[*LAYERS, *KINDS], default=[*LAYERS, *KINDS], help="without it, all")
    parser.add_argument("--jobs", type=int, help="number of processes; without it, all cores")
    parser.add_argument("--list", action="store_true", help="names the answers without a layer, and those beyond 3 sigma")
    options = parser.parse_args()
    hzn = shutil.which(options.hzn) or parser.error(f"--hzn: {options.hzn} is not there; build it, or give its path")
    seeds = range(options.first_seed, options.first_seed + options.pictures)
    todo = [(name, seed) for name in options.kinds for seed in seeds]
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool:
        done = [row for row in pool.map(run, [hzn] * len(todo), *zip(*todo)) if row]
    show(done)
    if options.list:
        for name, seed, found in done:
            for told, row in found.items():
                if row and (name not in LAYERS or row[1] > limb_campaign.BEYOND_3):
                    print(f"{name}, seed {seed}, tone {told}: {row[0]:.3f}°")


if __name__ == "__main__":
    main()

"""Runs hzn with night = "airglow" on pictures of another program: layers of airglow, and edges that are none.

    python night_campaign.py --hzn target/release/hzn --pictures 300 --first-seed 810000

The layers (decoy_pictures.py) are Chapman layers above ground that is dark, lit by the Moon, or by cities. Two kinds have
peaks from 85 to 105 km, 3 to 12 km thick: once as the scale height of the Chapman profile, once as its full width at half of
the emission. `557.7 nm` is the green line of oxygen alone, `broad` what a camera without a filter sees: hydroxyl, sodium, and
two systems of oxygen, each with a peak and a full width from published ranges, in any proportion. Every picture is a flight of
its own, with another lens. The sensor gets the position, the time (midnight in winter), and in one of two runs the tone of the
picture. The other pictures are limbs by day (limb_pictures.py) with the right time (noon in summer) or a wrong one (midnight),
lines of city lights, and edges that are no limb, at midnight.
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
# Peak and full width at half of the emission, km: hydroxyl, sodium, the atmospheric bands of oxygen, the green line of oxygen
# (Baker & Stair, Physica Scripta 37 (1988) 611; Khomich, Semenov & Shefov, Airglow as an Indicator, Springer 2008).
HYDROXYL, SODIUM, BANDS, GREEN = ((84, 90), (6, 11)), ((88, 94), (7, 12)), ((92, 97), (7, 12)), ((94, 100), (6, 12))


def emit(rng, kind):
    """Draws a layer of one kind: its peak and scale height, km."""
    peak, width = kind
    return rng.uniform(*peak), rng.uniform(*width) / WIDTH_OF_CHAPMAN


LAYERS = {
    "layer, thickness = scale height": decoy_pictures.chapman,
    "layer, thickness = full width": lambda rng: decoy_pictures.chapman(rng, 1 / WIDTH_OF_CHAPMAN),
    "layer, 557.7 nm": lambda rng: [(1.0, *emit(rng, GREEN))],
    "layer, broad": lambda rng: [(rng.uniform(0, 1), *emit(rng, kind)) for kind in (HYDROXYL, SODIUM, BANDS, GREEN)],
}


def city_line(rng, _):
    """A line of city lights along a coast or a road, on dark ground or under the Moon."""
    dark = rng.choice([0.005, 0.05]) * np.clip(1 + 0.4 * decoy_pictures.pattern(rng, 1.0), 0.1, None)
    lights = np.clip(decoy_pictures.pattern(rng, rng.uniform(0, 0.6)) + rng.uniform(0, 2), 0, None)
    away = decoy_pictures.arc(rng, 0.5, 8) + rng.uniform(0, 6) * decoy_pictures.pattern(rng, 1.5)
    return dark + rng.uniform(0.2, 0.8) * lights * np.exp(-((away / rng.uniform(1, 12)) ** 2))


decoy_pictures.KINDS["city line"] = city_line
DAY_LIMBS = list(limb_pictures.CLASSES)
DAY, NOON, CITY, NO_LIMB = "day at a wrong time", "day at noon", "a line of cities", "no limb"
KINDS = {DAY: DAY_LIMBS, NOON: DAY_LIMBS, CITY: ["city line"], NO_LIMB: integrity_campaign.NO_LIMB}


def run(hzn, name, seed):
    """Renders one picture and runs hzn. Returns the name and, per run, the error and its square over the covariance."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        decoy_pictures.LAYERS = LAYERS.get(name, decoy_pictures.chapman)
        kinds = KINDS.get(name, ["airglow"])
        axis, *_ = integrity_campaign.render(folder, seed, kinds[seed % len(kinds)])
        if not integrity_campaign.add_time(folder, is_noon=name == NOON):
            return None
        runs = {"unknown": NIGHT}
        tone = folder / "tone"
        if tone.exists() and name in LAYERS:
            runs["told"] = f'{NIGHT}[input]\ntone = "{tone.read_text()}"\n'
        found = {}
        for told, lines in runs.items():
            (row,) = limb_campaign.process(hzn, folder, COLUMNS, lines)
            # By day the key changes nothing: an answer is that of the limb.
            is_answer = row["status"] == "ok" and (name != NOON or row["detail"] == "airglow")
            found[told] = limb_campaign.miss(row, axis) if is_answer else None
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

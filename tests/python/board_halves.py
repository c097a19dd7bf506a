"""Compares lenses of disjoint halves of the pictures of a board: do they differ as their sigmas say?

The true lens of a real camera is unknown. Two halves of its pictures give two lenses; each parameter of these differs
by an error whose sigma is told. The RMS of the differences over their sigmas is 1 if the sigmas are right.

    python tests/python/board_halves.py --hzn target/release/hzn FOLDER:9x6 OTHER:8x6:brown-conrady
"""

import argparse
import math
import random
import shutil
import subprocess
import tempfile
import tomllib
from pathlib import Path


def calibrate(hzn: str, pictures: list[Path], board: str, model: str) -> tuple[list[float], list[float]] | None:
    """Returns the parameters of the lens and their sigmas; None if the calibration is refused."""
    with tempfile.TemporaryDirectory() as folder:
        for picture in pictures:
            shutil.copy(picture, folder)
        out = Path(folder, "camera.toml")
        command = [hzn, "calibrate", "board", folder, "--board", board, "--model", model, "-j1", "-q", "-o", str(out)]
        if subprocess.run(command, capture_output=True).returncode != 0:
            return None
        camera = tomllib.loads(out.read_text())["camera"]
        names = camera["covariance"]["order"]
        intrinsic = [camera[name] for name in names if name in camera]
        sigmas = [math.sqrt(row[n]) for n, row in enumerate(camera["covariance"]["rows"])]
        return intrinsic + camera.get("k", []), sigmas


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+", metavar="FOLDER:COLUMNSxROWS[:MODEL]")
    parser.add_argument("--hzn", default="hzn")
    parser.add_argument("--splits", type=int, default=4)
    parser.add_argument("--seed", type=int, default=100)
    args = parser.parse_args()
    everything: list[float] = []
    for given in args.sets:
        folder, board, model = (given.split(":") + ["kannala-brandt"])[:3]
        pictures = sorted(p for p in Path(folder).iterdir() if p.suffix in {".jpg", ".png", ".bmp"})
        ratios: list[float] = []
        refused = 0
        for split in range(args.splits):
            random.Random(args.seed + split).shuffle(pictures)
            halves = [calibrate(args.hzn, pictures[k::2], board, model) for k in range(2)]
            if None in halves:
                refused += 1
                continue
            (first, first_sigma), (second, second_sigma) = halves
            errors = zip(first, second, first_sigma, second_sigma)
            ratios += [(a - b) / math.hypot(sa, sb) for a, b, sa, sb in errors]
        everything += ratios
        print(describe(folder, ratios), f"refused {refused} of {args.splits}", flush=True)
    print(describe("all", everything))


def describe(name: str, ratios: list[float]) -> str:
    """Returns the line of a set."""
    if not ratios:
        return f"{name}: no halves"
    rms = math.sqrt(sum(r * r for r in ratios) / len(ratios))
    beyond = sum(abs(r) > 3 for r in ratios)
    return f"{name}: RMS {rms:.2f} sigma over {len(ratios)} differences, {beyond} beyond 3 sigma;"


if __name__ == "__main__":
    main()

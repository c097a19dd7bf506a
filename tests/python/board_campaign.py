"""Compares `hzn calibrate board` with OpenCV on rendered boards with known truth.

    python board_campaign.py --hzn target/release/hzn --sets 100 -o book/results/calibration.md

Every set has its own camera, poses, blur and noise. A fifth of the boards is cut by the border of the picture; OpenCV's
finder needs whole boards. Both programs use one thread and read the same files.
"""

import argparse
import concurrent.futures
import math
import pathlib
import subprocess
import tempfile
import time
import tomllib

import cv2
import numpy as np

import boards

VIEWS = 12


def model_of(lens):
    return boards.LENSES[lens][0]


def run_hzn(hzn, folder, lens):
    out = folder / "camera.toml"
    command = [hzn, "calibrate", "board", str(folder), "--board", f"{boards.COLUMNS}x{boards.ROWS}", "--square-mm",
               str(boards.SQUARE_MM), "--model", model_of(lens), "-o", str(out), "-j", "1", "--force", "-q"]
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True)
    elapsed = time.perf_counter() - start
    if done.returncode != 0:
        return {"error": done.stderr.strip()[-200:], "time": elapsed}
    camera = tomllib.loads(out.read_text())["camera"]
    lines = done.stdout.splitlines()
    views = sum("points, RMS" in line for line in lines)
    points = sum(int(line.split("points, RMS")[0].split()[-1]) for line in lines if "points, RMS" in line)
    rms = next(float(line.split()[1]) for line in lines if line.startswith("RMS"))
    return {"camera": camera, "views": views, "points": points, "rms": rms, "time": elapsed}


def run_opencv(files, lens, width, height):
    cv2.setNumThreads(1)
    start = time.perf_counter()
    board = np.zeros((boards.COLUMNS * boards.ROWS, 3), np.float32)
    board[:, :2] = np.mgrid[0:boards.COLUMNS, 0:boards.ROWS].T.reshape(-1, 2) * boards.SQUARE_MM
    corners = []
    for file in files:
        picture = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        found, at = cv2.findChessboardCorners(picture, (boards.COLUMNS, boards.ROWS))
        if found:
            corners.append(cv2.cornerSubPix(picture, at, (5, 5), (-1, -1), (3, 40, 1e-3)))
    out = {"views": len(corners), "points": 54 * len(corners)}
    try:
        if model_of(lens) == "kannala-brandt":
            flags = cv2.fisheye.CALIB_RECOMPUTE_EXTRINSIC | cv2.fisheye.CALIB_FIX_SKEW
            rms, matrix, k, *_ = cv2.fisheye.calibrate(
                [board[None].astype(np.float64)] * len(corners), [c.reshape(1, -1, 2).astype(np.float64) for c in corners],
                (width, height), None, None, flags=flags, criteria=(3, 100, 1e-9))
        else:
            rms, matrix, k, *_ = cv2.calibrateCamera([board] * len(corners), corners, (width, height), None, None,
                                                     criteria=(3, 100, 1e-9))
        out |= {"rms": rms, "matrix": matrix, "k": np.ravel(k)}
    except cv2.error as error:
        out["error"] = str(error)[:80]
    return out | {"time": time.perf_counter() - start}


def truth_of(camera):
    names = ["k1", "k2", "k3", "k4"] if camera["model"] == "kannala-brandt" else ["k1", "k2", "p1", "p2", "k3"]
    return {"fx_px": camera["fx"], "fy_px": camera["fy"], "cx_px": camera["cx"], "cy_px": camera["cy"],
            **dict(zip(names, camera["k"]))}


def one_set(job):
    hzn, lens, seed, width, height = job
    rng = np.random.default_rng(seed + 7_000_000)
    noise = float(rng.uniform(0.005, 0.03))
    camera, views = boards.render_set(lens, VIEWS, seed, width, height, psf=float(rng.uniform(0.6, 1.2)), noise=noise,
                                      partial=0.2)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        files = [folder / f"view-{n:02}.png" for n in range(VIEWS)]
        for file, view in zip(files, views):
            cv2.imwrite(str(file), view[0])
        ours, theirs = run_hzn(hzn, folder, lens), run_opencv(files, lens, width, height)
    row = {"lens": lens, "seed": seed, "ours": ours, "theirs": theirs}
    if "camera" in ours:
        found, truth = ours["camera"], truth_of(camera)
        order, rows = found["covariance"]["order"], found["covariance"]["rows"]
        k = found["k"] + [0.0] * 5
        values = [found[n] if n in found else k[order.index(n) - 4] for n in order]
        row["z"] = {n: (v - truth[n]) / math.sqrt(rows[i][i]) for i, (n, v) in enumerate(zip(order, values))}
        row["f_error"] = found["fx_px"] / truth["fx_px"] - 1
    if "matrix" in theirs:
        row["f_error_opencv"] = theirs["matrix"][0, 0] / camera["fx"] - 1
    return row


def table(rows, size):
    lines = [
        "| lens | sets | calibrated (hzn, OpenCV) | parameters within 3 sigma | worst parameter | RMS of errors, sigma | "
        "boards found (hzn, OpenCV) | reprojection RMS, px (hzn, OpenCV) | focal length error RMS, % (hzn, OpenCV) | "
        "time, hzn/OpenCV |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    rms = lambda x: math.sqrt(float(np.mean(np.square(x)))) if len(x) else float("nan")
    for lens in boards.LENSES:
        mine = [r for r in rows if r["lens"] == lens]
        good = [r for r in mine if "z" in r]
        theirs = [r for r in mine if "f_error_opencv" in r]
        names = list(good[0]["z"])
        share = {n: np.mean([abs(r["z"][n]) < 3 for r in good]) for n in names}
        worst = min(share, key=share.get)
        z = [v for r in good for v in r["z"].values()]
        found = [sum(r[who]["views"] for r in mine if "views" in r[who]) for who in ("ours", "theirs")]
        lines.append(
            f"| {lens} | {len(mine)} | {len(good)}, {len(theirs)} | {100 * np.mean(np.abs(z) < 3):.1f} % | "
            f"{worst} {100 * share[worst]:.0f} % | {rms(z):.2f} | {found[0]}, {found[1]} of {VIEWS * len(mine)} | "
            f"{np.median([r['ours']['rms'] for r in good]):.4f}, "
            f"{np.median([r['theirs']['rms'] for r in theirs]):.4f} | "
            f"{100 * rms([r['f_error'] for r in good]):.4f}, {100 * rms([r['f_error_opencv'] for r in theirs]):.4f} | "
            f"{np.median([r['ours']['time'] / r['theirs']['time'] for r in mine]):.2f} |"
        )
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hzn", required=True)
    parser.add_argument("--sets", type=int, default=100)
    parser.add_argument("--first-seed", type=int, default=5000)
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    args = parser.parse_args()
    width, height = map(int, args.size.split("x"))
    jobs = [(args.hzn, lens, args.first_seed + n, width, height) for lens in boards.LENSES for n in range(args.sets)]
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        rows = list(pool.map(one_set, jobs))
    for row in rows:
        for who in ("ours", "theirs"):
            if "error" in row[who]:
                print(row["lens"], row["seed"], who, row[who]["error"])
    text = table(rows, args.size)
    print(text)
    if args.output:
        args.output.write_text(text)


if __name__ == "__main__":
    main()

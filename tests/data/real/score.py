"""Scores limb results against truth.csv: python3 score.py RESULTS.csv

RESULTS.csv has a column `file` and, for each picture with an answer, `axis_x, axis_y, axis_z` (unit vector to the body,
camera frame: x right, y down, z forward) or `position_x_km, position_y_km, position_z_km` (camera to the body's centre),
or both. These are the columns of `hzn run -o RESULTS.csv`; any other program can write them. With `cov_*` (rad^2) and
`pos_cov_*_km2` the errors are also given in sigmas. Only the end of a file name counts.
"""

import csv
import math
import sys
from pathlib import Path


def numbers(row, names):
    cells = [row.get(name) or "" for name in names]
    return [float(cell) for cell in cells] if all(cells) else None


def length(v):
    return math.sqrt(sum(x * x for x in v))


def along(upper, u):
    xx, xy, xz, yy, yz, zz = upper
    x, y, z = u
    return xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + xz * x * z + yz * y * z)


def score_range(row, truth):
    position = numbers(row, ["position_x_km", "position_y_km", "position_z_km"])
    if position is None:
        return "no position"
    found, true = length(position), float(truth["value_1"])
    text = f"range {found:.0f} km, error {100.0 * (found / true - 1.0):+.3f} %"
    names = ["xx", "xy", "xz", "yy", "yz", "zz"]
    covariance = numbers(row, [f"pos_cov_{name}_km2" for name in names])
    if covariance:
        sigma = math.sqrt(along(covariance, [x / found for x in position]))
        text += f", {(found - true) / math.hypot(sigma, float(truth['sigma'])):+.2f} sigma"
    return text


def score_axis(row, truth):
    axis = numbers(row, ["axis_x", "axis_y", "axis_z"])
    axis = axis or numbers(row, ["position_x_km", "position_y_km", "position_z_km"])
    if axis is None:
        return "no direction"
    true = [float(truth[f"value_{i}"]) for i in (1, 2, 3)]
    a, b = length(axis), length(true)
    cross = [
        axis[1] * true[2] - axis[2] * true[1],
        axis[2] * true[0] - axis[0] * true[2],
        axis[0] * true[1] - axis[1] * true[0],
    ]
    dot = sum(x * y for x, y in zip(axis, true))
    angle = math.degrees(math.atan2(length(cross), dot))
    return f"direction {angle:.4f} deg off (truth known to {truth['sigma']} deg)"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    with open(Path(__file__).with_name("truth.csv"), newline="") as file:
        truths = list(csv.DictReader(file))
    for truth in truths:
        name = truth["file"].rsplit("/", 1)[-1]
        row = next((row for row in rows if (row.get("file") or "").endswith(name)), None)
        if row is None:
            print(f"{truth['file']}: not among the results")
            continue
        score = score_range if truth["quantity"] == "range" else score_axis
        print(f"{truth['file']}: {score(row, truth)}")


if __name__ == "__main__":
    main()

"""Scores limb results against truth.csv: python3 score.py RESULTS.csv

RESULTS.csv has a column `file` and, for each picture with an answer, `axis_x, axis_y, axis_z` (unit vector to the body,
camera frame: x right, y down, z forward) or `position_x_km, position_y_km, position_z_km` (camera to the body's centre),
or both. These are the columns of `hzn run -o RESULTS.csv`; any other program can write them. With `cov_*` (rad^2) and
`pos_cov_*_km2` the errors are also given in sigmas. Paths are compared from their end, so a name without a folder
counts for every picture of that name.
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
    axis, unit, name = numbers(row, ["axis_x", "axis_y", "axis_z"]), 1.0, "cov_{}"
    if axis is None:
        axis, name = numbers(row, ["position_x_km", "position_y_km", "position_z_km"]), "pos_cov_{}_km2"
        unit = length(axis) if axis else 1.0
    if axis is None:
        return "no direction"
    axis = [x / length(axis) for x in axis]
    true = [float(truth[f"value_{i}"]) for i in (1, 2, 3)]
    true = [x / length(true) for x in true]
    off = [x - y for x, y in zip(axis, true)]
    angle = 2.0 * math.degrees(math.asin(min(1.0, 0.5 * length(off))))
    text = f"direction {angle:.4f} deg off (truth known to {truth['sigma']} deg)"
    covariance = numbers(row, [name.format(ij) for ij in ("xx", "xy", "xz", "yy", "yz", "zz")])
    if covariance and length(off) > 0.0:
        variance = along(covariance, [x / length(off) for x in off]) / unit**2
        text += f", {angle / math.hypot(math.degrees(math.sqrt(variance)), float(truth['sigma'])):.2f} sigma"
    return text


# A pole is no answer: it orients the body for a program that needs no attitude.
SCORES = {"range": score_range, "axis": score_axis}


def find(rows, name):
    """Return the row of a picture. The paths must agree from the end as far as the shorter one goes."""
    for row in rows:
        file = (row.get("file") or "").replace("\\", "/")
        if file and (f"/{name}".endswith(f"/{file}") or f"/{file}".endswith(f"/{name}")):
            return row
    return None


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    with open(Path(__file__).with_name("truth.csv"), newline="") as file:
        truths = list(csv.DictReader(file))
    for truth in truths:
        if truth["quantity"] not in SCORES:
            continue
        row = find(rows, truth["file"])
        score = SCORES[truth["quantity"]](row, truth) if row else "not among the results"
        print(f"{truth['file']}: {score}")


if __name__ == "__main__":
    main()

"""Projects the rays of hzn's lens models into the picture with OpenCV and compares.

usage: check_lenses.py RAYS FOLDER

RAYS is hzn-calib's example `rays`; this program makes FOLDER. In OpenCV, cv2.projectPoints without coefficients is
`pinhole`, with (k1, k2, p1, p2, k3) it is `brown-conrady`; cv2.fisheye is `kannala-brandt`, without coefficients
`equidistant`. OpenCV's fisheye accepts only points in front of the camera: rays beyond 90 degrees are left out and counted.
Exits with 1 if a pixel is off by more than 1e-6.
"""

import csv
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np

W, H, CX, CY = 1280, 800, 655.25, 381.5
#        name             fx     fy     coefficients                             image circle, degrees
LENSES = [
    ("pinhole", 900.0, 905.0, [], None),
    ("brown-conrady", 900.0, 905.0, [-0.21, 0.055, 0.0008, -0.0011, -0.006], None),
    ("brown-conrady", 700.0, 690.0, [0.08, -0.012, -0.002, 0.0015, 0.004], None),
    ("kannala-brandt", 610.0, 607.0, [-0.055, 0.011, -0.0035, 0.0002], None),
    ("kannala-brandt", 380.0, 378.0, [0.02, -0.004, 0.0011, -0.0002], 100.0),
    ("equidistant", 400.0, 400.0, [], 95.0),
]


def project_with_opencv(model, rays, fx, fy, k):
    matrix = np.array([[fx, 0, CX], [0, fy, CY], [0, 0, 1]])
    still = np.zeros(3)
    if model in ("pinhole", "brown-conrady"):
        return cv2.projectPoints(rays, still, still, matrix, np.array(k or [0.0] * 5))[0][:, 0]
    return cv2.fisheye.projectPoints(rays[:, None], still, still, matrix, np.array(k or [0.0] * 4))[0][:, 0]


def main():
    program, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True)
    for number, (model, fx, fy, k, circle) in enumerate(LENSES):
        sensor = folder / f"{number}.toml"
        lines = ["[camera]", f"width = {W}", f"height = {H}", f'model = "{model}"', f"fx_px = {fx}", f"fy_px = {fy}",
                 f"cx_px = {CX}", f"cy_px = {CY}"]
        lines += [f"k = {k}"] if k else []
        lines += [f"theta_max_deg = {circle}"] if circle else []
        sensor.write_text("\n".join(lines) + "\n\n[body]\naltitude_km = 500.0\n")
        printed = subprocess.run([program, sensor], check=True, capture_output=True, text=True).stdout
        rows = np.array([[float(x) for x in row] for row in list(csv.reader(printed.splitlines()))[1:]])
        before = rows[:, 4] > 1e-6
        pixels, rays, again = rows[before, :2], rows[before, 2:5].copy(), rows[before, 5:7]
        theirs = project_with_opencv(model, rays, fx, fy, k)
        off, back = np.abs(theirs - pixels).max(), np.abs(again - pixels).max()
        widest = np.degrees(np.arccos(rows[:, 4].min()))
        print(f"{model} {k}: {len(pixels)} pixels to {min(widest, 90.0):.1f} deg off axis, {off:.1e} px from OpenCV, "
              f"{back:.1e} px there and back; {len(rows) - len(pixels)} pixels beyond 90 deg not compared")
        if not (len(pixels) > 2000 and off < 1e-6 and back < 1e-6):
            sys.exit(f"{model}: the pixels differ from OpenCV's")


main()

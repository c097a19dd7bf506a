"""Writes the files one-*.* and two-*.* of this folder with OpenCV's FileStorage.

    python make_opencv.py FOLDER

`one` is a lens of cv2.fisheye, `two` one of cv2.calibrateCamera. The files `*-word` have `fisheye_model`, as OpenCV's
calibration sample writes it. In the files `*-shape` only the shape of the coefficients tells the lens.
"""

import sys

import cv2
import numpy as np

matrix = np.array([[431.25, 0, 321.5], [0, 430.0625, 238.75], [0, 0, 1]])
lenses = {
    # cv2.fisheye.calibrate returns a column of four.
    "one": (1, np.array([[-0.0431], [0.0123], [-0.0057], [1e-05]])),
    # cv2.calibrateCamera returns a row of at least five.
    "two": (0, np.array([[-0.3376, 0.1116, -0.000218, -3e-05, 0.02]])),
}
for ending in ("yaml", "xml", "json"):
    for name, (fisheye, coefficients) in lenses.items():
        for kind in ("shape", "word"):
            storage = cv2.FileStorage(f"{sys.argv[1]}/{name}-{kind}.{ending}", cv2.FILE_STORAGE_WRITE)
            storage.write("calibration_time", "Sun 22 Nov 2026 10:00:00 AM")
            storage.write("image_width", 640)
            storage.write("image_height", 480)
            if kind == "word":
                storage.write("fisheye_model", fisheye)
            storage.write("camera_matrix", matrix)
            storage.write("distortion_coefficients", coefficients)
            storage.write("avg_reprojection_error", 0.1625)
            storage.release()

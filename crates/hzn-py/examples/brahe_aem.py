"""The attitude of `hzn fuse` in brahe: read from the AEM, interpolated, and compared with another attitude.

    pip install brahe
    hzn fuse ... --utc 2019-06-13T04:00:00Z --aem nav.aem --aem-version 2.0 -o nav.csv
    python brahe_aem.py nav.aem 2019 6 13 4 5 0

brahe reads version 2.0 of the message. Its frame ITRF is hzn's ECEF, and its matrix turns vectors from ITRF into the
frame of the vehicle, so the attitude of hzn (from the vehicle to ECEF) is the transpose.
"""

import sys

import brahe as bh
import numpy as np
from brahe.ccsds import AEM


def read(path):
    """Return the attitude in the message, which brahe interpolates between its times."""
    (attitude,) = AEM.from_file(str(path)).to_attitude_trajectories()
    return attitude


def fixed_from_vehicle(attitude, epoch):
    """Return the matrix that turns vectors from the frame of the vehicle into ECEF."""
    return np.array(attitude.rotation_matrix(epoch).to_matrix()).T


def misses(attitude_at, vehicle, solution):
    """Compare an attitude with the rows of a vehicle.csv, at the times of the rows of nav.csv (phase ``smoothed``).

    ``attitude_at`` gives the matrix from the vehicle to ECEF at a time in seconds. Returns two arrays: the errors about
    x, y and z of the vehicle in sigmas, shape (times, 3), and their squares in the whole covariance (NEES, 3 degrees of
    freedom).
    """
    times = np.array([float(row["time_s"]) for row in vehicle])
    sigmas, nees = [], []
    for row in solution:
        time_s = float(row["time_s"])
        i = np.argmin(np.abs(times - time_s))
        if abs(times[i] - time_s) > 1e-4:
            continue
        w, *xyz = (float(vehicle[i][name]) for name in ("qw", "qx", "qy", "qz"))
        truth = np.array(bh.Quaternion(w, *xyz).to_rotation_matrix().to_matrix()).T
        # For a small error, the matrix is 1 plus the cross product with the turn.
        error = truth.T @ attitude_at(time_s)
        turn = np.degrees([error[2, 1] - error[1, 2], error[0, 2] - error[2, 0], error[1, 0] - error[0, 1]]) / 2
        sigmas.append(turn / [float(row[f"sigma_{axis}_deg"]) for axis in "xyz"])
        of = ("xx", "xy", "xz", "yy", "yz", "zz")
        xx, xy, xz, yy, yz, zz = (float(row[f"attitude_cov_{axes}_deg2"]) for axes in of)
        nees.append(turn @ np.linalg.solve([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], turn))
    return np.array(sigmas), np.array(nees)


if __name__ == "__main__":
    path, *date = sys.argv[1:]
    epoch = bh.Epoch.from_datetime(*map(int, date[:5]), float(date[5]), 0.0, bh.TimeSystem.UTC)
    print(fixed_from_vehicle(read(path), epoch))

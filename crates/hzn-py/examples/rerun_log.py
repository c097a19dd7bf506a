"""Pictures and answers as a recording of Rerun, with every stage as a layer that can be switched off.

    pip install hzn-sensor rerun-sdk
    python rerun_log.py flight.rrd && rerun flight.rrd

Rerun also opens the MCAP files of `hzn run`, but without the limb; this program draws it. Frames and pixels need no
change: Rerun's camera frame `RDF` (x right, y down, z forward) is that of hzn, but its pixel centres are at halves.
"""

import sys

import numpy as np
import rerun as rr

import hzn

HALF_PX = 0.5


def log_answer(image, report, time_s):
    """Log one picture with its limb, its points, and the axis with its covariance as an ellipsoid at its tip."""
    rr.set_time("flight", duration=time_s)
    rr.log("camera/image", rr.Image(image) if image.ndim == 3 else rr.Image(image, color_model="L"))
    rr.log("status", rr.TextLog(f"{report.status} {report.detail}".strip()))
    rr.log("camera/image/limb", rr.LineStrips2D([line + HALF_PX for line in report.limb], colors=[255, 215, 0]))
    rr.log("camera/image/inliers", rr.Points2D(report.inliers + HALF_PX, colors=[50, 205, 50], radii=0.8))
    rr.log("camera/image/rejected", rr.Points2D(report.rejected + HALF_PX, colors=[255, 0, 0], radii=0.8))
    if report:
        variances, axes = np.linalg.eigh(report.covariance)
        if np.linalg.det(axes) < 0:
            axes[:, 0] *= -1
        rr.log("camera/axis", rr.Arrows3D(vectors=[report.axis], colors=[255, 215, 0]))
        half_sizes = 3 * np.sqrt(np.maximum(variances, 1e-12))  # rank 2: nothing is said along the axis
        rr.log("camera/axis/three_sigma", rr.Ellipsoids3D(half_sizes=[half_sizes], centers=[report.axis], quaternions=[turn(axes)]))
        rr.log("plots/sigma_max_deg", rr.Scalars(report.sigma_max_deg))
        if report.altitude_est_km is not None:
            rr.log("plots/altitude_est_km", rr.Scalars(report.altitude_est_km))


def turn(axes):
    """Return the quaternion (x, y, z, w) of a rotation matrix, by the eigenvector of the largest eigenvalue."""
    r = axes
    k = np.array([
        [r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
        [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
        [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], 0],
        [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
    ])  # fmt: skip
    return np.linalg.eigh(k)[1][:, -1]


def record(path, flight, sensor):
    """Process the pictures of a simulated flight into a recording. Return the reports."""
    rr.init("hzn", spawn=False)
    rr.save(path)
    camera = sensor.camera
    rr.log("camera", rr.ViewCoordinates.RDF, static=True)
    rr.log("camera/image", rr.Pinhole(image_from_camera=camera.matrix, resolution=[camera.width, camera.height]), static=True)
    reports = []
    for number, frame in enumerate(flight):
        report = sensor.process(frame.image, **frame.known, detail=True)
        log_answer(frame.image, report, float(number))
        reports.append(report)
    rr.disconnect()
    return reports


def main():
    flight = hzn.simulate("leo-infrared", frames=20)
    reports = record(sys.argv[1] if len(sys.argv) > 1 else "flight.rrd", flight, flight.sensor)
    print(f"{sum(r.ok for r in reports)} of {len(reports)} pictures answered")


if __name__ == "__main__":
    main()

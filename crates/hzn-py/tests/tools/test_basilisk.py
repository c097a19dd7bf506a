"""The same limb points through `hzn.locate` and through Basilisk's `horizonOpNav`.

Basilisk's vector points from the body to the camera, its principal point is the integer half of the resolution, its
radii are the equatorial and the polar one, and its body axes are those of the inertial frame. Basilisk fits by plain
least squares; it has no other method and no rejection of outliers.

The covariances differ by definition. The solution weighs all points alike. hzn gives the covariance of that solution;
Basilisk gives that of a solution with the best weights, which it does not compute. NumPy computes both from the same
points, and each program must agree with its own.
"""

import numpy as np
import pytest
from Basilisk.architecture import astroConstants, messaging
from Basilisk.fswAlgorithms import horizonOpNav

import hzn

SIZE = 1024
CENTRE = SIZE // 2
FOV_RAD = np.radians(30)
FOCAL_PX = SIZE / 2 / np.tan(FOV_RAD / 2)
SIGMA_PX = 0.3
CAMERA = hzn.Camera(
    width=SIZE, height=SIZE, model="pinhole", fx_px=FOCAL_PX, fy_px=FOCAL_PX, cx_px=CENTRE, cy_px=CENTRE
)

EARTH = (astroConstants.REQ_EARTH, astroConstants.RP_EARTH)
MARS = (astroConstants.REQ_MARS, astroConstants.RP_MARS)
JUPITER = (astroConstants.REQ_JUPITER, astroConstants.REQ_JUPITER)  # Basilisk's Jupiter is a sphere.
# Name, Basilisk's number, equatorial and polar radius, distance in radii, visible arc in degrees.
CASES = [
    ("Earth, whole", 1, EARTH, 6.0, 360.0),
    ("Earth, half", 1, EARTH, 6.0, 180.0),
    ("Mars, whole", 2, MARS, 10.0, 360.0),
    ("Mars, 120 deg", 2, MARS, 6.0, 120.0),
    ("Jupiter, half", 3, JUPITER, 8.0, 180.0),
]
NAMES = [case[0] for case in CASES]


def rotation(w, x, y, z):
    """Return the matrix of a unit quaternion."""
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


class Scene:
    """Noisy points on the limb of a body, with the truth."""

    def __init__(self, case, outliers=0.0, points=600):
        self.name, self.planet, (equator, pole), distance, arc_deg = case
        rng = np.random.default_rng(NAMES.index(self.name))
        self.radii_km = [equator, equator, pole]
        self.attitude = rng.normal(size=4)
        self.attitude *= np.sign(self.attitude[0]) / np.linalg.norm(self.attitude)
        self.truth_km = np.array([0.05, -0.03, 1.0]) * distance * equator
        # In the scaled space of the body the limb is a circle.
        scale = np.diag(1 / np.array(self.radii_km)) @ rotation(*self.attitude)
        centre = scale @ self.truth_km
        axis = centre / np.linalg.norm(centre)
        first = np.linalg.svd(axis[None])[2][1]
        second = np.cross(axis, first)
        sin = 1 / np.linalg.norm(centre)
        turn = np.radians(rng.uniform(0, 360) + np.linspace(0, arc_deg, points, endpoint=False))[:, None]
        rays = np.sqrt(1 - sin * sin) * axis + sin * (np.cos(turn) * first + np.sin(turn) * second)
        rays = np.linalg.solve(scale, rays.T).T
        self.points = FOCAL_PX * rays[:, :2] / rays[:, 2:] + CENTRE + rng.normal(0, SIGMA_PX, (points, 2))
        # Outliers lie inside the disc, as points on a terminator or on clouds do.
        wrong = rng.random(points) < outliers
        inwards = FOCAL_PX * self.truth_km[:2] / self.truth_km[2] + CENTRE - self.points
        inwards *= rng.uniform(3, 30, (points, 1)) / np.linalg.norm(inwards, axis=1, keepdims=True)
        self.points += wrong[:, None] * inwards

    def locate(self, method):
        """Return position and covariance by hzn."""
        return hzn.locate(
            self.points,
            camera=CAMERA,
            radii_km=self.radii_km,
            attitude=self.attitude,
            method=method,
            sigma_px=SIGMA_PX,
        )

    def basilisk(self):
        """Return position and covariance by Basilisk, from the camera to the body."""
        limb = messaging.OpNavLimbMsgPayload()
        limb.valid, limb.numLimbPoints, limb.planetIds = 1, len(self.points), self.planet
        limb.limbPoints = self.points.ravel().tolist()
        camera = messaging.CameraConfigMsgPayload()
        camera.fieldOfView, camera.resolution, camera.sigma_CB = FOV_RAD, [SIZE, SIZE], [0.0, 0.0, 0.0]
        attitude = messaging.NavAttMsgPayload()
        attitude.sigma_BN = (self.attitude[1:] / (1 + self.attitude[0])).tolist()
        written = [
            messaging.OpNavLimbMsg().write(limb),
            messaging.CameraConfigMsg().write(camera),
            messaging.NavAttMsg().write(attitude),
        ]
        module = horizonOpNav.horizonOpNav()
        module.planetTarget = self.planet
        # Basilisk's sigma is this factor times the width divided by the number of points.
        module.noiseSF = SIGMA_PX * len(self.points) / SIZE
        module.limbInMsg.subscribeTo(written[0])
        module.cameraConfigInMsg.subscribeTo(written[1])
        module.attInMsg.subscribeTo(written[2])
        module.SelfInit()
        module.Reset(0)
        module.UpdateState(0)
        found = module.opNavOutMsg.read()
        assert found.valid == 1
        return -np.array(found.r_BN_C) / 1e3, np.reshape(found.covar_C, (3, 3)) / 1e6

    def covariances(self):
        """Return the covariance of least squares with equal weights, and with the best ones."""
        scale = np.diag(1 / np.array(self.radii_km)) @ rotation(*self.attitude)
        rays = np.c_[(self.points - CENTRE) / FOCAL_PX, np.ones(len(self.points))] @ scale.T
        length = np.linalg.norm(rays, axis=1)[:, None]
        rows = rays / length
        n = np.linalg.lstsq(rows, np.ones(len(rows)), rcond=None)[0]
        gradient = (n - (rows @ n)[:, None] * rows) / length @ scale[:, :2] * SIGMA_PX / FOCAL_PX
        variance = (gradient**2).sum(1)[:, None]
        kappa = n @ n - 1
        by_n = np.linalg.inv(scale) @ (np.eye(3) - np.outer(n, n) / kappa) / np.sqrt(kappa)
        solve = by_n @ np.linalg.inv(rows.T @ rows)
        equal = solve @ (rows.T @ (rows * variance)) @ solve.T
        best = by_n @ np.linalg.inv(rows.T @ (rows / variance)) @ by_n.T
        return equal, best

    def chi2(self, position_km, covariance_km2):
        """Return the squared error in sigmas, with three degrees of freedom."""
        off = position_km - self.truth_km
        return off @ np.linalg.solve(covariance_km2, off)


def difference(found, reference):
    return np.linalg.norm(found - reference) / np.linalg.norm(reference)


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_the_plain_solution_is_basilisks(case):
    scene = Scene(case)
    position, covariance = scene.locate("least-squares")
    theirs, their_covariance = scene.basilisk()
    equal, best = scene.covariances()
    assert difference(position, theirs) < 1e-10
    assert difference(covariance, equal) < 1e-9
    assert difference(their_covariance, best) < 1e-9
    assert difference(covariance, their_covariance) < 1e-3


def test_outliers_move_the_robust_fit_least(capsys):
    """Print the errors of each method on the same points, without outliers and with 20 % of them."""
    lines = []
    for outliers in (0.0, 0.2):
        for case in CASES:
            scene = Scene(case, outliers)
            basilisk = scene.basilisk()
            answers = [basilisk, *(scene.locate(m) for m in ("least-squares", "gauss-newton", "robust"))]
            errors = [np.linalg.norm(position - scene.truth_km) for position, _ in answers]
            sigmas = [np.sqrt(scene.chi2(*answer)) for answer in answers]
            cells = [f"{km:9.1f} km {sigma:7.1f} s" for km, sigma in zip(errors, sigmas, strict=True)]
            lines.append(f"{case[0]:14} {outliers:4.0%} " + " ".join(cells))
            assert difference(answers[1][0], basilisk[0]) < 1e-10
            # 16.3 is the 99.9 % point of chi-square with three degrees of freedom.
            assert sigmas[3] ** 2 < 16.3, (case[0], sigmas)
            if outliers:
                assert errors[3] < 0.1 * errors[0], (case[0], errors)
    with capsys.disabled():
        print("\nerror of the position (s: in its sigmas, 3 degrees of freedom)")
        print(f"{'limb':14} bad  {'Basilisk':>20} {'least-squares':>20} {'gauss-newton':>20} {'robust':>20}")
        print("\n".join(lines))

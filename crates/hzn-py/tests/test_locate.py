"""Tests of `hzn.locate`. The folder `basilisk` compares its positions with those of another program."""

import pickle

import numpy as np
import pytest

import hzn

CAMERA = hzn.Camera(width=1000, height=1000, model="pinhole", fx_px=2000.0, fy_px=2000.0, cx_px=499.5, cy_px=499.5)
RADII_KM = [257.0, 251.0, 248.0]
ATTITUDE = [0.5, 0.5, -0.5, 0.5]
# From the camera to the axes of the body: the rotation of this quaternion.
TO_BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
TRUTH_KM = np.array([60.0, -40.0, 1500.0])
METHODS = ["gauss-newton", "least-squares", "robust"]


def limb(arc_deg=360.0, points=400, sigma_px=0.0):
    """Return points on the limb of a moon with three different radii."""
    scale = TO_BODY / np.array(RADII_KM)[:, None]
    centre = scale @ TRUTH_KM
    sin = 1 / np.linalg.norm(centre)
    axis = centre * sin
    first = np.linalg.svd(axis[None])[2][1]
    turn = np.radians(np.linspace(0, arc_deg, points, endpoint=False))[:, None]
    around = np.cos(turn) * first + np.sin(turn) * np.cross(axis, first)
    rays = np.linalg.solve(scale, (np.sqrt(1 - sin * sin) * axis + sin * around).T).T
    return CAMERA.project(rays) + np.random.default_rng(4).normal(0, 1, (points, 2)) * sigma_px


def locate(points, **keys):
    keys = {"camera": CAMERA, "radii_km": RADII_KM, "attitude": ATTITUDE, **keys}
    return hzn.locate(points, **keys)


@pytest.mark.parametrize("method", METHODS)
def test_exact_points_give_the_position(method):
    for arc_deg in (360.0, 120.0):
        position, covariance = locate(limb(arc_deg), method=method)
        assert np.allclose(position, TRUTH_KM, rtol=0, atol=1e-5)
        assert np.allclose(covariance, covariance.T) and np.all(np.linalg.eigvalsh(covariance) > 0)


@pytest.mark.parametrize("method", METHODS)
def test_noisy_points_are_within_their_covariance(method):
    position, covariance = locate(limb(sigma_px=0.2), method=method, sigma_px=0.2)
    off = position - TRUTH_KM
    assert off @ np.linalg.solve(covariance, off) < 16.3
    assert np.linalg.norm(off) > 1e-3


def test_the_covariance_follows_sigma():
    one, two = (locate(limb(), sigma_px=sigma)[1] for sigma in (0.1, 0.2))
    assert np.allclose(two, 4 * one, rtol=1e-6)


def test_points_that_determine_nothing_give_none():
    line = np.c_[np.linspace(100, 900, 50), np.full(50, 500.0)]
    for method in METHODS:
        assert locate(line[:2], method=method) is None
        assert locate(np.zeros((0, 2)), method=method) is None
    assert locate(line) is None and locate(line, method="robust") is None


@pytest.mark.parametrize(
    ("keys", "what"),
    [
        ({"radii_km": [257.0, -1.0, 248.0]}, "radii_km"),
        ({"attitude": [1.0, 1.0, 0.0, 0.0]}, "attitude"),
        ({"method": "best"}, "method: \"best\""),
        ({"sigma_px": 0.0}, "sigma_px"),
        ({"lit": [0.0, 0.0, 0.0]}, "lit"),
    ],
)
def test_what_is_refused_is_named(keys, what):
    with pytest.raises(hzn.ConfigError, match=what):
        locate(limb(), **keys)


def test_points_that_the_lens_does_not_see_are_refused():
    points = limb()
    points[7, 1] = np.nan
    with pytest.raises(hzn.ImageError, match="row 7"):
        locate(points)
    with pytest.raises(hzn.ImageError, match=r"\(n, 2\)"):
        locate(points[:, :1])


def test_the_limb_in_a_report_is_that_of_the_ellipsoid():
    """The drawn limb of Jupiter is the limb of the ellipsoid at the reported position, also after pickle."""
    flight = hzn.simulate("jupiter", frames=8)
    sensor = hzn.Sensor(camera=flight.parameters["camera"], body={"kind": "jupiter"})
    camera = sensor.camera
    drawn = 0
    for frame in flight:
        report = sensor.process(frame.image, **frame.known)
        if report.position_km is None:
            continue
        w, x, y, z = frame.known["attitude"]
        to_body = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])
        limb_km = np.array([71492.0, 71492.0, 66854.0]) + 80.0
        scale = to_body / limb_km[:, None]
        centre = scale @ report.position_km
        points = np.concatenate(report.limb)
        rays = camera.unproject(points) @ scale.T
        cos = rays @ centre / np.linalg.norm(rays, axis=1) / np.linalg.norm(centre)
        off_px = (np.arccos(cos) - np.arcsin(1 / np.linalg.norm(centre))) * camera.matrix[0, 0]
        # A circle of the same size leaves the ellipse by 1.5 % of its radius.
        radius_px = camera.matrix[0, 0] / np.linalg.norm(centre)
        assert np.abs(off_px).max() < min(0.1, 1e-3 * radius_px)
        again = pickle.loads(pickle.dumps(report))
        assert all(np.allclose(a, b) for a, b in zip(again.limb, report.limb, strict=True))
        drawn += 1
    assert drawn > 0

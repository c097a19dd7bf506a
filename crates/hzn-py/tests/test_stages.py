"""Tests of the single stages, and of a stage that is replaced."""

import importlib.metadata
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import hzn
from conftest import CAMERA, limb

TRUTH = np.array([0.0, np.sin(np.radians(68)), np.cos(np.radians(68))])


def degrees(a, b):
    return np.degrees(np.arccos(np.clip(a @ b, -1, 1)))


def test_the_stages_are_the_pipeline(sensor):
    """The stages give every number of the report to the last bit, and the fused answer to the last few bits."""
    image = limb()
    report = sensor.process(image, altitude_km=401.0, detail=True)
    expected = sensor.expect(altitude_km=401.0)
    level = hzn.threshold.level(sensor, image, expected)
    assert level == report.level
    borders = hzn.contour.find(sensor, image, level, expected)
    assert np.array_equal(borders[0], report.edges[0])
    rays = hzn.contour.points(sensor, image, level, borders[0])
    assert len(rays) == report.edge_points
    assert np.allclose(np.linalg.norm(rays.directions, axis=1), 1.0) and set(np.abs(rays.lit).sum(1)) == {1.0}
    start = hzn.consensus.keep(sensor, rays, expected)
    fit = hzn.fit.cone(sensor, rays, start, expected)
    assert (fit.rms_px, fit.inliers) == (report.rms_px, len(report.inliers)) and start.draws > 0
    assert np.array_equal(rays.points[rays.weights > 0], report.inliers)
    fused = hzn.covariance.fuse(sensor, rays, fit, expected)
    assert np.allclose(fused.axis, report.axis, rtol=0, atol=1e-12)
    assert np.allclose(fused.covariance, report.covariance, rtol=1e-9, atol=1e-15)


def disc(image, u, v, radius_px, brightness):
    """Return the picture with a disc painted into it; its edge is blurred over two pixels."""
    y, x = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    cover = np.clip(0.5 + (radius_px - np.hypot(x - u, y - v)) / 2, 0, 1)
    return np.maximum(image, brightness * cover).astype(np.uint8)


def test_the_stages_of_each_body():
    """With several bodies, each has its own threshold, and the second excludes the points on the limb of the first."""
    camera = dict(CAMERA, fx_px=3000.0, fy_px=3000.0)
    bodies = [
        {"radius_km": 100.0, "altitude_km": 3900.0, "threshold": {"method": "fixed", "level": 60}},
        {"radius_km": 50.0, "altitude_km": 3950.0, "threshold": {"method": "fixed", "level": 90}},
    ]
    bodies = [dict(b, kind="sphere", limb_height_km=0.0, limb_height_sigma_km=1.0) for b in bodies]
    sensor = hzn.Sensor(camera=camera, bodies=bodies)
    image = disc(disc(np.full((240, 320), 20, np.uint8), 90, 120, 75.05, 210), 250, 110, 37.5, 230)
    reports = sensor.process(image, detail=True)
    found = None
    for body, report in enumerate((reports, *reports.others)):
        assert report.ok
        expected = sensor.expect(body=body)
        level = hzn.threshold.level(sensor, image, expected)
        assert level == report.level == (60, 90)[body]
        borders = hzn.contour.find(sensor, image, level, expected)
        # The edges of both discs are found for either body: the search does not stop at the answer.
        assert len(borders) == 2
        answers = []
        for border in borders:
            rays = hzn.contour.points(sensor, image, level, border)
            on_another = 0 if found is None else hzn.consensus.withdraw(sensor, rays, found)
            if 2 * on_another > len(rays):
                continue
            start = hzn.consensus.keep(sensor, rays, expected)
            fit = start and hzn.fit.cone(sensor, rays, start, expected)
            fused = fit and hzn.covariance.fuse(sensor, rays, fit, expected)
            answers.append(fused)
            if fit and (fit.rms_px, fit.inliers) == (report.rms_px, len(report.inliers)):
                assert isinstance(fit, hzn.consensus.Cone) and fit.draws == start.draws
                # The axis of the report was normalised once more.
                assert np.allclose(fused.axis, report.axis, rtol=0, atol=1e-15)
                assert np.array_equal(fused.covariance, report.covariance)
                own = fused
        assert len(answers) == 2 - body
        found = hzn.consensus.Cone(own.axis, own.cos_half_angle)
    with pytest.raises(hzn.ConfigError, match="0 to 1"):
        sensor.expect(body=2)


def test_find_stops_neither_at_the_limb_nor_at_the_limits(sensor):
    image = disc(limb(), 160, 40, 12, 220)
    few = hzn.Sensor(**{**sensor.parameters, "limits": {"max_work": 10_000}})
    found = hzn.contour.find(sensor, image, 110)
    assert len(found) == 2 and all(map(np.array_equal, found, hzn.contour.find(few, image, 110)))
    lit = image >= 110
    for border in found:
        x, y = border.astype(int).T
        assert lit[y, x].all() and (np.abs(np.diff(border, axis=0)).max(axis=1) == 1).all()


def test_other_strides_and_a_round_trip_through_arrays(sensor):
    image = limb()
    level = hzn.threshold.level(sensor, np.asfortranarray(image))
    borders = hzn.contour.find(sensor, np.asfortranarray(image), level)
    assert np.array_equal(borders[0], hzn.contour.find(sensor, image, level)[0])
    there = hzn.contour.points(sensor, image, level, borders[0])
    back = hzn.rays.of(sensor, there.points, there.lit)
    assert np.array_equal(back.directions, there.directions) and np.array_equal(back.lit, there.lit)


def test_every_step_can_be_ones_own(sensor):
    """Threshold, points, consensus and fit are in NumPy, between the stages that stay."""
    image = limb()
    # The points are the crossings of the half level in each column.
    columns = np.arange(0, 320, 2)
    profile = image[:, columns].astype(float) - 110
    rows = np.argmax(profile > 0, axis=0)
    above, below = profile[rows - 1, np.arange(160)], profile[rows, np.arange(160)]
    points = np.column_stack([columns, rows - below / (below - above)])
    points[::10, 1] += 40.0
    rays = hzn.rays.of(sensor, points, np.tile([0.0, 1.0], (160, 1)))
    # The consensus is the known truth.
    start = hzn.consensus.Cone(TRUTH, np.cos(np.radians(70.38)))
    weights = np.ones(160)
    weights[::10] = 0.0
    rays.weights = weights
    fit = hzn.fit.cone(sensor, rays, start)
    assert fit.inliers == 144 and degrees(fit.axis, TRUTH) < 0.1
    # The fit is a plane through the ends of the rays, s . n = 1.
    chosen = rays.directions[weights > 0]
    n = np.linalg.lstsq(chosen, np.ones(len(chosen)), rcond=None)[0]
    rays.weights = weights
    own = hzn.consensus.Cone(n / np.linalg.norm(n), 1 / np.linalg.norm(n))
    fused = hzn.covariance.fuse(sensor, rays, own)
    assert degrees(fused.axis, TRUTH) < 0.1 and np.allclose(fused.covariance @ fused.axis, 0, atol=1e-12)


def test_what_the_stages_refuse(sensor):
    image = limb()
    rays = hzn.rays.of(sensor, [[1.0, 2.0]] * 3, [[0.0, 1.0]] * 3)
    for wrong in ([1.0], [2.0, 0.0, 0.0], [np.nan] * 3, "x"):
        with pytest.raises(hzn.ConfigError, match="weights"):
            rays.weights = wrong
    with pytest.raises(hzn.ImageError, match="outside"):
        hzn.contour.points(sensor, image, 100, [[500.0, 0.0]])
    with pytest.raises(hzn.ImageError, match="lit"):
        hzn.rays.of(sensor, [[1.0, 2.0]], [[0.0, 1.0]] * 2)
    with pytest.raises(hzn.HznError, match="no-limb"):
        hzn.threshold.level(sensor, np.full_like(image, 100))
    with pytest.raises(hzn.ConfigError, match="cos_half_angle"):
        hzn.consensus.Cone([0.0, 0.0, 1.0], 2.0)
    with pytest.raises(hzn.ConfigError, match="flight"):
        hzn.threshold.level(hzn.Sensor(**sensor.parameters, flight=True), image)
    assert hzn.consensus.keep(sensor, rays) is None or hzn.fit.cone(sensor, rays, hzn.consensus.keep(sensor, rays)) is None


def test_the_distribution_is_hzn_sensor():
    metadata = importlib.metadata.metadata("hzn-sensor")
    assert metadata["Name"] == "hzn-sensor" and metadata["Version"] == hzn.__version__
    # On the Python index `hzn` belongs to another project, so no page may say to install it.
    root = Path(__file__).parents[3]
    pages = [*root.glob("*.md"), *root.glob("book/**/*.md"), *root.glob("crates/hzn-py/python/**/*.py")]
    assert len(pages) > 20
    for page in pages:
        assert not re.search(r"pip install ['\"]?hzn(?!-sensor)\b", page.read_text()), page

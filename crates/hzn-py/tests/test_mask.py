"""`Report.mask`: what hides the stars in a picture, as `hzn run --mask-pictures` writes it."""

import pickle
import subprocess

import cv2
import numpy as np
import pytest

import hzn
from conftest import CAMERA, PARAMETERS, limb


def test_the_masks_are_those_of_hzn_run(folder, hzn_program):
    masks = folder / "masks"
    run = [hzn_program, "run", "-q", folder, "-o", folder / "a.csv", "--mask-pictures", masks, "--mask-margin-deg", "0.5"]
    subprocess.run(run, check=True)
    sensor = hzn.Sensor.from_toml(folder / "sensor.toml")
    reports = list(sensor.process_many(str(folder / "*.pgm")))
    assert len(reports) == 50 and all(reports)
    for report in reports:
        written = cv2.imread(str(masks / f"{report.file}.png"), cv2.IMREAD_UNCHANGED)
        mask = report.mask(0.5)
        assert mask.dtype == np.uint8 and np.array_equal(mask, written), report.file
        assert (report.mask() <= mask).all() and set(np.unique(mask)) == {0, 255}
    # An array that is processed alone has the same mask as its file.
    assert np.array_equal(sensor.process(limb(7)).mask(0.5), reports[7].mask(0.5))


def test_bright_pixels_of_the_body_are_covered():
    image = limb()
    mask = hzn.Sensor(**PARAMETERS).process(image).mask()
    assert (mask[image > 40] == 255).all()
    # The limb is known to a part of a pixel, so the sky begins soon above it.
    first = np.argmax(mask > 0, axis=0) - np.argmax(image > 40, axis=0)
    assert (first <= 0).all() and (first > -40).all(), first.min()


def test_a_known_sun_is_in_the_mask():
    sensor = hzn.Sensor(**PARAMETERS)
    dark, bright = (sensor.process(limb(), **known).mask() for known in ({}, {"sun": [-0.4, -0.3, 1.0]}))
    u, v = round(159.5 - 0.4 * 300), round(119.5 - 0.3 * 300)
    assert dark[v, u] == 0 and bright[v, u] == 255
    ys, xs = np.nonzero(bright > dark)
    # The Sun's half-angle is 0.27 degrees: 1.4 px in the middle, more at the border of a pinhole picture.
    assert 4 <= len(xs) <= 30 and abs(xs - u).max() <= 4 and abs(ys - v).max() <= 4


def test_a_body_whose_direction_is_unknown_is_named():
    sensor = hzn.Sensor(camera=CAMERA, bodies=[{"kind": "earth-sphere", "altitude_km": 400.0}, {"kind": "sun"}])
    report = sensor.process(limb())
    with pytest.warns(UserWarning, match="the mask is without sun"):
        mask = report.mask()
    assert np.array_equal(mask, hzn.Sensor(**PARAMETERS).process(limb()).mask())


def test_without_an_answer_or_its_picture_there_is_no_mask(recording):
    sensor = hzn.Sensor(**PARAMETERS)
    assert sensor.process(np.zeros((240, 320), np.uint8)).mask() is None
    report = sensor.process(limb())
    with pytest.raises(hzn.HznError, match="not from a pickle"):
        pickle.loads(pickle.dumps(report)).mask()
    with pytest.raises(hzn.ConfigError, match="margin_deg"):
        report.mask(-1.0)
    with pytest.raises(hzn.ConfigError, match="margin_deg"):
        report.mask(float("nan"))

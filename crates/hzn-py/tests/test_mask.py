"""`Report.mask`: what hides the stars in a picture."""

import pickle

import numpy as np
import pytest

import hzn
from conftest import PARAMETERS, limb

SENSOR = hzn.Sensor(**PARAMETERS)


def test_the_mask_covers_the_body_and_little_more():
    report = SENSOR.process(limb())
    mask = report.mask()
    assert (mask.shape, mask.dtype) == ((240, 320), np.bool_)
    body = limb() > 110
    assert mask[body].all()
    # At most four pixels of sky next to the limb.
    assert 0 < (mask & ~body).sum() < 4 * 320
    # Two degrees are 10.5 pixels.
    wider = report.mask(margin_deg=2.0)
    assert wider[mask].all() and abs((wider.sum() - mask.sum()) / 320 - 10.5) < 1
    with pytest.raises(hzn.ConfigError, match="margin_deg: -1 is refused"):
        report.mask(margin_deg=-1)


def test_a_known_sun_is_in_the_mask():
    # The direction of the pixel in column 60, row 20.
    sun = [(60 - 159.5) / 300, (20 - 119.5) / 300, 1.0]
    plain, with_sun = SENSOR.process(limb()).mask(), SENSOR.process(limb(), sun=sun).mask()
    rows, columns = np.nonzero(with_sun & ~plain)
    # Its disc, with a half-angle of 0.27 degrees, has a radius of less than two pixels there.
    assert (np.abs(rows - 20) <= 2).all() and (np.abs(columns - 60) <= 2).all() and 9 <= len(rows) <= 25


def test_without_an_answer_there_is_no_mask():
    dark = SENSOR.process(np.zeros((240, 320), np.uint8))
    with pytest.raises(hzn.HznError, match=r"the picture has no answer \("):
        dark.mask()
    many = list(SENSOR.process_many([limb()]))
    assert many[0].mask().any()
    with pytest.raises(hzn.HznError, match="only the report of Sensor.process"):
        pickle.loads(pickle.dumps(SENSOR.process(limb()))).mask()

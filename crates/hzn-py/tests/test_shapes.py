"""A value of a wrong kind in the parameters: the message names its key, what it is, and what to write."""

from fractions import Fraction

import numpy as np
import pytest

import hzn
from conftest import CAMERA, PARAMETERS, limb


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        (dict(bodies={}), 'bodies: is a dict; write a list of dicts, one for each body, for example bodies=[{"kind": '),
        (dict(bodies={"earth": {}}), "bodies: is a dict; write a list of dicts"),
        (dict(bodies=["moon"]), '[[bodies]] 1: is the text "moon"; write a dict, for example {"kind": "moon"}'),
        (dict(body=[{"kind": "moon"}]), 'body: is a list; write a dict, for example body={"kind": "earth"}'),
        (dict(body="moon"), 'body: is the text "moon"; write a dict, for example body={"kind": "moon"}'),
        (dict(camera=[]), 'camera: is a list; write a dict, for example camera={"width": 1920, "height": 1080, '),
        (dict(camera=3), "camera: is a number; write a dict"),
        (dict(camera="cam.yaml"), 'camera: is the text "cam.yaml"; write a dict, for example camera={"file": '),
        (dict(gates=[1]), "gates: is a list; write a dict, for example gates={"),
        (dict(mount=[1, 0, 0, 0]), 'mount: is a list; write a dict, for example mount={"q_vehicle_from_camera_wxyz": [1'),
        (dict(mask={"polygons_px": {}}), "[mask] polygons_px: is a dict; write a list of polygons"),
        (dict(mask={"polygons_px": [1, 2]}), "[mask] polygons_px: has a number as item 1; write a list of polygons"),
        (dict(mask=np.zeros((240, 320))), "mask: is a list; write a dict, for example mask={\"polygons_px\": [[["),
        (dict(gates={"altitude_limits_km": 300}), "[gates] altitude_limits_km: is a number; write a list of numbers"),
        (dict(gates={"altitude_limits_km": [300]}), "[gates] altitude_limits_km: has 1 values; 2 are expected"),
        (dict(camera=CAMERA | {"width": [320]}), '[camera] width: is a list; write a whole number, for example "width": '),
        (dict(input={"invert": []}), '[input] invert: is a list; write True or False, for example "invert": False'),
        (dict(camera=CAMERA | {"fx_px": Fraction(3, 2)}), "camera.fx_px: an object of the class Fraction is no value"),
    ],
)
def test_a_wrong_shape_is_named_with_what_to_write(sections, message):
    with pytest.raises(hzn.ConfigError) as refused:
        hzn.Sensor(**{"camera": CAMERA} | sections)
    assert message in str(refused.value)
    # The text of the parameters is never seen, so its lines say nothing; nor do the terms of Rust.
    assert str(refused.value).startswith("parameters: ")
    assert not any(word in str(refused.value) for word in ("sequence", "struct", "map,", "table"))
    sensor = hzn.Sensor(**PARAMETERS)
    with pytest.raises(hzn.ConfigError) as again:
        sensor.parameters = {"camera": CAMERA} | sections
    assert str(again.value) == str(refused.value)


def test_a_path_is_a_value(tmp_path):
    lines = ["%YAML:1.0", "image_width: 320", "image_height: 240", "distortion_model: plumb_bob"]
    lines += ["camera_matrix: {rows: 3, cols: 3, data: [300.0, 0, 159.5, 0, 300.0, 119.5, 0, 0, 1]}"]
    lines += ["distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}"]
    camera = tmp_path / "camera.yaml"
    camera.write_text("\n".join(lines) + "\n")
    sensor = hzn.Sensor(camera={"file": camera}, body=PARAMETERS["body"])
    assert sensor == hzn.Sensor(camera={"file": str(camera)}, body=PARAMETERS["body"])
    assert sensor.process(limb()).ok

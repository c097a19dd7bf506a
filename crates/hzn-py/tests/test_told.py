"""What looks like a mistake is told, and what cannot be used says what would help."""

import importlib.metadata

import cv2
import numpy as np
import pytest

import hzn
from conftest import CAMERA, PARAMETERS, limb

SENSOR = hzn.Sensor(**PARAMETERS)


def test_a_picture_by_its_path(tmp_path):
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), limb())
    for given in (path, str(path)):
        report = SENSOR.process(given)
        assert report.file == "a.png"
        np.testing.assert_array_equal(report.axis, SENSOR.process(limb()).axis)
    with pytest.raises(hzn.ImageError, match="b.png: no such file"):
        SENSOR.process(tmp_path / "b.png")
    # OpenCV returns None for a file that it cannot read.
    with pytest.raises(hzn.ImageError, match="None: cv2.imread returns None"):
        SENSOR.process(cv2.imread(str(tmp_path / "b.png")))


def test_reports_of_arrays_are_numbered():
    known = {"altitude_km": 400.0}
    assert [r.index for r in SENSOR.process_many((limb(), known) for _ in range(5))] == [0, 1, 2, 3, 4]
    assert [r.index for r in SENSOR.process_many([limb()] * 3, jobs=2)] == [0, 1, 2]
    with pytest.raises(hzn.ImageError, match="the picture is None"):
        list(SENSOR.process_many([None, limb()]))


def test_metres_and_unused_values_are_told():
    with pytest.warns(UserWarning, match="altitude_km is 400000, .*is it in metres?"):
        SENSOR.process(limb(), altitude_km=400_000.0)
    earth = hzn.Sensor(camera=CAMERA, body={"kind": "earth", "altitude_km": 400.0})
    with pytest.warns(UserWarning, match="nothing uses attitude: add position_km"):
        earth.process(limb(), attitude=[1, 0, 0, 0])
    with pytest.warns(UserWarning, match="are the values in metres?"):
        earth.process(limb(), position_km=[6_778_000.0, 0.0, 0.0])


def test_width_and_height_that_are_swapped_are_told():
    matrix = [[300.0, 0, 319.5], [0, 300.0, 119.5], [0, 0, 1]]
    with pytest.warns(UserWarning, match="width and height, swapped"):
        hzn.Camera.from_opencv(matrix, size=(240, 640))


def test_arrays_that_would_be_misread_are_refused():
    picture = limb()
    with pytest.raises(hzn.ImageError, match="masked"):
        SENSOR.process(np.ma.masked_less(picture, 30))
    report = SENSOR.process(picture)
    with pytest.raises(hzn.ImageError, match="but the report is of a picture of 320 x 240 px"):
        hzn.overlay(picture[:100], report)
    with pytest.raises(TypeError, match="Sensor.from_toml"):
        hzn.Sensor("sensor.toml")
    with pytest.raises((TypeError, ValueError), match="attitude"):
        SENSOR.process(picture, attitude=[0.1, 0.2, 0.3])


class Table:
    """What `evaluate` sees of a data frame."""

    def __init__(self, rows):
        self.rows = rows
        self.columns = list(rows[0])

    def __iter__(self):
        return iter(self.columns)

    def to_dict(self, _orient):
        return self.rows


def test_tables_for_evaluate():
    # An ellipsoid has no noise to measure, so that only the two pictures are rendered.
    flight = hzn.simulate("jupiter", frames=2)
    reports = [flight.sensor.process(frame.image, **frame.known) for frame in flight]
    rows = [row for frame in flight for row in frame.truth]
    gaps = [{name: float("nan") if value is None else value for name, value in row.items()} for row in rows]
    assert hzn.evaluate(reports, Table(gaps)) == hzn.evaluate(reports, rows)
    with pytest.raises(hzn.ConfigError, match="results: a table is refused"):
        hzn.evaluate(Table([reports[0].to_dict()]), rows)
    with pytest.raises(hzn.ConfigError, match="results: item 0 is a str, not a Report"):
        hzn.evaluate(["a.png"], rows)


def test_a_report_is_true_if_there_is_an_answer():
    assert SENSOR.process(limb())
    assert not SENSOR.process(np.zeros((240, 320), np.uint8))


def test_a_notebook_stays_small():
    camera = dict(CAMERA, width=1920, height=1080, cx_px=959.5, cy_px=539.5)
    noise = np.random.default_rng(1).integers(0, 255, (1080, 1920), np.uint8)
    report = hzn.Sensor(camera=camera, body={"altitude_km": 400.0}).process(noise)
    assert len(report._repr_html_()) < 400_000


def test_the_wheel_has_the_licence_texts():
    files = [path for path in importlib.metadata.files("hzn-sensor") if ".dist-info" in str(path)]
    lengths = {path.name: len(path.read_text()) for path in files if path.name.startswith("LICENSE-")}
    # A link that was packed as a file would have a few bytes.
    assert lengths.keys() >= {"LICENSE-MIT", "LICENSE-APACHE"} and min(lengths.values()) > 1000, lengths

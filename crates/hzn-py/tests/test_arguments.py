"""Arguments of a wrong kind, as a newcomer writes them: the message says what is expected, and what to write."""

import datetime
import math

import numpy as np
import pandas
import pytest

import hzn
from conftest import CAMERA, PARAMETERS, limb

SENSOR = hzn.Sensor(**PARAMETERS)
MATRIX = [[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]]


@pytest.mark.parametrize(
    ("time", "message"),
    [
        (datetime.datetime(2020, 11, 20, tzinfo=datetime.UTC), r"not datetime: write time.timestamp\(\)"),
        (pandas.Timestamp("2020-11-20"), r"not Timestamp: write time.timestamp\(\)"),
        (np.datetime64("2020-11-20"), r"not datetime64: write time.astype\(\"datetime64\[ns\]\"\).astype\(float\) \* 1e-9"),
        (np.datetime64(1_605_830_400_000_000_000, "ns"), "not datetime64"),
        ("noon", "a number of seconds is expected, not str"),
    ],
)
def test_a_date_is_no_number_of_seconds(time, message):
    with pytest.raises(TypeError, match=message) as refused:
        SENSOR.process(limb(), time_s=time)
    assert "time_s" in "".join(refused.value.__notes__)
    rig = hzn.Rig([SENSOR], mounts=[[1, 0, 0, 0]])
    for call in (
        lambda: rig.process({"head0": limb()}, time_s=time),
        lambda: list(SENSOR.process_many([(limb(), {"time_s": time})])),
        lambda: hzn.render(SENSOR, [7000, 0, 0], [1, 0, 0, 0], time),
    ):
        with pytest.raises(TypeError, match=message):
            call()


def test_the_seconds_of_a_date():
    """What the messages tell to write gives the same time."""
    dates = [
        datetime.datetime(2020, 11, 20, 6, tzinfo=datetime.UTC).timestamp(),
        np.datetime64("2020-11-20T06:00").astype("datetime64[ns]").astype(float) * 1e-9,
    ]
    assert [SENSOR.process(limb(), time_s=date).time_s for date in dates] == [1_605_852_000.0] * 2
    assert SENSOR.process(limb(), time_s=math.nan).ok


def test_a_rotation_matrix_is_no_quaternion():
    what = r"4 numbers are expected, not an array of shape \(3, 3\): a quaternion is \(w, x, y, z\)"
    with pytest.raises(TypeError, match=what):
        SENSOR.process(limb(), position_km=[7000, 0, 0], attitude=np.eye(3), attitude_sigma_deg=1.0)
    with pytest.raises(TypeError, match=what):
        hzn.Rig([SENSOR], mounts=[np.eye(3)])
    with pytest.raises(TypeError, match="3 numbers are expected, not str"):
        SENSOR.process(limb(), position_km="7000,0,0")


def test_a_size_is_a_pair():
    expected = hzn.Sensor.start(size=(320, 240), fov_deg=56)
    for size in ([320, 240], np.array([320, 240])):
        assert hzn.Sensor.start(size=size, fov_deg=56) == expected
        assert hzn.Camera.from_opencv(MATRIX, size=size) == hzn.Camera.from_opencv(MATRIX, size=(320, 240))
    for size in ("320x240", (320, 240, 3), (320.5, 240), 320, (-1, 240)):
        with pytest.raises(TypeError, match=r"two whole numbers \(width, height\) are expected, not .*\n.*'size'"):
            hzn.Sensor.start(size=size, fov_deg=56)
    with pytest.raises(hzn.ConfigError, match=r"size: \(70000, 240\) is refused"):
        hzn.Camera.from_opencv(MATRIX, size=(70_000, 240))


def test_a_camera_matrix_has_three_rows():
    for matrix in ([300, 300, 159.5, 119.5], np.eye(2), np.zeros((3, 4)), np.zeros((9, 3))):
        with pytest.raises(hzn.ConfigError, match=r"camera matrix: three rows of three numbers are expected: \[\[fx, 0"):
            hzn.Camera.from_opencv(matrix, size=(320, 240))


def test_a_start_takes_paths():
    with pytest.raises(TypeError, match=r"a path or a list of paths is expected, not ndarray; .*size=\(width, height\)"):
        hzn.Sensor.start(limb(), fov_deg=56)
    with pytest.raises(TypeError, match="a path or a list of paths is expected, not list"):
        hzn.Sensor.start([limb()], fov_deg=56)


def test_the_heads_of_a_rig():
    two = [[1, 0, 0, 0], [0, 0, 1, 0]]
    for sensors, mounts in [({"a": SENSOR, "b": SENSOR}, two), ([SENSOR] * 2, {"a": two[0], "b": two[1]})]:
        with pytest.raises(TypeError, match="a list is expected, not dict: give one item for each head"):
            hzn.Rig(sensors, mounts=mounts)
    rig = hzn.Rig([SENSOR] * 2, mounts=two)
    what = 'a dict with the picture of each head is expected, for example {"head0": image}, not '
    with pytest.raises(TypeError, match=what + "list"):
        rig.process([limb(), limb()])
    with pytest.raises(TypeError, match=what + "list"):
        list(rig.process_many([[limb(), limb()]]))
    with pytest.raises(TypeError, match=what + "str"):
        list(rig.process_many({"head0": [limb()]}))


def test_many_pictures_are_several():
    colour = np.dstack([limb()] * 3)
    for one in (limb(), colour):
        with pytest.raises(hzn.ImageError, match=r"this array is one picture, and several are expected; write \[image\]"):
            list(SENSOR.process_many(one))
    assert [report.ok for report in SENSOR.process_many(np.stack([limb()] * 2))] == [True, True]
    assert [report.ok for report in SENSOR.process_many([colour])] == [True]
    with pytest.raises(TypeError, match='a pair has a picture and a dict such as {"altitude_km": 400.0}, not float'):
        list(SENSOR.process_many([(limb(), 400.0)]))


def test_a_scene_is_a_name_or_a_dict():
    with pytest.raises(hzn.ConfigError, match="scene: a name, a path or a dict is expected, not list"):
        hzn.simulate([])
    scene = hzn.simulate("rocket-clean", frames=1).parameters
    with pytest.raises(hzn.ConfigError, match="scene: capture: is a number; a table is expected"):
        hzn.simulate({**scene, "capture": 3})


def test_a_number_that_is_not_finite_and_a_key_without_its_section_are_named():
    with pytest.raises(hzn.ConfigError, match=r"parameters: body.altitude_km: a number is not finite; write None"):
        hzn.Sensor(camera=CAMERA, body={"altitude_km": math.nan})
    with pytest.raises(hzn.ConfigError, match=r"altitude_km: unknown section or key; it is a key of \[body\]"):
        hzn.Sensor(camera=CAMERA, altitude_km=400)

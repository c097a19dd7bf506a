"""A recording of ROS 2 with several cameras: Python reads the one that `hzn run` and `hzn init` read."""

import subprocess
import warnings

import numpy as np
import pytest

import hzn
import ros
from conftest import CAMERA, PARAMETERS, limb

FRONT, REAR = "/front/image_raw", "/rear/image_raw"


@pytest.fixture
def bag(tmp_path):
    """Return a recording of two cameras; the pictures of the second one are twice as large, and come later."""
    small, large = limb(), np.kron(limb(), np.ones((2, 2), np.uint8))
    messages = [
        (FRONT, "Image", ros.image(small, (5, 0))),
        (REAR, "Image", ros.image(large, (70, 0))),
        ("/front/camera_info", "CameraInfo", ros.camera_info(320, 240, 301.5)),
        ("/rear/camera_info", "CameraInfo", ros.camera_info(640, 480, 603.0)),
        (FRONT, "Image", ros.image(small, (6, 0))),
    ]
    return ros.write(tmp_path / "two.mcap", messages)


def test_the_pictures_of_a_topic(bag):
    large = CAMERA | dict(width=640, height=480, fx_px=600.0, fy_px=600.0, cx_px=319.5, cy_px=239.5)
    rear = hzn.Sensor(**PARAMETERS | {"camera": large})
    with warnings.catch_warnings():
        # Whoever names the topic needs no word about the others.
        warnings.filterwarnings("error", message=".*topic")
        (report,) = rear.process_many(bag, topic=REAR)
        assert report.ok and report.time_s == 70.0
        front = hzn.Sensor(**PARAMETERS)
        assert [r.time_s for r in front.process_many([bag], topic=FRONT)] == [5.0, 6.0]
    with pytest.warns(UserWarning, match=f"those of {FRONT}; other topics with pictures: {REAR} .topic= chooses one"):
        assert [r.time_s for r in front.process_many(bag)] == [5.0, 6.0]


def test_a_topic_that_does_not_exist_is_told_with_those_that_do(bag, tmp_path):
    sensor = hzn.Sensor(**PARAMETERS)
    what = f"two.mcap: no pictures on topic /left; there are some on {FRONT}, {REAR}"
    with pytest.raises(hzn.ConfigError, match=what):
        list(sensor.process_many(bag, topic="/left"))
    with pytest.raises(hzn.ImageError, match=what):
        hzn.Sensor.start(bag, topic="/left", altitude_km=400)
    with pytest.raises(hzn.ConfigError, match="topic: arrays have no topics; give the path of a recording"):
        list(sensor.process_many([limb()], topic=REAR))
    (tmp_path / "a.pgm").write_bytes(b"P5\n320 240\n255\n" + limb().tobytes())
    with pytest.raises(hzn.ConfigError, match="only an MCAP has topics"):
        list(sensor.process_many(tmp_path / "a.pgm", topic=REAR))
    with pytest.raises(hzn.ConfigError, match="topic: there are no pictures"):
        hzn.Sensor.start(size=(320, 240), fov_deg=60, topic=REAR)


@pytest.mark.parametrize("topic", [FRONT, REAR])
def test_a_start_takes_the_calibration_of_the_recording(bag, topic, tmp_path, hzn_program):
    out = tmp_path / "sensor.toml"
    options = ["--topic", topic, "--altitude", "400", "-o", out]
    subprocess.run([hzn_program, "init", bag, *options], check=True, capture_output=True)
    sensor = hzn.Sensor.start(bag, topic=topic, altitude_km=400)
    assert sensor == hzn.Sensor.from_toml(out)
    assert sensor.parameters["camera"]["fx_px"] == {FRONT: 301.5, REAR: 603.0}[topic]
    assert all(report.ok for report in sensor.process_many(bag, topic=topic))


@pytest.mark.filterwarnings("ignore:the field of view")
def test_a_start_without_the_recorded_calibration(bag, tmp_path):
    # What the caller says about the lens counts.
    with pytest.warns(UserWarning, match=f"those of {FRONT}; other topics"):
        told = hzn.Sensor.start(bag, fov_deg=56, altitude_km=400)
    assert told.parameters["camera"]["fx_px"] == pytest.approx(160 / np.tan(np.radians(28)), rel=1e-3)
    picture = (FRONT, "Image", ros.image(limb()))
    for info, what in [
        (ros.camera_info(320, 240, 301.5, zeros=True), "/front/camera_info is not used: .*not calibrated"),
        (ros.camera_info(320, 240, 301.5)[:150], "/front/camera_info is not used: the message ends too early"),
    ]:
        path = ros.write(tmp_path / "one.mcap", [picture, ("/front/camera_info", "CameraInfo", info)])
        with pytest.warns(UserWarning, match=what), pytest.raises(hzn.ConfigError, match="fov_deg"):
            hzn.Sensor.start(path)
    info = ros.camera_info(1280, 960, 900.0)
    path = ros.write(tmp_path / "one.mcap", [picture, ("/front/camera_info", "CameraInfo", info)])
    with pytest.raises(hzn.ConfigError, match="are for pictures of 1280 x 960 px.*or give fov_deg or lens,"):
        hzn.Sensor.start(path, altitude_km=400)

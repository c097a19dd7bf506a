"""The examples against the real libraries: each answer is right within three of its sigmas."""

import array
import json
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

import hzn

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
import basilisk_loop
import rerun_log
import ros_node


@pytest.fixture(scope="module")
def infrared():
    return basilisk_loop.infrared_sensor()


@pytest.mark.timeout(1800)
def test_a_satellite_of_basilisk_points_at_the_earth(infrared, capsys):
    """One orbit with a closed loop, a picture every 10 s."""
    log, errors = basilisk_loop.fly(*infrared)
    assert len(log) > 570 and all(report.ok for _, report, *_ in log)
    angle = basilisk_loop.angle_deg
    off = np.array([angle(report.nadir, centre) for _, report, centre, _ in log])
    sigma = np.array([report.sigma_max_deg for _, report, *_ in log])
    assert (off < 3 * sigma).all(), (off / sigma).max()
    # What else the message says: minus the direction, times the distance, with its covariance.
    each = []
    for _, report, centre, _ in log:
        miss = report.nadir - centre
        each.append(miss @ np.linalg.pinv(report.covariance, rcond=1e-6) @ miss)
    axis = np.array([angle(report.axis, centre) for _, report, centre, _ in log])
    theirs = np.array([angle(basilisk_loop.basilisks_direction(r, q), c) for _, r, c, q in log[::10]])
    settled = np.array([error for time_s, error in errors if time_s > 1500])
    with capsys.disabled():
        rms = basilisk_loop.rms
        print(f"\nto the centre, RMS: nadir {rms(off):.4f}, axis {rms(axis):.4f}, horizonOpNav {rms(theirs):.4f} deg;")
        print(f"NEES (2 degrees of freedom) {np.mean(each):.2f}; pointing RMS {rms(settled):.4f}, at most {settled.max():.4f} deg")
    # The axis is not the direction to the centre, and the half pixel counts: both traps would show here.
    assert axis.max() > 0.15 and basilisk_loop.rms(off) < 0.2 * basilisk_loop.rms(axis)
    assert basilisk_loop.rms(theirs) > 3 * basilisk_loop.rms(off)
    # The loop holds the satellite within three sigmas of a single answer.
    assert settled.max() < 3 * sigma.mean(), settled.max()
    # The limb height is the one that the sensor expects, so the answers are better than their sigmas say.
    assert np.mean(each) < 2.5, np.mean(each)


def test_basilisks_message_has_the_position(infrared):
    sensor = basilisk_loop.HorizonSensor(*infrared)
    state = basilisk_loop.messaging.SCStatesMsgPayload()
    state.r_BN_N = [0.0, 7.0e6, 1.0e5]
    down = -np.array(state.r_BN_N) / np.linalg.norm(state.r_BN_N)
    along = np.array([1.0, 0.0, 0.0])
    body = np.array([along, np.cross(down, along), down])
    state.sigma_BN = basilisk_loop.RigidBodyKinematics.C2MRP(body)
    written = basilisk_loop.messaging.SCStatesMsg().write(state)
    sensor.scStateInMsg.subscribeTo(written)
    sensor.Reset(0)
    sensor.UpdateState(0)
    message = sensor.opNavOutMsg.read()
    assert message.valid == 1 and message.planetID == 1
    found, truth = np.array(message.r_BN_B), body @ state.r_BN_N
    covariance = np.reshape(message.covar_B, (3, 3))
    miss = found - truth
    assert miss @ np.linalg.pinv(covariance, rcond=1e-6) @ miss < 11.8  # 99.7 % with 2 degrees of freedom
    assert abs(np.linalg.norm(found) - np.linalg.norm(truth)) < 1e-6 * np.linalg.norm(truth)


def nees(axis, covariance, frame):
    """Return the squared error of an axis in its sigmas: chi-square with two degrees of freedom."""
    miss = axis - np.array([frame.truth[0][f"axis_{k}"] for k in "xyz"])
    return miss @ np.linalg.pinv(covariance, rcond=1e-6) @ miss


def test_a_recording_of_rerun_has_the_answers(tmp_path, capsys):
    flight = hzn.simulate("leo-infrared", frames=6)
    path = tmp_path / "flight.rrd"
    reports = rerun_log.record(path, flight, flight.sensor)
    result = hzn.evaluate(reports, flight)
    assert all(f["miss"]["angle_deg"] < 3 * r.sigma_max_deg for f, r in zip(result["frames"], reports, strict=True))
    each = [nees(report.axis, report.covariance, frame) for report, frame in zip(reports, flight, strict=True)]
    with capsys.disabled():
        print(f"\nRerun: {len(each)} answers, NEES {np.mean(each):.2f}, at most {max(each):.2f}")
    # The 99.7 % points of chi-square with two degrees of freedom, and of the mean of six.
    assert max(each) < 11.8 and np.mean(each) < 4.98, each
    rerun = [sys.executable, "-m", "rerun", "rrd"]
    subprocess.run([*rerun, "verify", path], check=True)
    text = subprocess.run([*rerun, "print", "-vvv", path], check=True, capture_output=True, text=True).stdout
    chunks = re.split(r"(?m)^(?=Chunk\()", text)
    read = [float(x) for c in chunks if "/plots/sigma_max_deg" in c for x in re.findall(r"┆ \[([0-9.e-]+)\]", c)]
    assert sorted(read) == sorted(report.sigma_max_deg for report in reports)
    for entity in ("/camera/image/limb", "/camera/image/inliers", "/camera/axis/three_sigma"):
        rows = sum(int(n) for n in re.findall(rf"(?m)^Chunk\(\S+ with (\d+) rows? .* - {entity} -", text))
        assert rows == len(reports), (entity, rows)


class Ros:
    """The messages of ROS 2 as `rosbags` has them, and a stand-in for `rclpy`, which the Python index does not have."""

    def __init__(self, monkeypatch, sensor_path, messages):
        self.store = get_typestore(Stores.ROS2_HUMBLE)
        self.messages, self.published, self.warnings, self.callbacks = messages, [], [], {}
        for package in ("geometry_msgs", "sensor_msgs", "std_msgs"):
            module = ModuleType(f"{package}.msg")
            for name, kind in self.store.types.items():
                if name.startswith(f"{package}/msg/"):
                    vars(module)[name.split("/")[-1]] = kind
            monkeypatch.setitem(sys.modules, package, ModuleType(package))
            monkeypatch.setitem(sys.modules, f"{package}.msg", module)
        logger = SimpleNamespace(warning=lambda text, throttle_duration_sec: self.warnings.append(text))
        node = SimpleNamespace(
            declare_parameter=lambda name, default: SimpleNamespace(value=str(sensor_path)),
            create_publisher=lambda kind, topic, depth: SimpleNamespace(publish=lambda m: self.take(kind, topic, m)),
            create_subscription=lambda kind, topic, callback, qos: self.callbacks.update({topic: callback}),
            get_logger=lambda: logger,
        )
        rclpy = ModuleType("rclpy")
        rclpy.init, rclpy.spin = lambda: None, lambda node: self.spin()
        parts = {"node": {"Node": lambda name: node}, "qos": {"qos_profile_sensor_data": None}}
        monkeypatch.setitem(sys.modules, "rclpy", rclpy)
        for part, contents in parts.items():
            module = ModuleType(f"rclpy.{part}")
            vars(module).update(contents)
            monkeypatch.setitem(sys.modules, f"rclpy.{part}", module)

    def take(self, kind, topic, message):
        """Keep a message as its bytes give it again: a wrong type of a field does not survive this."""
        name = kind.__msgtype__
        if hasattr(message, "data"):
            # rclpy takes sequences of Python's own numbers, and rosbags only arrays.
            assert isinstance(message.data, list) and all(type(x) is float for x in message.data)
            message = kind(layout=message.layout, data=np.array(message.data))
        self.published.append((topic, self.store.deserialize_cdr(self.store.serialize_cdr(message, name), name)))

    def spin(self):
        for topic, message in self.messages(self.store.types):
            self.callbacks[topic](message)


def image_message(types, image, time_s, encoding="mono16"):
    """Return a picture as ROS has it, with padded rows."""
    stamp = types["builtin_interfaces/msg/Time"](sec=int(time_s), nanosec=round(time_s % 1 * 1e9))
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera_optical_frame")
    rows = image.reshape(len(image), -1).view(np.uint8)
    rows = np.hstack([rows, np.zeros((len(rows), 6), np.uint8)])
    return types["sensor_msgs/msg/Image"](
        header=header,
        height=image.shape[0],
        width=image.shape[1],
        encoding=encoding,
        is_bigendian=0,
        step=rows.shape[1],
        data=array.array("B", rows.tobytes()),
    )


def write_toml(sensor, path):
    """Write the parameters of a sensor as sensor.toml."""
    lines = []
    for section, keys in sensor.parameters.items():
        if isinstance(keys, dict):
            lines += [f"[{section}]", *(f"{key} = {json.dumps(value)}" for key, value in keys.items() if value is not None)]
    path.write_text("\n".join(lines))
    assert hzn.Sensor.from_toml(path) == sensor
    return path


def test_a_node_of_ros_answers_its_pictures(monkeypatch, tmp_path, capsys):
    flight = hzn.simulate("leo-infrared", frames=12)
    path = write_toml(flight.sensor, tmp_path / "sensor.toml")

    def messages(types):
        fix, status = (types[f"sensor_msgs/msg/{name}"] for name in ("NavSatFix", "NavSatStatus"))
        for frame in flight:
            picture = image_message(types, frame.image, frame.known["time_s"])
            known = dict(latitude=0.0, longitude=0.0, position_covariance=np.zeros(9), position_covariance_type=0)
            no_fix = status(status=-1, service=0)
            altitude = 1e3 * frame.known["altitude_km"]
            yield "fix", fix(header=picture.header, status=status(status=0, service=1), altitude=altitude, **known)
            yield "fix", fix(header=picture.header, status=no_fix, altitude=5.0, **known)
            yield "image", picture
        dark = np.full_like(frame.image, 2000)
        yield "image", image_message(types, dark, frame.known["time_s"])

    ros = Ros(monkeypatch, path, messages)
    ros_node.main()
    axes = [message for topic, message in ros.published if topic == "axis"]
    covariances = [message for topic, message in ros.published if topic == "axis_covariance"]
    assert len(axes) == len(covariances) == len(flight) and len(ros.warnings) == 1, ros.warnings
    each = []
    for axis, covariance, frame in zip(axes, covariances, flight, strict=True):
        assert axis.header.frame_id == "camera_optical_frame"
        assert abs(axis.header.stamp.sec + 1e-9 * axis.header.stamp.nanosec - frame.known["time_s"]) < 1e-6
        matrix = np.reshape(covariance.data, [size.size for size in covariance.layout.dim])
        each.append(nees(np.array([axis.vector.x, axis.vector.y, axis.vector.z]), matrix, frame))
    with capsys.disabled():
        print(f"\nnode of ROS: {len(each)} answers, NEES {np.mean(each):.2f}, at most {max(each):.2f}")
    # The 99.7 % points of chi-square with two degrees of freedom, and of the mean of twelve.
    assert max(each) < 11.8 and np.mean(each) < 3.95, each


@pytest.mark.parametrize("encoding", ["mono8", "bgr8", "rgba8"])
def test_the_node_reads_the_encodings_of_ros(encoding):
    types = get_typestore(Stores.ROS2_HUMBLE).types
    channels = {"mono8": 1, "bgr8": 3, "rgba8": 4}[encoding]
    image = np.random.default_rng(1).integers(0, 255, (6, 5, channels), np.uint8)
    read = ros_node.picture(image_message(types, image if channels > 1 else image[..., 0], 1.5, encoding))
    assert np.array_equal(read, image[..., 0] if channels == 1 else image[..., ::-1] if encoding == "bgr8" else image)
    with pytest.raises(ValueError, match="bayer"):
        ros_node.picture(image_message(types, image[..., 0].copy(), 1.5, "bayer_rggb8"))

"""The first minute: a sensor from a field of view, a picture of a pose, the direction to the centre, a drawing."""

import pickle
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import hzn
from conftest import CAMERA, PARAMETERS, limb, pgm

PHOTOGRAPH = Path(__file__).parents[2] / "hzn-cli/assets/iss-limb-2020-11-20.jpg"
WGS84_A_KM, WGS84_B_KM = 6378.137, 6356.752314245
SMALL = dict(CAMERA, width=640, height=480, fx_px=420.0, fy_px=420.0, cx_px=319.5, cy_px=239.5)
NOON = 1_560_421_800.0  # 2019-06-13T10:30:00Z


def angle_deg(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def pose(latitude_deg, longitude_deg, altitude_km, azimuth_deg=0.0, depression_deg=20.0, roll_deg=0.0):
    """Return position (ECEF, km) and rotation (camera to ECEF) of a camera that looks below the horizontal."""
    lat, lon = np.radians([latitude_deg, longitude_deg])
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    n = WGS84_A_KM**2 / np.hypot(WGS84_A_KM * np.cos(lat), WGS84_B_KM * np.sin(lat))
    position = np.array([n, n, n * (WGS84_B_KM / WGS84_A_KM) ** 2]) * up + altitude_km * up
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    north = np.cross(up, east)
    azimuth, depression, roll = np.radians([azimuth_deg, depression_deg, roll_deg])
    forward = (east * np.sin(azimuth) + north * np.cos(azimuth)) * np.cos(depression) - up * np.sin(depression)
    right = east * np.cos(azimuth) - north * np.sin(azimuth)
    down = np.cross(forward, right)
    x = right * np.cos(roll) + down * np.sin(roll)
    return position, np.column_stack([x, np.cross(forward, x), forward])


def quaternion(rotation):
    """Return the unit quaternion (w, x, y, z) of a rotation matrix, by the largest eigenvector of Bar-Itzhack's matrix."""
    r = rotation
    k = np.array([
        [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        [0, r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2]],
        [0, 0, r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2]],
        [0, 0, 0, r[2, 2] - r[0, 0] - r[1, 1]],
    ])  # fmt: skip
    return np.linalg.eigh(k, UPLO="U")[1][:, -1]


@pytest.mark.parametrize(
    ("options", "arguments"),
    [
        (["--fov", "38", "--altitude", "418"], dict(fov_deg=38.0, altitude_km=418.0)),
        (["--lens", "fisheye", "--altitude", "418"], dict(lens="fisheye", altitude_km=418.0)),
        (["--fov", "120", "--lens", "fisheye"], dict(fov_deg=120.0, lens="fisheye")),
        (["--fov", "40", "--body", "moon", "--altitude", "100"], dict(fov_deg=40.0, body="moon", altitude_km=100.0)),
        (["--fov", "2", "--body", "sun"], dict(fov_deg=2.0, body="sun")),
    ],
)
def test_the_start_is_that_of_hzn_init(options, arguments, tmp_path, hzn_program):
    out = tmp_path / "sensor.toml"
    subprocess.run([hzn_program, "init", PHOTOGRAPH, *options, "-o", out], check=True, capture_output=True)
    assert hzn.Sensor.start(PHOTOGRAPH, **arguments) == hzn.Sensor.from_toml(out)


def test_a_start_by_the_size_alone(tmp_path, hzn_program):
    (tmp_path / "a.pgm").write_bytes(pgm(limb()))
    out = tmp_path / "sensor.toml"
    known = ["--fov", "56", "--altitude", "400"]
    subprocess.run([hzn_program, "init", tmp_path / "a.pgm", *known, "-o", out], check=True, capture_output=True)
    sensor = hzn.Sensor.start(size=(320, 240), fov_deg=56, altitude_km=400)
    assert sensor == hzn.Sensor.from_toml(out)
    assert sensor.process(limb()).ok
    assert hzn.Sensor.start(size=(320, 240), fov_deg=56, flight=True).flight


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (dict(fov_deg=60), "give either pictures or size"),
        (dict(size=(320, 240), fov_deg=2, body="sun", altitude_km=400), "altitude_km: the Sun has one size"),
        (dict(size=(320, 240)), "fov_deg=60, and lens=\"fisheye\" or lens=\"pinhole\""),
        (dict(size=(320, 240), fov_deg=120), "fov_deg=120: a lens of this width may be .* lens=\"fisheye\""),
        (dict(size=(320, 240), fov_deg=60, lens="fish"), "lens: \"fish\" is refused"),
        (dict(size=(320, 240), fov_deg=60, body="vulcan"), "body: \"vulcan\" is refused"),
        (dict(size=(320, 240), fov_deg=60, altitude_km=-1), "altitude_km: -1 is refused"),
        (dict(size=(0, 240), fov_deg=60), r"size: \(0, 240\) is refused: width and height must be 1 to 65535"),
    ],
)
def test_a_refused_start_names_the_argument(arguments, message):
    with pytest.raises(hzn.ConfigError, match=message) as refused:
        hzn.Sensor.start(**arguments)
    assert "--" not in str(refused.value)


def test_one_picture_does_not_tell_the_kind_of_lens():
    """The photograph is 38 degrees wide. As a fisheye, it fitted 33.9 +- 0.9 degrees."""
    with pytest.raises(hzn.ConfigError, match="as a fisheye, but .* as a pinhole; add lens=") as refused:
        hzn.Sensor.start(PHOTOGRAPH, altitude_km=418)
    assert "--" not in str(refused.value)
    # Whoever says the kind learns that the picture is not enough, instead of that it says nothing.
    with pytest.raises(hzn.ConfigError, match="too uncertain to start from: .* as a pinhole; add more pictures"):
        hzn.Sensor.start(PHOTOGRAPH, lens="pinhole", altitude_km=418)


def test_a_field_of_view_that_the_limb_contradicts(tmp_path):
    """The pictures are 74.6 degrees wide; a list of pictures is one camera, as a folder is."""
    sensor = hzn.Sensor(camera=SMALL, body={"kind": "earth"}, input={"tone": "linear"})
    paths = []
    for i in range(6):
        position, rotation = pose(-30 + 9 * i, 10.0, 500.0, azimuth_deg=50 * i, roll_deg=7 * i)
        paths.append(tmp_path / f"{i}.pgm")
        paths[-1].write_bytes(pgm(hzn.render(sensor, position, quaternion(rotation), NOON + 10 * i)))
    with pytest.warns(UserWarning, match="of 6 pictures contradicts the field of view") as warned:
        hzn.Sensor.start(paths, fov_deg=35, altitude_km=500)
    assert all("--" not in str(one.message) for one in warned)
    assert hzn.Sensor.start([str(PHOTOGRAPH)], fov_deg=38, altitude_km=418) == hzn.Sensor.start(
        PHOTOGRAPH, fov_deg=38, altitude_km=418
    )
    with pytest.raises(hzn.ConfigError, match="give either pictures or size"):
        hzn.Sensor.start([], fov_deg=38)


def test_pictures_that_are_not_there(tmp_path):
    with pytest.raises(hzn.ImageError, match="none.jpg"):
        hzn.Sensor.start(tmp_path / "none.jpg", fov_deg=60)


def test_a_closed_loop_of_rendered_poses():
    """Answers agree with their poses within 3 sigma, and the attitude leads from the axis to the centre."""
    sensor = hzn.Sensor(camera=SMALL, body={"kind": "earth"}, input={"tone": "linear"})
    scaled, axes_off, centres_off = [], [], []
    for i in range(12):
        position, rotation = pose(-50 + 9 * i, 10.0, 500.0, azimuth_deg=30 * i, roll_deg=7 * i)
        image = hzn.render(sensor, position, quaternion(rotation), NOON + 10 * i)
        assert image.shape == (480, 640) and image.dtype == np.uint8
        known = dict(position_km=position, time_s=NOON + 10 * i)
        report = sensor.process(image, **known, attitude=quaternion(rotation), attitude_sigma_deg=1.0)
        bare = sensor.process(image, **known)
        assert report.ok and bare.ok, (report, bare)
        scaled.append(angle_deg(rotation @ report.axis, report.axis_fixed) / report.sigma_max_deg)
        centre = rotation.T @ (-position / np.linalg.norm(position))
        axes_off.append(angle_deg(bare.nadir, centre))
        centres_off.append(angle_deg(report.nadir, centre))
        assert np.array_equal(bare.nadir, bare.axis)
        assert axes_off[-1] < bare.nadir_error_deg + 3 * bare.sigma_max_deg
        assert centres_off[-1] < report.nadir_error_deg + 3 * report.sigma_max_deg
        # Three sigmas of one degree are 0.052 rad.
        assert report.nadir_error_deg < 0.053 * bare.nadir_error_deg + 1e-12
    # `sigma_max_deg` is the larger of two sigmas. Of 12 answers, none exceeds 3 of them.
    assert max(scaled) < 3.0, scaled
    print(f"error / sigma at most {max(scaled):.2f}; to the centre: axis {max(axes_off):.3f}, nadir {max(centres_off):.3f} deg")


def test_a_picture_depends_on_pose_time_and_world():
    sensor = hzn.Sensor(camera=SMALL)
    position, rotation = pose(10.0, 10.0, 500.0)
    q = quaternion(rotation)
    image = hzn.render(sensor, position, q, NOON)
    assert np.array_equal(image, hzn.render(sensor, position, q, NOON))
    # Another time or seed draws other noise.
    assert not np.array_equal(image, hzn.render(sensor, position, q, NOON + 0.1))
    assert not np.array_equal(image, hzn.render(sensor, position, q, NOON, seed=1))
    night = hzn.render(sensor, position, q, NOON + 43_200)
    assert night.mean() < 0.2 * image.mean()
    infrared = hzn.render(sensor, position, q, NOON + 43_200, world="leo-infrared")
    assert infrared.dtype == np.uint16 and infrared.mean() > 0.05 * 65535
    scene = {**hzn.simulate("rocket-clean", frames=1).parameters, "detector": {"bits": 12}}
    assert hzn.render(sensor, position, q, NOON, world=scene).max() > 255
    with pytest.raises(hzn.ConfigError, match="inside the Earth"):
        hzn.render(sensor, 0.9 * position, q, NOON)
    with pytest.raises(hzn.ConfigError, match="attitude"):
        hzn.render(sensor, position, [0, 0, 0, 2], NOON)
    with pytest.raises(hzn.ConfigError, match="ellipsoid.sun"):
        hzn.render(sensor, 1e6 * position, q, NOON, world="jupiter")
    with pytest.raises(hzn.ConfigError, match="did you mean rocket"):
        hzn.render(sensor, position, q, NOON, world="rockt")


def test_the_direction_to_the_centre_of_a_round_body_and_in_a_pickle():
    report = hzn.Sensor(**PARAMETERS).process(limb())
    assert np.array_equal(report.nadir, report.axis) and report.nadir_error_deg == 0.0
    nothing = hzn.Sensor(**PARAMETERS).process(np.zeros((240, 320), np.uint8))
    assert nothing.nadir is None and nothing.nadir_error_deg is None
    earth = hzn.Sensor(camera=CAMERA, body={"kind": "earth", "altitude_km": 400.0}).process(limb())
    assert np.array_equal(earth.nadir, earth.axis) and 0.16 < earth.nadir_error_deg < 0.19
    again = pickle.loads(pickle.dumps(earth))
    assert np.array_equal(again.nadir, earth.nadir) and again.nadir_error_deg == earth.nadir_error_deg


@pytest.fixture
def pyplot():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    yield plt
    plt.close("all")


def test_a_report_is_drawn(pyplot, tmp_path):
    image = limb()
    report = hzn.Sensor(**PARAMETERS).process(image, detail=True)
    ax = report.plot()
    labels = ax.get_legend_handles_labels()[1]
    assert labels[:2] == ["fitted limb", "inliers"] and "axis" in ax.get_title(loc="left")
    assert len(ax.images) == 1 and ax.get_xlim() == (-0.5, 319.5) and ax.get_ylim() == (239.5, -0.5)
    np.testing.assert_array_equal(ax.lines[0].get_xydata(), report.limb[0])
    # The picture is in axes that exist already, or there is none.
    _, mine = pyplot.subplots()
    assert report.plot(ax=mine) is mine and len(mine.images) == 1
    del image
    bare = pickle.loads(pickle.dumps(report)).plot()
    assert not bare.images and bare.get_ylim() == (239.5, -0.5)
    assert len(pickle.loads(pickle.dumps(report)).plot(limb()).images) == 1
    with pytest.raises(hzn.ImageError, match="but the report is of a picture of 320 x 240 px"):
        report.plot(limb()[:100])


def test_the_file_of_a_report_is_read_again(pyplot, tmp_path):
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), limb())
    report = hzn.Sensor(**PARAMETERS).process(path)
    ax = report.plot()
    assert np.array_equal(np.asarray(ax.images[0].get_array())[..., 0], limb())
    assert "<img" in report._repr_html_()
    path.unlink()
    assert "<img" not in report._repr_html_()
    with pytest.raises(hzn.ImageError, match="a.png"):
        report.plot()


def test_a_refusal_is_drawn_with_its_reason(pyplot):
    ax = hzn.Sensor(**PARAMETERS).process(np.zeros((240, 320), np.uint8)).plot()
    assert "too-dark" in ax.get_title(loc="left") or "no-limb" in ax.get_title(loc="left")


def test_without_matplotlib_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match="pip install matplotlib"):
        hzn.Sensor(**PARAMETERS).process(limb()).plot()


def test_the_photograph_of_the_station_in_four_lines(pyplot, tmp_path):
    sensor = hzn.Sensor.start(PHOTOGRAPH, fov_deg=38, altitude_km=418)
    report = sensor.process(PHOTOGRAPH, detail=True)
    print(report)
    report.plot().figure.savefig(tmp_path / "iss.png")
    # The camera of the demo is fitted to the limb; a field of view that is known to 5 % agrees with it.
    demo = hzn.Sensor.from_toml(PHOTOGRAPH.with_name("iss.toml")).process(PHOTOGRAPH)
    assert angle_deg(report.axis, demo.axis) < 3 * report.sigma_max_deg


def test_a_time_since_the_start_of_the_flight_is_no_utc():
    """Ten seconds of a flight are not 1 January 1970, when it was night here."""
    sensor = hzn.Sensor(camera=SMALL, body={"kind": "earth"}, input={"tone": "linear"})
    position, rotation = pose(10.0, 10.0, 500.0)
    image = hzn.render(sensor, position, quaternion(rotation), NOON)
    bare, timed, dated = (sensor.process(image, position_km=position, time_s=t) for t in (None, 10.0, NOON + 43_200))
    assert (timed.status, timed.sigma_max_deg, timed.time_s) == (bare.status, bare.sigma_max_deg, 10.0)
    assert bare.ok and (dated.status, dated.sigma_max_deg) != (bare.status, bare.sigma_max_deg)


def test_a_start_that_nothing_checks_warns():
    # The limb of one narrow picture is almost straight, and fits other fields of view as well.
    with pytest.warns(UserWarning, match="the field of view of 38.0 degrees and the altitude are checked only roughly"):
        hzn.Sensor.start(PHOTOGRAPH, fov_deg=38, altitude_km=418)
    for wrong in (dict(fov_deg=60, altitude_km=418), dict(fov_deg=38, altitude_km=1500)):
        with pytest.warns(UserWarning, match="contradicts the field of view or the altitude"):
            hzn.Sensor.start(PHOTOGRAPH, **wrong)
    with pytest.warns(UserWarning, match="fov_deg=0.66 is in degrees; if it is in radians, write fov_deg=37.8"):
        hzn.Sensor.start(size=(320, 240), fov_deg=0.66, altitude_km=418)


def test_another_count_of_numbers_is_named(sensor):
    with pytest.raises(TypeError, match=r"4 numbers are expected, not 3: a quaternion is \(w, x, y, z\)\n.*'attitude'"):
        sensor.process(limb(), attitude=[0.0, 0.0, 1.0])
    with pytest.raises(TypeError, match="3 numbers are expected, not 2\n.*'position_km'"):
        sensor.process(limb(), position_km=[0.0, 0.0])
    assert sensor.process(limb(), position_km=np.array([6771.0, 0.0, 0.0])).ok


def test_samples_that_look_wrong_are_told(sensor):
    kelvin = limb() / 10.0
    assert sensor.process(kelvin).ok
    kelvin[120, 160] = 1e5
    with pytest.warns(UserWarning, match="of the numbers lie in 0.0. % of the range .* hot pixel"):
        assert not sensor.process(kelvin).ok
    words = limb().astype(np.uint16) * 16
    assert sensor.process(words, bits=12).ok
    with pytest.warns(UserWarning, match="the largest sample is 3200, which has 12 bits, but bits = 8 was told"):
        assert not sensor.process(words, bits=8).ok

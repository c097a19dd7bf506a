"""Tests of the package as users see it. The numbers are tested in Rust; here, their transfer and the refused values."""

import copy
import csv
import pickle
import subprocess
import sys
import tempfile
import typing
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import hzn
from conftest import CAMERA, PARAMETERS, limb

def test_an_answer_and_its_covariance(sensor):
    report = sensor.process(limb())
    assert report.ok and report.status == "ok" and report.detail == ""
    truth = np.array([0.0, np.sin(np.radians(68)), np.cos(np.radians(68))])
    # The limb is 7 km lower than the sensor assumes.
    assert np.degrees(np.arccos(min(1.0, report.axis @ truth))) < report.sigma_max_deg
    assert np.isclose(np.linalg.norm(report.axis), 1.0)
    assert np.allclose(report.covariance @ report.axis, 0.0, atol=1e-12)
    assert np.isclose(np.degrees(np.sqrt(np.linalg.eigvalsh(report.covariance)[-1])), report.sigma_max_deg)
    # What is common is a part of the covariance: neither it nor the rest is negative in any direction.
    for part in (report.covariance_common, report.covariance - report.covariance_common):
        assert np.linalg.eigvalsh(part)[0] > -1e-9 * np.trace(report.covariance) and np.trace(part) > 0.0
    # The default probability is 1e-4.
    assert report.p_limb > 0.0 and np.isclose(report.protection_deg, 6.15 * report.sigma_max_deg)
    assert "sigma" in repr(report) and report.altitude_km == 400.0 and report.axis_vehicle is None
    row = report.to_dict()
    assert row["axis_y"] == report.axis[1]
    # The limb is straight down in the picture, and only a turn about the optical axis moves this direction.
    assert [row["picture_x"], row["picture_y"]] == list(report.picture_direction)
    assert np.allclose(report.picture_direction, [0.0, 1.0], atol=5 * report.picture_sigma)
    assert 0.0 < report.picture_sigma < np.radians(report.sigma_max_deg) / np.hypot(*report.axis[:2]) * 1.001


def test_the_axis_in_the_vehicle():
    # A camera that looks forward: the vehicle's x, y, z are the camera's z, x, y.
    mounted = hzn.Sensor(**PARAMETERS, mount={"q_vehicle_from_camera_wxyz": [0.5, 0.5, 0.5, 0.5]}).process(limb())
    assert np.allclose(mounted.axis_vehicle, np.roll(mounted.axis, 1), atol=1e-12)
    row = mounted.to_dict()
    assert [row["axis_v_x"], row["axis_v_y"], row["axis_v_z"]] == list(mounted.axis_vehicle)


def test_no_limb_is_an_answer_too(sensor):
    report = sensor.process(np.full((240, 320), 9, np.uint8))
    assert report.picture_direction is None and report.picture_sigma is None
    assert not report.ok and report.axis is None and report.covariance is None and report.covariance_common is None
    assert report.status in repr(report) and report.protection_deg is None


def test_kinds_of_arrays_give_one_answer(sensor):
    image = limb()
    wide = np.zeros((240, 400), np.uint8)
    wide[:, 40:360] = image
    frozen = image.copy()
    frozen.flags.writeable = False
    kinds = [
        np.asfortranarray(image),
        wide[:, 40:360],
        image[::-1].copy()[::-1],
        frozen,
        np.dstack([image] * 3),
        image[:, :, None],
    ]
    expected = sensor.process(image).axis
    for kind in kinds:
        assert np.array_equal(sensor.process(kind).axis, expected)
    words = sensor.process(image.astype(np.uint16) * 256)
    assert np.allclose(words.axis, expected, atol=1e-6)
    assert np.allclose(sensor.process(image.astype(np.uint16), bits=8).axis, expected, atol=1e-6)
    parameters = sensor.parameters
    parameters["input"]["bits"] = 8
    assert np.allclose(hzn.Sensor(**parameters).process(image.astype(np.uint16)).axis, expected, atol=1e-6)


def test_temperatures_have_the_answer_of_their_picture(sensor):
    image = limb()
    expected = sensor.process(image)
    celsius = -40.0 + (image.astype(float) - 20.0) / 3.0
    celsius[0, 0] = np.nan
    for kind in (celsius, celsius.astype(np.float32), celsius.astype(">f4")[:, :, None], np.asfortranarray(celsius)):
        answer = sensor.process(kind)
        assert np.degrees(np.linalg.norm(answer.axis - expected.axis)) < 0.002
    # The number of bits of a camera's counts says nothing about temperatures.
    parameters = sensor.parameters
    parameters["input"]["bits"] = 12
    assert np.array_equal(hzn.Sensor(**parameters).process(celsius).axis, sensor.process(celsius).axis)
    with pytest.raises(hzn.ImageError, match="bits: must be left out for an array of floats"):
        sensor.process(celsius, bits=16)
    assert hzn.overlay(celsius, expected).shape == (240, 320, 3)


@pytest.mark.parametrize(
    ("image", "what"),
    [
        (limb().astype(complex), "dtype complex128"),
        (np.full((240, 320), 3.5), "every number of the picture is the same, or not finite"),
        (limb().astype(bool), "dtype bool"),
        (limb().tolist(), "not list"),
        (limb()[0], "shape"),
        (limb()[None, None], "shape"),
        (np.zeros((0, 320), np.uint8), "empty"),
        (np.zeros((240, 320, 5), np.uint8), "1 to 4 channels"),
        (np.zeros((320, 240), np.uint8), "but the camera is 320 x 240"),
    ],
)
def test_what_is_no_picture_is_refused(sensor, image, what):
    with pytest.raises(hzn.ImageError, match=what):
        sensor.process(image)


@pytest.mark.parametrize(
    ("known", "what"),
    [
        ({"altitude_km": float("inf")}, "altitude_km"),
        ({"altitude_km": -3.0}, "altitude_km"),
        ({"position_km": [np.nan, 0, 0]}, "x_km"),
        ({"position_km": [1000.0, 0, 0]}, "x_km|outside"),
        ({"attitude": [2.0, 0, 0, 0]}, "attitude"),
        ({"attitude_sigma_deg": -1.0, "attitude": [1.0, 0, 0, 0]}, "attitude_sigma_deg"),
        ({"time_s": float("inf")}, "time_s"),
    ],
)
def test_what_cannot_be_known_is_refused(sensor, known, what):
    with pytest.raises(hzn.ConfigError, match=what):
        sensor.process(limb(), **known)


def test_parameters_name_their_fault():
    with pytest.raises(hzn.ConfigError, match="did you mean threshold_px"):
        hzn.Sensor(**PARAMETERS, consensus={"threshold_pxx": 3.0})
    with pytest.raises(hzn.ConfigError, match="must be above 0"):
        hzn.Sensor(**PARAMETERS, consensus={"threshold_px": -1.0})
    with pytest.raises(hzn.ConfigError, match="camera"):
        hzn.Sensor()
    with pytest.raises(hzn.ConfigError, match="hzn init"):
        hzn.Sensor.from_toml("nowhere.toml")
    assert issubclass(hzn.ConfigError, hzn.HznError) and issubclass(hzn.HznError, ValueError)


def test_parameters_are_read_set_pickled_and_copied(sensor):
    parameters = sensor.parameters
    assert parameters["camera"]["fx_px"] == 300.0
    parameters["consensus"]["seed"] = 7
    other = hzn.Sensor(**parameters)
    assert other != sensor and other.parameters["consensus"]["seed"] == 7
    for twin in (pickle.loads(pickle.dumps(sensor)), copy.deepcopy(sensor), hzn.Sensor(**sensor.parameters)):
        assert twin == sensor
        assert np.array_equal(twin.process(limb()).axis, sensor.process(limb()).axis)
        twin.parameters = parameters
        assert twin == other and twin != sensor
    assert hzn.Sensor(**PARAMETERS, flight=True) != sensor
    parameters["consensus"]["seed"] = -7
    with pytest.raises(hzn.ConfigError, match="seed"):
        sensor.parameters = parameters
    assert sensor.parameters["consensus"]["seed"] == 1 and sensor.process(limb()).ok


def test_a_sensor_of_keywords(sensor):
    assert hzn.Sensor(camera=sensor.camera, body=PARAMETERS["body"]) == sensor
    assert hzn.Sensor(**PARAMETERS, consensus={"seed": np.uint32(1)}) == sensor
    sun = hzn.Sensor(camera=sensor.camera, preset="sun")
    assert sun.parameters["body"]["kind"] == "sun"
    with pytest.raises(hzn.ConfigError, match="rejct"):
        hzn.Sensor(camera=sensor.camera, rejct={})


def test_every_key_has_a_type(sensor):
    sections = typing.get_type_hints(hzn.keys.Parameters)
    assert typing.get_type_hints(hzn.keys.Sections).keys() == sections.keys()
    for name, values in sensor.parameters.items():
        assert values.keys() <= typing.get_type_hints(sections[name]).keys(), name
    assert "altitude_km" in typing.get_type_hints(hzn.keys.Body)


def test_several_bodies_in_one_picture(sensor):
    bodies = [{"kind": "earth-sphere", "altitude_km": 400.0}, {"kind": "moon"}]
    both = hzn.Sensor(camera=sensor.camera, bodies=bodies)
    report = both.process(limb())
    assert report.ok and report.body == "earth-sphere"
    assert [r.body for r in report.others] == ["moon"] and not report.others[0].ok
    assert "moon" in repr(report)


def test_eight_threads_give_the_same(sensor):
    pictures = [limb(i) for i in range(16)]
    alone = [sensor.process(p).axis for p in pictures]
    with ThreadPoolExecutor(8) as pool:
        for _ in range(4):
            together = pool.map(lambda p: sensor.process(p).axis, pictures)
            assert all(np.array_equal(a, b) for a, b in zip(alone, together))


def test_detail_and_overlay(sensor):
    image = limb()
    report = sensor.process(image, detail=True)
    assert report.inliers.shape[1] == 2 and len(report.inliers) > 100
    assert set(report.stages_us) >= {"contour", "fit"} and report.candidates[0]["verdict"] == "chosen"
    # Inliers lie on the limb, where the brightness is halfway between dark and lit.
    column = report.inliers[np.argmin(abs(report.inliers[:, 0] - 160))]
    assert abs(image[int(round(column[1])), int(round(column[0]))].astype(int) - 110) < 100
    drawn = hzn.overlay(image, report)
    assert drawn.shape == (240, 320, 3) and drawn.dtype == np.uint8
    assert (abs(drawn.astype(int) - [240, 228, 66]) < 70).all(axis=2).any(), "the limb, whose edges are smooth"
    plain = sensor.process(image)
    with pytest.raises(hzn.HznError, match="detail=True"):
        plain.inliers
    assert len(plain.limb) == 1
    assert np.array_equal(report.rays, sensor.camera.unproject(report.inliers))
    html = report._repr_html_()
    assert "data:image/jpeg;base64," in html and "sigma" in html
    del image
    assert "base64" not in report._repr_html_()


def test_reports_are_pickled_and_copied(sensor):
    """Copies have every number and array to the last bit, for all bodies."""
    image = limb()
    bodies = [{"kind": "earth-sphere", "altitude_km": 400.0}, {"kind": "moon"}]
    both = hzn.Sensor(camera=sensor.camera, bodies=bodies)
    dark = np.full((240, 320), 9, np.uint8)
    reports = [
        sensor.process(image, detail=True, time_s=0.1 + 0.2),
        sensor.process(image),
        hzn.Sensor(**PARAMETERS, flight=True).process(image, detail=True),
        sensor.process(dark),
        both.process(image, detail=True),
    ]
    for report in reports:
        for twin in (*(pickle.loads(pickle.dumps(report, p)) for p in range(2, 6)), copy.copy(report), copy.deepcopy(report)):
            assert everything(twin) == everything(report)
            assert np.array_equal(hzn.overlay(image, twin), hzn.overlay(image, report))
    assert "base64" in copy.deepcopy(reports[0])._repr_html_()
    assert "base64" not in pickle.loads(pickle.dumps(reports[0]))._repr_html_()


def everything(report):
    """Return all values of a report in a form that can be compared."""
    found = {"repr": repr(report), "others": [everything(other) for other in report.others]}
    for name in set(dir(report)) - set(dir(object)) - {"others", "plot", "mask"}:
        if not name.startswith("_"):
            try:
                value = getattr(report, name)
            except hzn.HznError as missing:
                value = str(missing)
            found[name] = value() if callable(value) else value
    assert len(found) > 25
    arrays = lambda v: v.tolist() if isinstance(v, np.ndarray) else [arrays(x) for x in v] if isinstance(v, list) else v
    return {name: arrays(value) for name, value in found.items()}


def test_camera_there_and_back(sensor, tmp_path):
    camera = sensor.camera
    assert (camera.width, camera.height, camera.model) == (320, 240, "pinhole")
    points = np.array([[0.0, 0.0], [159.5, 119.5], [319.0, 17.25]])
    rays = camera.unproject(points)
    assert np.allclose(camera.project(3 * rays), points)
    assert np.allclose(rays[1], [0, 0, 1])
    assert np.isnan(camera.project(np.array([[0.0, 0.0, -1.0]]))).all()
    with pytest.raises(hzn.ImageError, match=r"\(n, 3\)"):
        camera.project(points)
    assert camera.project([[0, 0, 2]]).shape == (1, 2)
    with pytest.raises(hzn.ImageError, match="shape"):
        camera.project([1.0, 2.0, 3.0])
    for twin in (pickle.loads(pickle.dumps(camera)), hzn.Camera(**camera.parameters)):
        assert twin == camera


FISHEYE = dict(width=640, height=480, model="kannala-brandt", fx_px=250.0, fy_px=251.0, cx_px=321.0, cy_px=238.0)


def test_camera_by_opencvs_rules():
    """Compares with NumPy code of OpenCV's fisheye and pinhole models, as its documentation states them."""
    d = [-0.02, 0.003, -0.0005, 0.0001]
    k = np.array([[250.0, 0, 321.0], [0, 251.0, 238.0], [0, 0, 1]])
    camera = hzn.Camera.from_opencv(k, d, size=(640, 480), fisheye=True)
    assert camera == hzn.Camera(**FISHEYE, k=d)
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 7), np.linspace(-0.6, 0.6, 7))
    plane = np.column_stack([x.ravel(), y.ravel()])
    r = np.hypot(*plane.T)
    t = np.arctan(r)
    scale = np.where(r > 0, t * (1 + sum(c * t ** (2 * i + 2) for i, c in enumerate(d))) / np.maximum(r, 1e-12), 1.0)
    pixels = plane * scale[:, None] * [250.0, 251.0] + [321.0, 238.0]
    assert np.allclose(camera.undistort_points(pixels), plane, atol=1e-9)

    d = [-0.1, 0.02, 0.001, -0.0005, 0.0]
    camera = hzn.Camera.from_opencv(k, np.array([d]), size=(640, 480))
    r2, (px, py) = r * r, plane.T
    radial = 1 + d[0] * r2 + d[1] * r2 * r2
    bent = np.column_stack([
        px * radial + 2 * d[2] * px * py + d[3] * (r2 + 2 * px * px),
        py * radial + d[2] * (r2 + 2 * py * py) + 2 * d[3] * px * py,
    ])
    assert np.allclose(camera.undistort_points(bent * [250.0, 251.0] + [321.0, 238.0]), plane, atol=1e-9)
    with pytest.raises(hzn.ConfigError, match="size"):
        hzn.Camera.from_opencv(k, d)
    with pytest.raises(hzn.ConfigError, match="8 coefficients"):
        hzn.Camera.from_opencv(k, [0.0] * 8, size=(640, 480))
    skewed = np.array(k, dtype=float)
    skewed[0, 1] = 0.5
    with pytest.raises(hzn.ConfigError, match="camera matrix: has a skew of 0.5 px"):
        hzn.Camera.from_opencv(skewed, d, size=(640, 480))
    with pytest.raises(hzn.ConfigError, match="it is transposed"):
        hzn.Camera.from_opencv(np.array(k, dtype=float).T, d, size=(640, 480))
    with pytest.raises(hzn.ConfigError, match="finite"):
        hzn.Camera.from_opencv(k, [np.nan, 0.0, 0.0, 0.0], size=(640, 480))


def test_jacobian_is_the_derivative():
    camera = hzn.Camera(**FISHEYE, k=[-0.02])
    points = np.array([[10.0, 20.0], [321.0, 238.0], [600.0, 400.0]])
    by = [(camera.unproject(points + h) - camera.unproject(points - h)) / 2e-3 for h in ([1e-3, 0], [0, 1e-3])]
    assert camera.jacobian(points).shape == (3, 3, 2)
    assert np.allclose(camera.jacobian(points), np.stack(by, axis=2), atol=1e-9)


def test_calibrations_of_others(sensor, tmp_path):
    chain = tmp_path / "chain.yaml"
    chain.write_text(
        "cam0:\n  camera_model: pinhole\n  intrinsics: [300.0, 300.0, 159.5, 119.5]\n"
        "  distortion_model: none\n  distortion_coeffs: []\n  resolution: [320, 240]\n"
    )
    assert hzn.Camera.from_kalibr(chain) == sensor.camera
    with pytest.raises(hzn.ConfigError, match="did you mean cam0"):
        hzn.Camera.from_kalibr(chain, camera="cam1")
    opencv = tmp_path / "opencv.yml"
    opencv.write_text(
        "%YAML:1.0\n---\nimage_width: 320\nimage_height: 240\n"
        "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
        "   data: [ 300., 0., 159.5, 0., 300., 119.5, 0., 0., 1. ]\n"
        "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ 0., 0., 0., 0., 0. ]\n"
    )
    found = hzn.Camera.from_opencv(opencv)
    assert np.array_equal(found.matrix, sensor.camera.matrix) and found.width == 320


def test_any_strides_without_a_copy():
    """Processes a transposed, mirrored view of 400 MB: only the pages that are read become resident."""
    side = 20_000
    sensor = hzn.Sensor(
        camera=dict(width=side, height=side, model="pinhole", fx_px=2e4, fy_px=2e4, cx_px=1e4, cy_px=1e4),
        body={"kind": "earth-sphere", "altitude_km": 400.0},
    )
    with tempfile.TemporaryFile() as file:
        file.truncate(side * side)
        file.seek(0)
        file.write(b"\xff" * (side * side // 64))
        image = np.memmap(file, np.uint8, "r", shape=(side, side)).T[::-1]
        sensor.process(image)
        before = resident_mb()
        report = sensor.process(image)
        assert report.status in ("ok", "no-limb", "rejected", "too-few-points", "truncated")
        assert resident_mb() - before < 100, "the picture was copied"


def resident_mb():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


def test_a_panic_becomes_an_exception(sensor):
    with ThreadPoolExecutor(2) as pool:
        for fault in [pool.submit(hzn._hzn._panic) for _ in range(4)]:
            with pytest.raises(RuntimeError, match="asked for by a test"):
                fault.result()
    assert sensor.process(limb()).ok


@pytest.mark.parametrize("flight", [False, True])
def test_the_same_bits_as_the_command_line(folder, hzn_program, flight):
    out = folder / "out.csv"
    options = ["--flight"] if flight else []
    subprocess.run([hzn_program, "run", "-q", folder, "-o", out, *options], check=True)
    sensor = hzn.Sensor.from_toml(folder / "sensor.toml", flight=flight)
    assert sensor == hzn.Sensor(**PARAMETERS, flight=flight)
    with open(out, newline="") as f:
        rows = list(csv.DictReader(f))
    assert len(rows) == 50
    for i, row in enumerate(rows):
        report = sensor.process(limb(i)).to_dict()
        for name in set(row) - {"index", "file", "time_s", "elapsed_us", "crc32"}:
            value = "" if report[name] is None else report[name]
            assert str(value) == row[name] or float(row[name]) == value, (i, name)


def test_nothing_is_kept(sensor):
    image = limb()
    before = sys.getrefcount(image)
    reports = [sensor.process(image, detail=i % 2 == 0) for i in range(20)]
    assert sys.getrefcount(image) == before and len(reports) == 20
    for _ in range(200):
        with pytest.raises(hzn.ImageError):
            sensor.process(image[0])
    assert sys.getrefcount(image) == before


def test_the_example_of_the_readme_runs(tmp_path, hzn_program, monkeypatch, capsys):
    readme = Path(__file__).parents[3] / "README.md"
    example = readme.read_text().split("```python\n")[1].split("```")[0]
    monkeypatch.chdir(tmp_path)
    subprocess.run([hzn_program, "demo", "d", "--count", "1"], check=True, capture_output=True)
    (tmp_path / "d" / "flight" / "sensor.toml").rename(tmp_path / "sensor.toml")
    (tmp_path / "d" / "flight.mcap").rename(tmp_path / "flight.mcap")
    (tmp_path / "d" / "flight").rename(tmp_path / "flight")
    (tmp_path / "crates").symlink_to(readme.parent / "crates")
    pytest.importorskip("matplotlib").use("Agg")
    names = {}
    exec(example, names)
    assert list(names["table"]["status"]) == ["ok"]
    assert capsys.readouterr().out.splitlines()[-1].split()[1] == "ok"


def test_the_package_is_typed_and_documented():
    assert (Path(hzn.__file__).parent / "py.typed").exists()
    public = [getattr(hzn, name) for name in dir(hzn) if not name.startswith("_")]
    for thing in public:
        assert thing.__doc__ and not thing.__doc__[0].isspace(), thing
        if isinstance(thing, type) and not issubclass(thing, Exception):
            for name in vars(thing):
                assert name.startswith("_") or getattr(thing, name).__doc__, (thing, name)


def test_a_camera_below_the_limb_height_gets_a_report():
    sensor = hzn.Sensor(camera=CAMERA, body={"altitude_km": 400.0, "limb_height_km": 17.0})
    report = sensor.process(limb(), altitude_km=3.2)
    assert report.status == "no-altitude" and report.altitude_km == 3.2
    assert report.detail == "altitude 3.2 km is below the limb height 17 km"
    assert sensor.process(limb(), altitude_km=400.0).altitude_km == 400.0


def test_unused_bits_of_an_array_warn(sensor):
    words = limb().astype(np.uint16)
    assert sensor.process(words).ok and sensor.process(words, bits=8).ok
    with pytest.warns(UserWarning, match="the largest sample is 200 of 65535"):
        assert not sensor.process(np.full_like(words, 200)).ok


def test_a_rig_joins_its_heads(sensor):
    # The cameras look 22 degrees down on opposite sides, so that the body is along y of the vehicle in both.
    c, s = np.cos(np.radians(11)), np.sin(np.radians(11))
    mounts = [[c, -s, 0.0, 0.0], [0.0, 0.0, c, s]]
    rig = hzn.Rig([sensor, sensor], mounts=mounts, names=["left", "right"])
    answers = rig.process({"left": limb(), "right": limb()}, altitude_km=400.0)
    assert list(answers) == ["rig", "left", "right"] and rig.names == ["left", "right"]
    assert np.array_equal(answers["left"].axis, sensor.process(limb(), altitude_km=400.0).axis)
    joint = answers["rig"]
    row = joint.to_dict()
    assert joint.ok and row["head"] == "rig" and row["heads_used"] == "left right" and row["heads_excluded"] is None
    # The limb is 7 km lower than the sensor assumes; the two heads see this with opposite signs.
    assert np.allclose(joint.axis, [0.0, 1.0, 0.0], atol=2e-4) and row["protection_deg"] > 0.0

    alone = rig.process({"right": limb(), "left": None}, altitude_km=400.0)
    assert alone["rig"].to_dict()["detail"] == "left: no picture" and "left" not in alone
    _, y, z = alone["right"].axis
    cos, sin = np.cos(np.radians(22)), np.sin(np.radians(22))
    assert np.allclose(alone["rig"].axis[1:], [y * cos + z * sin, y * sin - z * cos], atol=1e-12)

    with pytest.raises(hzn.ConfigError, match="no head 'lft'|no head \"lft\"; did you mean left"):
        rig.process({"lft": limb()})
    with pytest.raises(hzn.ConfigError, match="mounts: 1 for 2 sensors"):
        hzn.Rig([sensor, sensor], mounts=mounts[:1])
    with pytest.raises(hzn.ConfigError, match=r"\[\[head\]\] 2 mount.q_rig_from_camera_wxyz"):
        hzn.Rig([sensor, sensor], mounts=[mounts[0], [1.0, 1.0, 0.0, 0.0]])
    moon = hzn.Sensor(camera=CAMERA, body={"kind": "moon"})
    with pytest.raises(hzn.ConfigError, match="left looks for earth.* and right for moon"):
        hzn.Rig([sensor, moon], mounts=mounts, names=["left", "right"])
    known = hzn.Sensor(camera=CAMERA, body={"altitude_km": 400.0}, fit={"half_angle": "known"})
    with pytest.raises(hzn.ConfigError, match='head head1: fit.half_angle is "known"'):
        hzn.Rig([sensor, known], mounts=mounts)

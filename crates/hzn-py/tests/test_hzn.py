"""The package as a user meets it. Numbers are tested in Rust; here it is that they arrive, and what is refused."""

import copy
import csv
import pickle
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import hzn

CAMERA = dict(width=320, height=240, model="pinhole", fx_px=300.0, fy_px=300.0, cx_px=159.5, cy_px=119.5)
PARAMETERS = {"camera": CAMERA, "body": {"kind": "earth-sphere", "altitude_km": 400.0}}


def limb(shift=0.0):
    """A bright body with a half-angle of 70 degrees whose centre is 68 degrees below the optical axis."""
    y, x = np.mgrid[0:240, 0:320]
    u, v = (x - 159.5) / 300.0, (y - 119.5) / 300.0
    s = np.radians(68.0 + 0.05 * shift)
    cos = (v * np.sin(s) + np.cos(s)) / np.sqrt(1 + u * u + v * v)
    px = (np.radians(70.38) - np.arccos(np.clip(cos, -1, 1))) * 300.0
    return (20 + 180 * np.clip(0.5 + px / 2, 0, 1)).astype(np.uint8)


@pytest.fixture
def sensor():
    return hzn.Sensor(PARAMETERS)


def test_an_answer_and_its_covariance(sensor):
    report = sensor.process(limb())
    assert report.ok and report.status == "ok" and report.detail == ""
    truth = np.array([0.0, np.sin(np.radians(68)), np.cos(np.radians(68))])
    assert np.degrees(np.arccos(min(1.0, report.axis @ truth))) < 0.1
    assert np.isclose(np.linalg.norm(report.axis), 1.0)
    assert np.allclose(report.covariance @ report.axis, 0.0, atol=1e-12)
    assert np.isclose(np.degrees(np.sqrt(np.linalg.eigvalsh(report.covariance)[-1])), report.sigma_max_deg)
    assert "sigma" in repr(report) and report.altitude_km == 400.0
    assert report.to_dict()["axis_y"] == report.axis[1]


def test_no_limb_is_an_answer_too(sensor):
    report = sensor.process(np.full((240, 320), 9, np.uint8))
    assert not report.ok and report.axis is None and report.covariance is None
    assert report.status in repr(report)


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


@pytest.mark.parametrize(
    ("image", "what"),
    [
        (limb().astype(float), "dtype float64"),
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
        ({"altitude_km": float("nan")}, "altitude_km"),
        ({"altitude_km": -3.0}, "altitude_km"),
        ({"position_km": [np.nan, 0, 0]}, "x_km"),
        ({"position_km": [1000.0, 0, 0]}, "x_km|outside"),
        ({"attitude": [2.0, 0, 0, 0]}, "attitude"),
        ({"attitude_sigma_deg": -1.0, "attitude": [1.0, 0, 0, 0]}, "attitude_sigma_deg"),
    ],
)
def test_what_cannot_be_known_is_refused(sensor, known, what):
    with pytest.raises(hzn.ConfigError, match=what):
        sensor.process(limb(), **known)


def test_parameters_name_their_fault():
    with pytest.raises(hzn.ConfigError, match="did you mean threshold_px"):
        hzn.Sensor({**PARAMETERS, "reject": {"threshold_pxx": 3.0}})
    with pytest.raises(hzn.ConfigError, match="must be above 0"):
        hzn.Sensor({**PARAMETERS, "reject": {"threshold_px": -1.0}})
    with pytest.raises(hzn.ConfigError, match="camera"):
        hzn.Sensor({})
    with pytest.raises(hzn.ConfigError, match="hzn init"):
        hzn.Sensor.from_toml("nowhere.toml")
    assert issubclass(hzn.ConfigError, hzn.HznError) and issubclass(hzn.HznError, ValueError)


def test_parameters_pickle_and_copy(sensor):
    parameters = sensor.parameters
    assert parameters["camera"]["fx_px"] == 300.0
    parameters["reject"]["seed"] = 7
    other = hzn.Sensor(parameters)
    assert other != sensor and other.parameters["reject"]["seed"] == 7
    for twin in (pickle.loads(pickle.dumps(sensor)), copy.deepcopy(sensor), hzn.Sensor(sensor.parameters)):
        assert twin == sensor
        assert np.array_equal(twin.process(limb()).axis, sensor.process(limb()).axis)
    assert hzn.Sensor(PARAMETERS, flight=True) != sensor


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
    assert set(report.stages_us) >= {"contour", "estimate"} and report.candidates[0]["verdict"] == "chosen"
    # Inliers lie on the limb: that is where the projection of the rays is halfway.
    column = report.inliers[np.argmin(abs(report.inliers[:, 0] - 160))]
    assert abs(image[int(round(column[1])), int(round(column[0]))].astype(int) - 110) < 100
    drawn = hzn.overlay(image, report)
    assert drawn.shape == (240, 320, 3) and drawn.dtype == np.uint8
    assert (drawn == [240, 228, 66]).all(axis=2).any()
    plain = sensor.process(image)
    with pytest.raises(hzn.HznError, match="detail=True"):
        plain.inliers
    assert len(plain.limb) == 1


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
    chain = tmp_path / "chain.yaml"
    chain.write_text(
        "cam0:\n  camera_model: pinhole\n  intrinsics: [300.0, 300.0, 159.5, 119.5]\n"
        "  distortion_model: none\n  distortion_coeffs: []\n  resolution: [320, 240]\n"
    )
    assert hzn.Camera.from_kalibr(chain) == camera
    with pytest.raises(hzn.ConfigError, match="did you mean cam0"):
        hzn.Camera.from_kalibr(chain, camera="cam1")


def test_the_same_bits_as_the_command_line(sensor, tmp_path, hzn_program):
    for i in range(50):
        image = limb(i)
        with open(tmp_path / f"{i:02}.pgm", "wb") as f:
            f.write(b"P5\n320 240\n255\n" + image.tobytes())
    lines = ["[camera]"] + [f"{k} = {v!r}".replace("'", '"') for k, v in CAMERA.items()]
    lines += ["[body]", 'kind = "earth-sphere"', "altitude_km = 400.0"]
    (tmp_path / "sensor.toml").write_text("\n".join(lines) + "\n")
    out = tmp_path / "out.mcap"
    subprocess.run([hzn_program, "run", "-q", tmp_path, "-o", out], check=True)
    subprocess.run([hzn_program, "export", out, "-o", tmp_path / "out.csv"], check=True, stderr=subprocess.DEVNULL)
    from_file = hzn.Sensor.from_toml(tmp_path / "sensor.toml")
    assert from_file == sensor
    with open(tmp_path / "out.csv", newline="") as f:
        rows = list(csv.DictReader(f))
    assert len(rows) == 50
    table = hzn.read_mcap(out)
    for i, row in enumerate(rows):
        report = from_file.process(limb(i)).to_dict()
        for name in ("status", "axis_x", "axis_y", "axis_z", "cov_xx", "cov_yz", "sigma_max_deg", "rms_px", "inliers"):
            assert str(report[name]) == row[name] or float(row[name]) == report[name], (i, name)
        assert table["axis_y"][i] == report["axis_y"] and table["status"][i] == "ok"
    assert len({len(column) for column in table.values()}) == 1


def test_the_example_of_the_readme_runs(tmp_path, hzn_program, monkeypatch, capsys):
    readme = Path(__file__).parents[3] / "README.md"
    example = readme.read_text().split("```python\n")[1].split("```")[0]
    monkeypatch.chdir(tmp_path)
    subprocess.run([hzn_program, "demo", "d", "--count", "1"], check=True, capture_output=True)
    for path in (tmp_path / "d" / "flight" / "sensor.toml", tmp_path / "d" / "flight.mcap"):
        path.rename(tmp_path / path.name)
    image = np.zeros((720, 1280), np.uint8)
    image[300:] = 200
    names = {"image": image}
    exec(example, names)
    assert names["picture"].shape == (720, 1280, 3) and list(names["table"]["status"]) == ["ok"]


def test_a_recording_that_is_none(tmp_path):
    with pytest.raises(hzn.HznError, match="cannot read"):
        hzn.read_mcap(tmp_path / "nowhere.mcap")
    other = tmp_path / "other.mcap"
    other.write_bytes(b"nothing")
    with pytest.raises(hzn.HznError, match="not an MCAP"):
        hzn.read_mcap(other)


def test_the_package_is_typed():
    assert (Path(hzn.__file__).parent / "py.typed").exists()
    assert all(hasattr(hzn, name) for name in hzn.__all__)

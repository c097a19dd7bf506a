"""A picture without a usable altitude has the row that the command line writes, in every way of processing."""

import csv
import math
import subprocess

import numpy as np
import pytest

import hzn
from conftest import CAMERA, limb, pgm

KNOWN = {
    "0.pgm": {"altitude_km": 400.0},
    "1.pgm": {},
    "2.pgm": {"altitude_km": math.nan},
    "3.pgm": {"altitude_km": 12.0},
    "4.pgm": {"altitude_km": -0.5},
    "5.pgm": {"altitude_km": 410.0},
}
SENSOR = "[camera]\n" + "".join(f"{k} = {v!r}\n".replace("'", '"') for k, v in CAMERA.items())


@pytest.fixture(params=["earth-sphere", "earth"])
def place(request, tmp_path):
    """Return a folder of pictures with gaps in their table, and the rows of the command line."""
    for i, name in enumerate(KNOWN):
        (tmp_path / name).write_bytes(pgm(limb(i)))
    cells = [known.get("altitude_km", math.nan) for known in KNOWN.values()]
    lines = [f"{name},{'' if math.isnan(km) else km}" for name, km in zip(KNOWN, cells, strict=True)]
    (tmp_path / "frames.csv").write_text("\n".join(["file,altitude_km", *lines]) + "\n")
    (tmp_path / "sensor.toml").write_text(SENSOR + f'[body]\nkind = "{request.param}"\n')
    return tmp_path


@pytest.fixture
def rows(place, hzn_program):
    out = place / "out.csv"
    ran = subprocess.run([hzn_program, "run", "-q", place, "-o", out], check=False)
    assert ran.returncode == 3
    with open(out) as file:
        return list(csv.DictReader(file))


def compare(reports, rows):
    assert [row["status"] for row in rows] == ["ok", *["no-altitude"] * 4, "ok"]
    for report, row in zip(reports, rows, strict=True):
        assert (report.status, report.detail) == (row["status"], row["detail"])
        mine = report.to_dict()
        for name in ("altitude_km", "axis_x", "axis_y", "axis_z", "sigma_max_deg", "half_angle_deg"):
            assert (mine[name] is None) == (row[name] == ""), name
            assert mine[name] is None or mine[name] == float(row[name]), name


def test_arrays(place, rows):
    sensor = hzn.Sensor.from_toml(place / "sensor.toml")
    pictures = [(limb(i), known) for i, known in enumerate(KNOWN.values())]
    compare([sensor.process(image, **known) for image, known in pictures], rows)
    compare(sensor.process_many(pictures, jobs=2), rows)
    flight = hzn.Sensor.from_toml(place / "sensor.toml", flight=True)
    assert [flight.process(image, **known).detail for image, known in pictures] == [row["detail"] for row in rows]


def test_files(place, rows):
    sensor = hzn.Sensor.from_toml(place / "sensor.toml")
    compare(sensor.process_many(place), rows)
    compare(sensor.process_many([place / name for name in KNOWN]), rows)


def test_gaps_of_every_kind(sensor):
    """A row of a table of pandas gives NaN for each value that is missing."""
    three, four = [math.nan] * 3, [math.nan] * 4
    gaps = dict(
        altitude_km=math.nan,
        position_km=three,
        attitude=four,
        attitude_sigma_deg=math.nan,
        rate_rad_s=three,
        range_km=math.nan,
        range_sigma_km=math.nan,
        pole=three,
        sun=three,
        time_s=math.nan,
        camera_temperature_c=math.nan,
    )
    report, expected = sensor.process(limb(), **gaps), sensor.process(limb())
    assert report.ok and report.altitude_km == 400.0 and (report.axis == expected.axis).all()
    # The single stages need a cone, and so an altitude.
    assert sensor.expect(altitude_km=math.nan).half_angle_deg == sensor.expect().half_angle_deg
    with pytest.raises(hzn.ConfigError, match="no altitude"):
        hzn.Sensor(camera=CAMERA, body={"kind": "earth-sphere"}).expect()
    # A gap in a part of an array is a fault.
    with pytest.raises(hzn.ConfigError, match="x_km"):
        sensor.process(limb(), position_km=[7000.0, math.nan, 0.0])


def test_the_lens_follows_the_temperature():
    """A sensor with a temperature answers as one whose lens is that of the temperature."""
    change = {"reference_c": 20.0, "focal_ppm_per_k": 400.0, "cx_px_per_k": 0.05}
    body = {"kind": "earth-sphere", "altitude_km": 400.0}
    sensor = hzn.Sensor(camera={**CAMERA, "temperature": change}, body=body)
    factor = 1 - 20 * 400e-6
    cold = {"fx_px": CAMERA["fx_px"] * factor, "fy_px": CAMERA["fy_px"] * factor, "cx_px": CAMERA["cx_px"] - 1.0}
    expected = hzn.Sensor(camera={**CAMERA, **cold}, body=body).process(limb())
    told = sensor.process(limb(), camera_temperature_c=0.0)
    (many,) = sensor.process_many([(limb(), {"camera_temperature_c": 0.0})])
    for report in (told, many):
        assert report.ok and np.abs(report.axis - expected.axis).max() < 1e-12
    assert np.abs(sensor.process(limb()).axis - expected.axis).max() > 1e-4
    with pytest.raises(hzn.ConfigError, match="camera_temperature_c"):
        sensor.process(limb(), camera_temperature_c=293.15)


def test_a_body_that_has_no_limb_in_view():
    """The reasons of a sensor of a position are rows as well."""
    sensor = hzn.Sensor(camera=CAMERA, body={"kind": "jupiter"})
    inside = sensor.process(limb(), attitude=[1, 0, 0, 0], position_km=[60_000.0, 0, 0], range_km=6e4, range_sigma_km=1)
    far = sensor.process(limb(), attitude=[1, 0, 0, 0], range_km=1e9, range_sigma_km=1.0)
    assert (inside.status, far.status) == ("no-altitude", "no-altitude")
    assert "inside the body" in inside.detail and "px wide at this distance" in far.detail


def test_a_wrong_altitude_is_told(sensor):
    picture = limb()
    assert sensor.what_fits(picture) is None, "the limb has the expected size"
    assert not sensor.process(picture, altitude_km=1500.0).ok
    words = sensor.what_fits(picture, altitude_km=1500.0)
    assert words.startswith("the limb fits 70.") and "a field of view of" in words and "at 1500 km" in words
    altitude, sigma = words.split("altitude ")[1].split(" km")[0].split(" +- ")
    assert abs(float(altitude) - 400.0) < 3.0 * float(sigma)
    with pytest.raises(hzn.ImageError):
        sensor.what_fits(picture[:10])

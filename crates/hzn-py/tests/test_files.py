"""Tests of picture files: Python's answers are those of the command, whichever way the file comes in."""

import csv
import io
import itertools
import json
import subprocess

import cv2
import numpy as np
import pytest
from PIL import Image, PngImagePlugin

import hzn
from conftest import PARAMETERS, limb
from test_first_start import PHOTOGRAPH

SENSOR = """[camera]
width = 320
height = 240
model = "pinhole"
fx_px = 300.0
fy_px = 300.0
cx_px = 159.5
cy_px = 119.5
[body]
kind = "earth"
altitude_km = 400.0
[edge_points]
sub_pixel = "{sub_pixel}"
"""


def say_srgb():
    chunks = PngImagePlugin.PngInfo()
    chunks.add(b"sRGB", b"\x00")
    return chunks


def write(kind, path):
    """Write a picture whose header says a tone or has more than 8 bits."""
    picture = limb()
    if kind == "png":
        Image.fromarray(picture).save(path)
    elif kind == "srgb.png":
        Image.fromarray(picture).save(path, pnginfo=say_srgb())
    elif kind == "jpg":
        Image.fromarray(picture).save(path, quality=95)
    elif kind == "12bit.png":
        assert cv2.imwrite(str(path), picture.astype(np.uint16) * 16)
    else:
        path.write_bytes(b"P5\n320 240\n1023\n" + (picture.astype(np.uint16) * 4).astype(">u2").tobytes())


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("sub_pixel", ["linear", "none"])
@pytest.mark.parametrize("kind", ["png", "srgb.png", "jpg", "12bit.png", "pgm"])
def test_every_way_in_gives_the_answer_of_the_command(kind, sub_pixel, tmp_path, hzn_program):
    path = tmp_path / f"a.{kind}"
    write(kind, path)
    (tmp_path / "sensor.toml").write_text(SENSOR.format(sub_pixel=sub_pixel))
    sensor = hzn.Sensor.from_toml(tmp_path / "sensor.toml")
    ran = subprocess.run([hzn_program, "run", "-q", path, "-o", "-", "--format", "csv"], check=True, capture_output=True)
    (row,) = csv.DictReader(io.StringIO(ran.stdout.decode()))
    assert row["status"] == "ok"

    (many,) = sensor.process_many([path])
    (paired,) = sensor.process_many([(path, {})])
    rig = hzn.Rig([sensor], mounts=[[1, 0, 0, 0]])
    for report in [sensor.process(path), many, paired, rig.process({"head0": path})["head0"]]:
        expected = {"axis_x": report.axis[0], "cov_xx": report.covariance[0, 0], "sigma_max_deg": report.sigma_max_deg}
        assert {name: float(row[name]) for name in expected} == expected
        assert report.level == int(row["level"])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_photograph_is_taken_as_srgb():
    # The edge of a photograph is at half of its light, which is not half of its counts.
    told = hzn.Sensor.start(PHOTOGRAPH, fov_deg=38, altitude_km=418)
    parameters = told.parameters
    assert parameters["input"].pop("tone") == "srgb"
    sensor = hzn.Sensor(**parameters)
    assert np.array_equal(sensor.process(PHOTOGRAPH).axis, told.process(PHOTOGRAPH).axis)
    # An array has no header. Another decoder rounds some pixels differently.
    pixels = np.asarray(Image.open(PHOTOGRAPH))
    assert np.allclose(told.process(pixels).axis, told.process(PHOTOGRAPH).axis, atol=2e-5)
    assert not np.allclose(sensor.process(pixels).axis, told.process(PHOTOGRAPH).axis, atol=2e-4)


def test_the_fitting_field_of_view_is_told_of_a_file(tmp_path):
    path = tmp_path / "a.png"
    write("png", path)
    wrong = hzn.Sensor(**PARAMETERS | {"body": {"kind": "earth-sphere", "altitude_km": 2000.0}})
    assert wrong.what_fits(path) == wrong.what_fits(limb())
    assert "altitude" in wrong.what_fits(path)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_row_of_a_report_is_that_of_the_command(tmp_path, hzn_program):
    path = tmp_path / "a.png"
    write("png", path)
    (tmp_path / "sensor.toml").write_text(SENSOR.format(sub_pixel="linear") + "[mount]\n"
                                          "q_vehicle_from_camera_wxyz = [0.5, 0.5, 0.5, 0.5]\n")
    rows = {}
    for form in ("csv", "jsonl"):
        command = [hzn_program, "run", "-q", path, "-o", "-", "--format", form]
        rows[form] = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    expected = json.loads(rows["jsonl"])
    # The checksum of a line of a file, which a report does not have.
    columns = rows["csv"].splitlines()[0].split(",")
    assert columns.pop() == "crc32" and expected.pop("crc32")
    (report,) = hzn.Sensor.from_toml(tmp_path / "sensor.toml").process_many([path])
    row = report.to_dict()
    assert list(row) == list(expected) == columns
    assert {**row, "elapsed_us": None} == {**expected, "elapsed_us": None}
    # Every array of the report is there, number by number.
    for stem, vector in [("axis", report.axis), ("axis_free", report.axis_free), ("axis_v", report.axis_vehicle),
                         ("axis_by_cos", report.axis_by_cos)]:
        assert [row[f"{stem}_{i}"] for i in "xyz"] == list(vector)
    for stem, matrix in [("cov", report.covariance), ("cov_free", report.covariance_free),
                         ("cov_common", report.covariance_common)]:
        for (i, a), (j, b) in itertools.combinations_with_replacement(enumerate("xyz"), 2):
            assert row[f"{stem}_{a}{b}"] == matrix[i, j]
    for name in ("index", "file", "time_s", "body", "status", "detail", "p_limb", "protection_deg", "sigma_max_deg",
                 "altitude_km", "altitude_est_km", "half_angle_deg", "rms_px", "roll_deg", "pitch_deg"):
        assert row[name] == getattr(report, name)
    # What the docstring leaves out.
    assert not any(name.startswith("nadir") for name in row) and report.nadir is not None

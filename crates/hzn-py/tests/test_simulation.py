"""Tests of scenes with truth, evaluation and sensitivity: the numbers equal those of the command line."""

import csv
import json
import re
import subprocess

import numpy as np
import pytest

import hzn


@pytest.fixture(scope="module")
def small():
    """Return an infrared scene with a quarter of the pixels."""
    scene = hzn.simulate("leo-infrared").parameters
    camera = dict(scene["camera"], width=192, height=144, fx_px=46.0, fy_px=46.0, cx_px=95.5, cy_px=71.5)
    return hzn.simulate({**scene, "camera": camera}, frames=3)


def test_a_flight_is_answered_and_evaluated(small):
    assert len(small) == 3 and len(list(small)) == 3 and small[-1].file == small[2].file
    sensor = hzn.Sensor(camera=small.parameters["camera"], body={"limb_height_km": 25.0, "limb_height_sigma_km": 4.5})
    reports = list(sensor.process_many((frame.image, frame.known) for frame in small))
    result = hzn.evaluate(reports, small)
    (earth,) = result["evaluations"]
    assert earth["answered"] == 3 and earth["errors"]["worst_deg"] < 0.3
    frames = result["frames"]
    assert [f["file"] for f in frames] == [f.file for f in small]
    for frame, report, simulated in zip(frames, reports, small, strict=True):
        truth = simulated.truth[0]
        angle = np.degrees(np.arccos(min(1.0, report.axis @ [truth["axis_x"], truth["axis_y"], truth["axis_z"]])))
        assert np.isclose(frame["miss"]["angle_deg"], angle, atol=1e-5)
    with pytest.raises(hzn.HznError, match="none among the results"):
        hzn.evaluate(reports[:2], small)


def test_a_scene_is_the_command_lines(small, tmp_path, hzn_program):
    """Pictures, truth, priors, and the sensor with its measured noise are the same as `hzn simulate` writes."""
    scene = tmp_path / "scene.toml"
    shown = subprocess.run([hzn_program, "simulate", "leo-infrared", "--show"], check=True, capture_output=True, text=True)
    text = shown.stdout
    for key, value in [("width", 192), ("height", 144), ("fx_px", 46.0), ("fy_px", 46.0), ("cx_px", 95.5), ("cy_px", 71.5)]:
        text = re.sub(rf"(?m)^{key} = .*$", f"{key} = {value}", text, count=1)
    scene.write_text(text)
    out = tmp_path / "flight"
    subprocess.run([hzn_program, "simulate", "-q", scene, "--frames", "3", "-o", out], check=True, capture_output=True)
    assert hzn.Sensor.from_toml(out / "sensor.toml") == small.sensor
    written = list(small.sensor.process_many(out))
    for frame, report in zip(small, written, strict=True):
        again = small.sensor.process(frame.image, **frame.known)
        assert report.file == frame.file and report.level == again.level
        assert np.array_equal(report.covariance, again.covariance)
    with open(out / "truth.csv", newline="") as f:
        rows = list(csv.DictReader(f))
    assert [float(row["axis_y"]) for row in rows] == [frame.truth[0]["axis_y"] for frame in small]
    assert not np.array_equal(hzn.simulate(small.parameters, seed=9)[1].image, small[1].image)


def test_scenes_that_cannot_be(small):
    for scene, what in [
        ("horac", "did you mean horace"),
        ({**small.parameters, "sed": 1}, "seed"),
        ({**small.parameters, "capture": {"to_s": 1.0, "frames": 0}}, r"\[capture\] frames"),
    ]:
        with pytest.raises(hzn.ConfigError, match=what):
            hzn.simulate(scene)
    with pytest.raises(IndexError):
        small[3]


def test_an_evaluation_is_the_command_lines(tmp_path, hzn_program):
    subprocess.run([hzn_program, "demo", tmp_path / "d", "--count", "3"], check=True, capture_output=True)
    flight = tmp_path / "d" / "flight"
    out = tmp_path / "report.json"
    recording = tmp_path / "d" / "flight.mcap"
    subprocess.run([hzn_program, "evaluate", recording, "--truth", flight, "-o", out], check=True, capture_output=True)
    expected = json.loads(out.read_text())
    found = hzn.evaluate(recording, flight)
    assert found["evaluations"] == expected["evaluations"] and found["frames"] == expected["frames"]
    with pytest.raises(hzn.HznError, match="no such file"):
        hzn.evaluate(tmp_path / "nothing.mcap", flight)


def test_a_sensitivity_is_the_command_lines(tmp_path, hzn_program):
    out = tmp_path / "s.csv"
    arguments = ["sensitivity", "--fov", "60,120", "--altitude", "100,200", "-o", out]
    subprocess.run([hzn_program, *arguments], check=True, capture_output=True)
    with open(out, newline="") as f:
        rows = list(csv.DictReader(f))
    table = hzn.sensitivity(fov_deg=[60, 120], altitude_km=[100, 200])
    assert len(rows) == len(table["fov_deg"]) == 4
    shared = set(rows[0]) & set(table)
    assert {"fov_deg", "altitude_km", "half_angle_deg"} < shared and sum("sigma" in n or "pitch" in n for n in shared) > 2
    for i, row in enumerate(rows):
        for name, value in table.items():
            if name in row and row[name]:
                assert np.isclose(float(row[name]), value[i], rtol=1e-6), (i, name)
    with pytest.raises(hzn.ConfigError, match="fov_deg"):
        hzn.sensitivity(fov_deg=176, altitude_km=200)
    with pytest.raises(hzn.ConfigError, match="not above the limb"):
        hzn.sensitivity(altitude_km=5)


def test_a_position_has_range_and_covariance():
    """The position of a planet comes from its limb alone; a known range makes it better."""
    flight = hzn.simulate("jupiter", frames=2)
    sensor = hzn.Sensor(camera=flight.parameters["camera"], body={"kind": "jupiter"})
    found = 0
    for frame in flight:
        known = {name: value for name, value in frame.known.items() if not name.startswith("range")}
        report = sensor.process(frame.image, **known)
        if report.position_km is None:
            continue
        found += 1
        truth = np.array([frame.truth[0][f"position_{axis}_km"] for axis in "xyz"])
        covariance = report.position_covariance_km2
        assert np.allclose(covariance, covariance.T) and np.all(np.linalg.eigvalsh(covariance) > 0)
        off = report.position_km - truth
        assert off @ np.linalg.solve(covariance, off) < 25.0
        assert report.body_fixed_km is not None and report.axis_free is None
        distance = float(np.linalg.norm(truth))
        better = sensor.process(frame.image, **known, range_km=distance, range_sigma_km=1e-4 * distance)
        assert abs(np.linalg.norm(better.position_km) - distance) < 5e-4 * distance
    assert found > 0
    with pytest.raises(hzn.ConfigError, match="range_sigma_km"):
        sensor.process(flight[0].image, attitude=[1, 0, 0, 0], range_km=1e7)
    with pytest.raises(hzn.ConfigError, match="pole"):
        sensor.process(flight[0].image, pole=[0, 0, 0])

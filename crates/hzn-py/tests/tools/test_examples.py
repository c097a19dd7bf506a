"""The examples against the real libraries: each answer is right within three of its sigmas."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hzn

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
import basilisk_loop
import rerun_log


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
    nees = []
    for _, report, centre, _ in log:
        miss = report.nadir - centre
        nees.append(miss @ np.linalg.pinv(report.covariance, rcond=1e-6) @ miss)
    axis = np.array([angle(report.axis, centre) for _, report, centre, _ in log])
    theirs = np.array([angle(basilisk_loop.basilisks_direction(r, q), c) for _, r, c, q in log[::10]])
    settled = np.array([error for time_s, error in errors if time_s > 1500])
    with capsys.disabled():
        rms = basilisk_loop.rms
        print(f"\nto the centre, RMS: nadir {rms(off):.4f}, axis {rms(axis):.4f}, horizonOpNav {rms(theirs):.4f} deg;")
        print(f"NEES (2 degrees of freedom) {np.mean(nees):.2f}; pointing RMS {rms(settled):.4f}, at most {settled.max():.4f} deg")
    # The axis is not the direction to the centre, and the half pixel counts: both traps would show here.
    assert axis.max() > 0.15 and basilisk_loop.rms(off) < 0.2 * basilisk_loop.rms(axis)
    assert basilisk_loop.rms(theirs) > 3 * basilisk_loop.rms(off)
    # The loop holds the satellite within three sigmas of a single answer.
    assert settled.max() < 3 * sigma.mean(), settled.max()
    # The limb height is the one that the sensor expects, so the answers are better than their sigmas say.
    assert np.mean(nees) < 2.5, np.mean(nees)


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


def test_a_recording_of_rerun_has_the_answers(tmp_path):
    flight = hzn.simulate("leo-infrared", frames=6)
    path = tmp_path / "flight.rrd"
    reports = rerun_log.record(path, flight, flight.sensor)
    result = hzn.evaluate(reports, flight)
    assert all(f["miss"]["angle_deg"] < 3 * r.sigma_max_deg for f, r in zip(result["frames"], reports, strict=True))
    rerun = [sys.executable, "-m", "rerun", "rrd"]
    subprocess.run([*rerun, "verify", path], check=True)
    text = subprocess.run([*rerun, "print", "-vvv", path], check=True, capture_output=True, text=True).stdout
    chunks = re.split(r"(?m)^(?=Chunk\()", text)
    read = [float(x) for c in chunks if "/plots/sigma_max_deg" in c for x in re.findall(r"┆ \[([0-9.e-]+)\]", c)]
    assert sorted(read) == sorted(report.sigma_max_deg for report in reports)
    for entity in ("/camera/image/limb", "/camera/image/inliers", "/camera/axis/three_sigma"):
        rows = sum(int(n) for n in re.findall(rf"(?m)^Chunk\(\S+ with (\d+) rows? .* - {entity} -", text))
        assert rows == len(reports), (entity, rows)

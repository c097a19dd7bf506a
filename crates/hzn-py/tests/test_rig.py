"""Sequences of epochs of several cameras."""

import numpy as np
import pytest
from conftest import CAMERA, limb

import hzn

# The cameras look 22 degrees down on opposite sides, so that the body is along y of the vehicle in both.
C, S = np.cos(np.radians(11)), np.sin(np.radians(11))
MOUNTS = [[C, -S, 0.0, 0.0], [0.0, 0.0, C, S]]


def noisy(seed):
    """The limb with the noise of a camera, which never repeats."""
    noise = np.random.default_rng(seed).normal(0.0, 2.0, limb().shape)
    return np.clip(np.round(limb() + noise), 0, 255).astype(np.uint8)


def epochs(count):
    return [{"left": noisy(2 * i), "right": noisy(2 * i + 1)} for i in range(count)]


@pytest.fixture
def rig(sensor):
    return hzn.Rig([sensor, sensor], mounts=MOUNTS, names=["left", "right"])


def same(a, b):
    """Whether two reports are equal but for their number and the time that they took."""
    rows = [report.to_dict() for report in (a, b)]
    for row in rows:
        row.pop("index"), row.pop("elapsed_us")
    return rows[0] == rows[1]


@pytest.mark.parametrize("jobs", [1, 3, None])
def test_a_sequence_has_the_answers_of_its_epochs(rig, jobs):
    pictures = epochs(12)
    many = list(rig.process_many(iter(pictures), jobs=jobs))
    assert [[report.index for report in answers.values()] for answers in many] == [[i] * 3 for i in range(12)]
    for answers, images in zip(many, pictures, strict=True):
        alone = rig.process(images)
        assert list(answers) == list(alone) == ["rig", "left", "right"]
        assert all(same(answers[name], alone[name]) for name in alone)
        assert answers["rig"].to_dict()["heads_used"] == "left right"


def test_what_is_known_of_an_epoch_comes_with_it(rig):
    (told,) = rig.process_many([(epochs(1)[0], {"altitude_km": 390.0, "time_s": 5.0, "bits": 8})])
    assert same(told["rig"], rig.process(epochs(1)[0], altitude_km=390.0, time_s=5.0)["rig"])
    assert told["rig"].altitude_km == 390.0 and told["rig"].time_s == 5.0
    with pytest.raises(TypeError, match=r"Rig.process\(\).*'altitude'"):
        list(rig.process_many([(epochs(1)[0], {"altitude": 390.0})]))
    with pytest.raises(TypeError, match=r"Rig.process\(\).*'range_km'"):
        list(rig.process_many([(epochs(1)[0], {"range_km": 390.0})]))
    with pytest.raises(hzn.ConfigError, match="jobs: 0 is refused"):
        rig.process_many([], jobs=0)
    assert list(rig.process_many([])) == []


def test_a_head_that_repeats_its_picture_is_excluded(rig):
    pictures = epochs(4)
    pictures[2]["right"] = pictures[1]["right"].copy()
    pictures[3]["left"] = pictures[3]["right"]
    rows = [answers["rig"].to_dict() for answers in rig.process_many(pictures, jobs=2)]
    assert [row["heads_used"] for row in rows] == ["left right", "left right", "left", None]
    assert [row["heads_excluded"] for row in rows] == [None, None, "right", "left right"]
    assert rows[2]["detail"] == "right: the picture of the epoch before"
    assert rows[3]["detail"].endswith("left: the picture of another head, right: the picture of another head")
    # At the same time, it is the same picture, which was stored twice. A single call knows no epoch before.
    stored = [(pictures[1], {"time_s": 1.0})] * 2
    assert all(answers["rig"].to_dict()["heads_excluded"] is None for answers in rig.process_many(stored))
    assert [rig.process(images)["rig"].ok for images in pictures[:3]] == [True] * 3


def test_a_lost_picture_costs_only_its_head(rig, tmp_path):
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"no picture")
    first, second, third = epochs(3)
    lost = [{**first, "left": broken}, {**second, "right": None}, third]
    answers = list(rig.process_many(lost))
    assert answers[0]["left"].status == "unreadable" and "broken.png" in answers[0]["left"].detail
    assert [a["rig"].to_dict()["heads_used"] for a in answers] == ["right", "left", "left right"]
    assert answers[0]["rig"].to_dict()["detail"] == "left: unreadable" and "right" not in answers[1]
    # An array that is no picture is a mistake of the program. The answers before it come first.
    wrong = rig.process_many([third, {"left": np.zeros((3, 3), np.uint8)}], jobs=1)
    assert next(wrong)["rig"].ok
    with pytest.raises(hzn.ImageError, match="3 x 3"):
        next(wrong)


def test_a_rig_without_an_altitude_searches_between_two():
    gates = {"altitude_limits_km": [300.0, 500.0]}
    head = hzn.Sensor(camera=CAMERA, body={"kind": "earth-sphere"}, gates=gates)
    answers = hzn.Rig([head, head], mounts=MOUNTS).process({"head0": noisy(0), "head1": noisy(1)})
    row = answers["rig"].to_dict()
    assert row["status"] == "ok" and row["altitude_km"] is None and row["limb_height_est_km"] is None
    assert abs(row["altitude_est_km"] - 400.0) < 4.0 * row["altitude_est_sigma_km"] < 100.0
    assert np.allclose(answers["rig"].axis, [0.0, 1.0, 0.0], atol=3e-3)
    # Without the limits, nothing is known, and the answer says what to tell.
    head = hzn.Sensor(camera=CAMERA, body={"kind": "earth-sphere"})
    answers = hzn.Rig([head, head], mounts=MOUNTS).process({"head0": noisy(0), "head1": noisy(1)})
    assert answers["head0"].status == "no-altitude" and answers["rig"].status == "no-limb"
    assert "gates.altitude_limits_km" in answers["rig"].detail

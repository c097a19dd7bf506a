"""Tests of recordings, picture by picture."""

import struct

import numpy as np
import pytest

import hzn
from conftest import limb


def test_frames_with_their_pictures(sensor, recording):
    with hzn.open_mcap(recording) as opened:
        assert opened.sensor() == sensor and "[camera]" in opened.sensor_toml and opened.metadata["program"]
        count = 0
        for count, frame in enumerate(opened, 1):
            report = frame.report
            assert report.ok and report.file == f"{count - 1:02}.pgm"
            if count <= 3:
                image = frame.image
                assert np.array_equal(image, limb(count - 1))
                again = sensor.process(image, detail=True)
                assert np.array_equal(again.axis, report.axis) and np.array_equal(again.inliers, report.inliers)
                assert np.allclose(again.rays, report.rays) and report.candidates == again.candidates
                assert hzn.overlay(image, report).shape == (240, 320, 3)
        assert count == 50
    with pytest.raises(hzn.HznError, match="closed"):
        next(opened)


def test_columns_of_equal_length(recording):
    table = hzn.read_mcap(recording)
    assert {len(column) for column in table.values()} == {50} and set(table["status"]) == {"ok"}
    assert np.isnan(table["roll_deg"]).all() and table["index"].dtype == np.uint64


def test_a_recording_that_is_none(tmp_path):
    for read in (hzn.read_mcap, hzn.open_mcap):
        with pytest.raises(hzn.HznError, match="cannot read"):
            read(tmp_path / "nowhere.mcap")
        other = tmp_path / "other.mcap"
        other.write_bytes(b"nothing")
        with pytest.raises(hzn.HznError, match="not an MCAP"):
            read(other)


def test_a_recording_that_was_cut(recording, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recording.read_bytes()[:-20_000])
    frames = list(hzn.open_mcap(cut))
    assert 0 < len(frames) < 50 and all(frame.report.ok for frame in frames)


def test_a_recording_that_was_cut_off_warns(recording):
    whole = recording.read_bytes()
    cut = recording.with_name("cut.mcap")
    cut.write_bytes(whole[:-20_000])
    with pytest.warns(UserWarning, match="was cut off; its finished pictures were read"):
        table = hzn.read_mcap(cut)
    assert 0 < len(table["file"]) < 50
    with pytest.warns(UserWarning, match="was cut off"), hzn.open_mcap(cut) as opened:
        assert len(list(opened)) == len(table["file"])


def test_a_recording_in_an_unknown_compression_warns(recording):
    other = recording.with_name("other.mcap")
    # The name of the compression in each chunk, after its length.
    other.write_bytes(recording.read_bytes().replace(b"\x04\0\0\0zstd", b"\x04\0\0\0zstx"))
    with pytest.warns(UserWarning, match='"zstx"'):
        assert len(hzn.read_mcap(other)["file"]) == 0
    with pytest.warns(UserWarning, match='"zstx"'), hzn.open_mcap(other) as opened:
        assert list(opened) == []


def mcap(schema):
    """Return a recording of two messages in the place of results, as another program may write it."""

    def text(value):
        return struct.pack("<I", len(value)) + value

    def record(op, content):
        return struct.pack("<BQ", op, len(content)) + content

    header = record(1, text(b"") + text(b"another program"))
    declared = record(3, struct.pack("<H", 1) + text(schema) + text(b"jsonschema") + text(b"{}"))
    channel = record(4, struct.pack("<HH", 1, 1) + text(b"/hzn/report") + text(b"json") + struct.pack("<I", 0))
    messages = record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + b"{}") * 2
    end = record(15, bytes(4)) + record(2, bytes(20))
    magic = b"\x89MCAP0\r\n"
    return magic + header + declared + channel + messages + end + magic


def test_reports_with_another_schema_are_told(tmp_path):
    other = tmp_path / "other.mcap"
    other.write_bytes(mcap(b"other.Report"))
    what = "2 messages on /hzn/report cannot be read as results, because the channel has another schema"
    with pytest.warns(UserWarning, match=what):
        assert len(hzn.read_mcap(other)["file"]) == 0
    with pytest.warns(UserWarning, match=what), hzn.open_mcap(other) as opened:
        assert list(opened) == []
    # With the name of hzn's schema they would be results, so it is the schema that is told.
    other.write_bytes(mcap(b"hzn.Report"))
    with pytest.raises(hzn.HznError, match="report of frame 0"):
        hzn.read_mcap(other)


def test_no_message_has_what_a_terminal_obeys(recording, tmp_path):
    evil = "\x1b]52;c;aGk\x07\x9b31m\u202e\u2066\x7f"
    shown = r"\x1b]52;c;aGk\x07\x9b31m\u{202e}\u{2066}\x7f"
    sensor = tmp_path / "evil.toml"
    escaped = "".join(f"\\u{ord(c):04x}" if not (c.isascii() and c.isprintable()) else c for c in evil)
    sensor.write_text((recording.parent / "sensor.toml").read_text() + f'["{escaped}"]\na = 1\n')
    with pytest.raises(hzn.ConfigError) as refused:
        hzn.Sensor.from_toml(sensor)
    assert shown in str(refused.value) and evil not in str(refused.value)
    with pytest.raises(hzn.HznError) as refused:
        hzn.read_mcap(tmp_path / f"{evil}.mcap")
    assert shown in str(refused.value) and "\x1b" not in str(refused.value)
    cut = tmp_path / f"{evil}.mcap"
    cut.write_bytes(recording.read_bytes()[:-20_000])
    with pytest.warns(UserWarning) as warned:
        hzn.read_mcap(cut)
    assert [str(warning.message) for warning in warned] != []
    assert not any(c in str(warning.message) for warning in warned for c in evil if c not in shown)

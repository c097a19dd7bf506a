"""Tests of sequences: reports in order, bounded memory, interrupts."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import hzn
from conftest import PARAMETERS, limb, pgm
from hzn._many import _TASK_ITEMS, _in_order


@pytest.fixture
def interruptible():
    """Handle Ctrl-C like a program in a terminal; a program that was started in the background ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def threads_left():
    return [t.name for t in threading.enumerate() if t.name.startswith("hzn")]


def test_arrays_come_out_in_order(sensor):
    pictures = [limb(i) for i in range(20)]
    alone = [sensor.process(p).axis for p in pictures]
    for images in (pictures, iter(pictures), ((p, {}) for p in pictures)):
        many = list(sensor.process_many(images, jobs=3))
        assert all(np.array_equal(a, b.axis) for a, b in zip(alone, many, strict=True))
    assert list(sensor.process_many([])) == []


def test_the_limb_of_a_sequence_is_tracked(sensor):
    pictures = [limb(0.5 * i) for i in range(12)]
    pictures[7] = np.full_like(pictures[7], 20)
    parameters = {**sensor.parameters, "track": {"full_every": 5}}
    tracking = hzn.Sensor(**parameters)
    many = list(tracking.process_many(pictures, jobs=4))
    # Every fifth picture is searched fully, and so is the one without a limb and the one after it.
    assert [i for i, report in enumerate(many) if report.tracked] == [1, 2, 3, 4, 6, 9, 11]
    assert [report.status for report in many] == ["no-limb" if i == 7 else "ok" for i in range(12)]
    for picture, report in zip(pictures, many, strict=True):
        # A single picture is never tracked.
        alone = tracking.process(picture)
        assert not alone.tracked
        if report.status == "ok":
            apart = np.linalg.norm(alone.axis - report.axis)
            assert apart == 0 if not report.tracked else apart < np.radians(report.sigma_max_deg)
    again = list(tracking.process_many(pictures))
    assert all(np.array_equal(a.axis, b.axis) for a, b in zip(many, again, strict=True) if a.status == "ok")


def test_what_is_known_of_each_picture(sensor):
    many = sensor.process_many((limb(), {"altitude_km": km}) for km in (390.0, 400.0, 410.0))
    assert [r.altitude_km for r in many] == [390.0, 400.0, 410.0]


@pytest.mark.parametrize(("side", "task_items"), [(16, _TASK_ITEMS), (3000, 1)])
def test_no_more_is_taken_than_is_worked_on(side, task_items):
    camera = dict(width=side, height=side, model="pinhole", fx_px=1e4, fy_px=1e4, cx_px=side / 2, cy_px=side / 2)
    sensor = hzn.Sensor(**{**PARAMETERS, "camera": camera})
    image = np.full((side, side), 9, np.uint8)
    taken = 0

    def endless():
        nonlocal taken
        while True:
            taken += 1
            yield image

    reports = sensor.process_many(endless(), jobs=2)
    for returned in range(1, 500 if task_items > 1 else 20):
        assert next(reports).status == "no-limb"
        # There are two tasks for each thread, and one more in transfer.
        assert returned <= taken <= returned + task_items * (2 * 2 + 1)
    reports.close()
    assert not threads_left()


def test_an_interrupt_ends_it(sensor, interruptible):
    taken = 0

    def endless():
        nonlocal taken
        while True:
            taken += 1
            if taken == 20:
                signal.raise_signal(signal.SIGINT)
            yield limb()

    with pytest.raises(KeyboardInterrupt):
        for report in sensor.process_many(endless(), jobs=2):
            assert report.ok
    assert taken == 20 and not threads_left()
    assert sensor.process(limb()).ok


def test_an_interrupt_waits_for_no_more_than_a_picture(interruptible):
    begun, at = [], 0

    def slow(item):
        begun.append(item)
        time.sleep(0.05)
        return item

    def interrupt():
        nonlocal at
        while len(begun) < 5:
            time.sleep(0.005)
        at = len(begun)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        list(_in_order(slow, range(10_000), 2))
    # These are the tasks of the two threads, and one more each until the caller wakes up.
    assert at <= len(begun) <= at + 4 and not threads_left()


def test_pictures_that_come_slowly_are_not_waited_for():
    """The reports of a camera come while it takes more pictures, not only when a task is full."""
    processed = []

    def camera():
        for i in range(12):
            time.sleep(0.02)
            yield i

    for i in _in_order(lambda item: processed.append(item) or item, camera(), 2):
        # The item before was processed when this one came.
        assert len(processed) <= i + 3
    assert processed == list(range(12))


def test_what_comes_after_an_error_of_the_iterable(sensor):
    def broken():
        yield limb()
        yield limb()
        raise OSError("no more film")

    reports = sensor.process_many(broken(), jobs=2)
    assert next(reports).ok and next(reports).ok
    with pytest.raises(OSError, match="film"):
        next(reports)
    assert not threads_left()


def test_a_picture_that_is_refused_raises_after_those_before(sensor):
    reports = sensor.process_many([limb(), limb()[0], limb()], jobs=2)
    assert next(reports).ok
    with pytest.raises(hzn.ImageError, match="shape"):
        next(reports)
    with pytest.raises(hzn.ConfigError, match="jobs"):
        sensor.process_many([limb()], jobs=0)


def test_files_as_the_command_line_takes_them(sensor, folder, recording):
    table = hzn.read_mcap(recording)
    pattern = str(folder / "*.pgm")
    for images in (folder, pattern, [folder / f"{i:02}.pgm" for i in range(50)], recording):
        reports = list(sensor.process_many(images, jobs=2))
        assert [r.index for r in reports] == list(range(50))
        assert np.array_equal([r.axis[1] for r in reports], table["axis_y"])
    assert [r.file for r in sensor.process_many(folder)][:2] == ["00.pgm", "01.pgm"]


def test_a_recording_that_was_cut_is_told(sensor, recording, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recording.read_bytes()[:-20_000])
    with pytest.warns(UserWarning, match="was cut off"):
        reports = list(sensor.process_many(cut))
    assert 0 < len(reports) < 50


def test_a_table_beside_the_pictures_and_a_file_that_is_cut(sensor, tmp_path):
    for i in range(3):
        (tmp_path / f"{i}.pgm").write_bytes(pgm(limb(i))[: None if i != 1 else 999])
    (tmp_path / "frames.csv").write_text("file,time_s,altitude_km\n0.pgm,5,390\n2.pgm,7,410\n")
    reports = list(sensor.process_many(tmp_path))
    assert [r.status for r in reports] == ["ok", "unreadable", "ok"]
    assert [r.altitude_km for r in reports] == [390.0, 400.0, 410.0] and reports[2].time_s == 7.0
    assert "end before" in reports[1].detail or "cannot be decoded" in reports[1].detail
    with pytest.raises(hzn.ConfigError, match="nowhere"):
        sensor.process_many(tmp_path / "nowhere")
    (tmp_path / "frames.csv").write_text("file,altitude_km\n0.pgm,-9000\n")
    with pytest.raises(hzn.ConfigError, match="altitude_km"):
        sensor.process_many(tmp_path)


def test_a_tracked_level_goes_from_picture_to_picture():
    sensor = hzn.Sensor(**PARAMETERS, threshold={"method": "track"})
    reports = list(sensor.process_many([limb(i) for i in range(6)], jobs=4))
    alone = hzn.Sensor(**PARAMETERS, threshold={"method": "track"})
    assert [r.level for r in reports] == [alone.process(limb(i)).level for i in range(6)]


def test_bits_are_found_once_for_a_sequence(sensor, tmp_path):
    # The first picture is dark: its own samples would suggest 8 bits.
    for i, scale in enumerate((0.25, 16, 16)):
        words = (limb(i).astype(float) * scale).astype(">u2")
        (tmp_path / f"{i}.pgm").write_bytes(b"P5\n320 240\n65535\n" + words.tobytes())
    with pytest.warns(UserWarning, match="in 3 pictures is 3200: the camera is assumed to have 12 bits"):
        reports = list(sensor.process_many(tmp_path))
    # Words of more than 8 bits are linear, which changes the default height of the limb.
    linear = hzn.Sensor(**PARAMETERS, input={"tone": "linear"})
    assert reports[1].ok and np.allclose(reports[1].axis, linear.process(limb(1)).axis, atol=1e-4)


def test_implausible_values_warn(tmp_path):
    camera = PARAMETERS["camera"] | {"cx_px": 119.5, "cy_px": 159.5, "width": 480}
    with pytest.warns(UserWarning, match="camera.cx_px: the centre"):
        hzn.Sensor(camera=camera)
    with pytest.warns(UserWarning, match='write kind = "sphere", radius_km = 1737.4, limb_height_km'):
        hzn.Sensor(camera=PARAMETERS["camera"], body={"kind": "moon", "altitude_km": 100.0})

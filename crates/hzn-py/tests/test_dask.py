"""Tests of an archive on a real cluster of two processes."""

import csv
import importlib.util
import math
import os
import re
import resource
import shutil
import signal
import threading
import time
import types
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import hzn
from conftest import CAMERA, limb, pgm

dask = pytest.importorskip("dask")
import distributed  # noqa: E402
import fsspec  # noqa: E402
import fsspec.implementations.local  # noqa: E402
import pyarrow.parquet as parquet  # noqa: E402
from moto.moto_server.werkzeug_app import DomainDispatcherApplication  # noqa: E402
from moto.server import ThreadedMotoServer  # noqa: E402

from hzn import _shards  # noqa: E402
from hzn.dask import process_archive  # noqa: E402

# A multiple of 50, of at least 100.
FRAMES = int(os.environ.get("HZN_ARCHIVE_PICTURES", "2000"))
SMALL = dict(CAMERA, width=80, height=60, fx_px=75.0, fy_px=75.0, cx_px=39.5, cy_px=29.5)


@pytest.fixture(scope="module")
def client():
    dask.config.set({"distributed.comm.timeouts.connect": "60s", "distributed.worker.daemon": False})
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster, distributed.Client(cluster) as client:
        yield client


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """Return the URLs of small pictures. Two of them cannot be read; one file does not exist."""
    folder = tmp_path_factory.mktemp("archive")
    kinds = [pgm(np.ascontiguousarray(limb(i)[::4, ::4])) for i in range(50)]
    for i in range(FRAMES):
        (folder / f"{i:06}.pgm").write_bytes(kinds[i % 50] if i != 77 else b"P5 cut")
    return [str(folder / f"{i:06}.pgm") for i in range(FRAMES)][:-1] + [str(folder / "lost.pgm")]


@pytest.fixture
def small():
    body = {"kind": "earth-sphere", "altitude_km": 400.0}
    return hzn.Sensor(camera=SMALL, body=body, edge_points={"min_points": 20})


def columns(archive):
    tables = [parquet.read_table(shard.removeprefix("file://")).to_pydict() for shard in archive.shards]
    return {name: [cell for table in tables for cell in table[name]] for name in tables[0]}


def test_two_thousand_frames_and_a_worker_that_dies(client, archive, small, tmp_path):
    out = tmp_path / "out"

    def kill_one():
        # The first shards are written, so others are in progress.
        while len(list(out.glob("*.parquet"))) < 3:
            time.sleep(0.02)
        os.kill(victim, signal.SIGKILL)

    victim = next(iter(client.run(os.getpid).values()))
    killer = threading.Thread(target=kill_one, daemon=True)
    killer.start()
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    result = process_archive(archive, small, client=client, out=str(out), shard_frames=50)
    took, more = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    print(f"{FRAMES} pictures: {FRAMES / took:.0f} a second; the client's memory grew by {more / 1024:.0f} MB")
    killer.join()
    client.wait_for_workers(2, timeout=60)
    assert victim not in client.run(os.getpid).values()
    assert (result.frames, len(result.shards), result.skipped) == (FRAMES, FRAMES // 50, 0)
    assert [os.path.basename(f["file"]) for f in result.failed] == ["000077.pgm", "lost.pgm"]
    assert "no such file" in result.failed[1]["detail"].lower()
    assert sorted(p.name for p in out.iterdir()) == sorted(os.path.basename(s) for s in result.shards)
    found = columns(result)
    serial = [r.to_dict() for r in small.process_many([p for p in archive if os.path.exists(p)])]
    assert found["index"] == list(range(FRAMES)) and found["file"] == archive
    # Every column is that of one process, but for the time of the processing. The names are compared above.
    assert list(found) == list(serial[0])
    for name in set(found) - {"file", "elapsed_us"}:
        assert found[name][:-1] == [row[name] for row in serial], name
    assert found["status"].count("ok") > 0.9 * FRAMES

    # A second run makes only the lost shard again, with the same contents.
    times = {p: p.stat().st_mtime_ns for p in out.iterdir()}
    lost = sorted(out.iterdir())[3]
    lost.rename(f"{lost}.77.part")  # as left by a worker that died before the renaming
    again = process_archive(archive, small, client=client, out=str(out), shard_frames=50)
    assert again.skipped == FRAMES // 50 - 1 and columns(again)["axis_y"] == found["axis_y"]
    assert {p for p in out.iterdir() if p.stat().st_mtime_ns != times[p]} == {lost}
    # With another sensor these shards do not count.
    other = hzn.Sensor(**{**small.parameters, "consensus": {"seed": 5}})
    assert process_archive(archive[:60], other, client=client, out=str(out), shard_frames=50).skipped == 0


def test_mcap_shards_and_what_is_known(client, archive, small, tmp_path):
    urls = [(path, {"altitude_km": 399.0}) for path in archive[:30]]
    result = process_archive(urls, small, client=client, out=f"file://{tmp_path}/m", format="mcap", shard_frames=20)
    (first, second) = [shard.removeprefix("file://") for shard in result.shards]
    table = hzn.read_mcap(first)
    assert len(table["index"]) == 20 and len(hzn.read_mcap(second)["index"]) == 10 and result.failed == []
    assert set(table["altitude_km"]) == {399.0}
    with hzn.open_mcap(first) as recording:
        assert recording.sensor() == small and next(recording).image is None


def test_reports_come_from_workers(client, small):
    images = [np.ascontiguousarray(limb(i)[::4, ::4]) for i in range(4)]
    sent = client.gather(client.map(small.process, images, detail=True))
    for image, report in zip(images, sent, strict=True):
        here = small.process(image, detail=True)
        assert report.ok and np.array_equal(report.axis, here.axis) and np.array_equal(report.inliers, here.inliers)
        assert np.array_equal(hzn.overlay(image, report), hzn.overlay(image, here))


@pytest.mark.parametrize("format", ["parquet", "mcap"])
def test_a_picture_without_an_altitude_costs_no_other(client, archive, tmp_path, format):
    sensor = hzn.Sensor(camera=SMALL, body={"kind": "earth-sphere"}, edge_points={"min_points": 20})
    known = [{"altitude_km": 400.0}, {}, {"altitude_km": math.nan}, {"altitude_km": 12.0}, {"altitude_km": 400.0}]
    urls = list(zip(archive, known, strict=False))
    result = process_archive(urls, sensor, client=client, out=str(tmp_path / format), format=format, retries=0)
    (shard,) = [shard.removeprefix("file://") for shard in result.shards]
    table = parquet.read_table(shard).to_pydict() if format == "parquet" else hzn.read_mcap(shard)
    without = "no-altitude"
    assert list(table["status"]) == ["ok", without, without, without, "ok"]
    assert [f["file"] for f in result.failed] == archive[1:4]
    details = [f["detail"] for f in result.failed]
    assert details[0] == details[1] and details[0].startswith("no altitude: set body.altitude_km")
    assert details[2].startswith("altitude 12 km is below the limb height ")
    # Without this picture's own data, the parameters' altitude counts.
    sensor.parameters = sensor.parameters | {"body": {"kind": "earth-sphere", "altitude_km": 400.0}}
    result = process_archive(urls, sensor, client=client, out=str(tmp_path / format), format=format, retries=0)
    assert [f["file"] for f in result.failed] == archive[3:4]


@pytest.fixture
def bucket(client, monkeypatch):
    """Return a new bucket of a server that speaks the protocol of S3, for this process and the workers."""
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    environment = {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "hzn",
        "AWS_SECRET_ACCESS_KEY": "hzn",
        "AWS_DEFAULT_REGION": "us-east-1",
    }
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    client.run(lambda: os.environ.update(environment))
    fsspec.filesystem("s3").mkdir("flights")
    yield "s3://flights"
    server.stop()


@pytest.fixture
def slow_down(monkeypatch):
    """Let every tenth request for a picture fail, and the first of every ten that write a shard, as a store does that
    is asked too often. Return what was refused, by the method of the request."""
    answer = DomainDispatcherApplication.__call__
    refused = {"GET": [], "PUT": []}

    def call(self, environ, start_response):
        method, path = environ["REQUEST_METHOD"], environ["PATH_INFO"]
        if (method, path.rpartition(".")[2]) in [("GET", "pgm"), ("PUT", "part")]:
            refused[method].append(len(refused[method]) % 10 == 0)
            if refused[method][-1]:
                # The client may go on to use this connection, so the data that it sends must not stay in it.
                environ["wsgi.input"].read(int(environ.get("CONTENT_LENGTH") or 0))
                start_response("503 Slow Down", [("Content-Type", "application/xml")])
                return [b"<Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>"]
        return answer(self, environ, start_response)

    monkeypatch.setattr(DomainDispatcherApplication, "__call__", call)
    return refused


def test_an_archive_in_an_object_store(client, archive, small, bucket, slow_down):
    files = fsspec.filesystem("s3")
    for path in archive[:30]:
        files.put_file(path, f"flights/pictures/{os.path.basename(path)}")
    urls = [f"{bucket}/pictures/{os.path.basename(path)}" for path in archive[:30]] + [f"{bucket}/pictures/lost.pgm"]
    # The folder does not exist before its first shard.
    result = process_archive(urls, small, client=client, out=f"{bucket}/out/a", shard_frames=20, retries=2)
    assert (result.frames, len(result.shards), result.skipped) == (31, 2, 0)
    assert all(shard.startswith("s3://flights/out/a/part-") for shard in result.shards)
    assert [f["file"] for f in result.failed] == urls[-1:]
    tables = [parquet.read_table(files.open(shard)).to_pydict() for shard in result.shards]
    serial = [report.to_dict() for report in small.process_many(archive[:30])]
    assert [file for table in tables for file in table["file"]] == urls
    for name in set(serial[0]) - {"file", "elapsed_us"}:
        found = [cell for table in tables for cell in table[name]]
        assert found[:-1] == [row[name] for row in serial], name
    # Each of the two shards took one request, and the first of them one more.
    assert sum(slow_down["GET"]) >= 3 and slow_down["PUT"] == [True, False, False]
    # Another program removes a shard and leaves the unfinished file of a worker; the next run makes what is missing.
    store = fsspec.filesystem("s3", skip_instance_cache=True)
    lost = result.shards[1].removeprefix("s3://")
    store.mv(lost, f"{lost}.77.part")
    again = process_archive(urls, small, client=client, out=f"{bucket}/out/a", shard_frames=20, retries=0)
    assert (again.shards, again.skipped) == (result.shards, 1)
    store.invalidate_cache()
    assert sorted(store.ls("flights/out/a")) == sorted(shard.removeprefix("s3://") for shard in result.shards)
    # Another picture of the same size under one key has another ETag.
    assert os.path.getsize(archive[3]) == os.path.getsize(archive[0])
    store.put_file(archive[3], urls[0].removeprefix("s3://"))
    replaced = process_archive(urls, small, client=client, out=f"{bucket}/out/a", shard_frames=20, retries=0)
    assert (replaced.skipped, replaced.shards[1]) == (1, result.shards[1]) and replaced.shards[0] != result.shards[0]
    for out in (f"{bucket}/out/m", bucket):
        recorded = process_archive(urls, small, client=client, out=out, format="mcap", retries=0)
        assert [f["file"] for f in recorded.failed] == urls[-1:]


def test_what_an_archive_refuses(client, archive, small, tmp_path):
    out = str(tmp_path)
    for urls, sensor, more, what in [
        ([], small, {}, "urls"),
        # A text is a sequence of letters, and each would be a picture.
        (str(tmp_path / "flight"), small, {}, "urls: '.*flight' is one URL or path; give a list"),
        (tmp_path / "flight", small, {}, "is one URL or path"),
        (archive, small, {"format": "xml"}, "format: 'xml' .* parquet, csv or mcap"),
        (archive, small, {"shard_frames": 0}, "shard_frames"),
        (archive, hzn.Sensor(camera=SMALL, threshold={"method": "track"}), {}, "track"),
    ]:
        with pytest.raises(hzn.ConfigError, match=what):
            process_archive(urls, sensor, client=client, out=out, **more)
    # Impossible data are refused before anything is processed, with the name of the picture.
    for known, what in [
        ({"attitude": [2, 0, 0, 0]}, "attitude: a quaternion"),
        ({"altitude_km": -9000.0}, "altitude_km must be"),
        ({"altitude_km": "high"}, "must be real number"),
        ({"altitude": 400.0}, "got an unexpected keyword argument 'altitude'"),
    ]:
        with pytest.raises(hzn.ConfigError, match=f"{archive[1]}: .*{what}"):
            process_archive([archive[0], (archive[1], known)], small, client=client, out=out)
    assert list(tmp_path.iterdir()) == []


class Unsteady(fsspec.implementations.local.LocalFileSystem):
    """A file system that fails: ``unsteady://N/PATH`` is read after N failures."""

    protocol = "unsteady"
    cachable = False
    failures: ClassVar[dict[str, int]] = {}

    @classmethod
    def _strip_protocol(cls, path):
        return path.removeprefix("unsteady://")

    def info(self, path, **kwargs):
        return super().info(path.partition("/")[2])

    def _open(self, path, mode="rb", **kwargs):
        count, _, file = path.partition("/")
        self.failures[path] = self.failures.get(path, 0) + 1
        if self.failures[path] <= int(count):
            raise RuntimeError("SlowDown: please reduce your request rate")
        return super()._open(f"/{file}", mode, **kwargs)


def test_the_waits_between_the_tries_grow(monkeypatch):
    def ask(url):
        asked.append((url, list(waits)))
        raise RuntimeError("SlowDown")

    asked, waits = [], []
    # Other threads of this process may sleep, too, so only the module's own clock is replaced.
    monkeypatch.setattr(_shards, "time", types.SimpleNamespace(sleep=waits.append))
    assert _shards._attempt(ask, "a.pgm") == (None, "cannot be read: SlowDown")
    # Three tries, and a wait before each but the first. A store that is asked too often has time to recover.
    assert asked == [("a.pgm", waits[:0]), ("a.pgm", waits[:1]), ("a.pgm", waits[:2])]
    first, second = waits
    assert first > 0 and second >= 2 * first

    def lost(url):
        raise FileNotFoundError(url)

    # An answer is no failure, and takes no time.
    assert _shards._attempt(lost, "b.pgm") == (None, "does not exist: b.pgm")
    assert _shards._attempt(len, "c.pgm") == (5, "") and len(waits) == 2


def test_a_reading_that_fails_for_a_while_costs_nothing(client, archive, small, tmp_path):
    def register():
        fsspec.register_implementation("unsteady", Unsteady, clobber=True)
        Unsteady.failures.clear()

    def run(**more):
        return process_archive(urls, small, client=client, out=str(tmp_path), shard_frames=2, retries=0, **more)

    client.run(register)
    urls = [f"unsteady://{count}/{path}" for count, path in zip([0, 2, 0, 4], archive, strict=False)]
    result = run()
    # The second picture was tried three times. The fourth needs more, and is a row of its shard.
    assert (result.skipped, [f["file"] for f in result.failed]) == (0, urls[3:])
    assert result.failed[0]["detail"] == "cannot be read: SlowDown: please reduce your request rate"
    assert columns(result)["status"] == ["ok", "ok", "ok", "unreadable"]
    # A later run tries its shard again, unless it is told not to.
    again = run(retry_failed=False)
    assert (again.skipped, again.failed, again.shards) == (2, result.failed, result.shards)
    again = run()
    assert (again.skipped, again.failed, again.shards) == (1, [], result.shards)
    assert columns(again)["status"] == ["ok"] * 4
    assert run().skipped == 2


@pytest.mark.parametrize("format", ["parquet", "csv", "mcap"])
def test_a_replaced_picture_is_noticed(client, archive, small, tmp_path, format):
    folder, out = tmp_path / "pictures", tmp_path / "out"
    folder.mkdir()
    urls = [str(folder / f"{i}.pgm") for i in range(4)]
    for url, path in zip(urls[:3], archive, strict=False):
        shutil.copy(path, url)

    def run():
        return process_archive(urls, small, client=client, out=str(out), shard_frames=2, retries=0, format=format)

    first = run()
    assert [f["file"] for f in first.failed] == urls[3:] and run().skipped == 2
    # One picture is replaced by another of the same size, and the absent one appears.
    shutil.copy(archive[3], urls[0])
    second = run()
    assert second.skipped == 1 and second.shards[0] != first.shards[0] and second.shards[1] == first.shards[1]
    shutil.copy(archive[4], urls[3])
    third = run()
    assert (third.skipped, third.failed) == (1, [])
    assert sorted(path.name for path in out.iterdir()) == sorted(os.path.basename(shard) for shard in third.shards)


def test_texts_are_texts_in_parquet_even_where_all_are_empty(client, archive, small, tmp_path):
    result = process_archive(archive[:2], small, client=client, out=str(tmp_path))
    schema = parquet.read_schema(result.shards[0].removeprefix("file://"))
    for name in ("file", "body", "status", "detail", "head", "heads_used", "heads_excluded"):
        assert str(schema.field(name).type) == "string", name


def test_csv_shards_are_those_of_parquet(client, archive, small, tmp_path):
    both = [
        process_archive(archive[60:90], small, client=client, out=f"{tmp_path}/{kind}", shard_frames=20, format=kind)
        for kind in ("parquet", "csv")
    ]
    table = columns(both[0])
    rows = []
    for shard in both[1].shards:
        with open(shard.removeprefix("file://"), newline="", encoding="utf-8") as file:
            rows += csv.DictReader(file)
    assert [list(row) for row in rows] == [list(table)] * 30 and both[0].failed == both[1].failed != []
    for name in set(table) - {"elapsed_us"}:
        cells = [row[name] for row in rows]
        for cell, known in zip(cells, table[name], strict=True):
            assert cell == "" if known is None else type(known)(cell) == known, name


def test_texts_of_csv_are_no_formulas(tmp_path, small):
    texts = ["=1+1", "-2.png", "+a", "@b", "'=c", "\t=1", "\r=1", "'", "'d", "plain", ""]
    written = ["'=1+1", "'-2.png", "'+a", "'@b", "''=c", "'\t=1", "'\r=1", "'", "'d", "plain", ""]
    assert [_shards._guarded(text) for text in texts] == written
    assert [_shards._unguarded(cell) for cell in written] == texts
    report = _shards._process_encoded(small, 0, "=lost.png", None, "-why", hzn._hzn._Prior())
    path = str(tmp_path / "a.csv")
    _shards._write_csv(path, small, [report])
    with open(path, newline="", encoding="utf-8") as file:
        assert next(csv.DictReader(file))["file"] == "'=lost.png"
    failed = _shards._unprocessed(fsspec.filesystem("file"), path)
    assert [row["file"] for row in failed] == ["=lost.png"] and failed[0]["detail"].startswith("-why")
    # The Rust program guards the same columns: all that are texts.
    row = {name: f"={name}" for name in _shards._TEXTS} | {"axis_x": -0.5, "inliers": None}
    guarded = _shards._change_texts(row, _shards._guarded)
    assert guarded == {name: f"'={name}" for name in _shards._TEXTS} | {"axis_x": -0.5, "inliers": None}
    assert _shards._change_texts(guarded, _shards._unguarded) == row
    assert _shards._change_texts({"head": None}, _shards._guarded) == {"head": None}


def test_a_picture_may_be_a_path(client, archive, small, tmp_path):
    as_text = process_archive(archive[:2], small, client=client, out=str(tmp_path / "text"))
    pictures = [Path(archive[0]), (Path(archive[1]), {})]
    as_path = process_archive(pictures, small, client=client, out=str(tmp_path / "path"))
    assert [os.path.basename(url) for url in as_path.shards] == [os.path.basename(url) for url in as_text.shards]
    assert columns(as_path)["file"] == archive[:2]


def test_what_is_known_may_be_of_numpy(client, archive, small, tmp_path):
    known = {"altitude_km": np.float32(400), "time_s": np.int64(3), "position_km": None}
    urls = [(archive[0], known), (archive[1], {"rate_rad_s": np.zeros(3), "time_s": np.float64(4)})]
    result = process_archive(urls, small, client=client, out=str(tmp_path / "numpy"))
    assert result.failed == [] and columns(result)["time_s"] == [3.0, 4.0]


def test_a_generator_is_read_only_as_far_as_the_workers_need_it(client, archive, small, tmp_path):
    out, ahead = tmp_path / "out", []

    def urls():
        for i, path in enumerate(archive):
            finished = len(list(out.glob("*.parquet"))) if out.exists() else 0
            ahead.append(i - 10 * finished)
            yield path

    result = process_archive(urls(), small, client=client, out=str(out), shard_frames=10)
    # Four shards wait for each of two threads. Each may be finished and not yet be counted when the next is read.
    assert (result.frames, len(result.shards)) == (FRAMES, FRAMES // 10) and max(ahead) <= 10 * (4 * 2 + 2)
    shards = [os.path.basename(shard) for shard in result.shards]
    assert shards == sorted(shards)

    def broken():
        yield from archive[:25]
        yield archive[25], {"altitude_km": "high"}
        yield from archive[26:]

    with pytest.raises(hzn.ConfigError, match=f"{archive[25]}: "):
        process_archive(broken(), small, client=client, out=str(tmp_path / "broken"), shard_frames=10)
    assert len(list((tmp_path / "broken").iterdir())) == 2
    with pytest.raises(hzn.ConfigError, match="urls: is empty"):
        process_archive(iter(()), small, client=client, out=str(tmp_path / "empty"))


def test_a_progress_bar_says_how_long_it_takes(client, archive, small, tmp_path, capsys):
    process_archive(archive[:80], small, client=client, out=str(tmp_path), shard_frames=40, progress=True)
    shown = capsys.readouterr().err
    assert "80/80" in shown and "pictures/s" in shown and "failed=1" in shown
    # The time since the start, and the time left.
    assert re.search(r"\[\d\d:\d\d<\d\d:\d\d", shown), shown


def test_a_cluster_that_runs_already(client, archive, small, tmp_path):
    address = client.scheduler.address
    assert address.startswith("tcp://")
    # The client that is the current one need not be given.
    with distributed.Client(address):
        result = process_archive(archive[:4], small, out=str(tmp_path))
    assert columns(result)["file"] == archive[:4] and result.failed == []


def test_without_pyarrow_there_is_csv(client, archive, small, tmp_path, monkeypatch):
    find = importlib.util.find_spec

    def without(name, *more):
        return None if name == "pyarrow" else find(name, *more)

    monkeypatch.setattr(importlib.util, "find_spec", without)
    with pytest.raises(ImportError, match='"hzn-sensor\\[dask\\]", or choose csv'):
        process_archive(archive[:2], small, client=client, out=str(tmp_path / "parquet"))
    assert not (tmp_path / "parquet").exists()
    result = process_archive(archive[:2], small, client=client, out=str(tmp_path / "csv"), format="csv")
    assert result.failed == [] and result.shards[0].endswith(".csv")

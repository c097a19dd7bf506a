"""The work of one task of `hzn.dask`: a shard of pictures, read, processed and written on a worker.

The name of a shard is ``part-NUMBER-INPUTS-PICTURES.FORMAT``. INPUTS is a digest of everything that the caller gives:
URLs, what is known of the pictures, parameters, version. PICTURES is a digest of the size and of the ETag or the time
of every picture, which the worker asks for. A picture that was replaced therefore gives another name, and its shard is
made again.
"""

from __future__ import annotations

import csv
import hashlib
import json
import os
import re
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import fsspec  # type: ignore[import-untyped]

from ._hzn import Report, Sensor, __version__, _Prior, _process_encoded, _write_mcap, read_mcap

Shard: TypeAlias = Sequence[tuple[str, Mapping[str, Any]]]

_TEXTS = ("file", "body", "status", "detail", "head", "heads_used", "heads_excluded")
_COUNTS = ("index", "edge_points", "inliers", "candidates", "dropped", "level")
_UNPROCESSED = ("unreadable", "no-altitude")
# What file systems call the mark of a file's contents, the best first. A time is the last resort.
_MARKS = ("ETag", "etag", "md5Hash", "content_md5", "mtime", "LastModified", "last_modified", "updated")
_TRIES = 3
_FIRST_WAIT_S = 0.2
_NOT_READ = "cannot be read: "


@dataclass
class Task:
    """What a worker needs for a shard."""

    sensor: Sensor
    first: int
    shard: Shard
    out: str
    stem: str
    """Path of the shard without the digest of its pictures and without its ending."""
    format: str
    older: Sequence[str]
    """Paths of the shards with this stem and format that existed at the start."""
    retry_failed: bool


@dataclass
class Done:
    """What became of a shard."""

    name: str
    existed: bool
    failed: list[dict[str, Any]]


def digest(sensor: Sensor, first: int, shard: Shard) -> str:
    """Return a digest of everything that the caller gives for a shard."""
    inputs = json.dumps([__version__, sensor.parameters, sensor.flight, first, shard], default=_plain, sort_keys=True)
    return hashlib.sha256(inputs.encode()).hexdigest()[:12]


def _plain(value: Any) -> Any:
    """Return a number or an array of NumPy, or another sequence, as JSON can have it."""
    return value.tolist() if hasattr(value, "tolist") else list(value)


def make(task: Task) -> Done:
    """Make a shard, unless it exists with the pictures as they are now."""
    filesystem, _ = fsspec.core.url_to_fs(task.out)
    marks = [_attempt(_mark, url)[0] for url, _ in task.shard]
    name = _name(task, marks)
    existed = any(os.path.basename(older) == os.path.basename(name) for older in task.older)
    # A shard that is new may be there, too: its worker wrote it and then died, or two workers got the same task.
    if existed or filesystem.exists(name):
        failed = _unprocessed(filesystem, name)
        again = existed and task.retry_failed and any(row["detail"].startswith(_NOT_READ) for row in failed)
        if not again:
            return Done(name, existed, failed)
    reports = []
    for i, (url, known) in enumerate(task.shard):
        data, why = _attempt(_read, url)
        reports.append(_process_encoded(task.sensor, task.first + i, url, data, why, _Prior(**known)))
    part = f"{name}.{os.getpid()}.part"
    with tempfile.TemporaryDirectory() as scratch:
        local = os.path.join(scratch, "shard")
        _WRITERS[task.format](local, task.sensor, reports)
        filesystem.put_file(local, part)
    filesystem.mv(part, name)
    for older in task.older:
        if os.path.basename(older) != os.path.basename(name):
            filesystem.rm(older)
    return Done(name, False, _failed(_rows(reports)))


def _name(task: Task, marks: Sequence[Any]) -> str:
    pictures = hashlib.sha256(json.dumps(marks, default=str).encode()).hexdigest()[:12]
    return f"{task.stem}-{pictures}.{task.format}"


def _attempt(ask: Any, url: str) -> tuple[Any, str]:
    """Return what `ask` says of a URL. An answer may fail for a while, so it is asked for again, after a longer wait
    each time. A file that does not exist is an answer."""
    why = ""
    for attempt in range(_TRIES):
        if attempt > 0:
            time.sleep(_FIRST_WAIT_S * 4 ** (attempt - 1))
        try:
            return ask(url), ""
        except FileNotFoundError as error:
            return None, f"does not exist: {error}"
        except Exception as error:  # noqa: BLE001 (each file system has exceptions of its own)
            why = f"{_NOT_READ}{error or type(error).__name__}"
    return None, why


def _read(url: str) -> bytes:
    with fsspec.open(url, "rb") as file:
        data: bytes = file.read()
        return data


def _mark(url: str) -> list[Any]:
    """Return the size of a picture file, and what changes with its contents."""
    filesystem, path = fsspec.core.url_to_fs(url)
    # The list of a folder that is kept from an earlier run does not know of a replaced file.
    filesystem.invalidate_cache(filesystem._parent(path))
    info = filesystem.info(path)
    return [info.get("size"), next((str(info[key]) for key in _MARKS if info.get(key)), None)]


def _rows(reports: Sequence[Report]) -> list[dict[str, Any]]:
    return [r.to_dict() for report in reports for r in (report, *report.others)]


def _write_parquet(path: str, _: Sensor, reports: Sequence[Report]) -> None:
    import pyarrow  # type: ignore[import-untyped]
    import pyarrow.parquet  # type: ignore[import-untyped]

    rows = _rows(reports)
    kinds = {name: pyarrow.string() for name in _TEXTS} | {name: pyarrow.int64() for name in _COUNTS}
    schema = pyarrow.schema([(name, kinds.get(name, pyarrow.float64())) for name in rows[0]])
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist(rows, schema=schema), path)


def _guarded(text: str) -> str:
    """Return a text as `hzn run` writes it into CSV: a spreadsheet must not take it for a formula."""
    return f"'{text}" if re.match(r"'*[=+\-@\t\r]", text) else text


def _unguarded(cell: str) -> str:
    return cell[1:] if re.match(r"'+[=+\-@\t\r]", cell) else cell


def _change_texts(row: Mapping[str, Any], change: Callable[[str], str]) -> dict[str, Any]:
    return {name: change(cell) if name in _TEXTS and cell is not None else cell for name, cell in row.items()}


def _write_csv(path: str, _: Sensor, reports: Sequence[Report]) -> None:
    rows = _rows(reports)
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(_change_texts(row, _guarded) for row in rows)


_WRITERS: Mapping[str, Any] = {"parquet": _write_parquet, "csv": _write_csv, "mcap": _write_mcap}
FORMATS = tuple(_WRITERS)


def _unprocessed(filesystem: Any, name: str) -> list[dict[str, Any]]:
    """Return the pictures of a shard that were not processed."""
    names = ("status", "file", "detail")
    if name.endswith(".mcap"):
        with tempfile.TemporaryDirectory() as scratch:
            local = os.path.join(scratch, "shard.mcap")
            filesystem.get_file(name, local)
            table = read_mcap(local)
        columns = [table[c].tolist() for c in names]
    elif name.endswith(".csv"):
        with filesystem.open(name, "r", newline="", encoding="utf-8") as file:
            return _failed([_change_texts(row, _unguarded) for row in csv.DictReader(file)])
    else:
        import pyarrow.parquet

        with filesystem.open(name, "rb") as file:
            read = pyarrow.parquet.read_table(file, columns=list(names))
        columns = [read[c].to_pylist() for c in names]
    return _failed([dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)])


def _failed(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    return [{"file": row["file"], "detail": row["detail"]} for row in rows if row["status"] in _UNPROCESSED]

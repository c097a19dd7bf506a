"""An archive of pictures on a Dask cluster: `pip install "hzn-sensor[dask]"`.

Each shard is one task, which the engine processes on one core. A shard is written under another name and then renamed,
so a file with the name of a shard is always complete. A second run skips the shards that exist.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from ._hzn import (
    ConfigError,
    Report,
    Sensor,
    __version__,
    _check_prior,
    _Prior,
    _process_encoded,
    _write_mcap,
)

try:
    import fsspec  # type: ignore[import-untyped]
    import pyarrow  # type: ignore[import-untyped]
    import pyarrow.parquet  # type: ignore[import-untyped]
    from distributed import as_completed, get_client
except ImportError as _missing:
    raise ImportError(f"hzn.dask needs the package {_missing.name}: pip install \"hzn-sensor[dask]\"") from None

if TYPE_CHECKING:
    from distributed import Client

Url: TypeAlias = str | tuple[str, Mapping[str, Any]]

_TEXTS = ("file", "body", "status", "detail")
_UNPROCESSED = ("unreadable", "no-altitude")
_COUNTS = ("index", "edge_points", "inliers", "candidates", "dropped", "level")


@dataclass
class Archive:
    """Result of an archive."""

    shards: list[str]
    """URLs of the shards, in the order of the pictures."""
    frames: int
    """Number of pictures in the shards."""
    skipped: int
    """Number of shards that existed already."""
    failed: list[dict[str, Any]] = field(repr=False)
    """Pictures that were not processed: ``file`` and ``detail``. They have a row with status ``unreadable`` or
    ``no-altitude`` in their shard."""


def process_archive(
    urls: Iterable[Url],
    sensor: Sensor,
    *,
    client: Client | None = None,
    out: str,
    format: Literal["parquet", "mcap"] = "parquet",
    shard_frames: int = 500,
    retries: int = 2,
) -> Archive:
    """Process pictures from any place that fsspec can read, into shards of results.

    Parameters
    ----------
    urls
        URLs or paths of picture files; or pairs of a URL or path and a dictionary of what is known of the picture: the
        keyword arguments of `hzn.Sensor.process` from ``altitude_km`` to ``time_s``. A picture without a usable
        altitude gets a row with the status ``no-altitude``.
    sensor
        The sensor. ``threshold.method = "track"`` is refused, because its threshold depends on the picture before.
    client
        A Dask client; without it, the current one.
    out
        URL or path of a folder for the shards.
    format
        Format of the shards: Parquet with the columns of book/reference/files.md, or MCAP without pictures.
    shard_frames
        Number of pictures per shard. Another number makes other shards.
    retries
        Number of times that a shard is tried again if its task fails. The death of a worker does not count: Dask gives
        its tasks to others.

    Returns
    -------
    Archive
        The shards, and the pictures that could not be read.

    Raises
    ------
    ConfigError
        There are no pictures; the sensor or an option is invalid; or an altitude, position or attitude is impossible.
    Exception
        A shard failed after all retries. The other shards are written, and the next run makes the missing ones.
    """
    pictures = [(url, {}) if isinstance(url, str) else (url[0], dict(url[1])) for url in urls]
    if not pictures:
        raise ConfigError("urls: is empty")
    if shard_frames < 1:
        raise ConfigError(f"shard_frames: {shard_frames} is refused: must be 1 or more")
    if format not in ("parquet", "mcap"):
        raise ConfigError(f"format: {format!r} is refused: must be parquet or mcap")
    if sensor.parameters["threshold"]["method"] == "track":
        raise ConfigError(
            "threshold.method: track takes its threshold from the previous picture, which another worker may have"
        )
    for url, known in pictures:
        try:
            _check_prior(sensor, _Prior(**known))
        except (ConfigError, TypeError) as error:
            raise ConfigError(f"{url}: {error}") from None
    client = client or get_client()
    filesystem, folder = fsspec.core.url_to_fs(out)
    filesystem.makedirs(folder, exist_ok=True)
    existing = set(_list(filesystem, folder))
    names: list[str] = []
    tasks = []
    for first in range(0, len(pictures), shard_frames):
        shard = pictures[first : first + shard_frames]
        name = f"{folder}/part-{first // shard_frames:06}-{_digest(sensor, first, shard)}.{format}"
        names.append(name)
        if not any(path.endswith(name.lstrip("/")) for path in existing):
            # The task is not pure: its result is the file on the disk, not its return value.
            tasks.append(client.submit(_shard, sensor, first, shard, out, name, retries=retries, pure=False))
    for _ in as_completed(tasks):
        pass
    client.gather(tasks)
    _sweep(filesystem, folder, names)
    return Archive(
        shards=[filesystem.unstrip_protocol(name) for name in names],
        frames=len(pictures),
        skipped=len(names) - len(tasks),
        failed=[row for name in names for row in _unprocessed(filesystem, name)],
    )


def _list(filesystem: Any, folder: str) -> list[str]:
    """Return the paths of the files in a folder."""
    # Other processes write into the folder, too.
    filesystem.invalidate_cache()
    try:
        return list(filesystem.ls(folder, detail=False))
    except FileNotFoundError:
        # An object store has no empty folders: the folder exists from its first file on.
        return []


def _sweep(filesystem: Any, folder: str, names: Sequence[str]) -> None:
    """Remove the files of workers that died between writing a shard and renaming it."""
    own = {os.path.basename(name) for name in names}
    for path in _list(filesystem, folder):
        # The file name is NAME.PROCESS.part.
        if path.endswith(".part") and os.path.basename(path).rsplit(".", 2)[0] in own:
            filesystem.rm(path)


def _digest(sensor: Sensor, first: int, shard: Sequence[tuple[str, Mapping[str, Any]]]) -> str:
    """Return a digest of everything that a shard depends on, so that the same name means the same result."""
    inputs = json.dumps([__version__, sensor.parameters, sensor.flight, first, shard], default=list, sort_keys=True)
    return hashlib.sha256(inputs.encode()).hexdigest()[:12]


def _shard(sensor: Sensor, first: int, shard: Sequence[tuple[str, Mapping[str, Any]]], out: str, name: str) -> None:
    """Process a shard; this is the task of a worker."""
    filesystem, _ = fsspec.core.url_to_fs(out)
    if filesystem.exists(name):
        # A worker wrote it and then died, or a second worker got the same task.
        return
    reports = [_picture(sensor, first + i, url, known) for i, (url, known) in enumerate(shard)]
    part = f"{name}.{os.getpid()}.part"
    with tempfile.TemporaryDirectory() as scratch:
        local = os.path.join(scratch, "shard")
        if name.endswith(".mcap"):
            _write_mcap(local, sensor, reports)
        else:
            pyarrow.parquet.write_table(_table(reports), local)
        filesystem.put_file(local, part)
    filesystem.mv(part, name)


def _picture(sensor: Sensor, index: int, url: str, known: Mapping[str, Any]) -> Report:
    try:
        with fsspec.open(url, "rb") as file:
            data, why = file.read(), ""
    except OSError as error:
        data, why = None, f"cannot be read: {error}"
    return _process_encoded(sensor, index, url, data, why, _Prior(**known))


def _table(reports: Sequence[Report]) -> Any:
    rows = [r.to_dict() for report in reports for r in (report, *report.others)]
    kinds = {name: pyarrow.string() for name in _TEXTS} | {name: pyarrow.int64() for name in _COUNTS}
    schema = pyarrow.schema([(name, kinds.get(name, pyarrow.float64())) for name in rows[0]])
    return pyarrow.Table.from_pylist(rows, schema=schema)


def _unprocessed(filesystem: Any, name: str) -> list[dict[str, Any]]:
    if name.endswith(".mcap"):
        from ._hzn import read_mcap

        with tempfile.TemporaryDirectory() as scratch:
            local = os.path.join(scratch, "shard.mcap")
            filesystem.get_file(name, local)
            table = read_mcap(local)
        rows = zip(table["status"].tolist(), table["file"].tolist(), table["detail"].tolist(), strict=True)
    else:
        with filesystem.open(name, "rb") as file:
            columns = pyarrow.parquet.read_table(file, columns=["status", "file", "detail"])
        rows = zip(*(columns[c].to_pylist() for c in ("status", "file", "detail")), strict=True)
    return [{"file": file, "detail": detail} for status, file, detail in rows if status in _UNPROCESSED]

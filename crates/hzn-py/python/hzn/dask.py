"""An archive of pictures on a Dask cluster: `pip install "hzn-sensor[dask]"`.

Each shard is one task, which the engine processes on one core. A shard is written under another name and then renamed,
so a file with the name of a shard is always complete. A second run skips the shards that exist.
"""

from __future__ import annotations

import importlib.util
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from ._hzn import ConfigError, Sensor, _check_prior, _Prior

try:
    import fsspec  # type: ignore[import-untyped]
    from distributed import as_completed, get_client
except ImportError as _missing:
    raise ImportError(f"hzn.dask needs the package {_missing.name}: pip install \"hzn-sensor[dask]\"") from None

from ._shards import FORMATS, Done, Task, digest, make

if TYPE_CHECKING:
    from distributed import Client

_Path: TypeAlias = str | os.PathLike[str]
Url: TypeAlias = _Path | tuple[_Path, Mapping[str, Any]]

# Shards that wait for each thread of the cluster. With fewer, a thread may wait for the client; more fill its memory.
_WAITING = 4


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
    format: Literal["parquet", "csv", "mcap"] = "parquet",
    shard_frames: int = 500,
    retries: int = 2,
    retry_failed: bool = True,
    progress: bool = False,
) -> Archive:
    """Process pictures from any place that fsspec can read, into shards of results.

    Parameters
    ----------
    urls
        URLs or paths of picture files; or pairs of a URL or path and a dictionary of what is known of the picture: the
        keyword arguments of `hzn.Sensor.process` from ``altitude_km`` to ``time_s``. A picture without a usable
        altitude gets a row with the status ``no-altitude``. A generator is read only as far as the cluster needs it,
        so an archive of any size fits into memory.
    sensor
        The sensor. ``threshold.method = "track"`` is refused, because its threshold depends on the picture before.
    client
        A Dask client; without it, the current one.
    out
        URL or path of a folder for the shards.
    format
        Format of the shards: Parquet or CSV with the columns of book/reference/files.md, or MCAP without pictures.
    shard_frames
        Number of pictures per shard. Another number makes other shards.
    retries
        Number of times that a shard is tried again if its task fails. The death of a worker does not count: Dask gives
        its tasks to others. A picture whose reading fails is tried three times in any case.
    retry_failed
        Whether a shard that exists is made again if one of its pictures could not be read although it exists.
    progress
        Whether a progress bar is shown, with the rate, the pictures that failed, and the time left
        (``pip install tqdm``).

    Returns
    -------
    Archive
        The shards, and the pictures that could not be read.

    Raises
    ------
    ConfigError
        There are no pictures, or a single URL is given for their list; the sensor or an option is invalid; or an altitude, position or attitude is impossible.
        The pictures of a list are checked before anything is processed, those of a generator when they are read.
    Exception
        A shard failed after all retries. The other shards are written, and the next run makes the missing ones.
    """
    if isinstance(urls, (str, bytes, os.PathLike)):
        # A text is a sequence of letters, and each would be taken as a picture.
        raise ConfigError(
            f"urls: {os.fspath(urls)!r} is one URL or path; give a list of those of the pictures, for example "
            "sorted(pathlib.Path(folder).glob('*.png'))"
        )
    _check_options(sensor, format, shard_frames)
    total = len(urls) if isinstance(urls, Sequence) else None
    if total is not None:
        if total == 0:
            raise ConfigError("urls: is empty")
        for url in urls:
            _check(sensor, url)
    bar = _bar(total) if progress else None
    client = client or get_client()
    filesystem, folder = fsspec.core.url_to_fs(out)
    filesystem.makedirs(folder, exist_ok=True)
    existing = _existing(filesystem, folder)

    def tasks() -> Iterator[Task]:
        pictures = (_check(sensor, url) for url in urls)
        first = 0
        while shard := list(islice(pictures, shard_frames)):
            stem = f"{folder}/part-{first // shard_frames:06}-{digest(sensor, first, shard)}"
            older = existing.get(f"{os.path.basename(stem)}.{format}", [])
            yield Task(sensor, first, shard, out, stem, format, older, retry_failed)
            first += len(shard)

    with client.as_current():
        shards, error = _run(client, tasks(), retries, bar)
    if bar is not None:
        bar.close()
    done = [shards[first] for first in sorted(shards)]
    _sweep(filesystem, folder, [shard.done.name for shard in done])
    if error is not None:
        raise error
    if not done:
        raise ConfigError("urls: is empty")
    return Archive(
        shards=[filesystem.unstrip_protocol(shard.done.name) for shard in done],
        frames=sum(shard.frames for shard in done),
        skipped=sum(shard.done.existed for shard in done),
        failed=[row for shard in done for row in shard.done.failed],
    )


def _check_options(sensor: Sensor, format: str, shard_frames: int) -> None:
    if shard_frames < 1:
        raise ConfigError(f"shard_frames: {shard_frames} is refused: must be 1 or more")
    if format not in FORMATS:
        raise ConfigError(f"format: {format!r} is refused: must be {', '.join(FORMATS[:-1])} or {FORMATS[-1]}")
    if format == "parquet" and importlib.util.find_spec("pyarrow") is None:
        raise ImportError('format: parquet needs the package pyarrow: pip install "hzn-sensor[dask]", or choose csv')
    if sensor.parameters["threshold"]["method"] == "track":
        raise ConfigError(
            "threshold.method: track takes its threshold from the previous picture, which another worker may have"
        )


def _check(sensor: Sensor, url: Url) -> tuple[str, dict[str, Any]]:
    """Return a picture and what is known of it; refuse what is impossible."""
    path, known = (url, {}) if isinstance(url, (str, os.PathLike)) else (url[0], dict(url[1]))
    name = os.fspath(path)
    try:
        _check_prior(sensor, _Prior(**known))
    except (ConfigError, TypeError) as error:
        what = str(error).removeprefix("_Prior.__new__() ")
        raise ConfigError(f"{name}: {what}") from None
    return name, known


@dataclass
class _Finished:
    done: Done
    frames: int


def _run(
    client: Client, tasks: Iterator[Task], retries: int, bar: Any
) -> tuple[dict[int, _Finished], BaseException | None]:
    """Run the tasks, with only a few of them on the way. Return what became of each shard by its first picture, and the
    first error. After an error of a task the others go on; after an error of the pictures no further task begins."""
    shards: dict[int, _Finished] = {}
    error: BaseException | None = None
    running: dict[Any, Task] = {}
    failed = 0
    finished = as_completed()
    while True:
        room = _WAITING * max(1, sum(client.nthreads().values()))
        while len(running) < room:
            try:
                task = next(tasks, None)
            except Exception as why:  # noqa: BLE001 (of the caller's generator)
                error = error or why
                task = None
            if task is None:
                break
            # The task is not pure: its result is the file on the disk, not its return value.
            future = client.submit(make, task, retries=retries, pure=False)
            running[future] = task
            finished.add(future)
        if not running:
            return shards, error
        future = next(finished)
        task = running.pop(future)
        try:
            done = future.result()
            shards[task.first] = _Finished(done, len(task.shard))
            failed += len(done.failed)
        except Exception as why:  # noqa: BLE001 (of the worker)
            error = error or why
        if bar is not None:
            bar.update(len(task.shard))
            bar.set_postfix(failed=failed, refresh=False)


def _bar(total: int | None) -> Any:
    try:
        from tqdm import tqdm  # type: ignore[import-untyped]
    except ImportError:
        raise ImportError("progress: the progress bar needs the package tqdm: pip install tqdm") from None
    return tqdm(total=total, unit=" pictures")


def _list(filesystem: Any, folder: str) -> list[str]:
    """Return the paths of the files in a folder."""
    # Other processes write into the folder, too.
    filesystem.invalidate_cache()
    try:
        return list(filesystem.ls(folder, detail=False))
    except FileNotFoundError:
        # An object store has no empty folders: the folder exists from its first file on.
        return []


def _existing(filesystem: Any, folder: str) -> dict[str, list[str]]:
    """Return the shards of a folder by their name without the digest of their pictures."""
    found: defaultdict[str, list[str]] = defaultdict(list)
    for path in _list(filesystem, folder):
        stem, _, rest = os.path.basename(path).rpartition("-")
        if stem.startswith("part-") and not path.endswith(".part"):
            found[f"{stem}.{rest.rpartition('.')[2]}"].append(path)
    return found


def _sweep(filesystem: Any, folder: str, names: Sequence[str]) -> None:
    """Remove the files of workers that died between writing a shard and renaming it."""
    own = {os.path.basename(name) for name in names}
    for path in _list(filesystem, folder):
        # The file name is NAME.PROCESS.part.
        if path.endswith(".part") and os.path.basename(path).rsplit(".", 2)[0] in own:
            filesystem.rm(path)


__all__ = ["Archive", "Url", "process_archive"]

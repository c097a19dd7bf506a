"""Many pictures on all cores: the threads are Python's, the work is done without the interpreter."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import chain
from typing import Any

from ._hzn import ConfigError, Report, Sensor, _Sequence


def process_many(sensor: Sensor, images: Any, jobs: int | None, progress: bool) -> Iterator[Report]:
    """What `Sensor.process_many` does."""
    if jobs is not None and jobs < 1:
        raise ConfigError(f"jobs: {jobs} is refused: must be 1 or more")
    work, items, total = _tasks(sensor, images)
    threads = jobs or len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1))
    reports = _in_order(work, items, threads)
    return _with_bar(reports, total) if progress else reports


def _tasks(sensor: Sensor, images: Any) -> tuple[Callable[[Any], Report], Iterable[Any], int | None]:
    """What is to be done with each item, the items, and their number where it is known."""
    if isinstance(images, str | os.PathLike):
        return _files(sensor, [images])
    iterator = iter(images)
    first = next(iterator, None)
    if isinstance(first, str | os.PathLike):
        return _files(sensor, [first, *iterator])

    def process(item: Any) -> Report:
        image, known = item if isinstance(item, tuple) else (item, {})
        return sensor.process(image, **known)

    total = len(images) if hasattr(images, "__len__") else None
    return process, chain([] if first is None else [first], iterator), total


def _files(
    sensor: Sensor, paths: Sequence[str | os.PathLike[str]]
) -> tuple[Callable[[Any], Report], Iterable[Any], int | None]:
    sequence = _Sequence(sensor, paths)
    return sequence.process, sequence, sequence.total()


def _in_order(work: Callable[[Any], Report], items: Iterable[Any], threads: int) -> Iterator[Report]:
    pool = ThreadPoolExecutor(threads, thread_name_prefix="hzn")
    pending: deque[Future[Report]] = deque()
    try:
        for item in items:
            pending.append(pool.submit(work, item))
            if len(pending) > 2 * threads:
                yield pending.popleft().result()
        while pending:
            yield pending.popleft().result()
    finally:
        # Also when the caller has had enough, or presses Ctrl-C: what was begun is finished, the rest forgotten.
        pool.shutdown(cancel_futures=True)


def _with_bar(reports: Iterator[Report], total: int | None) -> Iterator[Report]:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        raise ImportError("progress=True needs the package tqdm: pip install tqdm") from None
    return iter(tqdm(reports, total=total, unit=" frames"))

"""Many pictures on all cores: the threads are Python's, the work is done without the interpreter.

Pictures go to the threads in tasks of several, so that handing them over costs little beside them. The caller's thread
waits in `queue.SimpleQueue` alone: an interrupt leaves no lock behind, as it would in those that are written in Python.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from queue import SimpleQueue
from time import perf_counter
from typing import Any

from ._hzn import ConfigError, Report, Sensor, _Sequence

_TASK_S = 2e-3
_TASK_BYTES = 8 << 20
_TASK_ITEMS = 32


def process_many(sensor: Sensor, images: Any, jobs: int | None, progress: bool) -> Iterator[Report]:
    """What `Sensor.process_many` does."""
    if jobs is not None and jobs < 1:
        raise ConfigError(f"jobs: {jobs} is refused: must be 1 or more")
    work, items, total = _work(sensor, images)
    threads = jobs or len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1))
    reports = _in_order(work, items, threads)
    return _with_bar(reports, total) if progress else reports


def _work(sensor: Sensor, images: Any) -> tuple[Callable[[Any], Report], Iterable[Any], int | None]:
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


class _Task:
    """Some items, what comes after them, and in time what came of them."""

    def __init__(self) -> None:
        self.items: list[Any] = []
        self.error: BaseException | None = None
        """Raised when the reports before it are through."""
        self.through: SimpleQueue[list[Report]] = SimpleQueue()

    def reports(self) -> Iterator[Report]:
        """Waits for them."""
        yield from self.through.get()
        if self.error is not None:
            raise self.error


class _Pace:
    """What the threads tell each other."""

    stopped = False
    item_s = _TASK_S
    """What an item took of late; at first as long as a task may."""


def _in_order(work: Callable[[Any], Report], items: Iterable[Any], threads: int) -> Iterator[Report]:
    tasks: SimpleQueue[_Task | None] = SimpleQueue()
    pending: deque[_Task] = deque()
    pace = _Pace()
    # Daemons: when a second interrupt comes while they end, the program waits for none of them.
    workers = [
        threading.Thread(target=_serve, args=(work, tasks, pace), name=f"hzn-{i}", daemon=True) for i in range(threads)
    ]
    try:
        for worker in workers:
            worker.start()
        for task in _taken(items, pace):
            tasks.put(task)
            pending.append(task)
            while pending and (len(pending) > 2 * threads or not pending[0].through.empty()):
                yield from pending.popleft().reports()
        while pending:
            yield from pending.popleft().reports()
    finally:
        # Also when the caller has had enough, or presses Ctrl-C: what was begun is finished, the rest forgotten.
        pace.stopped = True
        for _ in workers:
            tasks.put(None)
        for worker in workers:
            worker.join()


def _taken(items: Iterable[Any], pace: _Pace) -> Iterator[_Task]:
    """Tasks of some milliseconds; of one item when items take longer to come or to be done."""
    iterator = iter(items)
    while True:
        task, held, begun = _Task(), 0, perf_counter()
        try:
            while True:
                item = next(iterator)
                task.items.append(item)
                held += getattr(item[0] if isinstance(item, tuple) else item, "nbytes", 0)
                next_s = max(perf_counter() - begun, (len(task.items) + 1) * pace.item_s)
                if held >= _TASK_BYTES or next_s > _TASK_S or len(task.items) == _TASK_ITEMS:
                    break
        except StopIteration:
            if task.items:
                yield task
            return
        except Exception as error:
            task.error = error
        yield task
        if task.error is not None:
            return


def _serve(work: Callable[[Any], Report], tasks: SimpleQueue[_Task | None], pace: _Pace) -> None:
    """What each thread does."""
    while (task := tasks.get()) is not None:
        reports: list[Report] = []
        begun = perf_counter()
        try:
            for item in task.items:
                if pace.stopped:
                    return
                reports.append(work(item))
                pace.item_s = (perf_counter() - begun) / len(reports)
        except BaseException as error:
            task.error = error
        task.items.clear()
        task.through.put(reports)


def _with_bar(reports: Iterator[Report], total: int | None) -> Iterator[Report]:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        raise ImportError("progress=True needs the package tqdm: pip install tqdm") from None
    return iter(tqdm(reports, total=total, unit=" frames"))

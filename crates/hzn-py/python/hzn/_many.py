"""Processing of many pictures on all cores: the threads are Python's, but they work without holding the interpreter.

A task for a thread has several pictures, so that its transfer costs little compared with the work. The caller's thread
waits only in `queue.SimpleQueue`: there an interrupt leaves no lock behind, unlike in the queues written in Python.
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

from ._hzn import ConfigError, Report, Sensor, _number, _Sequence

_TASK_S = 2e-3
_TASK_BYTES = 8 << 20
_TASK_ITEMS = 32
_NOTHING = object()


def process_many(sensor: Sensor, images: Any, jobs: int | None, progress: bool) -> Iterator[Report]:
    """Implement `Sensor.process_many`."""
    if jobs is not None and jobs < 1:
        raise ConfigError(f"jobs: {jobs} is refused: must be 1 or more")
    work, items, total = _work(sensor, images)
    threads = jobs or len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1))
    reports = _in_order(work, items, threads)
    return _with_bar(reports, total) if progress else reports


def _work(sensor: Sensor, images: Any) -> tuple[Callable[[Any], Report], Iterable[Any], int | None]:
    """Return the function for each item, the items, and their number if it is known."""
    if isinstance(images, str | os.PathLike):
        return _files(sensor, [images])
    iterator = iter(images)
    first = next(iterator, _NOTHING)
    if isinstance(first, str | os.PathLike):
        return _files(sensor, [first, *iterator])

    def process(numbered: _Numbered) -> Report:
        item = numbered.item
        image, known = item if isinstance(item, tuple) else (item, {})
        return _number(sensor.process(image, **known), numbered.index)

    total = len(images) if hasattr(images, "__len__") else None
    items = chain([] if first is _NOTHING else [first], iterator)
    return process, (_Numbered(index, item) for index, item in enumerate(items)), total


class _Numbered:
    """An item with its number."""

    def __init__(self, index: int, item: Any) -> None:
        self.index = index
        self.item = item
        self.nbytes: int = getattr(item[0] if isinstance(item, tuple) else item, "nbytes", 0)


def _files(
    sensor: Sensor, paths: Sequence[str | os.PathLike[str]]
) -> tuple[Callable[[Any], Report], Iterable[Any], int | None]:
    sequence = _Sequence(sensor, paths)
    return sequence.process, sequence, sequence.total()


class _Task:
    """Some items, the error that follows them, and later their reports."""

    def __init__(self) -> None:
        self.items: list[Any] = []
        self.error: BaseException | None = None
        """Raised after the reports of the task."""
        self.done: SimpleQueue[list[Report]] = SimpleQueue()

    def reports(self) -> Iterator[Report]:
        """Wait for the reports."""
        yield from self.done.get()
        if self.error is not None:
            raise self.error


class _Shared:
    """State that the threads share."""

    stopped = False
    item_s = _TASK_S
    """Recent time per item, seconds; at first the longest time of a task."""


def _in_order(work: Callable[[Any], Report], items: Iterable[Any], threads: int) -> Iterator[Report]:
    tasks: SimpleQueue[_Task | None] = SimpleQueue()
    pending: deque[_Task] = deque()
    shared = _Shared()
    # Daemon threads: if a second interrupt comes while they end, the program does not wait for them.
    workers = [
        threading.Thread(target=_run_tasks, args=(work, tasks, shared), name=f"hzn-{i}", daemon=True)
        for i in range(threads)
    ]
    try:
        for worker in workers:
            worker.start()
        for task in _tasks(items, shared):
            tasks.put(task)
            pending.append(task)
            while pending and (len(pending) > 2 * threads or not pending[0].done.empty()):
                yield from pending.popleft().reports()
        while pending:
            yield from pending.popleft().reports()
    finally:
        # Also runs if the caller stops early or presses Ctrl-C: items in progress are finished, all others are dropped.
        shared.stopped = True
        for _ in workers:
            tasks.put(None)
        for worker in workers:
            worker.join()


def _tasks(items: Iterable[Any], shared: _Shared) -> Iterator[_Task]:
    """Yield tasks of some milliseconds, or of a single item if an item takes longer to arrive or to process."""
    iterator = iter(items)
    while True:
        task, held_bytes, begun = _Task(), 0, perf_counter()
        try:
            while True:
                item = next(iterator)
                task.items.append(item)
                held_bytes += getattr(item, "nbytes", 0)
                next_s = max(perf_counter() - begun, (len(task.items) + 1) * shared.item_s)
                if held_bytes >= _TASK_BYTES or next_s > _TASK_S or len(task.items) == _TASK_ITEMS:
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


def _run_tasks(work: Callable[[Any], Report], tasks: SimpleQueue[_Task | None], shared: _Shared) -> None:
    """Run the tasks; the function of each thread."""
    while (task := tasks.get()) is not None:
        reports: list[Report] = []
        begun = perf_counter()
        try:
            for item in task.items:
                if shared.stopped:
                    return
                reports.append(work(item))
                shared.item_s = (perf_counter() - begun) / len(reports)
        except BaseException as error:
            task.error = error
        task.items.clear()
        task.done.put(reports)


def _with_bar(reports: Iterator[Report], total: int | None) -> Iterator[Report]:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        raise ImportError("progress=True needs the package tqdm: pip install tqdm") from None
    return iter(tqdm(reports, total=total, unit=" frames"))

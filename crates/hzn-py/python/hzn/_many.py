"""Processing of many pictures on all cores: the threads are Python's, but they work without holding the interpreter.

A task for a thread has several pictures, so that its transfer costs little compared with the work. The caller's thread
waits only in `queue.SimpleQueue`: there an interrupt leaves no lock behind, unlike in the queues written in Python.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from itertools import chain
from queue import SimpleQueue
from time import perf_counter
from typing import Any, TypeVar

from ._hzn import ConfigError, ImageError, Report, Rig, Sensor, _number, _Prior, _RigEpoch, _RigMemory, _Sequence

_TASK_S = 2e-3
_TASK_BYTES = 8 << 20
_TASK_ITEMS = 32
_NOTHING = object()
_Done = TypeVar("_Done")


def process_many(
    sensor: Sensor, images: Any, topic: str | None, jobs: int | None, progress: bool
) -> Iterator[Report]:
    """Implement `Sensor.process_many`."""
    threads = _threads(jobs)
    work, items, total = _work(sensor, images, topic)
    reports = _in_order(work, items, threads)
    return _with_bar(reports, total) if progress else reports


def process_epochs(rig: Rig, epochs: Any, jobs: int | None, progress: bool) -> Iterator[dict[str, Report]]:
    """Implement `Rig.process_many`."""
    threads = _threads(jobs)

    def see(numbered: _Numbered) -> _RigEpoch:
        images, known = numbered.item if isinstance(numbered.item, tuple) else (numbered.item, {})
        return rig._see(images, *_known(dict(known)))

    total = len(epochs) if hasattr(epochs, "__len__") else None
    items = (_Numbered(index, item) for index, item in enumerate(epochs))
    answers = _join(rig, _in_order(see, items, threads))
    return _with_bar(answers, total) if progress else answers


def _known(known: dict[str, Any]) -> tuple[_Prior, int | None]:
    """Check the keyword arguments of an epoch as those of `Rig.process`."""
    bits = known.pop("bits", None)
    try:
        for name in ("range_km", "range_sigma_km", "pole"):
            if name in known:
                raise TypeError(f"_Prior.__new__() got an unexpected keyword argument '{name}'")
        return _Prior(**known), bits
    except TypeError as error:
        raise TypeError(str(error).replace("_Prior.__new__()", "Rig.process()")) from None


def _join(rig: Rig, epochs: Generator[_RigEpoch, None, None]) -> Iterator[dict[str, Report]]:
    """Join the epochs in their order: a picture that repeats the one before is known only then."""
    memory = _RigMemory(rig)
    with closing(epochs):
        for index, epoch in enumerate(epochs):
            yield rig._join(memory, epoch, index)


def _threads(jobs: int | None) -> int:
    """Check the number of threads; without it, there is one per core."""
    if jobs is not None and jobs < 1:
        raise ConfigError(f"jobs: {jobs} is refused: must be 1 or more")
    return jobs or len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1))


def _work(
    sensor: Sensor, images: Any, topic: str | None
) -> tuple[Callable[[Any], Report], Iterable[Any], int | None]:
    """Return the function for each item, the items, and their number if it is known."""
    if isinstance(images, str | os.PathLike):
        return _files(sensor, [images], topic)
    camera = sensor.parameters["camera"]
    if getattr(images, "ndim", 0) in (2, 3) and images.shape[:2] == (camera["height"], camera["width"]):
        raise ImageError("images: this array is one picture, and several are expected; write [image]")
    iterator = iter(images)
    first = next(iterator, _NOTHING)
    if isinstance(first, str | os.PathLike):
        return _files(sensor, [first, *iterator], topic)
    if topic is not None:
        raise ConfigError("topic: arrays have no topics; give the path of a recording, or leave out topic")

    def process(numbered: _Numbered) -> Report:
        item = numbered.item
        image, known = item if isinstance(item, tuple) and len(item) == 2 else (item, {})
        if not isinstance(known, Mapping):
            what = f'a pair has a picture and a dict such as {{"altitude_km": 400.0}}, not {type(known).__name__}'
            raise TypeError(f"images: {what}")
        return _number(sensor.process(image, **known), numbered.index)

    total = len(images) if hasattr(images, "__len__") else None
    items = chain([] if first is _NOTHING else [first], iterator)
    return process, (_Numbered(index, item) for index, item in enumerate(items)), total


class _Numbered:
    """An item with its number."""

    def __init__(self, index: int, item: Any) -> None:
        self.index = index
        self.item = item
        given = item[0] if isinstance(item, tuple) else item
        pictures = given.values() if isinstance(given, dict) else [given]
        self.nbytes: int = sum(getattr(picture, "nbytes", 0) for picture in pictures)


def _files(
    sensor: Sensor, paths: Sequence[str | os.PathLike[str]], topic: str | None
) -> tuple[Callable[[Any], Report], Iterable[Any], int | None]:
    sequence = _Sequence(sensor, paths, topic)
    return sequence.process, sequence, sequence.total()


class _Task:
    """Some items, the error that follows them, and later what became of them: reports, or epochs of a rig."""

    def __init__(self) -> None:
        self.items: list[Any] = []
        self.error: BaseException | None = None
        """Raised after the reports of the task."""
        self.done: SimpleQueue[list[Any]] = SimpleQueue()

    def reports(self) -> Iterator[Any]:
        """Wait for the reports."""
        yield from self.done.get()
        if self.error is not None:
            raise self.error


class _Shared:
    """State that the threads share."""

    stopped = False
    item_s = _TASK_S
    """Recent time per item, seconds; at first the longest time of a task."""


def _in_order(work: Callable[[Any], _Done], items: Iterable[Any], threads: int) -> Generator[_Done, None, None]:
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


def _run_tasks(work: Callable[[Any], Any], tasks: SimpleQueue[_Task | None], shared: _Shared) -> None:
    """Run the tasks; the function of each thread."""
    while (task := tasks.get()) is not None:
        reports: list[Any] = []
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


def _with_bar(reports: Iterator[_Done], total: int | None) -> Iterator[_Done]:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        raise ImportError("progress=True needs the package tqdm: pip install tqdm") from None
    return iter(tqdm(reports, total=total, unit=" frames"))

"""Chunks of a design, computed by any executor of `concurrent.futures`."""

from __future__ import annotations

import multiprocessing
import signal
import threading
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from dataclasses import replace
from functools import lru_cache
from itertools import islice
from typing import Any

import cloudpickle
import pandas as pd

from nlctl.host.workers import end_with_parent
from nlctl.native.ensemble import cores

from ..uncertainty.design import Design, rows
from .experiment import Prepared, chunk_table

_LOOK = 0.5  # s between looks at Ctrl-C while workers are busy
Chunk = tuple[range, pd.DataFrame]


class LostChunkError(RuntimeError):
    """A worker ended without returning its chunk; the message says which rows are missing."""


def computed_elsewhere(
    executor: Executor,
    prepared: Prepared,
    design: Design,
    chunks: Iterable[range],
    wants_more: Callable[[], bool],
    *,
    threads: int | None = None,
) -> Generator[Chunk, None, None]:
    """Yield chunks as the executor finishes them."""
    # Two per worker are in flight at most. When no more are wanted, or one has failed, those that
    # have not begun are cancelled and the others are waited for.
    payload, todo = _packed(prepared, design), iter(chunks)
    waiting: dict[Future, range] = {}
    failures: list[tuple[range, BaseException]] = []
    workers = _workers(executor)

    def begin(numbers: range) -> None:
        points = None if design.points is None else rows(design, numbers)
        try:
            waiting[executor.submit(_worked, payload, points, numbers, threads or 1)] = numbers
        except BrokenExecutor as error:
            failures.append((numbers, error))

    try:
        while True:
            if wants_more() and not failures:
                for numbers in islice(todo, 2 * workers - len(waiting)):
                    begin(numbers)
            else:
                for future in list(waiting)[workers:]:
                    if future.cancel():
                        del waiting[future]
            if not waiting:
                break
            ready, _ = wait(waiting, timeout=_LOOK, return_when=FIRST_COMPLETED)
            for future in ready:
                numbers = waiting.pop(future)
                error = CancelledError() if future.cancelled() else future.exception()
                if error is None:
                    yield numbers, future.result()
                else:
                    failures.append((numbers, error))
    finally:
        for future in waiting:
            future.cancel()
    if failures:
        _raise(*failures[0])


def _packed(prepared: Prepared, design: Design) -> bytes:
    """Return what a worker needs, as bytes; functions made at run time travel by value."""
    # What builds diagrams stays at home, and the rows of a listed design go with their chunks.
    experiment = replace(prepared.experiment, build=_stays_at_home)
    light = replace(design, points=None, details={})
    return cloudpickle.dumps((replace(prepared, experiment=experiment), light))


def _stays_at_home(**choices: object) -> None:
    raise RuntimeError("a worker has compiled diagrams, it does not build them")


@lru_cache(maxsize=2)
def _unpacked(payload: bytes) -> tuple[Prepared, Design]:
    """Unpack once in every worker process, not once per chunk."""
    return cloudpickle.loads(payload)


def _worked(
    payload: bytes, points: pd.DataFrame | None, numbers: range, threads: int
) -> pd.DataFrame:
    """What a worker does: one chunk."""
    end_with_parent()
    in_main = threading.current_thread() is threading.main_thread()
    if in_main and multiprocessing.parent_process() is not None:
        # Ctrl-C reaches all processes of a terminal; the parent decides what is finished
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    prepared, design = _unpacked(payload)
    chosen = rows(design, numbers) if points is None else points
    return chunk_table(prepared, design, chosen, threads=threads)


def _workers(executor: Executor) -> int:
    """Return how many chunks an executor computes at once: its threads, processes or cores."""
    client: Any = getattr(executor, "_client", None)  # Dask's
    threads = sum(client.nthreads().values()) if client else 0
    return getattr(executor, "_max_workers", threads) or cores()


def _raise(numbers: range, error: BaseException) -> None:
    """Raise what ended a chunk; a lost worker is distinguished from an error of the experiment."""
    # Dask's errors are known by their names: it need not be installed
    if isinstance(error, BrokenExecutor | CancelledError) or "Killed" in type(error).__name__:
        raise LostChunkError(
            f"a worker ended abruptly while rows {numbers[0]} to {numbers[-1]} were computed "
            f"({type(error).__name__}{f': {error}' if str(error) else ''})"
        ) from error
    raise error

"""All rows of a design, run on whatever executor there is, and kept whatever happens."""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import islice, takewhile
from pathlib import Path
from typing import Any

import cloudpickle
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, of_type
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.host.workers import end_with_parent
from nlctl.names import check_known
from nlctl.native.ensemble import cores

from ..uncertainty.design import Design, rows
from .experiment import Prepared, chunk_table, columns_of
from .progress import Progress, Tally
from .store import ChunkStore, claimed, identity_of, opened, put, stored, table_of, taken_up

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


_LARGEST = 1024  # rows of a chunk: some 200 kB on disk, and seconds of work
FEWEST = 20  # chunks of a sweep, so that a kill costs little
_STEP = 64  # rows: a chunk keeps the SIMD lanes of several threads busy


def _check_columns(names: Iterable[str], columns: list[str]) -> None:
    for name in names:
        check_known("column", name, columns, "of the sweep")


@described_record(eq=False, made_by="sweep")
class Sweep:
    """Rows of a design that were run."""

    design: Design | None = field(repr=False)  # None where a folder was read without it.
    folder: Path | None  # Where the rows are kept.
    done: int  # Number of rows that are finished.
    complete: bool  # Whether these are all rows of the design.
    decided: object = None  # What ended the sweep early, see `sweep`; None if nothing did.
    # Whether Ctrl-C was pressed; in the last chunk that leaves it complete.
    interrupted: bool = False
    # What the user has to know: damaged chunks that were run again, lost workers.
    notes: tuple[str, ...] = ()
    # The rows of a sweep that is kept in no folder.
    held: pd.DataFrame | None = field(default=None, repr=False)

    @property
    def table(self) -> pd.DataFrame:
        """All finished rows by their numbers; read from the folder each time it is asked for."""
        return self.columns()

    @as_annotated
    def columns(self, *names: str) -> pd.DataFrame:
        """Return some columns of `table`; the others are not read.

        Parameters
        ----------
        *names : str
            Names of columns; all by default.

        Returns
        -------
        pandas.DataFrame
            One row for each row that is finished.

        Raises
        ------
        UnknownNameError
            If there is no such column.
        StoreError
            If a file cannot be read.
        """
        if self.folder is None:
            assert self.held is not None
            _check_columns(names, list(self.held))
            return self.held.loc[:, list(names)] if names else self.held
        store = opened(self.folder)
        _check_columns(names, list(store.columns))
        return table_of(store, names or None)


@as_annotated
def load(folder: str | os.PathLike[str], design: Design | None = None) -> Sweep:
    """Return the rows in a folder, finished or not, also while a sweep is working in it.

    Parameters
    ----------
    folder : path
        Of a sweep.
    design : Design, optional
        Of the sweep, for what asks for it.

    Raises
    ------
    StoreError
        If the folder holds no sweep.

    Examples
    --------
    >>> import tempfile
    >>> from nlctl.analysis.robustness import (
    ...     Experiment, Requirement, Space, Spec, Uncertain, grid, in_band, load, prepare, sweep
    ... )
    >>> space = Space(quantities=(Uncertain(name="valve.limit", bounds=(1.0, 3.0), nominal=2.0),))
    >>> strong = Requirement(key="strong", formula=in_band("v", lower=2.0), until=1.0)
    >>> experiment = Experiment(
    ...     space=space, build=lambda: nlctl.actuators.cascade({"valve": nlctl.Saturation()}),
    ...     spec=Spec(requirements=(strong,)), timepts=[0, 1], inputs=5.0,
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = sweep(prepare(experiment), grid(space, 2), folder)
    ...     print(load(folder).complete, load(folder).columns("spec")["spec"].tolist())
    True [-0.5, 0.5]
    """
    store = opened(folder)
    done = stored(store)
    return Sweep(design=design, folder=store.folder, done=done, complete=done == store.size)


@as_annotated
def sweep(
    prepared: Prepared,
    design: Design,
    folder: str | os.PathLike[str] | None = None,
    *,
    executor: Executor | None = None,
    chunk: int | None = None,
    resume: bool = False,
    threads: int | None = None,
    progress: Callable[[Progress], object] | None = None,
    stop: Callable[[Progress], Any] | None = None,
    identity: Mapping[str, Any] | None = None,
) -> Sweep:
    """Run the rows of a design.

    A row's result depends on the row alone: the table is the same, bit for bit, for any executor,
    chunk size and number of threads, and after any number of interruptions.  Only the column
    ``wall_time`` differs.  Ctrl-C finishes the chunks in hand; pressed again, it drops them.

    Parameters
    ----------
    prepared : Prepared
        The experiment, compiled: what `prepare` returns.
    design : Design
        Of the space of ``prepared.experiment``.
    folder : path, optional
        Every finished chunk is kept here at once, in Parquet, and memory stays flat.
    executor : concurrent.futures.Executor, optional
        Where chunks are computed: threads, processes, or a Dask cluster by
        ``client.get_executor()``.  By default in this process, with the engine's own threads,
        which is the fastest on one machine.
    chunk : int, optional
        Number of rows that are computed, kept and lost together.
    resume : bool, optional
        Whether rows that the folder holds already are taken up.  They must be of the same study.
    threads : int, optional
        Number of threads of each chunk; by default one per core, and one in an executor.
    progress : callable, optional
        Called with a `Progress` whenever rows are finished.
    stop : callable, optional
        Called with a `Progress` after every chunk; what it returns, unless false, ends the sweep
        and becomes ``decided``, see `progress.until_decided`.
    identity : mapping, optional
        What else identifies the study in `folder`, such as the text of its study file.

    Returns
    -------
    Sweep
        Incomplete after Ctrl-C before the last chunk, an early stop, or if workers were lost.

    Raises
    ------
    ParameterError
        If the design is of another space, `chunk` or `threads` is not an integer >= 1, or there is
        no folder to resume.
    StoreError
        As in `store.claimed`, or if a chunk cannot be written; those before it are kept.
    UnknownNameError
        If the design has a quantity that the experiment lacks.

    Examples
    --------
    Dead zones of many widths; it stops as soon as it is clear that few are too wide:

    >>> from nlctl.analysis.robustness import (
    ...     Experiment, Requirement, Space, Spec, Uncertain, eventually, in_band, independent,
    ...     prepare, sweep, until_decided,
    ... )
    >>> space = Space(quantities=(Uncertain(name="zone.b_r", bounds=(0.1, 0.9)),))
    >>> moves = Requirement(key="moves", formula=eventually(in_band("v", lower=0.01)), until=1.0)
    >>> experiment = Experiment(
    ...     space=space, build=lambda: nlctl.actuators.cascade({"zone": nlctl.DeadZone()}),
    ...     spec=Spec(requirements=(moves,)), timepts=np.linspace(0, 1, 5), inputs=1.0,
    ... )
    >>> design = independent(space, 2000, entropy=1)
    >>> made = sweep(prepare(experiment), design, chunk=200, stop=until_decided(design, 0.05))
    >>> print(made.decided.decision, made.done < 2000, made.complete)
    below True False
    """
    _check(prepared, design, executor, threads, resume and folder is None)
    fitting = min(_LARGEST, _STEP * math.ceil(design.size / (FEWEST * _STEP)))
    chunk = fitting if chunk is None else integer("a sweep", "chunk", chunk, 1)
    tally, frames, notes = Tally(design), [], []
    keep: Callable[[pd.DataFrame], object] = frames.append
    with ExitStack() as stack:
        if folder is not None:
            facts = identity_of(prepared, design, identity)
            store = ChunkStore(folder=Path(folder), identity=facts, columns=columns_of(prepared))
            stack.enter_context(claimed(store, resume=resume))
            keep = partial(put, store)
            notes += _continued(store, tally) if resume else []
        interrupt = stack.enter_context(gentle_interrupt())
        tally.restart()
        run = _Run(tally=tally, interrupt=interrupt, progress=progress, stop=stop)
        todo = tally.missing(chunk)
        chunks = (
            _computed_here(prepared, design, todo, run, threads)
            if executor is None
            else computed_elsewhere(
                executor, prepared, design, todo, run.wants_more, threads=threads
            )
        )
        notes += run.through(stack.enter_context(closing(chunks)), keep)
    held = None
    if folder is None:
        frames = frames or [chunk_table(prepared, design, rows(design, range(0)))]
        held = pd.concat(frames).sort_index()
    return Sweep(
        design=design,
        folder=None if folder is None else Path(folder),
        done=tally.done,
        complete=tally.done == design.size,
        decided=run.decided,
        interrupted=interrupt.asked,
        notes=tuple(notes),
        held=held,
    )


def _check(
    prepared: Prepared, design: Design, executor: object, threads: int | None, nothing_kept: bool
) -> None:
    of_type("a sweep", "prepared", prepared, Prepared, "prepare(experiment)")
    of_type("a sweep", "design", design, Design, "independent(space, size)")
    if executor is not None:
        of_type("a sweep", "executor", executor, Executor, "concurrent.futures")
    if threads is not None:
        integer("a sweep", "threads", threads, at_least=1)
    if nothing_kept:
        raise ParameterError("a sweep needs a folder to resume, got none")
    names, given = prepared.experiment.space.names, design.space.names
    for name in given:
        check_known("quantity", name, names, "in the design: take prepared.experiment.space")
    if names != given:
        raise ParameterError(f"the experiment's space has {names}, the design's has {given}")


def _continued(store: ChunkStore, tally: Tally) -> list[str]:
    """Count the chunks that are there; return what is to be said of damaged ones."""
    notes = []
    for numbers, statuses in taken_up(store):
        if isinstance(statuses, str):
            notes.append(statuses)
        else:
            tally.count(numbers, statuses)
    return notes


@dataclass(kw_only=True)
class _Run:
    """A running sweep: counts, and reasons to end it."""

    tally: Tally
    interrupt: Interrupt
    progress: Callable[[Progress], object] | None
    stop: Callable[[Progress], Any] | None
    decided: object = None

    def wants_more(self) -> bool:
        """Whether another chunk should begin."""
        return not (self.interrupt.asked or self.decided)

    def report(self, unfinished: int = 0) -> None:
        """Report the progress."""
        if self.progress is not None:
            self.progress(self.tally.progress(unfinished))

    def consider(self) -> None:
        """Report the progress, and ask whether the rows so far are enough."""
        self.report()
        if self.stop is not None and not self.decided:
            self.decided = self.stop(self.tally.progress()) or None

    def through(self, chunks: Iterator[Chunk], keep: Callable[[pd.DataFrame], object]) -> list[str]:
        """Keep and count all chunks; return what went wrong."""
        self.consider()
        try:
            for numbers, frame in chunks:
                keep(frame)
                self.tally.count(numbers, frame["spec"].to_numpy())
                self.consider()
        except LostChunkError as lost:
            return [str(lost)]
        except KeyboardInterrupt:
            self.interrupt.asked = True
        return []


def _computed_here(
    prepared: Prepared, design: Design, chunks: Iterable[range], run: _Run, threads: int | None
) -> Generator[Chunk, None, None]:
    """Yield chunk after chunk, until no more are wanted."""
    for numbers in takewhile(lambda _: run.wants_more(), chunks):
        yield (
            numbers,
            chunk_table(
                prepared, design, rows(design, numbers), threads=threads, progress=run.report
            ),
        )


class Interrupt:
    """Whether Ctrl-C was pressed."""

    asked = False


@contextmanager
def gentle_interrupt() -> Iterator[Interrupt]:
    """Take down the first SIGINT; the second one raises KeyboardInterrupt."""
    # Only Python's main thread may listen to signals: in another one, and where SIGINT is ignored,
    # nothing changes. What listened before listens again afterwards.
    interrupt = Interrupt()

    def pressed(number: int, frame: object) -> None:
        if interrupt.asked:
            raise KeyboardInterrupt
        interrupt.asked = True

    before = signal.getsignal(signal.SIGINT)
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or before in (signal.SIG_IGN, None):
        yield interrupt
        return
    signal.signal(signal.SIGINT, pressed)
    try:
        yield interrupt
    finally:
        signal.signal(signal.SIGINT, before)

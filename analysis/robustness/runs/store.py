"""A sweep's folder: chunk files in Parquet, each written in one step, so that a kill costs little.

study.json        what is run: results of another study are never mixed with these
chunks/000000000-000000999.parquet
                  rows 0 to 999; the file exists only when it is whole
.lock, .owner     held by the operating system for the process that works here; which that is
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import platform
import re
import socket
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from filelock import FileLock, Timeout

from nlctl import errors
from nlctl.arguments import integer
from nlctl.errors import UsageError
from nlctl.host.files import replace_file
from nlctl.wording import some_of

from ...loop_record import array_text, loop_facts, short_key, text_key
from ...metrics import Metric
from ..uncertainty.design import Design
from ..uncertainty.space import Space, Uncertain
from .experiment import Columns, Prepared, typed

if TYPE_CHECKING:
    import pyarrow as pa

VERSIONS = ("control", "numpy", "scipy", "numba", "llvmlite", "cma")
TELLING = {  # by the root of the modules: rooms that show numbers; all others may compute them
    Path(errors.__file__).parent: ("analysis/", "drawing/"),
    Path(__file__).parents[2]: ("cli/", "figures/", "pages/", "paper/page/", "recheck/", "report/"),
}
PROBES = np.array([0.01, 0.25, 0.5, 0.75, 0.99])


def identity_of(
    prepared: Prepared, design: Design, more: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return everything that the numbers of a study follow from, as data for a JSON file."""
    # It names no path and no machine.
    content = experiment_facts(prepared, design.space) | {
        "design": {
            "kind": design.kind,
            "size": design.size,
            "is_iid": design.is_iid,
            "entropy": str(design.entropy),  # too long for the numbers of other JSON readers
            "points": None if design.points is None else _table(design.points),
        },
        "study": dict(more or {}),
    }
    return json.loads(json.dumps(content)) | {"sha256": text_key(json.dumps(content))}


def experiment_facts(prepared: Prepared, space: Space | None = None) -> dict[str, Any]:
    """Return what the numbers of any row of an experiment follow from, its design aside."""
    experiment = prepared.experiment
    space = experiment.space if space is None else space
    return {
        "space": {q.name: _quantity(q) for q in space.quantities},
        "choices": {c.name: dict(zip(c.options, c.weights, strict=True)) for c in space.choices},
        "scale": space.scale,
        "spec": {
            r.key: {"formula": repr(r.formula), "until": r.until}
            for r in experiment.spec.requirements
        },
        "metrics": {m.key: _metric(m) for m in experiment.metrics},
        "settings": {
            "times": array_text(experiment.timepts),
            "inputs": array_text(experiment.inputs),
            **{k: getattr(experiment, k) for k in ("rtol", "atol", "max_steps", "method")},
        },
        "diagrams": {
            labels_text(labels): loop_facts(loop.system) for labels, loop in prepared.loops
        },
        "versions": versions_of_numbers(),
    }


def labels_text(labels: Mapping[str, str]) -> str:
    """Return which diagram of an experiment this is: the options that it has."""
    return ", ".join(f"{name} = {label}" for name, label in labels.items()) or "only"


@functools.cache
def versions_of_numbers() -> dict[str, str]:
    """Return the versions of all that computes numbers; nlctl's with a key of its source."""
    source = hashlib.sha256()
    for path, name in computing():
        source.update(f"{name}\0".encode() + path.read_bytes())
    version = f"{metadata.version('nlctl')} ({source.hexdigest()[:12]})"
    libraries = {name: metadata.version(name) for name in VERSIONS}
    return {"nlctl": version, **libraries, "python": platform.python_version()}


def computing() -> Iterator[tuple[Path, str]]:
    """Yield the files that numbers may come from, with their names below the root."""
    for root, telling in TELLING.items():
        for path in sorted(root.glob("**/*.py")):
            name = path.relative_to(root).as_posix()
            if not name.startswith(telling):
                yield path, name


def _quantity(quantity: Uncertain) -> dict[str, Any]:
    law = quantity.law
    numbers = [np.asarray(a).tolist() for a in law.args]
    numbers += [f"{k}={np.asarray(v).tolist()}" for k, v in law.kwds.items()]
    return {
        "law": f"{law.dist.name}({', '.join(map(str, numbers))})",
        "quantiles": [f"{v:.10g}" for v in law.ppf(PROBES)],  # of a law of the user's own as well
        "content": short_key(law),  # a histogram has its numbers nowhere else
        "bounds": list(quantity.box),
        "nominal": quantity.nominal,
        "unit": quantity.unit,
    }


def _metric(metric: Metric) -> dict[str, Any]:
    return {
        "signals": list(metric.signals),
        "function": _function(metric.function),
        "start": repr(metric.start),
        "end": repr(metric.end),
        "unit": metric.unit,
    }


def _function(function: object) -> str:
    """Return a function's name, and a key of it and of all that it reaches."""
    plain = function
    while isinstance(plain, functools.partial):
        plain = plain.func
    plain = getattr(plain, "py_func", plain)
    name = getattr(plain, "__qualname__", type(plain).__qualname__)
    return f"{name} {short_key(function)}"


def _table(points: pd.DataFrame) -> str:
    digest = hashlib.sha256(",".join(map(str, points.columns)).encode())
    for column in points.columns:
        values = points[column].to_numpy()
        is_number = values.dtype.kind in "iuf"
        digest.update(values.astype("<f8").tobytes() if is_number else repr(list(values)).encode())
    return f"{digest.hexdigest()[:16]} of shape {points.shape}"


def differences_of(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return what differs between two identities, one text for each place."""
    old, new = dict(_flat(before)), dict(_flat(now))
    keys = [key for key in {**old, **new} if key != "sha256"]
    missing = "nothing"
    return [
        f"{key} was {old.get(key, missing)}, now {new.get(key, missing)}"
        for key in keys
        if not _same(old.get(key, missing), new.get(key, missing))
    ]


def _same(one: object, other: object) -> bool:
    """Whether two values of JSON are equal; NaN equals NaN, here and inside of lists."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_same(one[k], other[k]) for k in one)
    return one == other or (one != one and other != other)


def _flat(content: Mapping[str, Any], place: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in content.items():
        here = f"{place}.{key}" if place else key
        if isinstance(value, Mapping):
            yield from _flat(value, here)
        else:
            yield here, value


CHUNKS_FORMAT = 2
SEALS = b"nlctl.seals"  # a key of each column, in a chunk's file


def parquet() -> ModuleType:
    """Return ``pyarrow.parquet``; say what to install where it is missing."""
    try:
        import pyarrow.parquet
    except ImportError:
        raise UsageError(
            "runs that are kept in a folder need pyarrow, for tables in Parquet: "
            'pip install "nlctl[studies]"'
        ) from None
    return pyarrow.parquet


def read_parquet(path: Path) -> pd.DataFrame:
    """Read a table that `DataFrame.to_parquet` has written, without threads."""
    # Those of pyarrow's datasets, which `read_table` begins, wait for ever where memory is too
    # short to begin others.
    with parquet().ParquetFile(path) as file:
        return file.read(use_threads=False).to_pandas(use_threads=False)


class StoreError(UsageError):
    """A folder that a sweep cannot be kept in; the message names it and says what is kept.

    Examples
    --------
    >>> from nlctl.analysis.robustness import load
    >>> load("no/such/folder")
    Traceback (most recent call last):
        ...
    nlctl.analysis...StoreError: 'no/such/folder/study.json' is not a study of a sweep: ...
    """


@dataclass(frozen=True, kw_only=True)
class ChunkStore:
    """A folder with chunks of one study."""

    folder: Path
    identity: Mapping[str, Any]  # see `identity.identity_of`
    columns: Columns  # see `experiment.columns_of`

    @property
    def chunks(self) -> Path:
        """Where the chunk files are."""
        return self.folder / "chunks"

    @property
    def size(self) -> int:
        """Number of rows of the design."""
        return self.identity["design"]["size"]


@contextmanager
def locked(folder: Path, error: type[UsageError] = StoreError) -> Iterator[None]:
    """Hold a folder for this process alone; it is made where there is none."""
    # The lock is the operating system's: it ends with the process, however that ends.
    owner, lock = folder / ".owner", FileLock(folder / ".lock", timeout=0)
    me = f"process {os.getpid()} on {socket.gethostname()}".encode()
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock.acquire()
            replace_file(owner, lambda file: file.write(me))
        except Timeout:
            raise error(
                f"'{folder}' is in use by {_text(owner) or 'another process'}: wait until it "
                "ends, or take another folder"
            ) from None
        except OSError as reason:
            raise error(f"cannot write to '{folder}': {reason.strerror or reason}") from reason
        yield
    finally:
        lock.release()  # does nothing where it is not held


def _text(path: Path) -> str:
    """Return what a file holds; nothing if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""


@contextmanager
def claimed(store: ChunkStore, *, resume: bool = False) -> Iterator[None]:
    """Hold a folder for this process alone, with the study's identity in it."""
    parquet()
    with locked(store.folder):
        _identify(store, resume)
        yield


def _identify(store: ChunkStore, resume: bool) -> None:
    """Write who a folder belongs to, or compare."""
    begun = bool(_ranges(store))
    if begun and not resume:
        raise StoreError(
            f"'{store.folder}' holds rows of a study already: continue it with resume=True "
            "(--resume), or take another folder"
        )
    if begun:
        changed = differences_of(opened(store.folder).identity, store.identity)
        if changed:
            more = f", and {len(changed) - 5} more" if len(changed) > 5 else ""
            raise StoreError(
                f"'{store.folder}' holds another study: {'; '.join(changed[:5])}{more}. Continue "
                "it with what it was begun with, or take another folder"
            )
        return
    content = {"format": CHUNKS_FORMAT, "identity": store.identity, "columns": store.columns}
    text = json.dumps(content | {"sha256": _key(content)}, indent=1)
    _write(store, store.folder / "study.json", text.encode())


def opened(folder: str | os.PathLike[str]) -> ChunkStore:
    """Return the store that a folder holds."""
    parquet()
    path = Path(folder) / "study.json"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        kept = content["format"]
        if kept == CHUNKS_FORMAT and content.pop("sha256") != _key(content):
            raise ValueError("it is not as it was written")
        store = ChunkStore(
            folder=path.parent, identity=content["identity"], columns=content["columns"]
        )
        integer("a sweep", "size", store.size, at_least=0)
        typed(pd.DataFrame(columns=list(store.columns)), store.columns)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise StoreError(f"'{path}' is not a study of a sweep: {error}") from error
    if kept != CHUNKS_FORMAT:
        raise StoreError(
            f"'{path}' has the format {str(kept)[:20]!a}, and this nlctl reads "
            f"{CHUNKS_FORMAT}: read it with the nlctl that wrote it, or run the study again"
        )
    return store


def _key(content: Mapping[str, Any]) -> str:
    return text_key(json.dumps(content, sort_keys=True))


def _write(store: ChunkStore, path: Path, content: bytes | memoryview) -> None:
    """Write a file of a store in one step, and return when it is on the disk."""

    def write(file: Any) -> None:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())

    try:
        path.parent.mkdir(exist_ok=True)
        replace_file(path, write)
    except OSError as error:
        raise StoreError(
            f"cannot write '{path}': {error.strerror or error}. "
            f"{some_of(stored(store), store.size, 'row', 'is', 'are')} kept there; make room and "
            "continue with resume=True (--resume)"
        ) from error


def put(store: ChunkStore, frame: pd.DataFrame) -> None:
    """Write consecutive rows as one chunk; floats keep their bits."""
    import pyarrow as pa

    columns = {"row": frame.index.to_numpy()} | {name: frame[name].array for name in frame}
    arrays = {name: pa.array(v, from_pandas=False) for name, v in columns.items()}  # NaN, not null
    labels: Any = [name for name, kind in store.columns.items() if not isinstance(kind, str)]
    seals = {name: _seal(frame[name]) for name in store.columns}
    table = pa.table(arrays).replace_schema_metadata({SEALS: json.dumps(seals)})
    sink = pa.BufferOutputStream()
    kept = {"compression": "zstd", "use_dictionary": labels, "write_page_checksum": True}
    parquet().write_table(table, sink, **kept)
    numbers = range(frame.index[0], frame.index[-1] + 1)
    _write(store, _path(store, numbers), memoryview(sink.getvalue()))


def _seal(column: Any) -> str:
    """Return a key of a column's values, which an edit of the file changes."""
    is_number = isinstance(column.dtype, np.dtype) and column.dtype.kind in "iufb"
    text = b"" if is_number else "\0".join(map(str, column)).encode()
    return hashlib.sha256(column.to_numpy().tobytes() if is_number else text).hexdigest()[:16]


def _check_seals(path: Path, frame: pd.DataFrame) -> None:
    """Refuse rows that are not what was written into a file."""
    seals = json.loads((parquet().read_schema(path).metadata or {}).get(SEALS, b"{}"))
    changed = [name for name in frame if seals.get(name) != _seal(frame[name])]
    if changed:
        raise ValueError(f"'{path.name}' is not as it was written: '{changed[0]}' was edited")


def _ranges(store: ChunkStore) -> list[range]:
    """Return the rows of every chunk file, in order."""
    ranges = []
    for path in sorted(store.chunks.glob("*.parquet")):
        name = re.fullmatch(r"(\d+)-(\d+)", path.stem)
        if name:
            ranges.append(range(int(name[1]), int(name[2]) + 1))
    return sorted(ranges, key=lambda numbers: numbers.start)


def _path(store: ChunkStore, numbers: range) -> Path:
    return store.chunks / f"{numbers[0]:09d}-{numbers[-1]:09d}.parquet"


def stored(store: ChunkStore) -> int:
    """Return the number of rows in the folder."""
    return sum(map(len, _ranges(store)))


def taken_up(store: ChunkStore) -> Iterator[tuple[range, np.ndarray | str]]:
    """Go through the chunks that are there, and clear what a killed process has left."""
    for place, pattern in (
        (store.folder, "..owner.*"),
        (store.folder, ".*.json.*"),
        (store.chunks, ".*.parquet.*"),
    ):
        for left in place.glob(pattern):
            left.unlink(missing_ok=True)
    end = 0
    for numbers in _ranges(store):
        path = _path(store, numbers)
        try:
            frame = _read(store, [path])
            if numbers.start < end or numbers.stop > store.size:
                raise ValueError("its rows are not where they belong")
            if not np.array_equal(frame.index, numbers):
                raise ValueError("it holds other rows than its name says")
            margins = frame["spec"].to_numpy()
        except (OSError, ValueError, KeyError) as error:  # pyarrow's errors are ValueErrors
            damaged = path.with_suffix(".damaged")
            os.replace(path, damaged)
            reason = str(error).partition("\n")[0]
            yield numbers, f"'{path}' is damaged ({reason}): kept as {damaged.name}, run again"
            continue
        end = numbers.stop
        yield numbers, margins


def table_of(store: ChunkStore, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Read the rows that are there, in order; only some columns where asked."""
    try:
        ranges = _ranges(store)
        frame = _read(store, [_path(store, numbers) for numbers in ranges], columns)
        if frame.index.tolist() != [row for numbers in ranges for row in numbers]:
            raise ValueError("they hold other rows than their names say")
        return frame
    except (OSError, ValueError, LookupError, TypeError) as error:
        reason = str(error).partition("\n")[0]  # pyarrow's list every column
        raise StoreError(
            f"cannot read the chunks in '{store.chunks}': {reason}. Run damaged ones again with "
            "resume=True (--resume)"
        ) from error


def _read(
    store: ChunkStore, paths: Sequence[Path], columns: Sequence[str] | None = None
) -> pd.DataFrame:
    import pyarrow as pa

    chosen = {name: store.columns[name] for name in columns or store.columns}
    if not paths:
        return typed(
            pd.DataFrame(columns=list(chosen), index=pd.Index([], name="row", dtype="int64")),
            chosen,
        )
    tables = [_columns_in(path, ["row", *chosen]) for path in paths]
    frame = pa.concat_tables(tables).to_pandas(use_threads=False).set_index("row")
    frame, end = typed(frame, chosen), 0
    for path in paths:
        first, end = end, end + parquet().read_metadata(path).num_rows
        _check_seals(path, frame.iloc[first:end])
    return frame


def _columns_in(path: Path, names: Sequence[str]) -> pa.Table:
    """Read some columns of a chunk's file, without threads."""
    with parquet().ParquetFile(path, page_checksum_verification=True) as file:
        lacking = [name for name in names if name not in file.schema_arrow.names]
        if lacking:
            raise ValueError(f"'{path.name}' has no column '{lacking[0]}'")
        return file.read(list(names), use_threads=False).replace_schema_metadata(None)

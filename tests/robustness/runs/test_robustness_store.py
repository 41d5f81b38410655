"""A sweep's folder survives kills, full disks, damage and a second sweep."""

import multiprocessing
import os
import random
import resource
import signal
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from places import SUPPORT
from scipy import stats
from sweep_examples import experiment, loop, same

from nlctl.analysis.robustness import (
    Requirement,
    Space,
    Spec,
    Uncertain,
    always,
    in_band,
    independent,
    prepare,
    scaled,
)
from nlctl.analysis.robustness.runs.store import ChunkStore, StoreError, claimed, put, table_of
from nlctl.analysis.robustness.runs.sweep import load, sweep
from nlctl.errors import UsageError

pytestmark = pytest.mark.slow  # one run, or one compiled function, for all of them

ROWS, CHUNK, ENTROPY = 96, 12, 3


@pytest.fixture(scope="module")
def made():
    return prepare(experiment())


@pytest.fixture(scope="module")
def design(made):
    return independent(made.experiment.space, ROWS, ENTROPY)


@pytest.fixture(scope="module")
def whole(made, design):
    return sweep(made, design).table


def test_without_pyarrow_a_folder_is_refused_before_the_first_run(made, design, tmp_path):
    """With what to install; a sweep in memory needs none."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "pyarrow", None)
        patch.setitem(sys.modules, "pyarrow.parquet", None)
        with pytest.raises(UsageError, match=r'pip install "nlctl\[studies\]"'):
            sweep(made, design, tmp_path / "runs")
        with pytest.raises(UsageError, match="need pyarrow"):
            load(tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


@pytest.fixture(scope="module")
def processes():
    """Processes that have imported and compiled everything before they are forked."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["sweep_warm"])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(SUPPORT))
        context.Process(target=int).start()  # the server starts with the first process
        yield context


def files(folder):
    """Return the names of all files in a folder."""
    return sorted(path.name for path in Path(folder).rglob("*") if path.is_file())


def test_a_folder_holds_the_table_of_memory(made, design, whole, tmp_path):
    """Bit for bit, in Parquet files that nobody needs nlctl for."""
    found = sweep(made, design, tmp_path, chunk=CHUNK)
    same(found.table, whole)
    assert found.complete
    plain = pd.concat(map(pd.read_parquet, sorted((tmp_path / "chunks").iterdir())))
    np.testing.assert_array_equal(plain["row"], whole.index)
    np.testing.assert_array_equal(plain["spec"], whole["spec"])
    again = load(tmp_path)
    assert again.complete
    same(again.table, whole)
    pd.testing.assert_frame_equal(again.columns("spec", "status"), whole[["spec", "status"]])


def test_floats_keep_their_bits(tmp_path):
    """Signed zeros, subnormals, NaN with a payload and the largest numbers."""
    nan = np.array([0x7FF8DEADBEEF0001], dtype=np.uint64).view(float)[0]
    values = np.array([0.0, -0.0, 5e-324, -2.2e-308, nan, np.inf, -np.inf, 1.8e308, 0.1])
    frame = pd.DataFrame({"x": values}, index=pd.RangeIndex(9, name="row"))
    facts = {"design": {"size": 9}}
    store = ChunkStore(folder=tmp_path, identity=facts, columns={"x": "float64"})
    with claimed(store):
        put(store, frame)
    found = table_of(store)["x"].to_numpy()
    np.testing.assert_array_equal(found.view(np.uint64), values.view(np.uint64))


def work(folder):
    """What a process does that will be killed."""
    made = prepare(experiment())
    sweep(made, independent(made.experiment.space, ROWS, ENTROPY), folder, chunk=3, resume=True)


def killed_again_and_again(processes, folder, times, seed):
    """Start sweeps and kill each at a random moment after its first new chunk; count the kills."""
    moments, kills = random.Random(seed), 0
    for _ in range(times):
        before = set(files(folder))
        process = processes.Process(target=work, args=(folder,))
        process.start()
        while process.is_alive() and not {f for f in set(files(folder)) - before if f[0] == "0"}:
            time.sleep(0.002)
        process.join(moments.uniform(0, 0.1))
        process.kill()
        process.join()
        kills += process.exitcode == -signal.SIGKILL
    return kills


def test_kill_9_again_and_again_changes_nothing(made, design, whole, processes, tmp_path):
    """What the kills have left is taken up, and the table is that of an undisturbed sweep."""
    assert killed_again_and_again(processes, tmp_path, times=5, seed=1) >= 3
    taken = load(tmp_path)
    same(taken.table, whole.loc[taken.table.index])
    found = sweep(made, design, tmp_path, chunk=3, resume=True)
    assert found.complete
    assert found.notes == ()
    same(found.table, whole)
    left = {name for name in files(tmp_path) if not name.endswith(".parquet")}
    assert left == {".lock", ".owner", "study.json"}


def test_only_missing_rows_are_run(made, design, whole, tmp_path):
    """Also with chunks of another size."""
    sweep(made, design, tmp_path, chunk=CHUNK)
    lost = [tmp_path / "chunks" / f"{a:09d}-{a + 11:09d}.parquet" for a in (24, 36, 84)]
    for path in lost:
        path.unlink()
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "chunks").iterdir()}
    seen = []
    found = sweep(made, design, tmp_path, chunk=20, resume=True, progress=seen.append)
    assert seen[0].done == ROWS - 36
    assert found.complete
    same(found.table, whole)
    for path, changed in kept.items():
        assert path.stat().st_mtime_ns == changed


def test_damaged_chunks_are_named_and_run_again(made, design, whole, tmp_path):
    """Cut off, empty, with a flipped bit, or with rows that belong elsewhere."""
    sweep(made, design, tmp_path, chunk=CHUNK)
    paths = sorted((tmp_path / "chunks").iterdir())
    content = [bytearray(path.read_bytes()) for path in paths]
    flipped = content[2].copy()
    flipped[len(flipped) // 3] ^= 4
    damage = [content[0][: len(content[0]) // 2], b"", flipped, content[5]]
    for path, new in zip(paths, damage, strict=False):
        path.write_bytes(new)
    found = sweep(made, design, tmp_path, resume=True)
    assert found.complete
    same(found.table, whole)
    assert len(found.notes) == 4
    for path, note in zip(paths, found.notes, strict=False):
        assert str(path) in note
        assert path.with_suffix(".damaged").exists()
    assert sweep(made, design, tmp_path, resume=True).notes == ()


def test_a_damaged_chunk_is_never_read_silently(made, design, tmp_path):
    """Whoever asks for the table is told how to repair it."""
    found = sweep(made, design, tmp_path, chunk=CHUNK)
    path = tmp_path / "chunks" / "000000012-000000023.parquet"
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 4
    path.write_bytes(content)
    with pytest.raises(StoreError, match="resume=True"):
        found.table  # noqa: B018


def test_two_sweeps_into_one_folder_are_refused(made, design, whole, tmp_path):
    """The second one is told who works there; the first one goes on."""
    refused = []

    def second(progress):
        with pytest.raises(StoreError, match=f"in use by process {os.getpid()} on") as error:
            sweep(made, design, tmp_path, resume=True)
        refused.append(error)

    found = sweep(made, design, tmp_path, chunk=48, threads=1, progress=second)
    assert refused
    same(found.table, whole)


def test_a_folder_with_rows_is_not_taken_without_a_word(made, design, tmp_path):
    """The message says how to go on."""
    sweep(made, design, tmp_path)
    before = files(tmp_path)
    with pytest.raises(StoreError, match=r"resume=True \(--resume\)"):
        sweep(made, design, tmp_path)
    assert files(tmp_path) == before


CHANGES = {
    "settings.rtol was 1e-08, now 1e-07": {"rtol": 1e-7},
    "spec.small.formula": {
        "spec": Spec(
            requirements=(
                Requirement(key="small", formula=always(in_band("y", upper=0.4), 1, 2), until=2),
            )
        )
    },
    "metrics.peak": {"metrics": experiment().metrics[:1]},
    "diagrams.only.parameters": {"build": lambda: loop(rate=1.1)},
}


@pytest.mark.parametrize("place", CHANGES)
def test_another_experiment_is_refused_with_what_differs(made, design, tmp_path, place):
    """Rows of two studies are never mixed."""
    sweep(made, design, tmp_path)
    other = prepare(experiment(**CHANGES[place]))
    with pytest.raises(StoreError, match=f"holds another study: .*{place}"):
        sweep(other, replace(design, space=other.experiment.space), tmp_path, resume=True)


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"entropy": 4}, "design.entropy was 3, now 4"),
        ({"size": 97}, "design.size was 96, now 97"),
        ({"space": "halved"}, "scale was 1.0, now 0.5"),
    ],
)
def test_another_design_is_refused_with_what_differs(made, design, tmp_path, changes, place):
    """The folder keeps what it has."""
    sweep(made, design, tmp_path)
    if "space" in changes:
        changes = {"space": scaled(design.space, 0.5)}
    with pytest.raises(StoreError, match=place):
        sweep(made, replace(design, **changes), tmp_path, resume=True)
    assert load(tmp_path).complete


def test_another_histogram_is_another_law(tmp_path):
    """With the same ends, quartiles and median: mass has moved from one eighth to the next."""

    def drawn(moved):
        shares = [100, 50 + moved, 50 - moved, 100, 100]
        law = stats.rv_histogram((shares, [0.5, 1.0, 1.25, 1.5, 2.0, 2.5]), density=False)
        space = Space(quantities=(Uncertain(name="lag.rate", law=law()),))
        return prepare(experiment(space=space))

    one, other = drawn(0), drawn(25)
    sweep(one, independent(one.experiment.space, 4, 1), tmp_path)
    with pytest.raises(StoreError, match=r"space\.lag\.rate\.content was"):
        sweep(other, independent(other.experiment.space, 4, 1), tmp_path, resume=True)


def test_a_study_may_say_what_else_identifies_it(made, design, tmp_path):
    """Such as the text of its study file."""
    sweep(made, design, tmp_path, identity={"text": "a"})
    with pytest.raises(StoreError, match=r"study\.text was a, now b"):
        sweep(made, design, tmp_path, identity={"text": "b"}, resume=True)


def test_a_file_in_place_of_the_folder_is_named(made, design, tmp_path):
    """Before anything is computed."""
    path = tmp_path / "taken"
    path.write_text("mine")
    with pytest.raises(StoreError, match=f"cannot write to '{path}'"):
        sweep(made, design, path)
    assert path.read_text() == "mine"


def fill(folder):
    """Sweep until files may not grow any more; return the error's text."""
    made = prepare(experiment())

    def limit(progress):
        if progress.runs >= 2 * CHUNK:
            resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))

    design = independent(made.experiment.space, ROWS, ENTROPY)
    with pytest.raises(StoreError) as error:
        sweep(made, design, folder, chunk=CHUNK, threads=1, progress=limit)
    return str(error.value)


def test_a_full_disk_is_named_and_loses_nothing_else(made, design, whole, processes, tmp_path):
    """The operating system refuses to write; no half file is left, and there is a way on."""
    with ProcessPoolExecutor(1, processes) as pool:
        text = pool.submit(fill, tmp_path).result()
    assert text.startswith(f"cannot write '{tmp_path / 'chunks' / '000000024-000000035.parquet'}'")
    assert "File too large. 24 of 96 rows are kept" in text
    assert len(files(tmp_path / "chunks")) == 2
    found = sweep(made, design, tmp_path, chunk=CHUNK, resume=True)
    same(found.table, whole)


def test_an_unfinished_folder_can_be_read(made, design, whole, tmp_path):
    """Also while the sweep works in it."""
    seen = []

    def look(progress):
        found = load(tmp_path)
        seen.append(found.table)
        same(seen[-1], whole.iloc[: found.done])
        assert found.complete == (found.done == ROWS)

    sweep(made, design, tmp_path, chunk=48, threads=1, progress=look)
    assert {len(table) for table in seen} == {0, 48, 96}
    assert list(seen[0].columns) == list(whole.columns)


def test_a_folder_without_a_sweep_is_named(tmp_path):
    """With the file that is missing."""
    with pytest.raises(StoreError, match=r"study\.json' is not a study"):
        load(tmp_path)


def test_the_identity_is_the_same_in_another_process(made, design, processes, tmp_path):
    """Hash seeds, addresses and temporary names are no part of it."""
    process = processes.Process(target=work, args=(tmp_path,))
    process.start()
    process.join()
    assert sweep(made, design, tmp_path, resume=True).complete
    assert str(loop().name) not in (tmp_path / "study.json").read_text()

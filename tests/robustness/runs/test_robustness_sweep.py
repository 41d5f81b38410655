"""A sweep gives the same table wherever it runs, and ends as it is told to."""

import multiprocessing
import signal
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from io import StringIO

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from scipy import stats
from sweep_examples import experiment, loop, same

import nlctl
from nlctl.analysis.cli.progress import sweep_bar
from nlctl.analysis.metrics import in_machine_code
from nlctl.analysis.robustness import (
    Choice,
    NoGuaranteeError,
    Space,
    Uncertain,
    from_table,
    grid,
    independent,
    prepare,
    seed_number,
    sequence_bounds,
    tracking_metrics,
)
from nlctl.analysis.robustness.runs.progress import Progress, Tally, until_decided
from nlctl.analysis.robustness.runs.sweep import load, sweep
from nlctl.analysis.robustness.stl.piecewise import extremes, with_vertices


@pytest.fixture(scope="module")
def made():
    return prepare(experiment())


@pytest.fixture(scope="module")
def design(made):
    return independent(made.experiment.space, 90, 7)


@pytest.fixture(scope="module")
def whole(made, design):
    return sweep(made, design, threads=1).table


@pytest.mark.parted
@pytest.mark.parametrize(("threads", "chunk"), [(2, None), (1, 17), (2, 90), (1, 1000)])
def test_threads_and_chunks_do_not_change_the_table(made, design, whole, threads, chunk):
    """Bit for bit, diverged runs and their graded margins included."""
    found = sweep(made, design, threads=threads, chunk=chunk)
    same(found.table, whole)
    assert found.complete
    assert found.done == 90
    assert 0 < np.sum(whole["status"] != "OK") < 90


def test_threads_of_an_executor_compute_the_same_table(made, design, whole):
    """Chunks come in any order, rows stand in theirs."""
    with ThreadPoolExecutor(3) as pool:
        same(sweep(made, design, executor=pool, chunk=7).table, whole)


@pytest.mark.weekly
def test_spawned_processes_compute_the_same_table(made, design, whole):
    """Also the rows of a listed design, whose points travel with their chunks.

    When processes are lost, the pool is broken for good: the sweep is incomplete, not wrong.
    """
    listed = from_table(made.experiment.space, design.table, entropy=design.entropy)

    def kill(progress):
        for process in list(pool._processes.values()):
            process.kill()

    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        same(sweep(made, design, executor=pool, chunk=16).table, whole)
        same(sweep(made, listed, executor=pool, chunk=20).table, whole)
        found = sweep(made, design, executor=pool, chunk=5, progress=once(kill))
    assert not found.complete
    assert 5 <= found.done < 90
    assert "a worker ended abruptly while rows" in found.notes[0]
    same(found.table, whole.loc[found.table.index])


def test_rows_carry_seeds_and_times(made, design, whole):
    """Each row's seed is that of its number; its wall time is its share of the chunk's."""
    assert whole["seed"].dtype == np.uint64
    assert list(whole["seed"].head(3)) == [seed_number(design, row) for row in range(3)]
    assert np.all(whole["wall_time"] > 0)
    found = sweep(made, design, threads=1, chunk=30).table
    assert found["wall_time"].nunique() == 3
    assert isinstance(found["status"].dtype, pd.CategoricalDtype)


def test_choices_are_labels_of_the_table():
    """Rows of all diagrams stand in the order of the design."""
    space = Space(
        quantities=(Uncertain(name="lag.x(0)", bounds=(0.5, 1.0)),),
        choices=(Choice(name="rate", options={"slow": 1.0, "fast": 2.0}),),
    )
    made = prepare(experiment(space=space, build=loop))
    found = sweep(made, grid(made.experiment.space, 3), chunk=4).table
    assert list(found.index) == list(range(6))
    rate = found["rate"].map({"slow": 1.0, "fast": 2.0}).astype(float)
    np.testing.assert_allclose(found["end"], found["lag.x(0)"] * np.exp(-2 * rate), atol=1e-6)


def test_a_design_of_another_space_is_refused(made):
    """With the name that the experiment does not know."""
    other = Space(quantities=(Uncertain(name="lag.speed", bounds=(0, 1)),))
    with pytest.raises(nlctl.errors.UnknownNameError, match=r"lag\.speed"):
        sweep(made, independent(other, 3, 1))


def test_a_refused_value_names_the_rows():
    """A draw that breaks a rule of the block is found in its chunk."""
    law = stats.norm(1.0, 0.1)
    space = Space(quantities=(Uncertain(name="lag.gain", law=law, nominal=1.0),))
    made = prepare(experiment(space=space))
    points = pd.DataFrame({"lag.gain": [1.0] * 9 + [-1.0]})
    with pytest.raises(nlctl.errors.ParameterError, match=r"gain.*-1.*in rows 8 to 9"):
        sweep(made, from_table(made.experiment.space, points), chunk=4)


def test_progress_counts_violations_and_bounds_them(made, design, whole):
    """The last report is the whole table's; bounds are those of the confidence sequence."""
    seen = []
    sweep(made, design, chunk=30, threads=1, progress=seen.append)
    done = [progress.done for progress in seen]
    assert done == sorted(done)
    assert (done[0], done[-1]) == (0, 90)
    assert len(set(done)) > 4  # also within a chunk
    violations = int(np.sum(~(whole["spec"] > 0)))
    assert 0 < violations < 90
    assert (seen[-1].runs, seen[-1].violations) == (90, violations)
    assert seen[-1].interval(0.9) == sequence_bounds(violations, 90, 0.9)
    assert seen[0].interval() is None
    assert seen[-1].remaining == 0


def test_rows_beyond_a_gap_do_not_count_yet(design):
    """Which chunks end first may depend on how their runs end."""
    tally = Tally(design)
    tally.count(range(10, 20), np.full(10, -1.0))
    assert (tally.progress().done, tally.progress().runs) == (10, 0)
    assert [*tally.missing(50)] == [range(10), range(20, 70), range(70, 90)]
    tally.count(range(10), np.array([1.0] * 8 + [np.nan, 0.0]))
    assert (tally.progress().runs, tally.progress().violations) == (20, 12)


def test_only_independent_draws_have_a_running_interval(made):
    """A grid has counts and no probability."""
    seen = []
    sweep(made, grid(made.experiment.space, 5), progress=seen.append)
    assert seen[-1].runs == 5**2
    assert seen[-1].interval() is None
    with pytest.raises(NoGuaranteeError):
        until_decided(grid(made.experiment.space, 5), 0.1)


def test_a_decided_sweep_stops_after_the_chunk(made, design):
    """The statement is the one that the rows so far support."""
    found = sweep(made, design, chunk=10, stop=until_decided(design, 0.99, 0.9))
    assert not found.complete
    assert found.done % 10 == 0
    assert found.decided.decision == "below"
    assert found.decided.statement.runs == found.done == len(found.table)
    assert found.decided.statement.upper < 0.99


def test_rows_that_are_there_may_decide_already(made, design, tmp_path):
    """Nothing is run then."""
    sweep(made, design, tmp_path, chunk=10, stop=until_decided(design, 0.99, 0.9))
    before = sorted(tmp_path.rglob("*.parquet"))
    found = sweep(made, design, tmp_path, resume=True, stop=until_decided(design, 0.99, 0.9))
    assert found.decided.decision == "below"
    assert sorted(tmp_path.rglob("*.parquet")) == before


def test_a_refused_row_costs_only_its_chunk(tmp_path):
    """What other workers have finished is kept in the folder."""
    made = prepare(experiment())
    points = independent(made.experiment.space, 40, 1).table
    points.loc[25, "lag.gain"] = -1.0
    design = from_table(made.experiment.space, points)
    with (
        ThreadPoolExecutor(2) as pool,
        pytest.raises(nlctl.errors.ParameterError, match="rows 20 to 29"),
    ):
        sweep(made, design, tmp_path, executor=pool, chunk=10)
    kept = load(tmp_path).table
    assert {*range(20)} <= {*kept.index}
    assert not {*range(20, 30)} & {*kept.index}


@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_finishes_the_chunk(made, design, whole):
    """What is done is a part of the whole; the handler is the old one again."""
    before = signal.getsignal(signal.SIGINT)

    def press(progress):
        if 0 < progress.done < 30:
            signal.raise_signal(signal.SIGINT)

    found = sweep(made, design, chunk=30, threads=1, progress=once(press))
    assert found.interrupted
    assert not found.complete
    assert found.done == 30
    same(found.table, whole.loc[:29])
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("presses_at", [0, 30])
@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_twice_drops_the_chunk(made, design, whole, presses_at):
    """Only whole chunks are kept; without one the table has its columns all the same."""

    def press(progress):
        if progress.done > presses_at:  # a fast chunk may tell its progress only once
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)

    found = sweep(made, design, chunk=30, threads=1, progress=press)
    assert found.interrupted
    assert found.done == len(found.table) == presses_at
    same(found.table, whole.iloc[:presses_at])


def once(press):
    """Call `press` until it has raised its signal."""
    done = []

    def tell(progress):
        if not done and progress.done > 0:
            done.append(True)
            press(progress)

    return tell


@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_waits_for_the_chunks_of_an_executor(made, design, whole):
    """Those that run are finished, those that wait are not begun."""

    def press(progress):
        signal.raise_signal(signal.SIGINT)

    with ThreadPoolExecutor(1) as pool:
        found = sweep(made, design, executor=pool, chunk=9, progress=once(press))
    assert found.interrupted
    assert 9 <= found.done < 90
    same(found.table, whole.loc[found.table.index])


def test_a_sweep_runs_outside_of_the_main_thread(made, design, whole):
    """Where no signal can be listened to."""
    found = []
    thread = threading.Thread(target=lambda: found.append(sweep(made, design).table))
    thread.start()
    thread.join()
    same(found[0], whole)


@given(
    st.lists(st.floats(-3, 3), min_size=4, max_size=30),
    st.tuples(st.floats(0, 1), st.floats(0, 1)).map(sorted),
)
def test_the_short_way_to_a_band_over_one_window_is_exact(samples, window):
    """The extremes in a window are those of the whole trace of the signal."""
    t, y = np.linspace(0, 1, len(samples)), np.array(samples)
    for low, high in (window, (t[1], t[-2]), (0.0, window[1])):
        expected = with_vertices(t, y).between(low, high).y
        assert extremes(t, y, low, high) == (np.min(expected), np.max(expected))


@pytest.mark.weekly
def test_machine_code_of_the_usual_metrics_agrees_with_python():
    """To the rounding of sums."""
    t = np.linspace(0, 20, 1001)
    y = np.exp(-t / 5) * np.sin(3 * t) + 0.01 * np.cos(40 * t)
    for metric in tracking_metrics(start=10, band=0.05):
        fast = in_machine_code(metric.function)
        assert fast is not metric.function
        np.testing.assert_allclose(fast(t, y), metric.function(t, y), rtol=1e-13)
    assert in_machine_code(len) is len


def test_the_bar_shows_rows_rate_and_bounds():
    """In a terminal; elsewhere nothing is printed."""
    progress = Progress(done=50, total=100, runs=50, violations=5, rate=12.5, is_iid=True)
    for is_terminal in (True, False):
        console = Console(file=StringIO(), force_terminal=is_terminal, width=150)
        with sweep_bar("example 1", console) as show:
            show(progress)
        text = console.file.getvalue()
        low, high = sequence_bounds(5, 50)
        shown = f"5 of 50 violate, p in [{low:.2g}, {high:.2g}] at 99 %" in text
        assert shown == is_terminal
        assert ("50/100 rows, 12.5/s" in text) == is_terminal
    assert progress.remaining == 4


@pytest.mark.parametrize("kept", [False, True])
def test_a_column_that_is_not_there_is_an_error(made, design, tmp_path, kept):
    """In memory and in a folder; not one column less."""
    found = sweep(made, design, folder=tmp_path / "rows" if kept else None)
    assert list(found.columns("spec").columns) == ["spec"]
    with pytest.raises(nlctl.errors.UnknownNameError, match="unknown column 'spek' of the sweep"):
        found.columns("spec", "spek")

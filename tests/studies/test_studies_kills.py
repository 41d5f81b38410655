"""Thirty kills of studies: afterwards the tables are those of one run, or the resume is refused."""

import multiprocessing
import os
import signal
import sys
import time

import pandas as pd
import pytest
from processes import alive, descendants, wait_until
from studies_example import HEAD, write

from nlctl.analysis.studies import RunFolderError, load_result, read_study, run
from nlctl.host.workers import process_pool

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")

STUDY = f"""{HEAD}
[runs]
size = 2000

[[analysis]]
kind = "worst case"
runs = 40

[[analysis]]
kind = "probability"
limit = 0.5

[[analysis]]
kind = "morris"
trajectories = 40

[[analysis]]
kind = "radius"
quantities = ["lag.rate"]
largest = 0.9
runs = 40
draws = 40

[[analysis]]
kind = "compare"
keyword = "lag"
options = {{ function = "loop.py:lags" }}
requirements = ["decays"]
runs = 300
metrics = {{ iae = "smaller" }}
"""
SEARCHES = STUDY.replace("[runs]\nsize = 2000\n", "").replace(
    '[[analysis]]\nkind = "probability"\nlimit = 0.5\n', ""
)
# from which file on a process is killed
EARLY = ["study.toml", "run.json"]
ROWS = ["rows/study.json", "rows/chunks/*.parquet", "worst-case/finding.json"]
BETWEEN = ["probability/finding.json", "morris/rows/chunks/*", "morris/finding.json"]
LATE = ["radius/finding.json", "compare/rows/chunks/*"]
SEARCHING = ["run.json", "worst-case/finding.json", "morris/finding.json", "radius/finding.json"]
KILLS = [
    *(("parent", STUDY, moment, None) for moment in EARLY + ROWS + BETWEEN + LATE),
    *(("parent", SEARCHES, moment, None) for moment in SEARCHING),
    *(("parent", STUDY, m, "equation") for m in ("study.toml", "run.json", ROWS[1], BETWEEN[0])),
    *(("parent", SEARCHES, moment, "equation") for moment in SEARCHING),
    *(("parent", SEARCHES, moment, "option") for moment in SEARCHING[1:3]),
    *(("worker", STUDY, moment, None) for moment in (ROWS[1], BETWEEN[1], LATE[1])),
    *(("pool", STUDY, moment, None) for moment in (ROWS[1], BETWEEN[1], LATE[1])),
]
EDITS = {
    "equation": ("p.gain * x[0] ** 3", "p.gain * x[0] ** 2"),
    "option": ('"wild": Lag(gain=0.4)', '"wild": Lag(gain=0.5)'),
}
EACH_RUN = (10,)  # those with a worker take longer

REFUSED = 2


def work(path, out, pooled):
    """What is killed: a study, begun or taken up."""
    file = read_study(path)
    if not pooled:
        try:
            run(file, out, resume=True, threads=1)
        except RunFolderError as error:
            out.with_name("refusal").write_text(str(error), encoding="utf-8")
            sys.exit(REFUSED)
        return
    with process_pool(2) as pool:
        run(file, out, resume=True, executor=pool)


@pytest.fixture(scope="module")
def server():
    """Processes that begin with everything imported."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["nlctl.analysis.studies"])
    return context


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Both studies, uninterrupted, and the folder of their loop."""
    folder = tmp_path_factory.mktemp("kills")
    found = {}
    for number, study in enumerate((STUDY, SEARCHES)):
        path = write(folder, study, name=f"study{number}.toml")
        found[study] = path, run(read_study(path), folder / f"whole{number}", threads=1)
    return folder, found


def killed(server, path, out, who, moment):
    """Run a study until something is there, and kill; return the processes that there were."""
    process = server.Process(target=work, args=(path, out, who != "parent"))
    process.start()
    while process.is_alive() and not any(out.glob(moment)):
        time.sleep(0.001)
    every = {process.pid} | descendants(process.pid)
    if who == "worker":
        workers = [p for p in every if "spawn_main" in command(p)]
        os.kill(min(workers), signal.SIGKILL)
        process.join(120)
    else:
        process.kill()
        process.join()
        assert process.exitcode == -signal.SIGKILL
    return every


def command(pid):
    try:
        with open(f"/proc/{pid}/cmdline", encoding="utf-8") as file:
            return file.read()
    except OSError:
        return ""


def assert_same(one, other):
    """Every number and every table, to the last bit."""
    assert one.plain() == other.plain()
    for first, second in zip(one.findings, other.findings, strict=True):
        for name, table in first.tables.items():
            frames = [t.drop(columns="wall_time", errors="ignore") for t in
                      (table, second.tables[name])]  # fmt: skip
            pd.testing.assert_frame_equal(*frames)
    if one.rows is not None:
        frames = [r.rows.table.drop(columns="wall_time") for r in (one, other)]
        pd.testing.assert_frame_equal(*frames)


def kill(number):
    """One in each `.ci/run`; the others once a week."""
    mark = pytest.mark.ci if number in EACH_RUN else pytest.mark.weekly
    return pytest.param(number, marks=mark)


@pytest.mark.parametrize("number", [kill(number) for number in range(len(KILLS))])
def test_a_kill_leaves_one_run_or_a_refusal(server, whole, tmp_path, number):
    """Whoever is killed, whenever: the processes end, and what is made is of one loop."""
    who, study, moment, edit = KILLS[number]
    (folder, found), out = whole, tmp_path / "out"
    path, straight = found[study]
    every = killed(server, path, out, who, moment)
    assert wait_until(lambda: not alive(every), 5), alive(every)
    loop = folder / "loop.py"
    before = loop.read_text(encoding="utf-8")
    try:
        if edit is not None:
            old, new = EDITS[edit]
            assert before.count(old) == 1
            loop.write_text(before.replace(old, new), encoding="utf-8")
        again = server.Process(target=work, args=(path, out, False))
        again.start()
        again.join(120)
    finally:
        loop.write_text(before, encoding="utf-8")
    if edit is None:
        assert again.exitcode == 0
        assert_same(load_result(out), straight)
    elif again.exitcode == 0:  # nothing had been computed: all of it is of the edited loop
        assert moment == "study.toml"
        with pytest.raises(RunFolderError, match="computed from another loop"):
            run(read_study(path), out, resume=True)
    else:
        assert again.exitcode == REFUSED
        words = {"equation": "the equations of 'lag'", "option": "lag.gain was 0.4, now 0.5"}[edit]
        assert words in (tmp_path / "refusal").read_text(encoding="utf-8")
        assert_finished(path, out, straight)


def assert_finished(path, out, straight):
    """With the loop as it was, the run goes on to the tables of one run."""
    assert not (out / "results.json").exists()
    assert_same(run(read_study(path), out, resume=True, threads=1), straight)


def test_there_are_thirty():
    """Of workers, of the parent, between analyses, with the loop edited in between.

    Those of each `.ci/run` are of every sort as well.
    """
    assert len(KILLS) >= 30
    sorts = {(who, study, edit) for who, study, _, edit in KILLS}
    assert {(who, study, edit) for who, study, _, edit in KILLS[1::3]} == sorts

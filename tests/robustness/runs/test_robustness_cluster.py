"""A sweep on a Dask cluster of processes, through nothing but `concurrent.futures`."""

import os
import signal
import subprocess
import sys

import pytest
from command_line import nlctl_here
from extras import needed
from studies_example import write
from sweep_examples import experiment, same

from nlctl.analysis.robustness import independent, prepare
from nlctl.analysis.robustness.runs.sweep import sweep
from nlctl.analysis.studies import load_result, read_study, run

pytestmark = pytest.mark.cluster


@pytest.fixture(scope="module", autouse=True)
def distributed():
    return needed("distributed", "cluster")


@pytest.fixture(scope="module")
def client(distributed):
    """Two worker processes; their nannies start new ones in place of killed ones."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.mark.weekly
def test_a_killed_worker_loses_nothing(client, tmp_path):
    """SIGKILL in the middle: its chunks are computed by others, and the table is the same."""
    made = prepare(experiment())
    design = independent(made.experiment.space, 120, 5)
    workers, killed = client.run(os.getpid), []

    def kill(progress):
        if not killed and progress.done >= 20:
            killed.append(next(iter(workers.values())))
            os.kill(killed[0], signal.SIGKILL)

    found = sweep(made, design, tmp_path, executor=client.get_executor(), chunk=5, progress=kill)
    assert killed
    assert os.getpid() not in workers.values()
    assert killed[0] not in client.run(os.getpid).values()
    assert found.complete
    assert found.notes == ()
    same(found.table, sweep(made, design).table)


def test_the_command_line_runs_a_study_on_the_cluster(client, tmp_path):
    """The table is that of threads, bit for bit; the user's loop in a file travels to workers."""
    path = write(tmp_path)
    there = nlctl_here(
        *("run", path, "--out", "there", "--executor", f"dask:{client.scheduler.address}"),
        cwd=tmp_path,
    )
    assert there.returncode == 0, there.stderr
    here = run(read_study(path), tmp_path / "here", threads=1)
    found = load_result(tmp_path / "there")
    same(found.rows.table, here.rows.table)
    assert found.plain() == here.plain()


@pytest.mark.parametrize(
    ("address", "words"),
    [
        # the port of discard, where nobody listens
        pytest.param("tcp://127.0.0.1:9", "Timed out", marks=pytest.mark.weekly),
        ("mainframe", "missing port"),
    ],
)
def test_a_wrong_address_is_one_sentence_and_leaves_nothing(address, words, tmp_path):
    """Exit code 2, with the address and what is wrong with it."""
    path = write(tmp_path)
    before = {*tmp_path.iterdir()}
    told = nlctl_here("run", path, "--out", "out", "--executor", f"dask:{address}", cwd=tmp_path)
    assert (told.returncode, told.stdout) == (2, "")
    assert told.stderr.startswith(f"nlctl: cannot reach a Dask scheduler at '{address}' ({words}")
    assert len(told.stderr.splitlines()) == 1
    assert {*tmp_path.iterdir()} - {tmp_path / "__pycache__"} == before


@pytest.mark.weekly
def test_without_the_extra_the_message_says_what_to_install(tmp_path):
    """As where distributed is not installed."""
    code = (
        "import sys; sys.modules['distributed'] = None;"
        "from nlctl.analysis.cli.main import main; main()"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, "run", str(write(tmp_path)), "--executor", "dask:tcp://x:1"],
        **{"cwd": tmp_path, "capture_output": True, "text": True, "timeout": 300, "check": False},
    )
    assert told.returncode == 2
    assert told.stderr == (
        'nlctl: --executor dask:ADDRESS needs the extra: pip install "nlctl[cluster]"\n'
    )

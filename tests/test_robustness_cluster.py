"""A sweep on a Dask cluster of processes, through nothing but `concurrent.futures`."""

import os
import signal

import pytest
from sweep_examples import experiment, same

from analysis.robustness import independent, prepare
from analysis.robustness.sweep import sweep

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def client():
    """Two worker processes; their nannies start new ones in place of killed ones."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


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

"""Worker processes end with the process that they work for."""

import os
import signal
import subprocess
import sys
import threading

import pytest
from processes import alive, descendants, wait_until

from nlctl.host.workers import process_pool

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")

PARENT = """\
import sys, time
from nlctl.host.workers import process_pool

def main():
    pool = process_pool(2)
    tasks = [pool.submit({task}) for _ in range(2)]
    time.sleep({busy})
    print(*(process.pid for process in pool._processes.values()), flush=True)
    time.sleep(600)

if __name__ == "__main__":
    main()
"""
TASKS = {
    "idle": ("abs, -1", 1.0),  # they wait for work
    "sleeping": ("time.sleep, 600", 1.5),
    "busy": ("exec, 'while True: pass'", 1.5),
}


@pytest.mark.slow
@pytest.mark.parametrize("doing", TASKS)
def test_workers_end_when_their_parent_is_killed(tmp_path, doing):
    """SIGKILL lets nobody say goodbye; whatever the workers are doing, they are gone in seconds."""
    task, busy = TASKS[doing]
    program = tmp_path / "parent.py"
    program.write_text(PARENT.format(task=task, busy=busy), encoding="utf-8")
    with subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, text=True) as parent:
        workers = {int(word) for word in parent.stdout.readline().split()}
        every = descendants(parent.pid)
        assert len(workers) == 2
        assert workers <= every
        parent.kill()
    assert wait_until(lambda: not alive(every), 5), alive(every)


def test_workers_outlive_the_thread_that_began_them():
    """Only the process counts: a pool may be made in a thread that ends before its work."""
    with process_pool(1) as pool:
        tasks = []
        beginner = threading.Thread(target=lambda: tasks.append(pool.submit(os.getpid)))
        beginner.start()
        beginner.join()
        assert tasks[0].result(60) == pool.submit(os.getpid).result(60) != os.getpid()


def test_a_worker_that_ends_is_told(tmp_path):
    """A killed worker breaks the pool, as without the watch."""
    with process_pool(1) as pool:
        worker = pool.submit(os.getpid).result(60)
        os.kill(worker, signal.SIGKILL)
        assert wait_until(lambda: not alive({worker}), 5)

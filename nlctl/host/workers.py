"""Worker processes that end with the process that they work for, however that ends."""

import multiprocessing
import os
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import wait

ORPHANED = 1  # exit code that nobody reads
_WATCHED = threading.Event()


def process_pool(jobs: int) -> ProcessPoolExecutor:
    """Return a pool of fresh processes.

    They end within a moment of this process, also where it is killed: a worker that waits for
    work would otherwise wait for ever, since it holds both ends of the queue that it waits at.
    """
    return ProcessPoolExecutor(
        jobs, mp_context=multiprocessing.get_context("spawn"), initializer=end_with_parent
    )


def end_with_parent() -> None:
    """Let this process end when its parent does; nothing happens where it has none.

    The operating system closes the parent's end of a pipe, whatever ends it.  A thread waits for
    that: the signal that Linux can send instead comes when the *thread* ends that began the
    process.
    """
    parent = multiprocessing.parent_process()
    if parent is None or _WATCHED.is_set():
        return
    _WATCHED.set()
    sentinel = parent.sentinel

    def watch() -> None:
        wait([sentinel])
        os._exit(ORPHANED)

    threading.Thread(target=watch, name="ends-with-parent", daemon=True).start()

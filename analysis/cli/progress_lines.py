"""How far a part of the work is, in lines on stderr: for a log, where a bar cannot be drawn."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .printing import error_line

FIRST_LINE, NEXT_LINE = 2.0, 10.0  # s: what is done sooner needs no line


@contextmanager
def progress_lines(what: str, progress: Callable[[], str]) -> Iterator[None]:
    """Print what is being done after two seconds, and then every ten, until the body is done."""
    begun, done = time.monotonic(), threading.Event()
    shown = threading.Event()

    def line(text: str) -> None:
        error_line(f"{what}: {text}, {time.monotonic() - begun:.0f} s")

    def watch() -> None:
        pause = FIRST_LINE
        while not done.wait(pause):
            shown.set()
            line(progress())
            pause = NEXT_LINE

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
    if shown.is_set():
        line("done")

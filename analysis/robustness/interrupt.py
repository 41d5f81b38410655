"""Ctrl-C that lets the work in hand be finished."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

__all__ = ["Interrupt", "gentle_interrupt"]


class Interrupt:
    """Whether Ctrl-C was pressed."""

    asked = False


@contextmanager
def gentle_interrupt() -> Iterator[Interrupt]:
    """Take down the first SIGINT; the second one raises KeyboardInterrupt.

    Only Python's main thread may listen to signals: in another one, and where SIGINT is ignored,
    nothing changes.  What listened before listens again afterwards.
    """
    interrupt = Interrupt()

    def pressed(number: int, frame: Any) -> None:
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

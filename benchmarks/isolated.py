"""Calls in a process of their own: for its peak memory, and to give up on what takes too long."""

from __future__ import annotations

import multiprocessing
import resource
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any


def call(function: Callable[..., Any], *arguments: Any, limit: float) -> Any:
    """Return ``function(*arguments)`` from a fresh process, or raise what it raises.

    Raises
    ------
    TimeoutError
        If there is no answer after `limit` seconds.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(there, function, arguments), daemon=True)
    process.start()
    there.close()
    try:
        if not here.poll(limit):
            raise TimeoutError(f"no answer in {limit:.0f} s")
        answer = here.recv()
    finally:
        process.terminate()
        process.join()
    if isinstance(answer, Exception):
        raise answer
    return answer


def _answer(connection: Connection, function: Callable[..., Any], arguments: tuple) -> None:
    try:
        connection.send(function(*arguments))
    except Exception as error:  # raised again where the call was made
        connection.send(error)


def peak_memory() -> float:
    """Return the largest memory that this process has had (bytes)."""
    status = Path("/proc/self/status")
    if status.exists():  # getrusage would count the parent's memory before exec
        lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
        return 1024.0 * int(lines["VmHWM"].split()[0])
    unit = 1.0 if sys.platform == "darwin" else 1024.0
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

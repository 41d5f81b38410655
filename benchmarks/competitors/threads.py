"""Members shared out to threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def in_threads(work: Callable[[slice], object], members: int, threads: int) -> None:
    """Call `work` with slices that cover range(members), eight per thread."""
    size = max(1, -(-members // (8 * threads)))
    parts = [slice(start, start + size) for start in range(0, members, size)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, parts))

"""How a run ends where memory is short: with a message, and neither a trace nor a wait."""

import errno
import mmap
import os

TOO_LITTLE = "this needs more memory than there is"
TO_BEGIN = 1300 * 10**6
"""Bytes of address space that libraries, compiling and running take on two cores.

Their memory is 0.4 GB; threads and allocators reserve the rest.
"""
TO_RUN = 200 * 2**20
"""Bytes of it that compiling and running take."""


def check_memory(needed: int = TO_RUN) -> None:
    """Refuse to begin where the process may not have what a run takes (``ulimit -v``)."""
    # Compilers of C++ end the process where they get no memory, and its threads may wait for others
    # that never began: afterwards nobody can say which.
    try:
        import resource
    except ImportError:  # not of this system
        return
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return
    os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")  # the other takes 1 GB in advance
    try:
        mmap.mmap(-1, needed).close()
    except (OSError, ValueError):
        raise MemoryError(
            f"a process may take {limit / 1e9:.2g} GB here, and less than {needed / 1e9:.2g} GB of "
            "them are left: raise the limit with ulimit -v"
        ) from None


def is_short_of_memory(error: BaseException | None) -> bool:
    """Whether an error, or what led to it, is that memory has run out: threads need some, too."""
    seen = 0
    while error is not None and seen < 100:
        words = str(error)
        is_thread = isinstance(error, RuntimeError) and "start new thread" in words
        is_library = isinstance(error, ImportError | SystemError) and (
            "allocate memory" in words or "map segment" in words
        )
        is_refused = isinstance(error, OSError) and error.errno == errno.ENOMEM
        if isinstance(error, MemoryError) or is_thread or is_library or is_refused:
            return True
        error, seen = error.__cause__ or error.__context__, seen + 1
    return False

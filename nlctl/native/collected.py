"""Less work for the garbage collector while thousands of records are made that all stay.

It looks through all objects of a process each time that a quarter more have come, those of SciPy
and pandas as well: a fifth of the time until a first run.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_RARELY = 50_000  # new objects between collections; Python's own number is 700


@contextmanager
def collected_rarely() -> Iterator[None]:
    """Have garbage collected less often, unless it is not at all, or is so already."""
    often, *older = gc.get_threshold()
    if not 0 < often < _RARELY:  # whoever has said so says when that ends
        yield
        return
    gc.set_threshold(_RARELY, *older)
    try:
        yield
    finally:
        gc.set_threshold(often, *older)

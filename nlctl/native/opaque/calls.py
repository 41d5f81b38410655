"""Functions of blocks that are called unchanged: what a program knows of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from ...equations import equation


@dataclass(frozen=True, kw_only=True)
class Source:
    """Source for numba, what it refers to by name, and the modules that teach numba."""

    source: str
    names: Mapping[str, Any]
    taught: tuple[Any, ...]

    def namespace(self, *, native: bool) -> dict[str, Any]:
        """Return everything that the source refers to, by name."""
        return {"np": np, "carray": carray, "equation": equation, **self.names}


@dataclass(frozen=True, kw_only=True)
class Call:
    """A function that is called for one member at a time."""

    name: str
    # whose function it is, and which one
    block: str
    kind: str
    lengths: tuple[int, ...]  # sizes of t, x, u, p and y
    reason: str  # why it could not be traced
    # it in Python: takes t, x, u and p in one array, returns y
    function: Callable[[np.ndarray], np.ndarray]
    # makes the `Source` of ``name(given, y)`` for numba; None where numba would understand it in
    # another way
    source: Callable[[], Source] | None

    @property
    def given(self) -> int:
        """Number of arguments."""
        return sum(self.lengths[:-1])

    @property
    def failed(self) -> int:
        """Row in which it says that it has failed, counted from its first."""
        return sum(self.lengths)

    @property
    def rows(self) -> int:
        """Rows that it takes: arguments, results, whether it has failed, and with what."""
        return self.failed + 1 + self.given

    def of_column(self, column: np.ndarray) -> None:
        """Read its arguments from its rows for one member, and write its results there."""
        column[self.given : self.failed] = self.function(column[: self.given].copy())

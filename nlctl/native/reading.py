"""What was read of a diagram: its schedule, its program, its equations."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..annotations import as_annotated
from ..diagrams import Apart, override
from ..errors import UsageError
from .cache import Cache
from .diagram.parameters import packed
from .diagram.program import Program
from .diagram.schedule import Schedule
from .equations.blocks import Equations, equations
from .lower import Lowered, lower
from .purity.captured import changed

_RESOLVING = threading.Lock()


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """A diagram as it was read.

    Attributes
    ----------
    schedule : Schedule
        What was read from the diagram.
    program : Program
        The arrays that machine code takes and fills.
    original : control.InputOutputSystem or None
        The diagram itself; none in another process.
    apart : Apart or None
        The copy of it that was read, in which runs write their parameters.
    cache : Cache
        What has been made of it, such as machine code.
    """

    schedule: Schedule
    program: Program
    original: Any = None
    apart: Apart | None = None
    cache: Cache = field(init=False, repr=False, default_factory=Cache)

    @property
    def system(self) -> Any:
        """The diagram that was compiled; runs write their parameters into a copy of it."""
        return self.schedule.system if self.original is None else self.original

    @cached_property
    def equations(self) -> Equations:
        """What the blocks' functions compute as expressions."""
        return equations(self.schedule, self.program.layout, meetings=self.program.meetings)

    @cached_property
    def lowered(self) -> Lowered:
        """The plan of a program for one member."""
        return lower(self.schedule, self.program, 1, self.equations)

    @as_annotated
    def parameter_vector(self, params: Mapping[str, Any] | None = None) -> np.ndarray:
        """Return the flat vector `p` that the program takes.

        Overrides are resolved by python-control itself.

        Parameters
        ----------
        params : mapping, optional
            Overrides by qualified name.

        Returns
        -------
        ndarray of shape (k,)
            The values of all k parameters, those of arrays one after the other.

        Raises
        ------
        UnknownNameError, ParameterError
            If a name or a value is refused.
        UsageError
            If a value that a function reads from around it has changed since.
        """
        with _RESOLVING:  # python-control keeps what it has resolved in the blocks
            if self.apart is not None and not self.apart.refreshed():
                raise UsageError(
                    f"'{self.system.name}' has other blocks than when it was compiled: compile "
                    "again"
                )
            other = changed(self.schedule.captured)
            if other is not None:
                raise UsageError(
                    f"'{other.title}' was {_short(other.then)} when '{self.system.name}' was "
                    f"compiled and is {_short(other.now)} now: compile again, or make it a "
                    "parameter"
                )
            override(self.schedule.system, params)
            return packed(self.schedule.holders, self.program.layout, self.program.fixed)


def _short(value: Any) -> str:
    """Return a value in one line."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."

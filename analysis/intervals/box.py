"""Boxes: the compact sets over which constants are proved, given or visited by trajectories."""

import dataclasses
from typing import Literal

import control as ct
import numpy as np

from nlctl.annotations import as_annotated, as_numbers
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.names import check_known
from nlctl.wording import counted

Cell = tuple[tuple[float, float], ...]


@as_annotated
@described_record
class Box:
    """A product of intervals with named sides.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import Box
    >>> box = Box(names=("x1", "v"), low=(-1.0, 0.0), high=(1.0, 2.0))
    >>> box.cell
    ((-1.0, 1.0), (0.0, 2.0))
    """

    names: tuple[str, ...]  # Coordinates, ``("x1", "x2", "v")``.
    low: tuple[float, ...]  # Ends of the sides; a side may be infinite.
    high: tuple[float, ...]
    # "sampled" for a box that trajectories have visited.
    provenance: Literal["given", "sampled"] = "given"
    how: str = "given"  # Where the box comes from.

    @classmethod
    def of(cls, **sides: tuple[float, float]) -> "Box":
        """Make a box of its sides, ``Box.of(x1=(-1, 1), v=(-12, 6))``.

        Parameters
        ----------
        **sides : (float, float)
            Lower and upper end of each side, by name.

        Returns
        -------
        Box
            In the order given.

        Raises
        ------
        ParameterError
            If a side is not a pair of numbers, or its lower end is above the upper one.
        """
        for name, ends in sides.items():
            numbers = as_numbers(ends) if isinstance(ends, tuple | list | np.ndarray) else None
            if numbers is None or numbers.shape != (2,):
                raise ParameterError(
                    f"Box needs (low, high) for side {name}, as in (-1, 1), got {str(ends)[:40]!r}"
                )
        low, high = (tuple(float(ends[i]) for ends in sides.values()) for i in (0, 1))
        return cls(names=tuple(sides), low=low, high=high)

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.low) == len(self.high):
            raise ParameterError(
                f"Box needs low and high for each of {counted(len(self.names), 'side')}, got "
                f"{len(self.low)} and {len(self.high)}"
            )
        for name, a, b in zip(self.names, self.low, self.high, strict=True):
            if not a <= b:  # refuses NaN, too
                raise ParameterError(f"Box needs low <= high on side {name}, got [{a:g}, {b:g}]")

    def __getitem__(self, name: str) -> tuple[float, float]:
        check_known("side", name, self.names, "of the box")
        i = self.names.index(name)
        return self.low[i], self.high[i]

    @as_annotated
    def only(self, *names: str) -> "Box":
        """Return the box of some of the sides, in the order given.

        Parameters
        ----------
        *names : str
            Sides to keep.

        Returns
        -------
        Box
            As many sides as names.
        """
        low, high = (tuple(self[name][i] for name in names) for i in (0, 1))
        return dataclasses.replace(self, names=names, low=low, high=high)

    @as_annotated
    def times(self, name: str, low: float, high: float) -> "Box":
        """Return the product of the box with one more side.

        Parameters
        ----------
        name : str
            Name of the new side.
        low, high : float
            Its ends.

        Returns
        -------
        Box
            The new side is the last.
        """
        names = (*self.names, name)
        return dataclasses.replace(self, names=names, low=(*self.low, low), high=(*self.high, high))

    @property
    def cell(self) -> Cell:
        """The sides as pairs."""
        return tuple(zip(self.low, self.high, strict=True))

    def __str__(self) -> str:
        sides = [f"{n} in [{a:g}, {b:g}]" for n, (a, b) in zip(self.names, self.cell, strict=True)]
        return ", ".join(sides) + ("" if self.how == "given" else f" ({self.how})")


@as_annotated
def visited_box(*responses: ct.TimeResponseData, margin: float = 0.1) -> Box:
    """Return the box that responses have visited, each side widened at both ends.

    Parameters
    ----------
    *responses : control.TimeResponseData
        With outputs x1, ..., xn, and u and v where they are recorded.
    margin : float, optional
        Widening at each end, as a share of the side; >= 0.

    Returns
    -------
    Box
        Provenance "sampled": nothing says that other trajectories stay in it.

    Raises
    ------
    ParameterError
        If there is no response, no state among its outputs, or a value that is not finite.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import visited_box
    >>> response = nlctl.input_output_response(nlctl.paper.example_1(), np.linspace(0, 1, 101))
    >>> box = visited_box(response, margin=0.0)
    >>> print(box.provenance, float(box.low[box.names.index("x1")]))  # x1 starts at 0.5 and rises
    sampled 0.5
    """
    if not responses or not margin >= 0:
        raise ParameterError(
            f"visited_box needs a response and margin >= 0, got {len(responses)} and {margin}"
        )
    for response in responses:
        if not hasattr(response, "output_labels"):
            raise ParameterError(
                f"visited_box needs responses with named outputs, got {type(response).__name__}"
            )
    labels = [list(r.output_labels or ()) for r in responses]
    names = [n for n in labels[0] if n in ("u", "v") or _is_state(n)]
    if not any(map(_is_state, names)):
        raise ParameterError("visited_box needs the outputs x1, ..., xn in the response")
    sides = {}
    for name in names:
        rows = zip(responses, labels, strict=True)
        values = np.concatenate([np.ravel(r.y[outputs.index(name)]) for r, outputs in rows])
        low, high = np.min(values), np.max(values)
        room = margin * (high - low)
        sides[name] = (low - room, high + room)
        if not np.all(np.isfinite(sides[name])):
            raise ParameterError(f"visited_box needs finite values, got {name} in {sides[name]}")
    start, end = (f([f(r.time) for r in responses]) for f in (np.min, np.max))
    who = counted(len(responses), "response")
    how = f"visited by {who} in [{start:g}, {end:g}] s, and {100 * margin:.0f} % more"
    return dataclasses.replace(Box.of(**sides), provenance="sampled", how=how)


def face_of_box(box: Box, i: int, end: float) -> Box:
    """Return the face of a box on which side i has one of its ends."""
    low, high = (tuple(end if j == i else a for j, a in enumerate(s)) for s in (box.low, box.high))
    return dataclasses.replace(box, low=low, high=high)


def _is_state(name: str) -> bool:
    return name[:1] == "x" and name[1:].isdigit()

"""Rows at chosen places of the boxes: a grid, the corners, one quantity at a time."""

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, of_type
from nlctl.attributes import with_parameters_of
from nlctl.errors import ParameterError
from nlctl.names import unknown

from .design import Design, affordable, checked_entropy, listed
from .space import Space, from_unit_cube, nominal


@as_annotated
def grid(space: Space, levels: int | Mapping[str, int], entropy: int | None = None) -> Design:
    """Cross evenly spaced values of every box, ends included, and all options of every choice.

    Parameters
    ----------
    space : Space
        Quantities with their boxes, and choices.
    levels : int or mapping
        Number of values per quantity, at least 1; one value is the middle of the box.  A mapping
        names every quantity.
    entropy : int, optional
        Of the rows' seeds; drawn if left out.

    Returns
    -------
    Design
        All points of the grid, with every combination of options.

    Raises
    ------
    ParameterError
        If a number of levels is missing or below 1.
    UnknownNameError
        If a level is given for an unknown quantity.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, grid, rows
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> rows(grid(space, 3), range(3))["a"].tolist()
    [0.0, 0.5, 1.0]
    """
    names = [q.name for q in of_type("a grid", "space", space, Space).quantities]
    given = levels if isinstance(levels, Mapping) else dict.fromkeys(names, levels)
    for name in given:
        if name not in names:
            raise unknown("quantity", str(name), names)
    counts = [
        integer("a grid", f"levels of '{name}'", given.get(name), at_least=1) for name in names
    ]
    affordable("a grid", math.prod([*counts, *_options(space)]), len(space.names))
    axes = [np.linspace(0, 1, n) if n > 1 else np.array([0.5]) for n in counts]
    return listed(space, "grid", _crossed(space, axes), checked_entropy(entropy))


@as_annotated
@with_parameters_of(grid)
def corners(space: Space, entropy: int | None = None) -> Design:
    """Cross both ends of every box, and all options of every choice: 2^d rows for d quantities.

    Returns
    -------
    Design
        All corners, with every combination of options.

    Raises
    ------
    ParameterError
        If an option of a choice has weight 0.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, corners, rows
    >>> box = (Uncertain(name="a", bounds=(0.0, 1.0)), Uncertain(name="b", bounds=(2.0, 3.0)))
    >>> rows(corners(Space(quantities=box)), range(4)).values.tolist()
    [[0.0, 2.0], [0.0, 3.0], [1.0, 2.0], [1.0, 3.0]]
    """
    rows = math.prod([2] * len(space.quantities) + _options(space))
    affordable("a design of corners", rows, len(space.names))
    axes = [np.array([0.0, 1.0])] * len(space.quantities)
    return listed(space, "corners", _crossed(space, axes), checked_entropy(entropy))


def _options(space: Space) -> list[int]:
    return [len(choice.options) for choice in space.choices]


def _crossed(space: Space, axes: Sequence[np.ndarray]) -> pd.DataFrame:
    """Every combination of places in the boxes, and of options."""
    options = [np.cumsum(c.weights) - np.array(c.weights) / 2 for c in space.choices]
    impossible = [c.name for c in space.choices if min(c.weights) == 0]
    if impossible:
        raise ParameterError(f"options with weight 0 in {impossible}: leave them out of the space")
    return from_unit_cube(space, np.array(list(itertools.product(*axes, *options))))


@as_annotated
def one_at_a_time(space: Space, levels: int = 2, entropy: int | None = None) -> Design:
    """Vary one quantity over its box, or one choice over its options, the others nominal.

    Row 0 is all nominal; ``details["varied"]`` names what varies in each row.

    Parameters
    ----------
    space : Space
        With nominal values, see `binding.resolved`.
    levels : int, optional
        Number of evenly spaced values per quantity, ends included.
    entropy : int, optional
        Of the rows' seeds, see `row_seed`; drawn afresh if it is left out.

    Returns
    -------
    Design
        The nominal row, and one row for each variation.

    Raises
    ------
    ParameterError
        If `levels` is below 2.
    SpaceError
        If a quantity has no nominal value.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, one_at_a_time, rows
    >>> a = Uncertain(name="a", bounds=(0.0, 1.0), nominal=0.5)
    >>> b = Uncertain(name="b", bounds=(2.0, 3.0), nominal=2.5)
    >>> rows(one_at_a_time(Space(quantities=(a, b))), range(5)).values.tolist()
    [[0.5, 2.5], [0.0, 2.5], [1.0, 2.5], [0.5, 2.0], [0.5, 3.0]]
    """
    levels = integer("one at a time", "levels", levels, at_least=2)
    affordable("a design", levels * len(space.names), len(space.names))
    middle = nominal(space)
    rows, varied = [middle], [""]
    unit = np.tile(np.linspace(0, 1, levels)[:, None], len(space.names))
    values = from_unit_cube(space, unit)
    for quantity in space.quantities:
        rows += [{**middle, quantity.name: value} for value in values[quantity.name]]
        varied += [quantity.name] * levels
    for choice in space.choices:
        others = [label for label in choice.options if label != choice.nominal]
        rows += [{**middle, choice.name: label} for label in others]
        varied += [choice.name] * len(others)
    table = pd.DataFrame(rows, columns=space.names)
    return listed(
        space, "one at a time", table, checked_entropy(entropy), {"varied": tuple(varied)}
    )

"""Which points of a space are run: independent draws, or rows that were chosen otherwise."""

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.stats import qmc

from nlctl.annotations import as_annotated
from nlctl.arguments import flag, integer, of_type
from nlctl.attributes import described_record, with_parameters_of
from nlctl.errors import ParameterError
from nlctl.names import unknown

from .space import Space, checked_rows, from_quantiles

_MOST_ROWS = 10**9  # rows of a design at most: what is drawn row by row
MOST_HELD = 10**8  # numbers that a design holds in memory at most, 800 MB: rows times columns

_Kind = Literal[
    "i.i.d.", "Sobol'", "Latin hypercube", "grid", "corners", "one at a time", "Saltelli",
    "Morris", "user's table", "adaptive",
]  # fmt: skip


@described_record(eq=False, made_by="independent")
class Design:
    """Rows to run."""

    space: Space
    kind: _Kind  # How the rows were chosen.
    size: int  # Number of rows.
    # Whether the rows are independent draws of the space's laws: what a statement about
    # probabilities needs.
    is_iid: bool
    entropy: int  # What all random numbers follow from.
    # The rows; None for i.i.d. rows, which are drawn when they are asked for.
    points: pd.DataFrame | None = None
    # Numbers that analyses of this kind of design need.
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def table(self) -> pd.DataFrame:
        """All rows, see `rows`."""
        return rows(self, range(self.size))


@as_annotated
def row_seed(design: Design, row: int) -> np.random.SeedSequence:
    """Return the seed that everything random in a row follows from.

    It depends on the design's entropy and the row's number alone: any row can be run again without
    the others, and a longer design begins with the same rows.

    Parameters
    ----------
    design : Design
        Rows and their seeds.
    row : int
        Number of the row.

    Returns
    -------
    numpy.random.SeedSequence
        For `numpy.random.default_rng`.

    Raises
    ------
    ParameterError
        If the row is not an integer, or below 0.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, independent, row_seed
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> once, again = (row_seed(independent(space, size, entropy=1), 2) for size in (3, 9))
    >>> np.random.default_rng(once).random() == np.random.default_rng(again).random()
    True
    """
    row = integer("a design", "row", row, at_least=0)
    return np.random.SeedSequence(design.entropy, spawn_key=(row,))


@as_annotated
@with_parameters_of(row_seed)
def seed_number(design: Design, row: int) -> int:
    """Return the row's seed as one number of 64 bits, for the table of results.

    Returns
    -------
    int
        Below 2^64.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, independent, seed_number
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> design = independent(space, 3, entropy=1)
    >>> len({seed_number(design, row) for row in range(3)})
    3
    """
    return int(row_seed(design, row).generate_state(1, np.uint64)[0])


@as_annotated
def rows(design: Design, numbers: range) -> pd.DataFrame:
    """Return some rows, indexed by their numbers; one column for each name of the space.

    Parameters
    ----------
    design : Design
        Rows and their seeds.
    numbers : range
        Of the rows.

    Returns
    -------
    pandas.DataFrame
        Values in the quantities' units, and labels of choices.

    Raises
    ------
    ParameterError
        If a number is not in the design.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, grid, rows
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> rows(grid(space, 5), range(2, 4))["a"].to_dict()
    {2: 0.5, 3: 0.75}
    """
    of_type("a design", "numbers", numbers, range)
    if len(numbers) and not (min(numbers) >= 0 and max(numbers) < design.size):
        raise ParameterError(
            f"the design has rows 0 to {design.size - 1}, asked for {min(numbers)} to "
            f"{max(numbers)}"
        )
    index = pd.RangeIndex(numbers.start, numbers.stop, numbers.step, name="row")
    if design.points is not None:
        return design.points.iloc[list(numbers)].set_axis(index)
    unit = np.empty((len(numbers), len(design.space.names)))
    for i, number in enumerate(numbers):
        unit[i] = np.random.default_rng(row_seed(design, number)).random(unit.shape[1])
    return from_quantiles(design.space, unit).set_axis(index)


def with_row_numbers(table: pd.DataFrame, first: int) -> pd.DataFrame:
    """Return rows with the numbers `first`, `first` + 1, ... as their index."""
    return table.set_axis(pd.RangeIndex(first, first + len(table), name="row"))


def checked_entropy(entropy: int | None) -> int:
    """Return the entropy, or fresh one."""
    if entropy is None:
        return int(np.random.SeedSequence().entropy)  # type: ignore[arg-type]
    return integer("a design", "entropy", entropy, at_least=0)


@as_annotated
def independent(space: Space, size: int, entropy: int | None = None) -> Design:
    """Draw rows from the laws, independent of each other: for statements about probabilities.

    Parameters
    ----------
    space : Space
        Quantities with their laws, and choices.
    size : int
        Number of rows, see `guarantee.runs_needed`.
    entropy : int, optional
        Fresh by default; the design keeps it.

    Returns
    -------
    Design
        Rows that follow from `entropy` and their numbers alone.

    Raises
    ------
    ParameterError
        If it is not a space, or `size` or `entropy` is out of range.

    Examples
    --------
    Rows follow from the entropy and their numbers: a longer design begins with the same rows.

    >>> from nlctl.analysis.robustness import Space, Uncertain, independent, rows
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> short, long = independent(space, 3, entropy=1), independent(space, 5, entropy=1)
    >>> bool((rows(short, range(3)) == rows(long, range(3))).all(axis=None)), short.is_iid
    (True, True)
    """
    of_type("a design", "space", space, Space)
    size = integer("a design", "size", size, at_least=1)
    if size > _MOST_ROWS:
        raise ParameterError(f"a design needs size <= {_MOST_ROWS:.0e}, got {size}")
    return Design(
        space=space, kind="i.i.d.", size=size, is_iid=True, entropy=checked_entropy(entropy)
    )  # fmt: skip


def affordable(what: str, rows: int, columns: int) -> int:
    """Return the number of rows of a design that is held in memory."""
    if rows * columns > MOST_HELD:
        raise ParameterError(
            f"{what} of {rows} rows with {columns} columns needs more memory than a design may: "
            f"at most {MOST_HELD // columns} rows; independent draws are made row by row"
        )
    return rows


@as_annotated
def from_table(
    space: Space,
    table: pd.DataFrame,
    *,
    drawn_independently: bool = False,
    entropy: int | None = None,
) -> Design:
    """Run the user's own rows.

    Parameters
    ----------
    space : Space
        Quantities and choices, whose names are the columns.
    table : pandas.DataFrame
        One column for each name of the space; others are refused.
    drawn_independently : bool, optional
        The user's word that rows are independent draws of the space's laws.  Statements about
        probabilities then quote it.
    entropy : int, optional
        Of the rows' seeds; drawn if left out.

    Returns
    -------
    Design
        The rows of the table, numbered from 0.

    Raises
    ------
    UnknownNameError
        If a column is not a name of the space, or a choice has no such option.
    ParameterError
        If a column is missing, there is no row, or a number is not finite.

    Examples
    --------
    >>> import pandas as pd
    >>> from nlctl.analysis.robustness import Space, Uncertain, from_table
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> design = from_table(space, pd.DataFrame({"a": [0.1, 0.9]}))
    >>> design.size, design.is_iid
    (2, False)
    """
    of_type("a design", "table", table, pd.DataFrame, "pandas.DataFrame(...)")
    independently = flag("a design", "drawn_independently", drawn_independently)
    if not table.columns.is_unique:
        twice = table.columns[table.columns.duplicated()][0]
        raise ParameterError(f"a table needs each column once, '{twice}' comes twice")
    for column in table.columns:
        if column not in space.names:
            raise unknown("quantity", str(column), space.names, "in the table")
    missing = [name for name in space.names if name not in table.columns]
    if missing or not len(table):
        raise ParameterError(f"a table needs rows and all columns, it lacks {missing or 'rows'}")
    labels = {choice.name: table[choice.name].astype(str).to_numpy() for choice in space.choices}
    numbers = checked_rows(space, table.assign(**labels).reset_index(drop=True))
    points = pd.DataFrame(numbers | labels)
    design = listed(space, "user's table", points, checked_entropy(entropy))
    return replace(design, is_iid=independently)


def listed(
    space: Space,
    kind: _Kind,
    points: pd.DataFrame,
    entropy: int,
    details: Mapping[str, Any] | None = None,
) -> Design:
    """Return a design of these rows; they are not independent draws."""
    return Design(
        space=space,
        kind=kind,
        size=len(points),
        is_iid=False,
        entropy=entropy,
        points=points,
        details=details or {},
    )


@as_annotated
@with_parameters_of(independent)
def sobol(space: Space, size: int, entropy: int | None = None) -> Design:
    """Fill the space evenly with a scrambled Sobol' sequence: for means, maps and sensitivity.

    Arguments as in `independent`.

    Parameters
    ----------
    size : int
        Number of rows, a power of 2.

    Returns
    -------
    Design
        Rows that fill the space; they are not independent draws.

    Raises
    ------
    ParameterError
        If `size` is not a power of 2, which the sequence's balance needs.

    Examples
    --------
    Of 2^k rows each half of a box holds half:

    >>> from nlctl.analysis.robustness import Space, Uncertain, rows, sobol
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> drawn = rows(sobol(space, 8, entropy=1), range(8))
    >>> int((drawn["a"] < 0.5).sum())
    4
    """
    entropy = checked_entropy(entropy)
    unit = sobol_points(len(space.names), size, entropy)
    return listed(space, "Sobol'", from_quantiles(space, unit), entropy)


def sobol_points(dimension: int, size: int, entropy: int) -> np.ndarray:
    """Return `size` scrambled Sobol' points of the unit cube, see `sobol`."""
    size = integer("a Sobol' design", "size", size, at_least=1)
    if size & (size - 1):
        raise ParameterError(
            f"a Sobol' design needs a power of 2 as its size, got {size}: take "
            f"{2 ** (size.bit_length() - 1)} or {2 ** size.bit_length()}"
        )
    affordable("a Sobol' design", size, dimension)
    return qmc.Sobol(dimension, rng=entropy).random_base2(size.bit_length() - 1)


@as_annotated
@with_parameters_of(independent)
def latin_hypercube(space: Space, size: int, entropy: int | None = None) -> Design:
    """Fill the space so that each quantity has one value in each of `size` equally likely parts.

    Arguments as in `independent`.

    Parameters
    ----------
    size : int
        Number of rows.

    Returns
    -------
    Design
        Rows that fill the space; they are not independent draws.

    Raises
    ------
    ParameterError
        If `size` or `entropy` is out of range, or it would hold more than `MOST_HELD` numbers.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, latin_hypercube, rows
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 4.0)),))
    >>> drawn = rows(latin_hypercube(space, 4, entropy=1), range(4))
    >>> sorted(int(a) for a in drawn["a"])  # one in each quarter
    [0, 1, 2, 3]
    """
    size = integer("a Latin hypercube", "size", size, at_least=1)
    affordable("a Latin hypercube", size, len(space.names))
    entropy = checked_entropy(entropy)
    unit = qmc.LatinHypercube(len(space.names), rng=entropy).random(size)
    return listed(space, "Latin hypercube", from_quantiles(space, unit), entropy)

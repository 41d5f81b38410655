"""Everything that is uncertain in a study, and its values at points of the unit cube."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.arguments import number, of_type, tuple_of
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.names import unknown

from .quantity import Choice, SpaceError, Uncertain


@as_annotated
@described_record
class Space:
    """Everything that is uncertain in a study, independent of each other.

    Raises
    ------
    SpaceError
        If nothing is uncertain, two names are equal, the scale is negative, or a scale other than
        1 meets a quantity without nominal value.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, nominal
    >>> slope = Uncertain(name="actuator.slope_r", bounds=(0.8, 1.2), nominal=1.0)
    >>> point = Uncertain(name="actuator.b_r", bounds=(0.4, 0.7), nominal=0.5)
    >>> nominal(Space(quantities=(slope, point)))
    {'actuator.slope_r': 1.0, 'actuator.b_r': 0.5}
    """

    quantities: tuple[Uncertain, ...] = ()
    choices: tuple[Choice, ...] = ()
    # Every number is moved towards or away from its nominal value by this factor, nominal + scale
    # (value - nominal); choices are not scaled.
    scale: float = 1.0

    def __post_init__(self) -> None:
        tuple_of("a space", "quantities", self.quantities, Uncertain)
        tuple_of("a space", "choices", self.choices, Choice)
        if not self.names:
            raise SpaceError("a space needs at least one quantity or choice, got none")
        twice = {name for name in self.names if self.names.count(name) > 1}
        if twice:
            raise SpaceError(f"a space needs each name once, got twice: {sorted(twice)}")
        if not number("a space", "scale", self.scale) >= 0:
            raise SpaceError(f"a space needs a finite scale >= 0, got {self.scale}")
        for quantity in self.quantities if self.scale != 1 else ():
            _nominal_of(quantity)

    @property
    def names(self) -> list[str]:
        """Names of the quantities, then of the choices: the columns of every table."""
        return [part.name for part in (*self.quantities, *self.choices)]

    @property
    def laws(self) -> dict[str, str]:
        """The law of every quantity and choice, as text."""
        about = "" if self.scale == 1 else f", scaled by {self.scale:g} about the nominal value"
        laws = {q.name: q.law_text + about for q in self.quantities}
        for choice in self.choices:
            weights = zip(choice.options, choice.weights, strict=True)
            laws[choice.name] = "one of " + ", ".join(f"{k} ({w:.3g})" for k, w in weights)
        return laws


def _nominal_of(quantity: Uncertain) -> float:
    if quantity.nominal is None:
        raise SpaceError(
            f"'{quantity.name}' has no nominal value: give one, or take the diagram's with "
            "resolved(space, diagram)"
        )
    return quantity.nominal


@as_annotated
def nominal(space: Space) -> dict[str, Any]:
    """Return ``{name: nominal value or label}``.

    Parameters
    ----------
    space : Space
        Quantities with their laws, and choices.

    Returns
    -------
    dict
        A number in the quantity's unit, or the label of a choice, by name.

    Raises
    ------
    SpaceError
        If a quantity has none.

    Examples
    --------
    See `Space`.
    """
    numbers = {q.name: _nominal_of(q) for q in space.quantities}
    return numbers | {c.name: c.nominal for c in space.choices}


@as_annotated
def scaled(space: Space, factor: float) -> Space:
    """Return the space with all deviations from the nominal values multiplied by `factor`.

    Parameters
    ----------
    space : Space
        Quantities with their laws, and choices.
    factor : float
        Of the deviations.

    Returns
    -------
    Space
        Wider for factors above 1; the given one stays as it is.

    Raises
    ------
    ParameterError
        If it is not a space, or the factor is not a finite number.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, corners, rows, scaled
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0), nominal=0.5),))
    >>> rows(corners(scaled(space, 2.0)), range(2))["a"].tolist()
    [-0.5, 1.5]
    """
    of_type("a scaled space", "space", space, Space)
    return replace(space, scale=space.scale * number("a scaled space", "factor", factor))


def moved(middle: float, value: Any, factor: float) -> Any:
    """Return a number or array with its distance to the nominal value, `middle`, multiplied."""
    return middle + factor * (value - middle)


def towards_nominal(
    space: Space, row: Mapping[str, Any], factor: float, names: Collection[str] | None = None
) -> dict[str, Any]:
    """Return the row with the deviations of numbers from nominal multiplied by `factor`."""
    middle = nominal(space)

    def nearer(quantity: Uncertain) -> float:
        value = moved(middle[quantity.name], row[quantity.name], factor)
        return float(np.rint(value)) if quantity.is_integer else float(value)

    return dict(row) | {
        q.name: nearer(q) for q in space.quantities if names is None or q.name in names
    }


def from_quantiles(space: Space, unit: np.ndarray) -> pd.DataFrame:
    """Turn points of the unit cube into values, each coordinate by its law's quantile function."""
    # Uniform points become draws of the laws.
    # Shapes: `unit` (n, len(space.names).
    inner = np.clip(_checked(space, unit), 2.0**-54, 1 - 2.0**-53)
    return _table(space, inner, lambda quantity, u: quantity.law.ppf(u))


def from_unit_cube(space: Space, unit: np.ndarray) -> pd.DataFrame:
    """Turn points of the unit cube into values, linearly between the ends of each box."""
    # Arguments and errors as in `sampled`; integers are rounded.

    def between(quantity: Uncertain, u: np.ndarray) -> np.ndarray:
        low, high = quantity.box
        return low + u * (high - low)

    return _table(space, _checked(space, unit), between)


def ends(space: Space) -> pd.DataFrame:
    """Return the ends of the box of every quantity: a table of two rows, low and high."""
    corners = from_unit_cube(space, np.repeat([[0.0], [1.0]], len(space.names), axis=1))
    return corners.filter([quantity.name for quantity in space.quantities])


def _checked(space: Space, unit: np.ndarray) -> np.ndarray:
    unit = np.asarray(unit, dtype=float)
    if unit.ndim != 2 or unit.shape[1] != len(space.names):
        raise ParameterError(
            f"points of this space need shape (n, {len(space.names)}), got {unit.shape}"
        )
    if not np.all((unit >= 0) & (unit <= 1)):  # false for NaN
        raise ParameterError("points of the unit cube need coordinates in [0, 1]")
    return unit


def _table(space: Space, unit: np.ndarray, value: Any) -> pd.DataFrame:
    columns: dict[str, np.ndarray] = {}
    for quantity, u in zip(space.quantities, unit.T, strict=False):
        values = value(quantity, u)
        if space.scale != 1:
            values = moved(_nominal_of(quantity), values, space.scale)
        columns[quantity.name] = np.rint(values) if quantity.is_integer else values
    for choice, u in zip(space.choices, unit.T[len(space.quantities) :], strict=True):
        edges = np.cumsum(choice.weights)[:-1]
        columns[choice.name] = np.array(list(choice.options))[np.searchsorted(edges, u, "right")]
    return pd.DataFrame(columns)


@as_annotated
def arguments(space: Space, table: pd.DataFrame) -> dict[str, dict[str, np.ndarray]]:
    """Return the ``params`` and ``initial_state`` of `nlctl.ensemble_response` for these rows.

    Choices are left out: rows with the same labels share a diagram, see `binding.diagrams`.

    Parameters
    ----------
    space : Space
        Quantities with their laws, and choices.
    table : pandas.DataFrame
        Rows of a design, a column for each name.

    Returns
    -------
    dict of str to dict
        Arrays of shape (rows,) by qualified name.

    Raises
    ------
    UnknownNameError, ParameterError
        As in `checked_rows`.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, arguments, grid, rows
    >>> start = Uncertain(name="plant.x1(0)", bounds=(0.0, 1.0))
    >>> space = Space(quantities=(Uncertain(name="law.k", bounds=(1.0, 2.0)), start))
    >>> given = arguments(space, rows(grid(space, {"law.k": 2, "plant.x1(0)": 1}), range(2)))
    >>> given["params"]["law.k"].tolist(), given["initial_state"]["plant.x1"].tolist()
    ([1.0, 2.0], [0.5, 0.5])
    """
    params, states = {}, {}
    checked = checked_rows(space, table)
    for quantity in space.quantities:
        values = checked[quantity.name]
        if quantity.is_initial:
            states[quantity.name.removesuffix("(0)")] = values
        else:
            params[quantity.name] = values.astype(int) if quantity.is_integer else values
    return {"params": params, "initial_state": states}


def arguments_of_row(space: Space, row: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the ``params`` and ``initial_state`` of one run for a row, see `arguments`."""
    given = arguments(space, pd.DataFrame([row], columns=space.names))
    return {part: {name: v[0] for name, v in values.items()} for part, values in given.items()}


def checked_rows(space: Space, table: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return the numbers of a table of rows by quantity, all finite."""
    of_type("a run of rows", "table", table, pd.DataFrame, "design.table")
    if not table.index.is_unique:
        twice = table.index[table.index.duplicated()][0]
        raise ParameterError(f"a run of rows needs each row once, row {twice} comes twice")
    for name in space.names:
        if name not in table.columns:
            raise unknown("column", name, map(str, table.columns), "of the table of rows")
    for choice in space.choices:
        for label in table[choice.name].unique():
            if label not in choice.options:
                raise unknown("option", str(label), choice.options, f"of '{choice.name}'")
    columns = {}
    for quantity in space.quantities:
        values = np.array(pd.to_numeric(table[quantity.name], errors="coerce"), dtype=float)
        for place in np.nonzero(~np.isfinite(values))[0][:1]:
            raise ParameterError(
                f"'{quantity.name}' needs finite numbers, row {table.index[place]} has "
                f"{table[quantity.name].iloc[place]!r}"
            )
        columns[quantity.name] = values
    return columns


def checked_row(space: Space, row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row in the order of the space."""
    of_type("a row", "row", row, Mapping, "{name: value}")
    for name in row:
        if name not in space.names:
            raise unknown("quantity", str(name), space.names, "of the row")
    for name in space.names:
        if name not in row:
            raise unknown("quantity", name, map(str, row), "of the row")
    numbers = {q.name: number("a row", f"'{q.name}'", row[q.name]) for q in space.quantities}
    for choice in space.choices:
        if row[choice.name] not in choice.options:
            raise unknown("option", str(row[choice.name]), choice.options, f"of '{choice.name}'")
    return numbers | {c.name: row[c.name] for c in space.choices}


def combinations(space: Space) -> list[dict[str, str]]:
    """Return every combination of the choices' labels; one empty one without choices."""
    labels = itertools.product(*(choice.options for choice in space.choices))
    return [dict(zip([c.name for c in space.choices], row, strict=True)) for row in labels]

"""Everything that is uncertain in a study, and its values at points of the unit cube."""

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from nlctl.annotations import as_annotated
from nlctl.arguments import number, of_type, text, tuple_of, vector
from nlctl.attributes import described_record
from nlctl.errors import ParameterError, UsageError
from nlctl.names import unknown
from nlctl.params import as_numbers
from nlctl.wording import counted

# ends of the box of a law without finite support: it holds 99.8 % of the law
QUANTILES = (0.001, 0.999)


class SpaceError(UsageError):
    """A space that contradicts itself or the diagram; the message names the quantity.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Uncertain
    >>> Uncertain(name="plant.m")
    Traceback (most recent call last):
        ...
    nlctl.analysis...SpaceError: 'plant.m' needs a law (scipy.stats) or bounds, got neither
    """


@as_annotated
@described_record
class Uncertain:
    """A number that is not known exactly.

    Raises
    ------
    SpaceError
        If there is neither law nor bounds, the law is not frozen, the bounds are no interval, or
        the nominal value lies outside of them.

    Examples
    --------
    A law of scipy.stats, and the box that it is searched in:

    >>> from scipy import stats
    >>> from nlctl.analysis.robustness import Uncertain
    >>> mass = Uncertain(name="plant.m", law=stats.norm(2.0, 0.1), bounds=(1.7, 2.3))
    >>> print(mass.law.mean(), mass.box)
    2.0 (1.7, 2.3)
    """

    # Qualified parameter, ``"actuator.b_r"`` or ``"controller.lambdas[0]"``, or initial state,
    # ``"plant.x1(0)"``.
    name: str
    law: Any = None  # Has ``ppf`` and ``support``. By default uniform on `bounds`.
    bounds: tuple[float, float] | None = None  # Ends of the `box`.
    # What the box is scaled about, and what the other quantities hold while one varies. By default
    # the diagram's own value, see `binding.resolved`.
    nominal: float | None = None
    unit: str = ""  # By default the diagram's.

    def __post_init__(self) -> None:
        text("an uncertain quantity", "name", self.name)
        if self.law is None:
            if self.bounds is None:
                raise SpaceError(f"'{self.name}' needs a law (scipy.stats) or bounds, got neither")
            low, high = _interval(self.name, self.bounds)
            object.__setattr__(self, "law", stats.uniform(low, high - low))
        if not (hasattr(self.law, "ppf") and hasattr(self.law, "dist")):
            raise SpaceError(
                f"'{self.name}' needs a frozen law such as scipy.stats.norm(0.5, 0.1), "
                f"got {self.law!r}"
            )
        low, high = self.box
        if self.nominal is not None:
            number(f"'{self.name}'", "nominal", self.nominal)
        if self.nominal is not None and not low <= self.nominal <= high:
            raise SpaceError(
                f"'{self.name}' needs a nominal value in its box [{low:g}, {high:g}], "
                f"got {self.nominal:g}"
            )

    @property
    def box(self) -> tuple[float, float]:
        """What corners, grids and screening use: the bounds, where given.

        Otherwise the support of the law, or its `QUANTILES` where that is infinite.
        """
        support = self.law.support()
        ends = np.where(np.isfinite(support), support, self.law.ppf(QUANTILES))
        return _interval(self.name, ends if self.bounds is None else self.bounds)

    @property
    def is_integer(self) -> bool:
        """Whether the law is one of integers."""
        return isinstance(self.law.dist, stats.rv_discrete)

    @property
    def is_initial(self) -> bool:
        """Whether this is an initial state."""
        return self.name.endswith("(0)")

    @property
    def law_text(self) -> str:
        """The law as text, ``uniform on [0.3, 0.7]`` or ``norm(0, 0.1)`` in SciPy's parameters."""
        if self.law.dist.name == "uniform":
            low, high = self.law.support()
            return f"uniform on [{low:g}, {high:g}]"
        given = [f"{v:g}" for v in self.law.args]
        given += [f"{k}={v:g}" for k, v in self.law.kwds.items()]
        return f"{self.law.dist.name}({', '.join(given)})"


def _interval(name: str, bounds: Sequence[float] | np.ndarray) -> tuple[float, float]:
    ends = as_numbers(bounds)
    if ends is None or ends.shape != (2,) or not np.all(np.isfinite(ends)) or not ends[0] < ends[1]:
        raise SpaceError(f"'{name}' needs finite bounds (low, high) with low < high, got {bounds}")
    return float(ends[0]), float(ends[1])


@as_annotated
@described_record
class Choice:
    """One of several blocks: another controller, actuator or reference.

    Raises
    ------
    SpaceError
        If there is no option, the nominal label is none of them, or the weights are no
        probabilities.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Choice
    >>> bodies = {"dead zone": nlctl.DeadZone(), "gain": nlctl.Gain()}
    >>> Choice(name="actuator", options=bodies).nominal
    'dead zone'
    """

    name: str  # Keyword of the function that builds the diagram, ``"actuator"``.
    options: Mapping[str, Any]  # ``{label: record or python-control system}``.
    nominal: str = ""  # Label that holds while other quantities vary; by default the first.
    weights: tuple[float, ...] = ()  # Probability of each option; by default all alike.

    def __post_init__(self) -> None:
        text("a choice", "name", self.name)
        of_type(f"choice '{self.name}'", "options", self.options, Mapping, "{label: block}")
        labels = [text(f"choice '{self.name}'", "a label", label) for label in self.options]
        if not labels:
            raise SpaceError(f"choice '{self.name}' needs at least one option, got none")
        if self.nominal not in ("", *labels):
            raise SpaceError(
                f"choice '{self.name}' needs a nominal option among {labels}, got '{self.nominal}'"
            )
        object.__setattr__(self, "nominal", self.nominal or labels[0])
        given = (1 / len(labels),) * len(labels) if self.weights == () else self.weights
        weights = vector(f"choice '{self.name}'", "weights", given).tolist()
        if len(weights) != len(labels) or min(weights) < 0 or not np.isclose(sum(weights), 1):
            raise SpaceError(
                f"choice '{self.name}' needs {counted(len(labels), 'weight')} >= 0 that add up to "
                f"1, got {self.weights}"
            )
        object.__setattr__(self, "weights", tuple(weights))


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

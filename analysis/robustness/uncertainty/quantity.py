"""What is uncertain: parameters and initial states with laws, and choices between blocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy import stats

from nlctl.annotations import as_annotated
from nlctl.arguments import number, of_type, text, vector
from nlctl.attributes import described_record
from nlctl.errors import UsageError
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
    >>> import nlctl
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

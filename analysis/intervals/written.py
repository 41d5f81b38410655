"""What a function does with numbers, written down as a list of operations.

A `Written` is one entry of the list; an equation takes it instead of a number, as it does a
ball.  Constants are the doubles of the equation, exactly.  What a comparison decides, and functions
that are not in the list of `OPERATIONS`, cannot be written.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .arithmetic import as_ball
from .normal_form import exact
from .numpy_functions import NumPyFunctions, calling
from .paths import Undecided

OPERATIONS = (
    "exp",
    "sin",
    "cos",
    "tanh",
    "sqrt",
    "log",
    "arctan",
    "absolute",
    "minimum",
    "maximum",
)
_MADE = {
    "tan": lambda x: x.apply("sin") / x.apply("cos"),
    "sinh": lambda x: (x.apply("exp") - (-x).apply("exp")) * 0.5,
    "cosh": lambda x: (x.apply("exp") + (-x).apply("exp")) * 0.5,
    "expm1": lambda x: x.apply("exp") - 1.0,
    "log1p": lambda x: (x + 1.0).apply("log"),
}
_MOST = 64  # power


class Written(NumPyFunctions):
    """A quantity of an equation, as its place in a list of operations."""

    __slots__ = ("nodes", "place")
    rank = 2

    def __init__(self, nodes: list[list[Any]], place: int) -> None:
        self.nodes = nodes  # operations, each a name with numbers, symbols, or places before it
        self.place = place

    def _node(self, *node: object) -> Written:
        place = next((i for i, other in enumerate(self.nodes) if other == list(node)), None)
        if place is None:
            place = len(self.nodes)
            self.nodes.append(list(node))
        return Written(self.nodes, place)

    def lifted(self, number: object) -> Any:
        """Return a number as an entry of the same list; NotImplemented for what is none."""
        if isinstance(number, Written):
            return number
        ball = as_ball(number)
        if ball is NotImplemented:
            return ball
        if not (ball.value.is_exact() and ball.value.is_finite()):
            raise Undecided(f"{number} is not a number that can be written exactly")
        return self._node("number", str(exact(float(ball.value))))

    def _with(self, operation: str, other: Written) -> Any:
        other = self.lifted(other)
        return other if other is NotImplemented else self._node(operation, self.place, other.place)

    __add__, __mul__ = calling("_with", "+"), calling("_with", "*")
    __truediv__ = calling("_with", "/")
    minimum, maximum = calling("_with", "minimum"), calling("_with", "maximum")

    def __neg__(self) -> Written:
        return self * -1.0

    def __pow__(self, n: Any) -> Any:
        if isinstance(n, NumPyFunctions) or n != int(n) or abs(n) > _MOST:
            raise Undecided("a power that is not a small integer")
        return 1.0 / self**-n if n < 0 else self._node("power", self.place, int(n))

    def __abs__(self) -> Written:
        return self._node("absolute", self.place)

    def apply(self, name: str) -> Any:
        """Return a function of the list, or one that is made of them."""
        if name in _MADE:
            return _MADE[name](self)
        if name not in OPERATIONS:
            raise Undecided(f"{name} cannot be written")
        return self._node(name, self.place)

    def pair(self, name: str, other: Written) -> Any:
        """Return a function of two arguments that is made of those of the list."""
        other = self.lifted(other)
        if other is NotImplemented or name != "hypot":
            raise Undecided(f"{name} cannot be written")
        return (self**2 + other**2).apply("sqrt")

    def table(self, xp: tuple[float, ...], fp: tuple[float, ...]) -> Any:
        """Refuse a table: it is none of the operations."""
        raise Undecided("a table cannot be written")

    def _compared(self, order: str, other: object) -> Any:
        raise Undecided("a comparison cannot be written: use np.minimum, np.maximum or abs")


def operations(names: tuple[str, ...], function: Callable[..., Any]) -> list[list[Any]]:
    """Return what a function does with symbols, as a list of which the last entry is its value."""
    nodes: list[list[Any]] = [["symbol", name] for name in names]
    start = Written(nodes, 0)
    value = start.lifted(function({name: Written(nodes, i) for i, name in enumerate(names)}))
    if value is NotImplemented:
        raise Undecided("it does not give a number")
    if value.place != len(nodes) - 1:
        nodes.append(["power", value.place, 1])
    return nodes

"""A function does with numbers what it does with balls: compared at points of every box.

A proof reads what a function makes of balls, a run what it makes of floats.  So where balls go
through a function of a user's, floats inside of these balls go through it as well, and what
comes out has to lie in what the balls gave.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NoReturn

import numpy as np
from flint import arb

from nlctl.errors import UsageError
from nlctl.wording import counted

from .arithmetic import Ball, as_ball, quiet
from .normal_form import Sum
from .numpy_functions import NumPyFunctions
from .paths import Undecided, decided_so_far, every_way
from .quotient import Slope
from .type_questions import type_question
from .written import Written


class TimeRead(Exception):  # noqa: N818 (it ends an evaluation; nobody else sees it)
    """The time was read."""


def _refused(*_: object, **__: object) -> NoReturn:
    raise TimeRead


class _Unread:
    """A time that nothing can be done with: arithmetic, comparison and conversion raise."""

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = _refused
    __rtruediv__ = __pow__ = __rpow__ = __mod__ = __rmod__ = __floordiv__ = _refused
    __rfloordiv__ = __neg__ = __pos__ = __abs__ = __float__ = __int__ = __bool__ = _refused
    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = __hash__ = _refused  # type: ignore[assignment]
    __array_ufunc__ = __array__ = __iter__ = __len__ = __getitem__ = __index__ = _refused
    __round__ = __trunc__ = __floor__ = __ceil__ = __divmod__ = __matmul__ = _refused


UNREAD: Any = _Unread()


def reads_time(function: Callable[[Any, Any], Any]) -> bool:
    """Whether ``function(u, t)`` reads t for any u; what cannot be followed does."""
    everywhere = Ball(arb(0, "inf"), (arb(1),))
    try:
        return any(result is UNREAD for result in every_way(lambda: function(everywhere, UNREAD)))
    except Exception:  # TimeRead, or whatever a function raises that is not followed
        return True


_ALL, _EVERY = 400, 16  # calls that are all compared, and then every so many
_AT_POINTS = 40  # calls that are compared with balls without width, too: wide ones hold a lot
_GOLDEN = 0.6180339887498949
_ROUNDING, _BALLS = 1e-9, 16  # relative; and radii of balls at a point, which bound rounding
_LARGE = 5.0  # scale of points in balls without an end
_NUMBERS = (NumPyFunctions, arb, int, float, np.integer, np.floating, np.bool_)
_APART = 1e-2  # least |v| at which a difference quotient keeps its digits
_ASKED = (
    "it {}, and may then do one thing in a run and another in a proof: leave it to numbers, with "
    "arithmetic, comparisons and NumPy functions"
)
_Refusal = Callable[[str], UsageError]


def agreeing(function: Callable[..., Any], refusal: _Refusal) -> Callable[..., Any]:
    """Return a function that compares what it makes of balls with what it makes of floats."""
    question = type_question(function)
    if question:
        raise refusal(_ASKED.format(question))
    calls = itertools.count()

    def called(*arguments: object) -> Any:
        before = decided_so_far()
        with quiet():
            result = function(*arguments)
        n = next(calls)
        if decided_so_far() == before and (n < _ALL or n % _EVERY == 0):
            _compare(function, arguments, result, n, refusal)
        return result

    return called


def on_balls(
    function: Callable[..., Any], refusal: Callable[[str], UsageError]
) -> Callable[..., Any]:
    """Return a function of a user's for balls: where it fails on them, `refusal` says so."""
    # Wherever it does not fail it is also called with floats, see `agreeing`.
    compared = agreeing(function, refusal)

    def called(*arguments: object) -> Any:
        try:
            result = compared(*arguments)
        except (Undecided, UsageError):
            raise
        except Exception as error:  # a user's function may raise whatever it likes
            raise refusal(f"{type(error).__name__}: {error}{_instead(error)}") from error
        for part in _elements(result):
            if not isinstance(part, _NUMBERS) and part is not UNREAD:
                raise refusal(f"it gives {_kind_of(part)}, where a number is needed")
        return result

    return called


def one_number(function: Callable[..., Any], refusal: _Refusal) -> Callable[..., Any]:
    """Return a function as `on_balls` does, that gives one number and nothing else."""
    compared = on_balls(function, refusal)

    def called(*arguments: object) -> Any:
        result = compared(*arguments)
        if isinstance(result, np.ndarray) and not result.ndim:  # of np.where
            result = result.item()
        if not isinstance(result, _NUMBERS):
            raise refusal(f"it gives {_kind_of(result)}, where one number is needed")
        return result

    return called


def several_numbers(function: Callable[..., Any], refusal: _Refusal) -> Callable[..., Any]:
    """Return a function as `on_balls` does, that gives a tuple, list or array of numbers."""
    compared = on_balls(function, refusal)

    def called(*arguments: object) -> tuple[Any, ...]:
        result = compared(*arguments)
        if isinstance(result, tuple | list | np.ndarray) and np.ndim(result) <= 1:
            parts = tuple(_elements(result))
            if len(parts) == len(np.atleast_1d(result)):
                return parts
        raise refusal(f"it gives {_kind_of(result)}, where a tuple of numbers is needed")

    return called


def _instead(error: Exception) -> str:
    """Return what to call where a function of `math` has met something else than a float."""
    is_of_math = isinstance(error, TypeError) and str(error).startswith("must be real number")
    return ": call NumPy's functions, np.sin and not math.sin" if is_of_math else ""


def _kind_of(result: object) -> str:
    return f"an object of type {type(result).__name__}"


def _compare(
    function: Callable[..., Any],
    arguments: Sequence[Any],
    result: object,
    n: int,
    refusal: _Refusal,
) -> None:
    """Call a function with floats inside of balls, and compare."""
    point = _Point(n)
    floats = tuple(map(point.inside, arguments))
    if not point.any or point.lost:
        return
    values, balls = _on_floats(function, floats, refusal), list(_elements(result))
    at_floats = f"at {', '.join(f'{x:.6g}' for x in point.taken)}"
    if values is None or len(values) != len(balls):
        what = "raises an error" if values is None else f"returns {counted(len(values), 'number')}"
        if all(_value(ball).is_finite() for ball in balls):
            raise refusal(
                f"with floats {at_floats} it {what}, and with balls it gives {len(balls)}"
            )
        return
    thin = _at_point(function, floats) if n < _AT_POINTS else None
    for i, (value, ball) in enumerate(zip(values, balls, strict=True)):
        room = _ROUNDING * (1 + abs(value))
        if _holds(_value(ball), value, room) and (not thin or _holds(thin[i], value, room)):
            continue
        thin = _at_point(function, floats) if thin is None else thin
        room = _BALLS * float(thin[i].rad()) if i < len(thin) else 0.0
        if not (room > 0 and _holds(_value(ball), value, room) and _holds(thin[i], value, room)):
            raise refusal(
                f"with floats {at_floats} it gives {value:.9g}, and with balls that hold them "
                f"{_value(ball)}: it must not ask what its arguments are"
            )
    _compare_quotients(function, arguments, point, (values, balls), refusal)


def _compare_quotients(
    function: Any,
    arguments: Sequence[Any],
    point: "_Point",
    results: Sequence[Any],
    refusal: _Refusal,
) -> None:
    """Compare difference quotients with those of floats."""
    values, balls = results
    v = point.slope
    if v is None or abs(v) < _APART or not any(isinstance(ball, Slope) for ball in balls):
        return
    at_rest = _Point(point.n, rest=True)
    zero = _on_floats(function, tuple(map(at_rest.inside, arguments)), refusal)
    for value, start, ball in zip(values, zero or (), balls, strict=False):
        if isinstance(ball, Slope):
            quotient = (value - start) / v
            room = 1e-6 * (1 + abs(quotient)) + _ROUNDING * (1 + abs(value)) / abs(v)
            if not _holds(ball.quotient.value, quotient, room):
                raise refusal(
                    f"with floats its difference quotient at {v:.6g} is {quotient:.9g}, and with "
                    f"balls {ball.quotient.value}: it must not ask what its arguments are"
                )


def _on_floats(
    function: Callable[..., Any], floats: tuple[float, ...], refusal: _Refusal
) -> list[float] | None:
    """Return what a function makes of floats; None for an error."""
    try:
        with np.errstate(all="ignore"):
            return [float(v) for v in _elements(function(*floats))]
    except UsageError:
        raise
    except TypeError as error:
        raise refusal(f"with floats it raises {type(error).__name__}: {error}") from error
    except Exception:  # a user's function may raise whatever it likes
        return None


def _at_point(function: Callable[..., Any], floats: tuple[float, ...]) -> list[arb]:
    """Return what a function makes of balls without width; nothing where that is undecided."""
    try:
        return [_value(ball) for ball in _elements(function(*map(_thin, floats)))]
    except Undecided:
        return []


def _thin(thing: Any) -> Any:
    if isinstance(thing, float):
        return Ball(arb(thing))
    if type(thing) in (tuple, list):
        return type(thing)(map(_thin, thing))
    if isinstance(thing, np.ndarray) and thing.dtype == float:
        array = np.empty(thing.shape, dtype=object)
        array[...] = [Ball(arb(float(v))) for v in thing]
        return array
    return thing


def _elements(result: object) -> Iterator[Any]:
    """Yield the numbers of a result, in order."""
    if isinstance(result, tuple | list | np.ndarray) and np.ndim(result):
        for part in result:
            yield from _elements(part)
    elif isinstance(result, tuple | list):
        return
    else:
        yield result.item() if isinstance(result, np.ndarray) else result


def _value(ball: object) -> arb:
    enclosed = as_ball(ball.here if isinstance(ball, Slope) else ball)
    return arb.nan() if enclosed is NotImplemented else enclosed.value


def _holds(ball: arb, value: float, room: float) -> bool:
    """Whether a ball, widened by the rounding of floats, contains a number."""
    if not ball.is_finite():
        return True
    return math.isfinite(value) and bool(ball.overlaps(arb(value, room)))


class _Point:
    """Takes a number in every ball of some arguments; `rest` takes 0 for v, and else the same."""

    def __init__(self, n: int, rest: bool = False) -> None:
        self.n, self.rest = n, rest
        self.taken: list[float] = []
        self.any = self.lost = False
        self.slope: float | None = None

    def inside(self, argument: Any) -> Any:
        """Return an argument with floats instead of balls."""
        if argument is UNREAD:
            return 0.0
        if isinstance(argument, Slope):
            number = self._number(
                argument.here.value
            )  # at rest, too: the others stay where they are
            self.slope = 0.0 if self.rest else number
            return self.slope
        if isinstance(argument, Ball):
            return self._number(argument.value)
        if type(argument) in (tuple, list):
            return type(argument)(map(self.inside, argument))
        if isinstance(argument, np.ndarray) and argument.dtype == object:
            return np.array([self.inside(v) for v in argument.flat], dtype=float).reshape(
                argument.shape
            )
        if isinstance(argument, Sum | Written):  # it has no point
            self.lost = True
            return math.nan
        return argument

    def _number(self, ball: arb) -> float:
        self.any = True
        share = (0.5 + _GOLDEN * (self.n + 1) * (len(self.taken) + 1)) % 1
        if ball.is_finite():
            low, high = float(ball.lower()), float(ball.upper())
            number = low + share * (high - low)
        else:
            number = _LARGE * math.tan(math.pi * (share - 0.5))
        if not ball.contains(arb(number)):
            number = float(ball.mid()) if ball.is_finite() else number
            self.lost |= not ball.is_nan() and not ball.contains(arb(number))
        self.taken.append(number)
        return number

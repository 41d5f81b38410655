"""Whatever a function can ask of its arguments' type, text, dtype or identity is refused."""

import contextlib
import dataclasses
import functools
import math
import numbers
import operator
import sys

import numpy as np
import pytest

import nlctl
from nlctl.analysis.intervals.type_questions import type_question
from nlctl.analysis.lyapunov import Box, certify, enclose, prove, prove_decrease
from nlctl.errors import ParameterError, UsageError

BOX = Box.of(v=(-1.0, 1.0))


@functools.singledispatch
def dispatched(v):
    return 2 * v


@dispatched.register
def _(v: float):
    return v


class Gain:
    """An object that asks in a method, or where an operator is overloaded."""

    def of(self, v):
        return v if isinstance(v, float) else 2 * v

    def __mul__(self, v):
        return self.of(v)

    @property
    def kind(self):
        return type(self)


@dataclasses.dataclass(frozen=True)
class Honest:
    """An object that asks nothing, with what dataclasses generate."""

    k: float = 2.0
    value: float = 0.5

    @property
    def square(self):
        return self.k * self.k

    def of(self, v):
        return self.square * v


is_float = isinstance
GAIN, HONEST = Gain(), Honest()


def caught(v):
    try:
        return float(v)
    except TypeError:
        return 2 * v


def suppressed(v):
    with contextlib.suppress(TypeError):
        return math.sin(v)
    return 2 * v


def matched(v):
    match v:
        case float():
            return v
    return 2 * v


def by_frame(v):
    return v if "arb" in sys._getframe(1).f_globals else 2 * v


def imported(v):
    from numbers import Real

    return v if Real.__instancecheck__(v) else 2 * v


ASKS = {
    "isinstance": lambda v: v if isinstance(v, float) else 2 * v,
    "isinstance of the other": lambda v: 2 * v if not isinstance(v, (np.floating, float)) else v,
    "type": lambda v: v if type(v) is float else 2 * v,
    "type by a collection": lambda v: v if type(v) in (float,) else 2 * v,
    "__class__": lambda v: v if v.__class__.__name__ == "float" else 2 * v,
    "hasattr": lambda v: 2 * v if hasattr(v, "gradient") else v,
    "getattr": lambda v: getattr(v, "gradient", (1,))[0] * v,
    "another name": lambda v: v if is_float(v, float) else 2 * v,
    "a default": lambda v, ask=isinstance: v if ask(v, float) else 2 * v,
    "a partial": functools.partial(lambda ask, v: v if ask(v, float) else 2 * v, isinstance),
    "dispatch": lambda v: dispatched(v),
    "repr": lambda v: v if "Ball" in repr(v) else 2 * v,
    "str": lambda v: v * len(str(v)),
    "text": lambda v: v if f"{v}"[0] == "B" else 2 * v,
    "text by %": lambda v: v if ("%s" % v)[0] == "B" else 2 * v,  # noqa: UP031
    "text of format": lambda v: v if "{}".format(v)[0] == "B" else 2 * v,  # noqa: UP032
    "identity": lambda v: v if v is (v + 0.0) else 2 * v,
    "identity by operator": lambda v: v if operator.is_(v, v * 1.0) else 2 * v,
    "id": lambda v: v if id(v) == id(+v) else 2 * v,
    "hash": lambda v: hash(v) * v,
    "dtype": lambda v: v if np.asarray(v).dtype == float else 2 * v,
    "itemsize": lambda v: np.array([v]).itemsize * v,
    "flags": lambda v: v if np.array([v]).flags.writeable else 2 * v,
    "result_type": lambda v: v if np.result_type(v) in (float,) else 2 * v,
    "isscalar": lambda v: v if np.isscalar(v) else 2 * v,
    "is_integer": lambda v: v if v.is_integer() else 2 * v,
    "hex": lambda v: v * len(v.hex()),
    "real": lambda v: v.real,
    "an exception": caught,
    "a suppressed one": suppressed,
    "match": matched,
    "a frame": by_frame,
    "an import": imported,
    "a class of numbers": lambda v: v if issubclass(v.__class__, numbers.Real) else 2 * v,
    "a method": lambda v: GAIN.of(v),
    "an operator": lambda v: GAIN * v,
    "a property": lambda v: v if GAIN.kind else 2 * v,
    "a bound method": GAIN.of,
    "deep inside": lambda v: np.sin((lambda w: (lambda z: z if callable(z) else 2 * z)(w))(v)),
    "vectorize": np.vectorize(lambda v: v if isinstance(v, float) else 2 * v),
    "eval": lambda v: eval("v"),
    "globals": lambda v: globals()["HONEST"].k * v,
    "a memo": functools.lru_cache(lambda v: 2 * v),
}

HONESTLY = {
    "arithmetic": lambda v: v * v - 2 * v**3,
    "a branch": lambda v: v if v > 0.2 else 0.2,
    "where": lambda v: np.where(v > 0, v, 0.5 * v),
    "an argument that may be None": lambda v, k=None: v if k is None else k * v,
    "an object": lambda v: HONEST.of(v),
    "a bound method": HONEST.of,
    "a partial": functools.partial(lambda k, v: k * v, 2.0),
    "a closure": (lambda k: lambda v: k * v)(3.0),
    "a sum over an array": lambda v: np.sum(np.array([v, 2 * v, 0.5])),
    "a product of matrices": lambda v: (np.array([[1.0, 2.0], [0.5, 1.0]]) @ np.array([v, v]))[0],
    "a loop": lambda v: sum(k * v**k for k in range(4)),
    "the catalogue": lambda v: np.hypot(v, 1.0) + np.arctan2(v, 2.0) + np.exp(-v) % 3.0,
    "a table": lambda v: np.interp(v, [-1.0, 0.0, 2.0], [0.0, 1.0, 0.5]),
    "an equation": nlctl.equation(lambda v: np.tanh(v)),
    "a parameter with a ball's word": lambda v: HONEST.value * v,
}


def of_state(function):
    return lambda x: function(x[0])


@pytest.mark.parametrize("what", ASKS)
def test_a_function_that_asks_is_refused(what):
    """By name, before anything is proved of it: in every function that reads balls."""
    ask = ASKS[what]
    with pytest.raises(ParameterError, match="cannot take this function: "):
        enclose(of_state(ask), BOX)
    with pytest.raises(ParameterError):
        prove(of_state(ask), BOX, high=100.0)


@pytest.mark.parametrize("what", HONESTLY)
def test_one_that_does_not_is_enclosed(what):
    """And its range holds what it gives floats."""
    function = HONESTLY[what]
    found = enclose(of_state(function), BOX, tol=0.05)
    values = [float(function(float(v))) for v in np.linspace(-1, 1, 41)]
    assert found.low <= min(values)
    assert max(values) <= found.high
    assert type_question(function) is None


@pytest.mark.parametrize("what", ["isinstance", "an exception", "an operator", "dtype", "identity"])
@pytest.mark.parametrize("who", ["V", "rhs", "gradient"])
def test_a_level_set_is_refused_so(what, who):
    """Each of its functions."""
    ask = ASKS[what]
    pieces = {
        "V": lambda x: x[0] ** 2,
        "rhs": lambda x: (-x[0],),
        "gradient": lambda x: (2 * x[0],),
    }
    asking = {"V": lambda x: ask(x[0]) ** 2, "rhs": lambda x: (-ask(x[0]),),
              "gradient": lambda x: (2 * ask(x[0]),)}  # fmt: skip
    with pytest.raises(ParameterError, match=f"needs {who} of numbers"):
        prove_decrease(**{**pieces, who: asking[who]}, box=BOX, level=0.9, floor=0.1)


@pytest.mark.parametrize("what", ["isinstance", "an exception", "a method", "text", "is_integer"])
@pytest.mark.parametrize("law", ["sliding", "known sign"])
def test_a_plant_that_asks_has_no_certificate(what, law):
    """Whatever the law, in f and in d: a run had 7.32 where 0.0198 was proved."""
    ask = ASKS[what]
    laws = {
        "sliding": nlctl.controllers.SlidingModeLaw(K=23.0, phi=0.1),
        "known sign": nlctl.controllers.KnownSignLaw(),
    }
    for more in (
        {"f": lambda x, v: -x[0] + 1.5 * v + 0.1 * ask(v)},
        {"f": lambda x, v: -x[0] + 1.5 * v, "d": lambda x, t: 0.1 * ask(x[0])},
    ):
        plant = nlctl.PureFeedback(order=2, **more)
        loop = nlctl.paper.example_1(plant=plant, controller=_controller(laws[law]))
        with pytest.raises(UsageError):
            certify(loop)


def _controller(law):
    return nlctl.adaptive_neural(2, law=law)


NO_NUMBERS = {  # what is given where x > 0.99: nowhere that floats are tried
    "nothing": None, "text": "x", "a complex number": 1j, "an array": np.array([1.0, 2.0]),
    "a pair": (1.0, 2.0), "a list": [1.0, 2.0], "a set": {1.0},
}  # fmt: skip


@pytest.mark.parametrize("what", NO_NUMBERS)
def test_what_is_no_number_somewhere_is_refused(what):
    """By its type; no error of what reads it."""

    def sometimes(x):
        return NO_NUMBERS[what] if x[0] > 0.99 else x[0] ** 2

    for ask in (
        lambda: enclose(sometimes, BOX),
        lambda: prove(sometimes, BOX, high=100.0),
        lambda: prove_decrease(sometimes, lambda x: (-x[0],), box=BOX, level=0.9, floor=0.1),
        lambda: prove_decrease(
            lambda x: x[0] ** 2, lambda x: (NO_NUMBERS[what] if x[0] > 0.9 else -x[0],),
            box=BOX, level=0.9, floor=0.1,
        ),
    ):  # fmt: skip
        with pytest.raises(ParameterError):
            ask()


@pytest.mark.parametrize("one", [1.0, 2, np.float32(0.5), np.array(3.0), np.array(2), np.bool_(1)])
def test_plain_numbers_are_numbers(one):
    """Those that NumPy makes of a choice between floats as well."""
    found = enclose(lambda x: np.where(x[0] > 0, one, 0.25), BOX)
    assert [found.low, found.high] == pytest.approx(sorted([0.25, float(one)]), abs=1e-6)
    assert enclose(lambda x: one, BOX).high == pytest.approx(float(one))

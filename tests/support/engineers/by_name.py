"""What is looked up by a name, a number or a type that is computed; contexts of one's own."""

import bisect
import dataclasses
import enum

import numpy as np

from engineers.entry import engineered


@dataclasses.dataclass(frozen=True)
class Inertia:
    Jx: float = 0.1
    Jy: float = 0.12
    Jz: float = 0.18

    @property
    def total(self):
        return self.Jx + self.Jy + self.Jz


INERTIA = Inertia()


@engineered(3)
def attributes_by_computed_names(t, x, u, params):
    axes = ("Jx", "Jy", "Jz")
    moments = [getattr(INERTIA, a) for a in axes]
    rates = [(getattr(INERTIA, axes[(i + 1) % 3]) - m) * x[i] / m for i, m in enumerate(moments)]
    return np.array(rates) / getattr(INERTIA, "tot" + "al")


@engineered(3)
def fields_by_name(t, x, u, params):
    names = [field.name for field in dataclasses.fields(INERTIA)]
    made = Inertia(*np.abs(x))
    return [getattr(INERTIA, n) * v - getattr(made, n) for n, v in zip(names, x, strict=True)]


@engineered(2)
def an_attribute_or_a_default(t, x, u, params):
    parts = [getattr(INERTIA, name, 2.0) for name in ("Jx", "Jw")]
    return parts * x


class Gear(enum.IntEnum):
    FIRST = enum.auto()
    SECOND = enum.auto()
    THIRD = enum.auto()

    @property
    def ratio(self):
        return {1: 3.6, 2: 2.1, 3: 1.4}[self.value]


@engineered(2)
def members_by_an_integer(t, x, u, params):
    gear = Gear(1 + bisect.bisect([1.0, 5.0], abs(x[0])))
    return [gear.ratio * x[1], x[0] if gear is not Gear.THIRD else -x[0]]


@engineered(2)
def members_that_there_may_not_be(t, x, u, params):
    try:
        gear = Gear(int(x[0]))
    except ValueError:
        gear = Gear.FIRST
    return [gear.ratio * x[1], Gear(int(abs(x[1])) + 1).ratio]


@engineered(2)
def an_array_as_a_number(t, x, u, params):
    try:
        v = float(x[:1])
    except TypeError:
        v = float(x[0]) + 1.0
    return [v, float(x[1:].reshape(()))]


class Scaled:
    def __init__(self, scale):
        self.scale, self.entered = scale, 0

    def __enter__(self):
        self.entered += 1
        return self

    def __exit__(self, kind, error, trace):
        self.entered -= 1
        return False

    def si(self, v):
        return v * self.scale * self.entered


@engineered(2)
def a_context_of_its_own(t, x, u, params):
    with Scaled(1e-3) as mm, np.errstate(all="ignore"):
        gap = mm.si(5.0 + x[0] ** 2)
        if x[1] > 1.0:
            return [gap, mm.si(x[1])]
    return [gap / (1.0 + mm.entered), -x[1]]


class Units:
    factor = 1e-3

    def __enter__(self):
        return self.factor

    def __exit__(self, *_):
        return None


UNITS = Units()


@engineered(2)
def a_context_that_was_there(t, x, u, params):
    with UNITS as k:
        return k * x


class Level(enum.Enum):
    LOW, HIGH = 0.5, 2.0


@engineered(2)
def members_by_a_float(t, x, u, params):
    level = Level(x[0]) if x[0] in (0.5, 2.0) else Level.LOW
    return [level.value, x[1]]

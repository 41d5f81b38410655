"""Methods, properties, inheritance, dataclasses, objects that are called."""

import enum
from collections import namedtuple
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np

from ._entry import entry, pieces
from .helpers import Base


@entry(discrete=True)
def method_reads_attributes(n):
    class Plant:
        def __init__(self, k):
            self.k = k
            self.A = -np.eye(n) * k

        def update(self, t, x, u, params):
            return self.A @ x + self.k * u[0]

        def output(self, t, x, u, params):
            return self.k * x[0]

    plant = Plant(1.7)
    return pieces(plant.update, plant.output, states=n)


@entry
def method_without_self(n):
    class Plant:
        def update(self, t, x, u, params):
            return -params["k"] * x + u[0]

    return pieces(Plant().update, states=n, k=0.7)


@entry
def static_and_class_methods(n):
    class Plant:
        gain = 1.3

        @staticmethod
        def update(t, x, u, params):
            return -x * u[0]

        @classmethod
        def output(cls, t, x, u, params):
            return cls.gain * x

    return pieces(Plant.update, Plant().output, states=n, outputs=n)


@entry
def properties(n):
    class Plant:
        mass, length = 2.0, 0.5

        @property
        def inertia(self):
            return self.mass * self.length**2

        def update(self, t, x, u, params):
            return -x / self.inertia + u[0]

    return pieces(Plant().update, states=n)


@entry
def inherited_with_super(n):
    class Heavy(Base):
        gain = 3.0

        def rate(self, x):
            return super().rate(x) - x**3

    class Heavier(Heavy):
        def update(self, t, x, u, params):
            return super().update(t, x, u, params) * self.n

    return pieces(Heavier(n).update, states=n)


@entry
def object_that_is_called(n):
    class Law:
        def __init__(self):
            self.K = np.linspace(1, 2, n)

        def __call__(self, t, x, u, params):
            return -self.K * x + u[1]

    return pieces(Law(), states=n)


@entry
def frozen_dataclass(n):
    @dataclass(frozen=True)
    class Motor:
        R: float = 1.2
        J: float = 0.3
        gains: tuple = (1.0, 2.0)

        def update(self, t, x, u, params):
            return -x * self.R / self.J + self.gains[1] * u[0]

    return pieces(Motor(J=0.5).update, states=n)


@entry
def dataclass_with_defaults(n):
    @dataclass
    class Tank:
        area: float = 2.0
        coefficients: list = field(default_factory=lambda: [1.0, 0.5])

        def __post_init__(self):
            self.total = sum(self.coefficients)

        def update(self, t, x, u, params):
            return (u[0] - self.total * np.sqrt(np.abs(x))) / self.area

    return pieces(Tank(area=1.5).update, states=n)


@entry
def dataclass_as_parameter(n):
    @dataclass(frozen=True)
    class Gains:
        kp: float
        ki: float

    def update(t, x, u, params):
        g = params["gains"]
        h = replace(g, ki=0.0)
        return -g.kp * x + g.ki * u[0] + h.ki

    return pieces(update, states=n, gains=Gains(1.5, 0.5))


@entry
def named_tuple_and_namespace(n):
    Point = namedtuple("Point", "x y")
    conf = SimpleNamespace(k=0.4, inner=SimpleNamespace(m=2.0))

    def update(t, x, u, params):
        p = Point(x[0], y=u[0])
        q = p._replace(y=1.0)
        return -x * conf.k / conf.inner.m + p.x * p.y + q.y

    return pieces(update, states=n)


@entry
def enumeration(n):
    class Mode(enum.Enum):
        OFF = 0
        ON = 1

    def update(t, x, u, params):
        if params["mode"] is Mode.ON:
            return -x + u[0]
        return x * 0

    return pieces(update, states=n, mode=Mode.ON)


@entry
def objects_made_within(n):
    class Vector:
        def __init__(self, a, b):
            self.a, self.b = a, b

        def __add__(self, other):
            return Vector(self.a + other.a, self.b + other.b)

        def __mul__(self, k):
            return Vector(self.a * k, self.b * k)

        def norm(self):
            return np.hypot(self.a, self.b)

    def update(t, x, u, params):
        v = Vector(x[0], x[1]) + Vector(u[0], 1.0) * 2.0
        return -x + v.norm()

    return pieces(update, states=n)


@entry
def composed_objects(n):
    class Spring:
        def __init__(self, k):
            self.k = k

        def force(self, d):
            return self.k * d + 0.1 * d**3

    class Chain:
        def __init__(self):
            self.springs = [Spring(1.0 + 0.1 * i) for i in range(n - 1)]

        def update(self, t, x, u, params):
            dx = np.zeros(n)
            for i, spring in enumerate(self.springs):
                f = spring.force(x[i + 1] - x[i])
                dx[i] += f
                dx[i + 1] -= f
            dx[-1] += u[0]
            return dx

    return pieces(Chain().update, states=n)


@entry
def attribute_by_name(n):
    class Plant:
        k_slow, k_fast = 0.5, 5.0

    plant = Plant()

    def update(t, x, u, params):
        k = getattr(plant, "k_" + params["mode"])
        missing = getattr(plant, "k_none", 7.0)
        return -k * x + missing + hasattr(plant, "k_slow") + hasattr(x, "nothing")

    return pieces(update, states=n, mode="fast")


@entry
def slots_and_class_attribute(n):
    class Plant:
        __slots__ = ("k",)
        COUNT = 3

        def __init__(self):
            self.k = 2.5

        def update(self, t, x, u, params):
            return -self.k * x + type(self).COUNT + self.__class__.COUNT * u[0]

    return pieces(Plant().update, states=n)


@entry
def sequence_protocol(n):
    class Gains:
        def __getitem__(self, i):
            if i >= n:
                raise IndexError
            return 1.0 + i

        def __len__(self):
            return n

    gains = Gains()

    def update(t, x, u, params):
        return [-k * v for k, v in zip(gains, x)] + np.array(len(gains) + gains[1])

    return pieces(update, states=n)


@entry
def types_and_isinstance(n):
    def update(t, x, u, params):
        if isinstance(u, (list, tuple)):
            u = np.array(u)
        if np.isscalar(x) or type(x) is float:
            return 100.0
        if isinstance(x, np.ndarray) and isinstance(params, dict) and isinstance(x[0], float):
            return -x + u[0]
        return -2 * x

    return pieces(update, states=n)


@entry
def duck_typing(n):
    def update(t, x, u, params):
        k = 1.0 if hasattr(u, "__len__") else 2.0
        j = u[0] if hasattr(x, "dtype") and x.dtype == float else 0.0
        return -k * x + j + x.nbytes + x.itemsize + getattr(x, "ndim", 5)

    return pieces(update, states=n)


@entry
def kind_of_an_element(n):
    def update(t, x, u, params):
        v = u[0]
        if isinstance(v, np.floating) and not isinstance(v, int) and np.ndim(v) == 0:
            return -x * 2 + isinstance(t, (int, float))
        return x

    return pieces(update, states=n)


@entry
def kind_of_a_parameter(n):
    """A gain is a number, or a function of the state."""

    def update(t, x, u, params):
        k = params["k"]
        return -(k(x) if callable(k) else k * x) + (type(params["m"]) is int)

    return pieces(update, states=n, k=1.5, m=2)


@entry
def cached_matrix_by_property(n):
    """Computed at the first use and kept: the same value ever after."""
    import functools

    class Plant:
        @functools.cached_property
        def A(self):
            return -np.eye(n) * 1.5

        def update(self, t, x, u, params):
            return self.A @ x + u[0]

    return pieces(Plant().update, states=n)

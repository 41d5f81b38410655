"""Patterns, texts, numbers of other kinds, functions of functions, and classes inside."""

import enum
import functools
import json
import math
import operator
import re
import types
import typing
from abc import ABC, abstractmethod
from collections import defaultdict
from decimal import Decimal
from fractions import Fraction
from functools import partial, reduce
from types import SimpleNamespace

import numpy as np

from engineers.entry import engineered

FN = {"a": np.sin, "b": np.cos}
LAY = [{"f": "a", "w": 1.0}, {"f": "b", "w": 2.0}]
LAY2 = [("a", 1.0), ("b", 2.0)]
PAT = re.compile(r"(\w+)=([\d.]+)")
CFG = '{"k": [1.0, 2.0], "c": 0.5}'
REACTIONS = """
A + B -> C : 2.0
C -> A + B : 0.5
C -> D     : 0.1
"""
compose = lambda *fs: reduce(lambda f, g: lambda z: g(f(z)), fs)  # noqa: E731


@engineered(3)
def match_numbers(t, x, u, params):
    n = int(np.clip(x[0], 0, 3))
    match n:
        case 0:
            return x
        case 1 | 2:
            return -x
        case _:
            return 0 * x


@engineered(3)
def match_tuple_cmp(t, x, u, params):
    match (float(x[0]) > 0, float(x[1]) > 0):
        case (True, True):
            return x
        case (True, False):
            return -x
        case _:
            return 0 * x


@engineered(3)
def match_np_bool(t, x, u, params):
    match x[0] > 0:
        case True:
            return x
        case False:
            return -x
        case _:
            return 0 * x


@engineered(3)
def match_str(t, x, u, params):
    mode = "hi" if x[0] > 1 else "lo"
    match mode:
        case "hi":
            return x
        case "lo":
            return -x


@engineered(3)
def is_true_py(t, x, u, params):
    a = float(x[0]) > 0
    return x if a is True else -x


@engineered(3)
def is_true_np(t, x, u, params):
    a = x[0] > 0
    return x if a is True else -x


@engineered(3)
def is_true_np2(t, x, u, params):
    a = bool(x[0] > 0)
    return x if a is not False else -x


@engineered(3)
def is_true_any(t, x, u, params):
    return x if any(v > 1 for v in x) is True else -x


@engineered(3)
def match_bool_py(t, x, u, params):
    match float(x[0]) > 0, params.get("k"):
        case True, None:
            return x
        case False, None:
            return -x
        case _:
            return 0 * x


@engineered(3)
def fn_by_key_list(t, x, u, params):
    h = x
    for lay in LAY:
        h = FN[lay["f"]](h) * lay["w"]
    return h


@engineered(3)
def fn_by_key_tuple(t, x, u, params):
    h = x
    for name, w in LAY2:
        h = FN[name](h) * w
    return h


@engineered(3)
def text_methods(t, x, u, params):
    k = {}
    for line in "a=1\nb=2\nc=3".splitlines():
        key, _, v = line.partition("=")
        k[key.strip().upper()] = float(v)
    s = "abc"
    return (
        [k[c.upper()] * x[i] for i, c in enumerate(s)]
        if s.isalpha() and "a-b".replace("-", "").isalpha()
        else -x
    )


@engineered(3)
def text_lines(t, x, u, params):
    rows = [
        list(map(float, r.split()))
        for r in "1 2 3\n4 5 6\n7 8 9".splitlines()
        if not r.startswith("#")
    ]
    return np.array(rows) @ x


@engineered(3)
def decimals(t, x, u, params):
    k = [Decimal("0.1") + Decimal(i) for i in range(3)]
    return [float(a) * b for a, b in zip(k, x)]


@engineered(3)
def fractions_(t, x, u, params):
    k = [Fraction(i, 3) for i in range(3)]
    return [a * b for a, b in zip(k, x)]


@engineered(3)
def fractions_and_numbers(t, x, u, params):
    k = Fraction(1, 3)
    return [k * x[0] + x[1] / k - k, (x[2] - k) * (k + 1), float(k) + k * float(x[0]) + k.numerator]


@engineered(3)
def reduce_compose(t, x, u, params):
    c = reduce(lambda f_, g_: lambda z: g_(f_(z)), [np.sin, np.cos, lambda z: z * 2])
    return c(x)


@engineered(3)
def reduce_mats(t, x, u, params):
    return reduce(np.matmul, [np.eye(3), np.diag(x), np.ones((3, 3))]) @ x


@engineered(3)
def pipe_args(t, x, u, params):
    def pipe(v, *fs):
        for g in fs:
            v = g(v)
        return v

    return pipe(x, np.sin, np.cos, lambda z: z + u[0])


@engineered(1, 1)
def hammerstein_compose(t, x, u, params):
    chain = compose(partial(np.clip, a_min=-1, a_max=1), np.arctan, lambda z: z + 0.1 * z**3, abs)
    return np.array([chain(u[0]) - x[0]])


@engineered(3)
def frompyfunc_of_arrays(t, x, u, params):
    g = np.frompyfunc(lambda a: a if a > 0 else 0.1 * a, 1, 1)
    return g(x).astype(float) + np.array(g(x), dtype=float) + np.asarray(g(x) * 2, dtype=np.float64)


@engineered(2)
def re_global(t, x, u, params):
    d = {k: float(v) for k, v in PAT.findall("k=2.0 c=0.3")}
    m = PAT.match("a=5")
    return [x[1] * float(m.group(2)), u[0] - d["k"] * x[0] - d["c"] * x[1]]


@engineered(2)
def re_split(t, x, u, params):
    a, b = map(float, re.split(r"[;,]\s*", "1.5; 2.5"))
    return [a * x[1], b * x[0] if re.search("1", "1.5") else 0.0]


@engineered(2)
def json_global(t, x, u, params):
    c = json.loads(CFG)
    return [c["k"][0] * x[1], -c["k"][1] * x[0] - c.get("c", 0) * x[1]]


@engineered(2)
def local_enum(t, x, u, params):
    class M(enum.IntEnum):
        A = 1
        B = 2

    m = M.A if x[0] > 1 else M.B
    return [m * x[1], {M.A: 2.0, M.B: 3.0}[m] * x[0]]


@engineered(2)
def local_named(t, x, u, params):
    class P(typing.NamedTuple):
        a: float
        b: float = 2.0

        def total(self):
            return self.a + self.b

    p = P(x[0])
    q = P(x[1], b=u[0])
    return [p.total() * q.a, max((p, q), key=lambda z: z.total()).a]


@engineered(2)
def local_closure(t, x, u, params):
    g = 9.81 * (1 + 0.1 * u[0])

    class Body:
        def __init__(self, m):
            self.m = m

        def weight(self):
            return self.m * g

        def bigger(self):
            return Body(self.m * 2)

    b = Body(x[0]).bigger()
    return [b.weight(), Body(x[1]).weight()]


@engineered(2)
def local_inherit(t, x, u, params):
    class Base:
        k = 2.0

        def force(self, v):
            return self.k * v

    class Stiff(Base):
        k = 5.0

        def force(self, v):
            return Base.force(self, v) + v**3

    return [Stiff().force(x[0]), Base().force(x[1])]


@engineered(2)
def local_super(t, x, u, params):
    class Base:
        def __init__(self, k):
            self.k = k

        def force(self, v):
            return self.k * v

    class Stiff(Base):
        def __init__(self, k, c):
            super().__init__(k)
            self.c = c

        def force(self, v):
            return super().force(v) + self.c * v**3

    return [Stiff(2.0, 0.5).force(x[0]), Base(1.0).force(x[1])]


@engineered(2)
def local_abstract_class(t, x, u, params):
    class Law(ABC):
        @abstractmethod
        def __call__(self, v): ...

    class Cubic(Law):
        def __call__(self, v):
            return v**3

    return [Cubic()(x[0]), x[1]]


@engineered(2)
def local_counter(t, x, u, params):
    class Acc:
        total = 0.0

        def add(self, v):
            self.total += v
            return self

    return [Acc().add(x[0]).add(x[1]).total, x[0]]


@engineered(2)
def vars_of_a_namespace(t, x, u, params):
    n = SimpleNamespace(a=x[0], b=2.0)
    n.c = x[1]
    return [sum(vars(n).values()), n.__dict__["a"]]


@engineered(3)
def products_of_polynomials(t, x, u, params):
    P = np.poly1d([1.0, 2.0]) * np.poly1d([1.0, 1.0]) + 1
    Q = np.polynomial.Polynomial([1.0, 2.0]) ** 2 * 3
    return P(x) + Q(x)


@engineered(3, 1)
def json_configured_plant(t, x, u, params):
    cfg = json.loads('{"poles": [1.0, 2.0, 3.0], "gain": 4.0, "sat": {"lo": -1, "hi": 1}}')
    uu = min(max(u[0], cfg["sat"]["lo"]), cfg["sat"]["hi"])
    p = np.poly([-v for v in cfg["poles"]])
    A = np.vstack([np.eye(3)[1:], -p[:0:-1]])
    return A @ x + np.array([0, 0, cfg["gain"]]) * uu


@engineered(2, 1)
def unit_parser_regex(t, x, u, params):
    spec = "k=2.5e0 N/m; c=0.3 Ns/m"
    vals = {m.group(1): float(m.group(2)) for m in re.finditer(r"(\w+)=([\d.e]+)", spec)}
    return [x[1], u[0] - vals["k"] * x[0] - vals["c"] * x[1]]


@engineered(4, 1)
def hvdc_mode_selector(t, x, u, params):
    class Mode(enum.Enum):
        VOLT = "v"
        CURR = "c"

        @property
        def gain(self):
            return {"v": 2.0, "c": 5.0}[self.value]

    mode = Mode.VOLT if x[0] < 1.1 else Mode.CURR
    e = (1 - x[0]) if mode is Mode.VOLT else (u[0] - x[1])
    return [mode.gain * e - x[0], e - x[1], x[0] - x[2], x[2] - x[3]]


@engineered(3, 1)
def protocols_and_generics(t, x, u, params):
    class Law(typing.Protocol):
        def __call__(self, v: float) -> float: ...

    def series(*laws: Law) -> Law:
        def run(v):
            for law in laws:
                v = law(v)
            return v

        return run

    chain = series(math.tanh, functools.partial(operator.mul, 2.0), lambda v: v - 0.1 * v**3)
    return [chain(u[0]) - x[0], chain(x[0]) - x[1], chain(x[1]) - x[2]]


@engineered(2, 1)
def pid_on_error_sequence(t, x, u, params):
    e = u[0] - x[0]
    terms = types.SimpleNamespace(p=2 * e, i=0.5 * x[1], d=-0.1 * x[0])
    total = sum(vars(terms).values())
    sat = functools.reduce(
        lambda a, g: g(a), (lambda v: min(v, 3.0), lambda v: max(v, -3.0)), total
    )
    return [sat - x[0], e if abs(total) < 3 else 0.0]


@engineered(4, 0)
def mass_action_parsed(t, x, u, params):
    names = "ABCD"
    conc = dict(zip(names, x))
    d = defaultdict(float)
    for line in REACTIONS.strip().splitlines():
        eq, k = line.split(":")
        lhs, rhs = (side.split("+") for side in eq.split("->"))
        rate = float(k)
        for s in lhs:
            rate *= conc[s.strip()]
        for s in lhs:
            d[s.strip()] -= rate
        for s in rhs:
            d[s.strip()] += rate
    return [d[n] for n in names]

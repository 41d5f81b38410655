# ruff: noqa: E501
"""Keys see through objects: whatever holds a number of an equation, another number shows."""

import subprocess
import sys
import textwrap

import control as ct
import pytest
import source_text
from places import ROOT

import nlctl
from nlctl.analysis.loop_record import loop_facts, unseen_parts

HEAD = """
import array, collections, contextlib, datetime, decimal, enum, fractions, functools, itertools
import operator, os, types, weakref
import numpy as np
import pandas as pd
import scipy.interpolate as si
import scipy.sparse as sp
import scipy.spatial
import scipy.stats
import control as ct

V = 1.0
LONG = np.linspace(0.0, 1.0, 5000)
X = np.linspace(0.0, 9.0, 10)
def table(at, by):
    y = np.sin(X)
    y[at] += by
    return y
"""
TAIL = """
def update(t, x, u, params):
    return np.array([-x[0] + 0.0 * f(x[0])])

def loop():
    return ct.nlsys(update, None, inputs=0, outputs=1, states=1, name="lag")
"""
# what holds the number: VALUE is 1.0, and 1.0 + 1e-9 in the other loop
WAYS = {
    "spline": "g = si.CubicSpline(X, table(7, VALUE))\nf = lambda v: g(v)",
    "pchip, bound": "f = si.PchipInterpolator(X, table(7, VALUE)).__call__",
    "akima": "g = si.Akima1DInterpolator(X, table(7, VALUE))\ndef f(v): return g(v)",
    "interp1d": "g = si.interp1d(X, table(7, VALUE))\ndef f(v): return g(v)",
    "grid": "g = si.RegularGridInterpolator((X,), table(7, VALUE))\ndef f(v): return g([v])[0]",
    "B-spline": "g = si.make_interp_spline(X, table(7, VALUE))\ndef f(v): return g(v)",
    "smoothing spline": "g = si.UnivariateSpline(X, table(7, VALUE), s=0)\ndef f(v): return g(v)",
    "scattered": "g = si.LinearNDInterpolator(np.array([[0, 0], [0, 1], [1, 0.]]), [0, 1, VALUE])\n"
                 "def f(v): return g(v, v)",
    "radial": "g = si.RBFInterpolator(X[:, None], table(7, VALUE))\ndef f(v): return g([[v]])[0]",
    "tree": "g = scipy.spatial.cKDTree(np.c_[X, table(7, VALUE)])\ndef f(v): return g.query([v, v])[0]",
    "derivative of a spline": "g = si.CubicSpline(X, table(7, VALUE)).derivative()\ndef f(v): return g(v)",
    "sparse": "g = sp.csr_matrix(np.diag(table(7, VALUE)))\ndef f(v): return (g @ X)[3] * v",
    "sparse array": "g = sp.lil_array(np.diag(table(7, VALUE)))\ndef f(v): return g[7, 7]",
    "frozen law": "g = scipy.stats.norm(0, VALUE)\ndef f(v): return g.pdf(v)",
    "vectorize": "def h(v): return VALUE * v\ng = np.vectorize(h)\ndef f(v): return g(v)",
    "poly1d": "g = np.poly1d([1.0, VALUE])\ndef f(v): return g(v)",
    "polynomial": "g = np.polynomial.Polynomial([1.0, VALUE])\ndef f(v): return g(v)",
    "series": "g = pd.Series(LONG.copy())\ng[2500] = VALUE\ndef f(v): return g[2500]",
    "eighth digit of a series": "g = pd.Series([VALUE])\ndef f(v): return g[0]",
    "frame": "g = pd.DataFrame({'a': LONG, 'b': LONG}).copy()\ng.loc[2500, 'b'] = VALUE\n"
             "def f(v): return g.loc[2500, 'b']",
    "index": "g = pd.Index(np.r_[LONG, VALUE])\ndef f(v): return g[-1]",
    "category": "g = pd.Categorical(['a', str(VALUE)])\ndef f(v): return float(g[1])",
    "attrs of a frame": "g = pd.DataFrame({'a': [1]})\ng.attrs['k'] = VALUE\ndef f(v): return g.attrs['k']",
    "masked array": "g = np.ma.masked_array([1.0, 2.0], [VALUE > 1, False])\ndef f(v): return g.sum()",
    "array of objects": "g = np.array([None, VALUE], dtype=object)\ndef f(v): return g[1]",
    "nested array of objects": "g = np.array([[1], [2, VALUE]], dtype=object)\ndef f(v): return g[1][1]",
    "record array": "g = np.rec.array([(1.0, VALUE)], names='a,b')\ndef f(v): return g.b[0]",
    "memory view": "g = memoryview(np.array([VALUE]))\ndef f(v): return g[0]",
    "array module": "g = array.array('d', [VALUE])\ndef f(v): return g[0]",
    "deque": "g = collections.deque([VALUE])\ndef f(v): return g[0]",
    "default dict": "g = collections.defaultdict(float, k=VALUE)\ndef f(v): return g['k']",
    "chain map": "g = collections.ChainMap({}, {'k': VALUE})\ndef f(v): return g['k']",
    "mapping proxy": "g = types.MappingProxyType({'k': VALUE})\ndef f(v): return g['k']",
    "simple namespace": "g = types.SimpleNamespace(k=VALUE)\ndef f(v): return g.k",
    "values of a dict": "g = {'k': VALUE}.values()\ndef f(v): return list(g)[0]",
    "bound get": "g = {'k': VALUE}.get\ndef f(v): return g('k')",
    "bound item": "g = [VALUE].__getitem__\ndef f(v): return g(0)",
    "decimal": "g = decimal.Decimal(VALUE)\ndef f(v): return float(g)",
    "fraction": "g = fractions.Fraction(VALUE)\ndef f(v): return float(g)",
    "duration": "g = datetime.timedelta(days=1e6 * VALUE)\ndef f(v): return g.total_seconds()",
    "item getter": "g = operator.itemgetter(int(1e9 * (VALUE - 1) + 0.5))\ndef f(v): return g([v, 2 * v])",
    "method caller": "g = operator.methodcaller('__mul__', VALUE)\ndef f(v): return g(float(v))",
    "partial of a library's": "g = functools.partial(np.interp, xp=X, fp=table(7, VALUE))\ndef f(v): return g(v)",
    "partial in a partial": "f = functools.partial(functools.partial(max, VALUE), 0.0)",
    "keyword of a partial": "def h(v, k): return k * v\nf = functools.partial(h, k=VALUE)",
    "partial of a spline": "f = functools.partial(si.CubicSpline(X, table(7, VALUE)).__call__, nu=1)",
    "reduce": "f = functools.partial(functools.reduce, operator.mul, [1.0, VALUE])",
    "lru_cache": "@functools.lru_cache\ndef f(v): return VALUE * v",
    "attribute of a function": "def f(v): return f.k * v\nf.k = VALUE",
    "spline at a function": "def f(v): return f.k(v)\nf.k = si.CubicSpline(X, table(7, VALUE))",
    "globals by text": "K = VALUE\ndef f(v): return globals()['K'] * v",
    "getattr of a module": "g = types.ModuleType('mine')\ng.K = VALUE\ndef f(v): return getattr(g, 'K') * v",
    "environment": "os.environ['NLCTL_TEST_K'] = repr(VALUE)\ndef f(v): return float(os.environ['NLCTL_TEST_K'])",
    "getenv": "os.environ['NLCTL_TEST_K'] = repr(VALUE)\ndef f(v): return float(os.getenv('NLCTL_TEST_K'))",
    "own class": "class C:\n    def __init__(self, k): self.k = k\n    def __call__(self, v): return self.k * v\nf = C(VALUE)",
    "spline in an own class": "class C:\n    def __init__(self, g): self.g = g\n    def __call__(self, v): return self.g(v)\nf = C(si.CubicSpline(X, table(7, VALUE)))",
    "attribute of an own class": "class C:\n    g = si.CubicSpline(X, table(7, VALUE))\n    def __call__(self, v): return self.g(v)\nf = C()",
    "object at an own class": "class K:\n    def __init__(self, k): self.k = k\nclass C:\n    held = K(VALUE)\n    def __call__(self, v): return self.held.k\nf = C()",
    "slots": "class C:\n    __slots__ = ('gain',)\n    def __call__(self, v): return self.gain\nf = C()\nf.gain = VALUE",
    "one slot": "class C:\n    __slots__ = 'gain'\n    def __call__(self, v): return self.gain\nf = C()\nf.gain = VALUE",
    "private slot": "class C:\n    __slots__ = ('__gain',)\n    def __init__(self, k): self.__gain = k\n    def __call__(self, v): return self.__gain\nf = C(VALUE)",
    "slot of a base": "class B:\n    __slots__ = ('gain',)\nclass C(B):\n    __slots__ = ()\n    def __call__(self, v): return self.gain\nf = C()\nf.gain = VALUE",
    "own float": "class C(float): pass\ng = C(VALUE)\ndef f(v): return g * v",
    "own float with more": "class C(float): pass\ng = C(1.0)\ng.k = VALUE\ndef f(v): return g.k * v",
    "own list with more": "class C(list): pass\ng = C([1.0])\ng.k = VALUE\ndef f(v): return g.k * v",
    "own text with more": "class C(str): pass\ng = C('a')\ng.k = VALUE\ndef f(v): return g.k * v",
    "own array": "class C(np.ndarray): pass\ng = np.array([VALUE]).view(C)\ndef f(v): return g[0] * v",
    "own array with more": "class C(np.ndarray): pass\ng = np.array([1.0]).view(C)\ng.k = VALUE\ndef f(v): return g.k * v",
    "own deque": "class C(collections.deque): pass\ng = C([VALUE])\ndef f(v): return g[0] * v",
    "own frame": "class C(pd.DataFrame): pass\ng = C({'a': [VALUE]})\ndef f(v): return g['a'][0] * v",
    "own spline": "class C(si.CubicSpline): pass\ng = C(X, table(7, VALUE))\ndef f(v): return g(v)",
    "own dict of objects": "class C(dict):\n    def scaled(self): return VALUE\ng = C()\ndef f(v): return g.scaled() * v",
    "named tuple's method": "class C(collections.namedtuple('C', 'a')):\n    def scaled(self): return VALUE\ng = C(1)\ndef f(v): return g.scaled() * v",
    "set of objects": "class K:\n    def __init__(self, k): self.k = k\ng = {K(VALUE)}\ndef f(v): return next(iter(g)).k * v",
    "own decorator with a value": "class C:\n    def __init__(self, h, k):\n        functools.update_wrapper(self, h)\n        self.k = k\n    def __call__(self, v): return self.k * self.__wrapped__(v)\ndef h(v): return v\nf = C(h, VALUE)",
    "static method": "class C:\n    k = staticmethod(functools.partial(max, VALUE))\ndef f(v): return C.k(v)",
    "class method": "class C:\n    k = VALUE\n    @classmethod\n    def g(cls, v): return cls.k * v\nf = C.g",
    "property": "class C:\n    @property\n    def k(self): return VALUE\ng = C()\ndef f(v): return g.k * v",
    "meta class": "class M(type):\n    @property\n    def k(cls): return VALUE\nclass C(metaclass=M): pass\ndef f(v): return C.k * v",
    "inner class": "class C:\n    class D:\n        k = VALUE\ndef f(v): return C.D.k * v",
    "enum": "class C(enum.Enum):\n    K = VALUE\ndef f(v): return C.K.value * v",
    "dispatch": "@functools.singledispatch\ndef f(v): return v\n@f.register\ndef _(v: float): return VALUE * v",
    "weak reference": "class K:\n    pass\nkept = K()\nkept.k = VALUE\ng = weakref.ref(kept)\ndef f(v): return g().k * v",
    "cycle of objects": "class K: pass\ng = K()\ng.me, g.k = g, VALUE\ndef f(v): return g.me.me.k * v",
    "closure of a library": "g = np.errstate(all='ignore')(lambda v: VALUE * v)\ndef f(v): return g(v)",
    "third party's object": "g = ct.ss(-1.0, VALUE, 1.0, 0.0)\ndef f(v): return g.B[0, 0] * v",
    "third party's transfer": "g = ct.tf([VALUE], [1.0, 2.0])\ndef f(v): return g(0.0).real * v",
    "pattern": "import re\ng = re.compile('a' * int(1e9 * (VALUE - 1) + 1.5))\ndef f(v): return len(g.pattern) * v",
    "partial of a method": "class C:\n    def h(self, k, v): return k * v\n    f = functools.partialmethod(h, VALUE)\ng = C()\ndef f(v): return g.f(v)",
    "partial at a class": "def h(k, v): return k * v\nclass C:\n    f = functools.partial(h, VALUE)\ndef f(v): return C.f(v)",
    "context": "import contextvars\ng = contextvars.ContextVar('g')\ng.set(VALUE)\ndef f(v): return g.get() * v",
    "default of a context": "import contextvars\ng = contextvars.ContextVar('g', default=VALUE)\ndef f(v): return g.get() * v",
    "local of a thread": "import threading\ng = threading.local()\ng.k = VALUE\ndef f(v): return g.k * v",
    "queue": "import queue\ng = queue.Queue()\ng.put(VALUE)\ndef f(v): return g.queue[0] * v",
    "rotation": "from scipy.spatial.transform import Rotation\ng = Rotation.from_rotvec([0, 0, VALUE])\ndef f(v): return g.as_rotvec()[2] * v",
    "weak values": "class K: pass\nkept = K()\nkept.k = VALUE\ng = weakref.WeakValueDictionary(a=kept)\ndef f(v): return g['a'].k * v",
    "weak set": "class K: pass\nkept = K()\nkept.k = VALUE\ng = weakref.WeakSet([kept])\ndef f(v): return next(iter(g)).k * v",
    "array of C": "import ctypes\ng = (ctypes.c_double * 2)(1.0, VALUE)\ndef f(v): return g[1] * v",
    "optimiser's result": "import scipy.optimize as so\ng = so.OptimizeResult(x=VALUE)\ndef f(v): return g.x * v",
    "histogram's law": "g = scipy.stats.rv_histogram((table(7, VALUE)[:9] ** 2, X))\ndef f(v): return g.pdf(v)",
    "density": "g = scipy.stats.gaussian_kde(table(7, VALUE))\ndef f(v): return g(v)[0]",
    "table of Arrow": "import pyarrow as pa\ng = pa.table({'a': [1.0, VALUE]})\ndef f(v): return g['a'][1].as_py() * v",
    "rolling window": "g = pd.Series([1.0, VALUE]).rolling(1)\ndef f(v): return g.mean().iloc[1] * v",
    "linear operator": "import scipy.sparse.linalg as sl\ng = sl.aslinearoperator(np.diag(table(7, VALUE)))\ndef f(v): return g.matvec(X)[3] * v",
    "filter": "import scipy.signal as ss\ng = ss.lti([VALUE], [1, 2])\ndef f(v): return g.num[0] * v",
    "file in memory": "import io\ng = io.StringIO(repr(VALUE))\ndef f(v): return float(g.getvalue()) * v",
    "metadata of a type": "import typing\ng = typing.Annotated[float, VALUE]\ndef f(v): return g.__metadata__[0] * v",
    "text by text": "K = {'a': {'b': [1, (2, {'c': VALUE})]}}\ndef f(v): return K['a']['b'][1][1]['c']",
}  # fmt: skip


def source(name, value):
    return HEAD + WAYS[name].replace("VALUE", repr(value)) + TAIL


def facts(name, value):
    return loop_facts(source_text.run(source(name, value))["loop"]())


@pytest.mark.parametrize("name", WAYS)
def test_every_way_to_hold_a_number(name):
    """The ninth digit of one number; the same number has the same key, however often it is made."""
    one, again, other = (facts(name, value) for value in (1.0, 1.0, 1.0 + 1e-9))
    assert one == again
    assert one["blocks"] != other["blocks"]


@pytest.mark.parametrize("name", WAYS)
def test_what_is_seen_is_not_named_as_unseen(name):
    """No false alarm where the key sees the number."""
    assert unseen_parts(source_text.run(source(name, 1.0))["loop"]()) == {}


USED = {  # what may keep notes on itself when it is used
    "sparse", "sparse array", "frame", "series", "index", "tree", "grid", "scattered", "frozen law",
    "interp1d", "lru_cache", "dispatch", "property", "spline", "vectorize", "own frame", "category",
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(USED))
def test_using_an_object_does_not_change_its_key(name):
    """Otherwise nothing could be resumed after a run."""
    loop = source_text.run(source(name, 1.0))["loop"]()
    before = loop_facts(loop)
    for v in (0.1, 0.7, 3.0):
        loop.dynamics(0.0, [v], [], params={})
    assert loop_facts(loop) == before


@pytest.mark.weekly
def test_keys_are_the_same_in_another_process():
    """Addresses and hash seeds are no part of them."""
    script = textwrap.dedent("""
        import json, sys
        sys.path[:0] = ["tests/studies", "tests/support"]
        from test_loop_record_objects import WAYS, facts
        print(json.dumps({name: facts(name, 1.0)["blocks"] for name in WAYS}))
    """)
    told = [
        subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT,
            env={**__import__("os").environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    ]  # fmt: skip
    assert told[0] == told[1]


UNSEEN = {
    "random generator": ("g = np.random.default_rng(1)\ndef f(v): return g.normal()", "random generator"),
    "random state": ("g = np.random.RandomState(1)\ndef f(v): return g.rand()", "random generator"),
    "eval": ("def f(v): return eval('v * K')\nK = 1.0", "what 'eval' finds"),
    "exec": ("def f(v):\n    exec('K = 1')\n    return v", "what 'exec' finds"),
    "globals by a computed text": ("K = 1.0\ndef f(v): return globals()[chr(75)]", "what 'globals' finds"),
    "open": ("def f(v):\n    with open('x') as file:\n        return float(file.read())", "files"),
    "read_csv": ("def f(v): return pd.read_csv('x').iloc[0, 0]", "files that are read"),
    "loadtxt": ("def f(v): return np.loadtxt('x')[0]", "files that are read"),
    "generator": ("g = (k for k in [1.0])\ndef f(v): return next(g)", "generator"),
    "frompyfunc": ("g = np.frompyfunc(lambda v: v, 1, 1)\ndef f(v): return g(v)", "compiled function"),
    "ctypes": ("import ctypes\ng = ctypes.CDLL(None).abs\ndef f(v): return g(1)", "object of ctypes"),
    "numpy.load": ("def f(v): return np.load('x')[0]", "files when it is called"),
    "numpy.random": ("def f(v): return np.random.rand()", "chance when it is called"),
    "random": ("import random\ndef f(v): return random.random()", "chance when it is called"),
    "bound random": ("from random import gauss\ndef f(v): return gauss(0, 1)", "random generator"),
    "a module in a closure": ("def make():\n    import time as clock\n    return lambda v: clock.monotonic()\nf = make()", "the time when it is called"),
    "a function of a clock": ("from time import perf_counter\ndef f(v): return perf_counter()", "the time when it is called"),
    "other programs": ("import subprocess\ndef f(v): return float(subprocess.check_output(['echo', '1']))", "other programs"),
    "its frame": ("import sys\nK = 1.0\ndef f(v): return sys._getframe().f_globals['K']", "what '_getframe' finds"),
    "its globals": ("K = 1.0\ndef f(v): return f.__globals__['K']", "what '__globals__' finds"),
    "its annotations": ("def h(a: 1.0): pass\ndef f(v): return h.__annotations__['a']", "what '__annotations__' finds"),
    "a late import": ("def f(v):\n    from no_such_module_of_a_test import K\n    return K * v", "what it imports when it is called"),
    "in an own class": ("class C:\n    g = np.random.default_rng(1)\n    def __call__(self, v): return self.g.normal()\nf = C()", "random generator"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNSEEN)
def test_what_cannot_be_seen_is_named(name):
    """By block, in words."""
    text, words = UNSEEN[name]
    (told,) = unseen_parts(source_text.run(HEAD + text + TAIL)["loop"]()).values()
    assert any(words in one for one in told), told


@pytest.mark.parametrize("make", [nlctl.paper.example_1, nlctl.paper.example_2])
def test_nothing_is_unseen_in_the_examples(make):
    """Of nlctl's own blocks, and of python-control's."""
    assert unseen_parts(make()) == {}
    assert unseen_parts(ct.tf2ss([1.0], [1.0, 1.0])) == {}

"""What a compiled diagram reads is changed in place: it is refused, or followed, never stale.

Each change is one that python-control sees: its next run computes the new loop.
"""

import collections
import functools
import importlib
import sys
import types
from dataclasses import dataclass, field

import control as ct
import numpy as np
import pytest
import scipy.constants
import source_text
from scipy import interpolate

import nlctl

T = np.linspace(0.0, 1.0, 11)


def system(function, output=None, **params):
    return ct.nlsys(
        function, output, inputs=1, outputs=1, states=1, name="s", params=params or None
    )


def helper(x, k=2.0):
    return -k * x


def faster(x, k=2.0):
    return -3.0 * k * x


class Plant:
    """An object that computes with methods, a property, and what it holds."""

    gain = 2.0

    def __init__(self):
        self.held = {"k": [2.0]}

    def rate(self, x):
        return -self.factor() * x

    def factor(self):
        return self.gain

    @property
    def slope(self):
        return 2.0

    @staticmethod
    def bent(x):
        return -2.0 * x

    @classmethod
    def of_class(cls, x):
        return -cls.gain * x

    def __call__(self, t, x, u, p):
        return [self.rate(x[0])]


class Steeper(Plant):
    """One that asks its base class."""

    def factor(self):
        return super().factor() * 1.0


@dataclass
class Held:
    """Parameters in an object."""

    k: float = 2.0
    more: dict = field(default_factory=lambda: {"k": 2.0})


def changed_code():
    def own(t, x, u, p):
        return [-2.0 * x[0]]

    made = system(own)
    return made, lambda: setattr(own, "__code__", (lambda t, x, u, p: [-9.0 * x[0]]).__code__)


def changed_code_of_helper():
    def own(x):
        return -2.0 * x

    def other(x):
        return -9.0 * x

    return (system(lambda t, x, u, p: [own(x[0])]),
            lambda: setattr(own, "__code__", other.__code__))  # fmt: skip


def changed_code_behind_two_helpers():
    def innermost(x):
        return -2.0 * x

    def middle(x):
        return innermost(x)

    def replaced(x):
        return -9.0 * x

    return (system(lambda t, x, u, p: [middle(x[0])]),
            lambda: setattr(innermost, "__code__", replaced.__code__))  # fmt: skip


def changed_code_of_output():
    def output(t, x, u, p):
        return [2.0 * x[0]]

    other = (lambda t, x, u, p: [5.0 * x[0]]).__code__
    return system(lambda t, x, u, p: [-x[0]], output), lambda: setattr(output, "__code__", other)


def changed_defaults():
    def own(x, k=2.0):
        return -k * x

    return (system(lambda t, x, u, p: [own(x[0])]), lambda: setattr(own, "__defaults__", (9.0,)))


def changed_default_in_place():
    def own(x, k=[2.0]):  # noqa: B006 (that is the case)
        return -k[0] * x

    return system(lambda t, x, u, p: [own(x[0])]), lambda: own.__defaults__[0].__setitem__(0, 9.0)


def changed_keyword_defaults():
    def own(x, *, k=2.0):
        return -k * x

    return (system(lambda t, x, u, p: [own(x[0])]), lambda: own.__kwdefaults__.update(k=9.0))


def changed_keywords_of_partial():
    own = functools.partial(lambda t, x, u, p, k: [-k * x[0]], k=2.0)
    return system(own), lambda: own.keywords.update(k=9.0)


def changed_keywords_of_inner_partial():
    own = functools.partial(lambda x, k: -k * x, k=2.0)
    return system(lambda t, x, u, p: [own(x[0])]), lambda: own.keywords.update(k=9.0)


def changed_arguments_of_partial():
    own = functools.partial(lambda k, t, x, u, p: [-k[0] * x[0]], [2.0])
    return system(own), lambda: own.args[0].__setitem__(0, 9.0)


def changed_function_of_partial():
    own = functools.partial(helper, k=2.0)

    def change():
        own.__setstate__((faster, (), {"k": 2.0}, None))

    return system(lambda t, x, u, p: [own(x[0])]), change


def changed_method_of_class(patch):
    plant = Plant()
    made = system(lambda t, x, u, p: [plant.rate(x[0])])
    return made, lambda: patch.setattr(Plant, "factor", lambda self: 9.0)


def changed_method_of_object(patch):
    plant = Plant()
    return (system(lambda t, x, u, p: [plant.rate(x[0])]),
            lambda: setattr(plant, "rate", lambda x: -9.0 * x))  # fmt: skip


def changed_method_of_base(patch):
    plant = Steeper()
    made = system(lambda t, x, u, p: [plant.rate(x[0])])
    return made, lambda: patch.setattr(Plant, "factor", lambda self: 9.0)


def changed_code_of_method(patch):
    plant = Plant()
    made = system(lambda t, x, u, p: [plant.rate(x[0])])
    return made, lambda: patch.setattr(Plant.factor, "__code__", (lambda self: 9.0).__code__)


def changed_property(patch):
    plant = Plant()
    made = system(lambda t, x, u, p: [-plant.slope * x[0]])
    return made, lambda: patch.setattr(Plant, "slope", property(lambda self: 9.0))


def changed_static_method(patch):
    plant = Plant()
    made = system(lambda t, x, u, p: [plant.bent(x[0])])
    return made, lambda: patch.setattr(Plant, "bent", staticmethod(lambda x: -9.0 * x))


def changed_class_method(patch):
    plant = Plant()
    made = system(lambda t, x, u, p: [plant.of_class(x[0])])
    return made, lambda: patch.setattr(Plant, "gain", 9.0)


def changed_call(patch):
    made = system(Plant())
    return made, lambda: patch.setattr(Plant, "__call__", lambda self, t, x, u, p: [-9.0 * x[0]])


def changed_attribute_in_place(patch):
    plant = Plant()
    made = system(lambda t, x, u, p: [-plant.held["k"][0] * x[0]])
    return made, lambda: plant.held["k"].__setitem__(0, 9.0)


def changed_dict_parameter():
    made = system(lambda t, x, u, p: [-p["c"]["k"] * x[0]], c={"k": 2.0})
    return made, lambda: made.params["c"].update(k=9.0)


def changed_nested_parameter():
    made = system(lambda t, x, u, p: [-p["c"]["a"][1]["k"] * x[0]], c={"a": [0, {"k": 2.0}]})
    return made, lambda: made.params["c"]["a"][1].update(k=9.0)


def changed_list_parameter():
    made = system(lambda t, x, u, p: [-p["c"][0][1] * x[0]], c=[("k", 2.0)])
    return made, lambda: made.params["c"].__setitem__(0, ("k", 9.0))


def changed_object_parameter():
    made = system(lambda t, x, u, p: [-p["c"].k * x[0]], c=Held())
    return made, lambda: setattr(made.params["c"], "k", 9.0)


def changed_dict_in_an_object_parameter():
    made = system(lambda t, x, u, p: [-p["c"].more["k"] * x[0]], c=Held())
    return made, lambda: made.params["c"].more.update(k=9.0)


def changed_ordered_dict():
    own = collections.OrderedDict(k=2.0)
    return system(lambda t, x, u, p: [-own["k"] * x[0]]), lambda: own.update(k=9.0)


def changed_default_dict():
    own = collections.defaultdict(float, k=2.0)
    return system(lambda t, x, u, p: [-own["k"] * x[0]]), lambda: own.update(k=9.0)


def changed_namespace():
    own = types.SimpleNamespace(k=2.0)
    return system(lambda t, x, u, p: [-own.k * x[0]]), lambda: setattr(own, "k", 9.0)


def changed_matrix():
    own = np.array([[2.0]]).view(np.matrix)
    return system(lambda t, x, u, p: [-own[0, 0] * x[0]]), lambda: own.__setitem__((0, 0), 9.0)


def changed_set():
    own = {2.0}
    return system(lambda t, x, u, p: [-max(own) * x[0]]), lambda: own.add(9.0)


def changed_wrapped():
    def inner(x):
        return -2.0 * x

    @functools.wraps(inner)
    def outer(x):
        return inner(x)

    return (system(lambda t, x, u, p: [outer(x[0])]),
            lambda: setattr(inner, "__code__", (lambda x: -9.0 * x).__code__))  # fmt: skip


def changed_cached():
    @functools.lru_cache
    def gain():
        return table["k"]

    table = {"k": 2.0}

    def change():
        table.update(k=9.0)
        gain.cache_clear()

    return system(lambda t, x, u, p: [-gain() * x[0]]), change


def changed_builtin(monkeypatch):
    import builtins

    made = system(lambda t, x, u, p: [-pow(x[0], 3)])
    return made, lambda: monkeypatch.setattr(builtins, "pow", lambda v, k: 5.0)


def changed_module_of_an_import(monkeypatch):
    def update(t, x, u, p):
        import math

        return [-math.cosh(x[0])]

    other = types.SimpleNamespace(__name__="math", cosh=lambda v: 3.0)
    return system(update), lambda: monkeypatch.setitem(sys.modules, "math", other)


class Kept:
    """An object whose gain is computed once, or assigned."""

    gain = functools.cached_property(lambda self: 2.0)


def changed_cached_property_of_its_own():
    thing = Kept()
    return system(lambda t, x, u, p: [-thing.gain * x[0]]), lambda: setattr(thing, "gain", 9.0)


def changed_coefficients():
    law = np.poly1d([2.0, 0.5])
    return system(lambda t, x, u, p: -law(x)), lambda: law.coeffs.__setitem__(0, 9.0)


def changed_content_of_a_spline():
    laws = {"drag": [interpolate.CubicSpline([0.0, 1.0, 2.0], [0.0, 1.0, 4.0])]}
    change = lambda: laws["drag"][0].c.__setitem__((2, 0), 9.0)  # noqa: E731
    return system(lambda t, x, u, p: -laws["drag"][0](x)), change


def changed_content_of_a_table():
    table = interpolate.RegularGridInterpolator(([0.0, 2.0], [0.0, 1.0]), np.eye(2))
    change = lambda: table.values.__setitem__((1, 1), 9.0)  # noqa: E731
    return system(lambda t, x, u, p: -table((abs(x[0]), 0.5))), change


def changed_through_a_view_of_a_dict():
    content = {"k": 2.0}
    view = types.MappingProxyType(content)
    return system(lambda t, x, u, p: [-view["k"] * x[0]]), lambda: content.update(k=9.0)


class Otherwise(dict):
    """A dict with a value for keys that it does not have."""

    gain = 2.0

    def __missing__(self, key):
        return self.gain


def changed_value_of_missing_keys(monkeypatch):
    table = Otherwise()
    change = lambda: monkeypatch.setattr(Otherwise, "gain", 9.0)  # noqa: E731
    return system(lambda t, x, u, p: [-table["k"] * x[0]]), change


def changed_record_of_a_block():
    made = nlctl.block(nlctl.Lag(T=0.5), "lag")
    loop = nlctl.interconnect([made], inputs=["u"], outputs=["v"])
    return loop, lambda: setattr(loop.params, "x", None) or loop.params.update({"lag.T": 0.1})


def changed_system_in_a_diagram():
    own = system(lambda t, x, u, p: [-2.0 * x[0]])
    loop = ct.interconnect([own], inplist=["s.u[0]"], outlist=["s.y[0]"])
    return loop, lambda: setattr(own, "updfcn", lambda t, x, u, p: [-9.0 * x[0]])


def changed_part_of_a_diagram():
    own = system(lambda t, x, u, p: [-2.0 * x[0]])
    loop = ct.interconnect([own], inplist=["s.u[0]"], outlist=["s.y[0]"])
    return loop, lambda: loop.syslist.__setitem__(0, system(lambda t, x, u, p: [-9.0 * x[0]]))


def changed_builtin_that_the_module_names():
    """A name that was Python's becomes the module's."""
    module = source_text.run("def rate(t, x, u, p):\n    return [-2.0 * abs(x[0])]\n")
    return system(module["rate"]), lambda: module.update(abs=lambda v: 4.5 * v)


OF_NUMBA = """
import numpy as np

ZERO, K = np.float32(0.0), 2.0  # single precision is not written out: numba takes the function

def helper(x):
    return -K * x

def rate(t, x, u, p):
    return [helper(x[0]) + ZERO]
"""


def changed_constant_of_a_helper_in_machine_code():
    """numba keeps the machine code of a function with what its constants were at first."""
    module = source_text.run(OF_NUMBA)
    return system(module["rate"]), lambda: module.update(K=9.0)


def changed_number_of_a_library(monkeypatch):
    """In machine code as well, which a new compilation finds on disk."""
    monkeypatch.setattr(scipy.constants, "g", 2.0)
    text = "from scipy import constants\n" + OF_NUMBA.replace("-K", "-constants.g")
    rate = source_text.run(text)["rate"]
    return system(rate), lambda: monkeypatch.setattr(scipy.constants, "g", 9.0)


CHANGES = [value for name, value in sorted(globals().items()) if name.startswith("changed_")]


def response(made):
    with np.errstate(all="ignore"):
        return nlctl.input_output_response(made, T, 0.0, 1.0, rtol=1e-9).outputs[..., -1]


@pytest.mark.parametrize("case", CHANGES, ids=lambda case: case.__name__.removeprefix("changed_"))
@pytest.mark.filterwarnings("ignore::nlctl.errors.EngineWarning")
def test_what_is_changed_in_place_is_refused_or_followed(case, monkeypatch):
    made, change = case(monkeypatch) if case.__code__.co_argcount else case()
    compiled = nlctl.compile(made)
    before = response(compiled)
    np.testing.assert_array_equal(response(compiled), before)  # nothing has changed yet
    change()
    tight = {"rtol": 1e-9, "atol": 1e-12}
    theirs = ct.input_output_response(made, T, 0.0, 1.0, solve_ivp_kwargs=tight)
    after = np.reshape(theirs.outputs, (-1, T.size))[:, -1]
    assert np.abs(after - before).max() > 1e-3  # python-control computes another loop
    try:
        np.testing.assert_allclose(np.reshape(response(compiled), -1), after, rtol=1e-6)
    except nlctl.errors.UsageError:
        with pytest.raises(nlctl.errors.UsageError, match="compile again"):
            response(compiled)
    fresh = response(nlctl.compile(made))
    np.testing.assert_allclose(np.reshape(fresh, -1), after, rtol=1e-6)


def test_a_function_that_was_reloaded_unchanged_is_the_same(tmp_path, monkeypatch):
    """Reloading a file in which another function changed gives equal code."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "reloaded_law.py").write_text("def law(x):\n    return -2.0 * x\n")
    module = importlib.import_module("reloaded_law")
    law = module.law
    compiled = nlctl.compile(system(lambda t, x, u, p: [law(x[0])]))
    before = response(compiled)
    importlib.reload(module)
    law.__code__ = module.law.__code__  # as IPython's autoreload does
    assert response(compiled) == before


def test_the_message_names_what_was_changed():
    made, change = changed_defaults()
    compiled = nlctl.compile(made)
    change()
    with pytest.raises(
        nlctl.errors.UsageError, match=r"own\.__defaults__' was \(2\.0,\) when 's' was"
    ):
        response(compiled)

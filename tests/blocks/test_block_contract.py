"""One contract for every block record of the public modules, and for the making of blocks."""

import dataclasses
import inspect
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from rows import each_row

import nlctl
from nlctl.analysis.catalogue import block_records
from nlctl.params import declared_params, equation_arguments


@nlctl.equation
def force(x, v):
    x1, x2, x3 = x
    return np.sin(x1) - x2 * x3 + v


@nlctl.equation
def disturbance(x, t):
    return x[0] * np.cos(t)


@nlctl.equation
def ramp(t):
    return 0.1 * t, 0.1, 0.0


NEEDED = {
    "PureFeedback": {"order": 3, "f": force, "d": disturbance},
    "FunctionReference": {"order": 2, "function": ramp},
    "Zero": {"outputs": ("W_psi", "W_norm")},
    "Pulse": {"width": 0.65},  # it ends before the second of TIMES
    "PulseTrain": {"width": 0.65},
    "Square": {"duty": 0.65},
    "HistoryStack": {"nodes": 3, "novelty": 1.5},  # points at random are that far apart
}


def records():
    """Return an example of every public record class that has inputs and outputs."""
    found = {name: cls(**NEEDED.get(name, {})) for name, cls in block_records().items()}
    return {name: spec for name, spec in found.items() if hasattr(spec, "outputs")}


RECORDS = records()
TIMES = (0.0, 0.7, 12.3)
PRESENT = {  # others' outputs follow from a run or from a whole diagram: they have tests of theirs
    name: spec for name, spec in RECORDS.items() if getattr(spec, "supplied", None) is None
}
every_record = pytest.mark.parametrize("spec", RECORDS.values(), ids=RECORDS)
every_function = pytest.mark.parametrize("spec", PRESENT.values(), ids=PRESENT)
EQUATIONS = ("output", "update")


def points(spec, seed=1, count=8):
    """Yield (t, x, u) at random, and with every input at every number that may be a corner."""
    rng, n, m = np.random.default_rng(seed), len(spec.states), len(spec.inputs)
    for i in range(count):
        yield TIMES[i % 3], rng.normal(size=n), 2 * rng.normal(size=m)
    scalars = [v for k in declared_params(spec) if np.ndim(v := getattr(spec, k)) == 0]
    for corner in 2 * (0.0, *scalars):  # with one state and another: memories count there
        yield 0.7, rng.normal(size=n), np.full(m, float(corner))
        for i in range(m if 1 < m <= 4 else 0):  # and each input alone, while others are at rest
            yield 0.7, rng.normal(size=n), np.where(np.arange(m) == i, float(corner), 0.0)


def call(function, spec, t, x, u, p=None):
    """Call an equation as compiled code does: tuples, or arrays where the record wants them."""
    if not getattr(spec, "vector", False):
        x, u = tuple(map(float, x)), tuple(map(float, u))
    result = function(t, x, u, equation_arguments(spec) if p is None else p)
    return np.array(result, dtype=float).reshape(-1)


def made(spec):
    """The block; of a program in discrete time, with any sampling time."""
    return nlctl.block(spec, "b", **({"dt": True} if getattr(spec, "discrete", False) else {}))


def equations(spec):
    return [getattr(spec, name) for name in EQUATIONS if spec.states or name == "output"]


def everything(block, t, x, u, params=None):
    """Return all that a block computes at a point, through python-control or compiled."""
    parts = [block.output(t, x, u, params=params)]
    return np.concatenate([*parts, *([block.dynamics(t, x, u, params=params)] if x.size else [])])


def other_values(spec, name):
    """Yield other values of a parameter, likely to be valid."""
    value = getattr(spec, name)
    if isinstance(value, bool | int):
        yield not value if isinstance(value, bool) else value + 1
        return
    for change in (lambda v: 1.25 * v, lambda v: v + 0.1, lambda v: v - 0.1):
        new = change(np.array(value))
        if not np.array_equal(new, value):
            yield new


def test_every_block_can_be_reached_from_nlctl():
    """`nlctl/__init__.pyi` lists it or its room, for editors, the reference and its examples."""
    rooms = [getattr(nlctl, name) for name in nlctl.__all__]
    named = {name for room in rooms if inspect.ismodule(room) for name in room.__all__}
    assert [name for name in block_records() if name not in {*named, *nlctl.__all__}] == []


def test_the_contract_covers_the_blocks_that_exist():
    """The walk through the modules finds blocks of every kind."""
    assert {"Genesio", "DeadZone", "SumOfSines", "NussbaumLaw", *NEEDED} <= set(PRESENT)
    assert set(RECORDS) - set(PRESENT) == {"IdealRelay", "TransportDelay"}


@every_record
class TestEveryRecord:
    def test_every_parameter_has_unit_and_meaning(self, spec):
        """They are what tables and reports show."""
        assert all(p.unit.strip() and p.meaning.strip() for p in declared_params(spec).values())
        assert len((type(spec).__doc__ or "").splitlines()) > 2

    def test_a_value_out_of_range_is_refused_by_name(self, spec):
        """Every bound of every parameter, and NaN: the message names record and parameter."""
        for name, rule in declared_params(spec).items():
            value = getattr(spec, name)
            limits = [b for b in (rule.above, rule.below) if b is not None]
            limits += [rule.at_least - 1] if rule.at_least is not None else []
            limits += [rule.at_most + 1] if rule.at_most is not None else []
            if not isinstance(value, bool):
                limits.append(np.nan)
            for bad in limits:
                with pytest.raises(
                    nlctl.errors.ParameterError, match=rf"^{type(spec).__name__} needs .*\b{name}\b"
                ):
                    dataclasses.replace(spec, **{name: np.full(np.shape(value), bad)[()]})

    def test_its_repr_lists_every_parameter(self, spec):
        """Name and unit of each in one line of text, and in one row of HTML."""
        block = made(spec)
        lines, html = repr(block).splitlines(), block._repr_html_()
        assert type(spec).__name__ in lines[0]
        assert "'b'" in lines[0]
        for name, rule in declared_params(spec).items():
            assert any(re.match(rf"\s+{name}\s.*\s{re.escape(rule.unit)}\s", s) for s in lines)
            assert re.search(rf"<td>{name}</td><td>[^<]+</td><td>{re.escape(rule.unit)}</td>", html)


@every_function
class TestEveryFunctionOfThePresent:
    def test_it_works_from_its_defaults(self, spec):
        """Finite values, as many as declared, from the initial state and zero inputs."""
        block = made(spec)
        x = nlctl.initial_state(block)
        assert x.shape == (len(spec.states),)
        result = everything(block, 0.0, x, np.zeros(len(spec.inputs)))
        assert result.size == len(spec.outputs) + len(spec.states)
        assert np.isfinite(result).all()
        labels = block.input_labels, block.output_labels, block.state_labels
        assert labels == (list(spec.inputs), list(spec.outputs), list(spec.states))

    def test_compiled_equals_python(self, spec):
        """Machine code and Python agree to a few ulp, at corners and with NaN as well."""
        block = made(spec)
        compiled = nlctl.compile(block)
        nan = [(0.7, np.full(len(spec.states), np.nan), np.full(len(spec.inputs), np.nan))]
        for t, x, u in [*points(spec), *nan]:
            expected, got = everything(block, t, x, u), everything(compiled, t, x, u)
            scale = max([1.0, *np.abs(expected[np.isfinite(expected)])])
            np.testing.assert_allclose(got, expected, rtol=1e-15, atol=8e-16 * scale)

    def test_python_control_computes_the_same(self, spec):
        """A block hands arrays to the equations; that makes no difference."""
        block = made(spec)
        for t, x, u in points(spec):
            direct = np.concatenate([call(f, spec, t, x, u) for f in equations(spec)])
            np.testing.assert_array_equal(everything(block, t, x, u), direct)

    def test_nan_in_gives_nan_out(self, spec):
        """Whatever depends on a state or input turns NaN with it: a lost run never looks calm."""
        n = len(spec.states)
        for function in equations(spec):
            for t, x, u in points(spec, count=2):
                z = np.concatenate([x, u])
                base = call(function, spec, t, x, u)
                for i in range(z.size):
                    results = []
                    for value in (z[i] + 0.5, z[i] - 2.0, np.nan):
                        moved = z.copy()
                        moved[i] = value
                        results.append(call(function, spec, t, moved[:n], moved[n:]))
                    depends = (results[0] != base) | (results[1] != base)
                    assert np.isnan(results[2][depends]).all()

    def test_arguments_are_not_changed(self, spec):
        """States and inputs may be read-only, and the result is not a view of them."""
        p = equation_arguments(spec)
        for function in equations(spec):
            for t, x, u in points(spec, count=2):
                x.flags.writeable = u.flags.writeable = False
                result = function(t, x, u, p)
                assert not any(np.shares_memory(np.asarray(result), given) for given in (x, u))
                np.testing.assert_array_equal(result, function(t, x, u, p))  # nothing is kept

    def test_an_override_reaches_the_equation(self, spec):
        """A run with an override equals a run of the record made with that value."""
        block = made(spec)
        for name in declared_params(spec):
            moved = False
            for value in other_values(spec, name):
                try:
                    changed = dataclasses.replace(spec, **{name: value})
                except nlctl.errors.ParameterError:
                    continue
                fresh = made(changed)
                starts = [nlctl.initial_state(b) for b in (block, fresh)]
                moved |= not np.array_equal(*starts)
                for t, x, u in points(spec):
                    result = everything(block, t, x, u, params={f"b.{name}": value})
                    np.testing.assert_array_equal(result, everything(fresh, t, x, u))
                    moved |= not np.array_equal(result, everything(block, t, x, u))
            assert moved, f"{name} changes nothing"

    def test_feedthrough_is_declared_truly(self, spec):
        """An output depends on an input at some point exactly when the record says so."""
        rng, depends = np.random.default_rng(3), False
        for t, x, u in points(spec):
            moved = call(spec.output, spec, t, x, u + rng.normal(size=u.size))
            depends |= not np.array_equal(moved, call(spec.output, spec, t, x, u))
        assert depends == spec.feedthrough


class Tags(HTMLParser):
    """Collects the tags and the text of a page."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.text = set(), ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.add((tag, *attrs))

    def handle_data(self, data):
        self.text += data


def test_html_shows_hostile_text_as_text():
    """Names, units and meanings cannot smuggle markup into a notebook."""
    evil = "<img src=x onerror=alert(1)>&amp;<script>"

    @nlctl.record
    class Hostile:
        k: float = nlctl.param(1.0, unit=evil, meaning=evil)
        inputs, outputs, states, feedthrough = ("u",), ("y",), (), True

        @staticmethod
        def output(t, x, u, p):
            return (p.k * u[0],)

    page = Tags(nlctl.block(Hostile(), evil)._repr_html_())
    assert page.tags <= {("p",), ("table",), ("tr",), ("th",), ("td",)}
    assert page.text.count(evil) == 3


def liar(**changes):
    """Return a record of a class that declares one input, one output and one state."""
    body = {
        "inputs": ("u",),
        "outputs": ("y",),
        "states": ("x",),
        "feedthrough": False,
        "update": staticmethod(lambda t, x, u, p: (u[0],)),
        "output": staticmethod(lambda t, x, u, p: (x[0],)),
    } | changes
    return nlctl.record(type("Liar", (), {k: v for k, v in body.items() if v is not None}))()


def test_what_goes_without_saying():
    """Equations of a record are static; without an update there are no states."""
    record = liar(feedthrough=None, states=None, update=None, output=squared)
    assert (record.feedthrough, record.states) == (True, ())
    assert nlctl.block(record, "b").output(0, [], [3.0]) == 9.0


@nlctl.equation
def squared(t, x, u, p):
    """The square of the input."""
    return (u[0] ** 2,)


@each_row(
    ("changes", "told"),
    [
        ({"output": staticmethod(lambda t, x, u, p: (x[0] + 0 * u[0],))}, "'y' depends on the in"),
        ({"output": staticmethod(lambda t, x, u, p: (u[0] > 0,))}, "'y' depends on the input"),
        ({"outputs": ("y", "z")}, "returns 1 value from output, needs 2: y, z"),
        ({"states": ("x", "w")}, "returns 1 value from update, needs 2: x, w"),
        ({"update": staticmethod(lambda t, x, u, p: (u[0], 0.0))}, "returns 2 values from update"),
        ({"outputs": None}, "is not a block: it lacks outputs"),
        ({"inputs": None, "output": None}, "is not a block: it lacks inputs, output"),
        ({"update": None}, "is not a block: it lacks update"),
        ({"output": None}, "is not a block: it lacks output"),
    ],
)
def test_a_record_that_lies_is_refused(changes, told):
    """Missing attributes, wrong sizes, untrue feedthrough: a TypeError names the record."""
    nlctl.block(liar(), "honest")
    undefined = staticmethod(lambda t, x, u, p: (np.log(x[0] - 1.0),))  # NaN at x = 0, honestly
    nlctl.block(liar(output=undefined), "honest")
    with pytest.raises(TypeError, match=rf"^Liar .*{re.escape(told)}"):
        nlctl.block(liar(**changes), "b")

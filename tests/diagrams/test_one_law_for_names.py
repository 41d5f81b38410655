"""One law for names: "P.k" is block P's own k in every entry point, whoever wrote the block."""

import copy
import functools
import pickle
import threading

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl
from nlctl.analysis.robustness import Space, Uncertain, resolved
from nlctl.diagrams import leaves
from nlctl.errors import AmbiguousNameError, ParameterError, UnknownNameError
from nlctl.upstream.control_internals import current_parameters

T = np.linspace(0.0, 1.0, 11)


def relax(t, x, u, p):
    return [(u[0] - x[0]) / p["tau"]]


def lag(name, tau, u="u", y=None):
    return ct.nlsys(relax, None, inputs=[u], outputs=[y or f"y_{name}"], states=1, name=name,
                    params={"tau": tau})  # fmt: skip


def hidden(name, u="u"):
    """A block that reads a parameter that it does not declare."""
    return ct.nlsys(None, lambda t, x, u, p: p.get("gain", 2.0) * u, inputs=[u],
                    outputs=[f"y_{name}"], name=name)  # fmt: skip


def two(join=nlctl.interconnect, **more):
    parts = [lag("fast", 0.1), lag("slow", 10.0)]
    return join(parts, inputs=["u"], outputs=["y_fast", "y_slow"], name="two", **more)


def end(tau):
    return 1.0 - np.exp(-1.0 / tau)


RUNS = {
    "machine code": lambda d, p: nlctl.input_output_response(d, T, 1.0, params=p, rtol=1e-9),
    "compiled": lambda d, p: nlctl.input_output_response(nlctl.compile(d), T, 1.0, params=p,
                                                         rtol=1e-9),
    "python-control": lambda d, p: nlctl.input_output_response(
        d, T, 1.0, params=p, engine="python-control", rtol=1e-9),
}  # fmt: skip
runs = pytest.mark.parametrize("run", RUNS.values(), ids=RUNS)
WIRES = {
    "nlctl": two,
    "nlctl in nlctl": lambda: nlctl.interconnect([two()], inputs=["u"]),
    "control in nlctl": lambda: nlctl.interconnect(
        [ct.interconnect([lag("fast", 0.1)], inputs=["u"], outputs=["y_fast"], name="a"),
         ct.interconnect([lag("slow", 10.0)], inputs=["u"], outputs=["y_slow"], name="b")],
        inputs=["u"]),
    "with a block of nlctl": lambda: nlctl.interconnect(
        [lag("fast", 0.1), lag("slow", 10.0), nlctl.block(nlctl.Gain(), "gain")], inputs=["u"],
        outputs=["y_fast", "y_slow"]),
    "records and systems": lambda: nlctl.interconnect(
        {"fast": lag("any", 0.1, y="y_fast"), "slow": lag("other", 10.0, y="y_slow")},
        inputs=["u"]),
}  # fmt: skip
wires = pytest.mark.parametrize("wire", WIRES.values(), ids=WIRES)


@runs
@wires
def test_each_block_keeps_its_own_value(run, wire):
    """Two lags whose time constants have one name, and python-control's own simulation too."""
    loop = wire()
    np.testing.assert_allclose(run(loop, None).outputs[:2, -1], [end(0.1), end(10.0)], rtol=1e-6)
    theirs = ct.input_output_response(loop, T, 1.0, solve_ivp_kwargs={"rtol": 1e-9})
    np.testing.assert_allclose(theirs.outputs[:2, -1], [end(0.1), end(10.0)], rtol=1e-6)


@runs
@wires
def test_each_is_overridden_by_its_own_name(run, wire):
    loop = wire()
    for params, taus in (
        ({"fast.tau": 0.5}, (0.5, 10.0)),
        ({"slow.tau": 0.5}, (0.1, 0.5)),
        ({"slow.tau": 2.0, "fast.tau": 3.0}, (3.0, 2.0)),
        (None, (0.1, 10.0)),
    ):
        found = run(loop, params).outputs[:2, -1]
        np.testing.assert_allclose(found, [end(tau) for tau in taus], rtol=1e-6)


@runs
def test_in_python_controls_own_diagrams_too(run):
    """Blocks share a value there until one is named; a bare name means both."""
    loop = two(ct.interconnect)
    for params, taus in (
        (None, (10.0, 10.0)),
        ({"tau": 0.5}, (0.5, 0.5)),
        ({"fast.tau": 0.1}, (0.1, 10.0)),
        ({"tau": 0.5, "slow.tau": 2.0}, (0.5, 2.0)),
    ):
        found = run(loop, params).outputs[:, -1]
        np.testing.assert_allclose(found, [end(tau) for tau in taus], rtol=1e-6)


def test_a_block_alone_and_a_sampled_one_are_addressed_so():
    alone = nlctl.input_output_response(lag("fast", 0.1), T, 1.0, params={"fast.tau": 1.0})
    np.testing.assert_allclose(alone.outputs[-1], end(1.0), rtol=1e-6)

    def law(name, k):
        return ct.nlsys(None, lambda t, x, u, p: [p["k"] * u[0]], inputs=["u"],
                        outputs=[f"y_{name}"], name=name, params={"k": k}, dt=0.1)  # fmt: skip

    loop = nlctl.interconnect([nlctl.sampled(law("a", 2.0)), nlctl.sampled(law("b", 3.0))],
                              inputs=["u"])  # fmt: skip
    for engine in ("native", "python-control"):
        for params, found in ((None, [2, 3]), ({"b.k": 5.0}, [2, 5]), ({"a.k": 7.0}, [7, 3])):
            run = nlctl.input_output_response(loop, T, 1.0, params=params, engine=engine)
            assert run.outputs[:, -1].tolist() == found


@given(fast=st.floats(0.05, 5.0), slow=st.floats(0.05, 5.0))
@settings(max_examples=10, deadline=None)
def test_ensembles_studies_and_linearizations(fast, slow):
    """Members, quantities, and 1 / tau as minus the derivative of x'."""
    for loop in (two(), two(ct.interconnect)):
        many = nlctl.ensemble_response(
            loop, T, 1.0, params={"fast.tau": np.array([fast, 1.0]), "slow.tau": slow},
            keep=["y_fast", "y_slow"], rtol=1e-9,
        )  # fmt: skip
        np.testing.assert_allclose(many.signals["y_fast"][:, -1], [end(fast), end(1.0)], rtol=1e-6)
        np.testing.assert_allclose(many.signals["y_slow"][:, -1], 2 * [end(slow)], rtol=1e-6)
        linear = nlctl.linearize(loop, 0, params={"fast.tau": fast, "slow.tau": slow})
        np.testing.assert_allclose(np.diag(linear.A), [-1 / fast, -1 / slow], rtol=1e-12)
    space = Space(quantities=(Uncertain(name="fast.tau", bounds=(0.01, 10.0)),))
    assert resolved(space, two()).quantities[0].nominal == 0.1
    assert nlctl.parameters(two())["value"].to_dict() == {"fast.tau": 0.1, "slow.tau": 10.0}


def test_a_name_without_a_block_must_mean_one():
    """Where each block has its own value; the only one of that name is meant by it."""
    for run in RUNS.values():
        with pytest.raises(AmbiguousNameError, match=r"'tau' could be fast\.tau or slow\.tau"):
            run(two(), {"tau": 1.0})
        one = nlctl.interconnect([lag("fast", 0.1)], inputs=["u"])
        np.testing.assert_allclose(run(one, {"tau": 1.0}).outputs[-1], end(1.0), rtol=1e-6)


ENTRIES = {
    "run": lambda d, p: nlctl.input_output_response(d, T, 1.0, params=p),
    "engine": lambda d, p: nlctl.input_output_response(d, T, 1.0, params=p,
                                                       engine="python-control"),
    "compiled run": lambda d, p: nlctl.input_output_response(nlctl.compile(d), T, 1.0, params=p),
    "ensemble": lambda d, p: nlctl.ensemble_response(d, T, 1.0, params=p),
    "compile": lambda d, p: nlctl.compile(d, params=p),
    "linearize": lambda d, p: nlctl.linearize(d, 0, params=p),
    "output": lambda d, p: nlctl.compile(d).output(0.0, np.zeros(d.nstates or 0), [1.0], p),
    "typeset": lambda d, p: nlctl.typeset(d, params=p),
}  # fmt: skip
DIAGRAMS = {
    "a block": lambda: lag("slow", 1.0),
    "nlctl": two,
    "control": lambda: two(ct.interconnect),
    "linear": lambda: ct.ss(-1, 1, 1, 0, name="slow"),
    "undeclared": lambda: ct.interconnect([hidden("slow")], inputs=["u"], outputs=["y_slow"]),
    "one of nlctl": lambda: nlctl.block(nlctl.Lag(), "slow"),
}
WRONG = ["tua", "slow.tua", "slwo.tau", "tau.slow", "fast.slow.gain_2", "K"]


@pytest.mark.parametrize("enter", ENTRIES.values(), ids=ENTRIES)
@pytest.mark.parametrize("make", DIAGRAMS.values(), ids=DIAGRAMS)
@pytest.mark.parametrize("name", WRONG)
def test_a_name_that_nobody_reads_is_refused_everywhere(enter, make, name):
    with pytest.raises(UnknownNameError, match="unknown parameter"):
        enter(make(), {name: 1.0})


def test_the_nearest_name_is_given():
    with pytest.raises(UnknownNameError, match=r"nearest: .*'slow\.tau'"):
        ENTRIES["run"](two(), {"slow.tua": 1.0})
    with pytest.raises(UnknownNameError, match=r"nearest: 'slow\.tau'"):
        ENTRIES["run"](two(), {"Slow.TAU": 1.0})
    with pytest.raises(ParameterError, match=r"block 'slow' needs a number for tau.* got 'a'"):
        ENTRIES["run"](two(), {"slow.tau": "a"})
    with pytest.raises(ParameterError, match="names of parameters, got 1"):
        ENTRIES["run"](two(), {1: 2.0})


KEY = "by_global"


class Law:
    """An object that computes, and knows by an attribute what it reads."""

    def __init__(self):
        self.key = "by_attribute"

    def output(self, t, x, u, p):
        return helper(p, u) * p.get(self.key, 1.0)

    def __call__(self, t, x, u, p):
        return self.output(t, x, u, p)


def helper(p, u):
    return u * p.get("in_a_helper", 1.0)


def reads_by_default(t, x, u, p, key="by_default"):
    return u * p.get(key, 1.0)


def reads_by_number(t, x, u, p):
    return sum(p.get(f"k_{i}", 0.5) for i in range(2)) * u


READERS = {
    "in_a_helper": Law().output,
    "by_attribute": Law(),
    "by_default": reads_by_default,
    "by_global": lambda t, x, u, p: u * p.get(KEY, 1.0),
    "by_partial": functools.partial(lambda key, t, x, u, p: u * p.get(key, 1.0), "by_partial"),
    "k_1": reads_by_number,
    "of_all": lambda t, x, u, p: u * sum({"of_all": 1.0, **p}.values()),
    "last": lambda t, x, u, p: u * (p["last"] if t > 1e9 and "last" in p else 1.0),
}


@pytest.mark.parametrize("name", READERS)
def test_what_a_function_may_read_without_declaring_it_is_not_refused(name):
    """Where its text stands in code or data that it reaches, or it asks for it when called."""
    block = ct.nlsys(None, READERS[name], inputs=1, outputs=1, name="block")
    loop = ct.interconnect([block], inplist=["block.u[0]"], outlist=["block.y[0]"])
    factor = 1.0 if name == "last" else 1.5 / 1.0 if name == "k_1" else 1.0
    for params in ({name: 1.0}, {f"block.{name}": 1.0}):
        run = nlctl.input_output_response(loop, T, 1.0, params=params, engine="python-control")
        assert run.outputs[-1] == factor
    if name != "of_all":
        with pytest.raises(UnknownNameError):
            ENTRIES["engine"](loop, {"another": 1.0})


def test_the_blocks_of_others_are_left_as_they_are():
    """They belong to their owner, who may connect them by python-control again."""
    fast, slow = lag("fast", 0.1), lag("slow", 10.0)
    before = dict(vars(fast)), dict(vars(slow)), type(fast)
    loop = nlctl.interconnect([fast, slow], inputs=["u"])
    nlctl.input_output_response(loop, T, 1.0, params={"fast.tau": 1.0})
    assert (dict(vars(fast)), dict(vars(slow)), type(fast)) == before
    again = ct.interconnect([fast, slow], inputs=["u"], outputs=["y_fast", "y_slow"])
    assert again.params == {"tau": 10.0}


@pytest.mark.parametrize("again", [
    copy.copy, copy.deepcopy, lambda d: d.copy(name="new"),
    lambda d: pickle.loads(pickle.dumps(nlctl.compile(d))),
])  # fmt: skip
def test_copies_and_pickles_keep_the_law(again):
    found = RUNS["machine code"](again(two()), {"slow.tau": 1.0}).outputs[:, -1]
    np.testing.assert_allclose(found, [end(0.1), end(1.0)], rtol=1e-6)


def test_elements_of_arrays_have_names():
    block = ct.nlsys(None, lambda t, x, u, p: [p["w"][0] * u[0] + p["w"][1]], inputs=["u"],
                     outputs=["y"], name="block", params={"w": np.array([1.0, 2.0])})  # fmt: skip
    for join in (nlctl.interconnect, ct.interconnect):
        loop = join([block], inputs=["u"], outputs=["y"])
        for run in RUNS.values():
            assert run(loop, {"block.w[1]": 7.0}).outputs[-1] == 8.0
    assert block.params["w"].tolist() == [1.0, 2.0]


def parts_now(system):
    """Return what the equations of each block read now."""
    return [dict(current_parameters(leaf.system)) for leaf in leaves(system)]


@pytest.mark.parametrize("join", [nlctl.interconnect, ct.interconnect])
def test_a_run_writes_nothing_into_the_diagram(join):
    loop = two(join)
    ct.input_output_response(loop, T, 1.0)
    before = parts_now(loop)
    for enter in ENTRIES.values():
        enter(loop, {"fast.tau": 3.0})
    assert parts_now(loop) == before


def test_another_thread_runs_the_same_diagram_with_its_own_parameters():
    """python-control's run of the diagram is not disturbed by runs of nlctl's, of any engine."""
    loop = nlctl.interconnect({"gain": nlctl.Gain(k=2.0), "lag": lag("lag", 0.5, "v", "y")},
                              inputs=["u"], outputs=["y"])  # fmt: skip
    compiled, stop, wrong = nlctl.compile(loop), threading.Event(), []

    def others():
        while not stop.is_set():
            RUNS["machine code"](compiled, {"gain.k": 9.0, "lag.tau": 9.0})
            RUNS["python-control"](loop, {"gain.k": 5.0, "lag.tau": 5.0})

    thread = threading.Thread(target=others)
    thread.start()
    try:
        for _ in range(20):
            found = ct.input_output_response(loop, T, 1.0, solve_ivp_kwargs={"rtol": 1e-9})
            wrong += [y for y in found.outputs[-1:] if abs(y - 2 * end(0.5)) > 1e-6]
    finally:
        stop.set()
        thread.join()
    assert not wrong


@runs
def test_parameters_of_records_have_their_names_in_python_controls_diagrams(run):
    """Also where no diagram of nlctl's has a table of them; an unknown one is refused."""
    gain = nlctl.block(nlctl.Gain(k=2.0), "twice")
    loop = ct.interconnect([gain], inplist=["twice.u"], outlist=["twice.v"], inputs=["u"],
                           outputs=["v"], name="plain")  # fmt: skip
    assert np.ravel(run(loop, {}).outputs)[-1] == pytest.approx(2.0)
    assert np.ravel(run(loop, {"twice.k": 3.0}).outputs)[-1] == pytest.approx(3.0)
    with pytest.raises(UnknownNameError, match=r"nearest: 'twice\.k'"):
        run(loop, {"twice.kk": 3.0})

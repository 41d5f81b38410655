"""Functions that cannot be traced: machine code calls them as they stand, by numba or in Python."""

import ctypes
import importlib.util
import pickle
import threading
from collections import namedtuple

import control as ct
import numba
import numpy as np
import pytest
from numba.core import config
from numba.core.errors import NumbaError
from scipy.interpolate import CubicSpline, RegularGridInterpolator
from scipy.special import erfcx

import nlctl
from nlctl.errors import CompileError, UsageError
from nlctl.native.machine.calls import native_calls
from nlctl.native.opaque.called import Call

WITH_JIT = not getattr(config, "DISABLE_JIT", False)
needs_jit = pytest.mark.skipif(not WITH_JIT, reason="nothing is compiled without JIT")
GRID = np.linspace(-2.0, 2.0, 9)
SPLINE = CubicSpline(GRID, np.sin(GRID))
SURFACE = RegularGridInterpolator((GRID, GRID), np.outer(np.sin(GRID), np.cos(GRID)), "linear",
                                  bounds_error=False, fill_value=None)  # fmt: skip


def by_spline(t, x, u, params):
    return [-params["k"] * x[0] + SPLINE(x[1]), -x[1] + u[0]]


def by_surface(t, x, u, params):
    return np.array([float(SURFACE([x[0], x[1]])[0]) - params["k"] * x[0], u[0] - x[1]])


def by_while(t, x, u, params):
    slow = -params["k"] * x + t
    while slow[0] > 0.5:
        slow = slow - 0.1
    return slow * u[0]


def by_unbound(t, x, u, params):
    if x[0] < 1e9:
        gain = erfcx(params["k"])
    return -gain * x


FUNCTIONS = [by_spline, by_surface, by_while, by_unbound]


def plant(function, **more):
    return ct.nlsys(function, None, inputs=["u"], outputs=2, states=2, name="p",
                    params={"k": 1.5}, **more)  # fmt: skip


def loop(function):
    """The function with a lag that is traced in front of it."""
    lag = ct.tf([1], [0.3, 1], name="lag", inputs="r", outputs="f")
    return ct.interconnect([lag, plant(function)], [["p.u", "lag.f"], ["lag.r", "-p.y[0]"]],
                           inplist=["lag.r"], inputs=["r"], outlist=["p.y[0]", "p.y[1]"],
                           name="loop")  # fmt: skip


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("function", FUNCTIONS)
def test_runs_agree_with_python_control(function):
    """A run, audited at every point that an audit looks at."""
    times = np.linspace(0, 2, 21)
    given = {"params": {"k": 0.7}, "rtol": 1e-9, "atol": 1e-11}
    made, (inputs, start) = loop(function), (np.sin(times), [0.3, -0.4, 0.5])
    found = nlctl.input_output_response(made, times, inputs, start, engine="native",
                                        audit="every run", **given)  # fmt: skip
    wanted = nlctl.input_output_response(made, times, inputs, start, engine="python-control",
                                         **given)  # fmt: skip
    # SciPy's own error at the corners of a table and of the inputs
    np.testing.assert_allclose(found.states, wanted.states, rtol=2e-5, atol=2e-6)


@pytest.mark.slow
@pytest.mark.parametrize("function", FUNCTIONS)
def test_right_hand_sides_are_python_controls_own(function):
    """Bit for bit where the function is called in Python."""
    made, rng = plant(function), np.random.default_rng(2)
    compiled = nlctl.compile(made)
    for _ in range(5):
        t, x, u = rng.uniform(0, 2), rng.normal(size=2), rng.normal(size=1)
        found = compiled.dynamics(t, x, u, {"k": 2.5})
        np.testing.assert_allclose(found, made.dynamics(t, x, u, {"k": 2.5}), rtol=1e-15)


@pytest.mark.parted
@pytest.mark.slow
@needs_jit
@pytest.mark.parametrize("function", FUNCTIONS)
def test_members_do_not_depend_on_threads_or_on_each_other(function):
    """The same bits with one thread and with three, and alone."""
    compiled, times = nlctl.compile(loop(function)), np.linspace(0, 1, 5)
    k = np.linspace(0.5, 2.0, 19)
    given = {"keep": ["y[0]"], "initial_state": {"p.x[0]": 0.4}}
    every = [
        nlctl.ensemble_response(compiled, times, 0.3, params={"k": k}, threads=threads, **given)
        .signals["y[0]"]
        for threads in (1, 3)
    ]  # fmt: skip
    alone = nlctl.ensemble_response(compiled, times, 0.3, params={"k": k[11:12]}, **given)
    np.testing.assert_array_equal(every[0], every[1])
    np.testing.assert_array_equal(every[0][11:12], alone.signals["y[0]"])
    assert np.ptp(every[0][:, -1]) > 1e-4


def test_discrete_time():
    """x[k+1] by a spline."""
    made = plant(by_spline, dt=0.1)
    times = 0.1 * np.arange(30)
    found = nlctl.input_output_response(made, times, np.cos(times), [0.2, 0.1], engine="native")
    wanted = ct.input_output_response(made, times, np.cos(times), [0.2, 0.1])
    np.testing.assert_allclose(found.states, wanted.states, rtol=1e-14)


TYPES = {"count": 3, "flag": True, "rate": 2.5, "table": np.arange(6).reshape(2, 3),
         "row": [1.0, 2.0], "pair": (1, 2.5), "single": np.float32(0.5),
         "kind": "fast"}  # fmt: skip


def types_of(t, x, u, params):
    """Numbers that tell one type and shape from another; erfcx keeps it from being traced."""
    told = [type(t) == float, x.shape == (1,), u.shape == (2,), x.dtype == float]  # noqa: E721
    for name, value in params.items():
        told.append(type(value) == type(TYPES[name]))  # noqa: E721
        told.append(np.shape(value) == np.shape(TYPES[name]))
    told.append(params["table"].dtype == TYPES["table"].dtype)
    told.append([type(v) for v in params["pair"]] == [int, float])
    return [erfcx(0.0) * float(v) for v in told]


def test_arguments_are_those_of_python_control():
    """Types, shapes and the dict of parameters."""
    count = 4 + 2 * len(TYPES) + 2
    made = ct.nlsys(lambda t, x, u, params: -x, types_of, inputs=2, outputs=count, states=1,
                    name="types", params=TYPES)  # fmt: skip
    wanted = np.asarray(types_of(0.5, np.zeros(1), np.zeros(2), TYPES))
    np.testing.assert_array_equal(wanted, np.ones(count))
    np.testing.assert_array_equal(nlctl.compile(made).output(0.5, [0.0], [0.0, 0.0]), wanted)


@pytest.mark.parametrize("result", [lambda v: v, lambda v: [v], lambda v: np.array([[v]])])
def test_results_of_any_form_are_taken_as_python_control_takes_them(result):
    """A number, a list, a matrix."""
    made = ct.nlsys(None, lambda t, x, u, params: result(erfcx(u[0])), inputs=1, outputs=1,
                    name="form")  # fmt: skip
    assert nlctl.compile(made).output(0.0, [], [0.4]) == erfcx(0.4)


class TooLateError(Exception):
    """Of a user."""


def failing(t, x, u, params):
    if t > 0.5 and x[0] > params["k"]:
        raise TooLateError("at", t, float(erfcx(x[0])))
    return [-0.1 * x[0] * erfcx(0.0 * x[0])]


ENDS = {
    "run": lambda c: nlctl.input_output_response(c, [0, 2.0], 0, [1.0]),
    "ensemble": lambda c: nlctl.ensemble_response(c, [0, 2.0], initial_state={"f.x[0]": [0, 1.0]}),
    "value": lambda c: c.dynamics(0.7, [1.0]),
}


@pytest.mark.parametrize("how", ENDS)
def test_what_a_function_raises_is_passed_on_as_it_is(how):
    """The user's own exception with what it holds, and its traceback."""
    made = ct.nlsys(failing, None, inputs=0, outputs=1, states=1, name="f", params={"k": 0.4})
    with pytest.raises(TooLateError) as caught:
        ENDS[how](nlctl.compile(made))
    _, t, value = caught.value.args
    assert t > 0.5
    assert 0 < value < 1
    assert any("failing" in str(entry.name) for entry in caught.traceback)


def test_a_result_of_another_length_names_the_block():
    """Found when it happens: at the point that was tried it had the right one."""

    def growing(t, x, u, params):
        return [erfcx(x[0])] * (1 if t < 0.5 else 2)

    made = ct.nlsys(growing, None, inputs=0, outputs=1, states=1, name="grows")
    compiled = nlctl.compile(made)
    assert compiled.dynamics(0.1, [1.0]) == erfcx(1.0)
    with pytest.raises(ValueError, match="'grows' returns 2 values from its update function"):
        nlctl.input_output_response(compiled, [0, 1.0], 0, [1.0])


def python_call(function):
    """A call with one state and one result."""
    return Call(name="called", block="b", kind="update", functions=(function,),
                lengths=(1, 1, 0, 0, 1), reason="", template={}, slots={}, record=None,
                system=None)  # fmt: skip


@needs_jit
@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, ValueError])
def test_a_function_that_has_failed_is_not_called_again(error):
    """Nothing is computed on; the error waits for whoever ends the evaluation."""
    calls = []

    def function(t, x, u, params):
        calls.append([t, *x])
        raise error("once")

    call = python_call(function)
    native = native_calls({"called": call}, 2)
    assert native.called_back == ("called",)
    at = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)(
        native.symbols["called"]
    )
    c = np.zeros((1 + call.rows, 2))
    c[1:3, 1] = 0.5, 7.0
    for _ in range(3):
        at(c.ctypes.data, 1, 1)
    assert calls == [[0.5, 7.0]]
    assert np.isnan(c[3, 1])
    assert np.isfinite(c[:, 0]).all()
    assert isinstance(native.error(call, c, 1, 1), error)
    assert not native.raised


def test_blocks_whose_paths_look_alike_are_told_apart():
    """Block b of diagram a, and a block called a_b."""

    def scaled(name, factor):
        return ct.nlsys(None, lambda t, x, u, params: factor * erfcx(u[0]), inputs=["u"],
                        outputs=["y"], name=name)  # fmt: skip

    inner = ct.interconnect([scaled("b", 2.0)], inplist=["b.u"], inputs=["u"], outlist=["b.y"],
                            outputs=["y"], name="a")  # fmt: skip
    outer = ct.interconnect([inner, scaled("a_b", 3.0)], inplist=[["a.u", "a_b.u"]], inputs=["u"],
                            outlist=["a.y", "a_b.y"], name="outer")  # fmt: skip
    found = nlctl.compile(outer).output(0.0, [], [0.3])
    np.testing.assert_allclose(found, [2 * erfcx(0.3), 3 * erfcx(0.3)], rtol=1e-15)


def test_what_is_called_travels_between_processes_if_it_pickles():
    """A spline does, a lock does not."""
    compiled = pickle.loads(pickle.dumps(nlctl.compile(plant(by_spline))))
    x, u = np.array([0.3, 0.4]), np.array([0.5])
    expected = plant(by_spline).dynamics(0, x, u)
    np.testing.assert_allclose(compiled.dynamics(0.0, x, u), expected, rtol=1e-14)
    lock = {"lock": threading.Lock(), "rate": 2.0}

    def locked(t, x, u, params):
        return [-lock["rate"] * x[0]]

    made = nlctl.compile(ct.nlsys(locked, None, inputs=0, outputs=1, states=1, name="locked"))
    with pytest.raises(UsageError, match="'locked' cannot be sent to another process"):
        pickle.dumps(made)


@pytest.mark.parametrize("source", ["np.seterr(all='warn')", "np.random.rand()", "open('f')",
                                    "differential_evolution(abs, [(0, 1)])"])  # fmt: skip
def test_memory_and_chance_stay_refused(source, tmp_path):
    """That it could be called in Python changes nothing."""
    file = tmp_path / "impure.py"
    file.write_text(
        "import numpy as np\nfrom scipy.optimize import differential_evolution\n\n\n"
        f"def update(t, x, u, params):\n    {source}\n    return -x\n"
    )
    spec = importlib.util.spec_from_file_location("impure", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with pytest.raises(CompileError, match=r"'impure' cannot be compiled: .*line 6"):
        nlctl.compile(ct.nlsys(module.update, None, inputs=0, outputs=1, states=1, name="impure"))


def powers(t, x, u, params):
    value = 1.0
    for _ in range(params["n"]):
        value = value * x[0]
    return [-value]


@needs_jit
@pytest.mark.parametrize("wrapped", [False, True])
def test_members_whose_integers_differ(wrapped):
    """x' = -x^n: each member has the solution of its own n, the same bits as alone."""
    made = ct.nlsys(powers, None, inputs=0, outputs=1, states=1, name="f", params={"n": 1})
    compiled, times = nlctl.compile(made), np.linspace(0, 1, 3)
    n = np.array([1, 3, 1, 2, 2, 3, 1, 1, 3, 2])
    if wrapped:
        n = np.roll(n, 3)
    given = {"initial_state": {"f.x[0]": 0.8}, "keep": ["y[0]"], "rtol": 1e-9, "atol": 1e-11}
    every = nlctl.ensemble_response(compiled, times, params={"n": n}, **given)
    exact = {1: 0.8 * np.exp(-1), 2: 0.8 / 1.8, 3: 0.8 / np.sqrt(1 + 2 * 0.64)}
    for member, power in enumerate(n):
        samples = every.signals["y[0]"][member]
        assert samples[-1] == pytest.approx(exact[power], rel=1e-7)
        alone = nlctl.ensemble_response(compiled, times, params={"n": power}, **given)
        np.testing.assert_array_equal(samples, alone.signals["y[0]"][0])


def reads(t, x, u, params):
    """Every way to read a parameter; the loop keeps it from being traced."""
    total = params["k"] * x[0]
    while total > 1e3:
        total *= 0.5
        if total > 1e9:
            continue  # a pass with one is not written out
    total += params.get("absent", 0.5) + params.get("k") + params["rows"][1]
    if "get" in params and "other" not in params:
        total += params["get"]
    return [total, params["names"][0] * x[1]]


@pytest.mark.weekly
@needs_jit
def test_numba_reads_parameters_as_a_dict_is_read():
    """By keys, with `get` and `in`; a parameter may be named ``get``; nothing calls back."""
    system = ct.nlsys(
        reads, None, inputs=["u"], outputs=2, states=2, name="p",
        params={"k": 1.5, "rows": np.array([1.0, 2.0]), "get": 4.0, "names": (3.0, 5)},
    )  # fmt: skip
    compiled = nlctl.compile(system)
    for x in ([0.5, -1.0], [2e3, np.pi]):
        np.testing.assert_array_equal(compiled.dynamics(0, x, [1.0]), system.dynamics(0, x, [1.0]))
    response = nlctl.input_output_response(compiled, [0.0, 0.01], 1.0, [0.5, -1.0])
    assert np.isfinite(response.states).all()
    assert "in machine code of numba" in str(compiled)


Reading = namedtuple("Reading", ["get", "k", "text"])


@needs_jit
def test_what_named_tuples_mean_in_other_machine_code_stays_as_it_is():
    """Fields, membership and refusals are numba's own beside nlctl."""
    reading = Reading(2.0, 3.0, "k")
    assert numba.njit(lambda r: r.get + r.k)(reading) == 5.0
    assert numba.njit(lambda r: 4.0 in (r.get, r.k))(reading) is False
    with pytest.raises(NumbaError):
        numba.njit(lambda r: r["k"])(reading)
    with pytest.raises(NumbaError):  # numba compares no text with numbers; never: a field's name
        numba.njit(lambda r: "k" in r)(reading)


TABLE = np.linspace(0.0, 1.0, 7, dtype=np.float32) ** 2


def of_single_precision(t, x, u, params):
    return np.array([x[1], 0.01 * TABLE[int(abs(x[0]))] - x[1] * TABLE[2]])


def cast_to_single_precision(t, x, u, params):
    angle, rate = x.astype("float32")
    return np.array([rate, 0.8 - 1.2 * np.sin(angle) - 0.1 * rate])


@pytest.mark.filterwarnings("ignore::nlctl.errors.EngineWarning")
@pytest.mark.parametrize("update", [of_single_precision, cast_to_single_precision])
def test_single_precision_is_that_of_numpy(update):
    """numba has doubles of it sooner: 0.01 times a single is none in NumPy."""
    system = ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="block")
    compiled = nlctl.compile(system)
    (call,) = compiled.equations.calls.values()
    assert call.system is None  # not for numba
    for x in np.random.default_rng(2).normal(size=(9, 2)):
        assert (compiled.dynamics(0.0, x, []) == system.dynamics(0.0, x, [])).all()

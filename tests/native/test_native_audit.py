"""Machine code is compared with python-control: defects that are planted are found and named."""

import control as ct
import numpy as np
import pytest
from numba.core import config

import nlctl
from nlctl.errors import AuditError, EngineWarning, ParameterError, UsageError
from nlctl.expressions.graph import Graph
from nlctl.native import audit
from nlctl.native.codegen import interpret
from nlctl.native.codegen.ir import numbers
from nlctl.native.equations.reader import Reader
from nlctl.native.purity.captured import CapturedValues

TIMES = np.linspace(0, 1, 11)
N = 12


def update(t, x, u, params):
    """A chain with a wall at one end: slices, differences, choices."""
    dx = np.zeros(12)
    dx[1:-1] = params["k"] * (x[2:] - 2 * x[1:-1] + x[:-2])
    dx[0] = u[0] - x[0]
    dx[-1] = np.where(x[-1] > 0.0, -x[-1], x[-2] - x[-1])
    return dx


def output(t, x, u, params):
    return [x[3] - x[0] / 3, np.sum(x * x)]


def measure(t, x, u, params):
    return [0.5 * u[0] + 0.1 * u[1]]


def diagram(name="loop"):
    chain = ct.nlsys(update, output, states=N, inputs=1, outputs=2, name="chain", params={"k": 3.0})
    sensor = ct.nlsys(None, measure, inputs=2, outputs=1, name="sensor")
    return ct.interconnect(
        [chain, sensor],
        [["sensor.u[0]", "chain.y[0]"], ["sensor.u[1]", "-chain.y[1]"],
         ["chain.u[0]", "sensor.y[0]"]],
        inplist=[], outlist=["chain.y[0]", "sensor.y[0]"], name=name,
    )  # fmt: skip


X0 = np.linspace(0.2, 1.0, N)


def swapped_operator(patch):
    patch.setitem(numbers.ARITHMETIC, "sub", "fadd")
    right = interpret.numpy_function  # without JIT
    patch.setattr(interpret, "numpy_function", lambda op: right("add" if op == "sub" else op))


def swapped_choice(patch):
    right = Graph.op
    patch.setattr(
        Graph, "op",
        lambda self, name, *args: right(self, name, args[0], args[2], args[1])
        if name == "select" else right(self, name, *args),
    )  # fmt: skip


def slice_off_by_one(patch):
    right = Graph.part

    def wrong(self, vector, start, step, size):
        start = start - 1 if start > 1 and size == N - 2 else start
        return right(self, vector, start, step, size)

    patch.setattr(Graph, "part", wrong)


def sum_without_its_last(patch):
    right = Graph.sum
    patch.setattr(
        Graph, "sum",
        lambda self, vector, size: right(self, self.part(vector, 0, 1, size - 1), size - 1),
    )  # fmt: skip


def lost_sign(patch):
    right = Reader._combined
    patch.setattr(
        Reader, "_combined",
        lambda self, combination, count: right(
            self, combination and {s: abs(g) for s, g in combination.items()}, count),
    )  # fmt: skip


def state_for_a_parameter(patch):
    right = Graph.leaf
    patch.setattr(
        Graph, "leaf",
        lambda self, array, start, *rest: right(self, "x" if array == "p" else array, start, *rest),
    )  # fmt: skip


DEFECTS = [swapped_operator, swapped_choice, slice_off_by_one, sum_without_its_last, lost_sign,
           state_for_a_parameter]  # fmt: skip


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("defect", DEFECTS, ids=lambda defect: defect.__name__)
def test_a_planted_defect_is_found(defect, monkeypatch):
    """In a single run, and in an ensemble; with engine="auto" python-control takes over."""
    right = nlctl.input_output_response(diagram(), TIMES, 0, X0)
    defect(monkeypatch)
    compiled = nlctl.compile(diagram())
    with pytest.raises(AuditError, match=r"differ at '.*' of block '(chain|sensor)': .* and"):
        nlctl.input_output_response(compiled, TIMES, 0, X0)
    start = {f"chain.x[{i}]": [value, 2 * value] for i, value in enumerate(X0)}
    with pytest.raises(AuditError, match=r"of block '(chain|sensor)'"):
        nlctl.ensemble_response(compiled, TIMES, initial_state=start)
    with pytest.warns(EngineWarning, match="takes over: machine code"):
        taken = nlctl.input_output_response(diagram(), TIMES, 0, X0, engine="auto")
    np.testing.assert_allclose(taken.outputs, right.outputs, rtol=1e-6, atol=1e-8)


def test_the_block_is_named_and_not_the_one_behind_it(monkeypatch):
    """A wrong output shows first in the derivatives of another block."""
    lost_sign(monkeypatch)  # of the wire from the chain to the sensor
    compiled = nlctl.compile(diagram())
    for _ in range(2):  # what has failed is not believed the next time
        with pytest.raises(AuditError, match=r"'y\[0\]' of block 'sensor'"):
            nlctl.input_output_response(compiled, TIMES, 0, X0)


@pytest.fixture
def calls(monkeypatch):
    """Count how often python-control's own right-hand side is asked."""
    counted, right = [], audit.values_now

    def counting(system, point):
        counted.append(point[0])
        return right(system, point)

    monkeypatch.setattr(audit, "values_now", counting)
    return counted


@pytest.mark.parametrize(("wanted", "each"), [(True, [True, False]), (False, [False, False]),
                                              ("every run", [True, True])])  # fmt: skip
def test_only_the_first_run_pays_unless_every_run_is_to(wanted, each, calls):
    """Start, end and times between; a single run and an ensemble are programs of their own."""
    compiled = nlctl.compile(diagram())
    for audited in each:
        calls.clear()
        nlctl.input_output_response(compiled, TIMES, 0, X0, audit=wanted)
        assert bool(calls) == audited
        assert not calls or {TIMES[0], TIMES[-1]} < set(calls)
    for audited in each:
        calls.clear()
        nlctl.ensemble_response(compiled, TIMES, audit=wanted)
        assert bool(calls) == audited


def test_another_choice_of_audit_is_refused():
    with pytest.raises(ParameterError, match="audit must be True, False or 'every run', got 'no'"):
        nlctl.input_output_response(nlctl.compile(diagram()), TIMES, 0, X0, audit="no")


def one_state(function):
    return ct.nlsys(function, None, inputs=0, outputs=1, states=1, name="one")


def test_values_that_differ_from_call_to_call_are_the_error(monkeypatch):
    """python-control's own right-hand side is not a function then."""
    system = one_state(lambda t, x, u, params: -x)
    compiled = nlctl.compile(system)
    drawn = iter(range(1000))
    monkeypatch.setattr(type(system), "_rhs", lambda self, t, x, u: x + next(drawn))
    with pytest.raises(AuditError, match="differ from call to call at t = 0 s: a block has a mem"):
        nlctl.input_output_response(compiled, TIMES, 0, [1.0])


def test_where_python_control_fails_machine_code_must_not_run_on(monkeypatch):
    system = one_state(lambda t, x, u, params: -x)
    compiled = nlctl.compile(system)

    def fails(self, t, x, u):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(type(system), "_rhs", fails)
    with pytest.raises(AuditError, match="raises an error at t = 0 s: ZeroDivisionError: division"):
        nlctl.input_output_response(compiled, TIMES, 0, [1.0])


CANCELLING = {  # how long (s), and the rate
    "large terms that cancel": (0.1, lambda t, x, u, params: (x + 1e9) - 1e9 - x),
    "a high gain": (0.1, lambda t, x, u, params: -1e8 * np.tanh(1e6 * (x - np.sin(t)))),
    "a jump at the state": (0.1, lambda t, x, u, params: np.sign(x - 1.0) - 0.0 * x),
    "half a turn more at t = 0": (0.1, lambda t, x, u, params: np.sin(t + np.pi) + 0.0 * x),
    "angles of many turns": (1e-3, lambda t, x, u, params: np.sin(1e9 * x) - x),
}


@pytest.mark.parted
@pytest.mark.skipif(getattr(config, "DISABLE_JIT", False), reason="many steps without JIT")
@pytest.mark.parametrize("kind", CANCELLING)
def test_rounding_is_no_difference(kind):
    """What python-control's own value moves when the state is rounded is not held against it."""
    end, rate = CANCELLING[kind]
    run = nlctl.input_output_response(
        nlctl.compile(one_state(rate)), end * TIMES, 0, [1.0], ignore_errors=True, audit="every run"
    )
    assert np.isfinite(run.outputs).all()


@pytest.mark.parametrize("count", [3, 2001, 20001])
def test_sines_of_half_turns_are_no_difference(count):
    """A reference's second derivative is sin(pi) at t = 0: 0 in machine code, 1.2e-16 by NumPy."""
    for order in (2, 3, 4):
        block = nlctl.block(nlctl.SumOfSines(order=order), "reference")
        run = nlctl.input_output_response(nlctl.compile(block), np.linspace(0, 20, count))
        assert run.outputs[2, 0] == 0


def test_loops_that_python_control_does_not_solve_are_compared_block_by_block(monkeypatch):
    """Each block's outputs are those of its equations at the inputs that the wires bring."""
    static = ct.nlsys(None, lambda t, x, u, params: 0.5 * u - np.tanh(u), inputs=1, outputs=1,
                      name="static")  # fmt: skip
    plant = ct.ss([[-1.0]], [[1.0]], [[1.0]], [[-0.7]], name="plant")
    inner = ct.interconnect([plant], inplist=["plant.u[0]"], outlist=["-plant.y[0]"], name="inner")
    loop = ct.interconnect(
        [static, inner], [["static.u", "inner.y"], ["inner.u", "static.y"]],
        inplist=["inner.u"], outlist=["inner.y", "static.y"], name="loop",
    )  # fmt: skip
    compiled = nlctl.compile(loop, algebraic_loops="solve")
    run = nlctl.input_output_response(compiled, TIMES, 1.0, [1.0])
    y, v = run.outputs
    np.testing.assert_allclose(v, 0.5 * y - np.tanh(y), atol=1e-12)
    monkeypatch.setattr(static, "outfcn", lambda t, x, u, params: 0.5 * u + np.tanh(u))
    monkeypatch.setattr(CapturedValues, "changed", lambda self: None)
    with pytest.raises(AuditError, match=r"of block '(static|inner\.plant)'"):
        nlctl.input_output_response(compiled, TIMES, 1.0, [1.0], audit="every run")


def test_in_discrete_time_as_well(monkeypatch):
    """The next state is compared."""
    system = ct.nlsys(lambda t, x, u, params: 0.5 * x + u, None, inputs=1, outputs=1, states=1,
                      dt=0.1, name="filter")  # fmt: skip
    compiled = nlctl.compile(system)
    nlctl.input_output_response(compiled, np.arange(5) * 0.1, 1.0, [1.0])
    right = type(system)._rhs
    monkeypatch.setattr(type(system), "_rhs", lambda self, t, x, u: 1.01 * right(self, t, x, u))
    with pytest.raises(AuditError, match="of block 'filter'"):
        nlctl.input_output_response(compiled, np.arange(5) * 0.1, 1.0, [1.0], audit="every run")


def changed_wire(loop):
    loop.set_connect_map(2 * loop.connect_map)


def changed_function(loop):
    loop.syslist[1].outfcn = lambda t, x, u, params: [u[0]]


def changed_matrix(loop):
    loop.output_map[0, 0] = 5.0


@pytest.mark.parametrize("change", [changed_wire, changed_function, changed_matrix])
def test_a_diagram_that_is_changed_after_compiling_is_no_longer_spoken_of(change):
    """python-control computes the new one; so the compiled one is refused."""
    loop = diagram()
    compiled = nlctl.compile(loop)
    nlctl.input_output_response(compiled, TIMES, 0, X0)
    change(loop)
    with pytest.raises(UsageError, match=r"was compiled and is .* now: compile again"):
        nlctl.input_output_response(compiled, TIMES, 0, X0)


def direct_later(t, x, u, params):
    return [-2.0 * u[0] if t > 1 else 0.0]


def direct_far_away(t, x, u, params):
    return [u[0] if x[0] > 50 else 0.0]


@pytest.mark.parametrize("function", [direct_later, direct_far_away])
def test_feedthrough_that_is_there_at_times_only(function):
    """Dependence is read from the expressions: python-control runs both loops, and so do we."""
    states = 1 if function is direct_far_away else 0
    law = ct.nlsys(
        (lambda t, x, u, params: 40.0 + 0.0 * x) if states else None, function,
        inputs=1, outputs=1, states=states or None, name="law",
    )  # fmt: skip
    plant = ct.ss([[-1.0]], [[1.0]], [[1.0]], [[0.0]], name="plant")
    loop = ct.interconnect(
        [law, plant], [["law.u", "plant.y"], ["plant.u", "law.y"]],
        inplist=["plant.u"], outlist=["plant.y", "law.y"], name="loop",
    )  # fmt: skip
    times = np.linspace(0, 2, 21)
    x0 = [0.0, 1.0] if states else [1.0]
    run = nlctl.input_output_response(nlctl.compile(loop), times, 0, x0)
    wanted = ct.input_output_response(
        loop, times, 0, x0, solve_ivp_kwargs={"rtol": 1e-10, "atol": 1e-12, "max_step": 0.01}
    )
    np.testing.assert_allclose(run.outputs, wanted.outputs, rtol=1e-3, atol=1e-3)
    assert wanted.outputs[1, -1] != 0.0

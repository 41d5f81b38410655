"""What operations round where terms cancel is no difference; a wrong operation is one."""

import control as ct
import numpy as np
import pytest
from numba.core import config

import nlctl
from nlctl.errors import AuditError
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.native.audit import Trial, rounding
from nlctl.native.rounding.nudged import ROUNDINGS, Shaken, nudged_values, unit

TIMES = np.linspace(0, 1, 23)
STARTS = (0.4, 1e-2, 1e-3, 1e-5, 3e-7, -2e-4)
EULER = float(np.exp(1.0))

# each a formula whose terms cancel, and one that differs from it by one operation or constant
FORMULAS = {
    "1 - cos": (lambda z: 1 - np.cos(z), lambda z: (1 + 1e-12) - np.cos(z)),
    "exp - 1": (lambda z: np.exp(z) - 1, lambda z: np.exp(z * (1 + 1e-7)) - 1),
    "softplus": (lambda z: np.log(1 + np.exp(z)) - np.log(2.0),
                 lambda z: np.log(1 + np.exp(-z)) - np.log(2.0)),
    "tanh far out": (lambda z: 1 - np.tanh(7.5 + z), lambda z: 1 - np.tanh(7.5 + z + 1e-6)),
    "logistic far out": (lambda z: 1 - 1 / (1 + np.exp(-30 - z)),
                         lambda z: 1 - 1 / (1 + np.exp(-25 - z))),
    "sinh minus argument": (lambda z: np.sinh(z) - z, lambda z: np.sinh(z) - z + 1e-12),
    "third order": (lambda z: np.sin(z) - z + z**3 / 6, lambda z: np.sin(z) - z + z**3 / 6 + 1e-14),
    "powers": (lambda z: (1 + z) ** 7 - (1 + z) ** 6 * (1 + z), lambda z: (1 + z) ** 7 - (1 + z)),
    "arctan2": (lambda z: np.arctan2(z, 1.0) - z, lambda z: np.arctan2(z, 1.0 + 1e-7) - z - 1e-13),
    "hypot": (lambda z: np.hypot(1.0, z) - 1.0, lambda z: np.hypot(1.0 + 1e-11, z) - 1.0),
    "log of exp": (lambda z: np.log(np.exp(1 + z)) - 1 - z,
                   lambda z: np.log(np.exp(1 + z)) - 1 + 1e-12 - z),
    "constants of two kinds": (lambda z: np.exp(1.0) * (1 + z) - EULER - EULER * z,
                               lambda z: np.exp(1.0) * (1 + z) - EULER - EULER * z + 1e-12),
    "high power of a root": (lambda z: np.sqrt(2 + z) ** 20 - (2 + z) ** 10,
                             lambda z: np.sqrt(2 + z) ** 20 - (2 + z) ** 10 * (1 + 1e-11)),
    "softmax": (lambda z: np.sum(np.exp([z, 2 * z, 3 * z])) - 3,
                lambda z: np.sum(np.exp([z, 2 * z, 2 * z])) - 3 - 1e-12),
}  # fmt: skip
LONG = np.linspace(-1.0, 1.0, 200)
SQUARE = np.outer(LONG, LONG)
VECTORS = {
    "a sum of many": (lambda x: np.sum(np.exp(x[0] * LONG)) - np.sum(np.cosh(x[0] * LONG)),
                      lambda x: np.sum(np.exp(x[0] * LONG)) - np.sum(np.cosh(x[0] * LONG)) + 1e-9),
    "a product of a matrix": (lambda x: (SQUARE @ np.full(200, x[0] + 1e3))[7],
                              lambda x: (SQUARE @ np.full(200, x[0] + 1e3))[7] + 1e-6),
    "a norm": (lambda x: np.linalg.norm(x + [0, 1e3]) - 1e3 - x[1],
               lambda x: np.linalg.norm(x + [0, 1e3]) - 1e3 - x[1] + 1e-9),
    "a solved system": (lambda x: np.linalg.solve(np.array([[1.0, 0.3], [0.3, 2.0 + 0 * x[0]]]),
                                                  np.array([1.0, 0.3 + x[0]]))[1] - x[0] / 1.91,
                        lambda x: x[0] / 1.91 - x[0] / 1.91 + 1e-12),
    "a distance by a loop": (lambda x: loop_norm(x) - 1.0, lambda x: loop_norm(x) - 1.0 + 1e-12),
}  # fmt: skip


def loop_norm(x):
    """The square root of 1 + x^2, by a loop that its value ends: it is called as it stands."""
    y = 1.0 + 0.0 * x[0]
    while abs(y * y - 1.0 - x[0] * x[0]) > 1e-10:
        y = 0.5 * (y + (1.0 + x[0] * x[0]) / y)
    return y


def system(rate):
    def update(t, x, u, params):
        return [0.01 * rate(x), -x[1]]

    return ct.nlsys(update, None, inputs=0, outputs=2, states=2, name="s")


CASES = {name: tuple(lambda x, f=f: f(x[0]) for f in pair) for name, pair in FORMULAS.items()}
CASES |= VECTORS
needs_jit = pytest.mark.skipif(
    getattr(config, "DISABLE_JIT", False), reason="the same operations in both without JIT"
)


@pytest.mark.parted
@needs_jit
@pytest.mark.parametrize("name", CASES)
@pytest.mark.filterwarnings("ignore::nlctl.errors.EngineWarning")
def test_what_cancels_is_no_difference(name):
    """Each of 138 starts and times at which terms of the size of 1 cancel to 1e-16 and more."""
    compiled = nlctl.compile(system(CASES[name][0]))
    for start in STARTS:
        run = nlctl.input_output_response(compiled, TIMES, 0, [start, 1.0], audit="every run")
        assert np.isfinite(run.states).all()


@pytest.mark.parted
@needs_jit
@pytest.mark.parametrize(
    "name",
    [
        n if n != "a distance by a loop" else pytest.param(n, marks=pytest.mark.weekly)
        for n in CASES
    ],
)
@pytest.mark.filterwarnings("ignore::nlctl.errors.EngineWarning")
def test_a_formula_that_differs_by_one_operation_is_found(name, monkeypatch):
    """Also where its terms cancel: by a sign, an index, or the twelfth digit of a constant."""
    right, wrong = CASES[name]
    made = system(right)
    compiled = nlctl.compile(made)
    monkeypatch.setattr(made, "updfcn", lambda t, x, u, params: [0.01 * wrong(x), -x[1]])
    object.__setattr__(compiled.schedule, "captured", ())
    with pytest.raises(AuditError, match=r"differ at 'x\[0\]' of block 's'"):
        nlctl.input_output_response(compiled, TIMES, 0, [0.05, 1.0], audit="every run")


def allowed(rate, start):
    """Return how far rounding may move the rate of the first state."""
    made = ct.nlsys(lambda t, x, u, params: [rate(x), -x[1]], None, inputs=0, states=2, name="s")
    compiled = nlctl.compile(made)
    trial = Trial(time=TIMES, states=np.zeros((2, 1)), inputs=np.zeros((0, 1)),
                  p=compiled.parameter_vector(), params=None, width=1)  # fmt: skip
    return rounding(compiled, trial, (0.0, np.array([start, 1.0]), np.zeros(0)))[0][0]


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e9])
def test_it_is_some_units_in_the_last_place_of_what_cancels(scale):
    """c cos(x) - c: each of three operations moves c by at most its nudge."""
    found = allowed(lambda x: scale * np.cos(x[0]) - scale, 1e-3)
    assert unit() * scale / 2 < found < 4 * unit() * scale


def test_it_is_nothing_where_nothing_is_rounded():
    """States, parameters, whole numbers and choices among them are what they are."""
    assert allowed(lambda x: np.where(x[0] > 0.5, -x[0], abs(x[1])), 0.7) == 0.0


def test_sums_count_by_their_terms():
    """The order of a sum is not said: 1e6 + 1 - 1e6 is 1 to the rounding of 1e6."""
    big = np.concatenate([np.full(10, 1e6), np.zeros(80), np.full(10, -1e6)])
    found = allowed(lambda x: np.sum(big * x[0]), 1.0)
    assert unit() * 1e6 < found < 40 * unit() * 1e6


@needs_jit
def test_loops_are_compared_block_by_block_with_the_same_tolerance():
    """python-control does not solve this one, so its blocks are compared at their inputs."""
    static = ct.nlsys(None, lambda t, x, u, params: 1 - np.cos(u), inputs=1, outputs=1,
                      name="static")  # fmt: skip
    plant = ct.ss([[-1.0]], [[1.0]], [[1.0]], [[-0.7]], name="plant")
    loop = ct.interconnect(
        [static, plant], [["static.u", "plant.y"], ["plant.u", "static.y"]],
        inplist=["plant.u"], outlist=["plant.y", "static.y"], name="loop",
    )  # fmt: skip
    compiled = nlctl.compile(loop, algebraic_loops="solve")
    for start in STARTS:
        run = nlctl.input_output_response(compiled, TIMES, 0.0, [start], audit="every run")
        np.testing.assert_allclose(run.outputs[1], 1 - np.cos(run.outputs[0]), atol=1e-14)


def test_arrays_that_are_shaken_are_arrays():
    """Without directions they compute what arrays do; with them each operation is rounded anew."""
    x = np.array([0.3, 0.7, -2.0])

    def function(x):
        y = np.zeros(3)
        y[:] = np.sin(x) + x[0] * x
        y += 1.0
        return np.linalg.norm(y), max(x), float(x[1]), np.dot(x, y), x[1:].sum(), *x

    plain = np.array(function(x), dtype=float)
    np.testing.assert_array_equal(np.array(function(Shaken.of(x, None)), dtype=float), plain)
    moved = np.array(function(Shaken.of(x, np.random.default_rng(1))), dtype=float)
    assert 0 < np.abs(moved - plain).max() < 100 * unit()
    assert (moved[[1, 2, 5, 6, 7]] == plain[[1, 2, 5, 6, 7]]).all()  # nothing was computed


def test_values_are_those_of_expressions_where_nothing_is_nudged():
    compiled = nlctl.compile(nlctl.paper.example_1())
    found = compiled.equations
    rng = np.random.default_rng(3)
    sizes = {"t": 1, "x": compiled.system.nstates, "u": compiled.schedule.ninputs}
    arrays = {name: rng.normal(size=(n, 1)) for name, n in sizes.items()}
    arrays["p"] = compiled.parameter_vector()[:, None]
    results = [expr for expr, _ in found.pieces("dx")]
    plain = evaluate_expressions(results, arrays)
    for one, other in zip(plain, nudged_values(results, arrays, {}, {}, {}), strict=True):
        size = one.shape[:-1] if one.ndim else ()
        ways = np.broadcast_to(other, (*size, ROUNDINGS))
        np.testing.assert_allclose(ways[..., 0], one.reshape(size), rtol=1e-14)
        np.testing.assert_allclose(ways, ways[..., :1] + 0 * ways, rtol=1e-9, atol=1e-9)

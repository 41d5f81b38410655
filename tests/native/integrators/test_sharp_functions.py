"""y' = f(s) with s' = 1, where f is flat but for a part of 1/1000 of what a step would be.

Nothing but f moves fast, and from rest: the integrals are known.
"""

import control as ct
import numpy as np
import pytest
from examples import crossed
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import erfc, gamma, gammaln, ive

import nlctl
from nlctl.expressions.conditions import switching_function
from nlctl.expressions.graph import Graph
from nlctl.expressions.sharp import AREA, ITSELF, SharpArgument, as_power, sharp_arguments

WAYS = [{"method": name} for name in ("tsit5", "rodas5p", "taylor")]
WAYS.append({"engine": "python-control"})
IDS = ["-".join(how.values()) for how in WAYS]
W, END = 1e-3, 4.0  # width of what is not flat, and the run (s)


def width(above):
    """Return how long `above` is positive, around 0."""
    return brentq(above, 0.0, 20 * W) - brentq(above, -20 * W, 0.0)


# functions of z, which goes from one side of 0 to the other, and their integrals
RATES = {
    "bell": (lambda z: np.exp(-((z / W) ** 2)) / W, np.sqrt(np.pi)),
    "hat": (lambda z: (1 - (z / W) ** 2 + 1) * np.exp(-((z / W) ** 2)) / W, 1.5 * np.sqrt(np.pi)),
    "sech": (lambda z: 1 / np.cosh(z / W) / W, np.pi),
    "pair": (lambda z: (np.tanh(z / W) - np.tanh((z - 5 * W) / W)) / (10 * W), 1.0),
    "high power": (lambda z: 1 / (1 + (z / W) ** 2) ** 8 / W, np.pi * 429 / 2048),
    "logistic": (lambda z: (1 / (1 + np.exp(-z / W)) - 1 / (1 + np.exp(5 - z / W))) / W, 5.0),
    "fourth power": (lambda z: np.exp(-((z / W) ** 4)) / W, 2 * gamma(1.25)),
    "another base": (lambda z: 0.5 ** ((z / W) ** 2) / W, np.sqrt(np.pi / np.log(2))),
    "two roots": (
        lambda z: np.exp(-((z * (z - 0.4) / W) ** 2)) / W,
        2 * quad(lambda s: np.exp(-((s * (W * s - 0.4)) ** 2)), -20, 20)[0],
    ),
    "kink": (lambda z: erfc(np.abs(z) / W) / W, 2 / np.sqrt(np.pi)),
    "no whole power": (
        lambda z: np.abs(np.cos(z / 2)) ** 20000.5,
        2 * np.sqrt(np.pi) * np.exp(gammaln(10000.75) - gammaln(10001.25)),
    ),
}
# with parameters n and w: of what is neither known to be positive, nor which power it is
OPEN = {
    "divisor": (lambda z, p: p["w"] ** 7 / (z**2 + p["w"] ** 2) ** 4, np.pi * 5 / 16),
    "root of one": (lambda z, p: p["w"] ** 4 / np.sqrt(z**2 + p["w"] ** 2) ** 5, 4 / 3),
    "exponent": (lambda z, p: (1 + (z / p["w"]) ** 2) ** -p["n"] / p["w"],
                 np.sqrt(np.pi) * gamma(7.0) / gamma(7.5)),
    "high exponent": (lambda z, p: np.abs(np.cos(z)) ** (3000 * p["n"]),
                      np.sqrt(np.pi) * np.exp(gammaln(11250.5) - gammaln(11251.0))),
    "base": (lambda z, p: p["w"] ** ((z / p["w"]) ** 2) / p["w"],
             np.sqrt(np.pi / -np.log(W))),
}  # fmt: skip
CONDITIONS = {
    "bell": lambda z: np.exp(-((z / W) ** 2)) - 0.5 - 0.01 * z,
    "square": lambda z: (1 + 0.1 * z) / (1 + (z / W) ** 2) ** 2 - 0.5,
    "cube": lambda z: (1 + 0.1 * z) / (1 + (z / W) ** 2) ** 3 - 0.5,
    "pair": lambda z: np.tanh((z + W) / W) - np.tanh((z - W) / W) - 0.9,
    "arctan": lambda z: np.arctan((z + W) / W) - np.arctan((z - W) / W) - 1.0,
    "eighth power": lambda z: W**8 - z**8,
    "power of a wave": lambda z: (1 + 0.01 * z) * np.cos(z * 300) ** 40 - 0.5,
}


# of which Taylor's method knows no coefficients
NO_SERIES = ("another base", "no whole power", "exponent", "high exponent", "base")


def ways(names):
    """Pairs of a name and a way of computing it."""
    every = [(name, how) for name in names for how in WAYS]
    return [(n, how) for n, how in every if n not in NO_SERIES or how != {"method": "taylor"}]


def flowing(f):
    return ct.nlsys(
        lambda t, x, u, p: [1.0, f(x[0])], lambda t, x, u, p: x[1], inputs=0, outputs=1, states=2,
        name="flowing",
    )  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize(("name", "how"), ways(RATES))
def test_integrals_of_pulses(name, how):
    f, integral = RATES[name]
    for start in (-1.0, -0.377, -2.93)[: 1 if "engine" in how else 3]:
        run = nlctl.input_output_response(
            flowing(f), [0, END], 0, [start, 0.0], squeeze=True, rtol=1e-8, atol=1e-10, **how
        )
        assert run.outputs[-1] == pytest.approx(integral, abs=1e-5)


@pytest.mark.parted
@pytest.mark.parametrize(("name", "how"), ways(OPEN))
def test_integrals_of_pulses_with_parameters(name, how):
    f, integral = OPEN[name]
    flow = ct.nlsys(
        lambda t, x, u, p: [1.0, f(x[0], p)], lambda t, x, u, p: x[1], inputs=0, outputs=1,
        states=2, params={"w": W, "n": 7.5}, name="flow",
    )  # fmt: skip
    for start in (-1.0, -0.93, -0.877)[: 1 if "engine" in how else 3]:
        run = nlctl.input_output_response(
            flow, [0, 2.0], 0, [start, 0.0], squeeze=True, rtol=1e-8, atol=1e-10, **how
        )
        assert run.outputs[-1] == pytest.approx(integral, rel=1e-5)


@pytest.mark.parametrize(
    ("how", "name"),
    crossed(
        dict(zip(IDS, WAYS, strict=True)),
        [name for name in CONDITIONS if name != "power of a wave"],
    ),
)
def test_windows_of_pulses(name, how):
    above = CONDITIONS[name]
    compared = flowing(lambda z: 1000.0 if above(z) > 0 else 0.0)
    for start in (-1.0, -0.7, -2.3)[: 1 if "engine" in how else 3]:
        run = nlctl.input_output_response(
            compared, [0, END], 0, [start, 0.0], squeeze=True, rtol=1e-8, atol=1e-10, **how
        )
        assert run.outputs[-1] == pytest.approx(1000 * width(above), rel=1e-4)


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_high_powers_of_a_wave(method):
    """cos^40 is above 1/2 for a tenth of each half wave."""
    above = CONDITIONS["power of a wave"]
    compared = flowing(lambda z: 1.0 if above(z) > 0 else 0.0)
    run = nlctl.input_output_response(compared, [0, 0.2], 0, [0.0, 0.0], method=method)
    grid = np.linspace(0, 0.2, 2_000_001)
    assert run.states[1, -1] == pytest.approx(0.2 * np.mean(above(grid) > 0), abs=1e-6)


@pytest.mark.parted
@pytest.mark.parametrize("how", WAYS, ids=IDS)
def test_sharp_functions_of_waves(how):
    """exp(k (cos z - 1)) is a pulse in each wave of z' = 1: 2 pi I_0(k) exp(-k) each."""
    run = nlctl.input_output_response(
        flowing(lambda z: np.exp(1e5 * (np.cos(z) - 1))), [0, 20 * np.pi], 0, [np.pi, 0.0],
        squeeze=True, **how,
    )  # fmt: skip
    assert run.outputs[-1] == pytest.approx(10 * 2 * np.pi * ive(0, 1e5), rel=1e-4)


@pytest.mark.parametrize("method", ["tsit5", "rodas5p"])
def test_powers_of_waves_are_high_at_crests(method):
    """The integral of cos^2000 over a half wave is pi binom(2000, 1000) / 2^2000."""
    run = nlctl.input_output_response(
        flowing(lambda z: np.cos(z) ** 2000), [0, 30 * np.pi], 0, [0.5 * np.pi, 0.0],
        squeeze=True, method=method,
    )  # fmt: skip
    half_wave = np.pi * np.exp(gammaln(2001) - 2 * gammaln(1001) - 2000 * np.log(2))
    assert run.outputs[-1] == pytest.approx(30 * half_wave, rel=1e-6)


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_waves_of_members(method):
    """Members of other frequencies, each with all of its pulses, from trough to trough."""
    train = ct.nlsys(
        lambda t, x, u, p: [1.0, np.exp(1e5 * (np.cos(p["w"] * x[0]) - 1))],
        lambda t, x, u, p: x[1], inputs=0, outputs=1, states=2, params={"w": 1.0}, name="train",
    )  # fmt: skip
    w = np.arange(3, 40) + 0.5  # half a wave more than whole ones in 2 pi
    runs = nlctl.ensemble_response(
        train, [0, 2 * np.pi], 0, [0.1, 0.0], params={"w": w}, keep=["y[0]"], method=method
    )
    pulses = np.floor(w + 0.1 * w / (2 * np.pi))
    near = np.abs(np.cos(0.1 * w + 2 * np.pi * w) - 1) < 1e-3  # it ends within one
    known = pulses * 2 * np.pi * ive(0, 1e5) / w
    np.testing.assert_allclose(runs.signals["y[0]"][~near, -1], known[~near], rtol=1e-5)


def test_members_of_an_ensemble():
    """Each sees its own pulse, wherever its steps end."""
    bell = ct.nlsys(
        lambda t, x, u, p: [1.0, np.exp(-(((x[0] - p["at"]) / 1e-3) ** 2)) * 1e3],
        lambda t, x, u, p: x[1], inputs=0, outputs=1, states=2, params={"at": 1.0}, name="bell",
    )  # fmt: skip
    places = np.linspace(0.31, 3.57, 64)
    runs = nlctl.ensemble_response(bell, [0, 4], params={"at": places}, keep=["y[0]"])
    np.testing.assert_allclose(runs.signals["y[0]"][:, -1], np.sqrt(np.pi), atol=1e-6)


def test_steps_stay_long_where_all_is_flat_or_gentle():
    """What is not met, and what moves as gently as its argument, costs no steps."""
    for f in (
        lambda z: np.exp(-((z - 50) ** 2)),
        lambda z: np.tanh(0.1 * z),
        lambda z: 1 / (1 + z),
    ):
        run = nlctl.input_output_response(flowing(f), [0, 4], 0, [0.0, 0.0], method="tsit5")
        assert run.statistics.accepted < 40


def test_what_functions_are_measured_by():
    graph = Graph({"x": 2})
    x, y = (graph.leaf("x", i, None) for i in range(2))
    square = graph.op("mul", x, x)
    above = graph.op("add", graph.const(1.0), square)
    nodes = [
        graph.op("tanh", y), graph.op("arctan", x), graph.op("logaddexp", x, y),
        graph.op("div", y, graph.op("mul", above, above)), graph.op("div", x, y), square,
        graph.op("exp", graph.const(2.0)),
    ]  # fmt: skip
    assert sharp_arguments(graph, nodes) == (
        SharpArgument(graph.op("mul", graph.const(2.0), y), ITSELF),
        SharpArgument(x, AREA),
        SharpArgument(graph.op("sub", x, y), ITSELF),
        SharpArgument(above, 2),
    )


@pytest.mark.parametrize("exponent", range(1, 17))
def test_powers_that_are_products(exponent):
    graph = Graph({"x": 1})
    x = power = graph.leaf("x", 0, None)
    for _ in range(exponent - 1):
        power = graph.op("mul", power, x)
    assert as_power(power) == (x, exponent)
    assert as_power(graph.op("power", x, graph.const(-2.5)))[1] == 1


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
@pytest.mark.parametrize("start", [0.0, 1.0])
def test_both_sides_are_equal_at_the_last_instant(method, start):
    """tanh(60 (x - 1)) and 0.3 x - 0.5 cross at 0.9966, and both are 1 where x = 5."""

    def above(x):
        return np.tanh(60 * (x - 1)) - (0.3 * x - 0.5)

    compared = flowing(lambda z: 1.0 if np.tanh(60 * (z - 1)) > 0.3 * z - 0.5 else 0.0)
    run = nlctl.input_output_response(compared, [0, 5 - start], 0, [start, 0.0], method=method)
    known = 4.0 if start else 5.0 - brentq(above, 0.9, 1.1)
    assert run.states[1, -1] == pytest.approx(known, abs=1e-6)


@pytest.mark.weekly
def test_waves_of_a_condition_in_the_reference():
    """sin(40 z) is above 0.99 for 2 acos(0.99) / 40 in each of 12 waves, all within one step."""
    compared = flowing(lambda z: 1.0 if np.sin(40 * z) > 0.99 else 0.0)
    run = nlctl.input_output_response(
        compared, [0, 24 * np.pi / 40], 0, [0.0, 0.0], engine="python-control"
    )
    assert run.states[1, -1] == pytest.approx(12 * 2 * np.arccos(0.99) / 40, abs=1e-5)


def test_nothing_is_multiplied_by_a_zero_that_is_compared_with():
    graph = Graph({"x": 2})
    x, y = (graph.leaf("x", i, None) for i in range(2))
    quotient = graph.op("div", x, y)
    for pair in ((quotient, graph.const(0.0)), (graph.const(0.0), quotient)):
        assert switching_function(graph, graph.op("lt", *pair)) == graph.op("mul", x, y)


def test_conditions_of_outputs_alone_are_counted():
    shows = ct.nlsys(
        lambda t, x, u, p: [1.0], lambda t, x, u, p: 1.0 if x[0] > 0.5 else 0.0,
        inputs=0, outputs=1, states=1, name="shows",
    )  # fmt: skip
    assert "conditions   1 of outputs alone, not located" in str(nlctl.compile(shows))


def series(t, x, u, p):
    """Pulses of height 1, 1 / 2, 1 / 4, ..., each half as wide, until they are low."""
    total, height, z = 0.0, 1.0, (x[0] - 1.7) / W
    while height > 0.01:
        total += height * np.exp(-((z / height) ** 2))
        height *= 0.5
    return [1.0, total]


def searched(t, x, u, p):
    """A diode behind a resistor: exp of what a search chooses, which moves as gently as x."""
    v = brentq(lambda v: 1e-9 * (np.exp(v / 0.026) - 1) - (x[0] - v) / 100, -1.0, 1.0)
    return [u[0] - x[0], v]


def test_pulses_of_a_series_are_seen():
    plant = ct.nlsys(series, inputs=0, outputs=2, states=2, name="plant")
    run = nlctl.input_output_response(plant, [0, END], 0, [0.0, 0.0])
    exact = W * np.sqrt(np.pi) * sum(0.25**k for k in range(7))
    assert run.states[1, -1] == pytest.approx(exact, rel=1e-5)


def test_what_a_search_tries_is_no_function_that_is_measured():
    plant = ct.nlsys(searched, inputs=1, outputs=2, states=2, name="plant")
    compiled, t = nlctl.compile(plant), np.linspace(0, 3, 31)
    assert len(compiled.equations.conditions.sharp) < 8  # of 24 passes
    run = nlctl.input_output_response(compiled, t, 0.5, [0.3, 0.0], rtol=1e-9, atol=1e-11)
    reference = ct.input_output_response(
        plant, t, 0.5 + 0 * t, [0.3, 0.0], solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-11}
    )
    np.testing.assert_allclose(run.states, reference.states, atol=1e-8)

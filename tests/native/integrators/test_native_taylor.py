"""Taylor's method: its coefficients, against power series of python-flint; its steps, against
closed forms, invariants and the explicit pair; kinks; and what it refuses by name."""

import ctypes
import pickle

import control as ct
import numpy as np
import pytest
import user_functions
from examples import many, some
from scipy.special import ber
from user_function_checks import quiet

import nlctl
from nlctl.errors import DivergedError, ParameterError, UsageError
from nlctl.expressions.functions import FUNCTIONS
from nlctl.expressions.graph import numpy_function
from nlctl.native.machine.routine import entry
from nlctl.native.taylor.method import order_for
from nlctl.native.taylor.routine import Series, series

flint = pytest.importorskip("flint")
ORDER = 12
SERIES = {  # each function of the table, of power series
    "exp": lambda x: x.exp(),
    "sin": lambda x: x.sin(),
    "cos": lambda x: x.cos(),
    "tanh": lambda x: 1 - 2 / ((2 * x).exp() + 1),
    "sqrt": lambda x: x.sqrt(),
    "log": lambda x: x.log(),
    "log2": lambda x: x.log() / flint.arb(2).log(),
    "log10": lambda x: x.log() / flint.arb(10).log(),
    "log1p": lambda x: (1 + x).log(),
    "expm1": lambda x: x.exp() - 1,
    "erf": lambda x: x.erf(),
    "erfc": lambda x: 1 - x.erf(),
    "exp2": lambda x: (x * flint.arb(2).log()).exp(),
    "tan": lambda x: x.sin() / x.cos(),
    "sinh": lambda x: (x.exp() - (-x).exp()) / 2,
    "cosh": lambda x: (x.exp() + (-x).exp()) / 2,
    "arcsin": lambda x: x.asin(),
    "arccos": lambda x: x.acos(),
    "arctan": lambda x: x.atan(),
    "arcsinh": lambda x: (x + (x * x + 1).sqrt()).log(),
    "arccosh": lambda x: (x + (x * x - 1).sqrt()).log(),
    "arctanh": lambda x: ((1 + x) / (1 - x)).log() / 2,
    "cbrt": lambda x: (x.log() / 3).exp(),
    "absolute": lambda x: x,
    "sign": lambda x: 0 * x + 1,
    "heaviside": lambda x, y: 0 * x + 1,
    "copysign": lambda x, y: x,
    "floor": lambda x: 0 * x,
    "ceil": lambda x: 0 * x + 1,
    "trunc": lambda x: 0 * x,
    "rint": lambda x: 0 * x,
    "remainder": lambda x, y: x,  # 0.4 % 0.9
    "fmod": lambda x, y: x,
    "floor_divide": lambda x, y: 0 * x,
    "minimum": lambda x, y: x,
    "maximum": lambda x, y: y,
    "arctan2": lambda y, x: (y / x).atan(),
    "hypot": lambda x, y: (x * x + y * y).sqrt(),
    "logaddexp": lambda x, y: (x.exp() + y.exp()).log(),
}
START = {"arccosh": (1.7, 2.9)}


def autonomous(rates, states, **more):
    """Return a compiled diagram x' = rates(t, x), whose outputs are its states."""
    system = ct.nlsys(
        lambda t, x, u, p: rates(t, x), None, inputs=0, outputs=states, states=states, name="loop",
        **more,
    )  # fmt: skip
    return nlctl.compile(system)


def coefficients(compiled, t, x, order=ORDER):
    """Return the Taylor coefficients of the solution through x, shape (order + 1, states)."""
    p = compiled.parameter_vector()[:, None]
    made = series(compiled, p, 1)
    c = made.parameters(p, order=order, rtol=1e-6, atol=1e-8)
    k = np.zeros((order + 1, made.layout.rows, 1))
    still = np.zeros((compiled.schedule.ninputs, 1))
    given = np.array([t]), np.array(x, dtype=float)[:, None], still, still, c, k
    fill = entry(made.functions[0])
    if callable(fill):
        fill(*given)
    else:
        call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(given))(fill)
        call(*(array.ctypes.data for array in given))
    return k[:, : len(x), 0]


def run(compiled, times, x0, **more):
    return nlctl.input_output_response(compiled, times, 0, x0, method="taylor", **more)


# -- coefficients


@pytest.mark.parted
@pytest.mark.parametrize("name", sorted(SERIES))
def test_the_coefficients_of_each_function_are_those_of_its_power_series(name):
    """z' = f(x, y) along x' = 1 - 0.3 x^2, y' = x: against python-flint's series of x and y."""
    function = numpy_function(name)
    count = FUNCTIONS[name].count
    compiled = autonomous(lambda t, x: [1.0 - 0.3 * x[0] ** 2, x[0], function(*x[:count])], 3)
    x0 = (*START.get(name, (0.4, 0.9)), 0.0)
    found = coefficients(compiled, 0.0, x0)
    flint.ctx.cap = ORDER
    x, y = (flint.arb_series(found[:ORDER, i].tolist()) for i in range(2))
    wanted = SERIES[name](*(x, y)[:count])
    wanted = [float(wanted[k].mid()) for k in range(ORDER)]
    scale = np.max(np.abs(wanted))
    rates = found[1:, 2] * np.arange(1, ORDER + 1)
    assert rates == pytest.approx(wanted, rel=1e-9, abs=1e-12 * scale)


def test_every_function_of_the_table_is_tested_here_or_refused():
    refused = {name for name, row in FUNCTIONS.items() if row.series == "unknown"}
    assert refused | set(SERIES) == set(FUNCTIONS)
    assert not refused & set(SERIES)


@pytest.mark.parametrize("name", sorted(n for n, r in FUNCTIONS.items() if r.series == "unknown"))
def test_a_function_without_coefficients_is_refused_by_name(name):
    function = getattr(np, name)
    given = FUNCTIONS[name].count
    compiled = autonomous(lambda t, x: [x[1], function(*(x + 1.5)[:given])], 2)
    with pytest.raises(ParameterError, match=f"'loop' cannot .*'{name}'.*method='tsit5'"):
        run(compiled, [0.0, 1.0], [0.3, 0.2])
    assert nlctl.input_output_response(compiled, [0.0, 0.1], 0, [0.3, 0.2]).states.size


def test_coefficients_of_products_quotients_and_time():
    """x = exp(sin t) - 2, y = t^3 / (1 + t^2): against flint's own quotient and composition."""
    compiled = autonomous(
        lambda t, x: [np.cos(t) * (x[0] + 2.0), (3 * t**2 + t**4) / ((1.0 + t**2) * (1.0 + t**2))],
        2,
    )
    flint.ctx.cap = ORDER + 1
    t = flint.arb_series([0.7, 1])
    exact = [t.sin().exp() - 2, t**3 / (1 + t**2)]
    found = coefficients(compiled, 0.7, [float(e[0].mid()) for e in exact])
    for i, each in enumerate(exact):
        wanted = [float(each[k].mid()) for k in range(ORDER + 1)]
        assert found[:, i] == pytest.approx(wanted, rel=1e-10, abs=1e-12)


def test_coefficients_of_vectors_are_those_of_their_elements():
    """A network of 20 nodes, as a loop, and as twenty numbers."""
    centres = np.linspace(-1.0, 1.0, 20)

    def network(t, x):
        psi = np.exp(-((x[0] - centres) ** 2))
        return np.concatenate([[-x[0] + psi @ x[1:]], x[0] * psi - 0.1 * x[1:]])

    x = np.random.default_rng(1).normal(size=21)
    found = coefficients(autonomous(network, 21), 0.0, x)
    states = [flint.arb_series([v]) for v in x.tolist()]
    for k in range(ORDER):  # order by order from the integral of the right-hand side
        flint.ctx.cap = k + 2
        psi = [(-((states[0] - float(c)) ** 2)).exp() for c in centres]
        rates = [-states[0] + sum(p * w for p, w in zip(psi, states[1:], strict=True))]
        rates += [states[0] * p - 0.1 * w for p, w in zip(psi, states[1:], strict=True)]
        states = [flint.arb_series([v]) + r.integral() for v, r in zip(x.tolist(), rates,
                                                                       strict=True)]  # fmt: skip
    wanted = [[float(s[k].mid()) for s in states] for k in range(ORDER + 1)]
    assert found == pytest.approx(np.array(wanted), rel=1e-9, abs=1e-9)


INTEGERS = {"floor", "ceil", "trunc", "rint", "remainder", "fmod", "floor_divide"}


def located(compiled):
    """Return the conditions of a diagram."""
    return compiled.equations.conditions.located


def defect(compiled, k, t, h):
    """Return how far a polynomial's slope is at h from the right-hand side, relatively."""
    powers = h ** np.arange(len(k))
    rates = np.arange(1, len(k))[:, None] * k[1:]
    wanted = compiled.dynamics(t + h, powers @ k, np.zeros(compiled.schedule.ninputs))
    return np.max(np.abs(powers[:-1] @ rates - wanted)) / (1.0 + np.max(np.abs(wanted)))


@pytest.mark.slow
@pytest.mark.parametrize("states", [2, pytest.param(9, marks=pytest.mark.weekly)])
def test_polynomials_of_users_functions_have_the_slopes_of_their_functions(states):
    """Wherever there are coefficients, at a distance at which the last term is 1e-9.

    Where a kink or jump lies within that distance: at a hundredth of it, and of what rounds its
    arguments, at a hundredth of that.
    """
    judged, beyond = 0, []
    for case in some(user_functions.ENTRIES, part=6):
        x = np.random.default_rng(2).uniform(0.3, 0.9, states)
        with quiet():
            try:
                compiled = nlctl.compile(user_functions.system(case.make(states), case.name))
                if compiled.system.nstates != states:
                    continue
                k = coefficients(compiled, 0.31, x, order=10)
            except UsageError:  # not compiled, or refused
                continue
            last = np.max(np.abs(k[-2:]))
            if not (np.isfinite(k).all() and last > 0.0):
                continue
            h = min((1e-9 / last) ** (1 / 9), 0.1)
            if not defect(compiled, k, 0.31, h) < 1e-6:
                beyond.append(case.name)
                near = 1e-4 if INTEGERS & {c.what for c in located(compiled)} else 0.01
                assert defect(compiled, k, 0.31, near * h) < 1e-6, case.name
        judged += 1
    assert judged > many(50, part=6)
    assert len(beyond) < 0.1 * judged, beyond


def test_at_a_kink_the_side_counts_on_which_the_solution_goes_on():
    """x(0) = 0 in |x|, max(x, 0) and where(x > 0, ...): the coefficients are those of x > 0."""
    compiled = autonomous(
        lambda t, x: [
            1.0 + x[0],
            abs(x[0]),
            np.maximum(x[0], 0.0),
            np.where(x[0] > 0, x[0], 5.0 * x[0]),
        ],
        4,
    )
    found = coefficients(compiled, 0.0, [0.0] * 4)
    for i in range(1, 4):
        assert found[2:, i] * np.arange(2, ORDER + 1) == pytest.approx(found[1:-1, 0])


# -- steps


def test_exact_solutions_to_twelve_digits():
    """Linear, logistic, and a quotient in t."""
    compiled = autonomous(lambda t, x: [x[1], -x[0], x[2] * (1.0 - x[2]), -2.0 * t * x[3] ** 2], 4)
    times = np.linspace(0.0, 10.0, 41)
    found = run(compiled, times, [0.0, 1.0, 0.1, 1.0], rtol=1e-13, atol=1e-14).states
    exact = [np.sin(times), np.cos(times), 1 / (1 + 9 * np.exp(-times)), 1 / (1 + times**2)]
    assert np.max(np.abs(found - exact)) < 2e-12


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10])
def test_the_error_follows_the_tolerance(rtol):
    compiled = autonomous(lambda t, x: [x[1], -np.sin(x[0])], 2)
    times = np.linspace(0.0, 20.0, 7)
    exact = nlctl.input_output_response(
        compiled, times, 0, [2.0, 0.0], method="tsit5", rtol=1e-13, atol=1e-14
    ).states
    found = run(compiled, times, [2.0, 0.0], rtol=rtol, atol=rtol).states
    assert np.max(np.abs(found - exact)) < 100 * rtol


def test_fixed_steps_converge_with_the_order_of_the_polynomial():
    """Halving the step divides the error by 2^p: p = 6 for rtol = 1e-3."""
    compiled, p = autonomous(lambda t, x: [x[1], -np.sin(x[0])], 2), order_for(1e-3)
    exact = run(compiled, [0.0, 4.0], [1.0, 0.0], rtol=1e-13, atol=1e-14).states[:, -1]
    errors = [
        np.max(
            np.abs(run(compiled, [0.0, 4.0], [1.0, 0.0], rtol=1e-3, step=h).states[:, -1] - exact)
        )
        for h in (0.4, 0.2, 0.1)
    ]
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([p, p], abs=0.7)


def test_dense_output_is_as_exact_as_the_steps():
    compiled = autonomous(lambda t, x: [x[1], -x[0]], 2)
    times = np.linspace(0.0, 10.0, 1001)
    found = run(compiled, times, [0.0, 1.0], rtol=1e-10, atol=1e-12)
    assert found.statistics.accepted < 60
    assert np.max(np.abs(found.states[0] - np.sin(times))) < 1e-9


def test_kepler_keeps_its_energy_and_comes_back():
    """Eccentricity 0.9, ten turns."""

    def kepler(t, x):
        r3 = (x[0] ** 2 + x[1] ** 2) * np.sqrt(x[0] ** 2 + x[1] ** 2)
        return [x[2], x[3], -x[0] / r3, -x[1] / r3]

    e = 0.9
    x0 = [1 - e, 0.0, 0.0, np.sqrt((1 + e) / (1 - e))]
    found = run(autonomous(kepler, 4), [0.0, 20 * np.pi], x0, rtol=1e-12, atol=1e-14).states[:, -1]
    energy = 0.5 * (found[2] ** 2 + found[3] ** 2) - 1 / np.hypot(found[0], found[1])
    assert energy == pytest.approx(-0.5, abs=1e-10)
    assert found == pytest.approx(x0, abs=1e-6)  # where the acceleration is 100


def test_inputs_are_linear_between_break_points():
    """x' = u for a triangle and x' = -x + u for steps: exact integrals."""
    system = nlctl.compile(
        ct.nlsys(lambda t, x, u, p: [u[0], u[0] * u[0]], None, inputs=1, outputs=2, states=2,
                 name="integrals")
    )  # fmt: skip
    times, u = np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 2.0, -1.0, 0.0])
    found = nlctl.input_output_response(system, times, u, method="taylor")
    assert found.states[0] == pytest.approx([0.0, 1.0, 2.0, 1.5], abs=1e-12)
    squares = np.diff(times) * (u[:-1] ** 2 + u[:-1] * u[1:] + u[1:] ** 2) / 3
    assert found.states[1] == pytest.approx([0.0, *np.cumsum(squares)], abs=1e-12)


def test_a_run_that_diverges_says_so():
    with pytest.raises(DivergedError):
        run(autonomous(lambda t, x: [x[0] ** 2], 1), [0.0, 2.0], [1.0])
    with pytest.raises(DivergedError):
        run(autonomous(lambda t, x: [np.log(x[0]) - 1.0], 1), [0.0, 5.0], [0.5])


def test_a_sampled_loop_is_expanded_anew_at_each_sample():
    plant = ct.nlsys(
        lambda t, x, u, p: [x[1], -np.sin(x[0]) - 0.3 * x[1] + u[0]], lambda t, x, u, p: [x[0]],
        inputs=["u"], outputs=["y"], states=2, name="plant",
    )  # fmt: skip
    law = ct.ss([[-1.0]], [[1.0]], [[-2.0]], [[-1.0]], inputs=["y"], outputs=["u"], name="law")
    sampled = nlctl.sampled(law, 0.1, method="euler")
    compiled = nlctl.compile(nlctl.interconnect([plant, sampled], outputs=["y"], name="loop"))
    times = np.linspace(0.0, 5.0, 81)
    exact, found = (
        nlctl.input_output_response(
            compiled, times, initial_state={"plant.x[0]": 1.0}, method=method, rtol=1e-10,
            atol=1e-12,
        ).states
        for method in ("tsit5", "taylor")
    )  # fmt: skip
    assert np.max(np.abs(found - exact)) < 5e-9


def test_a_compiled_diagram_that_was_pickled_runs_the_same():
    compiled = nlctl.compile(nlctl.paper.example_1())
    again = pickle.loads(pickle.dumps(compiled))
    runs = [
        nlctl.input_output_response(each, [0.0, 1.0], method="taylor").states
        for each in (compiled, again)
    ]
    assert np.array_equal(*runs)


# -- kinks


def test_a_dead_zone_behind_a_sine_has_its_closed_form():
    """v = u - 1/2 for u = sin t > 1/2, and u + 1/2 below: the integral of v, with its kinks as
    events."""
    zone = nlctl.DeadZone(b_r=0.5, b_l=-0.5)
    source = ct.nlsys(None, lambda t, x, u, p: [np.sin(t)], inputs=0, outputs=["u"], name="source")
    sink = ct.nlsys(lambda t, x, u, p: [u[0]], None, inputs=["v"], outputs=1, states=1, name="sum")
    loop = nlctl.interconnect([source, nlctl.block(zone, "zone"), sink], outputs=["v"], name="sine")
    compiled = nlctl.compile(loop)
    times = np.linspace(0.0, 20.0, 101)
    exact = nlctl.input_output_response(compiled, times, method="tsit5", rtol=1e-12, atol=1e-14)
    found = nlctl.input_output_response(compiled, times, method="taylor", rtol=1e-10, atol=1e-12)
    assert found.statistics.events >= 12
    assert np.max(np.abs(found.states - exact.states)) < 1e-9


@pytest.mark.parted
@pytest.mark.parametrize(
    ("kink", "integral"),
    [
        (abs, lambda t: 2 * np.floor(t / np.pi) + 1 - np.cos(t % np.pi)),
        (
            lambda s: np.where(s > 0.0, s, 0.0),
            lambda t: (
                2 * np.ceil(np.floor(t / np.pi) / 2)
                + (np.floor(t / np.pi) % 2 == 0) * (1 - np.cos(t % np.pi))
            ),
        ),
        (
            lambda s: np.maximum(s, -s),
            lambda t: 2 * np.floor(t / np.pi) + 1 - np.cos(t % np.pi),
        ),
        (np.sign, lambda t: np.pi / 2 - abs(t % (2 * np.pi) - np.pi) + np.pi / 2),
    ],
    ids=["abs", "where", "maximum", "sign"],
)
def test_kinks_and_jumps_that_no_block_declares(kink, integral):
    """The slope at the end of a step, and the sides of what is compared, see them."""
    compiled = autonomous(lambda t, x: [kink(np.sin(t))], 1)
    times = np.linspace(0.0, 20.0, 101)
    found = run(compiled, times, [0.0], rtol=1e-9, atol=1e-10)
    assert found.states[0] == pytest.approx(integral(times), abs=2e-7)


def test_a_short_excursion_to_another_side_is_not_stepped_over():
    """max(cos t - 0.99, 0) is not 0 for 0.14 s around each turn; steps are ten times as long."""
    compiled = autonomous(lambda t, x: [np.maximum(np.cos(t) - 0.99, 0.0), x[1] * 0.0], 2)
    a = np.arccos(0.99)
    found = run(compiled, [-3.0, 3.0], [0.0, 0.0], rtol=1e-10, atol=1e-10)
    assert found.states[0, -1] == pytest.approx(2 * (np.sin(a) - 0.99 * a), abs=1e-8)


def test_a_touch_between_two_looks_is_seen():
    """x1 = cos t is above 0.99999 for 9 ms each turn: seen by where its slope is 0."""
    compiled = autonomous(lambda t, x: [x[1], -x[0], np.maximum(x[0] - 0.99999, 0.0)], 3)
    a = np.arccos(0.99999)
    once = 2 * (np.sin(a) - 0.99999 * a)
    found = run(compiled, [1.0, 1.0 + 6 * np.pi], [np.cos(1.0), -np.sin(1.0), 0.0], rtol=1e-12)
    assert found.states[2, -1] == pytest.approx(3 * once, rel=1e-4)


def test_a_jump_at_the_very_beginning_is_left_behind():
    """A square wave sign(sin 20 t) from t = 0 on, where it is not yet 1: its integral."""
    compiled = autonomous(lambda t, x: [np.where(np.sin(20.0 * t) > 0.0, 1.0, -1.0)], 1)
    times = np.linspace(0.0, 3.0, 31)
    part = (20.0 * times) % (2 * np.pi)
    exact = np.minimum(part, 2 * np.pi - part) / 20.0
    for rtol in (1e-6, 1e-8, 1e-10):
        found = run(compiled, times, [0.0], rtol=rtol, atol=rtol).states[0]
        assert np.max(np.abs(found - exact)) < 1e4 * rtol


def test_a_comparison_that_does_not_matter_is_passed_as_any_other():
    """Both branches are the same: two more steps for each event, before it and across."""
    plain = run(autonomous(lambda t, x: [x[1], -x[0]], 2), [0.0, 20.0], [0.0, 1.0])
    compared = run(
        autonomous(lambda t, x: [x[1], np.where(x[0] > 0, -1.0 * x[0], x[0] * -1.0 + 0.0)], 2),
        [0.0, 20.0], [0.0, 1.0],
    )  # fmt: skip
    steps = plain.statistics.accepted + 2 * compared.statistics.events
    assert compared.statistics.events == 7  # at t = 0, and six times after
    assert compared.statistics.accepted <= steps + 2


@pytest.mark.parametrize(
    "friction", [nlctl.actuators.Stribeck(), nlctl.actuators.LuGre(sigma_0=100.0)],
    ids=["Stribeck", "LuGre"],
)  # fmt: skip
def test_a_narrow_peak_before_an_event_is_seen(friction):
    """exp(-(v / v_s)^2) of friction is 0 to all digits where a step begins that ends at v = 0."""
    block = nlctl.block(friction, "friction")
    (given,), (taken,) = block.input_labels, block.output_labels
    source = ct.nlsys(
        None, lambda t, x, u, p: [1.7 * np.sin(1.3 * t) + 0.4 * np.sin(4.1 * t + 0.3)],
        inputs=0, outputs=[given], name="source",
    )  # fmt: skip
    sink = ct.nlsys(
        lambda t, x, u, p: [u[0] - x[0]], None, inputs=[taken], outputs=["z"], states=1, name="lag"
    )
    compiled = nlctl.compile(nlctl.interconnect([source, block, sink], outputs=["z"], name="loop"))
    times = np.linspace(0.0, 6.0, 61)
    exact, found = (
        nlctl.input_output_response(compiled, times, method=method, rtol=rtol, atol=rtol / 100)
        for method, rtol in (("tsit5", 1e-10), ("taylor", 1e-8))
    )
    assert np.max(np.abs(found.states - exact.states)) < 2e-7


# -- what is refused


def test_a_diagram_without_states_is_refused():
    static = nlctl.compile(ct.nlsys(None, lambda t, x, u, p: [u[0]], inputs=1, outputs=1, name="k"))
    with pytest.raises(ParameterError, match="'k' has no states"):
        nlctl.input_output_response(static, [0.0, 1.0], [0.0, 1.0], method="taylor")


def test_an_algebraic_loop_and_a_function_called_as_it_stands_are_refused():
    """They have no expressions; the message names what it is."""
    called = autonomous(lambda t, x: [-ber(x[0])], 1)
    with pytest.raises(ParameterError, match=r"'loop' cannot .* called unchanged.*'tsit5'"):
        run(called, [0.0, 1.0], [1.0])


def test_what_it_cannot_do_is_refused_by_name():
    relay = nlctl.interconnect(
        {
            "plant": ct.nlsys(lambda t, x, u, p: [u[0]], lambda t, x, u, p: [x[0]], inputs=["v"],
                              outputs=["u"], states=1, name="plant"),
            "relay": nlctl.IdealRelay(),
        },
        outputs=["u"],
    )  # fmt: skip
    with pytest.raises(ParameterError, match=r"an ideal relay .*method='tsit5'"):
        nlctl.input_output_response(relay, [0.0, 1.0], method="taylor", engine="native")


# -- the examples, ensembles


def test_example_1_agrees_with_the_explicit_pair():
    compiled = nlctl.compile(nlctl.paper.example_1())
    times = np.linspace(0.0, 5.0, 51)
    exact, found = (
        nlctl.input_output_response(compiled, times, method=method, rtol=1e-12, atol=1e-14)
        for method in ("tsit5", "taylor")
    )
    assert np.max(np.abs(found.states - exact.states)) < 1e-10
    assert found.statistics.accepted < exact.statistics.accepted / 10


def test_members_do_not_depend_on_each_other_or_on_threads():
    compiled = nlctl.compile(nlctl.paper.example_1())
    times = np.linspace(0.0, 2.0, 21)

    def signals(values, threads):
        made = nlctl.ensemble_response(
            compiled, times, params={"law.beta": values}, method="taylor", threads=threads,
            keep=["e"], rtol=1e-8, atol=1e-10,
        )  # fmt: skip
        assert (made.table["status"] == "OK").all()
        return made.signals["e"]

    values = np.linspace(1.0, 4.0, 20)
    all_of_them = signals(values, 1)
    assert np.array_equal(all_of_them, signals(values, 2))
    assert np.array_equal(all_of_them[3:12], signals(values[3:12], 1))
    one = nlctl.input_output_response(
        compiled, times, params={"law.beta": values[5]}, method="taylor"
    )
    assert all_of_them[5] == pytest.approx(
        one.outputs[list(one.output_labels).index("e")], abs=1e-8
    )


def test_parameters_change_without_compiling_again():
    compiled = nlctl.compile(nlctl.paper.example_1())
    times = np.linspace(0.0, 1.0, 5)
    for beta in (1.0, 3.0):
        exact, found = (
            nlctl.input_output_response(
                compiled, times, params={"law.beta": beta}, method=method, rtol=1e-10
            ).states
            for method in ("tsit5", "taylor")
        )
        assert np.max(np.abs(found - exact)) < 1e-8
    assert len(compiled.cache.of(Series)) == 1


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_what_is_passed_and_passed_back_in_one_step(rtol):
    """max(y, 0) with y = (t - 1) (t - 1.4): a step from right behind 1 would end behind 1.4."""
    kink = ct.nlsys(
        lambda t, x, u, p: [2 * t - 2.4, max(x[0], 0.0)], lambda t, x, u, p: x, inputs=0,
        outputs=2, states=2, name="kink",
    )  # fmt: skip
    made = nlctl.input_output_response(kink, [0, 3], 0, [1.4, 0.0], method="taylor", rtol=rtol)
    assert np.allclose(made.events["time"], [1.0, 1.4], rtol=0, atol=100 * rtol)
    whole = np.polyint([1.0, -2.4, 1.4])
    area = np.polyval(whole, 1.0) - np.polyval(whole, 1.4) + np.polyval(whole, 3.0)
    assert abs(made.states[1, -1] - area) < 10 * rtol

"""Loops that take more passes than are written out: the function is called, and it is said."""

import warnings

import control as ct
import numpy as np
import pytest
from scipy import integrate, optimize, special
from scipy.integrate import solve_ivp

import nlctl
from nlctl import errors


def loop(update):
    """A diagram of one state."""
    return ct.nlsys(update, None, inputs=0, outputs=["x"], states=["x"], name="s")


def slow_fixed_point(t, x, u, params):
    """y = cos(y) + x / 10 by small steps: hundreds of passes."""
    y = 0.0
    while abs(y - np.cos(y) - 0.1 * x[0]) > 1e-12:
        y = y - 0.05 * (y - np.cos(y) - 0.1 * x[0])
    return [-y]


def flat_root(t, x, u, params):
    """A root of order 3, which Brent's method nears slowly: more than a hundred passes."""
    root = optimize.brentq(lambda y: (y - 0.1 * x[0]) ** 3, -1.0, 1.0, maxiter=500)
    return [-root]


BEYOND = {
    "tolerance": (
        slow_fixed_point,
        lambda x: optimize.brentq(lambda y: y - np.cos(y) - 0.1 * x, 0, 2),
    ),
    "brentq": (flat_root, lambda x: 0.1 * x),
}


@pytest.mark.parted
@pytest.mark.parametrize("name", BEYOND)
def test_where_a_loop_takes_more_passes_than_are_written_out_its_function_is_called(name):
    """In single runs and in members, in continuous and in discrete time; and it is said."""
    function, root = BEYOND[name]
    timepts, compiled = np.linspace(0.0, 1.0, 5), nlctl.compile(loop(function))
    assert not compiled.equations.calls
    assert "a run that takes more calls the update function of block 's'" in str(compiled)
    response = nlctl.input_output_response(compiled, timepts, initial_state=1.0)
    assert response.statistics.called == ("update function of block 's'",)
    assert "called   update function of block 's': a loop takes more passes" in str(response)
    exact = solve_ivp(lambda t, x: -root(x[0]), (0, 1), [1.0], rtol=1e-11, atol=1e-12,
                      t_eval=timepts)  # fmt: skip
    assert response.states == pytest.approx(exact.y, abs=1e-7)
    many = nlctl.ensemble_response(
        compiled, timepts, initial_state=np.array([[1.0], [0.5]]), keep=["x"], threads=1
    )
    assert many.signals["x"][0] == pytest.approx(exact.y[0], abs=1e-7)
    assert set(many.table["status"]) == {"OK"}


def test_the_next_states_of_a_discrete_diagram_are_called_where_passes_do_not_suffice():
    system = ct.nlsys(slow_fixed_point, None, inputs=0, outputs=1, states=1, dt=1.0, name="s")
    response = nlctl.input_output_response(system, np.arange(4.0), initial_state=1.0)
    states = [1.0]
    for _ in range(3):
        states += slow_fixed_point(0.0, states[-1:], None, {})
    assert response.states[0] == pytest.approx(states, abs=1e-12)


def quick_or_slow(t, x, u, params):
    """Newton's method where x < 2, small steps beyond."""
    y, step = 0.5 + 0.01 * np.tanh(x[0]), 1.0 if x[0] < 2 else 0.05
    while abs(y - np.cos(y)) > 1e-12:
        y = y - step * (y - np.cos(y)) / (1 + np.sin(y))
    return [y]


@pytest.mark.weekly
def test_only_members_that_take_more_passes_call_the_function():
    """The others stay what they are alone."""
    timepts, compiled = np.linspace(0.0, 0.5, 3), nlctl.compile(loop(quick_or_slow))
    slope = optimize.brentq(lambda y: y - np.cos(y), 0, 1)
    starts = [0.0, 1.9, 0.5]
    for start in starts:
        response = nlctl.input_output_response(compiled, timepts, initial_state=start)
        crosses = start + 0.5 * slope > 2
        assert bool(response.statistics.called) == crosses
        assert response.states[0] == pytest.approx(start + slope * timepts, abs=1e-9)
    many = nlctl.ensemble_response(
        compiled, timepts, initial_state=np.array(starts)[:, None], keep=["x"], threads=1
    )
    wanted = np.array(starts)[:, None] + slope * timepts
    assert many.signals["x"] == pytest.approx(wanted, abs=1e-9)


# python-control's, which `pytest.warns` repeats as this module's
@pytest.mark.filterwarnings("ignore:Setting the shape on a NumPy array:DeprecationWarning")
def test_derivatives_of_runs_are_differences_where_passes_do_not_suffice():
    """d(exp(-t/10) x0) / dx0."""
    with pytest.warns(errors.InexactWarning):
        made = nlctl.sensitivity_response(
            loop(flat_root), [0.0, 1.0], initial_state=[1.0], with_respect_to=["s.x(0)"]
        )
    assert made["x", "s.x(0)"][-1] == pytest.approx(np.exp(-0.1), abs=1e-5)


def test_a_stepper_says_which_loop_takes_more_passes():
    stepper = nlctl.stepper(nlctl.compile(loop(slow_fixed_point)), 0.1)
    stepper.reset([1.0])
    with pytest.raises(errors.DivergedError, match="a loop in the update function of block 's'"):
        stepper.step()


@pytest.mark.parametrize("name", BEYOND)
def test_values_and_derivatives_at_a_point_are_those_of_the_function_itself(name):
    """y - cos y = x / 10 has the slope 0.1 / (1 + sin y), a root of order three that of x / 10."""
    function, root = BEYOND[name]
    compiled, y = nlctl.compile(loop(function)), root(1.0)
    assert compiled.dynamics(0.0, [1.0]) == pytest.approx([-y], abs=1e-11)
    slope = -0.1 / (1 + np.sin(y)) if name == "tolerance" else -0.1
    with pytest.warns(errors.InexactWarning, match="takes more passes"):
        linear = compiled.linearize([1.0])
    assert linear.A[0, 0] == pytest.approx(slope, rel=1e-4)


def area(t, x, u, params):
    """Smooth where x is small; a narrow peak, which QUADPACK divides the range for, where not."""
    return [-integrate.quad(lambda s: np.exp(-((x[0] * (s - 0.3)) ** 2)), 0.0, 1.0)[0]]


def exact_area(k):
    return np.sqrt(np.pi) / (2 * k) * (special.erf(0.7 * k) + special.erf(0.3 * k))


def test_an_integral_is_written_out_where_one_sum_suffices_and_called_elsewhere():
    compiled = nlctl.compile(loop(area))
    assert not compiled.equations.calls
    for k in (0.1, 0.5, 1.0, 2.0, 3.0):
        found = compiled.native[0], np.empty(1)
        found[0](0.0, np.array([k]), np.empty(0), np.empty(0), found[1], np.empty(0), np.empty(0))
        assert found[1][0] == pytest.approx(area(0.0, [k], None, {})[0], abs=1e-14)
        assert -found[1][0] == pytest.approx(exact_area(k), abs=1e-12)
    for k in (30.0, 200.0):
        assert compiled.dynamics(0.0, [k])[0] == area(0.0, [k], None, {})[0]
    response = nlctl.input_output_response(compiled, [0.0, 0.1], initial_state=30.0)
    assert response.statistics.called


def test_lamberts_function_solves_its_equation_and_is_called_below_its_turn():
    """w e^w = z; below -1/e there is no real one, and SciPy's has the real part that it has."""
    compiled = nlctl.compile(loop(lambda t, x, u, p: [special.lambertw(x[0]).real]))
    for z in [-0.35, -0.1, 0.0, 1e-9, 0.3, 1.4, 1.6, 2.9, 3.1, 50.0, 1e6, 1e300]:
        (w,) = compiled.dynamics(0.0, [z])
        assert w == pytest.approx(special.lambertw(z).real, rel=1e-14, abs=1e-300)
        assert w * np.exp(w) == pytest.approx(z, rel=1e-12 * (1 + abs(w)), abs=1e-300)
    assert not compiled.equations.calls
    assert compiled.dynamics(0.0, [-0.9])[0] == special.lambertw(-0.9).real


def caught(t, x, u, params):
    """More passes than are written out are no error that somebody could catch."""
    try:
        y = integrate.quad(lambda s: np.exp(-((x[0] * (s - 0.3)) ** 2)), 0.0, 1.0)[0]
    except RuntimeError:
        y = 99.0
    return [-y]


def test_what_is_not_written_out_is_no_error():
    assert nlctl.compile(loop(caught)).dynamics(0.0, [80.0])[0] == area(0.0, [80.0], None, {})[0]


REMEDIES = {
    "algebraic loop": lambda x: optimize.fsolve(lambda z: z + np.sin(z) - x[0], [x[0], 1.0])[0],
    "scipy.optimize.brentq": lambda x: optimize.toms748(lambda z: z**3 + z - x[0], -9, 9),
    "CubicSpline": lambda x: special.yv(2, x[0]),
    "a finite one": lambda x: integrate.quad(lambda s: np.exp(-s) * x[0], 0, np.inf)[0],
    "states of the block": lambda x: solve_ivp(lambda t, y: -y, (0, 1), [x[0]]).y[0, -1],
}


@pytest.mark.parametrize("remedy", REMEDIES)
def test_what_is_called_says_what_to_do(remedy):
    function = REMEDIES[remedy]
    compiled = nlctl.compile(loop(lambda t, x, u, p: [-function(x)]))
    (line,) = [line for line in str(compiled).splitlines() if line.startswith("  unchanged ")]
    assert remedy in line


def counted_root(x, params):
    """Small steps towards y = cos(y) + k x, so many at most."""
    y = 0.0
    for _ in range(int(params["n"])):
        step = 0.05 * (y - np.cos(y) - params["k"] * x)
        if abs(step) < 1e-13:
            break
        y = y - step
    return y


def counted_loop(n):
    return ct.nlsys(
        lambda t, x, u, params: [u[0] - counted_root(x[0], params)], None, inputs=["u"],
        outputs=["x"], states=["x"], params={"n": n, "k": 0.1}, name="s",
    )  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize(("here", "there"), [(10, 200), (200, 10)])
def test_whether_passes_suffice_is_asked_of_the_integers_of_the_call(here, there):
    """All passes of 10 are written out, of 200 not; derivatives by differences of the function."""
    params, h = {"n": there, "k": 0.1}, 1e-5
    compiled = nlctl.compile(counted_loop(here))
    root = counted_root(1.0, params)
    assert compiled.dynamics(0.0, [1.0], [0.0], params=params) == pytest.approx([-root], abs=1e-13)
    slope = (counted_root(1.0 + h, params) - counted_root(1.0 - h, params)) / (2 * h)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", errors.InexactWarning)
        linear = compiled.linearize([1.0], [0.0], params=params)
        by_k = compiled.parameter_jacobian(["s.k"], [1.0], [0.0], params=params)[0]
        point = nlctl.find_operating_point(compiled, [0.5], 0.3, params=params)
        response = nlctl.frequency_response(compiled, [2.0], at=[1.0], params=params)
        given = {"initial_state": [1.0], "params": params}
        made = nlctl.sensitivity_response(compiled, [0, 1], 0.0, with_respect_to="s.k", **given)
    assert linear.A[0, 0] == pytest.approx(-slope, abs=1e-8)
    assert by_k[0, 0] == pytest.approx(-slope / 0.1, abs=1e-7)  # of k x, by x = 1 and k = 0.1
    assert counted_root(point.states[0], params) == pytest.approx(0.3, abs=1e-9)
    assert response.frdata[0, 0, 0] == pytest.approx(1 / (2j + slope), abs=1e-8)
    ends = [
        nlctl.input_output_response(
            compiled, [0, 1], initial_state=[1.0], params=params | {"k": k}, rtol=1e-11, atol=1e-12
        ).states[0, -1]
        for k in (0.1 - 1e-4, 0.1 + 1e-4)
    ]
    assert not made.missing
    assert made["x", "s.k"][-1] == pytest.approx((ends[1] - ends[0]) / 2e-4, abs=1e-6)


def test_a_function_that_other_integers_alone_make_opaque_is_named_in_the_log(caplog):
    """The first machine code that is made is that of other integers than the diagram's."""

    def update(t, x, u, params):
        return [-x[0] * (float(str(float(x[0]))) if params["n"] > 1 else 1.0)]

    system = ct.nlsys(update, None, inputs=0, outputs=["x"], states=["x"], params={"n": 1},
                      name="s")  # fmt: skip
    response = nlctl.input_output_response(system, [0, 1], initial_state=[1.0], params={"n": 2})
    assert response.states[0, -1] == pytest.approx(0.5, abs=1e-6)  # x' = -x^2
    assert "the update function of block 's' is called back in Python" in caplog.text


def by_halves(t, x, u, params):
    """y + y^3 = x by halving an interval so many times: a staircase of 2^45 steps."""
    low, high = -4.0, 4.0
    for _ in range(45):
        middle = 0.5 * (low + high)
        if middle + middle**3 > x[0]:
            high = middle
        else:
            low = middle
    return [-low if low > -3.0 else 0.0]


def halves_to_a_tolerance(t, x, u, params):
    """The same, until the interval is narrow."""
    low, high = -4.0, 4.0
    while high - low > 1e-12:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if middle + middle**3 > x[0] else (middle, high)
    return [-low]


def bisected(t, x, u, params):
    """The same, by SciPy."""
    return [-optimize.bisect(lambda y: y + y**3 - x[0], -4.0, 4.0)]


def halves_of_a_state(t, x, u, params):
    """The same in a bracket that follows the state: with all answers alike it moves with that."""
    low, high = x[0] / 20, x[0]
    for _ in range(45):
        middle = (low + high) / 2
        if middle + middle**3 - x[0] > 0:
            high = middle
        else:
            low = middle
    return [-middle]


def bisected_around(t, x, u, params):
    """The same by SciPy, in a bracket that follows the state."""
    return [-optimize.bisect(lambda y: y + y**3 - x[0], -1.0 - abs(x[0]), 1.0 + abs(x[0]))]


def where_signs_differ(t, x, u, params):
    """The same, with the value at one end."""
    a, b = 0.0, 1.0 + abs(x[0])
    at_a = a + a**3 - x[0]
    for _ in range(50):
        c = a + (b - a) / 2
        at_c = c + c**3 - x[0]
        if at_a * at_c <= 0:
            b = c
        else:
            a, at_a = c, at_c
    return [-c]


@pytest.mark.parted
@pytest.mark.parametrize(
    "update",
    [
        *(by_halves, halves_to_a_tolerance, bisected),
        *(halves_of_a_state, bisected_around, where_signs_differ),
    ],
)
def test_a_search_by_halves_is_called_as_it_stands(update):
    """With y + y^3 = x and x' = -y: ln(y / y0) + 3 (y^2 - y0^2) / 2 = -t, dy/dx = 1/(1 + 3 y^2)."""
    compiled = nlctl.compile(loop(update))
    (call,) = compiled.equations.calls.values()
    assert "a search by halves" in call.reason
    timepts = np.linspace(0.0, 2.0, 5)
    response = nlctl.input_output_response(compiled, timepts, initial_state=10.0)
    y = np.array([np.roots([1, 0, 1, -x])[-1].real for x in response.states[0]])
    np.testing.assert_allclose(np.log(y / 2) + 1.5 * (y**2 - 4), -timepts, atol=1e-5)
    with pytest.warns(errors.InexactWarning):
        slope = compiled.linearize([10.0], []).A
    np.testing.assert_allclose(slope, -1 / 13, rtol=1e-4)


def by_golden_sections(t, x, u, params):
    """The place of the least (y - x / 2)^2, between two that follow the state."""
    part, a, b = (np.sqrt(5.0) - 1.0) / 2, x[0] - 2.0, x[0] + 3.0
    for _ in range(45):
        c, d = b - part * (b - a), a + part * (b - a)
        if (c - 0.5 * x[0]) ** 2 < (d - 0.5 * x[0]) ** 2:
            b = d
        else:
            a = c
    return [-(a + b) / 2]


def test_golden_sections_are_a_search_by_halves():
    compiled = nlctl.compile(loop(by_golden_sections))
    (call,) = compiled.equations.calls.values()
    assert "a search by halves" in call.reason
    with pytest.warns(errors.InexactWarning):
        np.testing.assert_allclose(compiled.linearize([0.5], []).A, -0.5, atol=1e-3)


def sorted_by_exchanges(t, x, u, params):
    """The third of seven numbers: 36 comparisons in turn that exchange, and narrow nothing."""
    row = [x[0], 0.5, x[0] ** 2, 1.5, 2 * x[0], 0.25, 3.0]
    for _ in range(6):
        for i in range(6):
            a, b = row[i], row[i + 1]
            row[i], row[i + 1] = np.where(a > b, b, a), np.where(a > b, a, b)
    return [-row[2]]


def test_sorting_by_exchanges_is_no_search_by_halves():
    """The third of seven is x at 0.45, x^2 at 0.8."""
    compiled = nlctl.compile(loop(sorted_by_exchanges))
    assert not compiled.equations.calls
    np.testing.assert_allclose(compiled.linearize([0.45], []).A, -1.0, rtol=1e-12)
    np.testing.assert_allclose(compiled.linearize([0.8], []).A, -1.6, rtol=1e-12)


def counted_above(t, x, u, params):
    """How many of a few numbers are above a state: a loop of passes, and each of them jumps."""
    count = 0.0
    for limit in (0.25, 0.5, 0.75):
        if x[0] < limit:
            count = count + 1.0
    return [-1.0 - count]


def test_jumps_in_few_passes_are_located():
    """x falls at 1, 2, 3 and 4: from 1 to 1/4 in 1/4 + 1/8 + 1/12, then at 4."""
    compiled = nlctl.compile(loop(counted_above))
    assert len(compiled.equations.conditions.located) == 3
    end = 1 / 4 + 1 / 8 + 1 / 12 + 1 / 8
    response = nlctl.input_output_response(compiled, [0.0, end], initial_state=1.0)
    np.testing.assert_allclose(response.states[0, -1], -0.25, atol=1e-12)

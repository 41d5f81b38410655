"""Transport delays that vary in time: closed forms, two engines, what is refused."""

from math import factorial

import control as ct
import numpy as np
import pytest
from numpy.polynomial import Polynomial
from rows import each_row

import nlctl

ENGINES = ("native", "python-control")
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


def delayed(a, x0=1.0, **fields):
    """x' = a x(t - delay - varying(t))."""
    return nlctl.interconnect(
        {
            "wire": nlctl.TransportDelay(inputs=("x",), outputs=("late",), **fields),
            "plant": ct.ss(0, a, 1, 0, inputs="late", outputs="x", name="plant"),
        },
        outputs=["x", "late"],
    ), {"plant.x[0]": x0}


def pantograph(t, a, q):
    """The solution of x'(t) = a x(q t) with x(0) = 1."""
    return sum(a**k * q ** (k * (k - 1) / 2) * np.power(t, k) / factorial(k) for k in range(40))


@pytest.mark.parted
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("a", "q"), [(-1.0, 0.5), (0.4, 0.8)])
def test_the_pantograph_equation_is_its_power_series(engine, a, q):
    """x'(t) = a x(q t): a delay of (1 - q) t, from t = 1 on."""
    loop, x0 = delayed(
        a, pantograph(1.0, a, q), delay=1 - q, varying=lambda t: (1 - q) * (t - 1),
        history=lambda t: pantograph(t, a, q),
    )  # fmt: skip
    times = np.linspace(1, 6, 26)
    run = nlctl.input_output_response(loop, times, 0, x0, engine=engine, **TIGHT)
    np.testing.assert_allclose(run.outputs[0], pantograph(times, a, q), rtol=3e-9, atol=1e-9)
    np.testing.assert_allclose(run.outputs[1], pantograph(q * times, a, q), rtol=3e-9, atol=1e-9)


def swaying(t):
    return 0.4 * np.sin(t)


def forced():
    """x' = cos t + sin(t - tau) - x(t - tau), tau = 1 + 0.4 sin t: x = sin t."""
    plant = ct.nlsys(
        lambda t, x, u, params: np.cos(t) + np.sin(t - 1 - 0.4 * np.sin(t)) - u[0],
        lambda t, x, u, params: x, inputs=["late"], outputs=["x"], states=1, name="plant",
    )  # fmt: skip
    wire = nlctl.TransportDelay(
        inputs=("x",), outputs=("late",), delay=1.0, varying=swaying, history=np.sin
    )
    return nlctl.interconnect({"plant": plant, "wire": wire}, outputs=["x", "late"])


@pytest.mark.parted
@pytest.mark.parametrize("engine", ENGINES)
def test_a_delay_that_sways(engine):
    times = np.linspace(0, 20, 81)
    run = nlctl.input_output_response(forced(), times, 0, 0, engine=engine, **TIGHT)
    np.testing.assert_allclose(run.outputs[0], np.sin(times), rtol=0, atol=2e-9)
    late = np.sin(times - 1 - swaying(times))
    np.testing.assert_allclose(run.outputs[1], late, rtol=0, atol=2e-9)


def test_errors_fall_with_an_order_of_at_least_4():
    compiled, errors = nlctl.compile(forced()), []
    for step in (0.2, 0.1, 0.05, 0.025):
        run = nlctl.input_output_response(compiled, [0.0, 6.0], 0, 0, step=step)
        errors.append(abs(run.states[0, -1] - np.sin(6.0)))
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 4)


def steps_by_hand(end, slope):
    """x' = -x(t - 1 - slope t) from x(0) = 1 with 0 before: polynomials, and where they begin."""
    begins, parts = [0.0, 1 / (1 - slope)], [Polynomial([1.0])]
    while begins[-1] < end:
        sent = Polynomial([-1.0, 1 - slope])
        rate = -parts[-1](sent)
        part = rate.integ(lbnd=begins[-1])
        parts.append(part + parts[-1](begins[-1]))
        begins.append((begins[-1] + 1) / (1 - slope))
    return begins, parts


@pytest.mark.parted
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("slope", [0.25, -0.5])
def test_breaks_arrive_when_what_broke_does(engine, slope):
    """With the method of steps by hand: steps that grow longer, or shorter."""
    loop, x0 = delayed(-1.0, delay=1.0, varying=lambda t: slope * t)
    end = 6.0 if slope > 0 else 1.9  # the delay ends at t = 2
    times = np.linspace(0, end, 39)
    begins, parts = steps_by_hand(end, slope)
    exact = [parts[np.searchsorted(begins, t, "right") - 1](t) for t in times]
    run = nlctl.input_output_response(loop, times, 0, x0, engine=engine, **TIGHT)
    np.testing.assert_allclose(run.outputs[0], exact, rtol=0, atol=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_kink_of_the_delay_is_met(engine):
    """A ramp that arrives by a delay of 1 that grows from t = 2 to 3 to 1.5: by hand."""
    wire = nlctl.TransportDelay(
        inputs=("u",), outputs=("late",), delay=1.0,
        varying=lambda t: 0.5 * min(max(t - 2.0, 0.0), 1.0),
    )  # fmt: skip
    plant = ct.ss(0, 1, 1, 0, inputs="late", outputs="x", name="plant")
    loop = nlctl.interconnect({"wire": wire, "plant": plant}, inputs=["u"], outputs=["x", "late"])
    times = np.linspace(0, 5, 26)
    run = nlctl.input_output_response(loop, times, times, 0, engine=engine, **TIGHT)
    late = np.where(
        times < 2, np.maximum(times - 1, 0), np.where(times < 3, times / 2, times - 1.5)
    )
    np.testing.assert_allclose(run.outputs[1], late, rtol=0, atol=1e-9)
    between = 0.5 + (times**2 - 4) / 4
    behind = 1.75 + ((times - 1.5) ** 2 - 1.5**2) / 2
    x = np.where(times < 2, np.maximum(times - 1, 0) ** 2 / 2, np.where(times < 3, between, behind))
    np.testing.assert_allclose(run.outputs[0], x, rtol=0, atol=1e-9)


def test_a_variation_of_nothing_is_a_constant_delay():
    """To the bit, at any time and in any lane."""
    times, starts = np.linspace(0, 5, 11), {"plant.x[0]": np.array([0.5, 1.0, -2.0])}
    runs = []
    for fields in ({}, {"varying": lambda t: 0.0}):
        loop, _ = delayed(-1.0, delay=0.7, **fields)
        runs.append(nlctl.ensemble_response(nlctl.compile(loop), times, 0, starts, keep=["x"]))
    np.testing.assert_array_equal(runs[0].signals["x"], runs[1].signals["x"])


def test_members_differ_in_their_delay_and_have_the_same_bits_on_any_number_of_threads():
    compiled = nlctl.compile(forced())
    times, delays = np.linspace(0, 10, 21), np.array([0.6, 0.9, 1.0, 1.3, 2.2])
    params = {"wire.delay": delays}
    one, two = (
        nlctl.ensemble_response(
            compiled, times, 0, None, params=params, keep=["x"], threads=threads, **TIGHT
        ).signals["x"]
        for threads in (1, 2)
    )
    np.testing.assert_array_equal(one, two)
    for delay, member in zip(delays, one, strict=True):
        own = {"wire.delay": delay}
        alone = nlctl.input_output_response(compiled, times, 0, 0, params=own, **TIGHT)
        np.testing.assert_allclose(member, alone.outputs[0], rtol=0, atol=1e-9)


@each_row(
    ("fields", "message"),
    [
        ({"varying": lambda t: -0.5 * t}, r"delay \+ varying\(t\) > 0, got .* \(block 'wire'\)"),
        ({"varying": lambda t: 1.5 * np.sin(t)}, "grows by less than 1 s per second.*'wire'"),
        ({"varying": lambda t: -0.5 * (t >= 1.5)}, "continuous variation, got a jump .* t = 1.5 s"),
        ({"varying": lambda t: np.nan}, "varying that returns a finite number, got nan"),
        ({"varying": lambda t: 1 / 0}, "it raises ZeroDivisionError"),
    ],
)
def test_what_cannot_vary_so_is_refused_by_both_engines(fields, message):
    loop, x0 = delayed(-1.0, delay=2.0, **fields)
    for engine in ENGINES:
        with pytest.raises(nlctl.errors.ParameterError, match=message):
            nlctl.input_output_response(loop, [0, 5], 0, x0, engine=engine)


def test_a_constant_is_not_a_function():
    with pytest.raises(nlctl.errors.ParameterError, match="a constant belongs to delay"):
        nlctl.TransportDelay(varying=0.2)


def test_a_long_run_forgets_what_no_delay_reaches():
    """More than twice the places that there are at first."""
    run = nlctl.input_output_response(forced(), np.linspace(0, 120, 121), 0, 0, rtol=1e-8)
    assert run.statistics.accepted > 512
    np.testing.assert_allclose(run.outputs[0], np.sin(run.time), rtol=0, atol=1e-6)

"""Short pulses that delays are given, at any place: neither engine steps over one in silence."""

import control as ct
import numpy as np
import pytest
from examples import crossed
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from rows import each_row

import nlctl

ENGINES = ("native", "python-control")
TIGHT = {"rtol": 1e-10, "atol": 1e-12}
SHAPES = {  # height 1: whole width and area of one of width 1
    "triangle": (lambda s: max(0.0, 1.0 - 2.0 * abs(s)), 0.5),
    "Gaussian": (lambda s: float(np.exp(-((2.0 * s) ** 2))), np.sqrt(np.pi) / 2),
    "parabola": (lambda s: max(0.0, 1.0 - 4.0 * s * s), 2 / 3),
}
places = st.floats(0.05, 0.95)


def integrated(**fields):
    """The integral of what leaves a delay."""
    return nlctl.interconnect(
        {
            "wire": nlctl.TransportDelay(inputs=("u",), outputs=("late",), **fields),
            "plant": ct.ss(0, 1, 1, 0, inputs="late", outputs="x", name="plant"),
        },
        inputs=["u"],
        outputs=["x", "late"],
    )


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "shape"), crossed([*ENGINES], [*SHAPES]))
@given(place=places, height=st.floats(0.02, 0.09))
@settings(max_examples=3, phases=[Phase.generate])
def test_a_pulse_of_how_a_delay_varies(engine, shape, place, height):
    """A ramp is late by the pulse, of a 250th of the run; its integral lacks the area."""
    pulse, area = SHAPES[shape]
    end, width = 100.0, 0.4
    at = end * place
    loop = integrated(delay=1.0, varying=lambda t: height * pulse((t - at) / width))
    times = np.array([0.0, at, end])
    run = nlctl.input_output_response(loop, times, times, 0, engine=engine, **TIGHT)
    assert run.outputs[1, 1] == pytest.approx(at - 1.0 - height, abs=1e-9)
    exact = (end - 1.0) ** 2 / 2 - height * width * area
    assert run.outputs[0, -1] == pytest.approx(exact, abs=0.02 * height * width * area)


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "shape"), crossed([*ENGINES], [*SHAPES]))
@given(place=places)
@settings(max_examples=3, phases=[Phase.generate])
def test_a_pulse_of_a_history(engine, shape, place):
    """Of a 250th of the delay: its area arrives."""
    pulse, area = SHAPES[shape]
    delay, width = 10.0, 0.04
    loop = integrated(delay=delay, history=lambda t: pulse((t + delay * place) / width))
    run = nlctl.input_output_response(loop, [0.0, delay], np.zeros(2), 0, engine=engine)
    assert run.outputs[0, -1] == pytest.approx(width * area, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "lag"), crossed([*ENGINES], [0.05, 0.01]))
@given(place=places)
@settings(max_examples=3, phases=[Phase.generate])
def test_a_pulse_that_a_run_made_itself(engine, lag, place):
    """A triangle through a lag and a delay that is a hundred times as long as it."""
    smooth = ct.ss(-1 / lag, 1 / lag, 1, 0, inputs="v", outputs="u", name="lag")
    parts = {"lag": smooth, "wire": integrated(delay=10.0)}
    loop = nlctl.interconnect(parts, inputs=["v"], outputs=["x"])
    times = np.array([0.0, 0, 0.05, 0.1, 0]) + np.array([0, *[9 * place] * 3, 19.5])
    run = nlctl.input_output_response(loop, times, np.array([0, 0, 1, 0, 0.0]), 0, engine=engine)
    assert run.outputs[-1] == pytest.approx(0.05, rel=1e-3)


@pytest.mark.slow
@each_row("place", [2.5, 1.25, 3.75, 4.375, 1.0, 0.0048828125, np.pi, 4.9])
def test_a_jump_of_how_a_delay_varies_is_refused_wherever_it_is(place):
    """Also where two polynomials meet: halves, quarters and eighths of the run."""
    loop = integrated(delay=2.0, varying=lambda t: -0.5 * (t >= place))
    for engine in ENGINES:
        with pytest.raises(
            nlctl.errors.ParameterError, match=r"continuous variation, got a jump .* to -0.5"
        ):
            nlctl.input_output_response(loop, [0, 5], np.zeros(2), 0, engine=engine)


@pytest.mark.slow
@each_row("place", [2.5, 1.25, 4.375, np.pi])
def test_steps_end_where_a_delay_or_a_history_has_a_kink(place):
    """A ramp and a bent history between polynomials: exact, for none of them is stepped over."""
    times = np.linspace(0, 5, 21)
    loop = integrated(
        delay=1.0,
        varying=lambda t: 0.3 * max(t - place, 0.0),
        history=lambda t: -0.7 * abs(t + 0.5),
    )
    bent = np.maximum(times - place, 0.0)
    for engine in ENGINES:
        run = nlctl.input_output_response(loop, times, times, 0, engine=engine, rtol=1e-9)
        late = times - 1.0 - 0.3 * bent
        late[times < 1] = -0.7 * np.abs(times[times < 1] - 0.5)
        np.testing.assert_allclose(run.outputs[1], late, rtol=0, atol=1e-9)
        ramp = (times - 1.0) ** 2 / 2 - 0.15 * bent**2
        before = -0.7 * np.where(
            times < 0.5, 0.125 - (0.5 - times) ** 2 / 2, 0.125 + (times - 0.5) ** 2 / 2
        )
        exact = np.where(times < 1, before, -0.7 * 0.25 + ramp)
        np.testing.assert_allclose(run.outputs[0], exact, rtol=0, atol=2e-7)

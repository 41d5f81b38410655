"""Switching functions that cross and come back, where error control would step over it.

Within a dead zone, or the gap of a play, nothing limits a step.  An excursion that is less deep
than a millionth of the amplitude may be missed: it changes an integral by less than 1e-9 of it.
"""

import functools

import control as ct
import numpy as np
import pytest
from examples import crossed, many
from hypothesis import example, given, settings
from hypothesis import strategies as st

import nlctl
from nlctl.native.integrate.methods import Tableau


def of_time(t, x, u, params):
    """u = A sin(w t)."""
    return [params["A"] * np.sin(params["w"] * t)]


def of_state(t, x, u, params):
    """The same of a clock, whose error is 0 in every step."""
    return [params["A"] * np.sin(params["w"] * x[0])]


def zone_and_integral():
    """Return a dead zone with the slope 1 on the right, and an integrator behind it."""
    zone = nlctl.DeadZone(slope_r=1.0, slope_l=1.0, ripple_r=0.0, ripple_l=0.0, b_l=-100.0)
    sink = ct.nlsys(
        lambda t, x, u, p: [u[0]], lambda t, x, u, p: x, inputs=["v"], outputs=["area"],
        states=1, name="sink",
    )  # fmt: skip
    return nlctl.block(zone, "zone"), sink


@functools.cache
def compiled(driven):
    """Return a dead zone behind a sine of time or of a clock, and an integrator behind it."""
    given = {"params": {"A": 1.0, "w": 1.0}, "inputs": 0, "outputs": ["u"], "name": "source"}
    if driven == "by time":
        source = ct.nlsys(None, of_time, **given)
    else:
        source = ct.nlsys(lambda t, x, u, p: [1.0], of_state, states=1, **given)
    blocks = [source, *zone_and_integral()]
    return nlctl.compile(nlctl.interconnect(blocks, outputs=["area"], name="rig"))


def area(A, w, h, periods):
    """Return the integral of max(A sin(w t) - h A, 0) over whole periods."""
    half = np.arccos(h) if h < 1 else 0.0
    return periods * 2 * A / w * (np.sqrt(max(1 - h**2, 0.0)) - h * half)


BOGACKI_SHAMPINE = Tableau(  # with two stages inside a step, and a cubic polynomial
    name="bs3", order=3, a=((1 / 2,), (0.0, 3 / 4), (2 / 9, 1 / 3, 4 / 9)),
    c=(0.0, 1 / 2, 3 / 4, 1.0), error=(-5 / 72, 1 / 12, 1 / 9, -1 / 8), stable=2.5,
)  # fmt: skip
METHODS = ["tsit5", "rodas5p", "taylor", "auto"]
amplitudes, frequencies = st.floats(0.1, 10), st.floats(0.05, 100)
beyond = st.floats(-6, -0.03).map(lambda power: 10.0**power)  # the band, in amplitudes


@pytest.mark.slow
@pytest.mark.parametrize(("method", "driven"), crossed([*METHODS], ["by time", "by a clock"]))
@given(A=amplitudes, w=frequencies, d=beyond, periods=st.integers(1, 5))
@example(A=1.5, w=1.0, d=0.141, periods=2)
@example(A=1.0, w=1.0, d=1e-4, periods=5)
@example(A=1.4580254319059893, w=0.7263952884013972, d=4.742060308e-07, periods=5)
@settings(max_examples=many(25, part=4))
def test_no_excursion_is_stepped_over(driven, method, A, w, d, periods):
    """The integral of what passes the zone is right to tolerance, however shallow that is."""
    end, exact = periods * 2 * np.pi / w, area(A, w, 1 - d, periods)
    run = nlctl.input_output_response(
        compiled(driven), [0, end], params={"A": A, "w": w, "zone.b_r": (1 - d) * A}, method=method
    )
    assert run.outputs[0, -1] == pytest.approx(exact, rel=1e-7, abs=2e-9)


@given(w=frequencies, d=beyond)
@settings(max_examples=many(10, part=2))
def test_nor_with_a_pair_of_ones_own(w, d):
    """Without stages at three parts of a step, the solution is evaluated inside of it."""
    run = nlctl.input_output_response(
        compiled("by time"), [0, 4 * np.pi / w], params={"w": w, "zone.b_r": 1 - d},
        method=BOGACKI_SHAMPINE, rtol=1e-6, atol=1e-9,
    )  # fmt: skip
    assert run.outputs[0, -1] == pytest.approx(area(1.0, w, 1 - d, 2), rel=1e-5, abs=1e-8)


@given(d=beyond, step=st.floats(0.01, 0.5))
@settings(max_examples=many(10, part=2))
def test_nor_with_fixed_steps(d, step):
    """Steps end at events all the same; how far apart they are is the user's choice."""
    run = nlctl.input_output_response(
        compiled("by time"), [0, 4 * np.pi], params={"zone.b_r": 1 - d}, step=step
    )
    assert run.outputs[0, -1] == pytest.approx(area(1.0, 1.0, 1 - d, 2), rel=2e-3, abs=1e-8)


@pytest.mark.parametrize("driven", ["by time", "by a clock"])
def test_nor_side_by_side(driven):
    """In an ensemble as in single runs: each lane is looked into for itself."""
    d = np.geomspace(1e-6, 0.9, 24)
    w = np.geomspace(0.3, 3.0, 24)[::-1]
    made = nlctl.ensemble_response(
        compiled(driven), [0.0, 40.0], params={"zone.b_r": 1.5 * (1 - d), "A": 1.5, "w": w},
        keep=["area"],
    )  # fmt: skip
    single = [
        nlctl.input_output_response(
            compiled(driven),
            [0.0, 40.0],
            params={"zone.b_r": 1.5 * (1 - d[k]), "A": 1.5, "w": w[k]},
        ).outputs[0, -1]
        for k in range(d.size)
    ]
    np.testing.assert_allclose(made.signals["area"][:, -1], single, rtol=1e-6, atol=2e-9)
    whole = 40.0 * w / (2 * np.pi)
    fewest = [area(1.5, w[k], 1 - d[k], np.floor(whole[k])) for k in range(d.size)]
    most = [area(1.5, w[k], 1 - d[k], np.ceil(whole[k])) for k in range(d.size)]
    assert np.all(made.signals["area"][:, -1] >= np.array(fewest) * (1 - 1e-6) - 2e-9)
    assert np.all(made.signals["area"][:, -1] <= np.array(most) * (1 + 1e-6) + 2e-9)


def wave(t, x, u, params):
    """u = A sin(w t) + c t."""
    return [params["A"] * np.sin(params["w"] * t) + params["c"] * t]


@functools.cache
def beside_a_play():
    """Return a dead zone with an integrator and a play, all behind the same wave."""
    given = {"params": {"A": 1.0, "w": 1.0, "c": 0.0}, "inputs": 0, "outputs": ["u"]}
    play = nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.5, c_l=-0.5)
    loop = ct.interconnect(
        [ct.nlsys(None, wave, name="wave", **given), *zone_and_integral(),
         nlctl.block(play, "play")],
        connections=[["zone.u", "wave.u"], ["sink.v", "zone.v"], ["play.u", "wave.u"]],
        inplist=[], outlist=["sink.area", "play.v"], outputs=["area", "v"], name="beside",
    )  # fmt: skip
    return nlctl.compile(loop)


@pytest.mark.parted
@pytest.mark.parametrize("method", METHODS)
@given(A=amplitudes, w=frequencies, d=beyond, gap=beyond, periods=st.integers(1, 3))
@example(A=1.0, w=0.05, d=1e-6, gap=1e-6, periods=1)  # turns that rounding blurs
@example(A=1.0, w=0.05, d=1e-6, gap=1e-5, periods=2)
@settings(max_examples=many(25, part=4))
def test_nor_where_there_are_memories(method, A, w, d, gap, periods):
    """A play is carried by how far the wave leaves its gap, and a dead zone beside it works on."""
    run = nlctl.input_output_response(
        beside_a_play(), [0, (periods + 0.25) * 2 * np.pi / w], method=method,
        params={"A": A, "w": w, "zone.b_r": (1 - d) * A, "play.c_r": (1 - gap) * A,
                "play.c_l": (gap - 1) * A},
    )  # fmt: skip
    exact = area(A, w, 1 - d, periods + 0.5)
    assert run.outputs[0, -1] == pytest.approx(exact, rel=1e-7, abs=2e-9)
    assert run.outputs[1, -1] == pytest.approx(gap * A, rel=1e-7, abs=1e-9)


@pytest.mark.parted
@pytest.mark.parametrize("method", METHODS)
@given(w=st.floats(0.3, 30), deep=st.floats(-3, -0.5).map(lambda power: 10.0**power))
@settings(max_examples=many(25, part=4))
def test_a_memory_that_turns_twice_within_a_step(method, w, deep):
    """u = t + A sin(w t), hardly falling: the play keeps its peak until u is there again."""
    A = (1.0 + deep) / w
    top = (np.pi - np.arccos(1 / (A * w))) / w  # where u' = 1 + A w cos(w t) = 0, and again
    bottom = 2 * np.pi / w - top
    peak = top + A * np.sin(w * top)
    drop = peak - (bottom + A * np.sin(w * bottom))
    assert drop < 2.0  # less than the gap
    times = np.array([0.0, *(bottom + 2 * np.pi / w * np.arange(4))])
    run = nlctl.input_output_response(
        beside_a_play(), times, method=method,
        params={"A": A, "w": w, "c": 1.0, "play.c_r": 1.0, "play.c_l": -1.0},
    )  # fmt: skip
    risen = peak + 2 * np.pi / w * np.arange(4) - 1.0
    started = risen > 0.0
    np.testing.assert_allclose(run.outputs[1, 1:][started], risen[started], rtol=1e-7, atol=1e-8)

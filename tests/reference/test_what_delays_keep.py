"""What runs keep of delayed signals: pulses, both sides of events, breaks, seams."""

import control as ct
import numpy as np
import pytest
from examples import crossed
from scipy.integrate import quad

import nlctl
from nlctl.reference.past import Past

ENGINES = ["python-control", "native"]
ROOT = np.sqrt(np.pi)


def source(function):
    return ct.nlsys(None, lambda t, x, u, p: [function(t)], inputs=0, outputs=["v"], name="source")


def of_ramp(function):
    return ct.nlsys(
        lambda t, x, u, p: [1.0], lambda t, x, u, p: [function(x[0])], inputs=0, outputs=["v"],
        states=1, name="source",
    )  # fmt: skip


def late(signal, out, delay, **how):
    return nlctl.TransportDelay(inputs=(signal,), outputs=(out,), delay=delay, **how)


def integral(signal):
    return ct.nlsys(
        lambda t, x, u, p: [u[0]], lambda t, x, u, p: [x[0]], inputs=[signal], outputs=["z"],
        states=1, name="integral",
    )  # fmt: skip


@pytest.fixture(params=ENGINES)
def run(request):
    """Runs from 0 to an end by either engine."""

    def response(parts, end, **how):
        loop = nlctl.interconnect(parts, outputs=["z"])
        how |= {"engine": request.param, "squeeze": True}
        return nlctl.input_output_response(loop, [0, end], 0, **how)

    return response


GAUSS = lambda t: np.exp(-(((t - 5) / 0.01) ** 2))  # noqa: E731
PULSES = {
    "gauss": (GAUSS, 0.01 * ROOT),
    "tanh": (lambda t: np.tanh((t - 5) / 0.01) - np.tanh((t - 5.1) / 0.01), 0.2),
    "lorentz": (
        lambda t: 1 / (1 + ((t - 5) / 0.01) ** 2), 0.01 * (np.arctan(800.0) + np.arctan(500.0)),
    ),
    "parabola": (lambda t: np.maximum(0.0, 1 - ((t - 5) / 0.01) ** 2), 4 / 300),
    "hat": (lambda t: np.interp(t, [0, 5, 5.01, 5.02, 99], [0, 0, 1, 0, 0]), 0.01),
    "window": (lambda t: 1.0 if 5 < t < 5.01 else 0.0, 0.01),
}  # fmt: skip


@pytest.mark.parametrize(
    ("rtol", "begins", "name"),
    crossed(
        [1e-6, 1e-9], dict(zip(["of t", "of a state"], [source, of_ramp], strict=True)), [*PULSES]
    ),
)
def test_a_pulse_arrives_behind_a_delay_that_nothing_else_happens_in(name, begins, rtol, run):
    """At rest before and behind it; the delay is 700 times as long as the pulse."""
    function, area = PULSES[name]
    made = run({"s": begins(function), "l": late("v", "d", 7.0), "i": integral("d")}, 20, rtol=rtol,
               atol=1e-2 * rtol)  # fmt: skip
    assert made.outputs[-1] == pytest.approx(area, abs=30 * rtol)


@pytest.mark.parted
@pytest.mark.parametrize("second", [2.7, 8.1])
def test_a_pulse_arrives_behind_two_delays(second, run):
    parts = {"s": source(GAUSS), "l": late("v", "d", 3.3), "m": late("d", "e", second),
             "i": integral("e")}  # fmt: skip
    assert run(parts, 20, rtol=1e-7).outputs[-1] == pytest.approx(0.01 * ROOT, abs=1e-6)


def test_a_function_reference_arrives(run):
    reference = nlctl.FunctionReference(order=0, function=GAUSS)
    (name,) = nlctl.block(reference, "r").output_labels
    parts = {"s": reference, "l": late(name, "d", 7.0), "i": integral("d")}
    assert run(parts, 20, rtol=1e-7).outputs[-1] == pytest.approx(0.01 * ROOT, abs=1e-6)


def test_a_delay_that_varies_stretches_a_pulse(run):
    """The time t at which s leaves: t - 1 - sin(t)^2 / 2 = s."""

    def sent(t):
        return t - 1 - 0.5 * np.sin(t) ** 2

    parts = {"s": source(GAUSS), "i": integral("d"),
             "l": late("v", "d", 1.0, varying=lambda t: 0.5 * np.sin(t) ** 2)}  # fmt: skip
    area, _ = quad(lambda t: GAUSS(sent(t)), 5.9, 6.2, points=[6.04], epsabs=1e-13, limit=200)
    assert run(parts, 9, rtol=1e-7).outputs[-1] == pytest.approx(area, abs=1e-6)


def test_a_pulse_that_comes_back_each_second_is_counted_each_time(run):
    """v = pulse + v(t - 1): its integral after n seconds is 1 + ... + n pulses."""
    loop = ct.nlsys(
        None, lambda t, x, u, p: [np.exp(-(((t - 0.5) / 1e-3) ** 2)) + u[0]], inputs=["d"],
        outputs=["v"], name="loop",
    )  # fmt: skip
    parts = {"s": loop, "l": late("v", "d", 1.0), "i": integral("v")}
    assert run(parts, 5, rtol=1e-7).outputs[-1] == pytest.approx(15e-3 * ROOT / 3, abs=1e-7)


@pytest.mark.parametrize("height", [1.0, 1e4])
def test_what_is_kept_up_to_a_condition_is_of_its_near_side(height, run):
    """A window of a ramp: a last node behind its edge would be a spike of the kept polynomial."""
    window = of_ramp(lambda x: height if 1 < x < 1 + 1 / height else 0.0)
    parts = {"s": window, "l": late("v", "d", 0.37), "i": integral("d")}
    assert run(parts, 3, rtol=1e-9, atol=1e-11).outputs[-1] == pytest.approx(1.0, abs=3e-8)


# -- pieces ----------------------------------------------------------------------------------------


def past(delays, tolerance=1e-9, end=40.0):
    blocks = [nlctl.block(late("u", "y", delay), f"l{k}") for k, delay in enumerate(delays)]
    return Past(blocks, 0.0, end, (tolerance, 1e-2 * tolerance))


def keep(known, ends, *signals):
    known.keep(ends, lambda t: [np.array([signal(t)]) for signal in signals])


def test_a_piece_goes_through_what_steps_have_seen():
    """The ends of short steps say that there is a pulse; the 13 nodes of the whole say nothing."""
    known = past([4.0])
    near = np.linspace(1.95, 2.05, 41)
    keep(known, [0.0, *near.tolist(), 4.0], lambda t: np.exp(-(((t - 2) / 0.01) ** 2)))
    known.step = (4.0, 8.0)
    for s in np.linspace(1.9, 2.1, 77):
        assert known.leaving(4 + s)[0] == pytest.approx(np.exp(-(((s - 2) / 0.01) ** 2)), abs=1e-8)


def test_what_rests_leaves_a_delay_to_the_last_digit():
    """Compared with itself it does not switch over and over again."""
    known = past([1.0])
    keep(known, [0.0, 0.3, 1.0], lambda t: 0.1)
    known.step = (1.0, 2.0)
    assert all(known.leaving(1 + s)[0] == 0.1 for s in np.linspace(0.01, 0.99, 37))


@pytest.mark.parametrize(
    ("behind", "is_break"),
    [(lambda t: np.sin(t), False), (lambda t: 1 + np.sin(t), True), (lambda t: np.sin(3.0) + t - 3,
     True)],
    ids=["smooth", "jumps", "bends"],
)  # fmt: skip
def test_a_run_stops_where_what_jumps_leaves_its_own_delay(behind, is_break):
    """And not where it would have left the other one, whose signal is smooth."""
    known = past([5.0, 6.5])
    keep(known, [0.0, 1.5, 3.0], np.sin, np.sin)
    keep(known, [3.0, 4.0], behind, np.sin)
    stops = [5.0, 6.5, *([8.0] if is_break else []), 9.0]
    for before, stop in zip([4.0, *stops[:-1]], stops, strict=True):
        assert known.after(before, 9.0) == pytest.approx(stop, abs=1e-12)


def test_a_step_that_reads_the_past_ends_in_the_next_piece():
    known = past([10.0])
    ends = [0.0, *np.linspace(4.9, 5.1, 21).tolist(), 10.0]
    keep(known, ends, lambda t: np.exp(-(((t - 5) / 0.02) ** 2)))
    assert 10 + known.longest_step(10.0) < 15.0  # it does not lead over the peak
    assert known.longest_step(14.99) < 0.1
    assert known.longest_step(18.0) == np.inf  # nothing behind the last piece is known yet


# -- steps over events -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("engine", "rtol", "width", "speed"),
    crossed([*ENGINES], [1e-6, 1e-9], [1e-2, 1e-3, 1e-4], [1.0, 7.0]),
)
def test_a_hat_of_a_state_has_its_area(width, speed, rtol, engine):
    """From rest a step leads over its edges and sees 0 at both ends, also right up to the top."""
    places = [0, 2, 2 + width / 2, 2 + width, 99]
    hat = ct.nlsys(
        lambda t, x, u, p: [speed, np.interp(x[0], places, [0, 0, 2 / width, 0, 0])], None,
        inputs=0, outputs=["x", "z"], states=2, name="hat",
    )  # fmt: skip
    made = nlctl.input_output_response(
        hat, [0, 20 / speed], 0, 0, rtol=rtol, atol=1e-2 * rtol, engine=engine
    )
    np.testing.assert_allclose(made.events["time"][-3:], np.array(places[1:4]) / speed, atol=1e-6)
    assert made.states[1, -1] == pytest.approx(1 / speed, abs=30 * rtol)


@pytest.mark.parametrize("engine", ["python-control", "native"])
def test_a_train_of_pulses_has_its_low_ones_too(engine):
    """exp(-(s/w)^2) sin t at each 2.5 + 5 k: the integral of one is w sqrt(pi) sin e^(-w^2/4)."""
    width = 0.01
    train = ct.nlsys(
        lambda t, x, u, p: [np.sin(t) * np.exp(-(((t % 5 - 2.5) / width) ** 2))], None, inputs=0,
        outputs=["z"], states=1, name="train",
    )  # fmt: skip
    made = nlctl.input_output_response(train, [0, 40], 0, 0, engine=engine, rtol=1e-7)
    area = width * ROOT * np.exp(-(width**2) / 4)
    assert made.states[0, -1] == pytest.approx(
        area * np.sin(2.5 + 5 * np.arange(8)).sum(), abs=1e-7
    )


@pytest.mark.parametrize("engine", ["python-control", "native"])
@pytest.mark.parametrize("end", [9.0, 900.0])
def test_a_parabola_of_t_that_dips_between_all_looks_has_its_area(engine, end):
    """4 w / 3, where w is 1 / 450,000 of the longest run."""
    width = 2e-3
    bump = ct.nlsys(
        lambda t, x, u, p: [np.maximum(0.0, 1 - ((t - 2.0007) / width) ** 2)], None, inputs=0,
        outputs=["z"], states=1, name="bump",
    )  # fmt: skip
    made = nlctl.input_output_response(bump, [0, end], 0, 0, engine=engine, rtol=1e-8, atol=1e-10)
    assert made.states[0, -1] == pytest.approx(4 * width / 3, abs=1e-9)

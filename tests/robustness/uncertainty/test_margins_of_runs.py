"""Margins of signals of runs, with their events as breaks, against a brute force on 1e5 samples."""

import control as ct
import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

import nlctl
from nlctl.analysis.metrics import breaks_of, highest, lowest, with_breaks
from nlctl.analysis.robustness import Requirement, always, eventually, in_band, margin

END = 10.0
T, FINE = np.linspace(0, END, 801), np.linspace(0, END, 100_001)
OWN = ct.nlsys(None, lambda t, x, u, p: [np.clip(u[0], -1, 1)], inputs=["u"], outputs=["v"],
               name="own")  # fmt: skip


def late(**how):
    """A relay behind which its output is delayed."""
    return ct.interconnect(
        [
            nlctl.block(nlctl.Relay(on=0.2, off=-0.2), "relay"),
            nlctl.block(nlctl.TransportDelay(**how), "late", inputs="w", outputs="v"),
        ],
        connections=[["late.w", "relay.v"]], inplist=["relay.u"], outlist=["late.v"],
        inputs=["u"], outputs=["v"], name="relay behind a delay",
    )  # fmt: skip


ACTUATORS = {
    "saturation": nlctl.Saturation(limit=1.0),
    "a function of one's own": OWN,
    "dead zone": nlctl.DeadZone(),
    "relay": nlctl.Relay(on=0.2, off=-0.2),
    "backlash": nlctl.Backlash(),
    "a relay and a delay": late(delay=0.457),
    "a relay and a delay that varies": late(delay=0.3, varying=lambda t: 0.1 * np.sin(t)),
    "a law at a clock": nlctl.sampled(
        ct.ss([], [], [], [[0.7]], 0.37, inputs="u", outputs="v", name="held")
    ),
}


def run(actuator, times, engine):
    """Signals and breaks of an oscillator behind the actuator, which follows a decaying sine."""
    plant = ct.ss([[0, 1], [-4, -0.4]], [[0], [4]], [[1, 0]], 0, inputs="v", outputs="y",
                  name="plant")  # fmt: skip
    error = ct.nlsys(
        None, lambda t, x, u, p: [1.5 * (2 * np.exp(-0.2 * t) * np.sin(2 * t + 0.3) - u[0])],
        inputs=["y"], outputs=["u"], name="error",
    )  # fmt: skip
    blocks = {"error": error, "actuator": actuator, "plant": plant}
    made = nlctl.input_output_response(
        nlctl.interconnect(blocks, outputs=["v", "y"]), times, engine=engine, rtol=1e-10, atol=1e-12
    )
    v, y = (np.array(each) for each in made.outputs)
    return {"v": v, "y": y}, breaks_of(made)


def places(start, end):
    """Fine samples from one time to another."""
    return slice(round(start / END * 1e5), round(end / END * 1e5) + 1)


V, Y = (in_band(name, lower=-0.9, upper=0.95, scale=1.0) for name in "vy")
FORMULAS = {  # and what they are on fine samples
    "always v": (always(V), "v", lambda rho: rho.min()),
    "always y": (always(Y, 1.234, 7.77), "y", lambda rho: rho[places(1.234, 7.77)].min()),
    "eventually v": (eventually(V, 0.3333, 1.7777), "v",
                     lambda rho: rho[places(0.3333, 1.7777)].max()),
    "always eventually y": (
        always(eventually(Y, 0.0, 1.5), 1.0, 8.0), "y",
        lambda rho: sliding_window_view(rho[places(1.0, 9.5)], 15_001).max(axis=1).min(),
    ),
}  # fmt: skip


# in the reference; a saturation switches as often, and a relay is in the clock's law as well
LONG = ("a relay and a delay", "a relay and a delay that varies", "backlash", "relay", "dead zone")
CASES = [
    pytest.param(
        name, engine, marks=pytest.mark.weekly if engine != "native" and name in LONG else ()
    )
    for name in ACTUATORS
    for engine in ("native", "python-control")
]


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize(("name", "engine"), CASES)
def test_margins_and_extremes_are_those_of_a_brute_force(name, engine):
    """To 1e-6, and what 1e5 samples miss themselves where a window ends on a slope."""
    signals, breaks = run(ACTUATORS[name], T, engine)
    fine, _ = run(ACTUATORS[name], FINE, "native")
    assert breaks.size > 5
    for key, (formula, signal, brute) in FORMULAS.items():
        rho = np.minimum(0.95 - fine[signal], fine[signal] + 0.9)
        steps = np.abs(np.diff(fine[signal]))
        missed = 0.0 if key.startswith("always v") else steps[steps < 0.1].max()
        asked = Requirement(key="r", formula=formula, until=END)
        found = margin(asked, T, signals, breaks=breaks)
        allowed = 1e-6 + missed * (key != "always y")
        assert found == pytest.approx(brute(rho), abs=allowed), key
    for signal, values in signals.items():
        for function, exact in ((highest, np.max), (lowest, np.min)):
            found = with_breaks(function, breaks)(T, values)
            assert found == pytest.approx(exact(fine[signal]), abs=1e-6)


@pytest.mark.parted
@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_a_saturated_signal_of_a_run_has_its_limit_for_its_highest_value(engine):
    signals, breaks = run(ACTUATORS["saturation"], np.linspace(0, END, 101), engine)
    assert with_breaks(highest, breaks)(np.linspace(0, END, 101), signals["v"]) <= 1 + 1e-12
    asked = Requirement(key="r", formula=always(in_band("v", lower=-1.02, upper=1.02)), until=END)
    found = margin(asked, np.linspace(0, END, 101), signals, breaks=breaks)
    assert found == pytest.approx(0.02 / 1.02, abs=1e-9)

"""Memories that turn right behind a steep step of an input: its contacts are not their turns.

Several plays are moved one after the other while the step lasts, and events that follow each other
as closely once counted as turns that rounding repeats, behind which none was looked for.
"""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

HALF_GAPS = (0.2, 0.4, 0.6, 0.8, 1.1)
LEVELS = np.array([0.0, 1.7, -1.9, 2.4, 2.1, -1.2, -2.2, 1.0, -0.4])
OMEGA, SWING = 5.0, 0.3


def plays(signal: np.ndarray) -> np.ndarray:
    """Return what plays have become behind all samples of their input."""
    memory = np.zeros(len(HALF_GAPS))
    for u in signal:
        memory = np.clip(memory, u - np.array(HALF_GAPS), u + np.array(HALF_GAPS))
    return memory


def exact(times: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Return the memories at the end: a play knows its input's extremes, which are all sampled."""
    peaks = (np.pi * np.arange(100) + np.pi / 2) / OMEGA
    at = np.unique(
        np.concatenate([times, peaks[peaks < times[-1]], np.linspace(0, times[-1], 999)])
    )
    return plays(np.interp(at, times, levels) + SWING * np.sin(OMEGA * at))


def driven() -> object:
    """Return plays behind an input and a sine of a state, that is not known before the run."""
    drive = ct.nlsys(
        lambda t, x, u, p: [OMEGA], lambda t, x, u, p: [u[0] + SWING * np.sin(x[0])],
        inputs=["r"], outputs=["u"], states=["phase"], name="drive",
    )  # fmt: skip
    spec = nlctl.actuators.PrandtlIshlinskii(r=HALF_GAPS, w=(0.2,) * len(HALF_GAPS))
    return nlctl.interconnect(
        {"drive": drive, "act": nlctl.block(spec, "act")}, inputs=["r"], outputs=["v"]
    )


LOOP = driven()


@pytest.mark.parametrize(
    ("steep", "how", "rtol"),
    crossed(
        [1e-2, 1e-5, 1e-9], ["tsit5", "rodas5p", "taylor", "auto", "python-control"], [1e-6, 1e-9]
    ),
)
def test_plays_turn_where_their_input_does(how, steep, rtol):
    """The extremes of the input behind each step are kept, in whatever time it rises."""
    begins = 0.7 * np.arange(LEVELS.size)
    times = np.empty(2 * LEVELS.size - 1)
    times[::2], times[1::2] = begins, begins[1:] - steep
    levels = np.repeat(LEVELS, 2)[:-1]
    engine = {"engine": how} if how == "python-control" else {"method": how}
    run = nlctl.input_output_response(LOOP, times, levels, 0, rtol=rtol, atol=1e-2 * rtol, **engine)
    memories = [nlctl.state_names(LOOP).index(f"act.memory[{k}]") for k in range(len(HALF_GAPS))]
    np.testing.assert_allclose(run.states[memories, -1], exact(times, levels), atol=20 * rtol)


@pytest.mark.parametrize("parameter", ["gain.k", "drive.phase(0)"])
def test_their_derivatives_are_those_of_the_extremes(parameter):
    """Of held inputs: by a gain in front of the plays, and by the phase of the sine."""
    held = np.array([0.0, 1.7, 1.7, -1.9, 2.4, 2.1, -1.2])
    times = 0.7 * np.arange(held.size)
    gain = ct.nlsys(
        None, lambda t, x, u, p: [p["k"] * u[0]], inputs=["d"], outputs=["r"], name="gain",
        params={"k": 1.0},
    )  # fmt: skip
    lag = ct.ss(-1, 1, 1, 0, inputs=["v"], outputs=["y"], name="lag")
    loop = nlctl.compile(
        nlctl.interconnect([gain, *LOOP.syslist, lag], inputs=["d"], outputs=["y"])
    )
    tight = {"hold": "zoh", "rtol": 1e-10, "atol": 1e-12}
    run = nlctl.sensitivity_response(
        loop, times, held, with_respect_to=[parameter], of=["y"], **tight
    )

    def moved(by: float) -> np.ndarray:
        if parameter.endswith("(0)"):
            return nlctl.input_output_response(loop, times, held, {parameter[:-3]: by}, **tight)
        return nlctl.input_output_response(loop, times, held, params={parameter: 1 + by}, **tight)

    differences = (moved(1e-4).outputs - moved(-1e-4).outputs) / 2e-4
    np.testing.assert_allclose(np.ravel(run["y", parameter]), np.ravel(differences), atol=1e-6)


@pytest.mark.parametrize(
    ("method", "later"), crossed(["tsit5", "rodas5p", "taylor"], [1e-2, 1e-4, 1e-6, 1e-8])
)
def test_plays_whose_inputs_turn_right_after_one_another(later, method):
    """sin(t - k later), in 16 turns each: all of them are seen, however close the next one is."""
    end, late, half_gap = 50.0, later * np.arange(6), 0.25
    drive = ct.nlsys(
        lambda t, x, u, p: [1.0], lambda t, x, u, p: np.sin(x[0] - later * np.arange(6)),
        inputs=0, outputs=6, states=["now"], name="drive",
    )  # fmt: skip
    spec = nlctl.actuators.PrandtlIshlinskii(r=(half_gap,), w=(1.0,))
    many = [nlctl.block(spec, f"play{k}") for k in range(6)]
    loop = ct.interconnect(
        [drive, *many], inplist=[], outlist=[f"play{k}.v" for k in range(6)],
        connections=[[f"play{k}.u", f"drive.y[{k}]"] for k in range(6)],
    )  # fmt: skip
    made = nlctl.input_output_response(loop, [0.0, end], 0, 0, rtol=1e-6, method=method)
    turns = np.pi * np.arange(16) + np.pi / 2
    for k, shift in enumerate(late):
        memory = 0.0
        for u in np.sin(np.array([shift, *(turns + shift), end]) - shift):
            memory = np.clip(memory, u - half_gap, u + half_gap)
        row = list(made.state_labels).index(f"play{k}_memory[0]")
        assert made.states[row, -1] == pytest.approx(memory, abs=1e-8)

"""Random hybrid diagrams: machine code and the reference engine agree, or refuse alike.

So do their tables of events.

A linear plant, driven by a sine, with several parts in parallel in its feedback that jump at
clocks, at crossings or after each step.
"""

import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl

TIMES = np.linspace(0, 4, 17)
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


@nlctl.record
class Resetting:
    """Integrator that loses a part of its value where its input crosses a level."""

    level: float = 0.1
    kept: float = 0.5
    inputs, outputs, states, feedthrough = ("y",), ("w",), ("w",), False
    update = staticmethod(lambda t, x, u, p: (u[0] - 0.3 * x[0],))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (u[0] - p.level, p.level - u[0]))
    reset = staticmethod(lambda t, x, u, p: (p.kept * x[0],))

    def derived(self):
        return {"level": self.level, "kept": self.kept}


@nlctl.record
class Firing:
    """Integrate and fire: it grows with its input, and begins again at 1."""

    rate: float = 1.0
    inputs, outputs, states, feedthrough = ("y",), ("w",), ("w",), False
    update = staticmethod(lambda t, x, u, p: (p.rate + 0.3 * u[0],))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (1.0 - x[0],))
    reset = staticmethod(lambda t, x, u, p: (x[0] - 1.0,))

    def derived(self):
        return {"rate": self.rate}


def renamed(record, output):
    """A class of block with input y and an output of this name."""
    own = {"inputs": ("y",), "outputs": (output,)}
    return nlctl.record(type(record.__name__, (record,), own))


def own(function, output):
    """A user's own function of t and y."""
    return ct.nlsys(None, lambda t, x, u, p: [function(t, u[0])], inputs=["y"], outputs=[output],
                    name=output)  # fmt: skip


def threshold(rng, w):
    level, low, high = rng.uniform(-0.4, 0.4), *rng.uniform(-0.5, 0.5, 2)
    return own(lambda t, y: np.where(y > level, high, low), w)


def saturation(rng, w):
    limit = rng.uniform(0.1, 0.6)
    return own(lambda t, y: np.clip(y, -limit, 0.7 * limit), w)


def pulses(rng, w):
    period, duty = rng.uniform(0.3, 1.7), rng.uniform(0.1, 0.9)
    return own(lambda t, y: 0.5 * y + np.where(t % period < duty * period, 1.0, 0.0), w)


def relay(rng, w):
    middle, half = rng.uniform(-0.2, 0.2), rng.uniform(0.05, 0.3)
    return renamed(nlctl.Relay, w)(on=middle + half, off=middle - half, height=0.5)


def play(rng, w):
    right, left = rng.uniform(0.05, 0.4, 2)
    return renamed(nlctl.Backlash, w)(m_r=1.0, m_l=1.0, c_r=right, c_l=-left)


def sampled(rng, w):
    lag = ct.ss(rng.uniform(-0.5, 0.8), 0.5, 1.0, 0.2, True, inputs="y", outputs=w, name=w)
    return nlctl.sampled(lag, rng.uniform(0.11, 0.7), offset=rng.uniform(0, 0.1))


def delay(rng, w):
    return nlctl.TransportDelay(inputs=("y",), outputs=(w,), delay=rng.uniform(0.15, 0.9))


def resetting(rng, w):
    level, kept = rng.uniform(-0.3, 0.3), rng.uniform(-0.5, 0.8)
    return renamed(Resetting, w)(level=level, kept=kept)


def firing(rng, w):
    return renamed(Firing, w)(rate=rng.uniform(0.5, 2.0))


PARTS = (threshold, saturation, pulses, relay, play, sampled, delay, resetting, firing)


def diagram(rng, parts):
    """The plant with these parts in its feedback."""
    A = np.array([[0.0, 1.0], [-rng.uniform(0.5, 6), -rng.uniform(0.1, 1.0)]])
    gains, a, f = rng.uniform(-1.5, 1.5, len(parts)), rng.uniform(0.3, 1.5), rng.uniform(0.7, 4.0)
    signals = [f"w{i}" for i in range(len(parts))]
    plant = ct.nlsys(
        lambda t, x, u, p: A @ x + np.array([0.0, 1.0]) * (a * np.sin(f * t) + gains @ u),
        lambda t, x, u, p: x[:1], states=2, inputs=signals, outputs=["y"], name="plant",
    )  # fmt: skip
    blocks = {"plant": plant}
    blocks |= {w: part(rng, w) for w, part in zip(signals, parts, strict=True)}
    return nlctl.interconnect(blocks, outputs=["y", *signals])


def result(system, start, engine):
    """States and outputs of a run and its events, or what it ends with."""
    try:
        made = nlctl.input_output_response(
            system, TIMES, 0, start, engine=engine, squeeze=False, **TIGHT
        )
    except (nlctl.errors.DivergedError, nlctl.errors.UsageError) as error:
        return type(error)
    events = made.events.sort_values(["block", "which", "direction", "time"])
    return np.concatenate([made.outputs, made.states]), events


def both(seed, parts):
    """Results of a random diagram in machine code and in the reference engine."""
    rng = np.random.default_rng(seed)
    system = diagram(rng, parts)
    start = {"plant.x[0]": rng.uniform(-0.5, 0.5), "plant.x[1]": rng.uniform(-0.5, 0.5)}
    return result(system, start, "native"), result(system, start, "python-control")


@pytest.mark.slow
@given(
    seed=st.integers(0, 2**32 - 1),
    parts=st.lists(st.sampled_from(PARTS), min_size=2, max_size=4, unique=True),
)
@settings(max_examples=many(8, part=2))
def test_both_engines_agree_on_random_hybrid_diagrams(seed, parts):
    machine, reference = both(seed, parts)
    if isinstance(machine, type):
        assert machine is reference
        return
    np.testing.assert_allclose(machine[0], reference[0], rtol=0, atol=1e-7)
    columns = ["block", "which", "direction"]
    assert machine[1][columns].to_numpy().tolist() == reference[1][columns].to_numpy().tolist()
    np.testing.assert_allclose(machine[1]["time"], reference[1]["time"], rtol=0, atol=1e-7)

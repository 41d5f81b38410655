r"""
Resets, event triggers and pulse widths
=======================================

Three loops that jump: a ball that bounces where its height falls through 0, a control law that samples where the error
of its samples has grown to a part of the state, and a pulse-width modulated input.  Each stands next to its closed form,
and ``response.events`` says when what has happened.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

G, E = 9.81, 0.8


@nlctl.record
class Ball:
    """A ball that loses a fifth of its speed at each bounce."""

    inputs, outputs, states, feedthrough = (), ("h", "v"), ("h", "v"), False
    initial = {"h": 1.0}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return x[1], -G

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return x[0], x[1]

    @staticmethod
    @nlctl.equation
    def guard(t, x, u, p):
        """Where this falls through 0 the ball jumps."""
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def reset(t, x, u, p):
        """All states after the jump."""
        return x[0], -E * x[1]


def rule(t, x, u, params):
    """Sample where the error of what is held exceeds 0.3 of the state (Tabuada 2007)."""
    return -2 * u[1], 0.3 * abs(u[0]) - abs(u[1] - u[0])


def modulated(t, x, u, params):
    """A lag behind pulses of 50 Hz, as wide as a slow sine says."""
    on = t % 0.02 < 0.02 * (0.5 + 0.4 * np.sin(2 * np.pi * t))
    return [5 * (np.where(on, 1.0, 0.0) - x[0])]


ball = nlctl.input_output_response(nlctl.block(Ball(), "ball"), np.linspace(0, 3.5, 701))

plant = ct.ss(1, 1, 1, 0, inputs="u", outputs="x", name="plant")
law = ct.nlsys(None, rule, inputs=["x", "w1"], outputs=["u", "trigger"], name="rule")
hold = nlctl.block(nlctl.TriggeredHold(n=1), "hold")
loop = ct.interconnect(
    [plant, hold, law],
    [["plant.u", "rule.u"], ["rule.x", "plant.x"], ["rule.w1", "hold.w1"], ["hold.u1", "plant.x"],
     ["hold.trigger", "rule.trigger"]],
    inplist=[], outlist=["plant.x", "hold.w1"], outputs=["x", "w"],
)  # fmt: skip
held = nlctl.input_output_response(loop, np.linspace(0, 2, 801), 0, {"plant.x[0]": 1.0})

pulses = ct.nlsys(
    modulated, lambda t, x, u, params: x, inputs=0, outputs=["y"], states=1, name="pulses"
)
ripple = nlctl.input_output_response(pulses, np.linspace(0, 1.5, 1501), 0, 0)

figure, axes = plt.subplots(3, 1, figsize=(7, 6.4), layout="constrained")
for axis, run, label in zip(
    axes, (ball, held, ripple), ("height (m)", "x, and w held", "y"), strict=True
):
    axis.plot(run.time, np.atleast_2d(run.outputs)[0], label=label)
    axis.set(xlabel="t (s)", ylabel=label)
axes[1].plot(held.time, held.outputs[1], drawstyle="steps-post", linewidth=1)
bounces, samples = ball.events["time"], held.events["time"]
axes[0].plot(bounces, np.zeros(len(bounces)), "k|", markersize=10, label="events")
axes[1].plot(samples, np.zeros(len(samples)), "k|", markersize=10)
axes[0].legend(loc="upper right")

# closed forms: the bounces, the interval between two samples, and the mean of the pulses
v0 = np.sqrt(2 * G)
first = v0 / G + 2 * v0 / G * np.r_[0, np.cumsum(E ** np.arange(1, len(bounces)))]
interval = np.log(2 - 1 / 1.3)
print(
    f"{len(bounces)} bounces, furthest from the closed form by {np.abs(bounces - first).max():.1e} s"
)
print(
    f"{len(samples)} samples, {interval:.4f} s apart; furthest by {np.abs(np.diff(samples) - interval).max():.1e} s"
)
assert np.abs(bounces - first).max() < 1e-8
assert np.abs(np.diff(samples) - interval).max() < 1e-6
assert len(ripple.events) > 100

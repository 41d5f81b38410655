r"""
Step by step: reinforcement learning, predictive control
========================================================

``nlctl.stepper`` makes of a diagram a run that continues whenever it is given inputs for another step. Memories, clocks,
delays and the integrator's own steps are kept between two calls: n steps are one run with ``hold="zoh"``, here bit
for bit.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def swing(t, x, u, params):
    return [x[1], -9.81 * np.sin(x[0]) - 0.2 * x[1] + u[0]]


pendulum = ct.nlsys(
    swing,
    lambda t, x, u, params: x,
    inputs=["v"],
    outputs=["angle", "rate"],
    states=["angle", "rate"],
    name="pendulum",
)
backlash = nlctl.block(nlctl.Backlash(), "actuator")
loop = nlctl.interconnect([backlash, pendulum], inputs=["u"], outputs=["angle", "rate"])
compiled, dt = nlctl.compile(loop), 0.05
stepper = nlctl.stepper(compiled, dt)

inputs = np.sin(0.3 * np.arange(60))
y = np.array([stepper.step(u) for u in inputs]).T
t = dt * np.arange(61)
run = nlctl.input_output_response(
    compiled,
    t,
    np.append(inputs, inputs[-1]),
    hold="zoh",
    evaluation_times=np.nextafter(t[1:], 0),
)
assert np.array_equal(y, run.outputs)

# %%
# An environment
# --------------
#
# What a step returns are the outputs at its end, while the inputs still hold. Of an environment in the shape of
# Gymnasium's only the task is left to be written. A run that diverges ends the episode.


class SwingUp:
    """Bring the pendulum up with little torque."""

    def __init__(self):
        self.stepper = nlctl.stepper(compiled, dt, ignore_errors=True)

    def reset(self, seed=None):
        rng = np.random.default_rng(seed)
        return self.stepper.reset({"pendulum.angle": rng.uniform(-0.1, 0.1)}), {}

    def step(self, action):
        y = self.stepper.step(np.clip(action, -5, 5))
        reward = -np.cos(y[0]) - 0.01 * float(action) ** 2
        truncated = self.stepper.time >= 10
        return y, reward, not self.stepper.success, truncated, {}


env = SwingUp()
y, info = env.reset(seed=1)
total, terminated, truncated = 0.0, False, False
while not (terminated or truncated):
    y, reward, terminated, truncated, info = env.step(5 * np.sign(y[1]))
    total += reward
print(f"reward of the episode: {total:.1f}")
assert not terminated

# %%
# Predictive control
# ------------------
#
# ``rollout`` says what would come of inputs and leaves the run where it is; ``snapshot`` and ``restore`` are what it is
# made of. Here the best of a few constant torques is held for a step, over and over again. The model has the backlash,
# and so each roll-out begins with the memory as it is.
y = stepper.reset({"pendulum.angle": 0.6})
times, angles = [0.0], [y[0]]
torques = np.linspace(-5, 5, 11)
for _ in range(80):
    ahead = [stepper.rollout(np.full((1, 8), u)) for u in torques]
    cost = [np.sum((a[0] - 0.3) ** 2 + 0.05 * a[1] ** 2) for a in ahead]
    y = stepper.step(torques[int(np.argmin(cost))])
    times.append(stepper.time)
    angles.append(y[0])

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(times, angles, label="angle")
axes.axhline(0.3, color="k", linewidth=0.8, linestyle="--", label="wanted")
axes.set(xlabel="t (s)", ylabel="angle (rad)", xlim=(0, 4))
axes.legend()
assert abs(np.mean(angles[-20:]) - 0.3) < 0.1

# %%
# Many environments at once
# -------------------------
#
# ``nlctl.vector_stepper`` makes the steps of many runs, as vector environments of Gymnasium's do: inputs of shape
# (members, inputs), outputs and states by members, parameters and initial states of each, and ``reset`` of those that are
# over. Each is a stepper of its own, bit for bit, and costs a few microseconds a step; ``benchmarks/stepping.py`` measures
# it, and compares a step with runs of one step in nlctl and in python-control.
many = nlctl.vector_stepper(compiled, dt, size=8)
rng = np.random.default_rng(0)
angles = rng.uniform(-0.1, 0.1, 8)
y = many.reset({"pendulum.angle": angles}, {"actuator.c_r": np.linspace(0.1, 0.5, 8)})
for _ in range(100):
    y = many.step(5 * np.sign(y[:, 1]))  # one input: a number for each member
    over = np.abs(y[:, 0]) > np.pi
    if over.any():
        y = many.reset({"pendulum.angle": rng.uniform(-0.1, 0.1, 8)}, members=over)
print(y.round(3), many.time.round(2))
assert many.success.all()

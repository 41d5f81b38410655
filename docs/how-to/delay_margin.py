r"""
Operating point, Bode plot and margins of a loop with a delay
=============================================================

``nlctl.find_operating_point`` has the arguments of ``ct.find_operating_point``, and exact derivatives;
``nlctl.frequency_response`` linearizes a diagram there with its delays kept as they are: no Padé approximation.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def level(t, x, u, params):
    return u[0] - np.sqrt(x)


tank = ct.nlsys(level, inputs=["inflow"], outputs=["level"], states=["level"], name="tank")
pipe = nlctl.TransportDelay(inputs=("demand",), outputs=("inflow",), delay=0.8)
law = ct.tf([1, 0.25], [1, 0], inputs="error", outputs="demand", name="law")

# %%
# The open loop, from the error to the level
# ------------------------------------------
#
# The tank is full to 4 m where the inflow is 2: the controller's integrator has to be there.
parts = {"pipe": pipe, "tank": tank, "law": law}
chain = nlctl.interconnect(parts, inputs=["error"], outputs=["level"], name="open loop")
point = nlctl.find_operating_point(
    chain, {"tank.level": 1.0, "law.x[0]": 1.0}, 0.0, 4.0, input_indices=["error"]
)
print(point)
assert np.allclose(point.outputs, 4)

# %%
# Its linearization there is :math:`\frac{s + 1/4}{s} \, \frac{1}{s + 1/4} \, e^{-0.8 s} = e^{-0.8 s} / s`, and the response is that:
open_loop = nlctl.frequency_response(chain, np.geomspace(0.01, 10, 500), at=point)
s = 1j * open_loop.omega
exact = np.exp(-0.8 * s) / s
gap = np.abs(open_loop.frdata[0, 0] / exact - 1).max()
print(f"furthest from the closed form, relative: {gap:.0e}")
assert gap < 1e-12

# %%
# It is a ``ct.FrequencyResponseData``: python-control's plots and margins take it. The gain is 1 at 1 rad/s, where the
# phase is -90 degrees less 0.8 rad: the loop bears :math:`\pi / 2 - 0.8` s more delay.
gain, phase, _, crossing = ct.margin(open_loop)
margin = np.deg2rad(phase) / crossing
print(f"phase margin {phase:.1f} degrees at {crossing:.2f} rad/s: {margin:.4f} s more delay")
assert abs(margin - (np.pi / 2 - 0.8)) < 1e-6
ct.bode_plot(open_loop, display_margins=True)
plt.gcf().set_size_inches(6, 5)

# %%
# The delay margin is what a simulation says
# ------------------------------------------
#
# With nine tenths of the margin used up a small step dies out, and with a tenth more than all of it an oscillation grows.
error = ct.summing_junction(["reference", "-level"], "error", name="sum")
loop = nlctl.interconnect(parts | {"sum": error}, inputs=["reference"], outputs=["level"])
start = nlctl.find_operating_point(loop, {"tank.level": 4.0, "law.x[0]": 2.0}, 4.0)
t = np.linspace(0, 60, 1201)
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
swings = []
for part in (0.9, 1.1):
    delay = 0.8 + part * margin
    params = {"pipe.delay": delay, "pipe.before": 2.0}
    run = nlctl.input_output_response(loop, t, 4 + 0.01 * (t < 1), start.states, params=params)
    axes.plot(t, run.outputs, label=f"delay {delay:.3f} s")
    swings.append([np.ptp(run.outputs[(t > a) & (t < a + 15)]) for a in (5, 40)])
axes.set(xlabel="t (s)", ylabel="level (m)", xlim=(0, 60))
axes.legend()
(early, late), (early_2, late_2) = swings
assert late < early
assert late_2 > early_2

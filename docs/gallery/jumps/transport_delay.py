r"""
How much delay a loop bears
===========================

The loop :math:`\dot x = -a\, x(t - \tau)` is stable for :math:`a \tau < \pi / 2` only (Hayes 1950): a delay that a
network or a pipe adds turns integral control into an oscillation. Its slowest mode is
:math:`\exp(s t)` with :math:`s = W(-a \tau) / \tau`, where :math:`W` is Lambert's function. The delay is a parameter
of the block, so one ensemble has them all.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np
from scipy.special import lambertw

import nlctl

# sphinx_gallery_live_run = "nlctl.input_output_response(loop, t)"

a = 1.0
loop = nlctl.interconnect(
    {
        "plant": ct.ss(0, 1, 1, 0, inputs="late", outputs="x", name="plant"),
        "law": ct.ss([], [], [], -a, inputs="x", outputs="u", name="law"),
        "network": nlctl.TransportDelay(inputs=("u",), outputs=("late",), delay=1.0),
    },
    outputs=["x"],
)
t, delays = np.linspace(0, 60, 6001), np.array([0.8, 1.2, np.pi / 2, 1.7])
runs = nlctl.ensemble_response(
    loop, t, 0, {"plant.x[0]": 1.0}, params={"network.delay": delays}, keep=["x"], rtol=1e-9
)
x = runs.signals["x"]
plt.figure(figsize=(6, 3))
for tau, member in zip(delays, x, strict=True):
    plt.plot(t, member, label=f"{tau:.3g} s")
plt.ylim(-4, 4)
plt.xlabel("t (s)")
plt.legend(title="delay", ncols=4)

for tau, member in zip(delays, x, strict=True):
    s = lambertw(-a * tau) / tau  # x = c exp(s t) and its conjugate, once all other modes are gone
    later = t > 40
    modes = np.exp(s * (t[later] - 40.0))
    parts, *_ = np.linalg.lstsq(np.c_[modes.real, modes.imag], member[later], rcond=None)
    rest = member[later] - np.c_[modes.real, modes.imag] @ parts
    print(f"delay {tau:.4f} s: growth {s.real:+.4f} / s, misfit {abs(rest).max():.1e}")
    assert (s.real < -1e-9) == (a * tau < np.pi / 2 - 1e-9)
    assert abs(rest).max() < 1e-6 * max(1.0, abs(member).max())

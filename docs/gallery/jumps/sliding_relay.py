r"""
A relay that slides
===================

A linear plant behind an ideal relay, :math:`\dot x = A x - b\, \mathrm{sign}(x_1)`. On :math:`x_1 = 0` both fields point at
the surface where :math:`|x_2|` is small: there is no solution in the usual sense, and Filippov's goes along the surface,
with the mean output :math:`v = x_2` that keeps :math:`\dot x_1 = 0`. It leaves where :math:`|v|` would have to exceed 1.
``nlctl.IdealRelay`` finds that output from the derivatives of the whole diagram. The plant is the relay feedback system
with which Piiroinen and Kuznetsov show their integrator (ACM Transactions on Mathematical Software 34, 2008, not read; its
numbers as in the examples of nosnoc_py): its orbits slide several times in each period.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import expm

import nlctl

omega, zeta = 25.0, 0.05
A = np.array(
    [[-2 * zeta * omega - 1, 1, 0], [-2 * zeta * omega - omega**2, 0, 1], [-(omega**2), 0, 0]]
)
b, c = np.array([1.0, -2.0, 1.0]), np.array([1.0, 0.0, 0.0])
plant = ct.ss(A, -b[:, None], c[None], 0, inputs="v", outputs="u", name="plant")
start = {"plant.x[1]": -0.001, "plant.x[2]": -0.02}
t = np.linspace(0, 12, 12001)


loop = nlctl.interconnect({"relay": nlctl.IdealRelay(), "plant": plant}, outputs=["u", "v"])
run = nlctl.input_output_response(loop, t, 0, start, rtol=1e-10, atol=1e-12)
mode, x, v = run.states[0], run.states[1:], run.outputs[1]

fig, (orbit, output) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
late = t > 6
orbit.plot(x[0, late], x[1, late], color="C0", lw=0.8)
orbit.plot(*np.where(late & (mode == 0), x[:2], np.nan), lw=2.5, color="C3", label="slides")
orbit.set_xlabel("$x_1$")
orbit.set_ylabel("$x_2$")
orbit.legend()
output.plot(t[late], v[late], color="C0", lw=0.8)
output.plot(t, np.where(late & (mode == 0), v, np.nan), lw=2, color="C3")
output.set_xlabel("t (s)")
output.set_ylabel("v")

# from sample to sample by matrix exponentials: of A next to the surface, on it of the projected A
h, rest = t[1], np.linalg.solve(A, b)
for side in (-1, 0, 1):
    k = np.flatnonzero((mode[:-1] == side) & (mode[1:] == side))
    flow = A if side else (np.eye(3) - np.outer(b, c) / (c @ b)) @ A
    point = side * rest[:, None]
    wrong = abs(point + expm(flow * h) @ (x[:, k] - point) - x[:, k + 1]).max()
    print(f"v of mode {side:+d}: {k.size} steps, off by {wrong:.1e}")
    assert wrong < 1e-9
slid = mode == 0
print(f"|x_1| where it slides: {abs(x[0, slid]).max():.1e}")
assert abs(x[0, slid]).max() < 1e-10
assert abs(v - x[1])[slid].max() < 1e-9

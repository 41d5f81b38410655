r"""
Funnel control of a mass on a car
=================================

A car of mass 4 kg carries a mass of 1 kg on a ramp of 45 degrees, with a spring of 2 N/m and a damper of
1 N s/m; the force on the car is to move the mass horizontally along :math:`\cos t`. The benchmark of funnel
control (Berger, Lê, Reis, Automatica 87, 2018): relative degree two, internal dynamics, and the funnel
:math:`|e| < 5 e^{-2t} + 0.1`. The law is that of Berger, Ilchmann, Ryan (2021).
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

m1, m2, k, d, c = 4.0, 1.0, 2.0, 1.0, np.cos(np.pi / 4)
mass = np.array([[m1 + m2, m2 * c], [m2 * c, m2]])
lower = np.linalg.solve(mass, [[0, 0, 0, 0], [0, -k, 0, -d]])  # states z, s, z', s'
A = np.block([[np.zeros((2, 2)), np.eye(2)], [lower]])
B = np.array([0, 0, *np.linalg.solve(mass, [1, 0])])[:, None]
C = np.array([[1, c, 0, 0], [0, 0, 1, c]])
car = ct.ss(A, B, C, 0, name="car", inputs=["v"], outputs=["x1", "x2"])
assert (C @ B)[0] == 0 < (C @ B)[1]  # relative degree two, positive gain

reference = nlctl.SumOfSines(amplitudes=1.0, frequencies=1.0, phases=np.pi / 2)
controller = nlctl.controllers.FunnelControl(order=2, rho_0=5.1, rho_inf=0.1, decay=2.0)
loop = nlctl.interconnect(
    {"reference": reference, "car": car, "controller": controller, "actuator": nlctl.Gain()},
    outputs=["e", "u", "rho"],
)
t = np.linspace(0, 10, 4001)
e, u, rho = nlctl.input_output_response(loop, t).outputs

figure, (above, below) = plt.subplots(2, sharex=True, figsize=(6, 4))
above.plot(t, e)
above.plot(t, np.array([rho, -rho]).T, "k--", linewidth=0.8)
above.set(ylabel="e", ylim=(-1.5, 1.5))
below.plot(t, u)
below.set(xlabel="t (s)", ylabel="u (N)")

# %%
# The error keeps away from the boundary, as the theorem says.
print(f"largest |e| / rho: {np.max(np.abs(e) / rho):.3f}, largest |u|: {np.abs(u).max():.1f} N")
assert np.max(np.abs(e) / rho) < 1
assert np.abs(e[t > 4]).max() < 0.1 + 5 * np.exp(-8)

r"""
Presliding of the LuGre model
=============================

With the parameters of Canudas de Wit, Olsson, Astrom and Lischinsky (IEEE Trans. Automatic Control 40, 1995, Table I:
:math:`\sigma_{0} = 10^{5}` N/m, :math:`F_{c} = 1` N, :math:`F_{s} = 1.5` N) a mass of 1 kg is pushed with
1.425 N, released, and pushed again: it moves by micrometres like a spring (their Figure 2), and creeps a little.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def mass(t, x, u, params):
    return x[1], u[0] - u[1]


body = ct.nlsys(
    mass, None, states=["position", "velocity"], inputs=["push", "force"], name="body",
    outputs=["position", "velocity"],
)  # fmt: skip
friction = nlctl.block(nlctl.actuators.LuGre(), "friction")
loop = ct.interconnect(
    [body, friction], inputs=["push"], outputs=["position", "force"], name="pushed"
)
t = np.linspace(0, 30, 6001)
push = 1.425 * np.interp(t, [0, 7.5, 15, 22.5, 30], [0, 1, 0, 1, 0])
response = nlctl.input_output_response(nlctl.compile(loop), t, push, rtol=1e-8, atol=1e-12)
position = response.outputs[0] * 1e6

figure, axes = plt.subplots(figsize=(5, 3.2))
axes.plot(position, push)
axes.set(xlabel="position (µm)", ylabel="push (N)")

# %%
# It never slides, for the push is below the static friction. Pushed slowly, :math:`z' = v (1 - \sigma_{0} z / F_{s})`
# forwards and :math:`z' = v (1 + \sigma_{0} z / F_{s})` backwards, so that with :math:`\sigma_{0} z = F` the way is
# :math:`-(F_{s}/\sigma_{0}) \ln(1 - F/F_{s})` there and :math:`-(F_{s}/\sigma_{0}) \ln(1 + F/F_{s})` back:
there, back = -15 * np.log(1 - 1.425 / 1.5), -15 * np.log(1 + 1.425 / 1.5)
peak, rest = position[t == 7.5][0], position[t == 15][0]
print(f"{peak:.2f} µm and {rest:.2f} µm, closed form {there:.2f} µm and {there + back:.2f} µm")
assert abs(peak / there - 1) < 0.02
assert abs(rest / (there + back) - 1) < 0.02

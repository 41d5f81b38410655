r"""
``ct.ss`` and ``ct.nlsys`` in machine code
==========================================

A loop of python-control's own systems is compiled unchanged. Both engines agree with the closed form of
the linear loop's step response.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def controller(t, x, u, params):
    return params["k"] * (u[0] - u[1])


plant = ct.ss(-1.0, 1.0, 1.0, 0.0, name="plant", inputs=["u"], outputs=["y"])
law = ct.nlsys(None, controller, inputs=["ref", "y"], outputs=["u"], params={"k": 4.0}, name="law")
loop = ct.interconnect([plant, law], name="loop", inputs=["ref"], outputs=["y"])

t = np.linspace(0, 2, 201)
native = nlctl.input_output_response(nlctl.compile(loop), t, 1.0, rtol=1e-9, atol=1e-12)
plain = ct.input_output_response(loop, t, 1.0, solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-12})
exact = 4 / 5 * (1 - np.exp(-5 * t))

figure, axes = plt.subplots(figsize=(5, 3))
axes.plot(t, exact, label="closed form")
axes.plot(t[::10], native.outputs[::10], "o", markersize=4, label="machine code")
axes.set(xlabel="t (s)", ylabel="y")
axes.legend()
assert np.abs(native.outputs - exact).max() < 1e-8
assert np.abs(plain.outputs - exact).max() < 1e-7

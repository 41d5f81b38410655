r"""
3. Your own block, with states and memory
=========================================

A block is a record with two plain functions. This actuator is a first-order lag, :math:`T \dot{x} = u - x`.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl


@nlctl.record
class Lag:
    """First-order lag, T x' = u - x."""

    T: float = nlctl.param(0.05, unit="s", meaning="time constant", above=0)

    inputs, outputs, states, feedthrough = ("u",), ("v",), ("x",), False

    @nlctl.equation
    def update(t, x, u, p):
        return ((u[0] - x[0]) / p.T,)

    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


# %%
# Its step response is :math:`1 - e^{-t/T}`.
t = np.linspace(0, 0.5, 501)
lag = nlctl.block(Lag(T=0.1), "lag")
v = nlctl.input_output_response(lag, t, 1.0, rtol=1e-10, atol=1e-12).outputs
assert np.abs(v - (1 - np.exp(-t / 0.1))).max() < 1e-8

# %%
# Bounds are held where a value is born, and where one arrives later.
try:
    Lag(T=-1.0)
except nlctl.errors.ParameterError as error:
    print(error)

# %%
# **Memory is a state too**, one that stands still within a step. ``commit`` says what it becomes when a step
# has been accepted. This block keeps the largest input so far.

t = np.linspace(0, 10, 1001)
u = np.sin(t) * t / 10


@nlctl.record
class Peak:
    """Largest input so far."""

    inputs, outputs, states, feedthrough = ("u",), ("v",), ("largest",), True
    memory = ("largest",)
    initial = {"largest": -10.0}

    @nlctl.equation
    def update(t, x, u, p):
        return (1000.0 * np.maximum(u[0] - x[0], 0.0),)  # without accepted steps: relax onto it

    @nlctl.equation
    def output(t, x, u, p):
        return (np.maximum(u[0], x[0]),)

    @nlctl.equation
    def commit(t, x, u, p):
        return (np.maximum(u[0], x[0]),)


response = nlctl.input_output_response(nlctl.block(Peak(), "peak"), t, u)
plt.figure(figsize=(6, 2.5))
plt.plot(t, u, label="u")
plt.plot(t, response.outputs, label="largest so far")
plt.legend()
plt.xlabel("t (s)")
assert np.abs(response.outputs - np.maximum.accumulate(u)).max() < 1e-3

# %%
# Either is an actuator of any loop, ``nlctl.interconnect({..., "actuator": Lag(T=0.01)})``, and of a study file next to it,
# ``options.lag = { function = "arm.py:Lag", T = 0.01 }``: see :doc:`/studies`.

r"""
7. From Simulink
================

What you know, and what it is called here:

==============================  ==================================================================================
Simulink                        nlctl
==============================  ==================================================================================
block, mask parameters          a record, its fields (``nlctl.DeadZone(b_r=0.5)``), with units and bounds
model, subsystem                ``nlctl.interconnect`` of records; a diagram may be a block of another one
line, Goto and From             signals with the same name are connected
Gain, Sum, Transfer Fcn         ``ct.ss``, ``ct.tf``, ``ct.summing_junction`` of python-control
MATLAB Function                 a function of ``ct.nlsys``, or an equation of a record
Saturation, Dead Zone, ...      ``nlctl.Saturation``, ``nlctl.DeadZone``, ``nlctl.Backlash``, ``nlctl.Relay``, ...
Step, Pulse Generator, Chirp    ``nlctl.Step``, and ``PulseTrain``, ``Square``, ``Chirp`` of ``nlctl.sources``
From Workspace                  ``nlctl.sources.TimeTable``, or an input of the run
PID Controller (2DOF)           ``nlctl.PID2``, of ``("ref", "y")`` or of ``("e",)``
Extended Kalman Filter          ``nlctl.observers.ExtendedKalmanFilter``, next to ``nlctl.observers.luenberger``
initial condition               ``nlctl.initial_state(loop, {"plant.x1": 0.8})``
zero-crossing detection         always, of all equations that can be read: ``print(nlctl.compile(model))``
external reset, Hit Crossing    ``guard`` and ``reset`` of a block; ``events=`` of a run, ``response.events``
Stop Simulation                 ``stop_when=`` of a run
Memory, Unit Delay              a state that is memory (``commit``); blocks in discrete time
sample time, rate transition    ``nlctl.sampled(controller, dt)``
accelerator mode                always: machine code; ``engine="python-control"`` interprets
``sim`` with many inputs        ``nlctl.ensemble_response``
algebraic loop                  an error that prints its signals, or ``algebraic_loops="solve"``
scope                           ``response.outputs["y"]``, or ``nlctl simulate --plot``
==============================  ==================================================================================

As an example, the textbook model of a servo: a PI controller, a saturation, and a motor :math:`1/(s (s + 1))`.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

motor = ct.ss(ct.tf([1], [1, 1, 0]), name="motor", inputs=["v"], outputs=["y"])
law = ct.ss(ct.tf([2, 0.5], [1, 0]), name="law", inputs=["e"], outputs=["u"])
difference = ct.summing_junction(["ref", "-y"], "e", name="difference")
limit = nlctl.block(nlctl.Saturation(limit=1.0), "limit")
servo = ct.interconnect(
    [motor, law, difference, limit], inputs=["ref"], outputs=["y", "v"], name="servo"
)
figure = nlctl.draw(servo)
figure  # noqa: B018

# %%
# A step of 1, and one of 0.1, which stays within the limit:
t = np.linspace(0, 30, 3001)
for height in (0.1, 1.0):
    y, v = nlctl.input_output_response(servo, t, height, rtol=1e-8, atol=1e-10).outputs
    plt.plot(t, y / height, label=f"step of {height:g}")
plt.legend()
plt.xlabel("t (s)")

# %%
# The small step is that of the linear loop :math:`(2 s + 0.5) / (s^{3} + s^{2} + 2 s + 0.5)`:
linear = ct.step_response(ct.tf([2, 0.5], [1, 1, 2, 0.5]), t).outputs
small = nlctl.input_output_response(servo, t, 0.1, rtol=1e-8, atol=1e-10).outputs[0] / 0.1
assert np.abs(small - linear).max() < 1e-6
assert np.abs(v).max() <= 1.0  # of the large one

r"""
Sources, and pulses that no step leads over
===========================================

Steps, ramps, waves, pulses, chirps and tables. What jumps in them depends on t alone, and is solved before a run: their
integrals, from runs of which only both ends are asked for, are those of paper and pencil.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np
from scipy.special import fresnel

import nlctl

shown = {
    "Step": nlctl.Step(t_step=2.0),
    "Ramp": nlctl.sources.Ramp(slope=0.2, t_start=2.0),
    "Sine": nlctl.Sine(),
    "Square": nlctl.sources.Square(period=4.0, duty=0.25),
    "Pulse": nlctl.sources.Pulse(t_start=3.0, width=1.5),
    "PulseTrain": nlctl.sources.PulseTrain(period=2.0, width=0.2),
    "Chirp": nlctl.sources.Chirp(omega_0=0.0, omega_1=20.0, t_1=10.0),
    "TimeTable": nlctl.sources.TimeTable(times=(0, 3, 4, 8, 10), values=(0, 1, -1, 0.5, 0)),
}
S, _ = fresnel(np.sqrt(20.0 * 10.0 / np.pi))
integrals = {  # from 0 to 10 s
    "Step": 8.0, "Ramp": 0.2 * 8.0**2 / 2, "Sine": 1 - np.cos(10.0), "Square": 3.0 - 7.0,
    "Pulse": 1.5, "PulseTrain": 1.0, "Chirp": np.sqrt(np.pi * 10.0 / 20.0) * S,
    "TimeTable": 1.5 + 0.0 - 1.0 + 0.5,
}  # fmt: skip
integrator = ct.ss(0, 1, 1, 0, inputs="ref", outputs="integral", name="integrator")
t = np.linspace(0, 10, 2001)
figure, axes = plt.subplots(4, 2, sharex=True, figsize=(7, 6), layout="constrained")
for ax, (name, record) in zip(axes.flat, shown.items(), strict=True):
    loop = nlctl.interconnect({"source": record, "integrator": integrator}, outputs=["integral"])
    whole = nlctl.input_output_response(loop, [0, 10]).outputs.ravel()[-1]
    assert abs(whole - integrals[name]) < 1e-6, name
    block = nlctl.block(record, "source")
    ax.plot(t, [block.output(now, [], [])[0] for now in t])
    ax.set_title(name, fontsize="medium")
for ax in axes[-1]:
    ax.set_xlabel("t (s)")

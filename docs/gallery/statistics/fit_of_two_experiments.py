r"""
Two experiments, one fit
========================

What two experiments leave open apart, they may say together. Each of them is a table of pandas here, with times as its index
and columns for input and output; ``nlctl.Measurement`` gives it a name, and where experiments start is sought for each of
them (``separate``). One pushes a gap to the right, where it never meets its other end, and one to the left.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import nlctl

drive = nlctl.compile(
    nlctl.interconnect(
        {"gap": nlctl.Backlash(m_r=1.0, m_l=1.0), "lag": nlctl.Lag(T=0.5)},
        connections=[["lag.u", "gap.v"]], inplist=["gap.u"], inputs=["u"],
        outlist=["lag.v"], outputs=["y"],
    )
)  # fmt: skip
ends, t = {"gap.c_r": 0.4, "gap.c_l": -0.3}, np.linspace(0, 3, 61)
noise, pushes = np.random.default_rng(1), []
for name, u in {"right": t, "left": -t}.items():
    y = nlctl.input_output_response(drive, t, u, params=ends).outputs
    table = pd.DataFrame({"u": u, "y": y + 0.01 * noise.normal(size=t.size)}, index=t)
    pushes.append(nlctl.Measurement(data=table, name=name))

start = {"gap.c_r": 0.6, "gap.c_l": -0.6, "lag.v(0)": 0.0}
alone = [nlctl.fit(drive, data=push, parameters=start) for push in pushes]
for push, one in zip(pushes, alone, strict=True):
    print(push.name, "alone leaves open:", one.unidentifiable)
fitted = nlctl.fit(drive, data=pushes, parameters=start, separate=["lag.v(0)"])
print(fitted)

figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
for push, experiment in zip(pushes, fitted.experiments, strict=True):
    axes.plot(push.data["y"], ".", ms=3, color="0.6")
    axes.plot(t, experiment.response.values[0], label=experiment.name)
axes.set(xlabel="t (s)", ylabel="y", xlim=(0, 3))
axes.legend(title="pushed to the")

assert [one.unidentifiable for one in alone] == [("gap.c_l",), ("gap.c_r",)]
assert fitted.unidentifiable == ()
assert np.all(abs(fitted.values[:2] - list(ends.values())) < 4 * fitted.errors[:2])

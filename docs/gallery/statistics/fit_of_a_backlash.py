r"""
A backlash from data
====================

Both ends of a gap, a slope and a time constant are found from a noisy output. With the gap in between, the output has
kinks that move with the parameters; its derivatives are those of the run (``nlctl.sensitivity_response``), so that
SciPy's ``least_squares`` takes a few runs. The Fisher matrix says how sure the values are, and which parameters data do
not identify: behind a slope :math:`m` and a gain :math:`k` only :math:`m k` is seen.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def wave(t, x, u, params):
    return 2 * np.sin(1.3 * t) + 0.5 * np.sin(3.1 * t)


def lag(t, x, u, params):
    return (params["k"] * u[0] - x[0]) / params["T"]


source = ct.nlsys(None, wave, inputs=0, outputs=["u"], name="source")
plant = ct.nlsys(
    lag, lambda t, x, u, params: x, inputs=["v"], outputs=["y"], states=["y"],
    params={"k": 1.0, "T": 1.0}, name="plant",
)  # fmt: skip
loop = nlctl.compile(
    nlctl.interconnect({"source": source, "gap": nlctl.Backlash(), "plant": plant}, outputs=["y"])
)

truth = {"gap.c_r": 0.4, "gap.c_l": -0.3, "gap.m_r": 1.1, "gap.m_l": 1.1, "plant.T": 0.7}
t, noise = np.linspace(0, 12, 241), np.random.default_rng(1).normal(size=241)
y = nlctl.input_output_response(loop, t, params=truth, squeeze=True).outputs + 0.02 * noise
fitted = nlctl.fit(loop, t, {"y": y}, {name: 0.8 * value for name, value in truth.items()})
print(fitted)

figure, (above, below) = plt.subplots(2, figsize=(6, 5), layout="constrained")
above.plot(t, y, ".", ms=3, label="data")
above.plot(t, fitted.response.values[0], label="fit")
above.set(xlabel="t (s)", ylabel="y", xlim=(0, 12))
above.legend()
apart = fitted.values - np.array(list(truth.values()))
below.errorbar(apart, fitted.names, xerr=2 * fitted.errors, fmt="o")
below.axvline(0, color="0.6")
below.set(xlabel="value less the truth, with two standard errors")

assert np.all(abs(apart) < 4 * fitted.errors)
assert abs(fitted.noise - 0.02) < 0.004
both = nlctl.fit(loop, t, {"y": y}, truth | {"plant.k": 1.0})
print("not identifiable:", both.unidentifiable)
assert {"plant.k", "gap.m_r", "gap.m_l"} <= set(both.unidentifiable)

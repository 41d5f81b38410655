r"""
References with their derivatives, and noise
============================================

Each reference gives its derivatives up to the plant's order, which are those that differences of the samples show.
Band-limited noise is a sum of sines with the root mean square that is asked for.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

t = np.linspace(0, 10, 2001)
shown = {
    "SumOfSines": nlctl.SumOfSines(order=2),
    "FilteredStep": nlctl.FilteredStep(order=2, t_step=1.0),
    "FunctionReference": nlctl.FunctionReference(
        order=2,
        function=lambda t: (
            np.tanh(t - 5),
            1 / np.cosh(t - 5) ** 2,
            -2 * np.tanh(t - 5) / np.cosh(t - 5) ** 2,
        ),
    ),
}
figure, axes = plt.subplots(4, sharex=True, figsize=(6, 6), layout="constrained")
for ax, (name, record) in zip(axes, shown.items(), strict=False):
    block = nlctl.block(record, "reference")
    yd = nlctl.input_output_response(block, t, rtol=1e-10, atol=1e-12).outputs
    ax.plot(t, yd[0], t, yd[1], "--")
    ax.set_title(name, fontsize="medium")
    for order in (0, 1):
        slope = np.gradient(yd[order], t, edge_order=2)
        assert np.abs(slope - yd[order + 1])[5:-5].max() < 0.02 * np.abs(yd[2]).max()

noise = nlctl.block(nlctl.references.BandLimitedNoise(rms=0.1, high=20.0), "noise")
long = np.linspace(0, 2000, 200_001)
samples = nlctl.input_output_response(noise, long, 0.0).outputs.ravel()
axes[3].plot(long[:1001], samples[:1001])
axes[3].set_title("BandLimitedNoise", fontsize="medium")
axes[3].set_xlabel("t (s)")
print(f"rms {np.sqrt(np.mean(samples**2)):.4f}")
assert abs(np.sqrt(np.mean(samples**2)) - 0.1) < 2e-3

r"""
A derivative through backlash
=============================

How a signal changes when a parameter is changed a little is the derivative of a run. Through a play it is one of
three: on its sides :math:`v = A \sin t \mp c`, with :math:`\partial v / \partial A = \sin t` and :math:`\partial v /
\partial c = \mp 1`; in the gap :math:`v` stands where it has reversed, :math:`A - c`, and so do its derivatives, 1 and -1.
Nothing is switched by hand: ``nlctl.sensitivity_response`` integrates the derivative of the diagram with the diagram, and
its memory keeps the derivative of what it keeps.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

# sphinx_gallery_live = ["source.A", "play.c_r", "play.c_l"]
# sphinx_gallery_live_run = "nlctl.input_output_response(loop, t)"

A, c = 1.0, 0.25


def wave(t, x, u, params):
    return params["A"] * np.sin(t)


source = ct.nlsys(None, wave, inputs=0, outputs=["u"], params={"A": A}, name="source")
play = nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=c, c_l=-c)
loop = nlctl.interconnect({"source": source, "play": play}, outputs=["u", "v"])

t = np.linspace(0, 8, 401)
slopes = nlctl.sensitivity_response(
    loop, t, of=["v"], with_respect_to=["source.A", "play.c_r", "play.c_l"]
)

figure, (above, below) = plt.subplots(2, sharex=True, figsize=(6, 4.5), layout="constrained")
above.plot(t, A * np.sin(t), "0.6", label="u")
above.plot(t, slopes.values[0], label="v")
for name in slopes.with_respect_to:
    below.plot(t, slopes["v", name], label=f"by {name}")
above.set(ylabel="signals")
below.set(ylabel="derivative of v", xlabel="t (s)", xlim=(0, 8))
above.legend()
below.legend()

touches = np.arcsin(c / A)  # the right side, from within the gap
leaves = np.pi - np.arcsin(1 - 2 * c / A)  # the gap, on its left side
rises, stands = (t > touches) & (t < np.pi / 2), (t > np.pi / 2) & (t < leaves)
falls = (t > leaves) & (t < 3 * np.pi / 2)
by_a, by_c = slopes["v", "source.A"], slopes["v", "play.c_r"]
exact = np.select([rises, stands, falls], [np.sin(t), 1.0, np.sin(t)])
exact_c = np.select([rises, stands], [-1.0, -1.0])
follows = rises | stands | falls
furthest = max(abs(by_a - exact)[follows].max(), abs(by_c - exact_c)[follows].max())
print(f"furthest from the closed form by {furthest:.0e}")
assert furthest < 1e-7

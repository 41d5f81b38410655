r"""
Stick-slip and break-away of the LuGre model
============================================

A mass that a spring pulls sticks and slips, and it breaks away at a smaller force where the force rises faster: two
figures of Canudas de Wit, Olsson, Astrom and Lischinsky (IEEE Trans. Automatic Control 40, 1995, not read; its parameters
are the defaults of ``nlctl.actuators.LuGre``). The period is near that with Coulomb's law, for the Stribeck velocity is
small compared with the slips; pushed slowly, the mass breaks away at the static friction :math:`F_s = 1.5` N.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

pulled = ct.ss(
    [[0, -1], [2, 0]], [[0, 0.1], [-1, 0]], [[0, 1], [2, 0]], 0, name="pulled",
    inputs=["force", "one"], outputs=["velocity", "applied"],
)  # fmt: skip
pushed = ct.ss(0, [[1, -1]], 1, 0, inputs=["push", "force"], outputs="velocity", name="pushed")
lugre = nlctl.block(nlctl.actuators.LuGre(), "friction")
law = nlctl.block(nlctl.actuators.StickSlip(), "law")
figure, (stick, away) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")


def period(friction):
    """Return the time between two slips at 0.1 m/s of the end of a spring of 2 N/m."""
    loop = ct.interconnect(
        [pulled, friction], inputs="one", outputs="velocity", name="pull", check_unused=False
    )
    t = np.linspace(0, 60, 60_001)
    velocity = np.asarray(nlctl.input_output_response(nlctl.compile(loop), t, 1.0).outputs)
    stick.plot(t, velocity, lw=1, label=type(friction.spec).__name__)
    begins = t[1:][(velocity[:-1] < 0.05) & (velocity[1:] >= 0.05)]
    return np.mean(np.diff(begins[1:]))


push = ct.interconnect([pushed, lugre], inputs="push", outputs="velocity", name="push")
push = nlctl.compile(push)


def break_away(rate):
    """Return the force at which the mass slips faster than the Stribeck velocity."""
    t = np.linspace(0, 2 / rate, 20_001)
    velocity = np.asarray(nlctl.input_output_response(push, t, rate * t).outputs)
    return rate * t[np.argmax(velocity > 1e-3)]


with_bristles, with_coulomb, rates = period(lugre), period(law), np.geomspace(0.1, 20, 8)
forces = np.array([break_away(rate) for rate in rates])
stick.set(xlabel="t (s)", ylabel="velocity (m/s)", xlim=(0, 20))
stick.legend(loc="upper left")
away.semilogx(rates, forces, "o-")
away.set(xlabel="rate of the force (N/s)", ylabel="break-away force (N)", ylim=(1, 1.52))
print(f"period {with_bristles:.3f} s, with Coulomb's law {with_coulomb:.3f} s")
assert abs(with_bristles / with_coulomb - 1) < 0.02
assert np.all(np.diff(forces) < 0)
assert abs(forces[0] / 1.5 - 1) < 0.01

r"""
Adaptive control with a constrained input
=========================================

The unstable plant :math:`\dot{x} = x + u` with :math:`|u| \leq 10` starts at -9.99: beyond -10 no input brings it back. An
adaptive law that learns from the error learns from the saturation too. Karason and Annaswamy (IEEE Transactions on
Automatic Control 39, 1994) subtract the part of the error that is due to it. Gains and starts are those of python-control
programs for that article: :math:`\gamma_{1} = \gamma_{2} = 0.1`, :math:`\gamma_{3} = 1`, :math:`y_{d} = 5 \sin 0.5t`.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers


@nlctl.equation
def unstable(x, v):
    return x[0] + v


blocks = {
    "command": nlctl.SumOfSines(order=0, amplitudes=5.0, frequencies=0.5, phases=0.0),
    "plant": nlctl.PureFeedback(order=1, f=unstable, initial={"x1": -9.99}),
    "actuator": nlctl.Gain(),
}
errors = {
    "all of the error": controllers.ModelError(K=(1.0,), Q=(2.0,)),
    "its controllable part": controllers.ConstrainedError(K=(1.0,), Q=(2.0,), gamma_d=1.0),
}
start = {"controller.model.xm1": -9.9}
start |= {"controller.weights.W_hat[0]": 2.2, "controller.weights.W_hat[1]": -1.1}
t, gains = np.linspace(0, 20, 4001), {}
figure, (above, below) = plt.subplots(2, sharex=True, figsize=(6, 4))
for label, error in errors.items():
    controller = nlctl.mrac(
        controllers.ReferenceModel(a=(1.0,), b=1.0),
        error=error,
        weights=controllers.AdaptiveWeights(nodes=2, Gamma=0.1, sigma_1=0.0),
        law=controllers.ConstrainedLaw(u_max=10.0),
    )
    loop = nlctl.interconnect({**blocks, "controller": controller}, outputs=["x1", "u", "r"])
    response = nlctl.input_output_response(loop, t, 0, nlctl.initial_state(loop, start))
    states = dict(zip(nlctl.state_names(loop), response.states, strict=True))
    gains[label] = np.array([states[f"controller.weights.W_hat[{i}]"] for i in (0, 1)])
    above.plot(t, response.outputs[0], label=label)
    below.plot(t, response.outputs[1])
above.set_ylabel("x")
above.legend()
below.set(xlabel="t (s)", ylabel="u")

# %%
# The proof: V loses twice the integral of the controllable error squared. The true weights have the norm 2.24.
V = response.outputs[2] ** 2 + np.sum((gains[label] - [[2], [-1]]) ** 2, axis=0) / 0.1
V += (states["controller.error.beta_hat"] - 1) ** 2
print({label: gain[:, -1].round(2) for label, gain in gains.items()})
assert abs(V[0] - V[-1] - np.trapezoid(2 * response.outputs[2] ** 2, t)) < 1e-4
assert np.linalg.norm(gains["its controllable part"], axis=0).max() < 3.0

r"""
6. From python-control
======================

nlctl's diagrams are python-control's. What you have works as it stands, and may be mixed.
"""

import control as ct
import numpy as np

import nlctl

# %%
# A loop of ``ct.tf`` and ``ct.nlsys``, simulated by either:
plant = ct.ss(ct.tf(1, [1, 1, 0]))
plant = ct.ss(plant, name="plant", inputs=["v"], outputs=["y"])


def limited(t, x, u, params):
    return np.clip(params["k"] * (u[0] - u[1]), -1, 1)


law = ct.nlsys(None, limited, inputs=["ref", "y"], outputs=["v"], params={"k": 2.0}, name="law")
loop = ct.interconnect([plant, law], inputs=["ref"], outputs=["y"], name="loop")
t = np.linspace(0, 10, 501)
theirs = ct.input_output_response(
    loop, t, 3.0, solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-11, "max_step": 0.01}
)
ours = nlctl.input_output_response(nlctl.compile(loop), t, 3.0, rtol=1e-9, atol=1e-11)
difference = np.abs(theirs.outputs - ours.outputs).max()
print(f"largest difference {difference:.1e}")
assert difference < 1e-5

# %%
# nlctl's diagrams are linearised by python-control, or with exact derivatives:
example = nlctl.paper.example_1()
exact = nlctl.compile(example).linearize(nlctl.initial_state(example))
print(type(exact).__name__, exact.nstates, "states")
assert isinstance(exact, ct.StateSpace)

# %%
# What is different:
#
# * parameters are qualified, ``"actuator.b_r"``: two blocks never share one by accident;
# * an unknown name is an error with the nearest name;
# * steps end where equations switch, here at the limits of ``np.clip``, so that no ``max_step`` is needed;
# * a run that diverges is an error (``DivergedError``) unless ``ignore_errors=True``.

r"""
6. From python-control
======================

nlctl's diagrams are python-control's. What you have works unchanged, and may be mixed.
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
# ``nlctl.interconnect`` takes python-control's ``connections``, ``inplist``, ``outlist`` and ``params`` too, and refuses
# what these leave open. Or give the signals of a block other names:
left = nlctl.block(nlctl.Lag(T=0.1), "left", outputs="p")
right = nlctl.block(nlctl.Lag(T=0.2), "right", inputs="p")
by_name = nlctl.interconnect([left, right], inputs=["u"], outputs=["v"])
by_lists = nlctl.interconnect(
    {"left": nlctl.Lag(T=0.1), "right": nlctl.Lag()},
    connections=[["right.u", "left.v"]],
    inplist="left.u",
    outlist="right.v",
    params={"right.T": 0.2},
)
steps = [nlctl.input_output_response(each, t, 1.0).outputs for each in (by_name, by_lists)]
assert np.array_equal(*steps)

# %%
# Ensembles take ``T``, ``U`` and ``X0``. ``hold="zoh"`` keeps inputs constant from one time to the next, as
# ``ct.sample_system(..., "zoh")`` has it:
u = np.sin(3 * t[::25])
sampled = ct.sample_system(ct.ss(ct.tf(1, [1, 1, 0])), 0.5, "zoh")
held = nlctl.ensemble_response(ct.ss(ct.tf(1, [1, 1, 0])), T=t[::25], U=u, X0=[[0, 0], [1, 0]],
                               keep=["y[0]"], hold="zoh")  # fmt: skip
assert np.allclose(held.signals["y[0]"][0], ct.forced_response(sampled, t[::25], u).outputs)

# %%
# ``ct.describing_function`` takes every block, and states of a response go by their qualified names:
relay = nlctl.block(nlctl.Relay(on=0.5, off=-0.5), "relay")
print(ct.describing_function(relay, [1.0, 2.0]).round(4))
run = nlctl.input_output_response(example, t)
assert np.array_equal(run.states["plant.x1"], run.states["plant_x1"])

# %%
# What is different:
#
# * parameters are qualified, ``"actuator.b_r"``: two blocks never share one by accident;
# * an unknown name is an error with the nearest name;
# * steps end where equations switch, here at the limits of ``np.clip``, so that no ``max_step`` is needed;
# * a run that diverges is an error (``DivergedError``) unless ``ignore_errors=True``.

r"""
8. From Drake
=============

What you know, and what it is called here:

================================  ================================================================================
Drake                             nlctl
================================  ================================================================================
``LeafSystem``                    a record with ``update`` and ``output``, or ``ct.nlsys``
``DiagramBuilder``, ``Connect``   ``nlctl.interconnect``: signals are connected by their names
``Context``                       there is none: time, state, input and parameters are arguments of pure functions
declared parameters               fields of the record, ``"actuator.b_r"`` in a diagram
direct feedthrough                ``feedthrough``, declared and compared with the equations
witness functions                 conditions of equations are located anyway; ``guard``, ``switching``
unrestricted update at a witness  ``guard`` and ``reset``
per-step events                   a state that is memory, and ``commit``
monitor that terminates           ``stop_when=`` of a run
periodic discrete update          ``nlctl.sampled(block, dt)``
``Simulator``                     ``nlctl.input_output_response``; a run has a status
scalar types: ``AutoDiffXd``      the equations are traced once: machine code, derivatives, intervals, LaTeX
``MonteCarloSimulation``          ``nlctl.ensemble_response``, and studies
================================  ================================================================================

As an example, the pendulum of Drake's tutorials as a leaf system, :math:`m l^{2} \ddot{\theta} = \tau - b \dot\theta -
m g l \sin\theta`.
"""

import numpy as np

import nlctl


@nlctl.record
class Pendulum:
    """Pendulum with a torque at its pin."""

    m: float = nlctl.param(1.0, unit="kg", meaning="mass", above=0)
    l: float = nlctl.param(0.5, unit="m", meaning="length", above=0)  # noqa: E741
    b: float = nlctl.param(0.1, unit="N m s", meaning="damping", at_least=0)
    g: float = nlctl.param(9.81, unit="m/s^2", meaning="gravity")

    inputs, outputs, states, feedthrough = ("tau",), ("theta", "omega"), ("theta", "omega"), False

    @nlctl.equation
    def update(t, x, u, p):
        theta, omega = x
        (tau,) = u
        return omega, (tau - p.b * omega - p.m * p.g * p.l * np.sin(theta)) / (p.m * p.l**2)

    @nlctl.equation
    def output(t, x, u, p):
        return x[0], x[1]


pendulum = nlctl.block(Pendulum(), "pendulum")
print(pendulum)

# %%
# One run, and one with another length: nothing is built again.
t = np.linspace(0, 10, 1001)
for params in ({}, {"pendulum.l": 1.0}):
    theta = nlctl.input_output_response(pendulum, t, 0, [1.0, 0.0], params=params).outputs[0]
    print(params, f"{theta[-1]:.4f}")

# %%
# Where Drake has ``AutoDiffXd``, ``linearize`` has the derivatives of the equations. At rest the poles are those
# of :math:`m l^{2} s^{2} + b s + m g l`:
poles = nlctl.compile(pendulum).linearize([0.0, 0.0]).poles()
assert np.allclose(np.sort_complex(poles), np.sort_complex(np.roots([0.25, 0.1, 4.905])))

# %%
# And the same equations as LaTeX:
(equations,) = nlctl.typeset(pendulum)
print(*equations.equations, sep="\n")

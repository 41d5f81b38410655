r"""A loop whose blocks also output what the proof needs: rates of the states, g, G and d.

The rates are the blocks' own update equations on the loop's own signals, so that V' is the
gradient of V times the right-hand side of the diagram, and no difference of samples.

Whether a plant's update is, as expressions, the chain (1) of the f and d that it declares.

What is proved of f and d over a box is about the plant only if its runs integrate them.

The integral of (32) and (33), as states of a block that is integrated with the loop.

.. math:: I(t) = \int_0^t [k G N(\zeta) + 1] \zeta' e^{-\alpha_1 (t - \tau)} d\tau, \quad
   I' = -\alpha_1 I + [k G N(\zeta) + 1] \zeta' .
"""

import dataclasses
import functools
from collections.abc import Callable
from functools import cached_property
from typing import Any

import control as ct
import numpy as np

from nlctl.annotations import as_annotated
from nlctl.blocks import Block, block
from nlctl.diagrams import Place, interconnect
from nlctl.equations import equation
from nlctl.errors import DiagramError
from nlctl.expressions.graph import Ambiguous, Graph, Untraceable
from nlctl.expressions.trace import trace
from nlctl.native.diagram.parameters import slots_of
from nlctl.native.diagram.trace import traced_arguments
from nlctl.params import param, record
from nlctl.plants import PureFeedback, integrator_chain

from ..bounds.clipped import clipped_split
from ..bounds.decomposition import Decomposition
from .roles import Parts, joined_again


@as_annotated
def sharpest(split: Decomposition) -> Decomposition:
    """Return the split with the same bounds of k and the smallest abs(eps_u) at every (u, v).

    Bounds of eps_u that hold for any split with these k_1, k_2 hold for this one, which is the
    one that is evaluated along trajectories.  Machine code can call its ``part``.

    Parameters
    ----------
    split : Decomposition
        Any split of the actuator.

    Returns
    -------
    Decomposition
        With the same k_1 and k_2, and a smaller or equal eps_u*.

    Examples
    --------
    Where v = k u is within the bounds of k nothing is left for eps_u:

    >>> from nlctl.analysis.lyapunov import decompose, sharpest
    >>> split = decompose(nlctl.DeadZone(ripple_r=0, ripple_l=0))
    >>> zone = nlctl.block(nlctl.DeadZone(ripple_r=0, ripple_l=0), "actuator")
    >>> v = float(zone.output(0, [], [10.0])[0])
    >>> print(v, sharpest(split).part(10.0, v), split.part(10.0, v))
    9.5 9.5 10.0
    """
    return dataclasses.replace(split, part=clipped_split(split.k_1, split.k_2))


@record
class NussbaumIntegral:
    """The integrals of (32) and (33), three readings of the latter.

        I'         = -alpha_1 I + w,             w = [k G N(zeta) + 1] zeta' = r G k u + zeta'
        I_bar'     = -alpha_1 I_bar + |w|
        I_printed' = -alpha_1 I_printed + |k G N(zeta) + 1| zeta'

    sup I is the Q that (34) needs; sup I_bar bounds it; the integral that is printed in (33),
    with the bar over the bracket alone, does not, since zeta' may be negative.

    Parameters
    ----------
    part : equation, optional
        ``part(u, v)`` is k u of the actuator's split (2); by default k = 1.

    Examples
    --------
    Its three integrals are states and outputs:

    >>> from nlctl.analysis.lyapunov import NussbaumIntegral
    >>> nlctl.block(NussbaumIntegral(), "integral").state_labels
    ['I', 'I_bar', 'I_printed']
    """

    alpha_1: float = param(0.25, unit="1/s", meaning="rate of the weight", at_least=0)
    part: Callable[[Any, Any], Any] = clipped_split(1.0, 1.0)

    inputs = ("r", "u", "v", "G", "rate_zeta")
    outputs = ("kGu", "I", "I_bar", "I_printed")
    states = ("I", "I_bar", "I_printed")
    feedthrough = True

    @cached_property
    def output(self) -> Callable:
        """k G u, and the integrals."""
        part = equation(self.part)

        @equation
        def output(t, x, u, p):
            _, control, v, G, _ = u
            return G * part(control, v), x[0], x[1], x[2]

        return output

    @cached_property
    def update(self) -> Callable:
        """The integrands."""
        part = equation(self.part)

        @equation
        def update(t, x, u, p):
            r, control, v, G, rate_zeta = u
            I, I_bar, I_printed = x  # noqa: E741
            w = r * G * part(control, v) + rate_zeta
            return (
                -p.alpha_1 * I + w,
                -p.alpha_1 * I_bar + abs(w),
                -p.alpha_1 * I_printed + abs(w) * np.sign(rate_zeta),
            )

        return update


NEAR = 1e-5  # |v| below which G is interpolated: F/v would lose its digits


def input_gain(f: Callable) -> Callable:
    """Make the equation G(x, v) = F(x, v) / v of (6), (7), with its limit at v = 0."""
    # For |v| < 1e-5 it is the line through its values at v = -1e-5 and 1e-5, whose error is of the
    # order of the rounding, 1e-11, for a twice differentiable F.

    @equation
    def gain(x, v, p):
        at_rest = f(x, 0.0, p)
        far = abs(v) >= NEAR  # false for NaN, which then reaches G
        # a choice of values, not a case: cases of f would be followed twice
        quotient = (f(x, v, p) - at_rest) / np.where(far, v, 1.0)
        right, left = (f(x, NEAR, p) - at_rest) / NEAR, (at_rest - f(x, -NEAR, p)) / NEAR
        return np.where(far, quotient, 0.5 * (right + left) + 0.5 * (right - left) * (v / NEAR))

    return gain


@as_annotated
def observed(
    loop: ct.InterconnectedSystem, parts: Parts, split: Decomposition, alpha_1: float
) -> ct.InterconnectedSystem:
    """Return the loop with all its signals as outputs, and with the integrals of (32), (33).

    Added are ``rate_<state>`` for every state of plant, weights, robust term and law, the
    estimates ``W_hat[i]``, ``g``, ``G``, ``d`` and ``state_<state>`` of the plant, and
    `NussbaumIntegral`.

    Parameters
    ----------
    loop : control.InterconnectedSystem
        The closed loop; it stays as it is.
    parts : Parts
        What `read_parts` found in it; the blocks are given the parameters of that run.
    split : Decomposition
        Of the actuator; machine code must be able to call its ``part``, see `sharpest`.
    alpha_1 : float
        Rate of the weight in (32).

    Returns
    -------
    control.InterconnectedSystem
        To be compiled, and run from ``nlctl.initial_state``.

    Raises
    ------
    DiagramError
        If the law has no Nussbaum argument.

    Examples
    --------
    Every step of the proof, from a run of the loop with all its signals:

    >>> from nlctl.analysis.lyapunov import (
    ...     Box, comparison, constants, inequalities, observed, premises, read_parts, signals_of
    ... )
    >>> controller = nlctl.controllers.ablations(nlctl.adaptive_neural(2))["no network"]
    >>> loop = nlctl.paper.example_1(controller=controller)
    >>> box = Box(names=("x1", "x2", "v"), low=(-1.0, -1.0, -5.0), high=(1.0, 1.5, 5.0))
    >>> found = constants(loop, box, times=(0.0, 1.0))
    >>> given = premises(found)
    >>> seen = observed(loop, read_parts(loop), given.split, found["alpha_1"])
    >>> run = nlctl.input_output_response(seen, np.linspace(0, 0.2, 51), engine="native")
    >>> margins = {margin.equation: margin for margin in inequalities(signals_of(run), given)}
    >>> bool(margins["(31)"].margin.min() > 0)
    True
    >>> bound = comparison(signals_of(run), given, 0.1, 0.2)
    >>> bool(bound.max_r <= bound.bound < np.inf)
    True
    """
    if "zeta" not in parts.law.states or not hasattr(parts.law, "N"):
        raise DiagramError(
            "(23), (24) need a law with the state zeta and a function N, got "
            f"{type(parts.law).__name__}: for a known sign see certify"
        )
    integral = NussbaumIntegral(alpha_1=alpha_1, part=split.part)
    systems = [*joined_again(loop, parts.roles, _observed_block), block(integral, "integral")]
    return interconnect(systems, name=f"{loop.name}_observed")


def _observed_block(part: str, spec: Any, name: str) -> Block:
    if part == "plant":
        spec = _with_outputs(spec, *_plant_terms(spec))
    elif part in ("weights", "robust", "law"):
        spec = _with_outputs(spec)
    return block(spec, name)


def _plant_terms(plant: Any) -> tuple[tuple[str, ...], Callable]:
    """Return the outputs g, G, d and the states of a plant, and the equation of them."""
    f, d = terms_with_parameters(plant)
    G = input_gain(f)

    @equation
    def terms(t, x, u, p):
        (v,) = u
        state = tuple(x)
        return (f(state, 0.0, p), G(state, v, p), d(state, t, p)) + state

    return ("g", "G", "d", *(f"state_{name}" for name in plant.states)), terms


def _with_outputs(spec: Any, names: tuple[str, ...] = (), terms: Callable | None = None) -> Any:
    """Return a record with the same parameters and equations, and with more outputs."""
    # These are the rates of its states, of a record of vectors also the states that it does not
    # output, and what `terms` returns.
    if not spec.states:
        return spec
    vector = getattr(spec, "vector", False)
    hidden = [s for s in spec.states if s not in spec.outputs] if vector else []
    output = _longer_vector(spec, hidden) if vector else _longer_tuple(spec, terms)
    namespace = {
        "outputs": (*spec.outputs, *(f"rate_{s}" for s in spec.states), *hidden, *names),
        "output": staticmethod(output),
        "feedthrough": True,
    }
    kind = type(type(spec).__name__, (type(spec),), namespace)
    return kind(**{f.name: getattr(spec, f.name) for f in dataclasses.fields(spec) if f.init})


def _longer_vector(spec: Any, hidden: list[str]) -> Callable:
    output, update = spec.output, spec.update
    picked = np.array([list(spec.states).index(s) for s in hidden], dtype=np.int64)

    @equation
    def longer(t, x, u, p):
        return np.concatenate((np.array(output(t, x, u, p)), update(t, x, u, p), x[picked]))

    return longer


def _longer_tuple(spec: Any, terms: Callable | None) -> Callable:
    output, update = spec.output, spec.update
    more = no_terms if terms is None else terms

    @equation
    def longer(t, x, u, p):
        return output(t, x, u, p) + update(t, x, u, p) + more(t, x, u, p)

    return longer


@equation
def no_terms(t, x, u, p):
    """Nothing to add."""
    return ()


def terms_with_parameters(plant: Any) -> tuple[Callable, Callable]:
    """Return ``f(x, v, p)`` and ``d(x, t, p)`` as equations that machine code can call."""
    return plant.terms if isinstance(plant, PureFeedback) else (plant.f, plant.d)


def update_is_declared(plant: Place) -> bool:
    """Whether the update function and the chain of f and d are the same expressions."""
    # False where they differ, and where that is unknown: expressions that are equal but written in
    # another way count as different.
    system, graph = plant.system, Graph()
    declared = integrator_chain(*terms_with_parameters(system.current_spec))

    given = functools.partial(traced_arguments, graph, system, slots_of(system))
    try:
        with np.errstate(all="ignore"):
            one, other = (trace(graph, f, given) for f in (system.updfcn, declared))
    except (Untraceable, Ambiguous):
        return False
    pairs = zip(one.cells.flat, other.cells.flat, strict=False)
    return one.shape == other.shape and all(a is b for a, b in pairs)

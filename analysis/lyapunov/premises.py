"""The numbers that the inequalities suppose, and the paper's own reading of Example 1."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.params import equation_arguments
from nlctl.plants import ForcedDuffing, duffing_forcing

from ..intervals.arithmetic import as_ball
from ..intervals.box import Box
from ..intervals.branch_and_bound import enclose, upper
from .bounds.decomposition import Decomposition
from .bounds.error_bounds import Gains, alpha_0, alpha_1, initial_V, total_error
from .constants import Constants, bound
from .loop.integral import sharpest


@described_record(made_by="literal")
class Premises:
    """What the proof supposes of a loop, as numbers."""

    gains: Gains
    lambdas: tuple[float, ...]  # Of the filtered error (14).
    N: Callable[[Any], Any]  # Nussbaum function.
    W: np.ndarray  # (l,): Ideal weights.
    split: Decomposition  # Of the actuator, along trajectories.
    G_min: float  # Bounds of G, d* and eps*, and delta*.
    G_max: float
    d: float
    eps: float
    delta: float
    # ``forcing(t)`` of arrays: what the reading counts to g and not to d.
    forcing: Callable[[np.ndarray], np.ndarray] = np.zeros_like

    @property
    def alpha_0(self) -> float:
        """Constant of (31)."""
        return float(alpha_0(self.gains, self.delta, float(self.W @ self.W)))

    @property
    def alpha_1(self) -> float:
        """Rate of (31)."""
        return alpha_1(self.gains)

    @property
    def V_0(self) -> float:  # noqa: N802
        """V(0) of (21), from where the controller starts."""
        error = self.W - np.array(self.gains.W_hat_0)
        return float(initial_V(self.gains, self.delta, float(error @ error)))

    def C_0(self, V_0: float, Q: float) -> float:  # noqa: N802
        """C_0 of (36).

        Parameters
        ----------
        V_0 : float
            V at the start.
        Q : float
            Supremum of I(t), (33).

        Returns
        -------
        float
            Bound of |r|; infinite where alpha_1 = 0.
        """
        return bound(self.alpha_0, self.alpha_1, V_0, Q)


@as_annotated
def premises(
    constants: Constants, gains: Gains | None = None, split: Decomposition | None = None
) -> Premises:
    """Return the premises that constants make.

    Parameters
    ----------
    constants : Constants
        Of the loop, see `constants`.
    gains : Gains, optional
        Of a member of an ensemble; by default those of the constants.
    split : Decomposition, optional
        By default `sharpest` of the constants' split.

    Examples
    --------
    See `literal`.
    """
    parts = constants.parts
    return Premises(
        gains=parts.gains if gains is None else gains,
        lambdas=tuple(parts.filtered_error.lambdas),
        N=parts.law.N,
        W=constants.W,
        split=sharpest(constants.split) if split is None else split,
        G_min=constants["G_min"],
        G_max=constants["G_max"],
        d=constants["d*"],
        eps=constants["eps*"],
        delta=constants["delta*"],
    )


@as_annotated
def literal(given: Premises, constants: Constants, plant: object = None) -> Premises | None:
    """Return the premises of Example 1 as the paper prints them; None for another plant.

    There q cos(w t) stands inside g, so that d* bounds 0.1 |x|^2 sin t alone, and eps* the error
    of the network against that g, with q cos(w t) in it.

    Parameters
    ----------
    given : Premises
        The derived ones.
    constants : Constants
        Their plant and box give d* and eps*.
    plant : record, optional
        Of a member of an ensemble, for its forcing.

    Returns
    -------
    Premises or None
        With the printed numbers instead of the derived ones.

    Examples
    --------
    What leaves the disturbance comes back as an error of the network:

    >>> import numpy as np
    >>> import nlctl
    >>> from nlctl.analysis.lyapunov import Box, constants, literal, premises
    >>> controller = nlctl.controllers.ablations(nlctl.adaptive_neural(2))["no network"]
    >>> loop = nlctl.paper.example_1(controller=controller)
    >>> box = Box(names=("x1", "x2", "v"), low=(-1.0, -1.0, -5.0), high=(1.0, 1.0, 5.0))
    >>> found = constants(loop, box, times=(0.0, 1.0))
    >>> given = premises(found)
    >>> printed = literal(given, found)
    >>> bool(printed.d < 0.21 < 5.0 < given.d)
    True
    >>> print(round(printed.eps - given.eps, 2))
    5.1
    """
    declared: Any = constants.parts.plant
    plant = declared if plant is None else plant
    if not isinstance(declared, ForcedDuffing):
        return None
    quiet = dataclasses.replace(declared, q_mean=0.0, q_ripple=0.0)
    quiet_params, p = equation_arguments(quiet), equation_arguments(plant)
    box = constants.box.only("x1", "x2").times("t", 0.0, np.inf)
    d = enclose(lambda z: quiet.d(z[:-1], z[-1], quiet_params), box).magnitude
    eps = upper(as_ball(given.eps) + forcing_bound(declared))
    return dataclasses.replace(
        given,
        d=d,
        eps=eps,
        delta=upper(total_error(as_ball(given.G_max), given.split.eps_star, d, eps)),
        forcing=lambda t: duffing_forcing(t, p),
    )


def forcing_bound(plant: ForcedDuffing) -> float:
    """Return a proved bound of |q cos(w t)| for all time."""
    # No network of x alone comes closer to a g with q cos(w t) in it: at one x such a g takes
    # values that are that far from their middle.
    p = equation_arguments(plant)
    return enclose(lambda z: duffing_forcing(z[0], p), Box.of(t=(0.0, np.inf))).magnitude

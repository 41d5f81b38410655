"""The constants of the proof (18)-(36) for one loop and one box, and what is supposed of a run."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np

from nlctl.annotations import as_annotated
from nlctl.arguments import number, of_type, vector
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.functions import smooth_sign
from nlctl.names import unknown
from nlctl.params import equation_arguments
from nlctl.plants import ForcedDuffing, coordinate_names, duffing_forcing
from nlctl.wording import counted

from ..intervals.arithmetic import as_ball
from ..intervals.box import Box
from ..intervals.branch_and_bound import Proof, Range, enclose, prove, upper
from .bounds.decomposition import Decomposition, decompose
from .bounds.error_bounds import KAPPA, Gains, alpha_0, alpha_1, final_bound, initial_V, total_error
from .bounds.sector import Sector, plant_terms, sector
from .bounds.weights import approximation_error, network_on_grid, tightest_weights
from .loop.instrumented import sharpest
from .loop.roles import Parts, read_parts
from .proofs.result import Constant, Provenance, Row, constants_of_rows, per_second, rows_of_split

if TYPE_CHECKING:
    import pandas as pd


@described_record(made_by="literal")
class Constants:
    """All constants of the proof for one loop and one box.

    ``constants["delta*"]`` is a value.  The bounds hold while the trajectory stays in the box.
    """

    entries: tuple[Constant, ...]
    parts: Parts  # The records that they belong to; ``parts.gains`` are the controller's gains.
    box: Box
    sector: Sector
    split: Decomposition  # Of the actuator.
    W: np.ndarray  # (l,): The ideal weights that were chosen; empty without a network.

    def __getitem__(self, symbol: str) -> float:
        for entry in self.entries:
            if entry.symbol == symbol:
                return entry.value
        raise unknown("constant", symbol, [entry.symbol for entry in self.entries])

    def C_0(self, Q: float = 0.0) -> float:  # noqa: N802
        """Return C_0 of (36) for Q = sup I(t), (33); infinite where alpha_1 = 0.

        Parameters
        ----------
        Q : float, optional
            Supremum of I(t), from 0 on.

        Returns
        -------
        float
            In the unit of V.
        """
        return bound(self["alpha_0"], self["alpha_1"], self["V(0)"], Q)

    def ultimate(self, limsup_I: float = 0.0) -> float:
        """Return the bound of limsup |r| that (34) gives for limsup I(t).

        Parameters
        ----------
        limsup_I : float, optional
            Limit superior of I(t).

        Returns
        -------
        float
            In the unit of r.
        """
        return bound(self["alpha_0"], self["alpha_1"], 0.0, limsup_I)

    def table(self) -> pd.DataFrame:
        """Return the constants as a table with one row each, indexed by symbol.

        Returns
        -------
        DataFrame
            Values with where they come from.
        """
        import pandas as pd

        return pd.DataFrame([vars(entry) for entry in self.entries]).set_index("symbol")

    def __str__(self) -> str:
        width = max(len(entry.symbol) for entry in self.entries)
        lines = [f"Constants over {self.box}"]
        lines += [
            f"  {e.symbol:<{width}}  {e.value:<10.6g} {e.unit:<7}  {e.provenance:<8}  {e.how}"
            for e in self.entries
        ]
        return "\n".join(lines)


def bound(alpha_0: float, alpha_1: float, V_0: float, Q: float) -> float:
    """C_0 rounded up; without decay there is no bound."""
    return upper(final_bound(as_ball(alpha_0), alpha_1, V_0, Q)) if alpha_1 > 0 else np.inf


def kappa() -> Proof:
    """Prove s - s tanh s <= 0.2785 for s >= 0, (29), with the equation of the robust term.

    By branch and bound on [0, 10].  Beyond, s - s tanh s < 2 s exp(-2 s), which falls for
    s > 1/2 and is below 1e-7 at s = 10.

    Returns
    -------
    Proof
        Whether 0.2785 holds on [0, 10].

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import kappa
    >>> kappa().holds
    True
    """
    return prove(lambda s: s[0] - s[0] * smooth_sign(s[0], 1.0), Box.of(s=(0, 10)), high=KAPPA)


@as_annotated
def disturbance(plant: Any, box: Box, times: tuple[float, float], *, tol: float = 1e-3) -> Range:
    """Prove the range of d(x, t) over a box and a span of time, which may be infinite.

    Parameters
    ----------
    plant : record
        Plant of the class (1).
    box : Box
        Sides x1, ..., xn.
    times : (start, end)
        In s; ``(0, inf)`` bounds d for all time, with the phases at their worst.
    tol : float, optional
        As in `nlctl.analysis.intervals.branch_and_bound.enclose`.

    Returns
    -------
    Range
        In the unit of d, rounded outwards.

    Raises
    ------
    ParameterError
        If it is not a box, `times` is not a pair in order, or `tol` is not positive.

    Examples
    --------
    sin(0.1 t) of Example 2, for all time:

    >>> from nlctl.analysis.lyapunov import Box, disturbance
    >>> box = Box(names=("x1", "x2", "x3"), low=(-1.0,) * 3, high=(1.0,) * 3)
    >>> found = disturbance(nlctl.plants.Genesio(), box, (0.0, np.inf))
    >>> -1.0001 < found.low <= -1.0 and 1.0 <= found.high < 1.0001
    True
    """
    _, d = plant_terms(plant)
    of_type("disturbance", "box", box, Box, "Box.of(x1=(-1, 1))")
    if not (isinstance(times, tuple | list) and len(times) == 2 and times[0] <= times[1]):
        raise ParameterError(f"disturbance needs times = (start, end) in s, got {times}")
    return enclose(lambda z: d(z[:-1], z[-1]), box.times("t", *times), tol=tol)


@as_annotated
def constants(
    loop: ct.InterconnectedSystem,
    box: Box,
    *,
    W: object = None,
    k: tuple[float, float] | None = None,
    times: tuple[float, float] = (0.0, np.inf),
    start: Mapping[str, float] | None = None,
    params: Mapping[str, Any] | None = None,
    tol: float = 1e-3,
) -> Constants:
    """Assemble the constants of the proof for a loop and a box.

    Parameters
    ----------
    loop : control.InterconnectedSystem
        A loop of `nlctl.paper`, or any diagram of a plant, an actuator, a reference and the
        pieces of the paper's controller.
    box : Box
        Sides x1, ..., xn, and v (all v without it); see `visited_box`.  A side u says for which
        inputs a split of the actuator is proved.
    W : array_like of shape (l,), optional
        Ideal weights; by default those that make C_0 smallest, see `tightest_weights`.
    k : (k_1, k_2), optional
        Bounds of the actuator's gain, see `decompose`.
    times : (start, end), optional
        Span of time for d*, in s.
    start, params : mapping, optional
        Initial states and parameters other than the loop's own.
    tol : float, optional
        Of every branch and bound.

    Raises
    ------
    DiagramError
        If the loop is not one that the proof is about.
    DecompositionError
        If the actuator has no split (2).
    ParameterError, UnknownNameError
        If the box lacks a side, W has the wrong length or its norm is above 1e5.

    Examples
    --------
    See `literal`.
    """
    parts = read_parts(loop, start, params)
    box = of_type("constants", "box", box, Box, "Box.of(x1=(-1, 1), v=(-5, 5))")
    number("constants", "tol", tol, above=0)
    reach = {"u_max": max(map(abs, box["u"]))} if "u" in box.names else {}
    return constants_of(parts, decompose(parts.actuator, k=k, **reach), box, W, times, tol)


def constants_of(
    parts: Parts,
    split: Decomposition,
    box: Box,
    W: object = None,
    times: tuple[float, float] = (0.0, np.inf),
    tol: float = 1e-3,
) -> Constants:
    """Assemble the constants of a loop that is read already, see `constants`."""
    states = box.only(*coordinate_names(parts.order))
    v = box["v"] if "v" in box.names else (-np.inf, np.inf)
    over_v = states.times("v", *v)
    bounds = sector(parts.plant, over_v, tol=tol)
    d = disturbance(parts.plant, states, times, tol=tol)
    rest = total_error(bounds.G_max, split.eps_star, d.magnitude, 0.0)
    W, origin = _weights(parts, states, W, rest)
    eps = approximation_error(parts.plant, parts.basis, W, states, tol=tol)
    G_max = as_ball(bounds.G_max)
    delta = upper(total_error(G_max, split.eps_star, d.magnitude, eps.magnitude))
    entries = constants_of_rows([
        *_sector_rows(bounds, over_v, parts.order), *rows_of_split(split),
        *_error_rows(d, eps, states, times, parts.order), *_final_rows(parts, W, origin, delta),
    ])  # fmt: skip
    return Constants(entries=entries, parts=parts, box=over_v, sector=bounds, split=split, W=W)


def _weights(
    parts: Parts, box: Box, W: object, rest: float
) -> tuple[np.ndarray, tuple[Provenance, str]]:
    """Return the weights, and where they come from."""
    nodes = len(parts.gains.W_hat_0)
    if not nodes:
        return np.zeros(0), ("given", "no network")
    if W is None and not np.isfinite(rest):
        return np.zeros(nodes), ("computed", "0: delta* is infinite for every W")
    if W is None:
        W = tightest_weights(network_on_grid(parts.plant, parts.basis, box), parts.gains, rest)
        return W, ("computed", "argmin of C_0 (convex programme on a grid); any W will do")
    W = vector("constants", "W", W)
    if W.shape != (nodes,):
        raise ParameterError(f"constants needs W of shape ({nodes},), got {W.shape}")
    return W, ("given", "any W will do")


def _outcome(bound: float) -> Provenance:
    return "proved" if np.isfinite(bound) else "undecided"


def _sector_rows(bounds: Sector, box: Box, n: int) -> Iterator[Row]:
    how = f"F/v, {counted(bounds.boxes, 'box', 'boxes')}"
    notes = {"m1": "v >= 0", "m2": "v >= 0", "m3": "v < 0, upper", "m4": "v < 0, lower"}
    for symbol in ("m1", "m2", "m3", "m4", "G_min", "G_max"):
        value = getattr(bounds, symbol)
        if not np.isnan(value):  # a box without v < 0 has no m3, m4
            note = f"{notes[symbol]}: {how}" if symbol in notes else how
            yield symbol, value, per_second(n), _outcome(value), note, str(box)


def _error_rows(
    d: Range, eps: Range, box: Box, times: tuple[float, float], n: int
) -> Iterator[Row]:
    at = f"{box}, t in [{times[0]:g}, {times[1]:g}] s"
    rows = (("d*", d, "sup |d(x, t)|", at), ("eps*", eps, "sup |g - W^T psi|", str(box)))
    for symbol, supremum, what, over in rows:
        value, how = supremum.magnitude, f"{what}, {counted(supremum.boxes, 'box', 'boxes')}"
        yield symbol, value, per_second(n), _outcome(value), how, over


def _final_rows(
    parts: Parts, W: np.ndarray, origin: tuple[Provenance, str], delta: float
) -> list[Row]:
    """(20), (29), (31), (21), (36), rounded up."""
    gains, n = parts.gains, parts.order
    error = W - np.array(gains.W_hat_0)
    squares = [sum((as_ball(w) ** 2 for w in vector), as_ball(0)) for vector in (W, error)]
    a_0 = upper(alpha_0(gains, as_ball(delta), squares[0]))
    V_0, a_1 = upper(initial_V(gains, as_ball(delta), squares[1])), alpha_1(gains)
    rates = "min{2 beta, sigma_1 Gamma, sigma_2 gamma}" if gains.W_hat_0 else "no network"
    return [
        ("|W|", float(np.linalg.norm(W)), per_second(n), *origin, "a fixed W"),
        ("kappa", KAPPA, "1", "proved", "(29), branch and bound and a tail estimate", "all s"),
        ("delta*", delta, per_second(n), "computed", "G_max eps_u* + d* + eps*", "the box"),
        ("alpha_1", a_1, "1/s", "computed", rates, "all t"),
        ("alpha_0", a_0, per_second(2 * n - 1), "computed", "(31)", "the box"),
        ("V(0)", V_0, per_second(2 * n - 2), "computed", "(21)", "this initial state"),
        ("C_0", bound(a_0, a_1, V_0, 0.0), per_second(n - 1), "computed", "(36), Q = 0", "the box"),
    ]


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

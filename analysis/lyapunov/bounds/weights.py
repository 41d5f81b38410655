"""Ideal weights W* of (11), and the error eps* of the network with given weights.

The proof holds for every fixed W with its own eps*, so W is a choice.  The minimax weights of
(11) are ill-conditioned (norms of 1e17 and more); those that make the final bound smallest are
the solution of a convex programme.  Weights are computed on a grid, where eps* is a lower bound;
`approximation_error` proves eps* over the whole box.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from nlctl.annotations import as_annotated
from nlctl.controllers import AdaptiveWeights
from nlctl.errors import ParameterError
from nlctl.params import equation_arguments

from ...intervals.branch_and_bound import Box, Range, enclose
from ..convex import at_most, minimizer
from .error_bounds import Gains, alpha_0, alpha_1, initial_V
from .sector import plant_terms

LARGEST_NORM = 1e5  # |W|^2 = 1e10 has a rounding error of 1e-6 in double precision


@dataclass(frozen=True, kw_only=True)
class Network:
    """The network and the function that it approximates, on a grid."""

    psi: np.ndarray  # shape (m, l); basis functions at the m grid points
    g: np.ndarray  # shape (m,); g(x) = f(x, 0)
    points: np.ndarray  # shape (m, n)

    def error(self, W: np.ndarray) -> float:
        """Return max |g - W^T psi| over the grid: a lower bound of eps*."""
        return float(np.max(np.abs(self.g - self.psi @ W)))


def network_on_grid(plant: Any, basis: Any, box: Box, per_side: int | None = None) -> Network:
    """Evaluate the basis, if there is one, and g on a full grid over a box."""
    n = len(box.names)
    per_side = max(3, round(3500 ** (1 / n)) + 2 * (n == 2)) if per_side is None else per_side
    axes = [np.linspace(a, b, per_side) for a, b in box.cell]
    points = np.array(list(itertools.product(*axes)))
    f, _ = plant_terms(plant)
    psi = np.zeros((len(points), 0))
    if basis is not None:
        p, inputs = equation_arguments(basis), len(basis.inputs)
        psi = np.array([basis.output(0.0, (), x[:inputs], p) for x in points])
    return Network(psi=psi, g=np.array([f(tuple(x), 0.0) for x in points]), points=points)


@as_annotated
def minimax_weights(network: Network, largest: float | None = None) -> np.ndarray:
    """Return W* of (11): the weights with the smallest max |g - W^T psi| on the grid.

    A linear programme (HiGHS) with columns scaled to maximum 1.

    Parameters
    ----------
    network : Network
        Basis and g on a grid, see `network_on_grid`.
    largest : float, optional
        Bound of every |W_i|; without it the weights have no useful size.

    Returns
    -------
    ndarray of shape (l,)
        W*, in the unit of g.

    Raises
    ------
    ParameterError
        If the linear programme has no solution that HiGHS finds.

    Examples
    --------
    The best constant for g = x1^2 on [0, 1] misses it by 1/2 at both ends:

    >>> from nlctl.analysis.lyapunov import minimax_weights
    >>> from nlctl.analysis.lyapunov.bounds.weights import Network
    >>> x = np.linspace(0, 1, 11)[:, None]
    >>> network = Network(psi=np.ones((11, 1)), g=x[:, 0] ** 2, points=x)
    >>> W = minimax_weights(network)
    >>> print(W.round(6), round(network.error(W), 6))
    [0.5] 0.5
    """
    from scipy.optimize import linprog

    scale = np.max(np.abs(network.psi), axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    columns, one = network.psi / scale, np.ones((len(network.g), 1))
    bounds: list[tuple[float | None, float | None]] = [
        (None, None) if largest is None else (-largest * s, largest * s) for s in scale
    ]
    result = linprog(
        np.append(np.zeros(scale.size), 1.0),
        A_ub=np.block([[columns, -one], [-columns, -one]]),
        b_ub=np.concatenate([network.g, -network.g]),
        bounds=[*bounds, (0, None)],
        method="highs",
    )
    if result.x is None:
        raise ParameterError(f"minimax_weights found no weights: {result.message}")
    return result.x[:-1] / scale


@as_annotated
def tightest_weights(network: Network, gains: Gains, delta_rest: float) -> np.ndarray:
    """Return the weights that make the final bound C_0 of (36) smallest, for Q = 0.

    The convex programme  min alpha_0/alpha_1 + V(0)  over W and eps* with
    delta* = delta_rest + eps* and |g - W^T psi| <= eps* on the grid (Clarabel).

    Parameters
    ----------
    network : Network
        Basis and g on a grid, see `network_on_grid`.
    gains : Gains
        Gains of the controller, for V(0), alpha_0 and alpha_1.
    delta_rest : float
        G_max eps_u* + d*.

    Returns
    -------
    ndarray of shape (l,)
        W, in the unit of g.

    Raises
    ------
    ParameterError
        If the solver finds no solution, or the network has not as many nodes as W_hat(0).

    Examples
    --------
    A larger sigma_1 makes weights costly: they become smaller than those that approximate best.

    >>> import dataclasses
    >>> from nlctl.analysis.lyapunov import read_parts, tightest_weights
    >>> from nlctl.analysis.lyapunov.bounds.weights import Network
    >>> x = np.linspace(0, 1, 11)[:, None]
    >>> network = Network(psi=np.ones((11, 1)), g=x[:, 0] ** 2, points=x)
    >>> gains = read_parts(nlctl.paper.example_1()).gains
    >>> gains = dataclasses.replace(gains, W_hat_0=(0.0,))
    >>> W = tightest_weights(network, gains, delta_rest=0.0)
    >>> bool(0.0 < W[0] <= 0.5)
    True
    """
    nodes = network.psi.shape[1]
    if len(gains.W_hat_0) != nodes:
        raise ParameterError(
            f"tightest_weights needs as many nodes in the network as in W_hat(0), got {nodes} and "
            f"{len(gains.W_hat_0)}: take the basis of the controller"
        )
    P, q = _cost_of_weights(gains, delta_rest)
    error = -np.ones((len(network.g), 1))
    limits = [
        at_most(np.hstack([network.psi, error]), network.g),
        at_most(np.hstack([-network.psi, error]), -network.g),
    ]
    x, status = minimizer(P, q, limits)
    if x is None:
        raise ParameterError(f"tightest_weights found no weights: the solver says {status}")
    return x[:-1]


def _cost_of_weights(gains: Gains, delta_rest: float) -> tuple[np.ndarray, np.ndarray]:
    """Return alpha_0/alpha_1 + V(0) as x^T P x / 2 + q^T x but for a constant, x = (W, eps*)."""
    # The formulas take polynomials: in eps*, in |W|^2 and in |W - W_hat(0)|^2.
    one = Polynomial([0.0, 1.0])
    by_eps, by_W = alpha_0(gains, delta_rest + one, 0.0), alpha_0(gains, 0.0, one)
    by_W_error, rate = Polynomial([0.0]), alpha_1(gains)
    if rate > 0:  # otherwise C_0 is infinite for every W, and alpha_0 is what W can make small
        by_eps = by_eps / rate + initial_V(gains, delta_rest + one, 0.0)
        by_W, by_W_error = by_W / rate, initial_V(gains, 0.0, one)
    of_W, of_W_error = by_W.deriv()(0.0), by_W_error.deriv()(0.0)
    start = np.array(gains.W_hat_0)
    P = np.diag(np.append(np.full(start.size, 2 * (of_W + of_W_error)), by_eps.deriv(2)(0.0)))
    return P, np.append(-2 * of_W_error * start, by_eps.deriv()(0.0))


@as_annotated
def approximation_error(
    plant: Any, basis: Any, W: object, box: Box, *, tol: float = 1e-3, max_boxes: int = 50_000
) -> Range:
    """Prove the range of eps(x) = g(x) - W^T psi(x) over a box, (19).

    eps* is its ``magnitude``.  With no weights (``W = ()``) it is the range of g.

    Parameters
    ----------
    plant : record
        Plant of the class (1).
    basis : record or None
        `nlctl.controllers.GaussianBasis`, of the first states; may be None without weights.
    W : array_like of shape (l,)
        Any weights of norm up to 1e5.
    box : Box
        Sides x1, ..., xn.
    tol : float, optional
        Each end is at most this far from a value that is attained, in the unit of g.
    max_boxes : int, optional
        Limit of the branch and bound; where it is reached the range is wider, still proved.

    Returns
    -------
    Range
        In the unit of g, rounded outwards.

    Raises
    ------
    ParameterError
        If the norm of W is larger: W^T psi and V then lose their digits to rounding.

    Examples
    --------
    Without weights it is the range of g, here -6 x1 + x1^2 for x1 in [0, 0.1]:

    >>> from nlctl.analysis.lyapunov import Box, approximation_error
    >>> box = Box(names=("x1", "x2", "x3"), low=(0.0,) * 3, high=(0.1, 0.0, 0.0))
    >>> found = approximation_error(nlctl.plants.Genesio(), None, (), box)
    >>> print(round(found.low, 2), round(abs(found.high), 2))
    -0.59 0.0
    """
    W = np.asarray(W, dtype=float)
    norm = float(np.linalg.norm(W))
    if not norm <= LARGEST_NORM:
        raise ParameterError(
            f"approximation_error needs |W| <= {LARGEST_NORM:g}, got {norm:.3g}: |W|^2 enters V "
            "and (31), where rounding would exceed the bound; use tightest_weights, or "
            "minimax_weights with largest="
        )
    f, _ = plant_terms(plant)
    if not W.size:
        return enclose(lambda x: f(x, 0.0), box, tol=tol, max_boxes=max_boxes)
    p, weights = equation_arguments(basis), AdaptiveWeights(nodes=W.size)
    gains, inputs = equation_arguments(weights), len(basis.inputs)

    def eps(x: tuple[Any, ...]) -> Any:
        psi = basis.output(0.0, (), np.array(x[:inputs], dtype=object), p)
        W_psi, _ = weights.output(0.0, W, np.append(np.array([0.0], dtype=object), psi), gains)
        return f(x, 0.0) - W_psi

    return enclose(eps, box, tol=tol, max_boxes=max_boxes)

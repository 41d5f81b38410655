"""RBF network (10), (19): Gaussian basis, where its centres lie, and its weights (25)."""

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..arguments import integer, number, tuple_of
from ..diagrams import as_system
from ..equations import equation
from ..errors import ParameterError
from ..functions import gaussian
from ..params import Floats, Matrix, param, record, set_integer
from ..plants import coordinate_names
from ..wording import counted


def _rows(array: np.ndarray) -> Matrix:
    return tuple(tuple(map(float, row)) for row in array)


def _checked(who: str, count: int, inputs: int, low: float, high: float) -> int:
    integer(who, "inputs", inputs, at_least=1)
    number(who, "low", low)
    number(who, "high", high)
    return integer(who, "count", count, at_least=1)


@as_annotated
def diagonal_centres(count: int, inputs: int, low: float = -10, high: float = 10) -> Matrix:
    """Return `count` centres evenly spaced on the diagonal of [low, high]^inputs.

    The usual reading of "27 centres evenly distributed in [-10, 10] x [-10, 10]".

    Parameters
    ----------
    count : int
        Number of centres.
    inputs : int
        Number of the network's inputs.
    low, high : float, optional
        Ends of the diagonal, in the inputs' units.

    Returns
    -------
    tuple of tuple of float
        `count` rows of `inputs` numbers.

    Raises
    ------
    ParameterError
        If `count` or `inputs` is not an integer >= 1, or an end is not finite.

    Examples
    --------
    >>> diagonal_centres(3, 2)
    ((-10.0, -10.0), (0.0, 0.0), (10.0, 10.0))
    """
    count = _checked("diagonal_centres", count, inputs, low, high)
    return _rows(np.tile(np.linspace(low, high, count)[:, None], (1, inputs)))


@as_annotated
def grid_centres(counts: Sequence[int], low: float = -10, high: float = 10) -> Matrix:
    """Return a full grid on [low, high]^n with ``counts[i]`` points along axis i.

    The last axis varies fastest.

    Parameters
    ----------
    counts : sequence of int
        Points along each axis.
    low, high : float, optional
        Ends of each axis, in the inputs' units.

    Returns
    -------
    tuple of tuple of float
        A row for each point.

    Raises
    ------
    ParameterError
        If a count is not an integer >= 1, or an end is not finite.

    Examples
    --------
    >>> grid_centres([2, 1], low=0, high=1)
    ((0.0, 0.0), (1.0, 0.0))
    """
    for i, count in enumerate(tuple_of("grid_centres", "counts", counts, int)):
        _checked("grid_centres", count, i + 1, low, high)
    axes = [np.linspace(low, high, count) for count in counts]
    return _rows(np.array(list(itertools.product(*axes))))


@as_annotated
def latin_hypercube_centres(
    count: int, inputs: int, low: float = -10, high: float = 10, *, seed: int
) -> Matrix:
    """Return `count` centres of a Latin hypercube on [low, high]^inputs (scipy.stats.qmc).

    Parameters
    ----------
    count : int
        Number of centres.
    inputs : int
        Number of the network's inputs.
    low, high : float, optional
        Ends of each axis, in the inputs' units.
    seed : int
        Of the random numbers.

    Returns
    -------
    tuple of tuple of float
        `count` rows of `inputs` numbers.

    Raises
    ------
    ParameterError
        As `diagonal_centres`, and if the seed is not an integer >= 0.

    Examples
    --------
    >>> sorted(int(x // 5) for (x,) in latin_hypercube_centres(4, 1, seed=1))
    [-2, -1, 0, 1]
    """
    count = _checked("latin_hypercube_centres", count, inputs, low, high)
    integer("latin_hypercube_centres", "seed", seed, at_least=0)
    from scipy.stats import qmc

    unit = qmc.LatinHypercube(inputs, rng=seed).random(count)
    return _rows(low + (high - low) * unit)


def regressor_names(nodes: int) -> tuple[str, ...]:
    """Return ("psi[0]", ..., "psi[l-1]")."""
    return tuple(f"psi[{i}]" for i in range(nodes))


@record
class GaussianBasis:
    """Gaussian basis functions of the state (10), Example 1.

        psi_i(x) = exp(-|x - mu_i|^2 / nu_i^2),   i = 1, ..., l

    The number of columns of `centres` is the number of inputs x1, ..., xn.

    Examples
    --------
    >>> record = nlctl.controllers.GaussianBasis(centres=((0.0,), (2.0,)), widths=(2.0,))
    >>> basis = nlctl.block(record, "basis")
    >>> print(basis.output(0, [], [0.0]).round(6), round(np.exp(-1), 6))
    [1.       0.367879] 0.367879
    """

    centres: Matrix = param(
        diagonal_centres(27, 2), unit="1", meaning="centres mu_i, one per row", symbol="mu"
    )
    widths: Floats = param(
        (2.0,), unit="1", meaning="widths nu_i: one for all, or one each", above=0, symbol="nu"
    )

    vector = True

    def check(self) -> None:
        """One width, or one per centre."""
        if len(self.widths) not in (1, len(self.centres)):
            raise ParameterError(
                "GaussianBasis needs one width or one for each of its "
                f"{counted(len(self.centres), 'centre')}, got {len(self.widths)}"
            )

    inputs = property(lambda self: coordinate_names(len(self.centres[0])))
    outputs = property(lambda self: regressor_names(len(self.centres)))

    @equation
    def output(t, x, u, p):
        """The basis at the state u = x."""
        return gaussian(u, p.centres, p.widths)


def weight_names(nodes: int) -> tuple[str, ...]:
    """Return ("W_hat[0]", ..., "W_hat[l-1]")."""
    return tuple(f"W_hat[{i}]" for i in range(nodes))


def weight_inputs(nodes: int) -> tuple[str, ...]:
    """Return ("r", "psi[0]", ..., "psi[l-1]")."""
    return ("r", *regressor_names(nodes))


@equation
def network_output(t, x, u, p):
    """The network's output W_hat^T psi, and the norm of the weights."""
    psi, W_hat = u[1:], x
    return np.sum(W_hat * psi), np.sqrt(np.sum(W_hat * W_hat))


@record
class NetworkWeights:
    """What all weights of a network share; each has its own adaptation law W_hat'."""

    nodes: int = 27
    Gamma: float = param(0.5, unit="1", meaning="adaptation gain, Gamma I", above=0)

    outputs = ("W_psi", "W_norm")
    vector = True
    output = network_output

    def check(self) -> None:
        """A network has nodes."""
        set_integer(self, "nodes", at_least=1)

    inputs = property(lambda self: weight_inputs(self.nodes))
    states = property(lambda self: weight_names(self.nodes))


@record
class AdaptiveWeights(NetworkWeights):
    """Weights of the network with sigma-modification (25), and its output.

        W_hat' = Gamma (r psi - sigma_1 W_hat),   W_psi = W_hat^T psi,   W_hat(0) = 0

    Examples
    --------
    Two weights at 0 learn r psi, by Gamma = 0.5; the outputs are W_hat^T psi and |W_hat|:

    >>> weights = nlctl.block(nlctl.controllers.AdaptiveWeights(nodes=2), "weights")
    >>> print(weights.dynamics(0, [0.0, 0.0], [2.0, 1.0, 0.25]))
    [1.   0.25]
    >>> print(weights.output(0, [3.0, 4.0], [2.0, 1.0, 0.25]))
    [4. 5.]
    """

    sigma_1: float = param(0.5, unit="1", meaning="sigma-modification of W_hat", at_least=0)

    @equation
    def update(t, x, u, p):
        """Adaptation law, first line of (25)."""
        r, psi, W_hat = u[0], u[1:], x
        return p.Gamma * (r * psi - p.sigma_1 * W_hat)


def fitting_network(
    who: str, basis: Any, weights: Any, default: Callable[..., Any]
) -> tuple[ct.InputOutputSystem, Any]:
    """Return a regressor as a block, and its weights."""
    regressor = as_system(basis, "basis")
    nodes = sum(label.startswith("psi[") for label in regressor.output_labels)
    weights = default(nodes=nodes) if weights is None else weights
    if getattr(weights, "nodes", nodes) != nodes:
        raise ParameterError(
            f"{who} needs a weight for each output psi of its basis, got nodes={weights.nodes} "
            f"for {nodes}"
        )
    return regressor, weights

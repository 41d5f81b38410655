"""Adaptive weights that stay bounded: e-modification and projection.

Sigma-modification is `nlctl.controllers.AdaptiveWeights`, (25); with ``sigma_1=0`` it is the
gradient law.
"""

import numpy as np

from ...equations import equation
from ...params import param, record
from ..rbf import NetworkWeights


@record
class EModifiedWeights(NetworkWeights):
    """Weights with e-modification: they are forgotten only while there is an error.

        W_hat' = Gamma (r psi - sigma |r| W_hat),   W_psi = W_hat^T psi,   W_hat(0) = 0

    (Narendra, Annaswamy, IEEE Transactions on Automatic Control 32, 1987, p. 134.)  Where r = 0
    the weights stand still; sigma-modification, `AdaptiveWeights`, forgets them.  Within
    |W_hat| <= max |psi| / sigma they stay, whatever r is.

    Examples
    --------
    Without an error it forgets nothing:

    >>> record = nlctl.controllers.EModifiedWeights(nodes=2, Gamma=1.0, sigma=0.5)
    >>> weights = nlctl.block(record, "weights")
    >>> print(weights.dynamics(0, [3.0, 4.0], [0.0, 1.0, 1.0]))
    [0. 0.]
    >>> print(weights.dynamics(0, [3.0, 4.0], [-2.0, 1.0, 1.0]))  # r psi - sigma |r| W_hat
    [-5. -6.]
    """

    sigma: float = param(0.5, unit="1", meaning="e-modification of W_hat", at_least=0)

    @equation
    def update(t, x, u, p):
        r, psi, W_hat = u[0], u[1:], x
        return p.Gamma * (r * psi - p.sigma * np.absolute(r) * W_hat)

    @equation
    def switching(t, x, u, p):
        """The break point of |r|."""
        return (u[0],)


@equation
def boundary_function(W_hat, p):
    """Convex function f(W_hat): 0 at |W_hat|^2 = W_max^2 / (1 + width), 1 at |W_hat| = W_max."""
    bound = p.W_max * p.W_max
    return ((1 + p.width) * np.sum(W_hat * W_hat) - bound) / (p.width * bound)


@record
class ProjectedWeights(NetworkWeights):
    """Weights with smooth projection: they stay in the ball |W_hat| <= W_max.

        W_hat' = Gamma Proj(W_hat, r psi),   W_psi = W_hat^T psi,   W_hat(0) = 0
        Proj(W, y) = y - f W (W^T y) / |W|^2   f > 0 and W^T y > 0
                     y                         otherwise
        f = ((1 + width) |W|^2 - W_max^2) / (width W_max^2)

    (Pomet, Praly, IEEE Transactions on Automatic Control 37, 1992, p. 729; f as in Lavretsky,
    Wise, Robust and Adaptive Control, 2013, section 11.4.)  The ball is invariant, whatever r and
    psi are, and for W* with f(W*) <= 0 projection never makes V' larger:
    (W_hat - W*)^T (Proj(W_hat, y) - y) <= 0.

    Examples
    --------
    On the boundary of the ball nothing points outwards any more:

    >>> record = nlctl.controllers.ProjectedWeights(nodes=2, Gamma=1.0, W_max=5.0)
    >>> weights = nlctl.block(record, "weights")
    >>> rate = weights.dynamics(0, [3.0, 4.0], [2.0, 3.0, 4.0])
    >>> print(abs(round(float(rate @ [3.0, 4.0]), 9)))
    0.0
    """

    W_max: float = param(4.0, unit="1", meaning="radius of the ball", above=0)
    width: float = param(0.1, unit="1", meaning="width of the layer, of W_max^2", above=0)

    @equation
    def update(t, x, u, p):
        """Adaptation law; where f > 0, |W|^2 is at least W_max^2 / (1 + width)."""
        y, W_hat = u[0] * u[1:], x
        outwards = np.maximum(np.sum(W_hat * y), 0.0)
        inner = p.W_max * p.W_max / (1 + p.width)
        size = np.maximum(np.sum(W_hat * W_hat), inner)
        f = np.maximum(boundary_function(W_hat, p), 0.0)
        return p.Gamma * (y - f * outwards / size * W_hat)

    @equation
    def switching(t, x, u, p):
        """The inner boundary of the layer, and where y = r psi turns outwards in it."""
        return boundary_function(x, p), np.sum(x * u[0] * u[1:])

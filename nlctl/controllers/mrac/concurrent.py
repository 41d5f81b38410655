"""Concurrent learning: weights that learn from recorded points too, and their record."""

import numpy as np

from ...equations import equation
from ...params import param, record, set_integer
from ..rbf import NetworkWeights, network_output, regressor_names, weight_inputs


def sum_names(nodes: int) -> tuple[str, ...]:
    """Return ("z[0]", ..., "Omega[0,0]", "Omega[0,1]", ...)."""
    rows = range(nodes)
    matrix = [f"Omega[{i},{j}]" for i in rows for j in rows]
    return (*(f"z[{i}]" for i in rows), *matrix)


@equation
def sums_of_point(psi, Delta):
    """What a point adds: psi Delta, and psi psi^T by rows."""
    added = psi * Delta
    for i in range(psi.size):
        added = np.append(added, psi[i] * psi)
    return added


@record
class HistoryStack:
    """Record of points (psi_j, Delta_j) for concurrent learning, a program in discrete time.

        Omega = sum_j psi_j psi_j^T,   z = sum_j psi_j Delta_j,   Delta_j = x_n' - gain u

    A sample is recorded if |psi - psi_last| >= novelty |psi|, psi_last the last recorded one,
    until there are `points` of them (Chowdhary, Johnson, 49th IEEE CDC, 2010, p. 3674).  The law
    reads only the sums, which are the states, from the next sample on.  Points are never replaced;
    the algorithm that maximizes the least singular value (Chowdhary, Johnson, ACC 2011) does that.
    It needs a measurement or an estimate of x_n' besides the states.  Use it as
    ``nlctl.sampled(HistoryStack(...), dt)``.

    Examples
    --------
    A point psi = 2 with Delta = x2' - gain u = 7 - 1 is recorded: count, z, Omega.

    >>> stack = nlctl.block(nlctl.controllers.HistoryStack(nodes=1), "stack", dt=0.1)
    >>> recorded = stack.dynamics(0, [0.0, 0.0, 0.0, 0.0], [2.0, 7.0, 1.0])
    >>> print(stack.output(0, recorded, [2.0, 7.0, 1.0]))
    [ 1. 12.  4.]
    """

    nodes: int = 6  # Number of regressors.
    points: int = 100  # Largest number of points.
    derivative: str = "x2_dot"  # Name of the signal x_n'.
    gain: float = param(1.0, unit="1", meaning="input gain of the plant")
    novelty: float = param(0.05, unit="1", meaning="least relative change of psi", at_least=0)

    discrete = True
    feedthrough = False
    vector = True

    def check(self) -> None:
        """A network has nodes, and a record room."""
        for name in ("nodes", "points"):
            set_integer(self, name, at_least=1)

    def derived(self) -> dict[str, int]:
        """The number of points, for the equation."""
        return {"points": self.points}

    inputs = property(lambda self: (*regressor_names(self.nodes), self.derivative, "u"))
    outputs = property(lambda self: ("count", *sum_names(self.nodes)))
    states = property(lambda self: (*self.outputs, *(f"last[{i}]" for i in range(self.nodes))))

    @equation
    def update(t, x, u, p):
        """Record the point, or leave all as it is."""
        psi, Delta, count = u[:-2], u[-2] - p.gain * u[-1], x[0]
        last = x[-psi.size :]
        distance, size = np.sum((psi - last) ** 2), np.sum(psi * psi)
        taken = distance >= p.novelty * p.novelty * size and count < p.points
        change = np.append(np.append(np.ones(1), sums_of_point(psi, Delta)), psi - last)
        return x + ((1.0 if taken else 0.0) + 0.0 * (distance + size + count)) * change  # NaN stays

    @equation
    def output(t, x, u, p):
        """How many points, and the sums over them."""
        return x[: x.size - (u.size - 2)].copy()


@record
class ConcurrentWeights(NetworkWeights):
    """Weights with concurrent learning: they converge without persistent excitation.

        W_hat' = Gamma (r psi + z - Omega W_hat),   W_psi = W_hat^T psi,   W_hat(0) = 0

    (Chowdhary, Johnson, 49th IEEE CDC, 2010, p. 3674), z and Omega those of `HistoryStack`: the
    second term is sum_j psi_j (Delta_j - W_hat^T psi_j).  As soon as as many independent points are
    recorded as there are weights, Omega is positive definite, and the error of the weights decays
    at a rate of at least Gamma times its least eigenvalue.

    Examples
    --------
    One regressor, recorded once with psi = 2 and Delta = 6: W_hat = 3 is what was measured.

    >>> weights = nlctl.block(nlctl.controllers.ConcurrentWeights(nodes=1, Gamma=1.0), "weights")
    >>> r, psi, z, Omega = 0.0, 0.5, 12.0, 4.0
    >>> [float(weights.dynamics(0, [W_hat], [r, psi, z, Omega])[0]) for W_hat in (0.0, 3.0)]
    [12.0, 0.0]
    """

    nodes: int = 6
    Gamma: float = param(5.0, unit="1", meaning="adaptation gain, Gamma I", above=0)

    inputs = property(lambda self: (*weight_inputs(self.nodes), *sum_names(self.nodes)))

    @equation
    def update(t, x, u, p):
        """Adaptation law, row by row of Omega."""
        n, W_hat = x.size, x
        learned = u[0] * u[1 : n + 1] + u[n + 1 : 2 * n + 1]
        for j in range(n):  # Omega is symmetric: its columns are its rows
            learned = learned - u[(2 + j) * n + 1 : (3 + j) * n + 1] * W_hat[j]
        return p.Gamma * learned

    @equation
    def output(t, x, u, p):
        """As `AdaptiveWeights`."""
        return network_output(t, x, u[: x.size + 1], p)

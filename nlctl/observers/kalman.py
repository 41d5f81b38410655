"""Extended Kalman filter in continuous time."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ..arguments import a_function
from ..equations import equation
from ..errors import ParameterError
from ..expressions.graph import Untraceable
from ..expressions.jacobian_source import jacobian_function
from ..params import Matrix, as_numbers, nested_tuple, param, record
from .signals import estimate_names, set_names

_SIZES = ("states", "known inputs")
_MOST = 8  # states


@equation
def double_integrator(x, u):
    """The default plant, x1' = x2, x2' = u."""
    return x[1], u[0]


@equation
def first_state(x):
    """The default output, y = x1."""
    return (x[0],)


@record
class ExtendedKalmanFilter:
    """Extended Kalman filter of x' = f(x, u) + w, y = h(x) + v, in continuous time.

        x_hat' = f(x_hat, u) + K (y - h(x_hat)),   K = P H^T R^-1
        P'     = F P + P F^T + Q - P H^T R^-1 H P
        F = df/dx (x_hat, u),   H = dh/dx (x_hat)

    with Q and R the intensities of white noise w and v.  F and H are exact derivatives, derived
    once from the expressions that f and h compute; where these ask whether numbers are equal that
    are, the derivatives are those right next to there.  Of a linear plant it is the Kalman-Bucy
    filter, and P tends to what `control.lqe` finds.  In discrete time it is
    ``nlctl.sampled(nlctl.discretise(nlctl.block(filter, name), dt))``.

    Parameters
    ----------
    f : equation, optional
        ``f(x, u) -> (x1', ..., xn')``; a double integrator by default.
    h : equation, optional
        ``h(x) -> (y1, ..., yk)``; x1 by default.

    Examples
    --------
    The angle of a pendulum is measured:

    >>> @nlctl.equation
    ... def pendulum(x, u):
    ...     return x[1], -np.sin(x[0]) + u[0]
    >>> record = nlctl.observers.ExtendedKalmanFilter(f=pendulum, Q=0.1 * np.eye(2), R=((0.5,),))
    >>> block = nlctl.block(record, "filter")
    >>> print(block.state_labels)
    ['x1_hat', 'x2_hat', 'P11', 'P12', 'P22']
    >>> print(block.dynamics(0, [0.0, 0.0, 1.0, 0.0, 1.0], [0.0, 1.0]))
    [ 2.   0.  -1.9  0.   0.1]
    """

    known: tuple[str, ...] = ("u",)  # Names of the inputs u and of the outputs y.
    measured: tuple[str, ...] = ("y",)
    f: Callable[[Any, Any], Any] = double_integrator
    h: Callable[[Any], Any] = first_state
    x0: Sequence[float] = ()  # Initial estimate; 0 by default.
    # Initial covariance of the error; by default the unit matrix.
    P0: Sequence[Sequence[float]] = ()
    Q: Matrix = param(((0.1, 0.0), (0.0, 0.1)), unit="1/s", meaning="intensity of the noise in x'")
    R: Matrix = param(((0.1,),), unit="s", meaning="intensity of the noise in y")

    feedthrough = False
    vector = True

    def check(self) -> None:
        """Covariances that are some, names that fit, functions that can be differentiated."""
        who, n = "ExtendedKalmanFilter", len(self.Q)
        if n > _MOST:
            raise ParameterError(f"{who} needs at most {_MOST} states, got {n}")
        a_function(who, "f", self.f)
        a_function(who, "h", self.h)
        set_names(self, "known", None, at_least=0)
        set_names(self, "measured", len(self.R))
        object.__setattr__(self, "x0", _numbers("x0", self.x0, np.zeros(n)))
        object.__setattr__(self, "P0", _numbers("P0", self.P0, np.eye(n)))
        _check_covariance("Q", self.Q)
        _check_covariance("R", self.R, definite=True)
        _check_covariance("P0", self.P0)
        x = np.array(self.x0, dtype=float)
        values = {"f": _called("f", self.f, x, np.zeros(len(self.known))),
                  "h": _called("h", self.h, x)}  # fmt: skip
        for name, count in (("f", n), ("h", len(self.R))):
            if np.size(values[name]) != count:
                raise ParameterError(
                    f"{who} needs {name} to return {count} of them, as {'QR'[name == 'h']} has "
                    f"rows, got {np.size(values[name])}"
                )
        self.jacobians  # noqa: B018 (it is refused here if there are none)

    inputs = property(lambda self: (*self.known, *self.measured))
    outputs = property(lambda self: estimate_names(len(self.Q)))
    states = property(lambda self: (*self.outputs, *(f"P{i + 1}{j + 1}" for i, j in self.places)))

    @property
    def places(self) -> list[tuple[int, int]]:
        """Rows and columns of the upper triangle."""
        return [(i, j) for i in range(len(self.Q)) for j in range(i, len(self.Q))]

    @property
    def initial(self) -> dict[str, float]:
        """The initial estimate and its covariance."""
        values = [*self.x0, *(self.P0[i][j] for i, j in self.places)]
        return dict(zip(self.states, map(float, values), strict=True))

    def derived(self) -> dict[str, Any]:
        """The inverse of R."""
        return {"R_inverse": np.linalg.inv(np.array(self.R))}

    @cached_property
    def jacobians(self) -> tuple[Callable, Callable]:
        """df/dx as a function of x and u, and dh/dx as one of x."""
        n, m = len(self.Q), len(self.known)
        try:
            return jacobian_function(self.f, n, m), jacobian_function(self.h, n)
        except Untraceable as error:
            raise ParameterError(
                "ExtendedKalmanFilter needs functions f and h whose expressions can be read, for "
                f"their derivatives: {error}"
            ) from None

    @cached_property
    def update(self) -> Callable:
        """The filter's equation and Riccati's, along the estimate."""
        f, h, (df, dh) = equation(self.f), equation(self.h), self.jacobians
        n, m, places = len(self.Q), len(self.known), tuple(self.places)
        where = [[n + places.index((min(i, j), max(i, j))) for j in range(n)] for i in range(n)]

        @equation
        def update(t, x, u, p):
            estimate, known = x[:n], u[:m]
            P = np.array([[x[k] for k in row] for row in where])
            F, H = df(estimate, known), dh(estimate)
            PH = P @ H.T
            FP = F @ P
            K = PH @ p.R_inverse
            rates = np.array(f(estimate, known)) + K @ (u[m:] - np.array(h(estimate)))
            dP = FP + FP.T + p.Q - K @ PH.T
            return np.append(rates, np.array([dP[i, j] for i, j in places]))

        return update

    @cached_property
    def output(self) -> Callable:
        """The estimates."""
        n = len(self.Q)

        @equation
        def output(t, x, u, p):
            return x[:n].copy()

        return output


def _called(name: str, function: Callable, *args: np.ndarray) -> np.ndarray:
    """Return the values of a function at the initial estimate, with known inputs of 0."""
    try:
        return np.asarray(function(*args), dtype=float)
    except Exception as error:  # whatever a user's function raises
        sizes = " and ".join(f"{arg.size} {kind}" for arg, kind in zip(args, _SIZES, strict=False))
        raise ParameterError(
            f"ExtendedKalmanFilter calls {name} at its initial estimate, with {sizes}, which ends "
            f"in {type(error).__name__}: {error}"
        ) from error


def _numbers(name: str, given: object, otherwise: np.ndarray) -> Any:
    """Return finite numbers of a shape as tuples, those of `otherwise` if there are none."""
    matrix = as_numbers(given)
    if matrix is not None and not matrix.size:
        matrix = otherwise
    if matrix is None or matrix.shape != otherwise.shape or not np.all(np.isfinite(matrix)):
        shape = " x ".join(map(str, otherwise.shape))
        raise ParameterError(
            f"ExtendedKalmanFilter needs finite numbers of shape {shape} for {name}, got {given!r}"
        )
    return nested_tuple(matrix.tolist())


def _check_covariance(name: str, rows: object, *, definite: bool = False) -> None:
    """Refuse a matrix that is not symmetric, or not positive."""
    matrix = np.array(rows, dtype=float)
    square = matrix.shape[0] == matrix.shape[1]
    least = np.linalg.eigvalsh(matrix).min() if square and np.all(matrix == matrix.T) else np.nan
    rule = "definite" if definite else "semidefinite"
    slack = 0.0 if definite else -1e-12 * np.abs(matrix).max()
    if not (least > 0.0 if definite else least >= slack):
        raise ParameterError(
            f"ExtendedKalmanFilter needs {name} symmetric and positive {rule}, got {rows}"
        )

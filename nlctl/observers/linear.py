"""Luenberger's observer of a linear plant."""

from typing import Any

import control as ct
import numpy as np

from ..arguments import of_type
from ..equations import equation
from ..errors import ParameterError
from ..params import Matrix, param, record
from ..wording import counted
from .signals import estimate_names, set_names

_NEAR = 1e-6  # of the largest pole: how far those that were placed may lie from those wanted


@record
class LuenbergerObserver:
    """Luenberger observer of a linear plant x' = A x + B u, y = C x + D u.

        x_hat' = A x_hat + B u + L (y - C x_hat - D u)

    The error x - x_hat obeys (x - x_hat)' = (A - L C)(x - x_hat), whatever u is.  `luenberger`
    makes one of a plant and poles.  With the gain of `control.lqe` it is the steady Kalman filter.

    Examples
    --------
    A double integrator, with both poles of the error at -1:

    >>> observer = nlctl.block(nlctl.observers.LuenbergerObserver(L=((2.0,), (1.0,))), "observer")
    >>> print(observer.dynamics(0, [0.0, 0.0], [0.0, 1.0]))  # x_hat = 0 while y = 1
    [2. 1.]
    """

    # Names of the plant's inputs and outputs, in the order of the columns of B and the rows of C;
    # () for a plant without inputs, whose B and D have no columns.
    known: tuple[str, ...] = ("u",)
    measured: tuple[str, ...] = ("y",)
    A: Matrix = param(((0.0, 1.0), (0.0, 0.0)), unit="1/s", meaning="matrix A of the plant")
    B: Matrix = param(
        ((0.0,), (1.0,)), unit="1/s", meaning="matrix B of the plant", may_be_empty=True
    )
    C: Matrix = param(((1.0, 0.0),), unit="1", meaning="matrix C of the plant")
    D: Matrix = param(((0.0,),), unit="1", meaning="matrix D of the plant", may_be_empty=True)
    L: Matrix = param(((3.0,), (2.0,)), unit="1/s", meaning="gain of the observer")

    feedthrough = False
    vector = True

    def check(self) -> None:
        """Matrices that fit each other, and a name for each signal."""
        shapes = {key: np.shape(getattr(self, key)) for key in "ABCDL"}
        n, m, k = shapes["A"][0], shapes["B"][1], shapes["C"][0]
        needed = {"A": (n, n), "B": (n, m), "C": (k, n), "D": (k, m), "L": (n, k)}
        for key, shape in shapes.items():
            if shape != needed[key]:
                rows, columns = needed[key]
                raise ParameterError(
                    f"LuenbergerObserver needs {key} of shape {rows} x {columns} for "
                    f"{counted(n, 'state')}, {counted(m, 'input')} and {counted(k, 'output')}, got "
                    f"{shape[0]} x {shape[1]}"
                )
        set_names(self, "known", m, at_least=0)
        set_names(self, "measured", k)

    inputs = property(lambda self: (*self.known, *self.measured))
    states = property(lambda self: estimate_names(len(self.A)))
    outputs = states

    @equation
    def update(t, x, u, p):
        """The plant's equation, corrected by what its output is off."""
        m = p.B.shape[1]
        known, y = u[:m], u[m:]
        return p.A @ x + p.B @ known + p.L @ (y - p.C @ x - p.D @ known)

    @equation
    def output(t, x, u, p):
        return x.copy()


def luenberger(plant: ct.StateSpace, poles: object = None, *, L: Any = None) -> LuenbergerObserver:
    """Make a Luenberger observer of a linear plant, by its poles or its gain.

    Parameters
    ----------
    plant : control.StateSpace
        In continuous time; the observer takes its signals by their names.
    poles : array_like of shape (n,), optional
        Eigenvalues of A - L C (1/s), complex ones with their conjugates.
    L : array_like of shape (n, k), optional
        The gain instead of poles, from `control.lqe` for example.

    Returns
    -------
    LuenbergerObserver
        Its gain is that of `control.place`, or of `control.acker` where poles are equal.

    Raises
    ------
    ParameterError
        If the plant is not one in continuous time with a state and an output, there are not as
        many poles as states, both or neither of `poles` and `L` are given, or the plant is not
        observable.

    Examples
    --------
    >>> plant = ct.ss([[0, 1], [-1, 0]], [[0], [1]], [[1, 0]], 0, inputs="v", outputs="y")
    >>> observer = nlctl.observers.luenberger(plant, poles=[-2, -3])
    >>> print(observer.inputs, np.round(observer.L, 9).ravel())
    ('v', 'y') [5. 5.]
    """
    of_type("luenberger", "plant", plant, ct.StateSpace)
    if not plant.isctime() or not plant.noutputs or not plant.nstates:
        raise ParameterError(
            f"luenberger needs a plant in continuous time with a state and an output, got "
            f"'{plant.name}' with dt = {plant.dt}, {plant.nstates} and {plant.noutputs} of them"
        )
    if (poles is None) == (L is None):
        raise ParameterError("luenberger needs either poles or L, got both or neither")
    n, m, k = plant.nstates, plant.ninputs, plant.noutputs
    shapes = {"A": (n, n), "B": (n, m), "C": (k, n), "D": (k, m)}  # 0 x 0 where there is no input
    matrices: dict[str, Any] = {
        key: np.reshape(getattr(plant, key), shape) for key, shape in shapes.items()
    }
    matrices["L"] = (
        _placed(plant, poles) if L is None else np.reshape(L, (plant.nstates, plant.noutputs))
    )
    return LuenbergerObserver(
        known=tuple(plant.input_labels), measured=tuple(plant.output_labels),
        **matrices,
    )  # fmt: skip


def _placed(plant: ct.StateSpace, poles: Any) -> np.ndarray:
    """Return the gain that gives the error these poles."""
    desired = np.sort_complex(np.atleast_1d(poles))
    if desired.size != plant.nstates:
        raise ParameterError(
            f"luenberger needs {counted(plant.nstates, 'pole')} for '{plant.name}', got "
            f"{desired.size}"
        )
    A, C = np.asarray(plant.A), np.asarray(plant.C)
    equal = np.unique(desired).size < desired.size and plant.noutputs == 1
    try:
        dual = (ct.acker if equal else ct.place)(A.T, C.T, desired)
        gain = np.reshape(dual, (plant.noutputs, plant.nstates)).T
        placed = np.sort_complex(np.linalg.eigvals(A - gain @ C))
        off = np.max(np.abs(np.poly(placed) - np.poly(desired)))
    except (ValueError, np.linalg.LinAlgError) as error:
        raise ParameterError(
            f"luenberger cannot place {poles} for '{plant.name}': {error}"
        ) from None
    if not off <= _NEAR * np.max(np.abs(np.poly(desired))):
        raise ParameterError(
            f"luenberger needs an observable plant, got '{plant.name}': with the gain that was "
            f"found the error has the poles {np.round(placed, 6)}, not {desired}"
        )
    return gain

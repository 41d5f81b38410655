"""Where a diagram stays: equilibria and other operating points, by exact derivatives."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import control as ct
import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import OptimizeResult, least_squares, root

from ..annotations import as_annotated
from ..arguments import number
from ..attributes import with_parameters_of
from ..diagrams import state_names
from ..errors import OperatingPointError, ParameterError
from ..names import find_name
from ..responses.arguments import checked_params, state_array, with_aliases
from ..upstream.systems import System
from ..wording import counted
from .compiled import Compiled, as_compiled
from .cut_delays import CutDiagram
from .happened import row_labels
from .jacobians import point_numbers

_WHO = "find_operating_point"
_FOUND = 1e-8  # residual, relative to what it is made of
_AT_KINK = 1e-9
_RANK = 1e-9  # of the largest singular value: less is none
_NEWTON = 8  # steps that sharpen what was found
_SAME = 1e-6
_ALIASES = {
    "x0": "initial_state", "X0": "initial_state", "u0": "inputs", "y0": "outputs",
    "dx0": "derivs", "iu": "input_indices", "iy": "output_indices", "ix": "state_indices",
    "idx": "deriv_indices", "return_y": "return_outputs",
}  # fmt: skip


class OperatingPoint(ct.OperatingPoint):
    """An operating point that was found, and what kind of point it is.

    It is python-control's: it unpacks as states and inputs, and ``ct.linearize`` and
    `nlctl.linearize` take it.

    Attributes
    ----------
    states, inputs, outputs : ndarray
        At the point.
    residual : float
        Largest violation of what was asked, in the units of rates and outputs.
    rank, unknowns : int
        Rank of the derivatives of what was asked, and number of what was free.  With a lower rank
        the point is one of many nearby, or a double one, and no isolated solution.
    kinks : tuple of str
        Where the equations have a kink or a jump at the point: block and which.  Derivatives are
        those of one side there.

    Examples
    --------
    >>> tank = nlctl.block(nlctl.Lag(T=2.0), "tank")
    >>> point = nlctl.find_operating_point(tank, inputs=3.0)
    >>> print(point.states.round(9), point.isolated, point.kinks)
    [3.] True ()
    """

    def __init__(self, signals: Sequence[np.ndarray], kind: Mapping[str, Any], shown: bool) -> None:
        states, inputs, outputs = signals
        super().__init__(states, inputs, outputs, kind["result"], return_outputs=shown)
        self.residual: float = kind["residual"]
        self.rank: int = kind["rank"]
        self.unknowns: int = kind["unknowns"]
        self.kinks: tuple[str, ...] = kind["kinks"]

    @property
    def isolated(self) -> bool:
        """Whether there is no other such point nearby, by the derivatives."""
        return self.rank == self.unknowns

    def __repr__(self) -> str:
        lines = [f"Operating point: states {self.states}, inputs {self.inputs}"]
        lines.append(f"  outputs {self.outputs}, residual {self.residual:.1e}")
        if not self.isolated:
            lines.append(
                f"  not isolated: rank {self.rank} for {counted(self.unknowns, 'unknown')}"
            )
        if self.kinks:
            lines.append(f"  at a kink of {', '.join(self.kinks)}")
        return "\n".join(lines)


class _Asked(NamedTuple):
    """What is free and what is fixed."""

    x: np.ndarray  # fixed values, and guesses of the others
    u: np.ndarray
    y: np.ndarray
    dx: np.ndarray
    states: np.ndarray  # places of those that are free
    inputs: np.ndarray
    rates: np.ndarray  # places of those that are asked for
    outputs: np.ndarray


@as_annotated
def find_operating_point(
    system: System | Compiled,
    initial_state: Mapping[str, float] | Any = 0.0,
    inputs: ArrayLike | None = None,
    outputs: ArrayLike | None = None,
    t: float = 0.0,
    params: Mapping[str, Any] | None = None,
    *,
    input_indices: Iterable[Any] | None = None,
    output_indices: Iterable[Any] | None = None,
    state_indices: Iterable[Any] | None = None,
    deriv_indices: Iterable[Any] | None = None,
    derivs: ArrayLike | None = None,
    root_method: str | None = None,
    return_outputs: bool = False,
    **aliases: object,
) -> OperatingPoint:
    """Find an equilibrium or another operating point, as ``ct.find_operating_point`` does.

    With the compiled equations and their exact derivatives.  With `inputs` alone these are fixed
    and the states are sought; with `outputs` too these are fixed, and states and inputs sought.

    Parameters
    ----------
    system : control.InputOutputSystem or Compiled
        A diagram, or what `compile` made of it.
    initial_state : mapping, array_like or float, optional
        Where the search begins; also ``x0``.
    inputs : array_like, optional
        Inputs: fixed, or where their search begins if `outputs` or indices are given; also ``u0``.
    outputs : array_like, optional
        Outputs that are wanted; also ``y0``.
    t : float, optional
        Time (s).
    params : mapping, optional
        Qualified parameters.
    input_indices, output_indices, state_indices : iterable of int or str, optional
        What is fixed, by places or names; all else is free.  Without `output_indices` all outputs
        are fixed.  Also ``iu``, ``iy`` and ``ix``.
    deriv_indices : iterable of int or str, optional
        The states whose rates are fixed; all of them by default.  Also ``idx``.
    derivs : array_like, optional
        Rates that are wanted instead of 0; also ``dx0``.
    root_method : str, optional
        Method of `scipy.optimize.root` where there are as many unknowns as equations, "hybr" by
        default; otherwise least squares are taken.
    return_outputs : bool, optional
        Whether the point unpacks as states, inputs and outputs.
    **aliases : object
        python-control's short names.

    Returns
    -------
    OperatingPoint
        It says whether it is isolated, and at which kinks it lies.

    Raises
    ------
    OperatingPointError
        If none is found from there.
    CompileError, AlgebraicLoopError
        If the diagram cannot be compiled.
    ParameterError, UnknownNameError, UnknownKeywordError
        If an argument is refused.
    UsageError
        If there are sampled blocks: their states have no rates.

    Notes
    -----
    What leaves a `nlctl.TransportDelay` is what it is given, where all is constant.  The memory of
    a play or a relay stays where it is: such a point is not isolated, or lies at a kink.

    Examples
    --------
    >>> pendulum = ct.nlsys(lambda t, x, u, params: [x[1], u[0] - 9.81 * np.sin(x[0])],
    ...                     inputs=["torque"], states=["angle", "rate"], name="pendulum")
    >>> point = nlctl.find_operating_point(pendulum, [1.0, 0.0], 0.0, [0.5, 0.0],
    ...                                    output_indices=["angle"], state_indices=[])
    >>> point.inputs.round(6)  # 9.81 sin(0.5)
    array([4.703165])
    """
    named = {
        "initial_state": initial_state, "inputs": inputs, "outputs": outputs, "derivs": derivs,
        "input_indices": input_indices, "output_indices": output_indices,
        "state_indices": state_indices, "deriv_indices": deriv_indices,
        "return_outputs": return_outputs,
    }  # fmt: skip
    named = with_aliases(named, aliases, find_operating_point, _ALIASES)
    checked_params(params)
    cut = CutDiagram(_WHO, as_compiled(system, params), number(_WHO, "t", t), params)
    asked = _asked(cut, named)
    point = _search(cut, asked, root_method, bool(named["return_outputs"]))
    size = np.abs(np.concatenate([point.states, point.inputs])).max(initial=0.0)
    if not point.residual <= _FOUND * (1.0 + size):
        raise OperatingPointError(
            f"no operating point of '{cut.compiled.system.name}' was found from "
            f"{np.round(asked.x, 6)}: the search ended at {np.round(point.states, 6)}, where what "
            f"was asked is missed by {point.residual:.3g}; begin elsewhere, or ask for less",
            point.states,
            point.inputs,
            point.residual,
        )
    return point


@as_annotated
@with_parameters_of(find_operating_point)
def find_operating_points(
    system: System | Compiled,
    starts: Iterable[Any],
    inputs: ArrayLike | None = None,
    outputs: ArrayLike | None = None,
    **given: Any,
) -> tuple[OperatingPoint, ...]:
    """Find the operating points that searches from several states lead to.

    Parameters
    ----------
    starts : iterable
        Where searches begin, each as `initial_state` of `find_operating_point`.
    **given : object
        Its other arguments.

    Returns
    -------
    tuple of OperatingPoint
        Those that differ, in the order in which they were found; there may be more.

    Raises
    ------
    ParameterError, UnknownNameError, UnknownKeywordError, UsageError, CompileError
        As there, but for searches that find none: these are left out.

    Examples
    --------
    >>> cubic = ct.nlsys(lambda t, x, u, params: x - x**3, inputs=0, states=1, name="cubic")
    >>> [p.states.round(6).item() for p in nlctl.find_operating_points(cubic, [[-2], [0.1], [3]])]
    [-1.0, 0.0, 1.0]
    """
    made = as_compiled(system, given.get("params"))
    found: list[OperatingPoint] = []
    for start in starts:
        try:
            point = find_operating_point(made, start, inputs, outputs, **given)
        except OperatingPointError:
            continue
        here = np.concatenate([point.states, point.inputs])
        others = [np.concatenate([each.states, each.inputs]) for each in found]
        if all(np.abs(here - o).max(initial=0.0) > _SAME * (1 + np.abs(o).max()) for o in others):
            found.append(point)
    return tuple(found)


def _asked(cut: CutDiagram, named: Mapping[str, Any]) -> _Asked:
    """Return what is free and what is fixed, as python-control has it."""
    system = cut.compiled.system
    fixed = ("input_indices", "output_indices", "state_indices", "deriv_indices")
    plain, y = all(named[name] is None for name in fixed), named["outputs"]
    all_outputs = not plain or y is not None
    names = state_names(system)
    iu = _places("input", named["input_indices"], system.input_labels, plain and y is None)
    iy = _places("output", named["output_indices"], system.output_labels, all_outputs)
    ix = _places("state", named["state_indices"], names, False)
    idx = _places("state", named["deriv_indices"], names, True)
    if iy.size and y is None:
        raise ParameterError(
            f"{_WHO} needs outputs= for the outputs that are fixed; output_indices=[] fixes none"
        )
    return _Asked(
        x=state_array(system, named["initial_state"]),
        u=cut.inputs(_WHO, "inputs", named["inputs"]),
        y=point_numbers(f"{_WHO} needs", cut.noutputs, "outputs", y),
        dx=point_numbers(f"{_WHO} needs", cut.n, "derivs", named["derivs"]),
        states=np.setdiff1d(np.arange(cut.n), ix), inputs=np.setdiff1d(np.arange(cut.m), iu),
        rates=idx, outputs=iy,
    )  # fmt: skip


def _places(kind: str, given: Any, names: Sequence[str], every: bool) -> np.ndarray:
    """Return the places of what is named or counted; all or none by default."""
    if given is None:
        return np.arange(len(names) if every else 0)
    given = [given] if isinstance(given, str | int | np.integer) else given
    found = [_place(kind, each, list(names)) for each in given]
    return np.unique(np.array(found, dtype=int))


def _place(kind: str, each: object, names: Sequence[str]) -> int:
    if isinstance(each, str):
        return list(names).index(find_name(kind, each, dict.fromkeys(names)))
    if isinstance(each, bool) or not isinstance(each, int | np.integer):
        raise ParameterError(f"{_WHO} needs places or names of each {kind}, got {each!r}")
    if not 0 <= each < len(names):
        raise ParameterError(
            f"{_WHO} got {each} for a place of the {kind}s: there are {len(names)}, from 0 on"
        )
    return int(each)


def _equations(cut: CutDiagram, asked: _Asked) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return residual and Jacobian as functions of what is free, what leaves delays included."""
    n, free = cut.n, asked.states.size
    inside = free + asked.inputs.size
    columns = np.concatenate([asked.states, n + asked.inputs, n + cut.m + np.arange(cut.lines)])
    discrete = ct.isdtime(cut.compiled.system, strict=True)

    def parts(z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        x, u = asked.x.copy(), asked.u.copy()
        x[asked.states], u[asked.inputs] = z[:free], z[free:inside]
        return x, u, z[inside:]

    def residual(z: np.ndarray) -> np.ndarray:
        x, u, w = parts(z)
        rates, y, arriving = cut.values(x, u, w)
        rates = rates - x if discrete else rates
        return np.concatenate(
            [(rates - asked.dx)[asked.rates], (y - asked.y)[asked.outputs], arriving - w]
        )

    def slope(z: np.ndarray, in_the_end: bool = False) -> np.ndarray:
        found = cut.checked(*parts(z))[0] if in_the_end else cut.derivatives(*parts(z))
        rates, arriving = found.rates.copy(), found.arriving.copy()
        rates[:, :n] -= np.eye(n) if discrete else 0.0
        arriving[:, n + cut.m :] -= np.eye(cut.lines)
        rows = [rates[asked.rates], found.outputs[asked.outputs], arriving]
        return np.concatenate(rows)[:, columns]

    residual.parts = parts  # type: ignore[attr-defined]
    return residual, slope


def _search(cut: CutDiagram, asked: _Asked, method: str | None, shown: bool) -> OperatingPoint:
    """Return where the search ends."""
    residual, slope = _equations(cut, asked)
    w = cut.leaving(asked.x, asked.u)
    z = np.concatenate([asked.x[asked.states], asked.u[asked.inputs], w])
    result = OptimizeResult(x=z, success=True, message="nothing is free")
    if z.size:
        result = _solved(residual, slope, z, method)
    z = _sharpened(residual, slope, np.asarray(result.x, dtype=float))
    x, u, w = residual.parts(z)  # type: ignore[attr-defined]
    J = slope(z, in_the_end=True) if z.size else np.zeros((0, 0))
    known = np.isfinite(J).all()
    values = np.linalg.svd(J, compute_uv=False) if known and z.size else np.zeros(0)
    kind = {
        "result": result,
        "residual": float(np.abs(residual(z)).max(initial=0.0)),
        "rank": int((values > _RANK * values.max(initial=0.0)).sum()),
        "unknowns": z.size,
        "kinks": _kinks(cut, x, u, w),
    }
    return OperatingPoint((x, u, cut.values(x, u, w)[1]), kind, shown)


def _solved(residual: Any, slope: Any, z: np.ndarray, method: str | None) -> OptimizeResult:
    """Return what SciPy finds; least squares where the numbers differ, or the root is none."""
    if not np.isfinite(residual(z)).all():
        return OptimizeResult(x=z, success=False, message="not finite where it begins")
    if residual(z).size == z.size:
        try:
            with np.errstate(all="ignore"):
                found = root(residual, z, jac=slope, method=method or "hybr", tol=1e-13)
        except ValueError as error:
            raise ParameterError(f"{_WHO} with root_method={method!r}: {error}") from None
        if np.abs(residual(found.x)).max() <= np.abs(residual(z)).max() * _FOUND:
            return found
        if method is not None:
            return found
    try:
        with np.errstate(all="ignore"):
            return least_squares(residual, z, jac=slope, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    except (ValueError, np.linalg.LinAlgError) as error:  # it came to where nothing is finite
        return OptimizeResult(x=z, success=False, message=str(error))


def _sharpened(residual: Any, slope: Any, z: np.ndarray) -> np.ndarray:
    """Return a point after Newton steps, as long as they make the residual smaller."""
    size = np.abs(residual(z)).max(initial=0.0)
    for _ in range(_NEWTON if z.size else 0):
        derivative = slope(z)
        if not np.isfinite(derivative).all() or not size > 0:
            break
        further = z - np.linalg.lstsq(derivative, residual(z), rcond=_RANK)[0]
        smaller = np.abs(residual(further)).max(initial=0.0)
        if not smaller < size:
            break
        z, size = further, smaller
    return z


def _kinks(cut: CutDiagram, x: np.ndarray, u: np.ndarray, w: np.ndarray) -> tuple[str, ...]:
    """Return what the equations switch at, at a point."""
    g = cut.conditions(x, u, w)
    labels = row_labels(cut.compiled, cut.code.lowered.conditions)
    near = np.abs(g[: len(labels)]) <= _AT_KINK * (1.0 + np.abs(np.concatenate([x, u, w])).max())
    return tuple(dict.fromkeys(" ".join(labels[i]).strip() for i in np.flatnonzero(near)))

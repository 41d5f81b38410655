"""How a run is integrated; what python-control is told of its integrator, taken or refused."""

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from ..arguments import ATOL, RTOL
from ..errors import ParameterError, UnknownNameError
from ..names import unknown
from .integrate.methods import EXPLICIT_PAIRS
from .integrate.methods.tableau import Tableau
from .integrate.methods.tsit5 import TSIT5
from .integrate.state import AUTO, EXPLICIT, IMPLICIT, TAYLOR

METHODS = {
    "auto": AUTO,
    **dict.fromkeys(EXPLICIT_PAIRS, EXPLICIT),
    "rodas5p": IMPLICIT,
    "taylor": TAYLOR,
}
_STIFF = "method='rodas5p' is its stiff method"
_EXPLICIT = "method='tsit5' is its explicit Runge-Kutta pair of orders 5(4)"
_METHODS = {  # of `scipy.integrate.solve_ivp` -> what comes nearest
    **dict.fromkeys(("RK23", "RK45", "DOP853"), _EXPLICIT),
    **dict.fromkeys(("Radau", "BDF"), _STIFF),
    "LSODA": "method='auto' changes between an explicit and a stiff method",
}
JACOBIAN = "its stiff method makes the Jacobian itself"
_REFUSED = {  # of the keywords of `solve_ivp` -> what there is instead
    "max_step": "max_step= of the run bounds its steps",
    "min_step": "step= is a fixed step, max_steps= bounds their number",
    "first_step": "it chooses its first step by the tolerances; step= is a fixed step",
    "dense_output": "evaluation_times= are the times that are wanted",
    "events": "blocks declare switching functions, and metrics find crossings in the response",
    "vectorized": "it needs no other form of the functions",
    "args": "params= are the parameters",
    **dict.fromkeys(("jac", "jac_sparsity", "lband", "uband"), JACOBIAN),
}


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a run is integrated."""

    rtol: float = RTOL  # tolerances; the error of a step is weighed with atol + rtol |x|
    atol: float = ATOL
    max_steps: int = 10_000_000_000  # attempted steps after which a run ends as STEP_LIMIT
    # explicit pair of orders 5(4); stiff method of orders 5(4); Taylor's method, of an order that
    # follows from rtol, for equations that can be written as expressions and have no memories;
    # whichever is faster; an explicit pair of your own as its tableau
    method: str | Tableau = "auto"
    step: float = 0.0  # fixed step (s) instead of error control; 0 for error control
    max_step: float = np.inf  # longest step (s), under error control too
    slide: bool = True  # whether a run that chatters at a condition slides along it

    @property
    def pair(self) -> Tableau:
        """The explicit pair that is used, alone or in turn with the stiff method."""
        own = self.method
        return own if isinstance(own, Tableau) else EXPLICIT_PAIRS.get(own, TSIT5)

    def __post_init__(self) -> None:
        if not isinstance(self.method, Tableau) and self.method not in METHODS:
            error = unknown("method", str(self.method), METHODS, "of machine code")
            raise UnknownNameError(
                f"{error}; those of SciPy, 'RK45' say, are for input_output_response of a diagram"
            )
        for name in ("rtol", "atol", "step", "max_steps", "max_step"):
            if not isinstance(getattr(self, name), Real):
                raise ParameterError(f"{name} must be one number, got {getattr(self, name)!r}")
        for name, most in (("rtol", 1), ("atol", np.inf)):
            if not 0 < getattr(self, name) < most:
                rule = "> 0 and < 1" if most == 1 else "> 0"
                raise ParameterError(f"{name} must be {rule}, got {getattr(self, name)!r}")
        if not 0 <= self.step < np.inf:
            raise ParameterError(f"step must be > 0, or 0 for error control, got {self.step!r}")
        if not isinstance(self.slide, bool | np.bool_):
            raise ParameterError(f"slide must be True or False, got {self.slide!r}")
        if not self.max_step > 0:
            raise ParameterError(f"max_step must be > 0, got {self.max_step!r}")
        if self.max_steps < 1:
            raise ParameterError(f"max_steps must be >= 1, got {self.max_steps!r}")


def solver_settings(
    *,
    method: str | Tableau | None,
    solve_ivp_method: str | None,
    solve_ivp_kwargs: Mapping[str, Any] | None,
    **settings: object,
) -> Settings:
    """Return the settings of a run in machine code."""
    keywords = dict(solve_ivp_kwargs or {})
    asked = keywords.pop("method", None) or solve_ivp_method
    if asked:
        nearest = _METHODS.get(str(asked), f"{_EXPLICIT}, {_STIFF}")
        raise ParameterError(
            f"solve_ivp_method={asked!r} has no meaning in machine code: {nearest}"
        )
    for name in keywords:
        if name in _REFUSED:
            raise ParameterError(
                f"solve_ivp_kwargs with '{name}' has no meaning in machine code: {_REFUSED[name]}"
            )
        if name not in ("rtol", "atol"):
            raise unknown("keyword", name, ["rtol", "atol", *_REFUSED], "in solve_ivp_kwargs")
    return settings_of(method, **settings | keywords)


def settings_of(method: str | Tableau | None, **given: Any) -> Settings:
    """Return settings, the usual ones where None is given."""
    chosen = {name: value for name, value in given.items() if value is not None}
    return Settings(**chosen, method="auto" if method is None else method)

"""What python-control is told of its integrator, in machine code: taken, or refused by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import ParameterError
from ..names import unknown
from .integrate.driver import Settings
from .integrate.methods.tableau import Tableau

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


def solver_settings(
    *,
    method: str | Tableau | None,
    solve_ivp_method: str | None,
    solve_ivp_kwargs: Mapping[str, Any] | None,
    **settings: Any,
) -> Settings:
    """Return the settings of a run in machine code.

    Parameters
    ----------
    method : str, Tableau or None
        Of `Settings`.
    solve_ivp_method, solve_ivp_kwargs
        As python-control takes them: of the keywords ``rtol`` and ``atol`` have a meaning here.
    **settings
        Others of `Settings`; None where they are not given.

    Raises
    ------
    ParameterError
        If an argument has no meaning in machine code; the message says what comes nearest.
    UnknownNameError
        If there is no such keyword or method.
    """
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
    given = {name: value for name, value in settings.items() if value is not None}
    return Settings(**given | keywords, method="auto" if method is None else method)

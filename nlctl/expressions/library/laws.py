"""The normal distribution, as `scipy.stats.norm` has it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ..arrays import traced
from .integral_functions import ndtri
from .special import enter_scipy
from .table import Facade, formula, written_out

__all__: list[str] = []

_ROOT = math.sqrt(2.0 * math.pi)


def _below(np: Facade, z: Any) -> Any:
    from scipy import special

    enter_scipy()
    return 0.5 * written_out(np.graph, special.erfc, -z * math.sqrt(0.5))


def _of_places(rule: Callable[[Facade, Any, Any], Any]) -> Callable[..., Any]:
    def written(np: Facade, x: Any, loc: Any = 0.0, scale: Any = 1.0) -> Any:
        width: Any = traced(np.graph, scale)
        z = (traced(np.graph, x) - loc) / width
        return np.where(width > 0.0, rule(np, z, width), math.nan)

    return written


def _ppf(np: Facade, q: Any, loc: Any = 0.0, scale: Any = 1.0) -> Any:
    width: Any = traced(np.graph, scale)
    return np.where(width > 0.0, ndtri(np, traced(np.graph, q)) * width + loc, math.nan)


LAW = "norm_gen"  # SciPy's class of it
_METHODS = {
    "pdf": _of_places(lambda np, z, width: np.exp(-z * z / 2.0) / _ROOT / width),
    "logpdf": _of_places(lambda np, z, width: -z * z / 2.0 - math.log(_ROOT) - np.log(width)),
    "cdf": _of_places(lambda np, z, width: _below(np, z)),
    "sf": _of_places(lambda np, z, width: _below(np, -z)),
    "ppf": _ppf,
}
for _name, _written in _METHODS.items():
    formula((LAW, _name))(_written)

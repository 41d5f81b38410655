"""Methods of integration: explicit pairs, each a `tableau`, and a stiff one, a Rosenbrock method.

A new explicit pair is one module with its `Tableau` and its place in `EXPLICIT_PAIRS`.
"""

from .tableau import Tableau
from .tsit5 import TSIT5

EXPLICIT_PAIRS: dict[str, Tableau] = {pair.name: pair for pair in (TSIT5,)}

"""What memories are committed to where a run begins, with their derivatives.

All are committed from what they were, and again as long as one that has moved moves another: a
play behind a relay that switches at once is driven first as the relay was, then as it has become.
Its derivative is that of the last that has moved it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..expressions.dependence import reads
from ..expressions.evaluate import evaluate_expressions
from ..native.jacobians import searches_of
from .directions import SomeRows
from .program import Differentiated
from .source import EquationParts

Arrays = dict[str, np.ndarray]


def commits_at_start(
    differentiated: Differentiated, x0: np.ndarray, arrays: Arrays
) -> list[Arrays]:
    """Return what a run begins with before each commit of its memories, then behind the last."""
    source, places = differentiated.sides.source, differentiated.places
    memories = list(source.program.memory)
    x = arrays["x"].copy()
    x[memories, 0] = x0[memories]
    commits = [{**arrays, "x": x}]
    pieces = [(e, 1) for e in source.committed]
    pieces += [(e, 1) for row in differentiated.saltation.at_start for e in row.values()]
    moving = [*source.driven, *source.catching]
    rows = [*memories, *(places.derivative(j) + m for j in range(places.by) for m in moving)]
    for _ in memories:  # as often as the engine does
        behind = evaluated_rows(differentiated, pieces, commits[-1])
        same = np.array_equal(behind[: len(memories)], commits[-1]["x"][memories, 0])
        if same and len(commits) > 1:
            break
        x = commits[-1]["x"].copy()
        x[rows, 0] = behind
        commits.append({**arrays, "x": x})
    return commits


def left_where_they_are(source: EquationParts, commits: Sequence[Arrays], k: int) -> list[int]:
    """Return which driven memories count as commit `k` finds them."""
    # What moves a memory once more says all of it.  Behind the last commit only those can be at
    # another end than before that are driven by what it has changed.
    later = [arrays["x"][:, 0] for arrays in commits[k + 1 :]]
    if later:
        return [m for m in source.driven if all(x[m] == later[0][m] for x in later)]
    behind = commits[-1]["x"]
    changed = {m for m in source.program.memory if commits[-2]["x"][m, 0] != behind[m, 0]}
    return [m for m, become in source.driven.items() if reads([become], "x", changed - {m})]


def evaluated_rows(
    differentiated: Differentiated, pieces: Sequence[SomeRows], arrays: Arrays
) -> np.ndarray:
    """Return the rows of some pieces."""
    searches = searches_of(differentiated.compiled.equations)
    evaluated = evaluate_expressions([e for e, _ in pieces], arrays, searches)
    parts = [np.broadcast_to(v.reshape(-1), (n,)) if v.size in (1, n) else v.reshape(-1)
             for v, (_, n) in zip(evaluated, pieces, strict=True)]  # fmt: skip
    return np.concatenate([np.empty(0), *parts])

"""A certificate as a file that others check: rationals, boxes, and the claim, as JSON.

`nlctl.analysis.recheck` reads it, and knows nothing of what found it.  Bounds are written a little
wider than they were proved, so that plain interval arithmetic follows them, and nothing is written
that the recheck does not answer with yes.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

from nlctl.errors import UsageError
from nlctl.host.files import replace_file
from nlctl.plants import coordinate_names

from ...intervals.normal_form import exact
from ...intervals.paths import Undecided
from ...intervals.written import operations
from ...recheck import FORMAT, Refuted, proved_bounds, recheck, seal_of
from ..bounds.decomposition import Decomposition
from ..bounds.starts import Starts
from ..loop.plant_form import Acceleration

Content = dict[str, Any]


def save_certificate(
    path: str | os.PathLike[str], kind: str, name: str, attempts: Callable[[], Iterator[Content]]
) -> Path:
    """Write the first of some attempts that the recheck answers with yes."""
    why = "there is nothing to be written"
    try:
        for attempt in attempts():
            content = {
                "format": FORMAT[0],
                "version": FORMAT[1],
                "kind": kind,
                "loop": name,
                **attempt,
            }
            try:
                bounds = proved_bounds(content)
                content["claim"] = {k: str(_rounded_up(b)) for k, b in bounds.items()}
                content["seal"] = seal_of(content)
                recheck(content)
            except Refuted as error:
                why = str(error)
                continue
            text = f"{json.dumps(content, indent=1)}\n".encode()
            return replace_file(path, lambda file, text=text: file.write(text))
    except Undecided as error:
        why = f"{error}; the file holds arithmetic and a few functions only"
    raise UsageError(
        f"the certificate of '{name}' cannot be saved so that others can check it: {why}"
    )


def _rounded_up(bound: Fraction) -> Fraction:
    """Return a bound with ten digits or so."""
    digits = 10 ** max(10 - len(str(int(bound))), 0)
    return Fraction(-((-bound.numerator * digits) // bound.denominator), digits)


def texts(values: Iterable[Any]) -> list[str]:
    """Return finite numbers as exact texts."""
    return [str(exact(value)) for value in values]


def equation_content(acceleration: Acceleration, order: int) -> list[list[Any]]:
    """Return x_n' of a plant, in t, x1, ..., xn and v."""
    names = coordinate_names(order)
    return operations(
        ("t", *names, "v"), lambda s: acceleration(s["t"], [s[x] for x in names], s["v"])
    )


def split_content(split: Decomposition) -> Content:
    """Return the split of an actuator as a file has it."""
    endless = split.largest_u == float("inf")
    return {
        "k_1": str(exact(split.k_1)),
        "k_2": str(exact(split.k_2)),
        "eps": str(exact(split.eps_star)),
        "range": None if endless else str(exact(split.largest_u)),
    }


def starts_content(starts: Starts) -> Content:
    """Return the ends of all initial states that a proof depends on; not those that V bounds."""
    every = zip(starts.names, starts.low, starts.high, strict=True)
    bounded = ((name, ends) for name, *ends in every if all(map(math.isfinite, ends)))
    return {name: texts(ends) for name, ends in bounded if name not in starts.kept}

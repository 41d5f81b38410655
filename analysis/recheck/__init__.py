"""``python -m nlctl.analysis.recheck FILE`` checks a saved certificate again, by integers alone.

The file says what a closed loop is (the plant's equation, the gains, the split of the actuator, the
reference, the starts), what is claimed of it, and the numbers by which the claim follows.  Nothing
of the program that found them is used, and nothing but Python's own library: intervals are pairs of
integers, rounded outward, and all else is rational.  The answer is yes, or no with the line of the
proof that does not hold.

What is taken from the file as a premise, and is for its reader to compare with the loop, is
printed: the kind of controller, the equation, the split v = k u + eps_u, the reference.
"""

import json
import sys
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from .content import FORMAT, Record, Refuted, need, seal_of
from .filtered import filter_text, known_sign_bounds, sliding_mode_bounds
from .integers import exact_text, text_above
from .reference_model import model_text, reference_model_bounds

__all__ = ["FORMAT", "RECHECKED", "Refuted", "proved_bounds", "recheck", "seal_of"]

RECHECKED = {  # what follows, and the premises in words
    "known sign": (known_sign_bounds, filter_text),
    "sliding mode": (sliding_mode_bounds, filter_text),
    "reference model": (reference_model_bounds, model_text),
}


def recheck(content: Any) -> str:
    """Return what a certificate proves, in words.

    Parameters
    ----------
    content : dict
        What the file holds, read as JSON.

    Returns
    -------
    str
        The claim, with the premises that its reader has to compare with the loop at hand.

    Raises
    ------
    Refuted
        If a line of the proof does not hold, or the file is not as it was written.

    Examples
    --------
    A bound that is smaller than what follows is answered with no, whether or not it is sealed:

    >>> import json, tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.lyapunov import certify
    >>> from nlctl.analysis.recheck import recheck, seal_of
    >>> controller = nlctl.sliding_mode(law=nlctl.controllers.SlidingModeLaw(K=20.0, phi=0.1))
    >>> loop = nlctl.paper.example_1(controller=controller, actuator=nlctl.Gain())
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = certify(loop).save(Path(folder) / "certificate.json")
    ...     content = json.loads(file.read_text())
    >>> print(recheck(content).split(";")[1])
     for all t >= 0 from plant.x1(0) = 0.5, all other states 0. Premises: sliding mode
    >>> content["claim"]["|u|"] = "10"
    >>> content["seal"] = seal_of(content)
    >>> recheck(content)
    Traceback (most recent call last):
    nlctl.analysis.recheck.content.Refuted: |u| <= 10
    """
    whole = Record(content, "the file")
    need([whole["format"], whole["version"]] == FORMAT, "the format is another one")
    need(whole["seal"] == seal_of(content), "the file was changed after it was written")
    bounds, claim = proved_bounds(content), whole.record("claim")
    need(bool(claim.content), "nothing is claimed")
    need(set(claim.content) <= set(bounds), "a bound is claimed that is not proved")
    for name in claim.content:
        need(bounds[name] <= claim.number(name), f"{name} <= {exact_text(claim.number(name))}")
    said = ", ".join(f"{name} <= {text_above(claim.number(name))}" for name in claim.content)
    return f"{said}; for all t >= 0 from {RECHECKED[whole['kind']][1](whole)}"


def proved_bounds(content: object) -> dict[str, Fraction]:
    """Return the bounds that follow from the premises and the proof of a certificate, by name.

    Parameters
    ----------
    content : dict
        What the file holds; the seal and the claim are ignored.

    Returns
    -------
    dict of Fraction
        Upper bounds by name.

    Raises
    ------
    Refuted
        If one of the proof's lines does not hold.

    Examples
    --------
    See `recheck`.
    """
    whole = Record(content, "the file")
    kind = whole["kind"]
    need(isinstance(kind, str) and kind in RECHECKED, f"there is no proof of kind {kind!r}")
    return RECHECKED[kind][0](whole)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print yes or no for a file, and return 0 or 1; 2 where there is no such file."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    if len(given) != 1:
        print("usage: python -m nlctl.analysis.recheck FILE")
        return 2
    try:
        with open(given[0], encoding="utf-8") as file:
            content = json.load(file)
    except OSError as error:
        print(f"cannot be read: {error}")
        return 2
    except (ValueError, RecursionError) as error:
        print(f"no: {given[0]} is not JSON ({error})")
        return 1
    try:
        print(f"yes: {recheck(content)}")
    except (Refuted, ArithmeticError, TypeError, ValueError) as error:
        print(f"no: {error}")
        return 1
    return 0

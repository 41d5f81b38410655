"""The model description of an FMU, and how its sources are compiled, as XML."""

from __future__ import annotations

from importlib.resources import files

import jinja2
import numpy as np

from ..._version import __version__
from .records import Model
from .variables import is_structured

_BASE = {"s": 's="1"', "m": 'm="1"', "kg": 'kg="1"', "A": 'A="1"', "K": 'K="1"',
         "rad": 'rad="1"', "1/s": 's="-1"', "rad/s": 'rad="1" s="-1"', "m/s": 'm="1" s="-1"',
         "N": 'kg="1" m="1" s="-2"', "1": ""}  # fmt: skip


def description(model: Model, version: int, token: str, code: list[str]) -> str:
    """Return ``modelDescription.xml``; `code` are the files that are compiled."""
    return _rendered(
        f"modelDescription{version}.xml", model=model, token=token, code=code, tool=__version__,
        convention="structured" if is_structured(model.variables) else "flat",
        units={v.unit: _BASE.get(v.unit) for v in model.variables if v.unit},
        place={v.reference: i for i, v in enumerate(model.variables, start=1)},
        outputs=model.of("outputs"), rates=model.of("rates"), indicators=model.of("indicators"),
    )  # fmt: skip


def build_description(model: Model, code: list[str]) -> str:
    """Return ``buildDescription.xml`` of FMI 3.0."""
    return _rendered("buildDescription.xml", model=model, code=code)


def _rendered(template: str, **values: object) -> str:
    folder = files("nlctl.export.fmi") / "templates"
    templates = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True,
    )  # fmt: skip
    templates.filters["number"] = _number
    templates.tests["finite"] = np.isfinite
    text = (folder / f"{template}.j2").read_text(encoding="utf-8")
    return templates.from_string(text).render(**values)


def _number(value: float) -> str:
    return repr(float(value))

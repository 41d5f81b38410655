"""Records of results say what each of their fields is, once: next to it."""

import dataclasses
import importlib
import inspect
from collections.abc import Mapping
from typing import Literal

import numpy as np
import pytest
from reference import documented_names, entries
from rows import each_row

from nlctl.attributes import described_record

Answer = Literal["yes", "no"]


@described_record(made_by="watch")
class Watched:
    """A signal that was watched."""

    time: np.ndarray  # (m,): sample times (s)
    # What it was asked, in a sentence that does not
    # fit into one line.
    question: str
    answer: Answer = "no"
    low: float = 0.0  # its ends
    high: float = 1.0
    found: Mapping[str, float] | None = None


def test_a_docstring_has_each_field_with_type_shape_and_meaning():
    assert entries(Watched, "Attributes") == [
        ("time : ndarray of shape (m,)", "sample times (s)"),
        ("question : str", "What it was asked, in a sentence that does not fit into one line."),
        ('answer : {"yes", "no"}, optional', ""),
        ("low, high : float, optional", "its ends"),
        ("found : mapping or None, optional", ""),
    ]
    assert inspect.getdoc(Watched).endswith("Examples\n--------\nSee `watch`.")
    assert inspect.getdoc(Watched).startswith("A signal that was watched.\n\nAttributes\n")


def test_it_is_a_frozen_dataclass_made_by_name():
    watched = Watched(time=np.zeros(2), question="?")
    with pytest.raises(dataclasses.FrozenInstanceError):
        watched.answer = "yes"
    with pytest.raises(TypeError):
        Watched(np.zeros(2), "?")


def public_records():
    """The records of the reference whose fields are described next to them."""
    for home, name in documented_names():
        made = getattr(importlib.import_module(home), name)
        if inspect.isclass(made) and type(vars(made).get("__doc__")).__name__ == "_Docstring":
            yield f"{home}.{name}", made


@each_row(("name", "made"), sorted(dict(public_records()).items()))
def test_every_public_field_is_in_the_docstring(name, made):
    heads = [head.partition(" : ")[0] for head, _ in entries(made, "Attributes")]
    shown = {one for head in heads for one in head.split(", ")}
    own = [field for field in inspect.get_annotations(made) if not field.startswith("_")]
    assert shown == set(own), name

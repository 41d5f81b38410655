"""Arguments that are not what annotations say are named where a call fails, and only there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt
import pytest

import nlctl
from nlctl.annotations import as_annotated
from nlctl.errors import ParameterError

if TYPE_CHECKING:
    from decimal import Decimal

Side = Literal["upper", "lower"]


@as_annotated
def fails(
    n: int = 1,
    x: float = 0.5,
    name: str = "a",
    flag: bool = False,
    side: Side = "upper",
    many: Sequence[float] = (),
    texts: Sequence[str] = (),
    pair: tuple[float, float] = (0.0, 1.0),
    table: Mapping[str, float] | None = None,
    array: np.ndarray | None = None,
    like: npt.ArrayLike = 0.0,
    function: Callable[[float], float] = float,
    each: Iterable[int] = (),
    exact: Decimal | None = None,
    place: Path | None = None,
    limits: tuple[float, float] = (0.0, np.inf),
    anything: Any = None,
    **others: float,
):
    """Fail as a library does."""
    return {}["deep inside"]


RIGHT = {
    "n": [0, np.int64(3)], "x": [1, 0.5, np.float32(2), np.array(1.0)], "name": ["", "b"],
    "flag": [True, np.bool_(0)], "side": ["lower"], "many": [[1, 2.5], (), np.ones(3)],
    "texts": ["ab", ["a", "b"], ()], "pair": [(0, 1), [0.5, 2]],
    "table": [None, {}, {"a": 1, "b": 2.5}], "array": [None, np.ones(2), np.ones((2, 2))],
    "like": [1, [1, 2], np.ones(3)], "function": [len, lambda x: x], "each": [[1], iter([1])],
    "place": [Path("a")], "limits": [(0.0, np.inf)], "anything": [object(), None],
    "more": [1.0],
}  # fmt: skip
WRONG = {
    "n": [1.0, "1", None, True, 2**70], "x": ["1", None, 1j, np.nan, np.ones(2), 10**30],
    "name": [None, 3, b"a"], "flag": [1, "yes"], "side": ["up", None],
    "many": ["12", 3, ["a"], [None], {1: 2}, np.array(1.0)], "texts": [3, [1], None],
    "pair": [(1,), 3, ("a", "b"), (1, 2, 3)], "table": [3, {1: 2}, {"a": "b"}, [("a", 1)]],
    "array": ["a", object(), [np.nan], np.array(["a"]), np.array([])],
    "like": ["a", [[1], [1, 2]], [None]], "function": [3, "len"], "each": [3, ["a"]],
    "exact": [0.5], "place": [3], "more": ["a"],
}  # fmt: skip


@pytest.mark.parametrize(("name", "value"), [(k, v) for k in WRONG for v in WRONG[k]])
def test_the_argument_is_named_with_rule_and_value(name, value):
    with pytest.raises(ParameterError, match=rf"^fails needs {name} to be .+, got .+") as told:
        fails(**{name: value})
    assert isinstance(told.value.__cause__, KeyError)
    assert "\n" not in str(told.value)
    assert len(str(told.value)) < 200


@pytest.mark.parametrize(("name", "value"), [(k, v) for k in RIGHT for v in RIGHT[k]])
def test_an_error_that_no_argument_explains_stays_what_it_is(name, value):
    with pytest.raises(KeyError, match="deep inside"):
        fails(**{name: value})


def test_what_works_is_not_restricted():
    @as_annotated
    def works(n: int) -> str:
        return f"{n}"

    assert works("text") == "text"  # type: ignore[arg-type]


def test_files_and_own_sentences_are_left_alone():
    @as_annotated
    def opened(n: int = 1):
        return Path("no/such").read_text()

    @as_annotated
    def refused(n: int):
        nlctl.block(nlctl.Gain, "gain")

    with pytest.raises(FileNotFoundError):
        opened("x")  # type: ignore[arg-type]
    with pytest.raises(nlctl.errors.BlockError, match="is a class"):
        refused("x")  # type: ignore[arg-type]


def test_missing_arguments_are_pythons_to_tell():
    @as_annotated
    def two(a: int, b: int):
        return a + b

    with pytest.raises(TypeError, match="missing 1 required positional argument: 'b'"):
        two("x")  # type: ignore[call-arg,arg-type]


def test_constructors_and_variable_arguments():
    @as_annotated
    @dataclass(frozen=True)
    class Span:
        low: float
        high: float

        def __post_init__(self):
            self.high - self.low

    with pytest.raises(ParameterError, match="Span needs high to be a finite number, got 'b'"):
        Span(1.0, "b")  # type: ignore[arg-type]

    @as_annotated
    def total(*values: float):
        return sum(values)

    with pytest.raises(ParameterError, match=r"total needs values to be a tuple of a finite"):
        total(1.0, "b")  # type: ignore[arg-type]


def test_records_of_ones_own_say_it_too():
    @nlctl.record
    class Doubled:
        inputs: tuple[str, ...] = ("u",)

        def __post_init__(self):
            object.__setattr__(self, "count", len(self.inputs))

    with pytest.raises(ParameterError, match="Doubled needs inputs to be a tuple of text, got 3"):
        Doubled(inputs=3)


class Unprintable:
    def __repr__(self):
        raise RuntimeError


def test_values_that_cannot_be_printed_are_named_by_type():
    with pytest.raises(ParameterError, match="got an object of type Unprintable"):
        fails(n=Unprintable())  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match=r"\.\.\. of type str"):
        fails(n="x" * 1000)  # type: ignore[arg-type]

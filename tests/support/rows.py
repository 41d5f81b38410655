"""Tests that go through a table: one case, all rows, every mismatch told."""

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any

import pytest


def each_row(
    names: str | tuple[str, ...], rows: Iterable[Any], ids: Iterable[str] | None = None
) -> Callable[..., Any]:
    """Call a test with every row of a table, as `pytest.mark.parametrize` does, in one case.

    For rows that take no time, such as the wording of messages.  A row that fails does not end
    the test: all that fail are told together, each with its values, or its name in `ids`, and
    its traceback.
    """
    keys = [n.strip() for n in names.split(",")] if isinstance(names, str) else [*names]
    whole = [row if len(keys) > 1 else (row,) for row in rows]
    values = [dict(zip(keys, row, strict=True)) for row in whole]
    assert values, "a table without rows tests nothing"
    told = dict(enumerate(values if ids is None else ids))
    assert len(told) == len(values)

    def decorate(test: Any) -> Any:
        @functools.wraps(test)
        def every_row(*args: Any, **fixtures: Any) -> None:
            missed = []
            for number, row in enumerate(values):
                try:
                    test(*args, **fixtures, **row)
                except (Exception, pytest.fail.Exception) as error:
                    wrong = AssertionError(f"{told[number]}: {error!r}")
                    missed.append(wrong.with_traceback(error.__traceback__))
            if missed:
                raise ExceptionGroup(f"{len(missed)} of {len(values)} rows", missed)

        own = inspect.signature(test)
        left = [p for name, p in own.parameters.items() if name not in keys]
        every_row.__signature__ = own.replace(parameters=left)  # type: ignore[attr-defined]
        return every_row

    return decorate

"""Tests that go through a table: one case, all rows, every mismatch told."""

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any

import pytest


def table(names: str | tuple[str, ...], rows: Iterable[Any]) -> Callable[[Any], Any]:
    """Call a test with every row of a table, as `pytest.mark.parametrize` does, in one case.

    For rows that take no time, such as the wording of messages.  A row that fails does not end
    the test: all that fail are told together, each with its values and its traceback.
    """
    keys = tuple(n.strip() for n in names.split(",")) if isinstance(names, str) else names
    kept = [row if len(keys) > 1 else (row,) for row in rows]
    assert kept, "a table without rows tests nothing"

    def decorate(test: Any) -> Any:
        @functools.wraps(test)
        def every_row(*args: Any, **fixtures: Any) -> None:
            missed = []
            for row in kept:
                values = dict(zip(keys, row, strict=True))
                try:
                    test(*args, **fixtures, **values)
                except (Exception, pytest.fail.Exception) as error:
                    told = AssertionError(f"{values}: {error}")
                    missed.append(told.with_traceback(error.__traceback__))
            if missed:
                raise ExceptionGroup(f"{len(missed)} of {len(kept)} rows", missed)

        own = inspect.signature(test)
        left = [p for name, p in own.parameters.items() if name not in keys]
        every_row.__signature__ = own.replace(parameters=left)  # the rest are fixtures
        return every_row

    return decorate

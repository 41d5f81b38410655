"""Connecting blocks by python-control's lists: `connections`, `inplist`, `outlist`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import control as ct

from ..errors import DiagramError
from ..names import unknown


def connected_by_lists(
    systems: Sequence[Any], connections: Any, inplist: Any, outlist: Any
) -> Callable[..., Any]:
    """Check the names in lists of python-control; return what connects blocks by them.

    That takes ``(systems, inputs, outputs, name)`` and returns the diagram; it refuses what
    python-control refuses, and an input that nothing feeds.
    """
    for what in (connections, inplist, outlist):
        for text in _texts(what):
            _check_name(systems, text)

    def connected(systems: Any, inputs: Any, outputs: Any, name: str | None) -> Any:
        given = outlist
        if outlist is None and outputs is None:
            given, outputs = _every_output(systems)
        try:
            diagram = ct.interconnect(
                systems, connections, inplist, given, inputs=inputs or None, outputs=outputs,
                name=name, check_unused=False,
            )  # fmt: skip
        except (ValueError, TypeError, IndexError) as error:
            raise DiagramError(f"interconnect cannot connect these lists: {error}") from error
        _check_fed(diagram)
        return diagram

    return connected


def _texts(thing: Any) -> Iterator[str]:
    """Yield all texts in nested lists; python-control checks tuples of numbers and gains."""
    if isinstance(thing, str):
        yield thing
    elif isinstance(thing, list):
        for part in thing:
            yield from _texts(part)


def _check_name(systems: Sequence[Any], text: str) -> None:
    """Refuse ``"block.signal"`` that does not exist; a name alone is a block, or a signal."""
    name, dot, signal = text.removeprefix("-").partition(".")
    blocks = {system.name: system for system in systems}
    labels = {label for s in systems for label in (*s.input_labels, *s.output_labels)}
    if not dot:
        if name not in blocks and not _is_there(name, labels):
            raise unknown("signal", name, [*labels, *blocks], "in a list of connections")
        return
    if name not in blocks:
        raise unknown("block", name, blocks, f"in '{text}'")
    signals = [*blocks[name].input_labels, *blocks[name].output_labels]
    if not _is_there(signal, signals):
        raise unknown("signal", signal, signals, f"of block '{name}'")


def _is_there(signal: str, labels: Any) -> bool:
    """Whether there is a signal of that name, or several by ``"y[0:2]"`` or ``"y"``."""
    base = signal.partition("[")[0]
    return signal in labels or any(label.partition("[")[0] == base for label in labels)


def _every_output(systems: Sequence[Any]) -> tuple[list[Any], list[str]]:
    """Return every output of every block, and names that are different."""
    every = [(s, label) for s in systems for label in s.output_labels]
    count = Counter(label for _, label in every)
    names = [label if count[label] == 1 else f"{s.name}_{label}" for s, label in every]
    return [(s.name, label) for s, label in every], names


def _check_fed(diagram: Any) -> None:
    """Refuse an input of a block that nothing feeds: python-control takes it for 0."""
    dropped, _ = diagram.check_unused_signals(print_warning=False)
    for number, signal in sorted(dropped):
        block = diagram.syslist[number]
        raise DiagramError(
            f"input '{block.input_labels[signal]}' of block '{block.name}' is fed by nothing: "
            "connect it, or name it in inplist"
        )

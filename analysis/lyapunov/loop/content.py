"""What a loop consists of, and what has been seen of it before.

Whatever was checked of a loop holds as long as its functions, wiring and values are the same.  A
key of these sees whether they are; where no key sees everything nothing is remembered.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import control as ct

from nlctl.blocks import Block
from nlctl.diagrams import places

from ...loop_record import facts_and_unseen, text_key, value_text

_MOST = 1024  # checks that are remembered
_RECORDS = ("spec", "current_spec")


@dataclass(frozen=True, kw_only=True)
class LoopContent:
    """What a loop consists of."""

    # as of `nlctl.analysis.loop_record.loop_facts`
    facts: Mapping[str, dict[str, str]] = field(repr=False)
    # of all that python-control computes of it with the parameters of the run; empty where no
    # key sees everything
    key: str
    # of its functions, and of what kinds of values they get; empty where `key` is
    functions: str = ""


UNREAD_CONTENT = LoopContent(facts={}, key="")


class Remembered:
    """Keys of the latest checks that were passed; an empty key stands for none."""

    def __init__(self) -> None:
        self._passed: OrderedDict[str, None] = OrderedDict()

    def __contains__(self, key: str) -> bool:
        return bool(key) and key in self._passed

    def add(self, key: str) -> None:
        """Note that a check was passed."""
        if key:
            self._passed[key] = None
            while len(self._passed) > _MOST:
                self._passed.popitem(last=False)


def loop_content(
    loop: ct.InterconnectedSystem, params: Mapping[str, Any] | None = None
) -> LoopContent:
    """Return what a loop consists of now."""
    facts, unseen = facts_and_unseen(loop)
    is_seen = not unseen and all(_is_plain(place.system) for place in places(loop))
    values = {name: value_text(value) for name, value in (params or {}).items()}
    if not is_seen:
        return LoopContent(facts=facts, key="")
    kinds = {n: v if type((params or {})[n]) is not float else "float" for n, v in values.items()}
    return LoopContent(
        facts=facts, key=text_key(repr((facts, values))), functions=text_key(repr((facts, kinds)))
    )


def _is_plain(system: object) -> bool:
    """Whether a system computes what its class, its maps and its record say, and nothing else."""
    fields = {name: value for name, value in vars(system).items() if name not in _RECORDS}
    update, output = fields.pop("updfcn", None), fields.pop("outfcn", None)
    if any(callable(value) for value in fields.values()):  # instead of a method
        return False
    if type(system) is Block:
        spec = system.spec
        return output is spec.output and (not spec.states or update is spec.update)
    return type(system) is ct.InterconnectedSystem

"""What has happened in a run: times, and which of some labels each has."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

_Label = tuple[str, str, str]  # block, which, direction
_NONE = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, kw_only=True)
class EventLog:
    """Events of a run, in the order of time."""

    time: np.ndarray = field(default_factory=lambda: np.zeros(0))  # shape (n,): when (s)
    label: np.ndarray = field(default_factory=lambda: _NONE)  # which of the labels
    labels: tuple[_Label, ...] = ()  # block, which and direction

    def table(self) -> pd.DataFrame:
        """Return the events as rows: time, block, which, direction."""
        import pandas as pd

        columns = list(zip(*self.labels, strict=True)) or [(), (), ()]
        block, which, direction = (np.array(each, dtype=object)[self.label] for each in columns)
        named = {"block": block, "which": which, "direction": direction}
        return pd.DataFrame({"time": self.time, **named})

    def __iter__(self) -> Iterator[tuple[float, str, str, str]]:
        """Yield time, block, which and direction of each event."""
        for t, k in zip(self.time.tolist(), self.label.tolist(), strict=True):
            yield t, *self.labels[k]

    def times(self, block: str, which: str) -> np.ndarray:
        """Return when something of a block has happened (s)."""
        own = [k for k, each in enumerate(self.labels) if each[:2] == (block, which)]
        return self.time[np.isin(self.label, own)]


NO_EVENTS = EventLog()


def event_log(rows: Iterable[tuple[float, str, str, str]]) -> EventLog:
    """Return the log of rows of time, block, which, direction."""
    rows = list(rows)
    places: dict[_Label, int] = {}
    label = [places.setdefault((b, w, d), len(places)) for _, b, w, d in rows]
    return EventLog(
        time=np.array([row[0] for row in rows], dtype=float),
        label=np.array(label, dtype=np.int64),
        labels=tuple(places),
    )

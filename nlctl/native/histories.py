"""What a run keeps of signals that are delayed: before it begins, and while it goes on."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..delays.pieces import smooth_pieces
from ..delays.variation import Variation, check_positive, variation, variation_table
from ..errors import ParameterError
from .diagram.schedule import Schedule
from .integrate.delayed import DelayLines
from .integrate.delays import SMOOTH
from .integrate.memory import grown, with_fields, with_table
from .integrate.workspace import Task, Work
from .reading import Reading

_ROOM = 256  # steps that are kept at first
_KEPT = ("powers", "t", "h", "level")


def variations(reading: Reading, times: np.ndarray) -> list[Variation | None]:
    """Return how the delay of each line varies during runs over these times."""
    read, (begin, end) = reading.schedule, (float(times[0]), float(times[-1]))
    blocks = [line.block or 0 for line in read.lines]
    nodes = {i: read.nodes[i] for i in blocks}
    made = {i: variation(n.system.current_spec, begin, end, n.path) for i, n in nodes.items()}
    return [made[i] for i in blocks]


def lines_of(
    reading: Reading, p: np.ndarray, varied: list[Variation | None], signals: np.ndarray
) -> DelayLines:
    """Return the delays of all lines, how they vary, what acts on what, and where signals are."""
    read = reading.schedule
    delays = np.zeros((len(read.lines), p.shape[1]))
    for row, line in enumerate(read.lines):
        delays[row] = p[reading.program.layout[line.block or 0]["delay"].offset]
        check_positive(varied[row], delays[row], read.nodes[line.block or 0].path)
    return with_table(
        DelayLines, delays=delays, direct=direct_lines(read).astype(np.int64), signals=signals,
        **variation_table(varied),
    )  # fmt: skip


def with_past(reading: Reading, run: Any, p: np.ndarray) -> Any:
    """Return a run with what its signals were before it."""
    task = run.task
    lines, lanes = task.lines.delays.shape
    if not lines:
        return run
    begin = float(task.times[0])
    nodes, read = reading.schedule.nodes, reading.schedule.lines
    specs = [nodes[line.block or 0].system.current_spec for line in read]
    reach = task.lines.delays + np.array([[spec.varied(begin)] for spec in specs])
    before = _before(reading)
    earliest = begin - reach.max(axis=1)
    told = [row for row, spec in enumerate(specs) if spec.history is not None]

    def histories(t: float) -> np.ndarray:
        return before(t, earliest)[told]

    found = list(smooth_pieces(histories, float(earliest.min()), begin, len(told)))
    work = _with_places(run.work, max(_ROOM, 2 * len(found)))
    work.past.level[: len(found)] = SMOOTH
    for row, line in enumerate(read):
        slot = reading.program.layout[line.block or 0]["before"]
        work.past.powers[: len(found), row, 0] = p[slot.offset]
    for k, piece in enumerate(found):
        work.past.t[k], work.past.h[k] = piece.start, piece.length
        work.past.powers[k, told] = piece.powers[:, :, None]
        work.past.level[k, told] = 0 if piece.breaks else SMOOTH
    work.past.kept[:], work.past.shown_to[:], work.past.until[:] = len(found), -1, begin
    for row in range(len(read)):
        for j in range(lanes):
            starts = work.past.t[: len(found), j]
            first = int(np.searchsorted(starts, begin - reach[row, j], "right")) - 1
            breaks = np.flatnonzero(work.past.level[: len(found), row, j] < SMOOTH)
            later = breaks[breaks > max(first, 0)]
            work.past.first[row, j] = max(first, 0)
            work.past.next[row, j] = later[0] if later.size else -1
    return replace(run, work=work, early=np.array([one.start for one in found if one.breaks]))


def arriving_first(reading: Reading, task: Task) -> np.ndarray:
    """Return what leaves the delays where a run begins, shape (lines,)."""
    begin, nodes = float(task.times[0]), reading.schedule.nodes
    specs = [nodes[line.block or 0].system.current_spec for line in reading.schedule.lines]
    sent = begin - task.lines.delays[:, 0] - np.array([spec.varied(begin) for spec in specs])
    before = _before(reading)
    return np.array([before(t, sent)[row] for row, t in enumerate(sent)])


def with_room(task: Task, work: Work) -> Any:
    """Return the workspace with places for more steps, where there are none."""
    # What no delay reaches back to is forgotten; if that is less than half, there is more room.
    room = work.past.t.shape[0]
    if not task.lines.delays.size or work.past.kept.max() < room:
        return work
    longest = np.abs(task.lines.vary).sum(axis=2).max(axis=0)  # and more: powers of z in [-1, 1]
    for j in range(task.lines.delays.shape[1]):
        kept = work.past.kept[j]
        oldest = work.lanes["t"][j] - (task.lines.delays[:, j] + longest).max()
        gone = int(np.searchsorted(work.past.t[:kept, j], oldest, "right")) - 1
        gone = min(max(gone, 0), int(work.past.first[:, j].max()))
        gone = max(0, min(gone, *(i - 1 for i in work.past.next[:, j] if i >= 0), kept - 1))
        for name in _KEPT:
            array = getattr(work.past, name)
            array[: kept - gone, ..., j] = array[gone:kept, ..., j].copy()
        work.past.kept[j] = kept - gone
        work.past.first[:, j] = np.maximum(work.past.first[:, j] - gone, 0)
        work.past.next[:, j] = np.where(work.past.next[:, j] >= 0, work.past.next[:, j] - gone, -1)
    return work if work.past.kept.max() <= room // 2 else _with_places(work, 2 * room)


def _with_places(work: Work, room: int) -> Any:
    """Return the workspace with places for so many steps."""
    return with_fields(work, past=grown(work.past, _KEPT, room))


def direct_lines(read: Schedule) -> np.ndarray:
    """Return which lines' arriving signals depend at once on what leaves which lines."""
    leaving = {line: i for i, line in enumerate(read.lines)}
    found: dict[Any, frozenset[int]] = {}

    def reached(combination: Any) -> frozenset[int]:
        return frozenset().union(*(from_signal(s) for s in combination if s.block is not None))

    def from_signal(signal: Any) -> frozenset[int]:
        if signal in leaving:
            return frozenset([leaving[signal]])
        if signal not in found:
            found[signal] = frozenset(range(len(leaving)))  # of a loop that is solved: all
            node = read.nodes[signal.block]
            given = np.flatnonzero(node.direct[signal.index])
            found[signal] = frozenset().union(*(reached(node.inputs[int(j)]) for j in given))
        return found[signal]

    direct = np.zeros((len(leaving), len(leaving)), dtype=bool)
    for i, arriving in enumerate(read.outputs[len(read.outputs) - len(leaving) :]):
        direct[i, list(reached(arriving))] = True
    return direct


# -- before the run --------------------------------------------------------------------------------


def _before(reading: Reading) -> Callable[[float, np.ndarray], np.ndarray]:
    """Return the signals of all lines at a time, no earlier than their delays reach back to."""
    nodes = reading.schedule.nodes
    blocks = {line.block or 0: None for line in reading.schedule.lines}

    def values(t: float, earliest: np.ndarray) -> np.ndarray:
        found, row = [], 0
        for i in blocks:
            spec = nodes[i].system.current_spec
            try:
                found.append(spec.earlier(max(t, float(earliest[row]))))
            except ParameterError as error:
                raise ParameterError(f"{error} (block '{nodes[i].path}')") from None
            row += len(spec.inputs)
        return np.concatenate(found)

    return values

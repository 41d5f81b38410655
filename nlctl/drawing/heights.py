"""Vertical coordinates of a block diagram; see `routes`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, floor, inf
from statistics import fmean

from .order import LayoutPlan, side
from .records import EXTERNAL, GRID, LANE_WIDTH, ROW_GAP, Heights, LayoutNode


@dataclass(frozen=True)
class HeightMap:
    """Vertical coordinates of boxes, arrows at boxes, and arrows in channels."""

    centre: Sequence[float]
    half: Sequence[float]
    leave: Heights
    enter: Heights
    lane: Mapping[tuple[int, int], float]  # [wire, channel]
    total: float


def _up(value: float) -> float:
    """Round up to the grid."""
    return GRID * ceil(value / GRID - 1e-9)


def _outlets(plan: LayoutPlan, n: int) -> tuple[dict[int, float], float]:
    """Heights of a block's outlets below its axis, and half the height that they need."""
    # Wires to the next column leave on the axis, those to the channels outside of them; the far-
    # reaching stand nearer to the axis, where they do not cross the others.
    rank: dict[int, tuple[float, float]] = {}
    for i, wire in enumerate(plan.wires):
        if wire.source == n:
            home, goals = plan.places[n], [plan.places[t] for t in wire.targets]
            sides = [side(home, g, plan.channel.get((i, g.column))) for g in goals]
            reach = max(abs(g.column - home.column - 1) for g in goals)
            direct = fmean(g.share for g in goals)
            rank[i] = (0, direct) if 0 in sides else (2 * sides[0], -sides[0] * reach)
    label = plan.nodes[n].outlet
    if label.text:
        ways = [way for way, _ in rank.values()]  # where it keeps the box small
        rank[EXTERNAL] = (-1 if 0 in ways and 2 in ways and -2 not in ways else 1, 0)
    order = sorted(rank, key=lambda i: (rank[i], i))
    room = {i: (plan.wires[i].label.h + 3, 5.0) for i in order if i != EXTERNAL}
    room[EXTERNAL] = (label.h / 2 + 3, label.h / 2 + 3)
    at: dict[int, float] = dict.fromkeys(order[:1], 0.0)
    for above, below in pairwise(order):
        at[below] = _up(at[above] + room[above][1] + room[below][0])
    on_axis = [at[i] for i in order if rank[i][0] == 0] or [at[i] for i in order if i == EXTERNAL]
    ends = on_axis or list(at.values()) or [0.0]
    axis = GRID * round((ends[0] + ends[-1]) / 2 / GRID)
    need = [max(room[i][0] + axis - at[i], at[i] - axis + room[i][1]) for i in order]
    return {i: at[i] - axis for i in order}, max(need, default=0.0)


def _inlet_room(node: LayoutNode, i: int) -> float:
    """Height of the slot of an arrow that enters a block."""
    return 2 * GRID if i != EXTERNAL else 2 * _up(node.inlet.h / 2 + 2)


def _centres(plan: LayoutPlan, leave: Heights, half: Sequence[float]) -> list[float]:
    """Heights of the boxes: each is drawn towards its neighbours, in the order of its column."""
    pulls: list[list[tuple[int, float]]] = [[] for _ in plan.nodes]
    stacks: dict[tuple[int, int], list[int]] = {}
    for (n, i), offset in leave.items():
        for t in plan.wires[i].targets if i != EXTERNAL else ():
            if (i, plan.places[t].column) not in plan.channel:
                pulls[t].append((n, offset))
                pulls[n].append((t, -offset))
    for n in sorted(range(len(plan.nodes)), key=lambda n: plan.places[n].share):
        stacks.setdefault((plan.places[n].band, plan.places[n].column), []).append(n)
    y = [0.0] * len(plan.nodes)
    for sweep in range(16):
        for cell in sorted(stacks, reverse=sweep % 2 == 1):
            stack = stacks[cell]
            wish = [fmean([y[m] + d for m, d in pulls[n]] or [y[n]]) for n in stack]
            gaps = [half[a] + half[b] + ROW_GAP for a, b in pairwise(stack)]
            for n, value in zip(stack, _spread(wish, gaps), strict=True):
                y[n] = value
    return [GRID * floor(round(value, 6) / GRID + 0.5) for value in y]


def _spread(wish: Sequence[float], gaps: Sequence[float]) -> list[float]:
    """Increasing values near `wish` with at least `gaps` between them."""
    down, up = list(wish), list(wish)
    for k, gap in enumerate(gaps):
        down[k + 1] = max(down[k + 1], down[k] + gap)
    for k in reversed(range(len(gaps))):
        up[k] = min(up[k], up[k + 1] - gaps[k])
    return [(a + b) / 2 for a, b in zip(down, up, strict=True)]


def _bands(
    plan: LayoutPlan, centre: Sequence[float], half: Sequence[float]
) -> tuple[list[float], dict[tuple[int, int], float], float]:
    """Shift of each band down the page, heights of the channels' lanes, height of the page."""
    bands = 1 + max(place.band for place in plan.places)
    y, shift, lane_y = 0.0, [], {}
    for k in range(bands + 1):
        rows = {key: row for key, row in plan.lane.items() if key[1] == k}
        depth = (max(rows.values()) + 1) * LANE_WIDTH + ROW_GAP / 2 if rows else 0.0
        depth = _up(max(ROW_GAP, depth + ROW_GAP / 2) if 0 < k < bands else depth)
        for key, row in rows.items():
            inset = ROW_GAP / 2 + row * LANE_WIDTH
            lane_y[key] = y + (depth - inset if k == 0 else inset)
        y += depth
        if k < bands:
            members = [n for n, place in enumerate(plan.places) if place.band == k]
            shift.append(y - min(centre[n] - half[n] for n in members))
            y = shift[k] + max(centre[n] + half[n] for n in members)
    return shift, lane_y, y


def _half_for_inlets(plan: LayoutPlan, n: int) -> float:
    """Half the height of a box in which the main inlets stand on the axis."""
    room: dict[int, float] = {-2: 0.0, -1: 0.0, 0: 0.0, 2: 0.0}
    for i, (way, _) in plan.inlets[n].items():
        room[way] += _inlet_room(plan.nodes[n], i)
    if not room[0] and not room[-1]:  # only arrows from the channels
        return (room[-2] + room[2]) / 2 + GRID
    above, middle = (room[-2] + room[-1], room[0]) if room[0] else (room[-2], room[-1])
    return max(above, room[2]) + middle / 2 + GRID


def _straightened(
    plan: LayoutPlan, centre: Sequence[float], half: Sequence[float], offset: Heights
) -> list[float]:
    """Centres moved a little where that turns a bent arrow into a straight one."""
    cell = [(place.band, place.column) for place in plan.places]
    blocks = sorted(range(len(cell)), key=cell.__getitem__)

    def badness(y: Sequence[float], n: int) -> float:
        """Bent arrows near block `n`; infinite if boxes come too close."""
        band, column = cell[n]
        total, leave = 0.0, {(m, i): y[m] + d for (m, i), d in offset.items()}
        for t in [m for m in blocks if cell[m] in ((band, column), (band, column + 1))]:
            for m in blocks:
                if m != t and cell[m] == cell[t] and abs(y[m] - y[t]) < half[m] + half[t] + ROW_GAP:
                    return inf
            for i, at in _inlets(plan, t, y[t], half[t], leave).items():
                if plan.inlets[t][i] == (0, 0) and at != leave[plan.wires[i].source, i]:
                    total += 1 + abs(at - leave[plan.wires[i].source, i]) / 100
        return total

    y = list(centre)
    for n in blocks * 2:
        behind = {n, *(m for m in blocks if cell[m][0] == cell[n][0] and cell[m] > cell[n])}
        if badness(y, n):
            trials = [
                [value + shift * (m in group) for m, value in enumerate(y)]
                for shift in (0, -8, 8, -16, 16, -24, 24, -32, 32)
                for group in ({n}, behind)
            ]
            y = min(trials, key=lambda trial: badness(trial, n))
    return y


def _inlets(
    plan: LayoutPlan, n: int, centre: float, half: float, leave: Heights
) -> dict[int, float]:
    """Heights of the arrows into a block: straight ones if possible, never at a rival's height."""
    rank = plan.inlets[n]
    wish = {i: leave[plan.wires[i].source, i] for i, group in rank.items() if group == (0, 0)}
    order = sorted(rank, key=lambda i: (rank[i], wish.get(i, 0.0), i))
    room = {i: _inlet_room(plan.nodes[n], i) for i in order}
    if order and not wish:
        wish[EXTERNAL if EXTERNAL in rank else order[len(order) // 2]] = centre
    for above, below in reversed(list(pairwise(order))):
        if below in wish:
            wish.setdefault(above, wish[below] - (room[above] + room[below]) / 2)
    for above, below in pairwise(order):
        wish.setdefault(below, wish[above] + (room[above] + room[below]) / 2)
    place, taken = plan.places[n], {}
    for (m, i), y in leave.items():
        other = plan.places[m]
        if i != EXTERNAL and (other.band, other.column) == (place.band, place.column - 1):
            taken[y] = i
    low, rest, at = centre - half, sum(room.values()), {}
    for i in order:
        rest -= room[i]
        high = centre + half - rest - room[i] / 2 - GRID
        y = max(_up(low + room[i] / 2), min(high, GRID * round(wish[i] / GRID)))
        at[i] = y + GRID / 2 if i != EXTERNAL and taken.get(y, i) != i else y
        low = at[i] + room[i] / 2 - GRID / 2
    return at


def all_heights(plan: LayoutPlan) -> HeightMap:
    """All vertical coordinates of a diagram."""
    offset: dict[tuple[int, int], float] = {}
    half: list[float] = []
    for n, node in enumerate(plan.nodes):
        outlets, need = _outlets(plan, n)
        offset |= {(n, i): d for i, d in outlets.items()}
        half.append(_up(max(need, node.h / 2, _half_for_inlets(plan, n))))
    centre = _straightened(plan, _centres(plan, offset, half), half, offset)
    shift, lane, total = _bands(plan, centre, half)
    centre = [y + shift[place.band] for y, place in zip(centre, plan.places, strict=True)]
    leave = {(n, i): centre[n] + d for (n, i), d in offset.items()}
    enter = {
        (n, i): y
        for n in range(len(plan.nodes))
        for i, y in _inlets(plan, n, centre[n], half[n], leave).items()
    }
    return HeightMap(centre, half, leave, enter, lane, total)

"""Geometry of a block diagram: where the boxes stand and how the arrows run between them.

Pure functions of sizes and connections, in points, x to the right and y downwards.  Boxes stand in
columns in signal-flow order; gutter ``g`` is the free strip left of column ``g``.  A diagram too
wide for the page continues in the next band, like text; channel ``k`` is the free strip above band
``k``.  Arrows run in gutters and channels only, so none can pass through a box.  Outlets stand on
multiples of `GRID`, a bent inlet never at the height of another wire's outlet, and every wire has
its own vertical lane in each gutter, so no two wires ever lie on top of one another.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, floor, inf
from statistics import fmean

from .order import LayoutPlan, layers, make_plan, side
from .records import (
    APART,
    EXTERNAL,
    GRID,
    LANE_WIDTH,
    ROW_GAP,
    STUB,
    BlockFrame,
    Heights,
    Label,
    Layout,
    LayoutNode,
    Route,
    Wire,
)


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


@dataclass(frozen=True)
class _Gutter:
    """Horizontal coordinates of a gutter: names up to `start`, lanes, last stretch to `right`."""

    left: float
    start: float
    lanes: Mapping[int, float]
    right: float


def _joints(
    plan: LayoutPlan, heights: HeightMap, g: int
) -> dict[int, tuple[set[float], set[float]]]:
    """Heights at which each wire meets its lane in gutter `g` from the left and the right."""
    joints: dict[int, tuple[set[float], set[float]]] = {}
    for (n, i), y in heights.leave.items():
        if i != EXTERNAL and plan.places[n].column + 1 == g:
            joints.setdefault(i, (set(), set()))[0].add(y)
    for (n, i), y in heights.enter.items():
        if i != EXTERNAL and plan.places[n].column == g:
            joints.setdefault(i, (set(), set()))[1].add(y)
    for (i, k), gutters in plan.spans.items():
        if g in gutters:
            left, right = joints.setdefault(i, (set(), set()))
            left |= {heights.lane[i, k]} if g > gutters[0] else set()
            right |= {heights.lane[i, k]} if g < gutters[-1] else set()
    return joints


def _lanes_in_gutter(joints: Mapping[int, tuple[set[float], set[float]]]) -> dict[int, int]:
    """Lanes, from left to right, of the wires that need one, in an order with few crossings."""
    span = {i: (min(a | b), max(a | b)) for i, (a, b) in joints.items() if len(a | b) > 1}

    def crossings(a: int, b: int) -> int:  # of lane a left of lane b
        return sum(span[a][0] <= y <= span[a][1] for y in joints[b][0]) + sum(
            span[b][0] <= y <= span[b][1] for y in joints[a][1]
        )

    order = sorted(span)
    for _ in range(len(order)):
        for k in range(len(order) - 1):
            a, b = order[k : k + 2]
            if crossings(b, a) < crossings(a, b):
                order[k : k + 2] = b, a
    lane: dict[int, int] = {}
    for i in order:  # wires that are far apart share a lane
        near = [
            m for m in lane if span[m][0] - APART < span[i][1] and span[i][0] < span[m][1] + APART
        ]
        lane[i] = 1 + max((lane[m] for m in near), default=-1)
    return lane


def _run(lane: Mapping[int, int]) -> float:
    """Width of the lanes of a gutter."""
    return LANE_WIDTH * (1 + max(lane.values(), default=-1))


def _gutters(plan: LayoutPlan, heights: HeightMap, widths: Sequence[float], page: float):
    """Horizontal coordinates, with the space left over on the page given to the gutters."""
    last, parts = len(widths), []
    for g in range(last + 1):
        before = [n for n, place in enumerate(plan.places) if place.column == g - 1]
        behind = [n for n, place in enumerate(plan.places) if place.column == g]
        lead = [wire.label.w + 14 for wire in plan.wires if wire.source in before]
        tail = [STUB for (n, i) in heights.enter if i != EXTERNAL and n in behind] + [0.0]
        names_out = [plan.nodes[n].outlet.w for n in before if plan.nodes[n].outlet.text]
        names_in = [plan.nodes[n].inlet.w for n in behind if plan.nodes[n].inlet.text]
        # The outermost gutters have the names outside of the lanes, so that signals come
        # from outside the feedback loops; elsewhere a name stands right at its block.
        (tail if g == last else lead).extend(w + STUB + 10 for w in names_out)
        (lead if g == 0 else tail).extend(w + (6 if g == 0 else STUB + 10) for w in names_in)
        tail += [STUB] if g == 0 and names_in else []
        parts.append(
            (max(lead, default=0.0), _lanes_in_gutter(_joints(plan, heights, g)), max(tail))
        )
    natural = sum(widths) + sum(lead + _run(lane) + tail for lead, lane, tail in parts)
    slack = min(40.0, max(0.0, page - natural) / max(1, last - 1))
    x, gutters = 0.0, []
    for g, (lead, lane, tail) in enumerate(parts):
        start = x + lead + (slack if 0 < g < last else 0.0)
        lanes = {i: start + (k + 0.5) * LANE_WIDTH for i, k in lane.items()}
        gutters.append(_Gutter(x, start, lanes, start + _run(lane) + tail))
        x = gutters[-1].right + (widths[g] if g < last else 0.0)
    return gutters


def _path(plan: LayoutPlan, heights: HeightMap, gutters: Sequence[_Gutter], i: int, t: int):
    """Corners of wire `i` from its source to target `t`."""
    source, column = plan.wires[i].source, plan.places[t].column
    first, final = gutters[plan.places[source].column + 1], gutters[column]
    start, end = (first.left, heights.leave[source, i]), (final.right, heights.enter[t, i])
    out, back = first.lanes.get(i, first.left), final.lanes.get(i, first.left)
    k = plan.channel.get((i, column))
    through = [] if k is None else [(out, heights.lane[i, k]), (back, heights.lane[i, k])]
    corners = [start]
    for point in [(out, start[1]), *through, (back, end[1]), end]:
        if len(corners) > 1 and any(
            corners[-2][axis] == corners[-1][axis] == point[axis] for axis in (0, 1)
        ):
            corners.pop()
        if point != corners[-1]:
            corners.append(point)
    return tuple(corners)


def _wire_routes(plan: LayoutPlan, heights: HeightMap, gutters: Sequence[_Gutter]) -> list[Route]:
    """Arrows between blocks; the name stands above the first stretch."""
    routes = []
    for i, wire in enumerate(plan.wires):
        gutter = gutters[plan.places[wire.source].column + 1]
        for t in wire.targets:
            points, text, label = _path(plan, heights, gutters, i, t), wire.label, None
            if t == wire.targets[0]:
                clear = not gutter.lanes and gutter.right - gutter.start <= STUB
                end = gutter.right - STUB / 2 if clear else gutter.start
                x = (gutter.left + end - text.w) / 2
                label = Label(x, points[0][1] - 3 - text.h, text)
            routes.append(Route(points, label, wire.source, t, i))
    return routes


def _outside_routes(
    plan: LayoutPlan, heights: HeightMap, gutters: Sequence[_Gutter]
) -> list[Route]:
    """Short arrows for the external inputs and outputs of each block."""
    routes = []
    for n, node in enumerate(plan.nodes):
        before, behind = gutters[plan.places[n].column], gutters[plan.places[n].column + 1]
        if node.inlet.text:
            y, text = heights.enter[n, EXTERNAL], node.inlet
            x = before.start if before is gutters[0] else before.right - STUB
            label = Label(x - 4 - text.w, y - text.h / 2, text)
            routes.append(Route(((x, y), (before.right, y)), label, None, n))
        if node.outlet.text:
            y, text, outermost = heights.leave[n, EXTERNAL], node.outlet, behind is gutters[-1]
            x = max([behind.start, *behind.lanes.values()]) if outermost else behind.left
            label = Label(x + STUB + 4, y - text.h / 2, text)
            routes.append(Route(((behind.left, y), (x + STUB, y)), label, n, None))
    return routes


def _dots(plan: LayoutPlan, heights: HeightMap, gutters: Sequence[_Gutter]):
    """Points where at least three stretches of one wire meet."""
    dots = []
    for g, gutter in enumerate(gutters):
        for i, (left, right) in _joints(plan, heights, g).items():
            ends = min(left | right), max(left | right)
            dots += [
                (gutter.lanes[i], y)
                for y in sorted(left | right)
                if (y in left) + (y in right) + (y > ends[0]) + (y < ends[1]) > 2
            ]
    return tuple(dots)


def arrange(nodes: Sequence[LayoutNode], wires: Sequence[Wire], page: float = 624.0) -> Layout:
    """Place the blocks of a diagram and route its wires."""
    if not nodes:
        return Layout(0.0, 0.0, (), (), ())
    links = {(wire.source, t) for wire in wires for t in wire.targets}
    ordered = layers(len(nodes), links, {n for n, node in enumerate(nodes) if node.inlet.text})
    tries = []
    for columns in sorted(
        {ceil(len(ordered) / (n + 1)) for n in range(len(ordered))}, reverse=True
    ):
        tries.append(_fitted(make_plan(nodes, wires, ordered, columns), page))
        if tries[-1].width <= page + 1:  # the room left over was handed out, up to rounding
            break
    return min(tries, key=lambda layout: max(layout.width, page + 1))


def _fitted(plan: LayoutPlan, page: float) -> Layout:
    """Coordinates for a plan."""
    columns = range(1 + max(place.column for place in plan.places))
    cells = list(zip(plan.nodes, plan.places, strict=True))
    widths = [max(node.w for node, place in cells if place.column == c) for c in columns]
    heights = all_heights(plan)
    gutters = _gutters(plan, heights, widths, page)
    boxes = tuple(
        BlockFrame(gutters[place.column].right, y - half, widths[place.column], 2 * half)
        for y, half, place in zip(heights.centre, heights.half, plan.places, strict=True)
    )
    routes = _wire_routes(plan, heights, gutters) + _outside_routes(plan, heights, gutters)
    dots = _dots(plan, heights, gutters)
    return Layout(gutters[-1].right, heights.total, boxes, tuple(routes), dots)

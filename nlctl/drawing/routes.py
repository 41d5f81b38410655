"""Geometry of a block diagram: where the boxes stand and how the arrows run between them.

Pure functions of sizes and connections, in points, x to the right and y downwards.  Boxes stand in
columns in signal-flow order; gutter ``g`` is the free strip left of column ``g``.  A diagram too
wide for the page continues in the next band, like text; channel ``k`` is the free strip above band
``k``.  Arrows run in gutters and channels only, so none can pass through a box.  Outlets stand on
multiples of `GRID`, a bent inlet never at the height of another wire's outlet, and every wire has
its own vertical lane in each gutter, so no two wires ever lie on top of one another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil

from .heights import HeightMap, all_heights
from .order import LayoutPlan, layers, make_plan
from .records import (
    APART,
    EXTERNAL,
    LANE_WIDTH,
    STUB,
    BlockFrame,
    Label,
    Layout,
    LayoutNode,
    Route,
    Wire,
)


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

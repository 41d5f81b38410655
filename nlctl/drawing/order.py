"""Order of the blocks, and the strips of the page that the arrows use; see `routes`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from statistics import fmean

from .records import EXTERNAL, GridCell, LayoutNode, Links, Wire


@dataclass(frozen=True)
class LayoutPlan:
    """All that is decided before the first coordinate.

    ``channel[wire, gutter]`` is the channel that brings a wire to a gutter other than the one it
    starts in, ``spans[wire, channel]`` the gutters it connects, ``lane[wire, channel]`` its place
    in the channel, 0 nearest to the boxes.  ``inlets[block][wire]`` orders the arrows into a block
    from top to bottom; it is (0, 0) for those straight from the column before.
    """

    nodes: Sequence[LayoutNode]
    wires: Sequence[Wire]
    places: Sequence[GridCell]
    channel: Mapping[tuple[int, int], int]
    spans: Mapping[tuple[int, int], Sequence[int]]
    lane: Mapping[tuple[int, int], int]
    inlets: Sequence[Mapping[int, tuple[int, int]]]


def forward_links(count: int, links: Links, entries: set[int]) -> Links:
    """Links without those that close a loop."""
    # These are found by depth-first search or are those against the order of the blocks, whichever
    # are fewer, or else close more loops where the signals enter them, or make a shorter diagram.
    reach = {n: {t for s, t in links if s == n} for n in range(count)}
    for middle in range(count):
        for n in range(count):
            reach[n] |= reach[middle] if middle in reach[n] else set()
    ports = entries | {t for s, t in links if s not in reach[t]}

    def faults(kept: Links) -> tuple[int, int, int]:
        cut = links - kept
        return len(cut), sum(t not in ports for _, t in cut), max(_ranks(count, kept))

    listed = {(s, t) for s, t in links if s < t or s not in reach[t]}
    return min((_searched_links(count, links, entries), listed), key=faults)


def _searched_links(count: int, links: Links, entries: set[int]) -> Links:
    """Links that a search does not follow back into its own path."""
    # It starts at blocks that no block feeds, then at those with external inputs.
    fed = {target for source, target in links if source != target}
    followers = [sorted(t for s, t in links if s == node) for node in range(count)]
    seen: set[int] = set()
    kept: Links = set()
    for root in sorted(range(count), key=lambda n: (n in fed, n not in entries, n)):
        path = [] if root in seen else [(root, iter(followers[root]))]
        seen.add(root)
        while path:
            node, untried = path[-1]
            follower = next(untried, None)
            if follower is None:
                path.pop()
            elif all(follower != member for member, _ in path):
                kept.add((node, follower))
                if follower not in seen:
                    seen.add(follower)
                    path.append((follower, iter(followers[follower])))
    return kept


def _ranks(count: int, kept: Links) -> list[int]:
    """Longest path to each block; a source stands just before its first receiver."""
    before = {n: {s for s, t in kept if t == n} for n in range(count)}
    rank = [0] * count
    for n in TopologicalSorter(before).static_order():
        rank[n] = max((rank[s] + 1 for s in before[n]), default=0)
    return [
        rank[n] if before[n] else min((rank[t] - 1 for s, t in kept if s == n), default=0)
        for n in range(count)
    ]


def layers(count: int, links: Links, entries: set[int]) -> list[list[int]]:
    """Blocks by longest path from a source; barycentres order the blocks of a layer."""
    kept = forward_links(count, links, entries)
    near = {
        n: sorted({s for s, t in kept if t == n} | {t for s, t in kept if s == n})
        for n in range(count)
    }
    rank = _ranks(count, kept)
    ordered = [[n for n in range(count) if rank[n] == r] for r in sorted(set(rank))]
    for sweep in range(4):
        for layer in ordered[:: 1 - 2 * (sweep % 2)]:
            share = {n: (i + 0.5) / len(row) for row in ordered for i, n in enumerate(row)}
            pull = {n: fmean([share[m] for m in near[n]] or [share[n]]) for n in layer}
            layer.sort(key=pull.__getitem__)
    return ordered


def make_plan(
    nodes: Sequence[LayoutNode],
    wires: Sequence[Wire],
    ordered: Sequence[Sequence[int]],
    columns: int,
) -> LayoutPlan:
    """Write the layers into bands of `columns` each and choose the arrows' channels."""
    cells = {
        n: GridCell(rank // columns, rank % columns, (row + 0.5) / len(layer))
        for rank, layer in enumerate(ordered)
        for row, n in enumerate(layer)
    }
    places = [cells[n] for n in range(len(nodes))]
    channel = _channels(wires, places)
    spans = _spans(wires, places, channel)
    inlets: list[dict[int, tuple[int, int]]] = [
        {EXTERNAL: (-1, 0)} if node.inlet.text else {} for node in nodes
    ]
    for i, wire in enumerate(wires):
        home = places[wire.source]
        for t in wire.targets:
            way = side(places[t], home, channel.get((i, places[t].column)))
            inlets[t][i] = (2 * way, -way * abs(places[t].column - home.column - 1))
    return LayoutPlan(nodes, wires, places, channel, spans, _lanes(spans), inlets)


def _channels(wires: Sequence[Wire], places: Sequence[GridCell]) -> dict[tuple[int, int], int]:
    """Channels: feedback runs below the boxes, feedforward above, unless the way is far."""
    # Between bands, a wire changes height at the outer edge of the diagram where it can.
    channel: dict[tuple[int, int], int] = {}
    for i, wire in enumerate(wires):
        home = places[wire.source]
        for goal in (places[t] for t in wire.targets if places[t].column != home.column + 1):
            if goal.band != home.band and goal.column == 0:
                choice = home.band + 1
            elif goal.band != home.band:
                choice = goal.band + (goal.band < home.band)
            else:
                tie = 0.499 if goal.column <= home.column else 0.501
                choice = home.band + ((home.share + goal.share) / 2 > tie)
            channel.setdefault((i, goal.column), choice)
    return channel


def _spans(
    wires: Sequence[Wire], places: Sequence[GridCell], channel: Mapping[tuple[int, int], int]
) -> dict[tuple[int, int], list[int]]:
    """Gutters, from left to right, that ``[wire, channel]`` connects."""
    joined: dict[tuple[int, int], set[int]] = {}
    for (i, gutter), k in channel.items():
        joined.setdefault((i, k), {places[wires[i].source].column + 1}).add(gutter)
    return {key: sorted(gutters) for key, gutters in joined.items()}


def _lanes(joined: Mapping[tuple[int, int], list[int]]) -> dict[tuple[int, int], int]:
    """Lanes in the channels: the shorter the run, the nearer to the boxes."""
    lane: dict[tuple[int, int], int] = {}
    for key in sorted(joined, key=lambda key: (joined[key][-1] - joined[key][0], key)):
        rivals = {
            lane[other]
            for other in lane
            if other[1] == key[1]
            and joined[other][0] <= joined[key][-1]
            and joined[key][0] <= joined[other][-1]
        }
        lane[key] = min(set(range(len(lane) + 1)) - rivals)
    return lane


def side(place: GridCell, other: GridCell, channel: int | None) -> int:
    """-1, 0 or 1: at `place` the wire to or from `other` runs up, straight across, or down."""
    if channel is not None:
        return 1 if channel > place.band else -1
    return (other.band > place.band) - (other.band < place.band)

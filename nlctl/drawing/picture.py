"""Block diagrams of python-control interconnections, drawn as in a control textbook.

`signal_graph` reads what is connected to what, `lay_out` places it (see `nlctl.drawing.routes`),
`draw` paints it.
"""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any, cast

import control as ct
import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle

from ..annotations import as_annotated
from ..blocks import Block
from ..upstream.systems import System
from ..wording import counted
from .records import (
    FONT,
    BlockFrame,
    Layout,
    LayoutNode,
    Route,
    Text,
    Wire,
    bundle,
    measured_text,
    strokes,
)
from .routes import arrange

_WIDTH, MARGIN = 648.0, 12.0  # of the figure, in points
_NAME, _SMALL, TITLE = 9.0, 8.0, 11.0  # type sizes
INK, WIRE_GREY, FILL = "#16202b", "#5c6670", "#f0f3f7"


@dataclass(frozen=True)
class _Block:
    """A subsystem as it is shown: its name, what it is, its signals."""

    name: str
    kind: str
    nested: bool
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


@dataclass(frozen=True)
class _Signal:
    """One entry of a connection map: ``gain`` times port `output` goes to port `input`.

    `text` is how it is written on the arrow.  Ports count within their block (or among the
    external signals of the diagram); an external output that taps an input of a block has an
    `output` past the block's outputs.
    """

    text: str
    gain: float
    output: int
    input: int


@dataclass(frozen=True)
class _Edge:
    """All signals from block `source` to block `target`; None stands for the outside."""

    source: int | None
    target: int | None
    signals: tuple[_Signal, ...]


def signal_graph(diagram: ct.InterconnectedSystem) -> tuple[tuple[_Block, ...], tuple[_Edge, ...]]:
    """Read the blocks of a diagram and the signals between them."""
    if not isinstance(diagram, ct.InterconnectedSystem):
        raise TypeError(
            f"cannot draw a {type(diagram).__name__}: pass a diagram (InterconnectedSystem), for "
            "example what nlctl.interconnect or control.interconnect returns"
        )
    names = {i: name for name, i in diagram.syslist_index.items()}
    blocks = tuple(
        _block(system, names.get(i, system.name)) for i, system in enumerate(diagram.syslist)
    )
    inputs = [(n, i, label) for n, b in enumerate(blocks) for i, label in enumerate(b.inputs)]
    outputs = [(n, i, label) for n, b in enumerate(blocks) for i, label in enumerate(b.outputs)]
    taps = outputs + [(n, len(blocks[n].outputs) + i, label) for n, i, label in inputs]
    enter = [(None, i, label) for i, label in enumerate(diagram.input_labels)]
    leave = [(None, i, label) for i, label in enumerate(diagram.output_labels)]
    edges = _edges(diagram.connect_map, outputs, inputs)
    edges += _edges(diagram.input_map, enter, inputs) + _edges(diagram.output_map, taps, leave)
    return blocks, tuple(edges)


def _block(system: System, name: str) -> _Block:
    nested = isinstance(system, ct.InterconnectedSystem)
    signals = tuple(system.input_labels), tuple(system.output_labels)
    return _Block(name, _kind(system), nested, *signals)


def _kind(system: System) -> str:
    """What a block is, in a word; a static sum or gain as its formula."""
    if isinstance(system, ct.InterconnectedSystem):
        return counted(len(system.syslist), "block")
    if isinstance(system, Block):
        return type(system.spec).__name__
    if not isinstance(system, ct.StateSpace):
        return ""
    if system.nstates:
        transfer = "G(z)" if system.isdtime(strict=True) else "G(s)"
        return transfer if system.ninputs == system.noutputs == 1 else "state space"
    if system.noutputs != 1 or system.ninputs > 4:
        return "static gain"
    gains = zip(system.D[0], system.input_labels, strict=True)
    return " + ".join(_times(g, label) for g, label in gains if g).replace("+ -", "- ") or "0"


def _times(gain: float, name: str) -> str:
    return name if gain == 1 else f"-{name}" if gain == -1 else f"{gain:g} {name}"


def _edges(gains: np.ndarray, sources: Sequence[Any], targets: Sequence[Any]) -> list[_Edge]:
    """Bundle the non-zero `gains` (targets by sources) by the blocks that they join."""
    bundles: dict[tuple[int | None, int | None], list[_Signal]] = {}
    for column, row in np.argwhere(np.asarray(gains).T):
        (source, output, name), (target, port, label) = sources[column], targets[row]
        gain = float(gains[row, column])
        text = _times(gain, name)
        if target is None:  # an external output has a name of its own
            alone = np.count_nonzero(gains[row]) == 1
            text = label if gain == 1 and alone else f"{label} = {text}" + " + ..." * (not alone)
        bundles.setdefault((source, target), []).append(_Signal(text, gain, output, port))
    return [_Edge(*ends, tuple(signals)) for ends, signals in bundles.items()]


def lay_out(diagram: ct.InterconnectedSystem) -> Layout:
    """Place a diagram on paper, in points; `draw` paints exactly this."""
    blocks, edges = signal_graph(diagram)
    outside: dict[tuple[str, int | None], Sequence[str]] = {}
    targets: dict[tuple[int, Sequence[str]], list[int]] = {}
    for edge in edges:
        names = tuple(dict.fromkeys(signal.text for signal in edge.signals))
        if edge.source is not None and edge.target is not None:
            targets.setdefault((edge.source, names), []).append(edge.target)
        else:
            outside[("in", edge.target) if edge.source is None else ("out", edge.source)] = names
    nodes = []
    for n, block in enumerate(blocks):
        name, kind = measured_text(block.name, _NAME, "bold"), measured_text(block.kind, _SMALL)
        ends = [measured_text(bundle(outside.get((way, n), ())), _SMALL) for way in ("in", "out")]
        nodes.append(LayoutNode(max(name.w + 16, kind.w + 16, 56.0), name.h + kind.h + 16, *ends))
    wires = [
        Wire(source, tuple(ends), measured_text(bundle(names), _SMALL))
        for (source, names), ends in targets.items()
    ]
    return arrange(nodes, wires, _WIDTH - 2 * MARGIN)


@as_annotated
def draw(
    diagram: ct.InterconnectedSystem, *, title: str | None = None, expand: bool = False
) -> "Drawing":
    """Draw a block diagram, in the order of the signal flow from left to right.

    Signals between the same two blocks share an arrow; ``-y`` and ``2 y`` carry their gain.
    Feedback runs below the boxes, feedforward above, external signals are grey.  A dot marks
    where an arrow branches; lines that cross without a dot are not connected.

    Parameters
    ----------
    diagram : control.InterconnectedSystem
        Any diagram made with `nlctl.interconnect`, `control.interconnect`, `control.feedback`
        of nonlinear systems, ...
    title : str, optional
        Above the drawing; none by default.
    expand : bool, optional
        Show what is inside nested diagrams, each in a panel of its own below.

    Returns
    -------
    Drawing
        A `matplotlib.figure.Figure`, 9 inches wide or as wide as the diagram needs, that shows
        itself in a notebook; save it with ``figure.savefig("loop.svg")``.

    Raises
    ------
    TypeError
        If `diagram` is not an interconnection of blocks.

    Examples
    --------
    >>> figure = nlctl.draw(nlctl.paper.example_1(), title="Example 1")
    >>> round(float(figure.get_figwidth()), 6)  # inches; figure.savefig("loop.svg") keeps it
    9.0
    """
    panels = list(_panels(diagram, title or "", "", expand))
    width = max([_WIDTH, *(panel.layout.width + 2 * MARGIN for panel in panels)])
    height = sum(panel.height for panel in panels)
    figure = Drawing(figsize=(width / 72, height / 72), facecolor="white")
    bottom = height
    for panel in panels:
        bottom -= panel.height
        axes = figure.add_axes((0, bottom / height, 1, panel.height / height))
        _paint(axes, panel, width, framed=panel is not panels[0])
    return figure


@dataclass(frozen=True)
class _Panel:
    """One diagram of a figure with the words above it."""

    head: str
    blocks: tuple[_Block, ...]
    layout: Layout

    @property
    def height(self) -> float:
        return self.layout.height + 2 * MARGIN + (2 * TITLE if self.head else 0.0)


def _panels(diagram: Any, head: str, path: str, expand: bool) -> Iterator[_Panel]:
    """The diagram and, if asked for, those nested in it."""
    blocks, _ = signal_graph(diagram)
    yield _Panel(head, blocks, lay_out(diagram))
    for block, system in zip(blocks, diagram.syslist, strict=True):
        if expand and block.nested:
            yield from _panels(system, f"inside {path}{block.name}", f"{path}{block.name}.", True)


def _paint(axes: Axes, panel: _Panel, width: float, *, framed: bool) -> None:
    """Put a panel on paper; the units of the axes are points, from where the layout begins."""
    left, bottom = (panel.layout.width - width) / 2, panel.layout.height + MARGIN
    top = bottom - panel.height
    axes.set(xlim=(left, left + width), ylim=(bottom, top))
    axes.set_axis_off()
    if framed:
        frame = Rectangle((left + 4, top + 2), width - 8, panel.height - 4)
        frame.set(fill=False, edgecolor=WIRE_GREY, linewidth=0.6)
        axes.add_patch(frame)
    _write(axes, left + MARGIN, top + MARGIN, Text(panel.head), TITLE, weight="bold", ha="left")
    for wire, routes in groupby(panel.layout.routes, key=lambda route: route.wire):
        _paint_wire(axes, list(routes), WIRE_GREY if wire is None else INK)
    for dot in panel.layout.dots:
        axes.add_patch(Circle(dot, 2.2, color=INK, linewidth=0, zorder=3))
    for block, box in zip(panel.blocks, panel.layout.boxes, strict=True):
        _paint_box(axes, block, box)


def _paint_wire(axes: Axes, routes: Sequence[Route], colour: str) -> None:
    """The arrows of one wire with their name; every arrow ends to the right, at a box."""
    shafts = []
    for route in routes:
        *corners, (x, y) = route.points
        shafts.append(replace(route, points=(*corners, (x - 5, y))))
        head = Polygon([(x, y), (x - 7, y - 2.7), (x - 7, y + 2.7)])
        head.set(facecolor=colour, linewidth=0, zorder=3)
        axes.add_patch(head)
        if label := route.label:
            _write(axes, label.x, label.y, label.text, _SMALL, color=colour)
    style = {"colors": colour, "linewidths": 1.0, "capstyle": "projecting"}
    axes.add_collection(LineCollection(strokes(shafts), **style), autolim=False)


def _paint_box(axes: Axes, block: _Block, box: BlockFrame) -> None:
    """A box with its name and kind in the middle; a double line where there is more inside."""
    for inset in (0.0, 2.5)[: 1 + block.nested]:
        outline = Rectangle((box.x + inset, box.y + inset), box.w - 2 * inset, box.h - 2 * inset)
        outline.set(facecolor=FILL, edgecolor=INK, linewidth=1.2 - 0.2 * inset, zorder=2)
        axes.add_patch(outline)
    name, kind = measured_text(block.name, _NAME, "bold"), measured_text(block.kind, _SMALL)
    middle, top = box.x + box.w / 2, box.y + (box.h - name.h - kind.h) / 2
    _write(axes, middle - name.w / 2, top, name, _NAME, weight="bold")
    _write(axes, middle - kind.w / 2, top + name.h, kind, _SMALL, color=WIRE_GREY)


def _write(
    axes: Axes, x: float, y: float, text: Text, size: float, *, color: str = INK, **style: Any
) -> None:
    """Write lines of text below and right of `x, y`; every character is literal."""
    style = {"ha": "center", "family": FONT, "color": color} | style
    for k, line in enumerate(text.text.split("\n") if text.text else ()):
        baseline = y + (1.25 * k + 0.97) * size
        written = axes.text(x + text.w / 2, baseline, line, size=size, zorder=4, **style)
        written.set(parse_math=False, usetex=False)


class Drawing(Figure):
    """A matplotlib figure that a notebook shows as SVG, whatever backend is active.

    The same drawing gives the same bytes, so that notebooks under version control stay quiet.
    """

    def set_layout_engine(self, layout: object = None, **kwargs: object) -> None:
        """Choose how axes are arranged; everything has its place, so by default not at all."""
        # Matplotlib restores "none" as None behind a save, and takes that from its settings.
        chosen = cast(Any, "none" if layout is None else layout)
        super().set_layout_engine(chosen, **kwargs)

    def _repr_svg_(self) -> str:
        buffer = io.StringIO()
        with mpl.rc_context({"svg.hashsalt": "nlctl", "svg.fonttype": "path"}):
            self.savefig(buffer, format="svg", metadata={"Date": None})
        text = buffer.getvalue()
        return text[text.index("<svg") :]

    def _repr_html_(self) -> str:
        """The same within a box that scrolls, so that a wide diagram stays legible."""
        return f'<div style="overflow-x:auto">{self._repr_svg_()}</div>'

"""The block-diagram drawer: the graph is the diagram's, the geometry keeps its promises."""

from __future__ import annotations

import io
import itertools
from concurrent.futures import ThreadPoolExecutor
from xml.etree import ElementTree

import control as ct
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from rows import each_row

import nlctl
from nlctl.drawing.picture import draw, lay_out, signal_graph


def block(name, inputs, outputs):
    """A static block; only its names matter here."""
    return ct.nlsys(
        None,
        lambda t, x, u, params: np.zeros(len(outputs)),
        inputs=list(inputs) or 0,
        outputs=list(outputs) or 0,
        name=name,
    )


def joined(blocks, *, inputs=(), outputs=(), connections=()):
    return ct.InterconnectedSystem(
        blocks,
        connections=[list(connection) for connection in connections],
        inplist=[[place for place, name in inputs if name == wanted] for wanted in named(inputs)],
        inputs=named(inputs),
        outlist=[place for place, _ in outputs],
        outputs=[name for _, name in outputs],
    )


def named(pairs):
    return list(dict.fromkeys(name for _, name in pairs))


def adaptive_loop():
    """Reference, adaptive controller of five blocks, actuator and plant, as in the paper."""
    psi = [f"psi{i}" for i in range(1, 28)]
    controller = nlctl.interconnect(
        [
            block("filter", ["x1", "x2", "yd", "yd1", "yd2"], ["e", "r", "Y_d"]),
            block("basis", ["x1", "x2"], psi),
            block("weights", ["r", *psi], ["W_psi", "W_norm"]),
            block("robust", ["r"], ["robust", "delta_hat"]),
            block("law", ["r", "W_psi", "robust", "Y_d"], ["u", "zeta"]),
        ],
        inputs=["x1", "x2", "yd", "yd1", "yd2"],
        outputs=["u", "zeta", "delta_hat", "W_norm", "e", "r"],
        name="controller",
    )
    return nlctl.interconnect(
        [
            block("reference", [], ["yd", "yd1", "yd2"]),
            controller,
            block("actuator", ["u"], ["v"]),
            block("plant", ["v"], ["y", "x1", "x2"]),
        ],
        outputs=["y", "yd", "e", "r", "u", "v", "zeta", "delta_hat", "W_norm", "x1", "x2"],
        name="loop",
    )


def cross_coupled():
    """Two loops around a plant in which every input acts on every output."""
    lag = {"C1": "e1 u1", "C2": "e2 u2", "G11": "u1 z11", "G21": "u1 z21", "G12": "u2 z12"}
    lag["G22"] = "u2 z22"
    lags = [
        ct.ss(-1, 1, 1, 0, inputs=ends.split()[0], outputs=ends.split()[1], name=name)
        for name, ends in lag.items()
    ]
    sums = {"sum1": "r1 -y1 e1", "sum2": "r2 -y2 e2"}
    adds = {"add1": "z11 z12 y1", "add2": "z21 z22 y2"}
    first, last = (
        [ct.summing_junction(s.split()[:2], s.split()[2], name=name) for name, s in group.items()]
        for group in (sums, adds)
    )
    return ct.interconnect([*first, *lags, *last], inputs=["r1", "r2"], outputs=["y1", "y2"])


def chain(count):
    """Blocks in a row with negative feedback from the last to the first."""
    blocks = [block(f"stage{k}", [f"s{k}", f"back{k}"], [f"s{k + 1}"]) for k in range(count)]
    links = [(f"stage{k + 1}.s{k + 1}", f"stage{k}.s{k + 1}") for k in range(count - 1)]
    links.append(("stage0.back0", f"-stage{count - 1}.s{count}"))
    end = f"stage{count - 1}.s{count}"
    return joined(blocks, inputs=[("stage0.s0", "r")], outputs=[(end, "y")], connections=links)


def self_loop():
    return joined(
        [block("hold", ["u", "last"], ["y"])],
        inputs=[("hold.u", "u")],
        outputs=[("hold.y", "y")],
        connections=[("hold.last", ("hold", "y", 0.5))],
    )


EXAMPLES = {
    "adaptive loop": adaptive_loop,
    "controller": lambda: adaptive_loop().syslist[1],
    "cross-coupled plant": cross_coupled,
    "chain of 15": lambda: chain(15),
    "feedback of two blocks": lambda: ct.feedback(
        block("plant", ["u"], ["y"]),
        block("sensor", ["y"], ["m"]),  # pyright: ignore[reportArgumentType]
    ),
    "self loop": self_loop,
    "single block": lambda: joined(
        [block("only", ["u"], ["y"])], inputs=[("only.u", "u")], outputs=[("only.y", "y")]
    ),
    "islands": lambda: joined(
        [block("a", ["u"], ["y"]), block("b", [], []), block("c", [], ["z"])]
    ),
    "no blocks": lambda: ct.InterconnectedSystem([], inputs=0, outputs=0),
}


@st.composite
def diagrams(draw_value):
    """Any blocks, any connections, any gains."""
    size = st.integers(0, 3)
    ports = draw_value(st.lists(st.tuples(size, size), min_size=1, max_size=9))
    words = st.sampled_from(["u", "velocity", "W_hat", "x", "a_rather_long_name"])
    word = draw_value(words)
    blocks = [
        block(f"{word}{n}", [f"{word}{i}" for i in range(a)], [f"y{n}{word}{i}" for i in range(b)])
        for n, (a, b) in enumerate(ports)
    ]
    inputs, outputs = sum(a for a, _ in ports), sum(b for _, b in ports)
    outer = draw_value(size), draw_value(size)
    diagram = ct.InterconnectedSystem(blocks, inputs=outer[0], outputs=outer[1])
    gain = st.sampled_from([0, 0, 0, 1, 1, -1, 2.5])

    def matrix(rows, columns):
        values = draw_value(st.lists(gain, min_size=rows * columns, max_size=rows * columns))
        return np.array(values, dtype=float).reshape(rows, columns)

    diagram.connect_map = matrix(inputs, outputs)
    diagram.input_map = matrix(inputs, outer[0])
    diagram.output_map = matrix(outer[1], outputs + inputs)
    return diagram


# --- the graph ---


def assert_graph_is_diagram(diagram):
    blocks, edges = signal_graph(diagram)
    into = np.cumsum([0, *(len(b.inputs) for b in blocks)])
    out = np.cumsum([0, *(len(b.outputs) for b in blocks)])
    connect, enter, leave = (np.zeros_like(m) for m in maps(diagram))
    for edge in edges:
        for signal in edge.signals:
            if edge.source is None:
                enter[into[edge.target] + signal.input, signal.output] += signal.gain
            elif edge.target is not None:
                row, column = into[edge.target] + signal.input, out[edge.source] + signal.output
                connect[row, column] += signal.gain
            else:
                over = signal.output - len(blocks[edge.source].outputs)
                tap = (
                    out[edge.source] + signal.output
                    if over < 0
                    else out[-1] + into[edge.source] + over
                )
                leave[signal.input, tap] += signal.gain
    for found, wanted in zip((connect, enter, leave), maps(diagram), strict=True):
        np.testing.assert_array_equal(found, wanted)
    ends = [(edge.source, edge.target) for edge in edges]
    assert len(ends) == len(set(ends)), "signals between the same blocks must share one edge"


def maps(diagram):
    return diagram.connect_map, diagram.input_map, diagram.output_map


@pytest.mark.parametrize("name", EXAMPLES)
def test_edges_of_examples_are_the_connection_maps(name):
    assert_graph_is_diagram(EXAMPLES[name]())


@given(diagrams())
def test_edges_of_any_diagram_are_the_connection_maps(diagram):
    """One edge per pair of blocks; together they are connect_map, input_map and output_map."""
    assert_graph_is_diagram(diagram)


def test_blocks_say_what_they_are():
    """Record class of nlctl blocks, number of nested blocks, G(s), formula of a static sum."""
    parts = {
        "actuator": nlctl.block(nlctl.DeadZone(), "actuator"),
        "nested": ct.InterconnectedSystem(
            [block("a", [], []), block("b", [], [])], inputs=0, outputs=0
        ),
        "lag": ct.tf([1], [1, 1]),
        "sampled": ct.tf([1], [1, 0.5], True),
        "mimo": ct.rss(2, 2, 2),
        "sum": ct.summing_junction(["r", "-y"], "e"),
        "gain": ct.ss([], [], [], [[2.5]], inputs="u", outputs="v"),
        "function": block("f", [], []),
    }
    kinds = {
        name: signal_graph(ct.InterconnectedSystem([part], inputs=0, outputs=0))[0][0].kind
        for name, part in parts.items()
    }
    assert kinds == {
        "actuator": "DeadZone",
        "nested": "2 blocks",
        "lag": "G(s)",
        "sampled": "G(z)",
        "mimo": "state space",
        "sum": "r - y",
        "gain": "2.5 u",
        "function": "",
    }


# --- the geometry ---


def overlap(a, b, slack=0.0):
    """Whether two rectangles (left, top, right, bottom) share more than a border."""
    return (
        a[0] < b[2] - slack and b[0] < a[2] - slack and a[1] < b[3] - slack and b[1] < a[3] - slack
    )


def rectangle(box):
    return box.x, box.y, box.x + box.w, box.y + box.h


def text_rectangle(label):
    return label.x, label.y, label.x + label.text.w, label.y + label.text.h


def segments(route):
    for (x0, y0), (x1, y1) in itertools.pairwise(route.points):
        yield min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)


def assert_clean(layout):
    boxes = [rectangle(box) for box in layout.boxes]
    stretches = [(route, piece) for route in layout.routes for piece in segments(route)]
    texts = [text_rectangle(route.label) for route in layout.routes if route.label]
    page = (-1e-6, -1e-6, layout.width + 1e-6, layout.height + 1e-6)
    for x0, y0, x1, y1 in [*boxes, *texts, *(piece for _, piece in stretches)]:
        assert page[0] <= x0 <= x1 <= page[2]
        assert page[1] <= y0 <= y1 <= page[3]
    for a, b in itertools.combinations([*boxes, *texts], 2):
        assert not overlap(a, b), "boxes and names must not overlap"
    for route, piece in stretches:
        assert piece[0] == piece[2] or piece[1] == piece[3], "arrows are orthogonal"
        assert not any(overlap(piece, thing, 1e-6) for thing in [*boxes, *texts]), route
    for (one, a), (two, b) in itertools.combinations(stretches, 2):
        if one.wire != two.wire or one.wire is None:
            assert not on_top(a, b), "different wires must not run on top of one another"


def on_top(a, b):
    """Whether two collinear pieces share more than a point."""
    for axis in (0, 1):
        if a[axis] == a[axis + 2] == b[axis] == b[axis + 2]:
            other = 1 - axis
            return min(a[other + 2], b[other + 2]) - max(a[other], b[other]) > 1e-6
    return False


def assert_routes_join_their_blocks(diagram, layout):
    """Every edge has its arrow, from the right side of its source to the left of its target."""
    for route in layout.routes:
        (x0, y0), (x1, y1) = route.points[0], route.points[-1]
        if route.source is not None:
            box = layout.boxes[route.source]
            assert x0 == pytest.approx(box.x + box.w)
            assert box.y < y0 < box.y + box.h
        if route.target is not None:
            box = layout.boxes[route.target]
            assert x1 == pytest.approx(box.x)
            assert box.y < y1 < box.y + box.h
        assert route.points[-2][0] < x1, "an arrow arrives from the left"
    ends = sorted(str((route.source, route.target)) for route in layout.routes)
    assert ends == sorted(str((e.source, e.target)) for e in signal_graph(diagram)[1])


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_are_laid_out_cleanly(name):
    diagram = EXAMPLES[name]()
    layout = lay_out(diagram)
    assert_clean(layout)
    assert_routes_join_their_blocks(diagram, layout)


@pytest.mark.slow
@settings(deadline=None)
@given(diagrams())
def test_any_diagram_is_laid_out_cleanly(diagram):
    """Nothing overlaps: boxes, names, arrows through boxes or names, arrows on arrows."""
    layout = lay_out(diagram)
    assert_clean(layout)
    assert_routes_join_their_blocks(diagram, layout)


def test_the_loop_reads_from_left_to_right():
    """One straight line through reference, controller, actuator and plant; feedback below."""
    layout = lay_out(adaptive_loop())
    left = [box.x for box in layout.boxes]
    assert left == sorted(left)
    direct = {(r.source, r.target): r.points for r in layout.routes if r.wire is not None}
    assert {pair: len(points) for pair, points in direct.items()} == {
        (0, 1): 2,
        (1, 2): 2,
        (2, 3): 2,
        (3, 1): 6,
    }
    assert max(y for _, y in direct[3, 1]) > max(box.y + box.h for box in layout.boxes)


def test_arrows_inside_the_controller_are_as_straight_as_they_can_be():
    """Of two arrows into a block one is straight; the one around all boxes has four bends."""
    bends = {
        (r.source, r.target): len(r.points) - 2
        for r in lay_out(EXAMPLES["controller"]()).routes
        if r.wire is not None
    }
    filtered, basis, weights, robust, law = range(5)
    assert bends == {
        (basis, weights): 0,
        (filtered, weights): 2,
        (filtered, robust): 0,
        (weights, law): 0,
        (robust, law): 2,
        (filtered, law): 4,
    }


def test_feedforward_runs_above_and_feedback_below():
    """Control with an observer, which needs the control signal as well."""
    parts = [
        block("gain", ["r", "x"], ["u"]),
        block("plant", ["u"], ["y"]),
        block("observer", ["u", "y"], ["x"]),
    ]
    layout = lay_out(ct.interconnect(parts, inputs=["r"], outputs=["y"]))
    ways = {(r.source, r.target): [y for _, y in r.points] for r in layout.routes}
    assert min(ways[0, 2]) < min(box.y for box in layout.boxes)
    assert max(ways[2, 0]) > max(box.y + box.h for box in layout.boxes)


@pytest.mark.parametrize("from_outside", [True, False])
def test_order_of_the_list_does_not_matter_to_the_flow(from_outside):
    """A loop is drawn from where the reference enters it, wherever its blocks are listed."""
    parts = [block("c", ["q"], ["y"]), block("a", ["r", "y"], ["p"]), block("b", ["p"], ["q"])]
    if not from_outside:
        parts.append(block("reference", [], ["r"]))
    diagram = ct.interconnect(parts, inputs=["r"] if from_outside else 0, outputs=["y"])
    c, a, b = (box.x for box in lay_out(diagram).boxes[:3])
    assert a < b < c


def test_two_loops_are_drawn_as_two_rows():
    """Symmetric loops: four columns, the first fed back above, the second below."""
    diagram = cross_coupled()
    layout = lay_out(diagram)
    assert len({box.x for box in layout.boxes}) == 4
    names = [system.name for system in diagram.syslist]
    back = {
        names[r.source]: r
        for r in layout.routes
        if r.target is not None and r.source is not None and names[r.target].startswith("sum")
    }
    assert min(y for _, y in back["add1"].points) < min(box.y for box in layout.boxes)
    assert max(y for _, y in back["add2"].points) > max(box.y + box.h for box in layout.boxes)


def test_a_long_chain_continues_in_the_next_line():
    """Fifteen blocks fit on the page, read like text: by lines, each from left to right."""
    layout = lay_out(chain(15))
    assert layout.width <= 9 * 72
    assert [(box.y + box.h / 2, box.x) for box in layout.boxes] == sorted(
        (box.y + box.h / 2, box.x) for box in layout.boxes
    )


def test_a_bundle_to_two_blocks_is_one_branching_wire():
    parts = [block("a", [], ["p"]), block("b", ["p"], []), block("c", ["p"], [])]
    layout = lay_out(
        ct.InterconnectedSystem(
            parts, inputs=0, outputs=0, connections=[["b.p", "a.p"], ["c.p", "a.p"]]
        )
    )
    assert [route.wire for route in layout.routes] == [0, 0]
    assert [route.label.text.text for route in layout.routes if route.label] == ["p"]
    assert len(layout.dots) == 1


# --- names ---


def labels(diagram):
    """What is written on the arrows, in one line, and between which blocks."""
    routes = lay_out(diagram).routes
    return {r.label.text.text.replace("\n", " "): (r.source, r.target) for r in routes if r.label}


def test_gains_are_written_on_the_arrows():
    parts = [block("a", [], ["p", "q", "r"]), block("b", ["x", "y", "z"], [])]
    links = [("b.x", ("a", "p", -1)), ("b.y", ("a", "q", 2)), ("b.z", ("a", "r", -0.25))]
    assert list(labels(joined(parts, connections=links))) == ["-p, 2 q, -0.25 r"]


def test_numbered_signals_are_abbreviated():
    """Twenty-seven basis functions take one short label."""
    assert labels(EXAMPLES["controller"]())["psi1 ... psi27"] == (1, 2)


def test_an_external_output_with_a_name_of_its_own_tells_what_it_is():
    parts = [block("a", [], ["p"]), block("b", ["u"], ["q"])]
    diagram = ct.InterconnectedSystem(
        parts,
        outlist=["a.p", "-a.p", ["a.p", "b.q"], "b.u"],
        outputs=["plain", "turned", "total", "tap"],
        inputs=0,
    )
    assert set(labels(diagram)) == {"plain, turned = -p, total = p + ...", "total = q + ..., tap"}


ODD = ["$u_1$", "x^{2", "a_b_c", "\\alpha", "50%", "<b>&amp;", "a b"]


def test_every_character_is_shown_as_it_is():
    """Names that mean something in TeX or XML reach the paper unchanged."""
    parts = [block(f"{name}!", [name], [f"{name}~"]) for name in ODD]
    pairs = list(zip(parts, ODD, strict=True))
    diagram = ct.InterconnectedSystem(parts, inputs=[f"in {o}" for o in ODD], outputs=0)
    diagram.input_map = np.eye(len(ODD))
    diagram.connect_map = np.eye(len(ODD), k=-1)
    figure = draw(diagram, title="$t_i^{t}$")
    svg(figure)
    shown = [text for text in figure.axes[0].texts if text.get_text()]
    assert not any(text.get_parse_math() for text in shown)
    written = {text.get_text() for text in shown}
    wanted = {part.name for part, _ in pairs} | {f"in {o}" for o in ODD} | {"$t_i^{t}$"}
    assert wanted | {f"{o}~" for o in ODD[:-1]} <= written


# --- the figure ---


def svg(figure):
    buffer = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "nlctl"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["adaptive loop", "cross-coupled plant", "chain of 15"])
def test_the_same_diagram_gives_the_same_file(name):
    """Byte-identical SVG for two diagrams made alike."""
    first, second = (svg(draw(EXAMPLES[name](), title=name, expand=True)) for _ in range(2))
    assert first == second


@pytest.mark.slow
def test_drawing_in_threads_changes_nothing():
    diagram = cross_coupled()
    alone = lay_out(diagram)
    with ThreadPoolExecutor(4) as pool:
        figures = list(pool.map(draw, [diagram] * 8))
        assert set(pool.map(lay_out, [diagram] * 8)) == {alone}
    assert {len(figure.axes[0].texts) for figure in figures} == {len(figures[0].axes[0].texts)}


@pytest.mark.parted
@pytest.mark.parametrize("name", EXAMPLES)
def test_nothing_is_clipped_and_all_is_legible(name):
    """Text of at least 8 points, all of it on a page 9 inches wide; boxes hold their names."""
    figure = draw(EXAMPLES[name](), title="Title", expand=True)
    assert figure.get_figwidth() == pytest.approx(9)
    renderer = FigureCanvasAgg(figure).get_renderer()
    page = figure.bbox
    texts = [text for axes in figure.axes for text in axes.texts]
    extents = [text.get_window_extent(renderer) for text in texts]
    assert {text.get_text() for text in texts} >= {"Title"}
    assert min(float(text.get_fontsize()) for text in texts) >= 8
    for text, extent in zip(texts, extents, strict=True):
        assert page.x0 <= extent.x0, text
        assert extent.x1 <= page.x1, text
        assert page.y0 <= extent.y0, text
        assert extent.y1 <= page.y1, text
    for a, b in itertools.combinations(extents, 2):
        assert not overlap(a.extents, b.extents, 1.0), "no two texts may overlap"


def test_pyplot_is_left_alone():
    before = plt.get_fignums()
    draw(cross_coupled())
    assert plt.get_fignums() == before


def test_expand_shows_the_inside_of_nested_diagrams():
    """A panel per nested diagram, however deep, named by its path."""
    outer = nlctl.interconnect([adaptive_loop()], outputs=["y"])
    written = [
        [text.get_text() for axes in draw(outer, expand=e).axes for text in axes.texts]
        for e in (False, True)
    ]
    assert "basis" not in written[0]
    assert {"inside loop", "inside loop.controller", "basis", "plant"} <= set(written[1])


@each_row("thing", [ct.tf([1], [1, 1]), block("plant", ["u"], ["y"]), "loop", None])
def test_what_is_not_a_diagram_is_refused(thing):
    with pytest.raises(TypeError, match=rf"{type(thing).__name__}.*interconnect"):
        draw(thing)


def test_a_notebook_shows_the_drawing_as_vectors():
    """IPython asks an object for its representations: valid SVG with every path, twice alike."""
    shown = [draw(adaptive_loop(), expand=True)._repr_html_() for _ in range(2)]
    assert shown[0] == shown[1]
    root = ElementTree.fromstring(shown[0]).find("{http://www.w3.org/2000/svg}svg")
    assert root is not None
    assert len(root.findall(".//{http://www.w3.org/2000/svg}path")) > 50


@pytest.mark.parametrize("setting", ["figure.constrained_layout.use", "figure.autolayout"])
def test_settings_that_arrange_axes_move_no_drawing(setting):
    """Matplotlib takes its settings anew behind each save; a warning is an error here."""
    with matplotlib.rc_context({setting: True}):
        figure = nlctl.draw(nlctl.paper.example_1())
        first = figure._repr_svg_()
        assert figure._repr_svg_() == first

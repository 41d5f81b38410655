"""The design's layers: imports go downwards only, modules and functions stay small."""

import ast
import subprocess
import sys
from collections.abc import Mapping
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from places import ROOT

import nlctl
from nlctl.analysis.robustness.runs.store import computing

LAYERS = [  # from the bottom; a module belongs to the longest name that it begins with
    ["nlctl._version", "nlctl.host", "nlctl.upstream", "nlctl.attributes"],
    ["nlctl.errors", "nlctl.wording", "nlctl.names", "nlctl.arguments", "nlctl.params"]
    + ["nlctl.equations", "nlctl.annotations", "nlctl.probing", "nlctl.pickles"],
    [
        "nlctl.supplied",
        "nlctl.blocks",
        "nlctl.diagrams",
        "nlctl.functions",
        "nlctl.drawing",
        "nlctl.plotting",
        "nlctl.responses",
    ]
    + ["nlctl.accumulation", "nlctl.sampling", "nlctl.delays", "nlctl.sliding", "nlctl.reference"],
    ["nlctl.plants", "nlctl.actuators", "nlctl.references", "nlctl.sources", "nlctl.controllers"]
    + ["nlctl.faults"],
    ["nlctl.paper"],
    ["nlctl.papers"],
    ["nlctl.expressions"],
    ["nlctl.observers"],
    ["nlctl.native"],
    ["nlctl.response", "nlctl.sensitivities", "nlctl.describing"]
    + ["nlctl.export", "nlctl.fmi", "nlctl.__main__"],
    [
        "nlctl.analysis.json_values",
        "nlctl.analysis.catalogue",
        "nlctl.analysis.controller_guide",
        "nlctl.analysis.metrics",
        "nlctl.analysis.intervals",
    ]
    + ["nlctl.analysis.loop_record", "nlctl.analysis.response_of_loop", "nlctl.analysis.recheck"],
    ["nlctl.analysis.lyapunov", "nlctl.analysis.robustness"],
    ["nlctl.analysis.figures", "nlctl.analysis.report"],
    ["nlctl.analysis.studies"],
    ["nlctl.analysis.pages"],
    ["nlctl.analysis.loop_report", "nlctl.analysis.loop_checks"],
    ["nlctl.analysis.reproductions"],
    ["nlctl.analysis.paper"],
    ["nlctl.analysis.papers"],
    ["nlctl.analysis.cli"],
]
BLOCK_MODULES = LAYERS[3]
INSIDE = {  # the same within large packages: their rooms and single modules, from the bottom
    "nlctl.native": [
        ["cache", "collected", "codegen", "purity", "rounding", "sliding"],  # know no diagram
        ["codegen.ir"],
        ["codegen.c"],
        ["diagram"],
        ["declared", "opaque"],
        ["equations"],
        ["timed", "typesetting"],
        ["lower"],
        ["reading"],
        ["machine"],
        ["enclosures", "floats", "jacobians", "tied"],
        ["derivative_audit", "describe"],
        ["compiled"],
        ["cut_delays", "ensemble_result", "integrate", "members"],
        ["along", "audit", "discrete", "happened", "histories", "integrators", "laid", "settings"]
        + ["followed", "spare"],
        ["chattering", "known", "ship"],
        ["run"],
        ["taylor"],
        ["ahead", "results", "tubes", "windows"],
        ["slid"],
        ["driver", "own_errors"],
        ["ensemble", "response"],
        ["stepping", "operating_points", "frequency"],
    ],
    "nlctl.expressions": [
        ["limits", "signs"],
        ["arithmetic", "graph", "source"],
        ["functions", "elimination", "linear_systems"],
        ["integers", "gains", "passes", "protocols"],
        ["arrays", "promoted", "operators", "masked", "many_pieces", "edges"],
        ["sharp", "without_poles", "decimals"],
        ["levels"],
        [
            "conditions",
            "continuity",
            "dependence",
            "evaluate",
            "latex",
            "quotients",
        ],
        ["constants"],
        ["indexing"],
        ["bends", "registers", "texts"],
        ["library"],
        ["derivatives"],
        ["roots"],
        ["merged"],
        ["effects"],
        ["iterated"],
        ["rewritten"],
        ["staged", "stage"],
        ["staircases"],
        ["trace"],
        ["jacobian_source"],
    ],
    "nlctl.analysis.lyapunov": [
        ["bounds", "convex"],
        ["loop"],
        ["proofs", "nussbaum"],
        ["model_reference", "attraction"],
        ["certificate"],
        ["constants"],
        ["inequalities"],
        ["lines", "examination"],
        ["conclusions", "conservatism", "ledger", "tighten"],
    ],
    "nlctl.analysis.studies": [
        ["sealed", "file"],
        ["code"],
        ["result"],
        ["kind", "page"],
        ["resolve"],
        ["build"],
        ["kinds"],
        ["reading"],
        ["intact", "origin"],
        ["folder"],
        ["run", "plan", "differences"],
        ["replay"],
    ],
    "nlctl.analysis.robustness": [["stl", "uncertainty"], ["statistics"], ["runs"], ["search"]],
}
FILES = sorted(p for package in ("nlctl", "analysis") for p in (ROOT / package).rglob("*.py"))


def module_name(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    parts = parts if parts[0] == "nlctl" else ("nlctl", *parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


class Trees(Mapping):
    """The syntax trees of modules by name, each read when it is first asked for."""

    def __init__(self, paths):
        self.paths, self.trees = paths, {}

    def __getitem__(self, name):
        if name not in self.trees:
            self.trees[name] = ast.parse(self.paths[name].read_text(encoding="utf-8"))
        return self.trees[name]

    def __iter__(self):
        return iter(self.paths)

    def __len__(self):
        return len(self.paths)

    def __contains__(self, name):
        return name in self.paths


MODULES = Trees({module_name(path): path for path in FILES})
PACKAGES = {module_name(path) for path in FILES if path.name == "__init__.py"}
ROOTS = ("nlctl", "nlctl.analysis")  # these only re-export
MEMBERS = [name for name in MODULES if name not in ROOTS]


def imports(name):
    """Return the modules of this project that a module imports, also in functions and for types."""
    found = set()
    for node in ast.walk(MODULES[name]):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = name.split(".")
            if name not in PACKAGES:
                base = base[:-1]
            base = base[: len(base) - node.level + 1] if node.level else []
            source = ".".join([*base, *([node.module] if node.module else [])])
            members = {f"{source}.{alias.name}" for alias in node.names}
            found |= (members & set(MODULES)) or {source}
    return {module for module in found if module.split(".")[0] == "nlctl"}


def within(name, prefixes):
    """Whether a module is one of those named, or inside of one."""
    return any(name == prefix or name.startswith(f"{prefix}.") for prefix in prefixes)


def entry(name, layers=LAYERS):
    """Return the number of a module's layer, and the longest name in it that the module is in."""
    fits = [
        (len(prefix), number, prefix)
        for number, prefixes in enumerate(layers)
        for prefix in prefixes
        if within(name, [prefix])
    ]
    assert fits, f"{name} belongs to no layer: give it a place in the layers of this test"
    return max(fits)[1:]


def layer(name, layers=LAYERS):
    """Return the number of a module's layer."""
    return entry(name, layers)[0]


def order_inside(package):
    """Return the layers of a package with full names, and its modules without the package."""
    layers = [[f"{package}.{name}" for name in names] for names in INSIDE[package]]
    return layers, [m for m in MEMBERS if m.startswith(f"{package}.")]


ORDERS = {"all": (LAYERS, MEMBERS), **{name: order_inside(name) for name in INSIDE}}


@pytest.mark.parametrize("where", ORDERS)
def test_imports_go_downwards_only(where):
    """No module imports one of a higher layer: not lazily inside a function, nor for its types."""
    layers, members = ORDERS[where]
    known = {n: layer(n, layers) for n in members}
    upwards = {n: {m for m in imports(n) if known.get(m, -1) > known[n]} for n in members}
    assert {name: found for name, found in upwards.items() if found} == {}


@pytest.mark.parametrize("where", ORDERS)
def test_rooms_know_each_other_in_one_direction(where):
    """Also those of one layer: there is an order of the names that stand in it."""
    layers, members = ORDERS[where]
    rooms = {n: entry(n, layers)[1] for n in members}
    below = {room: set() for room in rooms.values()}
    for name, room in rooms.items():
        below[room] |= {rooms[m] for m in imports(name) if m in rooms} - {room}
    assert len(list(TopologicalSorter(below).static_order())) == len(below)


@pytest.mark.parametrize("where", ORDERS)
def test_names_of_layers_are_those_of_modules(where):
    """A name that no module has any more would hold nothing."""
    layers, members = ORDERS[where]
    named = {prefix for prefixes in layers for prefix in prefixes}
    assert named == {entry(n, layers)[1] for n in members}


def test_there_are_imports_to_look_at():
    """The reader of imports sees relative, absolute and lazy ones."""
    assert "nlctl.params" in imports("nlctl.plants")
    assert "nlctl.functions" in imports("nlctl.controllers.rbf")
    assert "nlctl.controllers" in imports("nlctl.paper")
    assert "nlctl.native" in imports("nlctl.response")  # for types, and for engines
    assert layer("nlctl.controllers.rbf") == 3


def test_no_module_imports_itself_in_a_ring():
    """There is an order in which every module comes after those that it imports."""
    packages_inside = {n: {m for m in imports(n) if m in MEMBERS and m != n} for n in MEMBERS}
    order = list(TopologicalSorter(packages_inside).static_order())
    assert set(order) == set(MEMBERS)


def test_nlctl_knows_nothing_of_analysis():
    """Blocks, diagrams and the engine can be used without it; the command is looked up by name."""
    below = [n for n in MEMBERS if not within(n, ["nlctl.analysis"])]
    assert {n for n in below for m in imports(n) if within(m, ["nlctl.analysis"])} == set()


def reached(names):
    """Return the modules that these import, and so on; packages that only re-export aside."""
    waiting, seen = list(names), set()
    while waiting:
        name = waiting.pop()
        if name not in seen and name in MEMBERS:
            seen.add(name)
            waiting += imports(name)
    return seen


def installed_name(path, below):
    """Return the name of a module by its file below one of the two roots, wherever these are."""
    top = "nlctl" if path == Path(nlctl.__file__).parent / below else "nlctl.analysis"
    parts = (top, *Path(below).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def test_what_a_study_is_computed_by_is_in_the_key_of_its_versions():
    """An edit of any of it makes results stale: of metrics, of makers of metrics, of kinds."""
    counted = {installed_name(path, name) for path, name in computing()}
    rooms = ["nlctl.analysis.metrics", "nlctl.analysis.robustness"]
    every = reached(m for m in MEMBERS if within(m, rooms))
    assert every - counted == set()
    assert "nlctl.analysis.lyapunov.nussbaum.forecast" in every
    studies = {m for m in MEMBERS if within(m, ["nlctl.analysis.studies", "nlctl.analysis.paper"])}
    pages = {m for m in studies if within(m, ["nlctl.analysis.paper.page"])}
    assert studies - counted == pages


def test_the_recheck_knows_nothing_of_the_prover():
    """Nor of any third-party package: it stands on Python's own library."""
    own = [m for m in MEMBERS if within(m, ["nlctl.analysis.recheck"])]
    assert {m: found for m in own if (found := imports(m) - set(own))} == {}
    taken = {name.partition(".")[0] for m in own for name in imported(m)}
    assert taken <= set(sys.stdlib_module_names)


def test_drawing_and_native_code_know_no_blocks():
    """They treat any python-control diagram alike, with or without our blocks."""
    for name in ("nlctl.drawing", "nlctl.native"):
        assert [m for m in MEMBERS if within(m, [name])], f"{name} does not exist"
    readers = [m for m in MEMBERS if within(m, ["nlctl.drawing", "nlctl.native"])]
    blocks = (*BLOCK_MODULES, "nlctl.paper")
    known = {name: {m for m in imports(name) if m.startswith(blocks)} for name in readers}
    assert {name: found for name, found in known.items() if found} == {}


def test_layout_is_independent_of_python_control():
    """Geometry needs sizes and connections only."""
    geometry = [m for m in MEMBERS if within(m, ["nlctl.drawing"]) and "picture" not in m]
    for name in geometry[1:]:  # the first is the package, which re-exports
        assert all(within(m, ["nlctl.drawing"]) for m in imports(name))
        assert "import control" not in ast.unparse(MODULES[name])
    assert {"nlctl.drawing.order", "nlctl.drawing.routes"} <= set(geometry)


def imported(name):
    """Yield the names of all modules that a module imports, with what it takes of them."""
    for node in ast.walk(MODULES[name]):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


PRIVATE = ("numba.core", "numba.np", "numba.misc", "numba.typed", "numba.cpython")


def is_private_of_others(module):
    """Whether a name of another library is none that it documents."""
    return within(module, PRIVATE) or ("._" in module and not within(module, ["nlctl"]))


def test_private_names_of_others_stand_in_two_modules():
    """Where nobody documents what is relied on there is a place to mend, and a test of each."""
    found = {name: [m for m in imported(name) if is_private_of_others(m)] for name in MEMBERS}
    known = {"nlctl.upstream.numba_internals", "nlctl.upstream.scipy_internals"}
    assert {n for n, modules in found.items() if modules} == known


CONTROL = ("_update_params", "_current_params", "_rhs", "_out")


def test_private_names_of_python_control_stand_in_one_module():
    """Those of `NonlinearIOSystem`, whether read, called or overridden."""
    found = {}
    for name, tree in MODULES.items():
        used = [n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)]
        used += [n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]
        found[name] = set(used) & set(CONTROL)
    assert {n: names for n, names in found.items() if names} == {
        "nlctl.upstream.control_internals": set(CONTROL)
    }


def lines_of_functions(path, lines):
    """Yield the name and the lines of code of every function, docstrings not counted."""
    for node in ast.walk(MODULES[module_name(path)]):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[1:] if ast.get_docstring(node) is not None else node.body
            if body:
                code = [s.strip() for s in lines[body[0].lineno - 1 : node.end_lineno]]
                yield node.name, len([s for s in code if s and not s.startswith("#")])


def test_modules_and_functions_are_small():
    """At most 500 lines a module, 40 lines of code a function."""
    large = []
    for path in FILES:
        name, lines = str(path.relative_to(ROOT)), path.read_text(encoding="utf-8").splitlines()
        if len(lines) > 500:
            large.append((name, len(lines)))
        large += [(f"{name}: {f}", n) for f, n in lines_of_functions(path, lines) if n > 40]
    assert large == []


def test_rooms_say_what_is_in_them():
    """A package says in its docstring what is in it."""
    assert [name for name in PACKAGES if not ast.get_docstring(MODULES[name])] == []


def test_importing_is_cheap():
    """`nlctl --help` and `import nlctl` load none of the heavy libraries."""
    heavy = ["control", "scipy", "numba", "matplotlib", "pandas"]
    for module in ("nlctl", "nlctl.analysis.cli.main"):
        code = f"import {module}, sys; print(*(m for m in {heavy} if m in sys.modules))"
        run = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        assert (module, run.stdout.split()) == (module, [])

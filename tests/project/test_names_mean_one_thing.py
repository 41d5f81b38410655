"""A public name of a module means one thing in the whole project, so that a search finds it."""

import ast
from collections import defaultdict

from test_layers import MODULES

EXCEPTIONS = {
    "AHEAD": "the step from a standstill, of either method; the integrators are compiled from it",
    "interpolate": "what each integrator offers instead of the other's",
    "evaluate": "rows of an experiment, in README; and a right-hand side within the integrators",
    "main": "what a script or a command calls",
    "Spec": "the contract of a block, and a specification of a response: both are public",
    "example_1": "that of each paper, and the same with controllers that studies compare",
    "example_2": "that of each paper, and the same with controllers that studies compare",
    "INITIAL_STATE": "where the printed example of each paper starts",
    "REPRODUCTION": "the record of each paper, which its name finds",
}


def bound(statement):
    """Yield the names that a statement of a module binds."""
    if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        yield statement.name
    elif isinstance(statement, ast.Assign | ast.AnnAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        for target in targets:
            nodes = ast.walk(target)
            yield from (
                n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
            )
    elif isinstance(statement, ast.If | ast.Try | ast.With):
        for inner in ast.iter_child_nodes(statement):
            yield from bound(inner)


def definitions(modules):
    """Return the modules that define each public name, imports not counted."""
    found = defaultdict(set)
    for module, tree in modules.items():
        for statement in tree.body:
            for name in bound(statement):
                if not name.startswith("_"):
                    found[name].add(module)
    return found


def test_a_public_name_is_defined_in_one_module():
    """What only its own module uses is private; what others import says what it is."""
    twice = {name: sorted(where) for name, where in definitions(MODULES).items() if len(where) > 1}
    assert {name: where for name, where in twice.items() if name not in EXCEPTIONS} == {}


def test_no_exception_has_become_needless():
    """Each exception is a name that is defined twice, and has a reason."""
    found = definitions(MODULES)
    assert {name for name in EXCEPTIONS if len(found[name]) < 2} == set()
    assert all(EXCEPTIONS.values())


def test_definitions_of_every_form_are_seen():
    """Functions, classes, constants, pairs of them, annotated ones, and those under a condition."""
    text = "def f(): x = 1\nclass G: y = 2\nA, (B, _p) = 1, (2, 3)\nC: int = 4\nif A:\n    D = 5\n"
    found = definitions({"one": ast.parse(text), "two": ast.parse("from one import f, G\nf.z = 1")})
    assert found == {name: {"one"} for name in ("f", "G", "A", "B", "C", "D")}

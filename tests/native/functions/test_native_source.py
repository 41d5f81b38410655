"""The source of a function is found however its module is divided into cells, and no other."""

import ast
import linecache
import math
import runpy

import cloudpickle
import control as ct
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl
from nlctl.expressions.source import Unreadable, definition

TEXT = """from __future__ import annotations
import numpy as np
K = 2
def gain(x):
    return K * np.sin(x) + math.cos(x)
import math
if True:
    import scipy.special as special
class Law:
    def update(self, x: Unknown):
        return np.exp(x) * math.tanh(x) - special.erf(x)
    lag = staticmethod(lambda x: np.log(x) + special.erf(x))
def made():
    import cmath
    return lambda x: np.sqrt(x) * cmath.pi
law = lambda x: np.abs(x) + math.e; other = lambda y: math.pi
"""
STATEMENTS = ast.parse(TEXT).body
FUTURE = 0x1000000  # of annotations, kept from cell to cell as IPython does


def run_in_cells(text, file, ends):
    """Run a text as cells that end after the given statements, each with its lines in the file."""
    names, start = {"__name__": "cells"}, 0
    for end in [*sorted(ends), len(STATEMENTS)]:
        cell = ast.Module(ast.parse(text, file).body[start:end], type_ignores=[])
        exec(compile(cell, file, "exec", flags=FUTURE, dont_inherit=True), names)
        start = end
    return names


def functions(names):
    law = names["Law"]
    known = [names["gain"], law.update, law.lag, names["made"], names["made"]()]
    return [*known, names["law"], names["other"]]


def remember(text, file):
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)


@pytest.mark.slow
@settings(max_examples=many(60), deadline=None)
@given(st.sets(st.integers(1, len(STATEMENTS) - 1)))
def test_every_division_into_cells_has_the_source_of_the_file(ends):
    """As of a notebook, which compiles each statement, and of a gallery, which has cells."""
    file = "<cells of a file>"
    remember(TEXT, file)
    whole = functions(run_in_cells(TEXT, file, ()))
    for function, same in zip(functions(run_in_cells(TEXT, file, ends)), whole, strict=True):
        assert function.__code__.co_firstlineno == same.__code__.co_firstlineno
        assert ast.dump(definition(function)) == ast.dump(definition(same))


@settings(max_examples=many(30, part=4), deadline=None)
@given(
    st.sets(st.integers(1, len(STATEMENTS) - 1)),
    st.sampled_from([("K *", "3 *"), ("np.exp", "np.sin"), ("cmath.pi", "cmath.e ")]),
)
def test_a_cell_that_was_edited_since_is_not_believed(ends, change):
    """Whatever its neighbours import: the statement itself must be the one that was run."""
    file = "<an edited file>"
    places = {"K *": [0], "np.exp": [1], "cmath.pi": [3, 4]}[change[0]]
    remember(TEXT, file)
    known = functions(run_in_cells(TEXT, file, ends))
    remember(TEXT.replace(*change), file)
    for place, function in enumerate(known):
        if place in places:
            with pytest.raises(Unreadable, match="is not what it was made of"):
                definition(function)
        else:
            definition(function)


def test_a_block_of_a_later_cell_is_compiled():
    """The import stands in another cell, so that its bytecode is not that of the whole file."""
    file = "<a page>"
    cells = "import control as ct, numpy as np\n", "\ndef f(t, x, u, p):\n    return -np.tanh(x)\n"
    remember("".join(cells), file)
    names = {}
    exec(compile(cells[0], file, "exec"), names)
    exec(compile("\n" + cells[1], file, "exec"), names)
    system = names["ct"].nlsys(names["f"], None, states=1, inputs=0, name="decay")
    response = nlctl.input_output_response(nlctl.compile(system), [0, 1], 0, [2.0], rtol=1e-9)
    assert math.isclose(math.sinh(response.states[0, -1]), math.sinh(2) / math.e, rel_tol=1e-6)


def test_functions_made_again_from_a_pickle_have_the_source_of_their_file(tmp_path):
    """cloudpickle leaves the file out of their code; it is believed only where it fits the code."""
    file = tmp_path / "blocks.py"
    file.write_text(TEXT)
    known = functions(runpy.run_path(str(file)))
    again = cloudpickle.loads(cloudpickle.dumps(known))
    for one, other in zip(known, again, strict=True):
        assert ast.dump(definition(one)) == ast.dump(definition(other))
    file.write_text(TEXT.replace("K *", "3 * K *"))
    with pytest.raises(Unreadable, match="is not what it was made of"):
        definition(again[0])


def test_where_a_function_from_a_pickle_cannot_be_compiled_is_said(tmp_path):
    """With its file and line, as for the function itself."""
    file = tmp_path / "counter.py"
    file.write_text("def made():\n    n = 0\n    def f(t, x, u, p):\n        nonlocal n\n"
                    "        n += 1\n        return -n * x\n    return f\n")  # fmt: skip
    f = cloudpickle.loads(cloudpickle.dumps(runpy.run_path(str(file))["made"]()))
    system = ct.nlsys(f, None, states=1, inputs=0, name="counter")
    with pytest.raises(nlctl.errors.CompileError, match=r"counter\.py, line 5"):
        nlctl.compile(system)


def test_what_was_made_of_a_text_is_not_taken_for_a_function_of_the_file():
    """Its globals know a file in which other lines stand."""
    names = dict(globals())
    exec("def f(t, x, u, p):\n    return [-2 * x[0]]", names)  # the text of no file
    with pytest.raises(Unreadable, match="is not what it was made of") as refused:
        definition(names["f"])
    assert "made of a text, as by exec" in refused.value.advice

"""C99 of controllers and of equations: headers and sources, with what every number means."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from .._version import __version__
from ..annotations import as_annotated
from ..attributes import described_record
from ..native.codegen.c.body import CModule, c_number
from ..native.codegen.c.program import function_text
from ..native.lower import Lowered
from ..wording import counted
from .words import comment, enumeration


@described_record(made_by="export_controller", eq=False)
class ExportedController:
    """A sampled controller as code."""

    name: str  # In front of all its names in C.
    dt: float  # Sampling time and time of the first sample (s).
    offset: float
    # Labels, in the order of their arrays; the states include the outputs that blocks hold.
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    states: tuple[str, ...]
    # Every number of them by its name, in the order of their array.
    parameters: Mapping[str, float]
    initial_state: np.ndarray  # (states,)
    takes_time: bool  # Whether its equations read the time, which ``step`` takes then.
    lowered: Lowered  # The plan that all code is written from.
    sampled_states: tuple[int, ...]  # Which states a sample makes, in the order in which it does.
    digest: str  # A key of all this: the same for the same program and numbers.


@described_record(made_by="export_equations", eq=False)
class ExportedEquations:
    """The equations of a diagram as code, for an integrator of one's own."""

    name: str  # In front of all its names in C.
    inputs: tuple[str, ...]  # Labels, in the order of their arrays.
    outputs: tuple[str, ...]
    states: tuple[str, ...]
    # States that jump after each accepted step, to what ``rates`` writes to `m`.
    memory: tuple[str, ...]
    conditions: int  # Numbers in `g`: where one changes its sign, steps should end.
    # Every number of them by its name, in the order of their array.
    parameters: Mapping[str, float]
    initial_state: np.ndarray  # (states,)
    lowered: Lowered  # The plan that the code is written from.
    digest: str  # A key of all this: the same for the same program and numbers.


_WORDS = {"+": "additions", "-": "subtractions", "*": "products", "/": "divisions", "fma": "fma"}
_OPERATION = re.compile(r" ([-+*/]) |\b([a-z]\w*)\(")
_FUNCTION = re.compile(r"^static \w+ (\w+)\([^)]*\)\n\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_TURNS = re.compile(r"for \(int k = 0; k < (\d+)")
_LINEAR = re.compile(r"^\s*nlctl_(lu|lu_solve)\(&\w+\[\d+\], (\d+)(?:, (\d+))?\);")
_FREE = ("nlctl_bits", "nlctl_real", "sizeof")


def counted_operations(before: str, step: str) -> Counter[str]:
    """Return how often the functions of `step` do what, with those in `before` that they call.

    Of a choice both sides are counted: the worst case.
    """
    known: dict[str, Counter[str]] = {}
    for name, body in _FUNCTION.findall(before):
        known[name] = _counts(body, known)
    total = Counter[str]()
    for _, body in _FUNCTION.findall(step):
        total += _counts(body, known)
    return total


def in_words(counts: Mapping[str, int]) -> str:
    """Return counts in a line."""
    order = [*(key for key in _WORDS if key in counts), *sorted(set(counts) - set(_WORDS))]
    return ", ".join(f"{counts[key]} {_WORDS.get(key, key)}" for key in order) or "no operations"


def _counts(body: str, known: Mapping[str, Counter[str]]) -> Counter[str]:
    """Return how often statements do what, those of loops as often as these turn."""
    total, times = Counter[str](), 1
    for line in body.splitlines():
        turns = _TURNS.search(line)
        if turns or line.strip() == "}":
            times = int(turns[1]) if turns else 1
            continue
        if linear := _LINEAR.match(line):
            total[_of_matrix(*linear.groups())] += times
        statement = re.sub(r"\[[^]]*\]|/\*.*?\*/", "", line).replace("+=", "= x +")
        statement = statement.partition("return")[2] or statement.partition("=")[2]
        for sign, name in _OPERATION.findall(f" {statement}"):
            if name in known:
                total += Counter({key: times * n for key, n in known[name].items()})
            elif name not in _FREE:
                total[sign or name] += times
    return total


def _of_matrix(name: str, rows: str, columns: str | None) -> str:
    if name == "lu":
        return f"LU factorisation of {rows} x {rows}"
    return f"back substitution of {rows} x {columns}"


INCLUDED = """\
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#if FLT_RADIX != 2 || DBL_MANT_DIG != 53 || FLT_EVAL_METHOD != 0
#error "doubles of IEEE 754 are needed, evaluated as doubles"
#endif
#ifdef __FAST_MATH__
#error "compile without -ffast-math"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif
"""


Exported = ExportedController | ExportedEquations


@as_annotated
def c_files(exported: Exported) -> dict[str, str]:
    """Return header and source, C99 without warnings, by the names of their files.

    Parameters
    ----------
    exported : ExportedController or ExportedEquations
        As `export_controller` and `export_equations` return them.

    Returns
    -------
    dict of str to str
        ``NAME.h`` and ``NAME.c``.

    Examples
    --------
    >>> files = c_files(nlctl.export.export_equations(nlctl.paper.example_1(), name="loop"))
    >>> "void loop_rates(" in files["loop.c"]
    True
    """
    is_controller = isinstance(exported, ExportedController)
    header, source = (
        (_controller_header(exported), _controller_source(exported))
        if is_controller
        else (_equations_header(exported), _equations_source(exported))
    )
    return {f"{exported.name}.h": header, f"{exported.name}.c": source}


def _controller_header(controller: ExportedController) -> str:
    """Return the header: sizes, indices, the state, two functions."""
    name, t = controller.name, "double t, " if controller.takes_time else ""
    words = "  t: time of the sample (s)." if t else ""
    dt, offset = c_number(controller.dt), c_number(controller.offset)
    return _header(
        controller,
        f"{counted(len(controller.inputs), 'input')}, "
        f"{counted(len(controller.outputs), 'output')}, "
        f"every {dt} s from {offset} s on.",
        f"""\
#define {name.upper()}_DT {dt} /* s */

typedef struct {{
  double x[{max(len(controller.states), 1)}]; /* states, and outputs that are held */
  double c[{controller.lowered.size}]; /* what depends on parameters alone, and room */
}} {name}_state;

/* Begin: initial states, and parameters, such as {name}_parameters. */
void {name}_reset({name}_state *self, const double parameters[]);

/* One sample: outputs of inputs, and the states of the next sample.{words} */
void {name}_step({name}_state *self, {t}const double inputs[], double outputs[]);
""",
    )


def _controller_source(controller: ExportedController) -> str:
    """Return the source: what the plan says, and the functions of the header around it."""
    name = controller.name
    t = "double t, " if controller.takes_time else ""
    now = "&t" if controller.takes_time else "&no_time"
    no_time = "" if controller.takes_time else "  const double no_time = 0.0;\n"
    given = f"{now}, self->x, inputs, self->c"
    return _source(
        controller,
        {"prepare": "prepare", "sample": "sample0", "held": "out"},
        "The operations and their order are those of nlctl's own simulation of it; each rounds\n"
        "   alike on every processor with doubles of IEEE 754.",
        "step",
        f"""\
static const double initial[{max(len(controller.states), 1)}] = {{{_start(controller)}}};

void {name}_reset({name}_state *self, const double parameters[])
{{
  memset(self, 0, sizeof *self);
  memcpy(self->x, initial, sizeof initial);
  prepare(parameters, self->c);
}}

void {name}_step({name}_state *self, {t}const double inputs[], double outputs[])
{{
{no_time}  double s[{max(len(controller.sampled_states), 1)}];
  sample({given}, s);
{_taken(controller.sampled_states)}  held({given}, outputs);
}}
""",
    )


def _equations_header(equations: ExportedEquations) -> str:
    """Return the header: sizes, indices, initial states, three functions."""
    name, size = equations.name, equations.lowered.size
    memory = ", ".join(map(comment, equations.memory)) or "none"
    return _header(
        equations,
        f"{counted(len(equations.states), 'state')}, {counted(len(equations.inputs), 'input')}, "
        f"{counted(len(equations.outputs), 'output')}, in continuous time.",
        f"""\
#define {name.upper()}_ROOM {size}
#define {name.upper()}_CONDITIONS {equations.conditions}
#define {name.upper()}_MEMORY {len(equations.memory)}
extern const double {name}_initial[{max(len(equations.states), 1)}];

/* What depends on parameters p alone, such as {name}_parameters.
   c has {name.upper()}_ROOM places. */
void {name}_prepare(const double p[], double c[]);

/* Rates dx of states x.  Where one of g changes its sign a step should end; after each accepted
   step the states of memory ({memory}) become m. */
void {name}_rates(
    double t, const double x[], const double u[], double c[], double dx[], double g[], double m[]);

/* Outputs y. */
void {name}_outputs(double t, const double x[], const double u[], double c[], double y[]);
""",
    )


def _equations_source(equations: ExportedEquations) -> str:
    """Return the source."""
    name = equations.name
    return _source(
        equations,
        {"prepare": "prepare", "rates": "rhs", "outputs": "out"},
        "The operations are those of nlctl's machine code, which may round products and sums once.",
        "evaluation",
        f"""\
const double {name}_initial[{max(len(equations.states), 1)}] = {{{_start(equations)}}};

void {name}_prepare(const double p[], double c[])
{{
  prepare(p, c);
}}

void {name}_rates(
    double t, const double x[], const double u[], double c[], double dx[], double g[], double m[])
{{
  rates(&t, x, u, c, dx, g, m);
}}

void {name}_outputs(double t, const double x[], const double u[], double c[], double y[])
{{
  outputs(&t, x, u, c, y);
}}
""",
    )


def _header(exported: Exported, what: str, functions: str) -> str:
    """Return a header around declarations."""
    name, big = exported.name, exported.name.upper()
    return f"""\
/* {comment(name)}: {what}
   nlctl {__version__}, program {exported.digest} */
#ifndef {big}_H
#define {big}_H

#define {big}_DIGEST "{exported.digest}"
{enumeration(f"{big}_STATE", exported.states)}
{enumeration(f"{big}_INPUT", exported.inputs)}
{enumeration(f"{big}_OUTPUT", exported.outputs)}
{enumeration(f"{big}_PARAMETER", exported.parameters, begins=True)}
extern const double {name}_parameters[{max(len(exported.parameters), 1)}];

{functions}
#endif
"""


def _source(
    exported: Exported, plans: Mapping[str, str], claim: str, unit: str, functions: str
) -> str:
    """Return a source: functions of a plan by their names in C, then functions around them."""
    module, labels = CModule(), _labels(exported)
    texts = [
        function_text(module, name, exported.lowered.functions[plan], labels)
        for name, plan in plans.items()
    ]
    counts = counted_operations(module.text(), "\n".join(texts[1:]))
    values = ",\n".join(
        f"  {c_number(value)} /* {comment(label)} */"
        for label, value in exported.parameters.items()
    )
    name = exported.name
    return f"""\
/* {comment(name)}, written by nlctl {__version__} from the graph of its equations, program \
{exported.digest}.
   {claim}
   No memory is allocated; of libraries: math.h, string.h.  A {unit} takes at most
   {in_words(counts)}. */
#include "{name}.h"

{INCLUDED}
const double {name}_parameters[{max(len(exported.parameters), 1)}] = {{
{values or "  0.0"}
}};

{module.text()}
{chr(10).join(texts)}
{functions}"""


def _labels(exported: Exported) -> dict[str, str]:
    """Return what the entries of arrays are called."""
    arrays = {"x": exported.states, "u": exported.inputs}
    arrays |= dict.fromkeys("pc", tuple(exported.parameters))
    return {
        f"{array}[{i}]": comment(label)
        for array, labels in arrays.items()
        for i, label in enumerate(labels)
    }


def _start(exported: Exported) -> str:
    return ", ".join(map(c_number, exported.initial_state)) or "0.0"


def _taken(places: Sequence[int]) -> str:
    """Return the lines that make what a sample computed the states."""
    if list(places) == list(range(len(places))):
        return f"  memcpy(self->x, s, {len(places)} * sizeof(double));\n"
    return "".join(f"  self->x[{i}] = s[{k}];\n" for k, i in enumerate(places))

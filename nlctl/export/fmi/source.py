"""The sources of an FMU: a diagram's tables and equations, and around them what all FMUs share."""

import hashlib
from collections.abc import Iterable, Mapping
from importlib.resources import files
from uuid import UUID

from ..._version import __version__
from ...expressions.sharp import AREA, ITSELF, LEADS, RANGE, SHORTER
from ...native.codegen.c.body import CModule, c_number
from ...native.codegen.c.program import function_text
from ...native.integrate.methods.tsit5 import TSIT5
from ..source import INCLUDED
from ..words import comment
from .variables import Model

_SHORT = 1e-7  # of the stop time: over which is seen whether a memory reverses
_SHARED = ("common.h", "instance.h", "machine.h", "machine.c", "model.c", "sharp.h", "sharp.c",
           "wide.c")  # fmt: skip


def sources(model: Model, version: int) -> dict[str, str]:
    """Return all files of C by their names, but for the headers of FMI."""
    folder = files("nlctl.export.fmi") / "c"
    shared = {
        name: (folder / name).read_text(encoding="utf-8")
        for name in (*_SHARED, f"fmi{version}.c")
    }  # fmt: skip
    equations, tables = _equations(model), f'#include "model.h"\n\n{_tables(model)}\n'
    text = "".join([_header(model, ""), equations, tables, *shared.values(), __version__])
    header = _header(model, f"{{{UUID(hashlib.sha256(text.encode()).hexdigest()[:32])}}}")
    return {"model.h": header, "equations.h": equations, "tables.c": tables, **shared}


def token_of(text: dict[str, str]) -> str:
    """Return the token by which an importer knows that description and binary fit."""
    return text["model.h"].partition('#define TOKEN "')[2].partition('"')[0]


def _header(model: Model, token: str) -> str:
    """Return sizes, value references, and what the equations are called."""
    lines = _sizes(model)
    stages = len(TSIT5.c)
    return f"""\
/* {comment(model.meaning)}: sizes, and the functions of its equations.  nlctl {__version__} */
#ifndef MODEL_H
#define MODEL_H

#include <math.h>

#define TOKEN "{token}"
{chr(10).join(lines)}
#define STAGES {stages}
#define ORDER {TSIT5.order}.0

typedef struct {{
  double low, high;
  int open_below, open_above, may_change;
  const char *name;
}} Bounds;

extern const double model_start[N_STATES + 1], model_parameters[N_PARAMETERS + 1];
extern const double model_breaks[N_BREAKS + 1][2], model_series[N_SERIES + 1][3];
extern const Bounds model_bounds[N_PARAMETERS + 1];
extern const unsigned model_meetings[N_MEETINGS + 1];
extern const int model_continuous[N_STATES + 1], model_memory[N_MEMORY + 1];
extern const int model_sampled[N_SAMPLED + 1], model_reset_states[N_RESETS + 1];
extern const int model_sharp_kinds[N_SHARP + 1];
extern const int model_owned[N_GUARDS + 1][N_RESETS + 1];
extern const double model_a[STAGES - 1][STAGES], model_nodes[STAGES], model_error[STAGES];

#if defined(__x86_64__) && defined(__GNUC__)
#define HAS_WIDE /* the equations are there for AVX2 and FMA as well: to the bit the same numbers */
#endif

#define FUNCTIONS(with) \\
  void model_prepare##with(const double p[], double c[]); \\
  void model_rates##with(double t, const double x[], const double u[], double c[], double dx[], \\
                         double g[], double m[]); \\
  void model_outputs##with(double t, const double x[], const double u[], double c[], double y[]); \\
  void model_sample##with(int k, double t, const double x[], const double u[], double c[], \\
                          double s[]); \\
  void model_reset##with(double t, const double x[], const double u[], double c[], double s[]); \\
  void model_sharp##with(double t, const double x[], const double u[], double c[], double s[]);

FUNCTIONS()
FUNCTIONS(_plain)
FUNCTIONS(_wide)

#endif
"""


def _sizes(model: Model) -> list[str]:
    """Return sizes, value references and numbers as lines."""
    rows, at, what = model.lowered.rows, model.places, model.happenings
    resets = sum(end - begin for _, begin, end in model.jumping)
    sizes = {
        "STATES": rows["x"], "CONTINUOUS": len(model.continuous),
        "STILL": rows["x"] - len(model.continuous), "INPUTS": rows["u"],
        "OUTPUTS": rows["y"], "PARAMETERS": len(model.parameters), "ROOM": rows["c"],
        "SIGNS": rows["g"], "GUARDS": len(model.guards), "MEMORY": len(model.memory),
        "SAMPLED": len(model.sampled), "RESETS": resets, "SERIES": len(what.series),
        "MEETINGS": len(what.meetings), "BREAKS": len(what.breaks),
        "SHARP": len(model.lowered.sharp), "INDICATORS": model.indicators,
        "DECLARED": model.declared,
    }  # fmt: skip
    numbers = {
        "KNOWN_UNTIL": what.known_until, "LONGEST": what.longest, "TOLERANCE": model.tolerance,
        "SHORT_TIME": _SHORT * model.stop_time, "RANGE": RANGE, "LEADS": LEADS,
        "SHORTER": SHORTER,
    }  # fmt: skip
    lines = [f"#define N_{name} {size}" for name, size in sizes.items()]
    lines += [f"#define OF_{kind.upper()} {first}u" for kind, first in at.items()]
    lines += [f"#define {name} {kind}" for name, kind in (("ITSELF", ITSELF), ("AREA", AREA))]
    lines += [f"#define {name} {c_number(value)}" for name, value in numbers.items()]
    return lines


def _equations(model: Model) -> str:
    """Return what is compiled for any processor, and where it can be for a wide one."""
    module, functions = CModule(), dict(model.lowered.functions)
    labels = {
        f"{array}[{i}]": comment(v.name)
        for array, kind in (("x", "states"), ("u", "inputs"), ("p", "parameters"))
        for i, v in enumerate(model.of(kind))
    }
    texts = [function_text(module, name, plan, labels) for name, plan in functions.items()]
    cases = "".join(
        f"    case {name.removeprefix('sample')}: {name}(&t, x, u, c, s); break;\n"
        for name in functions
        if name.startswith("sample")
    )
    return f"""\
/* {comment(model.meaning)}, written by nlctl {__version__} from the graph of its equations. */
#include "model.h"

{INCLUDED}
{module.text()}
{chr(10).join(texts)}
void VERSION(model_prepare)(const double p[], double c[]) {{ prepare(p, c); }}

void VERSION(model_rates)(double t, const double x[], const double u[], double c[], double dx[],
                          double g[], double m[])
{{
  rhs(&t, x, u, c, dx, g, m);
}}

void VERSION(model_outputs)(double t, const double x[], const double u[], double c[], double y[])
{{
  out(&t, x, u, c, y);
}}

void VERSION(model_sample)(int k, double t, const double x[], const double u[], double c[],
                           double s[])
{{
{_UNUSED}  switch (k) {{
{cases}    default: break;
  }}
}}

{_like_sample("reset", functions)}
{_like_sample("sharp", functions)}"""


def _like_sample(name: str, functions: Mapping[str, object]) -> str:
    """Return a function that fills `s`, if there is something to be filled in."""
    body = f"  {name}(&t, x, u, c, s);\n" if name in functions else _UNUSED
    return f"""\
void VERSION(model_{name})(double t, const double x[], const double u[], double c[], double s[])
{{
{body}}}
"""


_UNUSED = "  (void)t, (void)x, (void)u, (void)c, (void)s;\n"


def _tables(model: Model) -> str:
    """Return the tables of the header."""
    what, rows = model.happenings, model.lowered.rows
    inside = set(model.continuous)
    owned = [
        [int(block == owner) for block, begin, end in model.jumping for _ in range(begin, end)]
        for owner in model.guards
    ]
    resets = [i for _, begin, end in model.jumping for i in range(begin, end)]
    named = model.of("parameters")
    bounds = [
        "{"
        f"{c_number(b.low)}, {c_number(b.high)}, {int(b.open_below)}, {int(b.open_above)}, "
        f'{int(b.may_change)}, "{comment(v.name)}"' + "}"
        for v in named for b in (v.bounds,)
    ]  # fmt: skip
    stages = len(TSIT5.c)
    a = [_list([*map(c_number, row), *["0.0"] * (stages - len(row))]) for row in TSIT5.a]
    return "\n".join([
        _table("double model_start", map(c_number, model.start)),
        _table("double model_parameters", map(c_number, model.parameters)),
        _table("double model_breaks", (_list(map(c_number, b)) for b in what.breaks), "[2]"),
        _table("double model_series", (_list(f"{n}.0" for n in s) for s in what.series), "[3]"),
        _table("Bounds model_bounds", bounds, empty="{0.0, 0.0, 0, 0, 0, 0}"),
        _table("unsigned model_meetings", map(str, what.meetings)),
        _table("int model_continuous", (str(int(i in inside)) for i in range(rows["x"]))),
        _table("int model_memory", map(str, model.memory)),
        _table("int model_sampled", map(str, model.sampled)),
        _table("int model_reset_states", map(str, resets)),
        _table("int model_sharp_kinds", map(str, model.lowered.sharp)),
        _table("int model_owned", (_list([*map(str, row), "0"]) for row in owned),
               f"[{len(resets) + 1}]"),
        f"const double model_a[STAGES - 1][STAGES] = {{{', '.join(a)}}};",
        f"const double model_nodes[STAGES] = {_list(map(c_number, TSIT5.c))};",
        f"const double model_error[STAGES] = {_list(map(c_number, TSIT5.error))};",
    ])  # fmt: skip


def _list(items: Iterable[str]) -> str:
    return "{" + ", ".join(items) + "}"


def _table(name: str, items: Iterable[str], shape: str = "", empty: str = "") -> str:
    """Return a table, with one entry more: C has no empty ones."""
    every = [*items, empty or ("{0}" if shape else "0")]
    return f"const {name}[{len(every)}]{shape} = {_list(every)};"

"""A loop that a page runs itself: its program, its sliders, and what stands behind its curves."""

import base64
import gzip
import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import control as ct
import numpy as np

from nlctl.diagrams import state_names
from nlctl.export.web import WebProgram, check_linker, handles, web_program
from nlctl.faults.effects import NEVER
from nlctl.plotting.bands import quantile, upper_envelope
from nlctl.response import input_output_response
from nlctl.responses.arguments import state_array
from nlctl.responses.time_response import as_response
from nlctl.upstream.systems import SystemResponse
from nlctl.wording import counted

from ..report.document import Figure, Live, Report, Section
from ..robustness import Prepared, nominal
from ..robustness.stl.formula import And, Band, Formula, Not, Temporal
from ..robustness.stl.spec import Requirement, limits_of_requirements
from ..robustness.uncertainty.space import arguments_of_row
from ..studies.result import Result
from .study.histories import Histories
from .study.loop import loop_of


def with_study_live(
    report: Report,
    result: Result,
    prepared: Prepared,
    histories: Histories | None,
    names: Sequence[str] = (),
) -> Report:
    """Return the report of a study with its nominal loop, which the page runs."""
    # Its sliders are what the study varies, within its box; its limits, bands and requirements
    # those of the study.
    experiment = prepared.experiment
    space = experiment.space
    diagram: Any = loop_of(prepared).diagram
    arguments = arguments_of_row(space, nominal(space))
    response: Any = input_output_response(
        diagram, experiment.timepts, experiment.inputs, arguments["initial_state"],
        params=arguments["params"], rtol=experiment.rtol, atol=experiment.atol,
    )  # fmt: skip
    program = live_program(diagram, response, arguments["params"])
    boxes = [f"{q.name}={q.box[0]!r}:{q.box[1]!r}" for q in space.quantities if not q.is_integer]
    watched = histories.signals if histories else {}  # by the spec; the page draws each in a row
    item = live_item(
        program, response, names or boxes, requirements=experiment.spec.requirements,
        histories=histories, command=_repeated(result, experiment, arguments),
        base=arguments["params"],
        signals=[name for name in watched if name in response.output_labels],
    )  # fmt: skip
    key = report.sections[0].key
    if histories is not None:
        key, runs = "study_fans", len(next(iter(histories.signals.values()), ()))
        shaded = f" Shaded: 90 % of {counted(runs, 'run')} of the study."
        item = replace(item, caption=item.caption + shaded)
    sections = [
        replace(section, items=[*section.items, *([item] if section.key == key else [])])
        for section in report.sections
    ]
    return replace(
        report, sections=sections, numbers={**report.numbers, "live": live_numbers(program)}
    )


def _repeated(result: Result, experiment: Any, given: dict[str, Any]) -> list[str]:
    """Return the words that repeat a run, where a loop can be named without options."""
    study, t = result.study, experiment.timepts
    plain = isinstance(experiment.inputs, float | int) and not experiment.inputs
    if study.options or study.choices or not plain:
        return []
    words = ["nlctl", "simulate", study.loop, "--until", f"{t[-1]:g}", "--step", f"{t[1]:g}"]
    named = given["params"] | {f"{k}(0)": v for k, v in given["initial_state"].items()}
    return words + [w for k, v in named.items() for w in ("--set", f"{k}={float(v)!r}")]


_NODES = 240  # stretches of time of a band
_PIECE = 12000  # bytes of a module: two pieces are closer than gzip looks back
_LARGEST = 1e300  # instead of infinity, which JSON has not


def live_program(
    loop: ct.InputOutputSystem, response: Any, params: Mapping[str, Any]
) -> WebProgram:
    """Return the program of a page that runs a loop as a response was run."""
    check_linker()
    diagram: Any = loop
    if not isinstance(loop, ct.InterconnectedSystem):  # a single block
        labels = {"inputs": loop.input_labels, "outputs": loop.output_labels}
        diagram = ct.interconnect([loop], **labels, name=loop.name)
    u = np.atleast_2d(response.u) if loop.ninputs else 0.0
    return web_program(
        diagram, response.time, u, params=params, initial_state=np.asarray(response.x)[:, 0]
    )


def live_item(
    program: WebProgram,
    response: Any,
    names: Sequence[str],
    *,
    signals: Sequence[str | Sequence[str]] = (),
    requirements: Sequence[Requirement] = (),
    histories: Histories | None = None,
    command: Sequence[str] = (),
    base: Mapping[str, Any] | None = None,
    called: str = "loop",
    origin: str = "as reported",
) -> Live:
    """Return the part of a page that runs a loop.

    `names` are what may be moved, a sensible few by default; `command` repeats the run as it
    stands, else the call of Python with the settings `base` does, of the loop as it is `called`;
    `origin` says in a few words where the run of the page is from.
    """
    moved = handles(
        program.compiled, names, program.p, program.x0, program.u,
        (float(response.time[0]), float(response.time[-1])),
    )  # fmt: skip
    known = program.signals
    limits = {k: v for k, v in limits_of_requirements(requirements).items() if k in known}
    content = {
        "module": _packed([program.module]),
        "facts": program.facts,
        "handles": [
            {k: v for k, v in vars(handle).items() if v not in ("", None)} for handle in moved
        ],
        "never": NEVER,
        "origin": origin,
        "outputs": list(program.outputs),
        "rows": _rows(response, known, signals, limits),
        "limits": {name: [[*line] for line in lines] for name, lines in limits.items()},
        "bands": {} if histories is None else _bands(histories, known),
        "requirements": [
            {"key": r.key, "text": str(r.formula), "meaning": r.meaning, "until": r.until,
             "formula": _formula(r.formula)}
            for r in requirements if set(r.signals) <= set(known)
        ],
        "numbers": live_numbers(program)["outputs"],
        "command": _command(command, program, response, base or {}, called),
    }  # fmt: skip
    what = ", ".join(handle.name for handle in moved)
    return Live(
        key="live",
        caption="This page runs the loop itself: the same equations, by integrators of nlctl. "
        f"Grey: {origin}.",
        description=f"Sliders for {what}.",
        program=content,
    )


def modules_together(items: Sequence[Live], programs: Sequence[WebProgram]) -> list[Live]:
    """Return what runs on one page, with the modules of all in the first of them.

    They have the integrators in common, which are in the page once.
    """
    module = _packed([program.module for program in programs])
    data = module.pop("data")
    where = [{"data": data}] + [{"of": items[0].key}] * (len(items) - 1)
    return [
        replace(item, program={**item.program, "module": {**module, **place, "place": k}})
        for k, (item, place) in enumerate(zip(items, where, strict=True))
    ]


def _packed(modules: Sequence[bytes]) -> dict[str, Any]:
    """Return modules as text: pieces of all in turn, so that what they share is near."""
    pieces = range(0, max(map(len, modules)), _PIECE)
    content = b"".join(module[at : at + _PIECE] for at in pieces for module in modules)
    return {
        "data": base64.b64encode(gzip.compress(content, 9, mtime=0)).decode(),
        "sizes": [*map(len, modules)],
        "piece": _PIECE,
        "place": 0,
    }


def behind_figures(section: Section, item: Live) -> Section:
    """Put what runs behind the last figure of a section."""
    items = [*section.items]
    last = max(k for k, shown in enumerate(items) if isinstance(shown, Figure))
    return replace(section, items=[*items[: last + 1], item, *items[last + 1 :]])


def live_numbers(program: WebProgram) -> dict[str, Any]:
    """Return what ``report.json`` has of a page's reported run: the same numbers."""
    lane = program.run.lanes[0]
    ends = {
        name: [float(y.min()), float(y.max()), float(y[-1])] for name, y in program.signals.items()
    }
    return {
        "program": program.digest,
        "steps": int(lane["accepted"]),
        "rtol": program.facts["rtol"],
        "outputs": ends,
    }


def _rows(
    response: Any,
    known: Mapping[str, np.ndarray],
    signals: Sequence[str | Sequence[str]],
    watched: Collection[str],
) -> list[dict[str, Any]]:
    """Return the rows of the static figure, with the outputs that the page computes.

    What requirements always ask of a signal is seen in a row of its own.
    """
    _, rows = as_response(response, None).rows([*signals] or None)
    apart = [] if signals else [name for name in known if name in watched]
    kept = {name: [name] for name in apart}
    for title, names in rows.items():
        left = [name for name in names if name in known and name not in apart]
        kept |= {title if len(left) == len(names) else ", ".join(left): left} if left else {}
    return [{"title": title, "names": names} for title, names in kept.items()]


def _bands(histories: Histories, known: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Return what 90 % of a study's runs lie in, by signal: times, and both ends."""
    nodes = np.unique(np.linspace(0, histories.time.size - 1, _NODES + 1).astype(int))
    return {
        name: [
            [float(f"{value:.5g}") for value in row]
            for row in (
                histories.time[nodes],
                -upper_envelope(-quantile(samples, 0.05, -np.inf), nodes),
                upper_envelope(quantile(samples, 0.95, np.inf), nodes),
            )
        ]
        for name, samples in histories.signals.items()
        if name in known and np.isfinite(samples).all()
    }


def _formula(formula: Formula) -> list[Any]:
    """Return a formula as JSON can hold it."""
    match formula:
        case Band():
            return ["band", formula.signal, _finite(formula.lower), _finite(formula.upper),
                    formula.scale]  # fmt: skip
        case Not():
            return ["not", _formula(formula.part)]
        case And():
            return ["and", *map(_formula, formula.parts)]
        case Temporal():
            return [formula.word, _formula(formula.part), formula.start, _finite(formula.end)]
    raise TypeError(f"no formula: {formula!r}")


def _finite(value: float) -> float:
    return float(np.clip(value, -_LARGEST, _LARGEST))


def _command(
    words: Sequence[str],
    program: WebProgram,
    response: SystemResponse,
    base: Mapping[str, Any],
    loop: str,
) -> dict[str, Any]:
    """Return what repeats a run: words of a shell, or the settings of a call of Python."""
    if words:
        return {"shell": shlex.join(words)}
    times = np.asarray(response.time)
    ends = [repr(float(end)).removesuffix(".0") for end in (times[0], times[-1])]
    even = np.array_equal(times, np.linspace(times[0], times[-1], times.size))
    usual = state_array(program.compiled.system, None)
    names = state_names(program.compiled.system)
    return {
        "python": loop,
        "times": f"np.linspace({', '.join(ends)}, {times.size})" if even else "t",
        "inputs": [None if np.ptp(row) else float(row[0]) for row in program.u],
        "states": {
            name: float(value)
            for name, value, other in zip(names, program.x0, usual, strict=True)
            if value != other
        },
        "params": {k: v for k, v in base.items() if isinstance(v, float | int)},
    }

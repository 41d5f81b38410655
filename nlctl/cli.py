"""The command line.  It only reads arguments and prints; everything heavy is imported late."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    name="nlctl",
    help="Adaptive neural control of pure-feedback nonlinear systems with python-control.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help='A parameter ("actuator.b_r=0.6") or an initial state ("plant.x1(0)=0.8").',
    ),
]
Example = Annotated[str, typer.Argument(help="example-1 or example-2.")]


@app.command()
def report(
    out: Annotated[Path, typer.Option(help="Folder for the report.")] = Path("reports/paper"),
    jobs: Annotated[int, typer.Option(min=0, help="Processes; 0: one per core.")] = 0,
) -> None:
    """Reproduce both examples of the paper and write OUT/index.html."""
    from analysis.report.paper_report import paper_report
    from analysis.report.render import write_report
    from analysis.reproduction import CASES, checks, run_all

    from ._terminal import check_writable, progress_bar
    from .native._ensemble import cores

    check_writable(out)
    with progress_bar("simulating", len(CASES)) as advance:
        runs = run_all(CASES, jobs=jobs or min(cores(), len(CASES)), done=lambda _: advance(1))
    made = paper_report(runs)
    page = write_report(made, out)
    print(made.verdict)
    print(page)
    if not all(check.passed for check in checks(runs)):
        raise typer.Exit(1)


@app.command()
def simulate(
    example: Example,
    set_: Set = None,
    until: Annotated[float, typer.Option(help="Horizon in s.")] = 20.0,
    step: Annotated[float, typer.Option(help="Sampling interval of the output in s.")] = 0.01,
    plot: Annotated[Path | None, typer.Option(help="Figure to write: .svg, .png, .pdf.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Table of signals to write.")] = None,
) -> None:
    """Simulate an example, with parameters and initial states changed at will."""
    from ._terminal import check_figure, check_writable, progress_bar, show_metrics
    from .response import input_output_response

    diagram = _diagram(example)
    params, initial = _assignments(diagram, set_ or [])
    times = _times(until, step)
    for path in (plot, csv):
        if path is not None:
            check_writable(path.parent)
    if plot is not None:
        check_figure(plot)
    with progress_bar(f"simulating {example}", until) as advance:
        reached = [0.0]

        def progress(t: float) -> None:
            advance(t - reached[0])
            reached[0] = t

        response = input_output_response(
            diagram, times, 0, initial, params=params, progress=progress
        )
    signals = {name: response.y[i] for name, i in diagram.output_index.items()}
    show_metrics(times, signals)
    if csv is not None:
        _write_csv(csv, times, signals)
    if plot is not None:
        from analysis.figures import overview

        _write_figure(plot, overview(times, signals))


@app.command()
def check(
    example: Example,
    set_: Set = None,
    horizon: Annotated[float, typer.Option(help="Length of the runs in s.")] = 20.0,
    ensemble: Annotated[
        int,
        typer.Option(
            min=0, help="Runs from random initial states of the plant, each within SPREAD."
        ),
    ] = 0,
    spread: Annotated[float, typer.Option(help="Largest distance from the initial state.")] = 0.1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the initial states.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Check every assumption and inequality of the paper's proof; exit 1 if one is violated."""
    from analysis.lyapunov import ledger

    from ._errors import ParameterError

    if not 0 < horizon < float("inf"):
        raise ParameterError(f"check needs a horizon > 0, got {horizon:g}")
    diagram = _diagram(example)
    params, start = _assignments(diagram, set_ or [])
    if ensemble:
        start = _random_start(diagram, start, ensemble, spread, seed)
    found = ledger(diagram, horizon, start=start, params=params)
    print(found.to_json() if json else found)
    if not found.holds:
        raise typer.Exit(1)


@app.command("list")
def list_(
    name: Annotated[str | None, typer.Argument(help="Show this block only.")] = None,
) -> None:
    """List the blocks with parameters, units and bounds, and the examples."""
    from ._terminal import show_blocks

    show_blocks(name)


@app.command()
def diagram(
    example: Example,
    out: Annotated[Path, typer.Option("-o", "--out", help="File: .svg, .png, .pdf.")],
    expand: Annotated[bool, typer.Option(help="Show what is inside nested diagrams.")] = False,
) -> None:
    """Draw the block diagram of an example."""
    from ._terminal import check_figure, check_writable
    from .drawing import draw

    check_figure(out)
    check_writable(out.parent)
    _write_figure(out, draw(_diagram(example), expand=expand))


def _diagram(example: str):
    from . import paper
    from ._names import unknown

    examples = {"example-1": paper.example_1, "example-2": paper.example_2}
    if example not in examples:
        raise unknown("example", example, examples)
    return examples[example]()


def _times(until: float, step: float):
    import numpy as np

    from ._errors import ParameterError

    if not (0 < step < until < float("inf")):
        raise ParameterError(f"simulate needs 0 < step < until, got step {step:g}, until {until:g}")
    return np.linspace(0, until, round(until / step) + 1)


def _assignments(diagram, texts: list[str]) -> tuple[dict, dict]:
    """Sort ``NAME=VALUE`` texts into parameters and initial states; names must exist."""
    from ._diagram import parameter_names
    from ._errors import ParameterError
    from ._names import base_name, find_name

    params, initial = {}, {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise ParameterError(f"--set needs NAME=VALUE, got '{text}'")
        if name.endswith("(0)"):
            initial[name.removesuffix("(0)")] = _number(name, value)
        else:
            find_name("parameter", base_name(name), dict.fromkeys(parameter_names(diagram)))
            params[name] = _value(name, value)
    return params, initial


def _random_start(diagram, start: dict, count: int, spread: float, seed: int) -> dict:
    """Draw the plant's initial states, uniformly within `spread` of where it would start."""
    import numpy as np

    from ._diagram import initial_state, state_names

    rng = np.random.default_rng(seed)
    nominal = dict(zip(state_names(diagram), initial_state(diagram, start), strict=True))
    drawn = {
        name: value + spread * rng.uniform(-1, 1, count)
        for name, value in nominal.items()
        if name.startswith("plant.")
    }
    return {k: v for k, v in start.items() if f"plant.{k.rpartition('.')[2]}" not in drawn} | drawn


def _value(name: str, text: str) -> bool | float | tuple[float, ...]:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    if "," in text:
        return tuple(_number(name, part) for part in text.split(","))
    return _number(name, text)


def _number(name: str, text: str) -> float:
    from ._errors import ParameterError

    try:
        return float(text)
    except ValueError:
        raise ParameterError(f"{name} needs a number, got '{text}'") from None


def _write_csv(path: Path, times, signals) -> None:
    import pandas as pd

    from ._files import replace_file

    table = pd.DataFrame({"time": times} | signals)
    replace_file(path, lambda file: table.to_csv(file, index=False))


def _write_figure(path: Path, figure) -> None:
    from ._files import replace_file

    replace_file(path, lambda file: figure.savefig(file, format=path.suffix[1:].lower()))
    print(path)


def main() -> None:
    """Run the command line; what the user can put right ends in one sentence and exit code 2."""
    from ._errors import DivergedError, UsageError

    try:
        app()
    except (UsageError, DivergedError, OSError) as error:
        print(f"nlctl: {error}", file=sys.stderr)
        raise SystemExit(2) from None

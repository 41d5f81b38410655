"""The command line.  It only reads arguments and prints; everything heavy is imported late."""

from __future__ import annotations

import sys
import traceback
from pathlib import Path
from typing import Annotated

import typer

from .cli_report import register as register_reports
from .cli_studies import register as register_studies

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
def simulate(
    example: Example,
    set_: Set = None,
    until: Annotated[float, typer.Option(help="Horizon in s.")] = 20.0,
    step: Annotated[float, typer.Option(help="Sampling interval of the output in s.")] = 0.01,
    plot: Annotated[Path | None, typer.Option(help="Figure to write: .svg, .png, .pdf.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Table of signals to write.")] = None,
) -> None:
    """Simulate an example, with parameters and initial states changed at will."""
    from ._terminal import check_figure, check_writable, progress_bar, show_metrics, write_figure
    from .response import input_output_response

    diagram = _diagram(example)
    params, initial = _assignments(diagram, set_ or [])
    times = _times(until, step)
    if plot is not None:
        check_figure(plot)
    if csv is not None:
        check_writable(csv.parent)
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

        write_figure(plot, overview(times, signals))
        print(plot)


@app.command()
def check(
    example: Example,
    set_: Set = None,
    horizon: Annotated[float, typer.Option(help="Length of the runs in s.")] = 20.0,
    ensemble: Annotated[
        int,
        typer.Option(
            min=0,
            help="Number of runs that start from random initial states of the plant: each state "
            "uniform within SPREAD of its initial value; nothing else is varied. 0: one run.",
        ),
    ] = 0,
    spread: Annotated[float, typer.Option(help="Largest distance of an initial state.")] = 0.1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random initial states.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """Check the assumptions and inequalities of the paper's proof; exit 1 if one is violated.

    Statements that are false only as the paper has them are shown and do not count.
    """
    from rich.console import Console

    from analysis.lyapunov.ledger import ledger

    from ._check import random_start, replay, show_ledger, summary, worst_lines
    from ._errors import ParameterError

    if not 0 < horizon < float("inf"):
        raise ParameterError(f"check needs a horizon > 0, got {horizon:g}")
    diagram = _diagram(example)
    params, start = _assignments(diagram, set_ or [])
    if ensemble:
        start = random_start(diagram, start, ensemble, spread, seed)
    steps = round(20_000 * max(horizon, 10))  # several times what a run that ends well takes
    found = ledger(diagram, horizon, start=start, params=params, max_steps=steps)
    if json:
        print(found.to_json())
    else:
        show_ledger(found, Console())
        print(summary(found))
        for line in worst_lines(found) if ensemble else ():
            print(f"run {line.member}, worst in {line.key}, again (with constants of its own):")
            print(f"  {replay(example, horizon, set_ or [], start, line.member)}")
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
    from ._terminal import check_figure, write_figure
    from .drawing import draw

    check_figure(out)
    write_figure(out, draw(_diagram(example), expand=expand))
    print(out)


def _diagram(example: str):
    from .paper import named_example

    return named_example(example)()


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


register_reports(app)
register_studies(app)


def main() -> None:
    """Run the command line; what the user can put right ends in one sentence and exit code 2.

    What he cannot, an internal error, ends with its trace and exit code 3.
    """
    from ._errors import DivergedError, UsageError

    try:
        app()
    except (UsageError, DivergedError, OSError) as error:
        print(f"nlctl: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    except Exception:
        traceback.print_exc()
        raise SystemExit(3) from None

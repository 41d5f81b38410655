"""The command line.  It only reads arguments and prints; everything heavy is imported late."""

import functools
import shlex
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from nlctl.errors import ParameterError

from .loops import (
    USUAL_HORIZON,
    USUAL_STEP,
    AskedRun,
    assignments,
    given_tolerances,
    named_loop,
    simulated,
)
from .printing import error_line, notify, say
from .report import Atol, Input, Rtol, Set, compare_command, report, write_gallery_of
from .studies import (
    FAILS,
    OPEN,
    exit_codes,
    replay_command,
    run_command,
    schema,
    validate,
    verify_command,
)
from .tune import tune_command

UNPROVED = {"violated": FAILS, "undecided": OPEN}  # exit code by the answer of a ledger

app = typer.Typer(
    name="nlctl",
    help="Adaptive neural control of pure-feedback nonlinear systems with python-control.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

LoopArgument = Annotated[
    str,
    typer.Argument(
        metavar="LOOP",
        help="example-1, example-2, or a loop of your own: path/to/file.py:function or "
        "package.module:function, a function that returns the diagram. Its code is run.",
    ),
]


def _print_version(asked: bool) -> None:
    if asked:
        from nlctl._version import __version__

        print(f"nlctl {__version__}")
        raise typer.Exit


@app.callback()
def version(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Say which.")
    ] = False,
) -> None:
    """Adaptive neural control of pure-feedback nonlinear systems with python-control."""


@app.command()
def simulate(
    loop: LoopArgument,
    set_: Set = None,
    input_: Input = None,
    engine: Annotated[
        str,
        typer.Option(help="native, python-control, or auto: native if it can be compiled."),
    ] = "auto",
    until: Annotated[float, typer.Option(help="Horizon in s.")] = USUAL_HORIZON,
    step: Annotated[float, typer.Option(help="Sampling interval of the output in s.")] = USUAL_STEP,
    rtol: Rtol = None,
    atol: Atol = None,
    plot: Annotated[Path | None, typer.Option(help="Figure to write: .svg, .png, .pdf.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Table of signals to write.")] = None,
) -> None:
    """Simulate a loop, with parameters, initial states and inputs changed at will.

    A table of its signals is printed: peaks, root mean squares, and last values.
    """
    from .terminal import check_figure, check_file, show_metrics, write_figure

    if plot is not None:
        check_figure(plot)
    if csv is not None:
        check_file(csv)
    run = AskedRun(
        loop=loop, settings=set_ or [], inputs=input_ or [], until=until, step=step,
        tolerances=given_tolerances(rtol, atol),
    )  # fmt: skip
    response = simulated(run, engine).response
    times = response.time
    signals = dict(zip(response.output_labels, response.y, strict=True))
    show_metrics(times, signals)
    if response.statistics is not None and response.statistics.slides:
        notify(f"it slides along {response.statistics.along}")
        if response.statistics.forks:
            notify(response.statistics.ways)
    if small := response.small_outputs():
        notify(small)
    if csv is not None:
        _write_csv(csv, times, signals)
        print(csv)
    if plot is not None:
        from nlctl.plotting.signals import rows_figure

        figure, _ = rows_figure(times, *response.rows())
        write_figure(plot, figure)
        print(plot)


@app.command()
def check(
    loop: LoopArgument,
    set_: Set = None,
    horizon: Annotated[
        float, typer.Option("--until", "--horizon", help="Horizon of the runs in s.")
    ] = 20.0,
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
    engine: Annotated[
        str,
        typer.Option(
            help="python-control: runs of python-control, which machine code, of which the proof "
            "takes more signals, must reproduce; where a loop diverges it may not end. native, "
            "auto: machine code alone."
        ),
    ] = "auto",
    k: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="K_1 K_2",
            help="Bounds that the actuator's gain k of (2) shall have, 0 < K_1 <= K_2; by default "
            "those that the actuator knows.",
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """Check the assumptions and inequalities of the paper's proof, line by line.

    Exit codes: 0 every line holds, 1 a line is violated, 5 none is violated, but not all are
    decided. Statements that are false only as the paper has them are shown and do not count.
    """
    from rich.console import Console

    from nlctl.arguments import one_of
    from nlctl.response import ENGINES

    from ..lyapunov.ledger import ledger
    from .check import (
        interpreted_runs,
        ledger_summary,
        random_start,
        repeat_command,
        show_ledger,
        worst_lines,
    )

    if not 0 < horizon < float("inf"):
        raise ParameterError(f"check needs a horizon > 0, got {horizon:g}")
    one_of("check", "--engine", engine, ENGINES)
    diagram = named_loop(loop)
    params, start = assignments(diagram, set_ or [])
    if ensemble:
        start = random_start(diagram, start, ensemble, spread, seed)
    steps = round(20_000 * max(horizon, 10))  # several times what a run that ends well takes
    settings = {"start": start, "params": params}
    run: Any = horizon
    if engine == "python-control":
        run, settings = interpreted_runs(diagram, horizon, start, params), {}
    lines = ledger(diagram, run, **settings, k=k, max_steps=steps)
    if json:
        print(lines.to_json())
    else:
        show_ledger(lines, Console())
        print(ledger_summary(lines))
        for line in worst_lines(lines) if ensemble else ():
            print(f"run {line.member}, worst in {line.key}, again (with constants of its own):")
            print(f"  {repeat_command(loop, horizon, set_ or [], start, line.member, engine, k)}")
    if lines.answer in UNPROVED:
        raise typer.Exit(UNPROVED[lines.answer])


@app.command()
def new(
    folder: Annotated[Path, typer.Argument(metavar="NAME", help="Name of a new folder.")],
) -> None:
    """Write a loop, a study of it and a test into a new folder; they run as they are."""
    from .starting import start_project

    paths = start_project(folder)
    for path in paths:
        say(path)
    loop, study, test = (shlex.quote(path.as_posix()) for path in paths)
    say(f"nlctl simulate {loop}:make --plot {shlex.quote(folder.as_posix())}/run.svg")
    say(f"nlctl report {loop}:make    # its page")
    say(f"nlctl report {study}    # the study, and its page")
    say(f"pytest {test}")


@app.command("list")
def list_(
    name: Annotated[
        str | None,
        typer.Argument(
            help="A block, whose parameters are shown; controllers: which one is for which plant; "
            "kinds: the kinds of analysis of a study, or one of them; path/to/file.py:NAME: a "
            "block or a kind of your own, whose code is run."
        ),
    ] = None,
) -> None:
    """List the blocks in groups, and the examples; with NAME, its parameters, units and bounds."""
    from .listing import show, show_all

    show_all() if name is None else show(name)


@app.command()
def export(
    loop: LoopArgument,
    block: Annotated[
        str | None,
        typer.Option(help="A controller of the loop; by default all equations of the loop."),
    ] = None,
    target: Annotated[
        str,
        typer.Option(help="c: C99; or LLVM's name of a machine, such as thumbv7em-none-eabihf."),
    ] = "c",
    dt: Annotated[
        float | None, typer.Option(help="Sampling time in s of a block that is not sampled.")
    ] = None,
    method: Annotated[
        str | None, typer.Option(help="How it becomes one in discrete time: euler, ...")
    ] = None,
    set_: Set = None,
    name: Annotated[
        str | None, typer.Option(help="In front of all names in C; by default the block's.")
    ] = None,
    as_fmu: Annotated[
        bool, typer.Option("--fmu", help="The whole loop as an FMU, which other simulators run.")
    ] = False,
    version: Annotated[int, typer.Option(help="Of FMI: 2 or 3.")] = 3,
    stop_time: Annotated[
        float, typer.Option(help="End of the FMU's default experiment in s.")
    ] = 10.0,
    out: Annotated[
        Path, typer.Option("-o", "--out", help="Folder of the files; of --fmu the file itself.")
    ] = Path("."),
) -> None:
    """Write a controller as C99 or object code: the program that the simulation runs.

    Without --block all equations of the loop are written, for an integrator of your own; with
    --fmu the loop, with its events, as a model for other simulators.
    """
    from .exporting import write_export, write_fmu

    if as_fmu:
        chosen = {"--block": block, "--dt": dt, "--method": method}
        say(
            write_fmu(
                loop, chosen, target, settings=set_ or [], name=name, version=version,
                stop_time=stop_time, out=out,
            )
        )  # fmt: skip
        return
    files = write_export(
        loop, block, target, dt=dt, method=method, settings=set_ or [], name=name, out=out
    )
    for path in files:
        say(path)


@app.command()
def diagram(
    loop: LoopArgument,
    out: Annotated[Path, typer.Option("-o", "--out", help="File: .svg, .png, .pdf.")],
    expand: Annotated[bool, typer.Option(help="Show what is inside nested diagrams.")] = False,
) -> None:
    """Draw the block diagram of a loop."""
    from nlctl.drawing.picture import draw

    from .terminal import check_figure, write_figure

    check_figure(out)
    write_figure(out, draw(named_loop(loop), expand=expand))
    print(out)


def _write_csv(path: Path, times, signals) -> None:
    import pandas as pd

    from nlctl.host.files import replace_file

    table = pd.DataFrame({"time": times} | signals)
    replace_file(path, lambda file: table.to_csv(file, index=False))


for name, command in {
    "report": report, "compare": compare_command, "gallery": write_gallery_of, "run": run_command,
    "validate": validate, "replay": replay_command, "verify": verify_command, "schema": schema,
    "tune": tune_command,
}.items():  # fmt: skip
    app.command(name)(command)


def _say_warnings() -> None:
    """Print warnings of nlctl as sentences; others stay as Python has them."""
    usual = warnings.showwarning

    def shown(message: Any, category: Any, *place: Any, **more: object) -> None:
        if category.__module__.partition(".")[0] == "nlctl":
            error_line(f"nlctl: {message}")
        else:
            usual(message, category, *place, **more)

    warnings.showwarning = shown


@functools.cache
def _command() -> Any:
    """Return what the commands are to Typer; in a process of many calls they are read once."""
    return typer.main.get_command(app)


def main() -> None:
    """Run the command line; what the user can put right ends in one sentence and exit code 2."""
    # An error in a function of the user's, or an internal one, ends with its trace and exit code 3.
    _say_warnings()
    try:
        with exit_codes(json=False):
            _command()()
    except typer.Exit as ended:
        raise SystemExit(ended.exit_code) from None

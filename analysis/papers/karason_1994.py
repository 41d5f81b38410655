"""Karason and Annaswamy 1994, its scalar example: what a program for it shows, and what holds."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure as MatplotlibFigure

from nlctl.papers import karason_1994 as printed

from ..report.document import Equation, Paragraph
from ..reproductions.figures import rows_over_time
from ..reproductions.paper import (
    Paper,
    PaperCase,
    PaperFigure,
    PaperRun,
    PaperRuns,
    PaperSource,
    Part,
    Statement,
)

_TIMES = np.linspace(0, 20, 8001)
_THETA, K = -2.0, 1.0  # the gains of the matching conditions
_SMALL = 0.25


def _case(key: str, learns_from: str, amplitude: float) -> PaperCase:
    make = partial(printed.example_1, learns_from=learns_from, amplitude=amplitude)
    return PaperCase(
        key=key, make=make, times=_TIMES, start=printed.INITIAL_STATE, rtol=1e-10, atol=1e-12
    )


_CASES = (
    _case("with", "controllable", 5.0),
    _case("without", "all", 5.0),
    _case("with, sin", "controllable", 1.0),
    _case("without, sin", "all", 1.0),
)
_COMMANDS = {"5 sin 0.5t": ("", 5.0), "sin 0.5t": (", sin", 1.0)}  # suffix of the keys, amplitude


def last_saturated(run: PaperRun) -> float:
    """Return until when |u| is at its limit (s)."""
    at_limit = np.abs(run["u"]) >= 10 - 1e-9
    return float(run.time[at_limit][-1])


def first_zero(run: PaperRun) -> float:
    """Return when the error first comes to 0 behind its largest value (s)."""
    e = run["e"]
    peak = int(np.argmax(np.abs(e)))
    behind = np.nonzero(np.sign(e[peak:]) != np.sign(e[peak]))[0]
    return float(run.time[peak + behind[0]]) if behind.size else float("nan")


def late_error(run: PaperRun, start: float) -> float:
    """Return max |e| from a time on."""
    return float(np.abs(run["e"][run.time >= start]).max())


def gains(run: PaperRun) -> tuple[np.ndarray, np.ndarray]:
    """Return theta and k."""
    theta, k = (-run[f"controller.weights.W_hat[{i}]"] for i in (0, 1))
    return theta, k


def imbalance(run: PaperRun) -> float:
    """Return how far V(20) - V(0) is from the integral of a_m e_u^2, of V(0)."""
    theta, k = gains(run)
    beta = run["controller.error.beta_hat"]
    V = (run["r"] ** 2 + ((theta - _THETA) ** 2 + (k - K) ** 2) / 0.1 + (beta - 1) ** 2) / 2
    lost = np.trapezoid(run["r"] ** 2, run.time)
    return float(abs(V[-1] - V[0] + lost) / V[0])


def _with_correction(command: str, suffix: str) -> list[Statement]:
    say = partial(
        Statement, part="example-1", case=f"controllable error, {command}", read="post",
        claim="Does it handle the saturation, and track once that is over?",
    )  # fmt: skip
    return [
        say(
            quantity="saturated until (s)", printed="6", tolerance=0.5,
            value=lambda runs: last_saturated(runs[f"with{suffix}"]),
        ),
        say(
            quantity="max |e| for t ≥ 10 s", printed=f"{_SMALL:g}", relation="≤",
            value=lambda runs: late_error(runs[f"with{suffix}"], 10.0),
        ),
    ]  # fmt: skip


def _without_correction(command: str, suffix: str, amplitude: float) -> list[Statement]:
    say = partial(
        Statement, part="example-1", case=f"all of the error, {command}", read="post"
    )  # fmt: skip
    of_program = amplitude == 5.0
    return [
        say(
            claim=f"Without the correction and with r = {command}: is the error nonzero until "
            "around seven seconds?",
            quantity="the error comes to 0 at (s)", printed="7", tolerance=0.5,
            value=lambda runs: first_zero(runs[f"without{suffix}"]),
            by="the post with its program's command" if of_program else "",
        ),
        say(
            claim="Without the correction, does it never really track?",
            quantity="max |e| for t ≥ 15 s, of the amplitude", printed="0.25", relation="≥",
            value=lambda runs: late_error(runs[f"without{suffix}"], 15.0) / amplitude,
        ),
    ]  # fmt: skip


def _statements() -> list[Statement]:
    """Return the statements on the runs, and what follows from them."""
    say = partial(Statement, part="example-1", case="controllable error, 5 sin 0.5t")
    return [
        *(line for c, (suffix, _) in _COMMANDS.items() for line in _with_correction(c, suffix)),
        *(line for c, command in _COMMANDS.items() for line in _without_correction(c, *command)),
        say(
            claim="Does V fall by the integral of the controllable error squared?", read="post",
            quantity="imbalance of V, of V(0)", printed="0", tolerance=1e-5,
            value=lambda runs: imbalance(runs["with"]),
        ),
        say(
            claim="Does the plant stay where an input of at most 10 can hold it, |x| < 10?",
            quantity="max |x|", printed="10", relation="≤",
            value=lambda runs: float(np.abs(runs["with"]["x1"]).max()),
        ),
        say(
            claim="Is the input never beyond its limit?", quantity="max |u|", read="program",
            printed="10", tolerance=1e-12,
            value=lambda runs: float(np.abs(runs["with"]["u"]).max()),
        ),
    ]  # fmt: skip


def _states_and_inputs(runs: PaperRuns) -> MatplotlibFigure:
    """Plant and model, and the input, with and without the correction."""
    corrected, other = runs["with"], runs["without"]
    t = corrected.time
    return rows_over_time(
        {
            "state": {
                "model": (t, corrected["xm1"]),
                "plant": (t, corrected["x1"]),
                "plant, learns from all": (t, other["x1"]),
            },
            "$u$": {"plant's": (t, corrected["u"]), "learns from all": (t, other["u"])},
        }
    )


def _errors(runs: PaperRuns) -> MatplotlibFigure:
    """The error, and its part that the gains learn from."""
    run = runs["with"]
    t = run.time
    deficit = run["e"] - run["r"]
    return rows_over_time(
        {"error": {"$e$": (t, run["e"]), "$e_u$": (t, run["r"]), r"$e_\Delta$": (t, deficit)}}
    )


def _estimates(runs: PaperRuns) -> MatplotlibFigure:
    """The gains of both laws."""
    rows = {}
    for name, place in ((r"$\theta$", 0), ("$k$", 1)):
        values = {key: gains(runs[key])[place] for key in ("with", "without")}
        rows[name] = {
            "controllable error": (_TIMES, values["with"]),
            "all of the error": (_TIMES, values["without"]),
        }
    return rows_over_time(rows)


_MODEL = (
    Paragraph(text="Plant, reference model, and a law whose output is limited:"),
    Equation(
        latex=r"\dot x_p = x_p + u,\quad \dot x_m = -x_m + r,\quad u_c = \theta x_p + k r,\quad"
        r" u = \min(\max(u_c, -10), 10),\quad \Delta u = u - u_c"
    ),
    Paragraph(text="The part of the error that the limit causes, and what is left to learn from:"),
    Equation(
        latex=r"\dot e_\Delta = -e_\Delta + \beta_\Delta \Delta u,\quad"
        r" e_u = x_p - x_m - e_\Delta"
    ),
    Equation(
        latex=r"\dot\theta = -\gamma_1 e_u x_p,\quad \dot k = -\gamma_2 e_u r,\quad"
        r" \dot\beta_\Delta = \gamma_3 e_u \Delta u,\quad \dot V = -e_u^2"
    ),
    Equation(
        latex=r"V = \frac{1}{2} e_u^2 + \frac{1}{2 \gamma_1} (\theta + 2)^2"
        r" + \frac{1}{2 \gamma_2} (k - 1)^2 + \frac{1}{2 \gamma_3} (\beta_\Delta - 1)^2"
    ),
)

REPRODUCTION = Paper(
    key="karason_1994",
    title="Adaptive control with a constrained input, reproduced",
    question="does an unstable plant at the edge of what its input can hold track in the end?",
    citation=(
        "S. P. Karason, A. M. Annaswamy: Adaptive control in the presence of input constraints. "
        "IEEE Transactions on Automatic Control 39(11), 1994, pp. 2325–2330. doi 10.1109/9.333787."
    ),
    model=_MODEL,
    parts=(
        Part(
            key="example-1",
            title="The scalar example",
            make=printed.example_1,
            blocks=("plant", "controller.law", "controller.error", "controller.weights"),
            picture="The loop as simulated, and the inside of its controller.",
            figures=(
                PaperFigure(
                    key="example-1-states", draw=_states_and_inputs,
                    caption="Plant and model, and the input, with and without the correction.",
                ),
                PaperFigure(
                    key="example-1-errors", draw=_errors,
                    caption="The error, the part to learn from, and the part due to the limit.",
                ),
                PaperFigure(
                    key="example-1-gains", draw=_estimates, folded=True,
                    caption="Gains: with the correction they stay near −2 and 1.",
                ),
            ),
            more="The gains over time",
            parameters=(
                ("a_p, b_p", "1, 1", "1, 1", "program; the article's could not be read"),
                ("a_m, b_m", "−1, 1", "{model.a[0]:g}, {model.b:g}", "here s + a_1: a = 1"),
                ("u_max", "10", "{law.u_max:g}", "post and program"),
                ("γ₁, γ₂", "0.1, 0.1", "{weights.Gamma:g}, {weights.Gamma:g}",
                 "chosen by the program: not given in the article"),
                ("γ₃", "1", "{error.gamma_d:g}", "chosen by the program, too"),
                ("r", "sin 0.5t, and 5 sin 0.5t", "{command.amplitudes[0]:g} sin 0.5t",
                 "the post prints the first, its program has the second"),
                ("x_p(0), x_m(0)", "−9.99, −9.9", "{plant.initial[x1]:g}, −9.9", "program"),
                ("θ(0), k(0)", "−2.2, 1.1", "−2.2, 1.1", "program; matching: −2 and 1"),
            ),
        ),
    ),
    cases=_CASES,
    statements=tuple(_statements()),
    reproduced="both runs of its scalar example, and the balance of its Lyapunov function",
    not_reproduced=(
        "what the post says of seven seconds, with its program's command; the article's own gains "
        "and figures, which are not given or could not be read; its local theorem."
    ),
    sources=(
        PaperSource(
            key="post",
            text="D. P. Wiese: Adaptive control in the presence of input constraints, 2020-12-12 "
            "(repository dpwiese/personal-website): equations, the Lyapunov function, and what is "
            "seen in two runs that were made to be similar to those of the article.",
        ),
        PaperSource(
            key="program",
            text="The program of that post (repository dpwiese/control-examples, "
            "saturation-protection): all values.",
        ),
    ),
    open_points=(
        "The article itself could not be read. The post says that it does not give the gains γ: "
        "those here are the program's, chosen so that runs look as in the article.",
        "The post prints the command as sin 0.5t, its program has 5 sin 0.5t. Both saturate for "
        "the same time. Without the correction the error comes to 0 at 7.3 s with the first and at "
        "7.8 s with the second: its words fit the command that it prints. Which one the article "
        "has is not known; the program's is used.",
        "“Near zero by about ten seconds” and “never really track” name no bound: those here are "
        "0.25, and a quarter of the command's amplitude.",
        "The bounds within which the article proves local stability were not found, and are not "
        "checked.",
    ),
    methods=(
        "The loop is connected from the blocks of nlctl: its reference model, the constrained law "
        "and the constrained error. A test compares it with one function in the post's symbols.",
    ),
    limits=(
        "Two runs from one start. Beyond |x| = 10 no input of at most 10 brings the plant back, "
        "whatever the law.",
    ),
    lead=PaperFigure(
        key="lead", draw=_states_and_inputs,
        caption="The plant comes back from the edge, and follows its model.",
    ),
)  # fmt: skip
